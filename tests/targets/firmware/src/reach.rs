//! Calls that the fixture does not make: every other way into the core, so that the proofs see it,
//! and its bits are compared from machine to machine as well.

use crate::{fixture, onboard};
use core::hint::black_box;
use dynvox_clip::{Clip, Frame};
use dynvox_core::{
    Capacity, Mapper, Serial,
    digest::Digest,
    image::View,
    memory::Slabs,
    objects::{ObjectSink, RetiredObject},
    planning::RobotCylinder,
    view::Raycaster,
    volume::{BlockStore, EvictedBlock, LoadedBlock, ObservationWeight},
};

/// Frames taken.
const FRAMES: usize = 6;
/// So few blocks that some must leave, with colour and a window for planners.
const CAPACITY: Capacity = Capacity {
    blocks: 600,
    visible_blocks: 600,
    planning_width: 40,
    planning_length: 60,
    planning_height: 12,
    planning_distance_3d: true,
    colour: true,
    ..fixture::CAPACITY
};
/// Bytes of slab for the fixture and for this.
pub const SLAB_BYTES: usize = if CAPACITY.bytes() > fixture::CAPACITY.bytes() {
    CAPACITY.bytes()
} else {
    fixture::CAPACITY.bytes()
};
const PIXELS: usize = CAPACITY.pixels();
/// Columns of the planners' window.
pub const COLUMNS: usize = CAPACITY.planning_width * CAPACITY.planning_length;

static COLOUR: [[u8; 3]; PIXELS] = [[200, 100, 50]; PIXELS];
static DISPARITY_Q8: [u16; PIXELS] = [20 << 8; PIXELS];

/// Digest of what leaves.
struct Leaving(Digest);

impl BlockStore for Leaving {
    fn store(&mut self, block: EvictedBlock<'_>) -> bool {
        self.0.i16s(block.sdf);
        self.0.bytes(block.weight);
        block.colour.into_iter().flatten().for_each(|plane| self.0.bytes(plane));
        true
    }

    fn load(&mut self, _: LoadedBlock<'_>) -> bool {
        false
    }
}

impl ObjectSink for Leaving {
    fn retire(&mut self, object: RetiredObject<'_, '_>) {
        self.0.u64(u64::from(object.summary.frames));
        self.0.u64(object.volume.digest());
    }
}

/// Goes every way; 0 where one is closed. What the compiler must not know is hidden from it.
#[inline(never)]
pub fn digest(clip: &Clip<'_>, slab: &mut [u8]) -> u64 {
    // In its slot from the first: the mapper is never twice on the stack.
    let mut slot = None;
    make(&mut slot, slab);
    let Some(mapper) = slot.as_mut() else { return 0 };
    let mut leaving = [Leaving(Digest::default()), Leaving(Digest::default())];
    let mut digest = Digest::default();
    if !step(mapper, clip, &mut leaving, &mut digest) {
        return 0;
    }
    inspect(mapper, &mut digest);
    finish(mapper, &mut leaving, &mut digest);
    leaving.iter().for_each(|leaving| digest.u64(leaving.0.finish()));
    digest.finish()
}

/// Ends the run: what is left goes to the stores.
// Never inlined: its reports must not lie below the steps.
#[inline(never)]
fn finish(mapper: &mut Mapper<'_>, [blocks, objects]: &mut [Leaving; 2], digest: &mut Digest) {
    digest.u64(u64::from(mapper.finish_with(objects).visited));
    digest.u64(u64::from(mapper.stream_out(blocks).stored));
}

/// Makes the mapper; the slot stays empty where that fails.
// Never inlined: its settings must not lie below what comes later.
#[inline(never)]
fn make<'s>(slot: &mut Option<Mapper<'s>>, slab: &'s mut [u8]) {
    let mut config = fixture::CONFIG;
    config.volume.observation_weight = black_box(ObservationWeight::Depth);
    config.stereo.median = black_box(true);
    // What fails shows in the slot.
    let _ = Mapper::new_into(slot, black_box(&CAPACITY), black_box(&config), Slabs::One(slab));
}

/// Takes the frames; false where one is not taken.
// Never inlined: reports must not lie below what the map shows.
#[inline(never)]
fn step(
    mapper: &mut Mapper<'_>,
    clip: &Clip<'_>,
    [blocks, objects]: &mut [Leaving; 2],
    digest: &mut Digest,
) -> bool {
    let [width, height] = clip.size();
    for (index, frame) in clip.frames().enumerate().take(FRAMES) {
        let Frame::Pair(pair) = frame else { return false };
        let mut frame = pair.stereo();
        if index >= FRAMES / 2 {
            frame.colour = View::new(&COLOUR, width, height);
            frame.class = Some(frame.left);
            frame.t_world_camera = Some(*mapper.t_world_camera());
        }
        if index == FRAMES - 1 {
            frame.disparity_q8 = View::new(&DISPARITY_Q8, width, height);
        }
        // By reference: a report is some kilobytes.
        let taken = mapper.step_with(black_box(&frame), &Serial, blocks, objects);
        let Ok(report) = &taken else { return false };
        digest.u64(report.digest);
        digest.u64(report.severity() as u64);
    }
    true
}

/// All that the map shows.
// Never inlined, here and below: what it needs of the stack must not stay below the steps, nor what
// one part needs below another.
#[inline(never)]
fn inspect(mapper: &mut Mapper<'_>, digest: &mut Digest) {
    views(mapper, digest);
    plan(mapper, digest);
    onboard::messages(mapper, digest);
    onboard::columns(mapper, digest);
    surfaces(mapper, digest);
}

/// The map as cameras see it.
#[inline(never)]
fn views(mapper: &mut Mapper<'_>, digest: &mut Digest) {
    let pose = *mapper.t_world_camera();
    let mut hash_view = |seen: Option<&Raycaster<'_>>| {
        let depth_m =
            seen.and_then(Raycaster::depth_m).into_iter().flat_map(|image| image.rows()).flatten();
        depth_m.for_each(|&depth_m| digest.f64(f64::from(depth_m)));
        let normals =
            seen.and_then(Raycaster::normal).into_iter().flat_map(|image| image.rows()).flatten();
        normals.for_each(|normal| digest.bytes(&normal.map(|x| x as u8)));
    };
    hash_view(mapper.raycast(&pose, &Serial).ok());
    hash_view(mapper.raycast_composed(&pose, &Serial).ok());
    hash_view(mapper.raycast_object(black_box(1), &pose, &Serial).ok());
}

/// The map's triangles, and what is tracked.
#[inline(never)]
fn surfaces(mapper: &mut Mapper<'_>, digest: &mut Digest) {
    let triangles = mapper.triangles(&mut |triangle| {
        triangle
            .vertices
            .iter()
            .flat_map(|vertex| vertex.position_m)
            .for_each(|x| digest.f64(f64::from(x)));
    });
    digest.u64(triangles);
    mapper.tracks().for_each(|track| digest.u64(u64::from(track.id)));
    // The bytes themselves depend on the index of blocks.
    digest.u64(u64::from(mapper.footprint().bytes() == CAPACITY.bytes()));
}

/// The maps for planners: the window now and later, distances, a ray and a path.
#[inline(never)]
fn plan(mapper: &mut Mapper<'_>, digest: &mut Digest) {
    digest.u64(u64::from(mapper.update_planning_maps(black_box(0.0)).occupied));
    digest.u64(mapper.planning().digest());
    digest.u64(u64::from(mapper.plan_ahead(black_box(0.5)).obstacles));
    let (planning, volume) = (mapper.planning(), mapper.static_map());
    digest.u64(planning.digest());
    let camera = mapper.t_world_camera().translation_m;
    let ahead = [camera[0], camera[1], camera[2] + 10.0];
    digest.f64(planning.ray(volume, black_box(camera), [0.0, 0.1, 1.0], 20.0).free_m);
    let robot = RobotCylinder { radius_m: 0.4, low_m: -1.0, high_m: 0.5, unknown_ends: true };
    digest.f64(planning.sweep(volume, black_box(&[camera, ahead]), &robot).free_m);
    let cell = planning.origin();
    let gradients =
        [planning.slice_gradient(cell).map(|[x, y]| [x, y, 0.0]), planning.cell_gradient(cell)];
    gradients.into_iter().flatten().flatten().for_each(|slope| digest.f64(f64::from(slope)));
}
