// Vectors as arrays of three numbers, matrices as columns. Axes: x right, y down, z forward.
const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scale = (a, factor) => [a[0] * factor, a[1] * factor, a[2] * factor];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const length = (a) => Math.hypot(a[0], a[1], a[2]);
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

// A pose [x, y, z, i, j, k, w] as a 4 x 4 matrix.
function poseMatrix([x, y, z, i, j, k, w]) {
  return new Float32Array([
    1 - 2 * (j * j + k * k), 2 * (i * j + k * w), 2 * (i * k - j * w), 0,
    2 * (i * j - k * w), 1 - 2 * (i * i + k * k), 2 * (j * k + i * w), 0,
    2 * (i * k + j * w), 2 * (j * k - i * w), 1 - 2 * (i * i + j * j), 0,
    x, y, z, 1,
  ]);
}

function multiply(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      let sum = 0;
      for (let at = 0; at < 4; at++) sum += a[at * 4 + row] * b[column * 4 + at];
      out[column * 4 + row] = sum;
    }
  }
  return out;
}

const transform = (m, p) => [0, 1, 2].map((row) => m[row] * p[0] + m[4 + row] * p[1] + m[8 + row] * p[2] + m[12 + row]);

// From camera axes (y down, z forward) at an eye to clip coordinates.
function clipMatrix(eye, [right, down, forward], verticalRad, aspect, near, far) {
  const f = 1 / Math.tan(verticalRad / 2);
  const row = (axis, factor) => [...scale(axis, factor), -dot(axis, eye) * factor];
  const z = (far + near) / (far - near), shift = -2 * far * near / (far - near);
  const x = row(right, f / aspect), y = row(down, -f), depth = row(forward, z), w = row(forward, 1);
  depth[3] += shift;
  const out = new Float32Array(16);
  [x, y, depth, w].forEach((values, at) => values.forEach((value, column) => { out[column * 4 + at] = value; }));
  return out;
}
