// Everything is computed at the vertices: a processor that stands in for a graphics card has more pixels than vertices to do.
const MESH_VERTEX = `#version 300 es
uniform mat4 u_clip_world, u_world_mesh;
uniform vec3 u_low, u_tint;
uniform float u_size;
uniform vec2 u_heights;
uniform int u_colour;
in vec3 a_position;
in vec2 a_normal;
in vec3 a_colour;
in vec3 a_values;
out vec3 v_colour;
vec3 turbo(float x) {
  vec4 p = vec4(1.0, x, x * x, x * x * x); vec2 q = p.zw * p.z;
  return vec3(
    dot(p, vec4(0.1357, 4.6154, -42.6603, 132.1311)) + dot(q, vec2(-152.9424, 59.2864)),
    dot(p, vec4(0.0914, 2.1942, 4.8430, -14.1850)) + dot(q, vec2(4.2773, 2.8296)),
    dot(p, vec4(0.1067, 12.6419, -60.5820, 110.3628)) + dot(q, vec2(-89.9031, 27.3482)));
}
void main() {
  vec4 world = u_world_mesh * vec4(u_low + u_size * a_position, 1.0);
  vec3 n = vec3(a_normal, 1.0 - abs(a_normal.x) - abs(a_normal.y));
  float fold = max(-n.z, 0.0);
  n.xy -= vec2(n.x < 0.0 ? -fold : fold, n.y < 0.0 ? -fold : fold);
  n = normalize(mat3(u_world_mesh) * n);
  float light = 0.5 + 0.5 * dot(n, vec3(-0.36, -0.80, -0.48));
  bool tinted = u_tint.r >= 0.0;
  vec3 base = vec3(0.80, 0.80, 0.78);
  float ambient = 0.35;
  if (u_colour == 0 && a_colour != vec3(0.0)) { base = a_colour; ambient = 0.72; }
  if (u_colour == 1) { base = turbo(clamp((u_heights.y - world.y) / (u_heights.y - u_heights.x), 0.0, 1.0)); ambient = 0.5; }
  if (u_colour == 2) { base = 0.5 - 0.5 * n; ambient = 1.0; }
  if (u_colour == 3) { if (tinted) base = u_tint; else base = vec3(0.62, 0.64, 0.66); ambient = 0.3; }
  if (u_colour > 3) {
    float value = 255.0 * a_values[u_colour - 4];
    if (value > 0.5) { base = turbo((value - 1.0) / 254.0); ambient = 0.6; }
  }
  if (u_colour == 0 && tinted) base = mix(base, u_tint, 0.35);
  v_colour = base * (ambient + (1.1 - ambient) * light);
  gl_Position = u_clip_world * world;
}`;
const MESH_FRAGMENT = `#version 300 es
precision mediump float;
in vec3 v_colour;
out vec4 o_colour;
void main() { o_colour = vec4(v_colour, 1.0); }`;
// Points as squares whose side is a length in the world.
const CLOUD_VERTEX = `#version 300 es
uniform mat4 u_clip_world;
uniform vec3 u_low;
uniform float u_size, u_side;
in vec3 a_position, a_colour;
out vec3 v_colour;
void main() {
  gl_Position = u_clip_world * vec4(u_low + u_size * a_position, 1.0);
  gl_PointSize = clamp(u_side / max(gl_Position.w, 0.05), 1.5, 96.0);
  v_colour = a_colour;
}`;
// A line as a strip of constant width on the screen: each instance is a piece between two points.
const LINE_VERTEX = `#version 300 es
uniform mat4 u_clip_world;
uniform vec2 u_px;
uniform float u_width_px;
in vec3 a_from, a_to;
void main() {
  vec4 from = u_clip_world * vec4(a_from, 1.0), to = u_clip_world * vec4(a_to, 1.0);
  float near = 0.05;
  if (from.w < near && to.w < near) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
  if (from.w < near) from = mix(from, to, (near - from.w) / (to.w - from.w));
  if (to.w < near) to = mix(to, from, (near - to.w) / (from.w - to.w));
  vec2 along = (to.xy / to.w - from.xy / from.w) * u_px;
  along = length(along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
  vec4 end = gl_VertexID < 2 ? from : to;
  float side = (gl_VertexID & 1) == 0 ? 1.0 : -1.0;
  gl_Position = end + vec4(side * u_width_px * vec2(-along.y, along.x) / u_px * end.w, -2e-4 * end.w, 0.0);
}`;
const LINE_FRAGMENT = `#version 300 es
precision mediump float;
uniform vec3 u_colour;
out vec4 o_colour;
void main() { o_colour = vec4(u_colour, 1.0); }`;
