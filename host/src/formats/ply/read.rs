//! Binary little-endian PLY meshes, read triangle by triangle. Faces mostly name vertices near
//! those before, so few of them are in memory.

use super::MeshAxes;
use super::records::Records;
use crate::formats::FormatError;
use crate::formats::bounds::{MAX_PLY_HEADER_BYTES, MAX_PLY_VERTEX_BYTES, bytes_text};
use dynvox_core::view::Vertex;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::ops::ControlFlow;
use std::path::Path;

/// Next action for a file that is cut off.
const MAKE_ANEW: &str = "Make it again, or copy it anew";
/// Bytes of a face: the number of its corners, and three of them.
const FACE_BYTES: usize = 13;
/// Faces read at once.
const FACES: usize = 4_096;

/// A corner of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlyVertex {
    /// Number of its object; 0 for the static map.
    pub object: u32,
    /// Position in the camera's axes, with colour and weight.
    pub vertex: Vertex,
}

/// Offsets of a vertex's properties.
#[derive(Debug, Default)]
struct VertexLayout {
    bytes: usize,
    position: Option<usize>,
    colour: Option<usize>,
    object: Option<usize>,
    weight: Option<usize>,
    axes: MeshAxes,
}

impl VertexLayout {
    /// Takes in a property; `None` for a type that is not known.
    fn add(&mut self, kind: &str, name: &str) -> Option<()> {
        match (name, kind) {
            ("x", "float") => self.position = Some(self.bytes),
            ("red", "uchar") => self.colour = Some(self.bytes),
            ("object", "int") => self.object = Some(self.bytes),
            ("weight", "uchar") => self.weight = Some(self.bytes),
            _ => {}
        }
        self.bytes += match kind {
            "char" | "uchar" => 1,
            "short" | "ushort" => 2,
            "int" | "uint" | "float" => 4,
            "double" => 8,
            _ => return None,
        };
        Some(())
    }

    /// The vertex in so many bytes.
    fn vertex(&self, bytes: &[u8]) -> Option<PlyVertex> {
        let word = |at: usize| <[u8; 4]>::try_from(bytes.get(at..at + 4)?).ok();
        let metres = |at: usize| word(at).map(f32::from_le_bytes);
        let at = self.position?;
        let colour =
            self.colour.and_then(|at| bytes.get(at..at + 3)?.try_into().ok()).unwrap_or_default();
        let object = self.object.and_then(word).map(u32::from_le_bytes).unwrap_or_default();
        let weight = self.weight.and_then(|at| bytes.get(at).copied()).unwrap_or_default();
        let position_m = self.axes.to_camera([metres(at)?, metres(at + 4)?, metres(at + 8)?]);
        Some(PlyVertex { object, vertex: Vertex { position_m, colour, weight } })
    }
}

/// A mesh file whose header is read.
#[derive(Debug)]
pub struct PlyMesh {
    /// Vertices in the file.
    pub vertices: u64,
    /// Triangles in the file.
    pub triangles: u64,
    corners: PlyVertices,
    faces: File,
    /// Offset of the first face.
    faces_at: u64,
}

/// The vertices of a mesh file, read where they are asked for.
#[derive(Debug)]
pub struct PlyVertices {
    layout: VertexLayout,
    records: Records,
}

impl PlyVertices {
    /// A vertex by its number.
    ///
    /// # Errors
    /// The file ends early, or there is no such vertex.
    pub fn get(&mut self, number: u32) -> io::Result<PlyVertex> {
        let record = self.records.get(u64::from(number))?.ok_or_else(damaged)?;
        self.layout.vertex(record).ok_or_else(damaged)
    }
}

/// Header of a file.
struct Header {
    layout: VertexLayout,
    /// Vertices and faces.
    counts: [u64; 2],
}

/// Reads the header, up to the first vertex.
fn header(file: &mut BufReader<File>, path: &Path) -> Result<Header, FormatError> {
    let refuse = |reason: &str| {
        FormatError::content(path, reason, "Give a binary little-endian PLY of triangles")
    };
    let (mut layout, mut counts, mut element, mut binary) =
        (VertexLayout::default(), [0u64; 2], String::new(), false);
    let mut header = file.by_ref().take(MAX_PLY_HEADER_BYTES);
    loop {
        let mut line = String::new();
        // A file without line breaks is no PLY: 4 KiB of a line are enough.
        let read =
            header.by_ref().take(4_096).read_line(&mut line).map_err(FormatError::read(path))?;
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["end_header"] => break,
            ["format", "binary_little_endian", _] => binary = true,
            ["element", name, count] => {
                let count =
                    count.parse().map_err(|_| refuse("a number of its header cannot be read"))?;
                match name {
                    "vertex" => counts[0] = count,
                    "face" => counts[1] = count,
                    _ => return Err(refuse("it holds more than vertices and faces")),
                }
                element = name.to_owned();
            }
            ["property", "list", "uchar", "uint" | "int", _] if element == "face" => {}
            ["property", kind, name] if element == "vertex" => {
                layout
                    .add(kind, name)
                    .ok_or_else(|| refuse("a type of its header is not known"))?;
            }
            ["comment", ..] => layout.axes.read(&line),
            ["ply"] => {}
            _ if read == 0 => {
                let most = bytes_text(MAX_PLY_HEADER_BYTES);
                return Err(refuse(&format!("its first {most} hold no header of a PLY file")));
            }
            _ => return Err(refuse("its header cannot be read")),
        }
    }
    if layout.bytes > MAX_PLY_VERTEX_BYTES {
        let (found, most) = (layout.bytes, MAX_PLY_VERTEX_BYTES);
        return Err(refuse(&format!("its vertices have {found} bytes; at most {most} are read")));
    }
    if !binary || layout.position.is_none() {
        return Err(refuse("it is not binary, or its vertices have no positions"));
    }
    Ok(Header { layout, counts })
}

impl PlyMesh {
    /// Opens a mesh as [`super::PlyWriter`] writes it, other properties of vertices allowed.
    ///
    /// # Errors
    /// It cannot be read, or is no such mesh.
    pub fn open(path: &Path) -> Result<Self, FormatError> {
        let mut file = BufReader::new(File::open(path).map_err(FormatError::read(path))?);
        let Header { layout, counts } = header(&mut file, path)?;
        let ([vertices, triangles], vertices_at) =
            (counts, file.stream_position().map_err(FormatError::read(path))?);
        let damaged =
            || FormatError::content(path, "it is shorter than its header says", MAKE_ANEW);
        let bytes = |count: u64, size: usize| count.checked_mul(size as u64).ok_or_else(damaged);
        let faces_at =
            bytes(vertices, layout.bytes)?.checked_add(vertices_at).ok_or_else(damaged)?;
        let end = bytes(triangles, FACE_BYTES)?.checked_add(faces_at).ok_or_else(damaged)?;
        let len = file.get_ref().metadata().map_err(FormatError::read(path))?.len();
        if end > len {
            return Err(damaged());
        }
        let open = |at: u64| {
            File::open(path)
                .and_then(|mut file| file.seek(SeekFrom::Start(at)).map(|_| file))
                .map_err(FormatError::read(path))
        };
        let records = Records::new(open(0)?, vertices_at, vertices, layout.bytes);
        Ok(Self {
            vertices,
            triangles,
            corners: PlyVertices { layout, records },
            faces: open(faces_at)?,
            faces_at,
        })
    }

    /// Pieces that are read one after the other.
    pub fn pieces(&self) -> u64 {
        self.triangles.div_ceil(FACES as u64)
    }

    /// Hands every triangle to `sink`, once: corners in the file's order.
    ///
    /// # Errors
    /// The file ends early, a face is not a triangle, or names a vertex that is not there.
    pub fn triangles(mut self, mut sink: impl FnMut([PlyVertex; 3])) -> io::Result<()> {
        self.faces(1, |[a, b, c], vertices| {
            sink([vertices.get(a)?, vertices.get(b)?, vertices.get(c)?]);
            Ok(ControlFlow::Continue(()))
        })
    }

    /// Hands the numbers of corners to `sink` until it breaks off: those in the first of every so
    /// many pieces. It reads the vertices that it does not know.
    ///
    /// # Errors
    /// The file ends early, a face is not a triangle, or `sink` fails.
    pub fn faces(
        &mut self,
        every: usize,
        mut sink: impl FnMut([u32; 3], &mut PlyVertices) -> io::Result<ControlFlow<()>>,
    ) -> io::Result<()> {
        let mut bytes = vec![0; FACES * FACE_BYTES];
        for first in (0..self.triangles).step_by(every.max(1) * FACES) {
            let faces = (self.triangles - first).min(FACES as u64);
            let bytes = &mut bytes[..faces as usize * FACE_BYTES];
            self.faces.seek(SeekFrom::Start(self.faces_at + first * FACE_BYTES as u64))?;
            self.faces.read_exact(bytes)?;
            for face in bytes.as_chunks::<FACE_BYTES>().0 {
                let [3, indices @ ..] = face else { return Err(damaged()) };
                let [a, b, c] = [0, 4, 8].map(|at| {
                    u32::from_le_bytes([
                        indices[at],
                        indices[at + 1],
                        indices[at + 2],
                        indices[at + 3],
                    ])
                });
                if sink([a, b, c], &mut self.corners)?.is_break() {
                    return Ok(());
                }
            }
        }
        Ok(())
    }
}

fn damaged() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, "the mesh is damaged")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::PlyWriter;

    #[test]
    fn gives_the_triangles_that_were_written_and_refuses_what_is_no_mesh() {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("map.ply");
        let mut ply = PlyWriter::begin_in(&path, "a test", crate::formats::Axes::Enu).unwrap();
        // More vertices than a chunk, and than all chunks share a slot.
        let corners = |at: u32| {
            [0.0, 0.1, 0.2].map(|d| Vertex {
                position_m: [at as f32, d, d * d],
                colour: [at as u8, 7, 9],
                weight: (at / 7) as u8,
            })
        };
        (0..9_000).for_each(|at| ply.triangle(corners(at)));
        ply.finish().unwrap();
        let mut read = Vec::new();
        let mesh = PlyMesh::open(&path).unwrap();
        assert_eq!((mesh.vertices, mesh.triangles), (27_000, 9_000));
        mesh.triangles(|triangle| read.push(triangle.map(|corner| corner.vertex))).unwrap();
        assert!(read == (0..9_000).map(corners).collect::<Vec<_>>());
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &whole[..whole.len() - 5]).unwrap();
        assert!(PlyMesh::open(&path).is_err(), "it ends early");
        for text in [
            "",
            "ply\nformat ascii 1.0\nend_header\n",
            "ply\nformat binary_little_endian 1.0\nelement tristrips 1\nend_header\n",
        ] {
            std::fs::write(&path, text).unwrap();
            assert!(
                PlyMesh::open(&path).unwrap_err().to_string().contains("Give a binary"),
                "{text}"
            );
        }
    }
}
