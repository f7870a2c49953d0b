//! One round of a solution: the equations of all closures at the poses as they are.
//!
//! Errors are twists of the world's frame, in which an error of one link moves all keyframes after
//! it alike. So what two closures share is a difference of sums along the chain.

use super::{
    ChainSum, Graph, LOOSE, Node, UNUSED,
    closures::{Closure, WORLD},
    dense::{entries, factor, solve},
    twist::{
        Twist, add, difference, in_world, isotropic, spread_in_world, squared, times, twist_of,
    },
};
use crate::{egomotion::MotionCovariance, geometry::Transform};

/// Squared error of a closure, in standard deviations, at which it counts a quarter: 95 % of right
/// ones are below (chi square with six degrees of freedom).
const SCALE: f64 = 12.6;
/// Factor on it from a round to the one before, and the number of rounds at the true scale.
const SCALE_STEP: f64 = 4.0;
pub(super) const ROUNDS_AT_SCALE: u32 = 4;
/// Least weight in the equations.
const WEIGHT_MIN: f64 = 1e-9;
/// Errors where the camera was lost, rad and m.
const LOOSE_RAD: f64 = 1.0;
const LOOSE_M: f64 = 100.0;

/// Two entries of a slice.
fn pair<T>(of: &[T], a: usize, b: usize) -> Option<[&T; 2]> {
    Some([of.get(a)?, of.get(b)?])
}

/// Places in the chain of the ends of a closure. The first keyframe stands for the world.
fn ends(positions: &[u32], closure: &Closure) -> Option<[usize; 2]> {
    let position = |slot: u32| positions.get(slot as usize).map(|&position| position as usize);
    let begin = if closure.from == WORLD { 0 } else { position(closure.from)? };
    Some([begin, position(closure.to)?])
}

impl Graph<'_> {
    /// Moves the poses of the chain of `slots` towards the solution. `None` where the equations
    /// have none.
    pub(super) fn solve_round(
        &mut self,
        slots: impl Iterator<Item = usize> + Clone,
        rounds_left: u32,
    ) -> Option<()> {
        self.accumulate(slots.clone())?;
        // A wide scale first: before the first round right closures look wrong as well.
        let scale = (ROUNDS_AT_SCALE..rounds_left).fold(SCALE, |scale, _| SCALE_STEP * scale);
        for at in 0..self.closure_len {
            self.fill_row(at, scale)?;
        }
        let Self { matrix, pulls, closure_len, .. } = self;
        let pulls = pulls.get_mut(..*closure_len)?.as_flattened_mut();
        // The pulls' memory holds the right-hand side, then the solution.
        factor(matrix, pulls.len())?;
        solve(matrix, pulls)?;
        self.apply(slots)
    }

    /// Spread and error of the links up to each keyframe.
    #[inline(never)]
    fn accumulate(&mut self, slots: impl Iterator<Item = usize>) -> Option<()> {
        let Self { nodes, sums, positions, .. } = self;
        let mut sum: Option<(ChainSum, Transform)> = None;
        let used = slots.filter_map(|slot| Some((slot, used(nodes, slot)?)));
        for ((position, (slot, node)), to) in (0..).zip(used).zip(sums.iter_mut()) {
            let mut next = ChainSum { spread: MotionCovariance::ZERO, error: [0.0; 6] };
            if let Some((before, t_world_before)) = &sum {
                // Errors of links are independent, so their covariances add up.
                next = *before;
                next.spread.add_scaled(&link_spread(node), 1.0);
                if node.link != LOOSE {
                    let expected = *t_world_before * node.t_before_node;
                    add(&mut next.error, &twist_of(&(expected * node.working.inverse())));
                }
            }
            *to = next;
            *positions.get_mut(slot)? = position;
            sum = Some((next, node.working));
        }
        Some(())
    }

    /// Fills in the equations of a closure: its error without that of the links it spans, what it
    /// shares with those before it, and its own spread.
    #[inline(never)]
    fn fill_row(&mut self, at: usize, scale: f64) -> Option<()> {
        let Self { nodes, closures, sums, positions, matrix, pulls, .. } = self;
        let (before, rest) = closures.split_at_mut_checked(at)?;
        let closure = rest.first_mut()?;
        let to = nodes.get(closure.to as usize)?;
        let t_world_to = closure.t_world_from(nodes)? * closure.t_from_to;
        // In the later camera's frame, in which the covariance is.
        let error = twist_of(&(to.working.inverse() * t_world_to));
        let squared = squared(&error, &closure.covariance)?;
        let share = scale / (scale + squared);
        closure.weight = share * share;
        // Links between the ends are off already: a closure need not say that again.
        let [begin, end] = ends(positions, closure)?;
        let [start, stop] = pair(sums, begin, end)?;
        let links = difference(&stop.error, &start.error);
        *pulls.get_mut(at)? = difference(&in_world(&error, &to.working), &links);
        for (column, other) in before.iter().chain([&*closure]).enumerate() {
            let [other_begin, other_end] = ends(positions, other)?;
            // Two closures share the links that both of them span.
            let (low, high) = (begin.max(other_begin), end.min(other_end));
            let mut block = MotionCovariance::ZERO;
            if low < high {
                let [start, stop] = pair(sums, low, high)?;
                block.add_scaled(&stop.spread, 1.0);
                block.add_scaled(&start.spread, -1.0);
            }
            if column == at {
                // A closure that hardly counts still needs a row that can be divided by.
                let weight = if closure.weight > WEIGHT_MIN { closure.weight } else { WEIGHT_MIN };
                let own = spread_in_world(&closure.covariance, &to.working);
                block.add_scaled(&own, 1.0 / weight);
            }
            for inner in 0..6 {
                let row = 6 * at + inner;
                // The last block lies on the diagonal: its upper half is not kept.
                let kept = matrix.get_mut(entries(row)..entries(row + 1))?.get_mut(6 * column..)?;
                kept.iter_mut().zip(block.row(inner)).for_each(|(to, value)| *to = value);
            }
        }
        Some(())
    }

    /// Moves each keyframe by what the links before it give way.
    #[inline(never)]
    fn apply(&mut self, slots: impl Iterator<Item = usize>) -> Option<()> {
        let Self { nodes, closures, closure_len, sums, positions, pulls, .. } = self;
        let mut step: Twist = [0.0; 6];
        let mut error_before = None;
        for slot in slots {
            let Some(node) = nodes.get_mut(slot).filter(|node| node.link != UNUSED) else {
                continue;
            };
            let position = *positions.get(slot)?;
            let error = sums.get(position as usize)?.error;
            // The first keyframe stays: it holds the world in its position.
            if let Some(before) = error_before.replace(error) {
                add(&mut step, &difference(&error, &before));
                let mut pull: Twist = [0.0; 6];
                for (closure, one) in closures.iter().zip(&**pulls).take(*closure_len) {
                    let [begin, end] = ends(positions, closure)?;
                    if begin < position as usize && position as usize <= end {
                        add(&mut pull, one);
                    }
                }
                add(&mut step, &times(&link_spread(node), &pull));
            }
            // Numbers that overflow must not reach the poses in use.
            let moved = node.working.retract(step);
            if !moved.is_finite() {
                return None;
            }
            node.working = moved;
        }
        Some(())
    }
}

fn used(nodes: &[Node], slot: usize) -> Option<&Node> {
    nodes.get(slot).filter(|node| node.link != UNUSED)
}

/// Covariance of a keyframe's link in the world's frame.
fn link_spread(node: &Node) -> MotionCovariance {
    if node.link == LOOSE {
        isotropic(LOOSE_RAD, LOOSE_M)
    } else {
        spread_in_world(&node.covariance, &node.working)
    }
}
