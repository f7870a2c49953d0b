// Tiles and lines on a canvas.
const NO_TINT = [-1, -1, -1];
const IDENTITY = poseMatrix([0, 0, 0, 0, 0, 0, 1]);

// Names of what draws without a graphics card.
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

class Renderer {
  // Null where the browser has no WebGL 2. Smooth edges take a processor twenty times as long as all the rest: there they are left out.
  static on(canvas) {
    const probe = document.createElement("canvas").getContext("webgl2"), names = probe && probe.getExtension("WEBGL_debug_renderer_info");
    const software = SOFTWARE.test(probe ? probe.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : probe.RENDERER) : "");
    const gl = canvas.getContext("webgl2", { antialias: !software, alpha: false, preserveDrawingBuffer: true });
    return gl ? new Renderer(canvas, gl, software) : null;
  }

  constructor(canvas, gl, software) {
    Object.assign(this, { canvas, gl, software });
    this.mesh = this.program(MESH_VERTEX, MESH_FRAGMENT, ["a_position", "a_normal", "a_colour", "a_values"]);
    this.line = this.program(LINE_VERTEX, LINE_FRAGMENT, ["a_from", "a_to"]);
    this.cloud = this.program(CLOUD_VERTEX, MESH_FRAGMENT, ["a_position", "a_colour"]);
    this.tiles = [];
    this.clouds = [];
    gl.enable(gl.DEPTH_TEST);
  }

  program(vertex, fragment, attributes) {
    const { gl } = this, program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    attributes.forEach((name, at) => gl.bindAttribLocation(program, at, name));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) || "a shader does not link");
    const uniforms = {};
    for (let at = 0; at < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); at++) {
      const { name } = gl.getActiveUniform(program, at);
      uniforms[name] = gl.getUniformLocation(program, name);
    }
    return { program, uniforms };
  }

  addTile(head, { bytes, indices, coarse }) {
    const { gl } = this, array = gl.createVertexArray(), buffers = [gl.createBuffer(), gl.createBuffer()];
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers[0]);
    gl.bufferData(gl.ARRAY_BUFFER, bytes, gl.STATIC_DRAW);
    [[3, gl.UNSIGNED_SHORT, 0], [2, gl.BYTE, 6], [3, gl.UNSIGNED_BYTE, 8], [3, gl.UNSIGNED_BYTE, VALUE_AT]].forEach(([size, kind, offset], at) => {
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, size, kind, true, VERTEX_BYTES, offset);
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers[1]);
    // All triangles, and behind them the few that stand for them while something moves.
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, 2 * (indices.length + coarse.length), gl.STATIC_DRAW);
    gl.bufferSubData(gl.ELEMENT_ARRAY_BUFFER, 0, indices);
    gl.bufferSubData(gl.ELEMENT_ARRAY_BUFFER, 2 * indices.length, coarse);
    gl.bindVertexArray(null);
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((bits) => head.low_m.map((low, axis) => (bits >> axis & 1 ? head.high_m[axis] : low)));
    this.tiles.push({ head, array, buffers, whole: [0, indices.length], coarse: [indices.length, coarse.length], corners });
  }

  // Removes the tiles whose heads are gone, or all: a map that grows is drawn from new ones.
  removeTiles(isGone = () => true) {
    const { gl } = this, gone = this.tiles.filter(({ head }) => isGone(head));
    for (const { array, buffers } of gone) {
      gl.deleteVertexArray(array);
      buffers.forEach((buffer) => gl.deleteBuffer(buffer));
    }
    this.tiles = this.tiles.filter((tile) => !gone.includes(tile));
  }

  addCloud(head, bytes) {
    const { gl } = this, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, bytes, gl.STATIC_DRAW);
    [[gl.UNSIGNED_SHORT, 0], [gl.UNSIGNED_BYTE, POINT_COLOUR_AT]].forEach(([kind, offset], at) => {
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, 3, kind, true, POINT_BYTES, offset);
    });
    gl.bindVertexArray(null);
    this.clouds.push({ head, array });
  }

  // A line through points, or pieces between pairs of them.
  addLine(points, colour, widthPx, pairs = false) {
    const { gl } = this, array = gl.createVertexArray(), buffer = gl.createBuffer();
    const line = { array, buffer, colour, widthPx, pairs, count: 0 };
    this.setLine(line, points);
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    for (const at of [0, 1]) {
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, 3, gl.FLOAT, false, pairs ? 24 : 12, 12 * at);
      gl.vertexAttribDivisor(at, 1);
    }
    gl.bindVertexArray(null);
    return line;
  }

  setLine(line, points) {
    const { gl } = this;
    line.count = line.pairs ? points.length >> 1 : Math.max(points.length - 1, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, line.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(points.flat()), gl.DYNAMIC_DRAW);
  }

  // Draws at a share of the canvas's own pixels, and with the tiles' coarse triangles where they are asked for and there. `objects` gives pose and tint of each object, or null where it is hidden.
  draw({ share, isCoarse, clip, colour, heights, background, showStatic, objects, lines, layers }) {
    const { gl, canvas } = this;
    const ratio = Math.min(window.devicePixelRatio || 1, 2) * share;
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio)), height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.clearColor(...background, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const triangles = this.drawTiles({ clip, colour, heights, isCoarse, showStatic, objects });
    this.drawClouds(clip, layers, height);
    const { program, uniforms } = this.line;
    gl.useProgram(program);
    gl.uniformMatrix4fv(uniforms.u_clip_world, false, clip);
    gl.uniform2f(uniforms.u_px, width, height);
    for (const line of lines) {
      gl.uniform3fv(uniforms.u_colour, line.colour);
      gl.uniform1f(uniforms.u_width_px, line.widthPx * ratio);
      gl.bindVertexArray(line.array);
      if (line.count) gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, line.count);
    }
    return triangles;
  }

  // The clouds of the layers that are on.
  drawClouds(clip, layers, heightPx) {
    const { gl } = this, { program, uniforms } = this.cloud;
    gl.useProgram(program);
    gl.uniformMatrix4fv(uniforms.u_clip_world, false, clip);
    for (const { head, array } of this.clouds.filter((cloud) => layers[cloud.head.layer])) {
      gl.uniform3fv(uniforms.u_low, head.low_m);
      gl.uniform1f(uniforms.u_size, head.size_m);
      gl.uniform1f(uniforms.u_side, head.side_m * heightPx / 2 / Math.tan(VERTICAL_RAD / 2));
      gl.bindVertexArray(array);
      gl.drawArrays(gl.POINTS, 0, head.points);
    }
  }

  drawTiles({ clip, colour, heights, isCoarse, showStatic, objects }) {
    const { gl } = this, { program, uniforms } = this.mesh;
    gl.useProgram(program);
    gl.uniformMatrix4fv(uniforms.u_clip_world, false, clip);
    gl.uniform1i(uniforms.u_colour, colour);
    gl.uniform2fv(uniforms.u_heights, heights);
    let triangles = 0;
    for (const { head, array, whole, coarse, corners } of this.tiles) {
      const object = head.object === null ? (showStatic ? { matrix: IDENTITY, tint: NO_TINT } : null) : objects[head.object];
      if (!object || isOutside(multiply(clip, object.matrix), corners)) continue;
      gl.uniformMatrix4fv(uniforms.u_world_mesh, false, object.matrix);
      gl.uniform3fv(uniforms.u_low, head.low_m);
      gl.uniform1f(uniforms.u_size, head.size_m);
      gl.uniform3fv(uniforms.u_tint, object.tint);
      gl.bindVertexArray(array);
      const [first, count] = isCoarse && coarse[1] ? coarse : whole;
      gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_SHORT, 2 * first);
      triangles += count / 3;
    }
    return triangles;
  }
}

// Whether all corners of a box lie beyond one side of the view.
function isOutside(clip, corners) {
  const seen = corners.map((corner) => [0, 1, 2, 3].map((row) => clip[row] * corner[0] + clip[4 + row] * corner[1] + clip[8 + row] * corner[2] + clip[12 + row]));
  return [0, 1, 2].some((axis) => seen.every((at) => at[axis] > at[3]) || seen.every((at) => at[axis] < -at[3]));
}
