//! Cholesky factor of a dense symmetric matrix, whose lower half is kept row by row.

/// Entries of the lower half of a matrix of `rows` rows.
pub(super) const fn entries(rows: usize) -> usize {
    rows * (rows + 1) / 2
}

/// Replaces the matrix by its Cholesky factor. `None` unless the matrix is positive definite.
pub(super) fn factor(lower: &mut [f64], rows: usize) -> Option<()> {
    for at in 0..rows {
        let (above, rest) = lower.split_at_mut_checked(entries(at))?;
        let row = rest.get_mut(..=at)?;
        for column in 0..at {
            let other = row_of(above, column)?;
            let (before, behind) = row.split_at_mut_checked(column)?;
            let known: f64 = before.iter().zip(other).map(|(a, b)| a * b).sum();
            let (entry, pivot) = (behind.first_mut()?, other.last()?);
            *entry = (*entry - known) / pivot;
        }
        let (diagonal, before) = row.split_last_mut()?;
        let pivot = *diagonal - before.iter().map(|entry| entry * entry).sum::<f64>();
        if pivot.is_nan() || pivot <= 0.0 {
            return None;
        }
        *diagonal = libm::sqrt(pivot);
    }
    Some(())
}

/// Divides a vector by the factor: the first half of a solution.
pub(super) fn forward(factor: &[f64], vector: &mut [f64]) -> Option<()> {
    for at in 0..vector.len() {
        let (diagonal, row) = row_of(factor, at)?.split_last()?;
        let (before, behind) = vector.split_at_mut_checked(at)?;
        let known: f64 = row.iter().zip(&*before).map(|(a, b)| a * b).sum();
        let entry = behind.first_mut()?;
        *entry = (*entry - known) / diagonal;
    }
    Some(())
}

/// Solves the equations of a factor for a right-hand side.
pub(super) fn solve(factor: &[f64], vector: &mut [f64]) -> Option<()> {
    forward(factor, vector)?;
    for at in (0..vector.len()).rev() {
        let (diagonal, row) = row_of(factor, at)?.split_last()?;
        let (before, behind) = vector.split_at_mut_checked(at)?;
        let entry = behind.first_mut()?;
        *entry /= diagonal;
        before.iter_mut().zip(row).for_each(|(value, factor)| *value -= factor * *entry);
    }
    Some(())
}

fn row_of(lower: &[f64], at: usize) -> Option<&[f64]> {
    lower.get(entries(at)..entries(at + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_what_it_factored() {
        // The product of a lower triangle with ones and itself.
        let mut lower = [4.0, 2.0, 10.0, 2.0, 4.0, 6.0];
        let mut vector = [8.0, 16.0, 12.0];
        factor(&mut lower, 3).unwrap();
        solve(&lower, &mut vector).unwrap();
        for (value, expected) in vector.iter().zip([1.0, 1.0, 1.0]) {
            assert!((value - expected).abs() < 1e-12, "{vector:?}");
        }
    }

    #[test]
    fn refuses_what_is_not_positive_definite() {
        assert_eq!(factor(&mut [1.0, 2.0, 1.0], 2), None);
        assert_eq!(factor(&mut [f64::NAN], 1), None);
    }
}
