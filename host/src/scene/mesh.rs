//! A mesh in memory, small enough for a browser.

use nalgebra::Vector3;

/// Triangles with shared vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IndexedMesh {
    /// Positions of vertices, m.
    pub positions_m: Vec<[f32; 3]>,
    /// Colours of the vertices; all 0 where unknown.
    pub colours: Vec<[u8; 3]>,
    /// Numbers of observations of the vertices; all 0 where unknown.
    pub weights: Vec<u8>,
    /// Numbers of each triangle's corners, counter-clockwise seen from free space.
    pub triangles: Vec<[u32; 3]>,
}

impl IndexedMesh {
    /// Normals of the vertices, of length 1: the mean over their triangles by area. 0 where they
    /// cancel out.
    pub fn normals(&self) -> Vec<[f32; 3]> {
        let mut sums = vec![Vector3::<f32>::zeros(); self.positions_m.len()];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|corner| Vector3::from(self.positions_m[corner as usize]));
            let normal = (b - a).cross(&(c - a));
            triangle.iter().for_each(|&corner| sums[corner as usize] += normal);
        }
        sums.iter().map(|sum| sum.try_normalize(1e-20).unwrap_or_default().into()).collect()
    }

    /// Least and greatest coordinate on each axis, m; `None` of an empty mesh.
    pub fn bounds_m(&self) -> Option<[[f32; 3]; 2]> {
        let first = *self.positions_m.first()?;
        Some(self.positions_m.iter().fold([first; 2], |[low, high], at| {
            [
                [0, 1, 2].map(|axis| low[axis].min(at[axis])),
                [0, 1, 2].map(|axis| high[axis].max(at[axis])),
            ]
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_point_to_where_the_corners_are_counter_clockwise() {
        let mesh = IndexedMesh {
            positions_m: vec![[0.0; 3], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [9.0, 9.0, 9.0]],
            colours: vec![[0; 3]; 4],
            weights: vec![0; 4],
            triangles: vec![[0, 1, 2]],
        };
        assert_eq!(mesh.normals(), [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0; 3]]);
        assert_eq!(mesh.bounds_m(), Some([[0.0; 3], [9.0; 3]]));
        assert_eq!(IndexedMesh::default().bounds_m(), None);
    }
}
