//! The map as a binary PLY, streamed: triangles go to disk as they come, and the header's counts
//! are filled in at the end.
//!
//! A vertex has position, normal (the mean over its triangles by area), colour, weight and the
//! number of the object it belongs to. Memory: a window of [`WINDOW`] recent vertices that may come
//! again, so that triangles share them, and the records of those written last, whose normals grow.
//! The mesh itself is never in memory. Vertices that fall out of the window are written again when
//! they return, which costs bytes, not correctness.

use super::records::Records;
use super::{Axes, MeshAxes};
use crate::owned;
use dynvox_core::view::{MeshSink, Triangle, Vertex};
use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

/// Vertices remembered for sharing.
const WINDOW: usize = 1 << 19;
/// Number of the latest vertices that are searched first, since they fit the processor's fastest
/// memory. A divisor of [`WINDOW`].
const LATEST: usize = 1 << 10;
/// Bytes of faces written at once.
const FACES: usize = 1 << 17;
/// Digits of a count in the header.
const DIGITS: usize = 10;
/// Bytes of a vertex: position and normal of three floats, three bytes of colour, the weight, the
/// object's number.
const VERTEX_BYTES: usize = 32;
/// Bytes of a vertex's colour.
const COLOUR_BYTES: usize = 3;
/// Offset of a vertex's normal, bytes.
const NORMAL: usize = 12;
const POSITION: &str = "property float x\nproperty float y\nproperty float z\n\
                        property float nx\nproperty float ny\nproperty float nz\n";
const COLOUR: &str = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
const REST: &str = "property uchar weight\nproperty int object\n";

/// Counts of a written mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mesh {
    /// Vertices in the file.
    pub vertices: u64,
    /// Triangles in the file.
    pub triangles: u64,
    /// Number of triangles that belong to objects.
    pub object_triangles: u64,
}

impl Mesh {
    /// Triangles of the static map.
    pub fn static_triangles(&self) -> u64 {
        self.triangles - self.object_triangles
    }
}

/// A vertex as bits (position; colour and weight), and the number of the record behind its own. All
/// 0 where no vertex was seen.
type Recent = [u32; 5];

/// Writes one PLY.
pub struct PlyWriter {
    vertices: Records,
    faces: BufWriter<File>,
    axes: MeshAxes,
    /// Vertices have colours.
    colour: bool,
    vertex_count_at: u64,
    face_count_at: u64,
    /// Recent vertices, each in the slot of its hash. Untouched slots cost no memory.
    window: Vec<Recent>,
    /// The vertices that entered the window last, or were found in it, each in the slot of its
    /// hash. What leaves the window leaves this too: the slot of the one decides that of the other.
    latest: Vec<Recent>,
    /// Vertices written before the object: they are not its own.
    others: u32,
    /// Number of the object that triangles belong to; 0 for the static map.
    object: u32,
    mesh: Mesh,
    failed: Option<io::Error>,
}

impl PlyWriter {
    /// Begins the file. Faces wait in a second file without a name: they stand after all vertices.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn begin(path: &Path) -> io::Result<Self> {
        Self::begin_in(path, "the first camera", Axes::Camera)
    }

    /// Begins a file like [`PlyWriter::begin`], with the name of the frame of reference for the
    /// header. Triangles come in the camera's axes, and are written in `axes`.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn begin_in(path: &Path, frame: &str, axes: Axes) -> io::Result<Self> {
        Self::begin_with(path, frame, axes, true)
    }

    /// Begins a file like [`PlyWriter::begin_in`]; without `colour` its vertices have no colours,
    /// so that viewers do not show a map of grey images as black.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn begin_with(
        path: &Path,
        frame: &str,
        axes: impl Into<MeshAxes>,
        colour: bool,
    ) -> io::Result<Self> {
        let axes = axes.into();
        let mut file = BufWriter::new(owned::create_file(path)?);
        write!(file, "ply\nformat binary_little_endian 1.0\n{}", axes.comments(frame))?;
        writeln!(
            file,
            "comment object: 0 for the static map, otherwise the number of the object's track"
        )?;
        let vertex_count_at = count_line(&mut file, "element vertex ")?;
        write!(file, "{POSITION}{}{REST}", if colour { COLOUR } else { "" })?;
        let face_count_at = count_line(&mut file, "element face ")?;
        file.write_all(b"property list uchar uint vertex_indices\nend_header\n")?;
        let start = file.stream_position()?;
        let file = file.into_inner().map_err(|error| error.into_error())?;
        let faces = owned::create_unnamed(&path.with_extension("faces"))?;
        Ok(Self {
            vertices: Records::new(file, start, 0, vertex_bytes(colour)),
            faces: BufWriter::with_capacity(FACES, faces),
            axes,
            colour,
            vertex_count_at,
            face_count_at,
            window: vec![[0; 5]; WINDOW],
            latest: vec![[0; 5]; LATEST],
            others: 0,
            object: 0,
            mesh: Mesh::default(),
            failed: None,
        })
    }

    /// Triangles from here on belong to an object: the number of its track.
    pub fn begin_object(&mut self, number: u32) {
        self.object = number;
        self.others = self.vertices.len().try_into().unwrap_or(u32::MAX);
    }

    /// Adds a triangle whose vertices any other may have. [`PlyWriter::finish`] returns a failure,
    /// so that callbacks need no error path.
    pub fn triangle(&mut self, vertices: [Vertex; 3]) {
        let names = vertices.map(|vertex| self.vertex(&vertex, true));
        MeshSink::triangle(self, &Triangle { vertices }, names);
    }

    fn try_triangle(&mut self, vertices: [Vertex; 3], indices: [u32; 3]) -> io::Result<()> {
        let normal = area_normal(vertices.map(|vertex| self.axes.of_camera(vertex.position_m)));
        let mut face = [3u8; 13];
        for (bytes, index) in face[1..].chunks_exact_mut(4).zip(indices) {
            bytes.copy_from_slice(&index.to_le_bytes());
            self.vertices.change(u64::from(index), |vertex| add_normal(vertex, normal))?;
        }
        self.mesh.triangles += 1;
        self.mesh.object_triangles += u64::from(self.object != 0);
        self.faces.write_all(&face)
    }

    /// The position of a vertex in the file; it is written if it is not among the recent ones.
    fn index_of(&mut self, vertex: &Vertex) -> io::Result<u32> {
        let [x, y, z] = vertex.position_m.map(f32::to_bits);
        let [red, green, blue] = vertex.colour;
        let bits = [x, y, z, u32::from_le_bytes([red, green, blue, vertex.weight])];
        let key = bits[..3]
            .iter()
            .fold(0u32, |key, bits| (key ^ bits).wrapping_mul(0x9E37_79B1).rotate_left(13))
            as usize;
        let known = |[x, y, z, rest, next]: Recent| {
            ([x, y, z, rest] == bits && next > self.others).then(|| next.wrapping_sub(1))
        };
        let latest = &mut self.latest[key % LATEST];
        if let Some(index) = known(*latest) {
            return Ok(index);
        }
        let slot = &mut self.window[key % WINDOW];
        if let Some(index) = known(*slot) {
            *latest = *slot;
            return Ok(index);
        }
        let index = self.append(vertex)?;
        let [x, y, z, rest] = bits;
        let recent = [x, y, z, rest, index + 1];
        (self.window[key % WINDOW], self.latest[key % LATEST]) = (recent, recent);
        Ok(index)
    }

    /// Writes a vertex and returns its position in the file.
    fn append(&mut self, Vertex { position_m, colour, weight }: &Vertex) -> io::Result<u32> {
        let next = u32::try_from(self.vertices.len() + 1)
            .map_err(|_| io::Error::other("a PLY holds at most 2^32 - 1 vertices"))?;
        let mut record = [0; VERTEX_BYTES];
        for (bytes, value) in record.chunks_exact_mut(4).zip(self.axes.of_camera(*position_m)) {
            bytes.copy_from_slice(&value.to_le_bytes());
        }
        let weight_at = if self.colour {
            record[24..24 + COLOUR_BYTES].copy_from_slice(colour);
            24 + COLOUR_BYTES
        } else {
            24
        };
        record[weight_at] = *weight;
        record[weight_at + 1..weight_at + 5].copy_from_slice(&self.object.to_le_bytes());
        self.vertices.push(&record[..vertex_bytes(self.colour)])?;
        Ok(next - 1)
    }

    /// Appends the faces and fills in the counts. After a failure what is at the path is not a PLY.
    ///
    /// # Errors
    /// The disk refused, now or before.
    pub fn finish(mut self) -> io::Result<Mesh> {
        if let Some(error) = self.failed {
            return Err(error);
        }
        self.mesh.vertices = self.vertices.len();
        let mut file = self.vertices.finish(normalize)?;
        file.seek(SeekFrom::End(0))?;
        self.faces.flush()?;
        let mut faces = self.faces.into_inner().map_err(|error| error.into_error())?;
        faces.seek(SeekFrom::Start(0))?;
        io::copy(&mut faces, &mut file)?;
        drop(faces);
        for (at, count) in
            [(self.vertex_count_at, self.mesh.vertices), (self.face_count_at, self.mesh.triangles)]
        {
            file.seek(SeekFrom::Start(at))?;
            write!(file, "{count:0DIGITS$}")?;
        }
        file.flush()?;
        Ok(self.mesh)
    }
}

impl MeshSink for PlyWriter {
    /// Position of a vertex in the file.
    type Name = u32;

    fn vertex(&mut self, vertex: &Vertex, may_recur: bool) -> u32 {
        if self.failed.is_some() {
            return 0;
        }
        let index = if may_recur { self.index_of(vertex) } else { self.append(vertex) };
        index.unwrap_or_else(|error| {
            self.failed = Some(error);
            0
        })
    }

    fn triangle(&mut self, triangle: &Triangle, names: [u32; 3]) {
        if self.failed.is_none() {
            self.failed = self.try_triangle(triangle.vertices, names).err();
        }
    }
}

/// The normal of a triangle, twice as long as its area is large.
fn area_normal([a, b, c]: [[f32; 3]; 3]) -> [f32; 3] {
    let [a, b, c] = [a, b, c].map(nalgebra::Vector3::from);
    (b - a).cross(&(c - a)).into()
}

fn normal_of(vertex: &[u8]) -> [f32; 3] {
    [0, 1, 2].map(|axis| {
        let at = NORMAL + 4 * axis;
        f32::from_le_bytes([vertex[at], vertex[at + 1], vertex[at + 2], vertex[at + 3]])
    })
}

fn set_normal(vertex: &mut [u8], normal: [f32; 3]) {
    for (bytes, value) in vertex[NORMAL..].chunks_exact_mut(4).zip(normal) {
        bytes.copy_from_slice(&value.to_le_bytes());
    }
}

fn add_normal(vertex: &mut [u8], normal: [f32; 3]) {
    let sum = normal_of(vertex);
    set_normal(vertex, [0, 1, 2].map(|axis| sum[axis] + normal[axis]));
}

fn normalize(vertex: &mut [u8]) {
    let normal = nalgebra::Vector3::from(normal_of(vertex));
    set_normal(vertex, normal.try_normalize(f32::MIN_POSITIVE).unwrap_or_default().into());
}

/// Bytes of a vertex with or without colour.
fn vertex_bytes(colour: bool) -> usize {
    if colour { VERTEX_BYTES } else { VERTEX_BYTES - COLOUR_BYTES }
}

/// Writes a header line with space for a count and returns the position of the count.
fn count_line(file: &mut BufWriter<File>, line: &str) -> io::Result<u64> {
    file.write_all(line.as_bytes())?;
    let at = file.stream_position()?;
    writeln!(file, "{:0DIGITS$}", 0)?;
    Ok(at)
}
