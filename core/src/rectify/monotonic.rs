//! Growing functions of one number: up to where they grow, and their inverse.

/// Most Newton steps of the inverse. Each is at most half as long as the one before, so that as
/// many leave less than a rounding error.
pub const MAX_STEPS: usize = 64;
/// Points at which [`growing_until`] evaluates the function.
const POINTS: u32 = 512;

/// The last of [`POINTS`] points between 0 and `end`, each mapped by `point`, up to which `value`
/// grows from one to the next.
pub(super) fn growing_until(
    end: f64,
    point: impl Fn(f64) -> f64,
    value: impl Fn(f64) -> f64,
) -> f64 {
    let (mut last, mut before) = (0.0, value(0.0));
    for step in 1..=POINTS {
        let at = point(end * f64::from(step) / f64::from(POINTS));
        let here = value(at);
        // Written so that NaN ends it.
        let grows = here > before && here.is_finite();
        if !grows {
            break;
        }
        (last, before) = (at, here);
    }
    last
}

/// Inverts a function that grows from 0 to `end`: Newton's step where it stays within the bracket
/// and is at most half as long as the step before, else half the bracket. `with_slope` gives value
/// and derivative. `None` when `sought` is not between 0 and the value at `end`, or after
/// [`MAX_STEPS`].
pub(super) fn inverse(sought: f64, end: f64, with_slope: impl Fn(f64) -> [f64; 2]) -> Option<f64> {
    let within = sought >= 0.0 && sought <= with_slope(end)[0];
    if !within {
        return None;
    }
    let (mut low, mut high) = (0.0, end);
    let mut at = if sought < end { sought } else { 0.5 * end };
    let mut length = end;
    for _ in 0..MAX_STEPS {
        let [value, slope] = with_slope(at);
        let error = value - sought;
        // The function grows, so the error's sign says in which part the solution lies.
        if error > 0.0 {
            high = at
        } else {
            low = at
        };
        let newton = at - error / slope;
        // A step that is not half as long as the last one: Newton's method does not converge here.
        let short = libm::fabs(newton - at) <= 0.5 * length;
        let next =
            if newton >= low && newton <= high && short { newton } else { 0.5 * (low + high) };
        length = libm::fabs(next - at);
        at = next;
        // A few units in the last place: further steps would only rock.
        if length <= 1e-15 * (1.0 + at) {
            return Some(at);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_end_of_growth_and_inverts_up_to_it() {
        // Grows up to 1, and falls from there.
        let cubic = |x: f64| x - x * x * x / 3.0;
        let end = growing_until(2.0, |x| x, cubic);
        assert!((end - 1.0).abs() < 0.01, "the derivative is 0 at 1, not at {end}");
        for x in [0.0, 1e-9, 0.3, 0.9, 0.99 * end] {
            let found = inverse(cubic(x), end, |x| [cubic(x), 1.0 - x * x]).unwrap();
            assert!((found - x).abs() < 1e-12, "{found} for {x}");
        }
        assert_eq!(inverse(0.7, end, |x| [cubic(x), 1.0 - x * x]), None, "above all values");
        assert_eq!(inverse(-0.1, end, |x| [cubic(x), 1.0 - x * x]), None);
        assert_eq!(inverse(f64::NAN, end, |x| [cubic(x), 1.0 - x * x]), None);
    }
}
