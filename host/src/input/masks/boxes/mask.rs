//! The mask of a box: what stands at the depth it shows most of.

use super::DetectedBox;
use super::marks::Marks;
use crate::formats::Image;
use crate::input::source::InstanceMask;
use dynvox_core::geometry::{GroundPlane, StereoRig};
use dynvox_core::image::{DISPARITY_ONE_PX, View};
use dynvox_core::masks::PixelBox;
use dynvox_core::tracking::Class;
use std::collections::BTreeMap;

/// Boxes of fewer pixels are shrunk only.
const SMALL_PX: i64 = 1_500;
/// By how much at each side, as a share of width and height.
const SHRUNK: f64 = 0.05;
/// Part of a box that its object surely covers: shares of its width and height.
const CORE: [f64; 4] = [0.2, 0.3, 0.8, 0.85];
/// Height above the ground below which pixels belong to the ground, m.
const CLEARANCE_M: f64 = 0.12;
/// Depth errs by this, m for each m^2 of squared depth.
const DEPTH_ERROR: f64 = 0.0012;
/// Disparities of neighbouring pixels of one object differ by less, px.
const STEP_PX: f64 = 1.2;
/// Gaps up to this share of a box's width are filled.
const GAP: f64 = 0.1;
/// The left image's first columns, as many as the disparity and these, are beyond the right image's
/// edge or too close to it to match, px.
const UNMATCHED_EDGE_PX: f64 = 6.0;
/// Least share of a box that a mask fills: less is another object's, and the box is shrunk only.
const FILLED_MIN: f64 = 0.25;

/// Least share of a box that a semantic map must have in a class of the box's to count for it.
const KNOWN_SHARE: f64 = 0.15;
/// Fewest pixels of an object that a semantic map shows and no box, and its score.
const REGION_MIN_PX: i64 = 400;
const REGION_SCORE: f32 = 0.5;

/// Returns the length of an object of a class, m.
fn length_m(class: Class) -> f64 {
    match class {
        Class::Bus => 12.0,
        Class::Truck => 10.0,
        Class::Train => 25.0,
        Class::Van => 5.5,
        Class::Person => 0.8,
        Class::Rider | Class::Bicycle | Class::Motorcycle | Class::Animal => 2.0,
        Class::Car | Class::MovingObject | Class::Other => 4.5,
    }
}

/// A frame's disparity, with the ground under it.
pub(super) struct Scene<'a> {
    rig: &'a StereoRig,
    disparity_q8: View<'a, u16>,
    ground: Option<GroundPlane>,
    /// A semantic map of the image, by [`Class::code`].
    regions: Option<&'a Image<u8>>,
}

impl<'a> Scene<'a> {
    pub fn new(
        rig: &'a StereoRig,
        disparity_q8: View<'a, u16>,
        regions: Option<&'a Image<u8>>,
    ) -> Self {
        Self { rig, disparity_q8, ground: GroundPlane::find(rig, disparity_q8), regions }
    }

    fn size(&self) -> (usize, usize) {
        (self.disparity_q8.width(), self.disparity_q8.height())
    }

    /// Disparity of a pixel, px.
    fn disparity_px(&self, u: i32, v: i32) -> Option<f64> {
        let q8 = self
            .disparity_q8
            .get(usize::try_from(u).ok()?, usize::try_from(v).ok()?)
            .filter(|q8| *q8 > 0)?;
        Some(f64::from(q8) / f64::from(DISPARITY_ONE_PX))
    }

    /// The mask of a box; `None` where it has no pixel in the image.
    pub fn mask(&self, one: &DetectedBox) -> Option<InstanceMask> {
        let pixels = one.pixels(0.0, self.size());
        let grown = (pixels.area() >= SMALL_PX).then(|| self.grown(one, &pixels)).flatten();
        let count =
            |mask: &InstanceMask| mask.mask.iter().filter(|pixel| **pixel > 0).count() as f64;
        grown.filter(|mask| count(mask) >= FILLED_MIN * pixels.area() as f64).or_else(|| {
            let shrunk = one.pixels(SHRUNK, self.size());
            (shrunk.area() > 0)
                .then(|| InstanceMask::from_predicate(one.class, one.score, shrunk, |_, _| true))
                .flatten()
        })
    }

    /// Grows the mask from the depth that most of the box has.
    fn grown(&self, one: &DetectedBox, pixels: &PixelBox) -> Option<InstanceMask> {
        let peak_px = self.peak_px(one, pixels)?;
        let (focal_m_px, length_m) = (self.rig.focal_baseline_px_m(), length_m(one.class));
        let depth_m = focal_m_px / peak_px;
        let error_m = DEPTH_ERROR * depth_m * depth_m;
        let (near_m, far_m) = (depth_m - length_m - error_m, depth_m + length_m + error_m);
        let agrees = self.agrees(one.class, pixels);
        let is_own = |u: i32, v: i32| {
            let Some(disparity_px) = self.disparity_px(u, v) else { return false };
            let per_px = self.rig.baseline_m / disparity_px;
            let point = [
                (f64::from(u) - self.rig.center_u_px) * per_px,
                (f64::from(v) - self.rig.center_v_px) * per_px,
                self.rig.focal_px * per_px,
            ];
            agrees(u, v)
                && (near_m..=far_m).contains(&point[2])
                && self.ground.is_none_or(|ground| ground.above_m(point) > CLEARANCE_M)
        };
        let components = Marks::new(*pixels, is_own).components(|a, b| self.is_next(a, b));
        // Of equals the first.
        let largest = components.into_iter().rev().max_by_key(Vec::len)?;
        let to_edge = self.with_unmatched_edge(largest, pixels.left);
        self.filled(one.class, one.score, &to_edge, |_, _| true)
    }

    /// A component with what is left of it up to a box's left edge, in rows where the right camera
    /// cannot see that: it has no disparity.
    fn with_unmatched_edge(&self, component: Vec<(i32, i32)>, left: i32) -> Vec<(i32, i32)> {
        let mut first_of_rows = BTreeMap::new();
        for &(u, v) in &component {
            let first = first_of_rows.entry(v).or_insert(u);
            *first = u.min(*first);
        }
        let mut whole = component;
        for (v, first) in first_of_rows {
            let edge = self.disparity_px(first, v).unwrap_or_default() + UNMATCHED_EDGE_PX;
            if f64::from(first) <= edge && (left..first).all(|u| self.disparity_px(u, v).is_none())
            {
                whole.extend((left..first).map(|u| (u, v)));
            }
        }
        whole
    }

    /// Returns true if neighbours can be on one surface.
    fn is_next(&self, a: (i32, i32), b: (i32, i32)) -> bool {
        let pair = self.disparity_px(a.0, a.1).zip(self.disparity_px(b.0, b.1));
        pair.is_some_and(|(a, b)| (a - b).abs() < STEP_PX)
    }

    /// The mask of a component, its gaps filled where `may` is true.
    fn filled(
        &self,
        class: Class,
        score: f32,
        component: &[(i32, i32)],
        may: impl Fn(i32, i32) -> bool,
    ) -> Option<InstanceMask> {
        let mut marks = Marks::of(component)?;
        marks.fill_gaps((GAP * f64::from(marks.pixels.width)) as usize + 2, may);
        InstanceMask::from_predicate(class, score, marks.pixels, |u, v| marks.holds(u, v))
    }

    /// The masks of regions that none of `masks` covers: their components in disparity. They have
    /// the score of a certain detection.
    pub fn uncovered(&self, masks: &[InstanceMask]) -> Vec<InstanceMask> {
        let Some(regions) = self.regions else { return Vec::new() };
        let (width, height) = self.size();
        let image = PixelBox { left: 0, top: 0, width: width as i32, height: height as i32 };
        let class = |u: i32, v: i32| {
            Class::from_code(u32::from(regions.get(u as usize, v as usize).unwrap_or_default()))
        };
        let is_free = |u: i32, v: i32| {
            class(u, v) != Class::Other && !masks.iter().any(|mask| mask.contains(u, v))
        };
        let free = Marks::new(image, is_free);
        let agrees = |a: (i32, i32), b: (i32, i32)| {
            class(a.0, a.1).agrees_with(class(b.0, b.1)) && self.is_next(a, b)
        };
        let components = free.components(agrees);
        let large = components.iter().filter(|component| component.len() as i64 >= REGION_MIN_PX);
        let mask = |component: &Vec<(i32, i32)>| {
            let (u, v) = component[component.len() / 2];
            let own = class(u, v);
            self.filled(own, REGION_SCORE, component, |u, v| {
                free.holds(u, v) && class(u, v).agrees_with(own)
            })
        };
        large.filter_map(mask).collect()
    }

    /// Returns a test for pixels whose class in the semantic map can be the box's. The test is
    /// always true without a map, and where the map has hardly any pixel of that class.
    fn agrees<'b>(&'b self, class: Class, pixels: &PixelBox) -> impl Fn(i32, i32) -> bool + 'b {
        let at = move |u: i32, v: i32| {
            self.regions.is_none_or(|regions| {
                let code = regions.get(u as usize, v as usize).unwrap_or_default();
                Class::from_code(u32::from(code)).agrees_with(class)
            })
        };
        let rows = pixels.top..pixels.top + pixels.height;
        let count = rows
            .flat_map(|v| (pixels.left..pixels.left + pixels.width).map(move |u| (u, v)))
            .filter(|(u, v)| at(*u, *v))
            .count();
        let is_known = count as f64 >= KNOWN_SHARE * pixels.area() as f64;
        move |u, v| !is_known || at(u, v)
    }

    /// The disparity that most of a box's core has, px.
    fn peak_px(&self, one: &DetectedBox, pixels: &PixelBox) -> Option<f64> {
        let [left, top, right, bottom] = one.edges;
        let (width, height) = (right - left, bottom - top);
        let at = |from: f64, side: f64, share: f64| (from + share * side) as i32;
        let core = PixelBox {
            left: at(left, width, CORE[0]),
            top: at(top, height, CORE[1]),
            width: (width * (CORE[2] - CORE[0])) as i32,
            height: (height * (CORE[3] - CORE[1])) as i32,
        }
        .intersection(pixels);
        // Half pixels: an object's depth is that of its nearest surface, which fills a few of them.
        let mut counts = vec![0u32; 2 * 256];
        for v in core.top..core.top + core.height {
            for disparity_px in
                (core.left..core.left + core.width).filter_map(|u| self.disparity_px(u, v))
            {
                counts
                    .get_mut((2.0 * disparity_px) as usize)
                    .into_iter()
                    .for_each(|count| *count += 1);
            }
        }
        let around = |bin: usize| {
            let reach = 1 + bin / 16;
            counts
                .get(bin.saturating_sub(reach)..=(bin + reach).min(counts.len() - 1))
                .map_or(0, |near| near.iter().sum::<u32>())
        };
        let best = (1..counts.len())
            .max_by_key(|&bin| (around(bin), bin))
            .filter(|&bin| around(bin) > 0)?;
        Some((best as f64 + 0.5) / 2.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIG: StereoRig =
        StereoRig { focal_px: 300.0, center_u_px: 100.0, center_v_px: 40.0, baseline_m: 0.5 };

    /// A car 60 x 50 px large, with a pane that shows the wall behind it, before a wall.
    fn mask(class: Class, edges: [f64; 4]) -> Option<InstanceMask> {
        let on_car = |u: usize, v: usize| {
            (70..130).contains(&u)
                && (30..80).contains(&v)
                && !((90..94).contains(&u) && (40..44).contains(&v))
        };
        let disparity: Vec<u16> = (0..200 * 100)
            .map(|at| if on_car(at % 200, at / 200) { 24 * 256 } else { 6 * 256 })
            .collect();
        let view = View::new(&disparity, 200, 100).unwrap();
        Scene::new(&RIG, view, None).mask(&DetectedBox { class, score: 0.5, edges })
    }

    fn filled(mask: &InstanceMask) -> usize {
        mask.mask.iter().filter(|pixel| **pixel > 0).count()
    }

    #[test]
    fn a_box_becomes_what_stands_at_its_depth() {
        let found = mask(Class::Car, [60.0, 22.0, 140.0, 90.0]).unwrap();
        assert_eq!(found.pixels, PixelBox { left: 70, top: 30, width: 60, height: 50 });
        assert_eq!(filled(&found), 3_000, "the pane is filled");
    }

    #[test]
    fn what_a_semantic_map_shows_and_no_box_is_a_mask_of_its_own() {
        // A bus and a person at one depth, and a few pixels of a car.
        let (bus, person) = ((70..130, 30..80), (140..160, 40..80));
        let within = |(us, vs): &(std::ops::Range<usize>, std::ops::Range<usize>), u, v| {
            us.contains(&u) && vs.contains(&v)
        };
        let disparity: Vec<u16> = (0..200 * 100)
            .map(|at| (at % 200, at / 200))
            .map(|(u, v)| if within(&bus, u, v) || within(&person, u, v) { 24 } else { 6 })
            .map(|px: u16| px * 256)
            .collect();
        let class = |u: usize, v: usize| match (u, v) {
            _ if within(&bus, u, v) => Class::Bus,
            _ if within(&person, u, v) => Class::Person,
            (20..30, 20..30) => Class::Car,
            _ => Class::Other,
        };
        let codes = (0..200 * 100).map(|at| class(at % 200, at / 200).code() as u8).collect();
        let regions = Image::new(200, 100, codes).unwrap();
        let scene = Scene::new(&RIG, View::new(&disparity, 200, 100).unwrap(), Some(&regions));
        let found = scene.uncovered(&[]);
        let boxes: Vec<_> = found.iter().map(|mask| (mask.class, mask.pixels)).collect();
        let pixels = |left, top, width, height| PixelBox { left, top, width, height };
        let [of_bus, of_person] = [pixels(70, 30, 60, 50), pixels(140, 40, 20, 40)];
        assert_eq!(boxes, [(Class::Bus, of_bus), (Class::Person, of_person)]);
        // A mask that a box became counts as seen.
        let rest = scene.uncovered(&found[..1]);
        assert_eq!(rest.len(), 1, "the bus has a mask already");
        let without = Scene::new(&RIG, View::new(&disparity, 200, 100).unwrap(), None);
        assert!(without.uncovered(&[]).is_empty());
    }

    #[test]
    fn every_class_has_a_length_and_a_mask() {
        let classes = [
            Class::Person,
            Class::Bicycle,
            Class::Car,
            Class::Van,
            Class::Truck,
            Class::Bus,
            Class::Train,
        ];
        assert!(classes.map(length_m).is_sorted());
        for class in classes {
            assert!(mask(class, [60.0, 22.0, 140.0, 90.0]).is_some(), "{class:?}");
        }
    }

    #[test]
    fn a_car_at_the_left_edge_keeps_columns_the_right_camera_misses() {
        // Disparity 24 px: the first 26 columns have none. Of a car inside the image, what is left
        // of it has none either: it hides that.
        let car = |first: usize| {
            let disparity: Vec<u16> = (0..200 * 100)
                .map(|at| (at % 200, at / 200))
                .map(|(u, v)| {
                    if u < first || !(30..80).contains(&v) {
                        0
                    } else if u < 90 {
                        24 * 256
                    } else {
                        6 * 256
                    }
                })
                .collect();
            let edges = [first as f64 - 20.0, 30.0, 90.0, 80.0];
            Scene::new(&RIG, View::new(&disparity, 200, 100).unwrap(), None)
                .mask(&DetectedBox { class: Class::Car, score: 0.5, edges })
                .unwrap()
                .pixels
        };
        assert_eq!((car(26).left, car(26).width), (6, 84));
        assert_eq!((car(40).left, car(40).width), (40, 50));
    }

    #[test]
    fn small_boxes_and_those_that_show_little_of_one_depth_are_shrunk() {
        let small = mask(Class::Car, [80.0, 40.0, 110.0, 60.0]).unwrap();
        assert_eq!(small.pixels, PixelBox { left: 82, top: 41, width: 27, height: 18 });
        // A box beyond the image ends with it.
        let cut = mask(Class::Car, [180.0, 40.0, 260.0, 60.0]).unwrap();
        assert_eq!((cut.pixels.left, cut.pixels.width), (184, 16));
        for nothing in [
            [300.0, 10.0, 400.0, 90.0],
            [50.0, 50.0, 50.0, 50.0],
            [90.0, 50.0, 60.0, 20.0],
            [f64::NAN; 4],
        ] {
            assert_eq!(mask(Class::Car, nothing), None);
        }
    }
}
