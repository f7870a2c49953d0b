// The core in an instance of its own for each recording.
// Vertices that a tile takes at most: indices have 16 bits.
const TILE_TRIANGLES = 21840;
// Bytes of a triangle as the core writes it, and triangles shown at most.
const TRIANGLE_BYTES = 48, MOST_TRIANGLES = 400000;
// Memory that the mapper has for pairs of one's own, bytes.
const BUDGET = 96 << 20;

class CoreMapper {
  static async make(module) {
    const { exports } = await WebAssembly.instantiate(module, {});
    return Object.assign(new CoreMapper(), { exports, meshAt: 0 });
  }

  beginClip(clip) {
    const { exports } = this, start = exports.reserve(clip.length);
    new Uint8Array(exports.memory.buffer, start, clip.length).set(clip);
    return Boolean(exports.begin_clip(start, clip.length));
  }

  beginPairs({ width, height, focal, baseline }) {
    const { exports } = this, start = exports.reserve(56);
    new Float64Array(exports.memory.buffer, start, 7).set([width, height, focal, (width - 1) / 2, (height - 1) / 2, baseline, BUDGET]);
    return Boolean(exports.begin_pairs(start));
  }

  numbers() {
    return Array.from(new Float64Array(this.exports.memory.buffer, this.exports.numbers(), 18));
  }

  // Maps the next frame; null where there is none.
  step(pair) {
    const { exports } = this;
    if (pair) {
      const before = this.numbers();
      [15, 16].forEach((at, side) => new Uint8Array(exports.memory.buffer, before[at], pair[side].length).set(pair[side]));
    }
    const began = performance.now(), done = exports.step(), ms = performance.now() - began;
    if (done === 0) return null;
    if (done === 2) throw new Error("the mapper refuses this frame: its pictures are too small or differ in size");
    const [width, height, frames, slab, blocks, high, low, severity, ...rest] = this.numbers();
    const pose = rest.slice(0, 7), [leftAt, , disparityAt] = rest.slice(7), { buffer } = exports.memory;
    return {
      width, height, frames, slab, blocks, severity, pose, ms,
      digest: [high, low].map((half) => half.toString(16).padStart(8, "0")).join(""),
      left: new Uint8Array(buffer, leftAt, width * height), disparity: new Uint16Array(buffer, disparityAt, width * height),
    };
  }

  // The map as tiles for the renderer.
  tiles() {
    const { exports } = this;
    this.meshAt = this.meshAt || exports.reserve(TRIANGLE_BYTES * MOST_TRIANGLES);
    const count = Math.min(exports.triangles(this.meshAt, MOST_TRIANGLES), MOST_TRIANGLES), tiles = [];
    for (let first = 0; first < count; first += TILE_TRIANGLES) {
      const triangles = Math.min(TILE_TRIANGLES, count - first);
      tiles.push(tileOf(exports.memory.buffer, this.meshAt + TRIANGLE_BYTES * first, triangles));
    }
    return { tiles, count };
  }
}

// Triangles as the renderer's vertices: positions in 16 bits over the tile's box, normals in an octahedron's two.
function tileOf(buffer, start, triangles) {
  const corners = 3 * triangles, floats = new Float32Array(buffer, start, 4 * corners), given = new Uint8Array(buffer, start, 16 * corners);
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let at = 0; at < corners; at++) {
    for (let axis = 0; axis < 3; axis++) {
      low[axis] = Math.min(low[axis], floats[4 * at + axis]);
      high[axis] = Math.max(high[axis], floats[4 * at + axis]);
    }
  }
  const size = Math.max(...high.map((most, axis) => most - low[axis]), 1e-6);
  const bytes = new Uint8Array(VERTEX_BYTES * corners), words = new Uint16Array(bytes.buffer);
  for (let at = 0; at < corners; at++) {
    if (at % 3 === 0) {
      const normal = faceNormal(floats, 4 * at);
      for (const corner of [0, 1, 2]) bytes.set(normal, VERTEX_BYTES * (at + corner) + 6);
    }
    for (let axis = 0; axis < 3; axis++) words[8 * at + axis] = Math.round((floats[4 * at + axis] - low[axis]) / size * 65535);
    for (const channel of [0, 1, 2]) bytes[VERTEX_BYTES * at + 8 + channel] = given[16 * at + 12 + channel];
  }
  const head = { object: null, low_m: low, high_m: high, size_m: size, triangles };
  return { head, bytes, indices: Uint16Array.from({ length: corners }, (_, at) => at), coarse: new Uint16Array(0) };
}

// Two bytes of the normal of a triangle whose corners lie four floats apart.
function faceNormal(floats, at) {
  const corner = (number) => [0, 1, 2].map((axis) => floats[at + 4 * number + axis]);
  const [a, b, c] = [0, 1, 2].map(corner), [u, v] = [sub(b, a), sub(c, a)];
  let [x, y, z] = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const sum = Math.abs(x) + Math.abs(y) + Math.abs(z) || 1;
  [x, y, z] = [x / sum, y / sum, z / sum];
  if (z < 0) [x, y] = [(1 - Math.abs(y)) * (x < 0 ? -1 : 1), (1 - Math.abs(x)) * (y < 0 ? -1 : 1)];
  return [x, y].map((value) => Math.round(127 * value) & 0xff);
}
