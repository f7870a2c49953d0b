//! The map as a binary PLY, streamed: triangles go to disk as they come, and the header's counts are filled in at the end.
//!
//! Memory: a window of [`WINDOW`] recent vertices, so that neighbouring triangles share them. The mesh itself is never in memory. Vertices
//! that fall out of the window are written again when they return, which costs bytes, not correctness.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Vertices remembered for sharing.
const WINDOW: usize = 1 << 16;
/// Digits of a count in the header.
const DIGITS: usize = 10;

/// A vertex: position in m and colour.
pub type Vertex = ([f32; 3], [u8; 3]);

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mesh {
    /// Vertices in the file.
    pub vertices: u64,
    /// Triangles in the file.
    pub triangles: u64,
}

/// Writes one PLY.
pub struct PlyWriter {
    file: BufWriter<File>,
    faces: BufWriter<File>,
    faces_path: PathBuf,
    vertex_count_at: u64,
    face_count_at: u64,
    window: Vec<Option<(Vertex, u32)>>,
    mesh: Mesh,
    failed: Option<io::Error>,
}

impl PlyWriter {
    /// Begins the file. Faces wait in a second file beside it, since they stand after all vertices.
    pub fn begin(path: &Path) -> io::Result<Self> {
        Self::begin_in(path, "the first camera")
    }

    /// As [`PlyWriter::begin`], with the name of the frame of reference for the header.
    pub fn begin_in(path: &Path, frame: &str) -> io::Result<Self> {
        let mut file = BufWriter::new(File::create(path)?);
        write!(file, "ply\nformat binary_little_endian 1.0\ncomment metres; x right, y down, z forward of {frame}\n")?;
        let vertex_count_at = count_line(&mut file, "element vertex ")?;
        file.write_all(
            b"property float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n",
        )?;
        let face_count_at = count_line(&mut file, "element face ")?;
        file.write_all(b"property list uchar uint vertex_indices\nend_header\n")?;
        let faces_path = path.with_extension("faces");
        let faces = File::options().read(true).write(true).create(true).truncate(true).open(&faces_path)?;
        Ok(Self {
            file,
            faces: BufWriter::new(faces),
            faces_path,
            vertex_count_at,
            face_count_at,
            window: vec![None; WINDOW],
            mesh: Mesh::default(),
            failed: None,
        })
    }

    /// Adds a triangle. [`PlyWriter::finish`] returns a failure, so that callbacks need no error path.
    pub fn triangle(&mut self, corners: [Vertex; 3]) {
        if self.failed.is_none() {
            self.failed = self.try_triangle(corners).err();
        }
    }

    fn try_triangle(&mut self, corners: [Vertex; 3]) -> io::Result<()> {
        let mut face = [3u8; 13];
        for (bytes, corner) in face[1..].chunks_exact_mut(4).zip(corners) {
            bytes.copy_from_slice(&self.index_of(corner)?.to_le_bytes());
        }
        self.mesh.triangles += 1;
        self.faces.write_all(&face)
    }

    /// The position of a vertex in the file; it is written if it is not among the recent ones.
    fn index_of(&mut self, vertex: Vertex) -> io::Result<u32> {
        let key = vertex.0.iter().fold(0u32, |key, value| (key ^ value.to_bits()).wrapping_mul(0x9E37_79B1).rotate_left(13));
        let slot = &mut self.window[key as usize % WINDOW];
        if let Some((_, index)) = slot.filter(|(known, _)| *known == vertex) {
            return Ok(index);
        }
        let index = u32::try_from(self.mesh.vertices).map_err(|_| io::Error::other("a PLY holds at most 2^32 vertices"))?;
        *slot = Some((vertex, index));
        let (position_m, colour) = vertex;
        for value in position_m {
            self.file.write_all(&value.to_le_bytes())?;
        }
        self.file.write_all(&colour)?;
        self.mesh.vertices += 1;
        Ok(index)
    }

    /// Appends the faces and fills in the counts. After a failure the file of faces is removed, and what is at the path is not a PLY.
    pub fn finish(self) -> io::Result<Mesh> {
        let faces_path = self.faces_path.clone();
        self.complete().inspect_err(|_| {
            // The disk has failed already.
            let _ = std::fs::remove_file(&faces_path);
        })
    }

    fn complete(mut self) -> io::Result<Mesh> {
        if let Some(error) = self.failed {
            return Err(error);
        }
        self.faces.flush()?;
        let mut faces = self.faces.into_inner().map_err(|error| error.into_error())?;
        faces.seek(SeekFrom::Start(0))?;
        io::copy(&mut faces, &mut self.file)?;
        drop(faces);
        std::fs::remove_file(&self.faces_path)?;
        for (at, count) in [(self.vertex_count_at, self.mesh.vertices), (self.face_count_at, self.mesh.triangles)] {
            self.file.seek(SeekFrom::Start(at))?;
            write!(self.file, "{count:0DIGITS$}")?;
        }
        self.file.flush()?;
        Ok(self.mesh)
    }
}

/// Writes a header line with space for a count and returns the position of the count.
fn count_line(file: &mut BufWriter<File>, line: &str) -> io::Result<u64> {
    file.write_all(line.as_bytes())?;
    let at = file.stream_position()?;
    writeln!(file, "{:0DIGITS$}", 0)?;
    Ok(at)
}
