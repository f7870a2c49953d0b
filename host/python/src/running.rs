//! A mapper with its memory, and what it is made of until its pictures' size is known.

use super::blocks::{Blocks, BlocksChoice};
use super::error::{raise, refuse};
use super::examined::Examined;
use super::rig::Rig;
use dynvox::Request;
use dynvox::request::MapperPlan;
use dynvox::run::{RunError, Threads, step_reason};
use dynvox::slab::HostSlab;
use dynvox_core::inertial::InertialUnit;
use dynvox_core::objects::NoSink;
use dynvox_core::{Mapper, Report, StereoFrame};
use pyo3::PyResult;
use self_cell::{MutBorrow, self_cell};
use std::io::Read;
use std::time::{Duration, Instant};

self_cell!(
    /// A mapper and the slab it lives in.
    pub struct SlabMapper {
        owner: MutBorrow<HostSlab>,
        #[not_covariant]
        dependent: Mapper,
    }
);

/// First bytes of a snapshot. Then follow, of 8 bytes each, width and height of the mapped pictures
/// and the length of the core's snapshot; then the core's snapshot, and the file of evicted blocks.
const MAGIC: [u8; 8] = *b"DVXPYTHN";
const HEAD: usize = 32;

/// A mapper that has its memory.
pub struct Running {
    pub plan: MapperPlan,
    pub mapper: SlabMapper,
    pub threads: Threads,
    pub blocks: Blocks,
    /// Report of the last step.
    pub report: Option<Report>,
    /// Wall time of the core's part of it.
    pub step_time: Option<Duration>,
    /// Width and height of the pictures its memory was divided for, px.
    size: (usize, usize),
    /// Number of the next frame.
    next_frame: u32,
}

/// Everything a mapper is made of once its pictures' size is known.
pub struct Recipe {
    pub rig: Rig,
    /// Request that the mapper was made of.
    pub request: Request,
    pub interval_s: Option<f64>,
    /// Plan of a data set's run, if it is made already.
    pub plan: Option<MapperPlan>,
    /// Inertial unit of a mapper without a data set.
    pub inertial: Option<InertialUnit>,
    pub blocks: BlocksChoice,
}

/// A mapper, or what it will be made of.
pub struct State {
    pub recipe: Recipe,
    pub running: Option<Running>,
    /// Examination of the first pairs.
    pub examined: Examined,
    /// True after `Mapper.close`.
    pub is_closed: bool,
}

/// A snapshot, taken apart.
struct Snapshot<'a> {
    size: (usize, usize),
    core: &'a [u8],
    blocks: &'a [u8],
}

impl<'a> Snapshot<'a> {
    fn parse(bytes: &'a [u8]) -> Option<Self> {
        let (head, rest) = bytes.split_at_checked(HEAD)?;
        let (magic, numbers) = head.split_at_checked(MAGIC.len())?;
        let mut numbers = numbers
            .chunks_exact(8)
            .map(|number| usize::try_from(u64::from_le_bytes(number.try_into().ok()?)).ok());
        let mut number = || numbers.next().flatten();
        let (size, core) = ((number()?, number()?), number()?);
        let (core, blocks) = rest.split_at_checked(core)?;
        (magic == MAGIC).then_some(Self { size, core, blocks })
    }
}

impl Running {
    /// Maps the slab and makes the mapper in it.
    fn begin(plan: MapperPlan, size: (usize, usize), blocks: &mut BlocksChoice) -> PyResult<Self> {
        let slab = slab_of(&plan)?;
        let mapper = SlabMapper::try_new(slab, |slab| {
            Mapper::new(&plan.capacity, &plan.config, slab.borrow_mut().bytes_mut())
                .map_err(|error| raise(anyhow::anyhow!("{error}")))
        })?;
        Ok(Self {
            blocks: Blocks::begin(blocks, &plan.config, &[])?,
            threads: Threads::new(plan.threads).map_err(raise)?,
            mapper,
            plan,
            report: None,
            step_time: None,
            size,
            next_frame: 0,
        })
    }

    /// Restores the mapper to its state when the snapshot was taken.
    fn restore(
        plan: MapperPlan,
        snapshot: &Snapshot<'_>,
        blocks: &mut BlocksChoice,
    ) -> PyResult<Self> {
        let slab = slab_of(&plan)?;
        let mut source = snapshot.core;
        let mapper = SlabMapper::try_new(slab, |slab| {
            let mut read = |piece: &mut [u8]| source.read_exact(piece);
            Mapper::restore(&plan.capacity, &plan.config, slab.borrow_mut().bytes_mut(), &mut read)
                .map_err(|error| {
                    refuse(format!(
                        "{error}. Restore it with the rig, the bounds and \
                    the settings it was made with"
                    ))
                })
        })?;
        Ok(Self {
            blocks: Blocks::begin(blocks, &plan.config, snapshot.blocks)?,
            threads: Threads::new(plan.threads).map_err(raise)?,
            mapper,
            plan,
            report: None,
            step_time: None,
            size: snapshot.size,
            next_frame: 0,
        })
    }

    /// Maps a frame.
    fn step(&mut self, frame: &StereoFrame<'_>) -> PyResult<Report> {
        let Self { mapper, threads, blocks, .. } = self;
        let began = Instant::now();
        let stepped = mapper.with_dependent_mut(|_, mapper| {
            threads.run(|| mapper.step_with(frame, threads, blocks, &mut NoSink))
        });
        let report = stepped.map_err(|error| {
            refuse(format!("frame {} was refused: {}", self.next_frame, step_reason(error)))
        })?;
        self.step_time = Some(began.elapsed());
        self.next_frame = report.frame + 1;
        self.report = Some(report);
        Ok(report)
    }

    /// Everything that later steps depend on.
    pub fn snapshot(&mut self) -> PyResult<Vec<u8>> {
        let mut bytes = MAGIC.to_vec();
        bytes.resize(HEAD, 0);
        let write = &mut |piece: &[u8]| {
            bytes.extend_from_slice(piece);
            Ok::<(), std::convert::Infallible>(())
        };
        let Ok(()) = self.mapper.with_dependent_mut(|_, mapper| mapper.save(write));
        let numbers = [self.size.0, self.size.1, bytes.len() - HEAD];
        for (field, number) in bytes[MAGIC.len()..HEAD].chunks_exact_mut(8).zip(numbers) {
            field.copy_from_slice(&(number as u64).to_le_bytes());
        }
        let blocks = self.blocks.bytes();
        bytes.extend(blocks.map_err(|error| {
            refuse(format!("evicted blocks cannot be read back: {error}. Check the disk"))
        })?);
        Ok(bytes)
    }
}

/// The memory of a mapper.
fn slab_of(plan: &MapperPlan) -> PyResult<MutBorrow<HostSlab>> {
    let bytes = plan.capacity.bytes();
    let no_memory = || raise(RunError::NoMemory { bytes, profile: plan.profile.clone() });
    HostSlab::map(bytes).map(MutBorrow::new).ok_or_else(no_memory)
}

impl State {
    /// The mapper, made for pictures of a size unless it is there.
    pub fn running_for(&mut self, size: (usize, usize)) -> PyResult<&mut Running> {
        self.check_open()?;
        match self.running {
            Some(ref mut running) => Ok(running),
            None => {
                let running =
                    Running::begin(self.recipe.plan_for(size)?, size, &mut self.recipe.blocks)?;
                Ok(self.running.insert(running))
            }
        }
    }

    /// Maps a frame of pictures of a size.
    pub fn step(&mut self, size: (usize, usize), frame: &StereoFrame<'_>) -> PyResult<Report> {
        self.check_open()?;
        self.examined.take(&self.recipe.rig, frame)?;
        let is_first = self.running.is_none();
        let stepped = self.running_for(size)?.step(frame);
        // A pair that is refused does not decide on the size.
        if is_first && stepped.is_err() {
            self.running = None;
        }
        stepped
    }

    /// The mapper.
    pub fn running(&mut self) -> PyResult<&mut Running> {
        self.check_open()?;
        let absent = || {
            refuse(
                "the mapper has no picture yet, and so no size. Give it one with step, or its size \
                 with image=(width, height)",
            )
        };
        self.running.as_mut().ok_or_else(absent)
    }

    fn check_open(&self) -> PyResult<()> {
        if self.is_closed {
            return Err(refuse("the mapper is closed. Make another one"));
        }
        Ok(())
    }

    /// Puts a snapshot instead of the mapper. After an error the mapper is gone, and as it was
    /// made.
    pub fn restore(&mut self, bytes: &[u8]) -> PyResult<()> {
        self.check_open()?;
        let foreign = || {
            refuse(
                "the bytes are not a snapshot of a mapper of Python. Pass those that \
                 Mapper.snapshot() returned",
            )
        };
        let snapshot = Snapshot::parse(bytes).ok_or_else(foreign)?;
        let plan = self.recipe.plan_for(snapshot.size)?;
        // Its file of evicted blocks is in the way otherwise, and two slabs are more than one.
        self.running = None;
        self.running = Some(Running::restore(plan, &snapshot, &mut self.recipe.blocks)?);
        Ok(())
    }
}

impl Recipe {
    fn plan_for(&self, size: (usize, usize)) -> PyResult<MapperPlan> {
        match &self.plan {
            Some(plan) => Ok(plan.clone()),
            None => {
                let fitted = self.rig.fitted(size);
                let mut plan = self.request.mapper(&fitted, self.interval_s).map_err(raise)?;
                plan.config.inertial = self.inertial;
                Ok(plan)
            }
        }
    }
}
