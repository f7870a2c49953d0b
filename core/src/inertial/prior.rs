//! The unit from frame to frame: predicted turns, and what measured ones say of it.

mod forces;

use super::{
    INERTIAL_SAMPLES_PER_FRAME, InertialDoubt, InertialReport, InertialSample, InertialUnit,
    agreement::{Agreement, TurnPair},
    errors::{TurnError, UnitErrors},
    gravity::Gravity,
    integral::{Integral, Reading, integrate},
    recent::{RecentSamples, seconds_after},
    turn::{MeasuredMotion, PendingTurn},
};
use crate::{
    egomotion::{PredictedTurn, Turned},
    geometry::{MapSegment, Transform},
    memory::{Carver, region_bytes},
    state::{Hasher, Visitor},
};
use nalgebra::Vector3;

/// Time between a frame and the nearest sample from which on they are on two clocks, s.
const APART_S: f64 = 1.0;
/// Name of the region.
const REGION: &str = "inertial";
/// Least standard deviation of a turn, rad, and its part: scale and mounting are not perfect.
const SIGMA_MIN_RAD: f64 = 0.0005;
const SIGMA_PART: f64 = 0.01;
/// Turn that may go unseen between samples, one sigma, rad, beyond which a turn is compared only
/// once the samples after it are there: a clock ahead by a frame leaves a frame's end open.
const UNSEEN_MAX_RAD: f64 = 0.003;

/// An inertial unit over time.
#[derive(Clone, Debug)]
pub(crate) struct InertialPrior {
    unit: InertialUnit,
    recent: RecentSamples,
    errors: UnitErrors,
    agreement: Agreement,
    gravity: Gravity,
    segment: MapSegment,
    /// Times of the last frame and of the last sample, ns.
    frame_ns: Option<u64>,
    sample_ns: Option<u64>,
    /// Measured turn of the interval before, to learn from once samples cover it.
    pending: Option<PendingTurn>,
    /// Turn since the frame that matches are sought with.
    since_reference: Option<Turned>,
    /// Integral of the frame's samples; `None` where they do not cover its interval.
    integral: Option<Integral>,
    span_s: f64,
    report: InertialReport,
}

/// Bytes of the slab for a prior; the same on every target.
const PRIOR_BYTES: usize = 3_584;
const _: () = assert!(size_of::<InertialPrior>() <= PRIOR_BYTES);

impl InertialPrior {
    /// Bytes of the slab.
    pub const fn bytes() -> usize {
        region_bytes::<u8>(PRIOR_BYTES)
    }

    /// Makes a prior in the slab, if there is a unit. Its kilobytes must not lie in the mapper,
    /// which is moved over the stack when it is made.
    #[inline(never)]
    pub fn new_in<'s>(
        unit: Option<&InertialUnit>,
        carver: &mut Carver<'s>,
    ) -> Option<&'s mut Self> {
        match unit {
            Some(unit) => Self::alloc(unit, carver),
            // The region is there with and without a unit: bytes depend on the capacity alone.
            None => {
                carver.alloc_as_found::<u8>(REGION, PRIOR_BYTES);
                None
            }
        }
    }

    // Never inlined: without a unit its stack is not taken.
    #[inline(never)]
    fn alloc<'s>(unit: &InertialUnit, carver: &mut Carver<'s>) -> Option<&'s mut Self> {
        carver.alloc_value(REGION, PRIOR_BYTES, Self::new(unit))
    }

    pub fn new(unit: &InertialUnit) -> Self {
        Self {
            unit: *unit,
            recent: RecentSamples::new(),
            errors: UnitErrors::new(unit),
            agreement: Agreement::default(),
            gravity: Gravity::default(),
            segment: MapSegment::FIRST,
            frame_ns: None,
            sample_ns: None,
            pending: None,
            since_reference: None,
            integral: None,
            span_s: 0.0,
            report: InertialReport::default(),
        }
    }

    /// Takes the samples of a frame. Returns the turn of the camera since the frame before, and
    /// since the one that matches are sought with, if the unit is trusted and covers them.
    /// `since_reference` is the number of frames between these two, `t_world_camera` the camera
    /// before.
    #[inline(never)]
    pub fn predict(
        &mut self,
        time_ns: Option<u64>,
        samples: &[InertialSample],
        since_reference: u32,
        t_world_camera: &Transform,
    ) -> Option<PredictedTurn> {
        self.report = InertialReport { samples: samples.len() as u32, ..Default::default() };
        let (read, beyond) =
            samples.split_at_checked(INERTIAL_SAMPLES_PER_FRAME).unwrap_or((samples, &[]));
        self.report.ignored = beyond.len() as u32;
        // With the errors as they were, before this frame changes them.
        self.learn(read);
        let start_ns = core::mem::replace(&mut self.frame_ns, time_ns);
        (self.integral, self.span_s) = (None, 0.0);
        if let Some((start_ns, end_ns)) = start_ns.zip(time_ns) {
            self.span_s = seconds_after(start_ns, end_ns);
            self.errors.pass(&self.unit, self.span_s);
            self.integral = self.integrate(read, start_ns, self.span_s);
            self.check_clocks(read, start_ns);
        }
        // Kept after the integration, which would read them twice.
        self.push(read);
        let mut predicted = self.predicted_turn(since_reference)?;
        // A guess goes on by forces where they tell its way.
        if let Some((way_m, sigma_m)) = self.way_m(t_world_camera) {
            predicted.last.t_before_now.translation_m = way_m;
            predicted.way_sigma_m = Some(sigma_m);
        }
        Some(predicted)
    }

    /// Readings of an interval from the recent samples and those of the frame.
    fn integrate(&self, read: &[InertialSample], start_ns: u64, span_s: f64) -> Option<Integral> {
        let offset_s = self.unit.clock_offset_s + self.errors.offset_s();
        let new = read.iter().filter(|sample| sample.is_finite()).map(|sample| Reading {
            at_s: seconds_after(start_ns, sample.time_ns) + offset_s,
            turn_rate: sample.turn_rate.into(),
            force: sample.force.into(),
        });
        let readings = self.recent.readings(start_ns, offset_s).chain(new);
        integrate(readings, span_s, &self.errors.bias())
    }

    /// Learns from the turn that images measured in the interval before, which samples may cover
    /// only now.
    fn learn(&mut self, read: &[InertialSample]) {
        let Some(pending) = self.pending.take() else { return };
        let Some(integral) = self.integrate(read, pending.start_ns, pending.span_s) else { return };
        let measured = Transform::new(pending.turn_rad, [0.0; 3]);
        let error = (integral.t_start_end.inverse() * measured).rotation_vector().into();
        let noise = self.noise_rad(&measured, pending.span_s);
        let sigma_rad = libm::sqrt(noise * noise + pending.sigma_rad * pending.sigma_rad);
        if pending.open != 0 {
            let unit = self.errors.turn_sigma_rad(&integral, pending.span_s);
            self.compare(&TurnPair {
                measured: pending.turn_rad.into(),
                predicted: integral.t_start_end.rotation_vector().into(),
                raw: Some(integral.rate_sum + self.errors.bias() * pending.span_s),
                sigma_rad: libm::sqrt(sigma_rad * sigma_rad + unit * unit),
                strong: true,
            });
        }
        self.errors.update(&TurnError {
            error,
            sigma_rad,
            span_s: pending.span_s,
            integral: &integral,
        });
        // An offset at its bound may be any larger one.
        if self.errors.is_apart() {
            self.agreement.lose_trust_in_clock();
            self.errors = UnitErrors::new(&self.unit);
        }
    }

    /// Standard deviation of an integrated turn by noise, scale and mounting, rad.
    fn noise_rad(&self, turn: &Transform, span_s: f64) -> f64 {
        let density = self.unit.turn_density;
        let part = SIGMA_PART * turn.angle_rad();
        libm::sqrt(density * density * span_s + part * part + SIGMA_MIN_RAD * SIGMA_MIN_RAD)
    }

    /// Doubts samples that lie far from the frame's interval.
    fn check_clocks(&mut self, read: &[InertialSample], start_ns: u64) {
        let offset_s = self.unit.clock_offset_s + self.errors.offset_s();
        let is_near = |sample: &InertialSample| {
            let at_s = seconds_after(start_ns, sample.time_ns) + offset_s;
            at_s > -APART_S && at_s < self.span_s + APART_S
        };
        if !read.is_empty() && !read.iter().any(is_near) {
            self.agreement.lose_trust(InertialDoubt::ClocksApart);
        }
    }

    /// Keeps the frame's samples.
    fn push(&mut self, read: &[InertialSample]) {
        for sample in read {
            let is_later = self.sample_ns.is_none_or(|last_ns| last_ns < sample.time_ns);
            if !(is_later && sample.is_finite()) {
                self.report.ignored = self.report.ignored.saturating_add(1);
                continue;
            }
            if let Some(last_ns) = self.sample_ns.replace(sample.time_ns) {
                self.errors.note_interval(seconds_after(last_ns, sample.time_ns));
            }
            self.agreement.note_sample(&self.unit, sample);
            self.recent.push(sample);
        }
    }

    /// The camera's turn of this frame, with its sigma.
    fn predicted_turn(&mut self, since_reference: u32) -> Option<PredictedTurn> {
        let before = self.since_reference.take().filter(|_| since_reference > 0);
        let integral = self.integral?;
        self.report.bridged = integral.bridged;
        let (noise, unit) = (
            self.noise_rad(&integral.t_start_end, self.span_s),
            self.errors.turn_sigma_rad(&integral, self.span_s),
        );
        // Errors of noise and of what is learned are independent.
        let last = Turned {
            t_before_now: self.in_camera(&integral.t_start_end),
            variance: noise * noise + unit * unit,
        };
        self.report.turn_rad = Some(last.t_before_now.rotation_vector().map(|rad| rad as f32));
        self.report.turn_sigma_rad = libm::sqrt(last.variance) as f32;
        self.since_reference = match before {
            None if since_reference > 0 => None,
            None => Some(last),
            Some(before) => Some(before.then(&last)),
        };
        let whole = self.since_reference;
        self.agreement.is_trusted().then_some(PredictedTurn { last, whole, way_sigma_m: None })
    }

    /// A rotation of the unit in the camera's axes.
    fn in_camera(&self, rotation: &Transform) -> Transform {
        // A turn is felt alike anywhere on a rigid body: the lever arm has no part in it.
        let mounting = Transform { translation_m: [0.0; 3], ..self.unit.t_camera_unit };
        (mounting * *rotation * mounting.inverse()).normalized()
    }

    /// Compares the turn that images measured with the predicted one, and learns from it.
    pub fn observe(&mut self, measured: &MeasuredMotion) {
        self.report.turned = measured.turned;
        self.report.refused = measured.refused;
        self.observe_turn(measured);
        self.observe_force(measured);
    }

    fn observe_turn(&mut self, measured: &MeasuredMotion) {
        let (Some(motion), Some(predicted)) = (&measured.t_reference_now, self.since_reference)
        else {
            return;
        };
        let mounting = Transform { translation_m: [0.0; 3], ..self.unit.t_camera_unit };
        let in_unit = |turn: &Transform| {
            Vector3::from((mounting.inverse() * *turn * mounting).rotation_vector())
        };
        let sigma_rad = measured.sigma_rad;
        let turn_rad = in_unit(motion);
        let predicted_rad = in_unit(&predicted.t_before_now);
        // Rates in degrees turn by more than half a turn.
        let bias_rad = self.errors.bias() * self.span_s;
        let raw_rad = self.integral.map(|integral| integral.rate_sum + bias_rad);
        let pair = TurnPair {
            measured: turn_rad,
            predicted: predicted_rad,
            raw: raw_rad.filter(|_| !measured.over_several),
            sigma_rad: libm::sqrt(predicted.variance + sigma_rad * sigma_rad),
            strong: measured.strong,
        };
        // Turns over several frames are compared, but not learned from.
        let is_learned = !measured.over_several && measured.strong;
        // A turn says little of the unit while no sample reaches its end.
        let is_open = |integral: Integral| integral.unseen_rad > UNSEEN_MAX_RAD;
        let is_compared_later = is_learned && self.integral.is_some_and(is_open);
        if !is_compared_later {
            self.compare(&pair);
        }
        if is_learned {
            let start_ns =
                self.frame_ns.map(|end_ns| end_ns.wrapping_sub((self.span_s * 1e9) as u64));
            self.pending = start_ns.map(|start_ns| PendingTurn {
                start_ns,
                span_s: self.span_s,
                turn_rad: turn_rad.into(),
                sigma_rad,
                open: u32::from(is_compared_later),
            });
        }
    }

    fn compare(&mut self, pair: &TurnPair) {
        if self.agreement.compare(pair) {
            // The errors may have changed: they are to be found anew.
            self.errors.widen(&self.unit);
        }
    }

    /// Report of the frame.
    pub fn report(&self) -> InertialReport {
        let bias: [f64; 3] = self.errors.bias().into();
        InertialReport {
            trusted: self.agreement.is_trusted(),
            doubt: self.agreement.doubt(),
            turn_bias: bias.map(|rate| rate as f32),
            turn_bias_sigma: self.errors.bias_sigma() as f32,
            clock_offset_s: (self.unit.clock_offset_s + self.errors.offset_s()) as f32,
            clock_offset_sigma_s: self.errors.offset_sigma_s() as f32,
            vertical: self.gravity.vertical(&self.unit),
            ..self.report
        }
    }

    /// Digest of all that later frames depend on.
    pub fn digest(&mut self) -> u64 {
        Hasher::digest(|hasher| self.visit(hasher))
    }

    /// Visits what lives from frame to frame.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self {
            recent,
            errors,
            agreement,
            gravity,
            segment,
            frame_ns,
            sample_ns,
            pending,
            since_reference,
            // Told by the caller.
            unit: _,
            // Belong to one frame.
            integral: _,
            span_s: _,
            report: _,
        } = self;
        recent.visit(visitor);
        errors.visit(visitor);
        agreement.visit(visitor);
        gravity.visit(visitor);
        let mut number = u32::from(segment.get());
        visitor.u32(&mut number);
        *segment = MapSegment::new(number as u16);
        for time_ns in [frame_ns, sample_ns] {
            visitor.option(time_ns, || 0, |visitor, time_ns| visitor.u64(time_ns));
        }
        visitor.option(pending, PendingTurn::default, |visitor, pending| pending.visit(visitor));
        visitor.option(since_reference, Turned::default, |visitor, turned| turned.visit(visitor));
    }
}
