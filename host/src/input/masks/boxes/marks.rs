//! Marked pixels: components and gaps.

use dynvox_core::masks::PixelBox;

/// Marked pixels of a box.
pub(super) struct Marks {
    pub pixels: PixelBox,
    marks: Vec<bool>,
}

impl Marks {
    /// The pixels for which `holds` is true.
    pub fn new(pixels: PixelBox, holds: impl Fn(i32, i32) -> bool) -> Self {
        let rows = pixels.top..pixels.top + pixels.height;
        let all = rows.flat_map(|v| (pixels.left..pixels.left + pixels.width).map(move |u| (u, v)));
        Self { marks: all.map(|(u, v)| holds(u, v)).collect(), pixels }
    }

    /// Makes the marks of a component: its box and its pixels.
    pub fn of(component: &[(i32, i32)]) -> Option<Self> {
        let columns = || component.iter().map(|(u, _)| *u);
        let rows = || component.iter().map(|(_, v)| *v);
        let (left, top) = (columns().min()?, rows().min()?);
        let pixels = PixelBox {
            left,
            top,
            width: columns().max()? + 1 - left,
            height: rows().max()? + 1 - top,
        };
        let mut marks = Self { pixels, marks: vec![false; pixels.area() as usize] };
        for (u, v) in component {
            marks.marks[((v - top) * pixels.width + u - left) as usize] = true;
        }
        Some(marks)
    }

    /// Returns true if a pixel is marked.
    pub fn holds(&self, u: i32, v: i32) -> bool {
        self.pixels.contains(u, v)
            && self.marks
                [((v - self.pixels.top) * self.pixels.width + u - self.pixels.left) as usize]
    }

    /// The components, by their first pixels, row by row; neighbours are connected where `is_next`.
    pub fn components(
        &self,
        is_next: impl Fn((i32, i32), (i32, i32)) -> bool,
    ) -> Vec<Vec<(i32, i32)>> {
        let PixelBox { left, top, width, .. } = self.pixels;
        let mut left_over = self.marks.clone();
        let mut components = Vec::new();
        for start in 0..self.marks.len() {
            if !left_over[start] {
                continue;
            }
            left_over[start] = false;
            let mut component = vec![(left + start as i32 % width, top + start as i32 / width)];
            let mut next = 0;
            while let Some(&(u, v)) = component.get(next) {
                next += 1;
                for (u2, v2) in [(u - 1, v), (u + 1, v), (u, v - 1), (u, v + 1)] {
                    let at = ((v2 - top) * width + u2 - left) as usize;
                    if self.pixels.contains(u2, v2) && left_over[at] && is_next((u, v), (u2, v2)) {
                        left_over[at] = false;
                        component.push((u2, v2));
                    }
                }
            }
            components.push(component);
        }
        components
    }

    /// Marks what lies between two marked pixels of a row, and then of a column, at most `most`
    /// pixels apart and where `may` is true: panes and reflections have disparities of what is
    /// behind them.
    pub fn fill_gaps(&mut self, most: usize, may: impl Fn(i32, i32) -> bool) {
        let PixelBox { left, top, width, height } = self.pixels;
        let (columns, rows) = (width as usize, height as usize);
        let mut fill_line = |first: usize, step: usize, count: usize| {
            let mut last = None;
            for index in 0..count {
                if !self.marks[first + index * step] {
                    continue;
                }
                if let Some(last) = last.filter(|last| index - last - 1 <= most) {
                    for at in (last + 1..index).map(|gap| first + gap * step) {
                        self.marks[at] |=
                            may(left + (at % columns) as i32, top + (at / columns) as i32);
                    }
                }
                last = Some(index);
            }
        };
        (0..rows).for_each(|row| fill_line(row * columns, 1, columns));
        (0..columns).for_each(|column| fill_line(column, columns, rows));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_are_connected_and_gaps_between_their_pixels_filled() {
        let pixels = PixelBox { left: 10, top: 20, width: 8, height: 3 };
        // A frame with a hole, and a pixel apart.
        let marks = Marks::new(pixels, |u, v| (u < 14 && (u, v) != (12, 21)) || (u, v) == (17, 20));
        let components = marks.components(|_, _| true);
        assert_eq!(components.iter().map(Vec::len).collect::<Vec<_>>(), [11, 1]);
        let halves = marks.components(|(u, _), (u2, _)| (u < 12) == (u2 < 12));
        assert_eq!(halves.iter().map(Vec::len).collect::<Vec<_>>(), [6, 5, 1]);
        let mut first = Marks::of(&components[0]).unwrap();
        assert_eq!(first.pixels, PixelBox { width: 4, ..pixels });
        first.fill_gaps(1, |_, _| false);
        assert!(!first.holds(12, 21));
        first.fill_gaps(1, |_, _| true);
        assert!(first.holds(12, 21) && !first.holds(14, 21) && Marks::of(&[]).is_none());
    }
}
