// Meshes and tables out of the page's elements.
async function inflate(id) {
  const element = document.getElementById(id);
  const text = atob(element.textContent);
  element.remove();
  const bytes = new Uint8Array(text.length);
  for (let at = 0; at < text.length; at++) bytes[at] = text.charCodeAt(at);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const readHead = async () => JSON.parse(new TextDecoder().decode(await inflate("dynvox-head")));

// Bytes of a vertex: position 3 x 16 bits, normal 2 x 8, colour 3 x 8, one unused, values 3 x 8, one unused.
const VERTEX_BYTES = 16, VALUE_AT = 12;

// Positions out of planes of differences, each the first words of so many of a vertex.
function decodePositions(planes, words, vertices, size) {
  for (let axis = 0; axis < 3; axis++) {
    const low = 2 * axis * vertices, high = low + vertices;
    for (let at = 0, value = 0; at < vertices; at++) {
      const word = planes[low + at] | planes[high + at] << 8;
      value = value + (word >> 1 ^ -(word & 1)) & 0xffff;
      words[size * at + axis] = value;
    }
  }
}

// A plane of differences as one byte of each vertex.
function decodeBytes(planes, from, bytes, vertices, size, to) {
  for (let at = 0, value = 0; at < vertices; at++) {
    value = value + planes[from + at] & 0xff;
    bytes[size * at + to] = value;
  }
}

// Bytes of a point: position 3 x 16 bits, colour 3 x 8, three unused.
const POINT_BYTES = 12, POINT_COLOUR_AT = 6;

// A cloud's planes as the points that WebGL takes.
function decodeCloud(planes, { points }) {
  const bytes = new Uint8Array(POINT_BYTES * points);
  decodePositions(planes, new Uint16Array(bytes.buffer), points, POINT_BYTES / 2);
  for (const channel of [0, 1, 2]) decodeBytes(planes, (6 + channel) * points, bytes, points, POINT_BYTES, POINT_COLOUR_AT + channel);
  return bytes;
}

// A tile's planes as the vertices and indices that WebGL takes.
function decodeTile(planes, { vertices, triangles }, values) {
  const bytes = new Uint8Array(VERTEX_BYTES * vertices), words = new Uint16Array(bytes.buffer);
  decodePositions(planes, words, vertices, VERTEX_BYTES / 2);
  // Planes of differences, and where they go.
  const bytewise = [8, 9, 10, ...Array.from({ length: values }, (_, value) => VALUE_AT + value)];
  bytewise.forEach((to, number) => decodeBytes(planes, (8 + number) * vertices, bytes, vertices, VERTEX_BYTES, to));
  for (let axis = 0; axis < 2; axis++) {
    const normal = (6 + axis) * vertices;
    for (let at = 0; at < vertices; at++) bytes[VERTEX_BYTES * at + 6 + axis] = planes[normal + at];
  }
  const corners = 3 * triangles, low = (11 + values) * vertices, high = low + corners;
  const indices = new Uint16Array(corners);
  for (let at = 0, named = 0; at < corners; at++) {
    const word = planes[low + at] | planes[high + at] << 8;
    indices[at] = named - word;
    if (word === 0) named++;
  }
  return { bytes, indices };
}

// Triangles between one vertex for each cube of some steps: what a slow machine draws while something moves. A power of two of steps.
function coarseTriangles({ bytes, indices }, bits) {
  const words = new Uint16Array(bytes.buffer), size = VERTEX_BYTES / 2, vertices = words.length / size;
  const keepers = new Map(), kept = new Uint16Array(vertices), coarse = [];
  for (let at = 0; at < vertices; at++) {
    const cell = ((words[size * at] >> bits) * 65536 + (words[size * at + 1] >> bits)) * 65536 + (words[size * at + 2] >> bits);
    if (!keepers.has(cell)) keepers.set(cell, at);
    kept[at] = keepers.get(cell);
  }
  for (let at = 0; at < indices.length; at += 3) {
    const a = kept[indices[at]], b = kept[indices[at + 1]], c = kept[indices[at + 2]];
    if (a !== b && b !== c && c !== a) coarse.push(a, b, c);
  }
  return Uint16Array.from(coarse);
}

// Bits of the cubes that leave about one triangle of sixteen: four edges of this tile long.
function coarseBits({ bytes, indices }) {
  const words = new Uint16Array(bytes.buffer), size = VERTEX_BYTES / 2, every = 3 * Math.max(1, Math.floor(indices.length / 3000));
  let sum = 0, count = 0;
  for (let at = 0; at + 1 < indices.length; at += every, count++) {
    sum += Math.hypot(...[0, 1, 2].map((axis) => words[size * indices[at] + axis] - words[size * indices[at + 1] + axis]));
  }
  return clamp(Math.round(Math.log2(4 * sum / Math.max(count, 1))), 1, 15);
}
