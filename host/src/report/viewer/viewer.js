// The viewer: what is shown, and how the parts of the page change it.
const root = document.getElementById("dynvox-viewer");
const find = (selector) => root.querySelector(selector);
const rgb = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);
const LINES = { camera: "#2f6fde", truth: "#e5484d", now: "#f5b301" };
// Where the edges of the camera's picture lie at a depth of 1, and how far its pyramid is drawn, m.
const PYRAMID = [[-0.85, -0.27], [0.85, -0.27], [0.85, 0.27], [-0.85, 0.27]];
const PYRAMID_M = 1.6;
// Number of the first colour that stands for a value of the surface.
const FIRST_VALUE = 4;
// Boxes along an object's trajectory, at most, and the edges of one between its corners.
const SWEPT_BOXES = 24;
const BOX_EDGES = [0, 1, 2].flatMap((bit) => [0, 1, 2, 3, 4, 5, 6, 7].filter((corner) => !(corner >> bit & 1)).map((corner) => [corner, corner | 1 << bit]));
// Drawing slower than this, ms, draws coarser triangles, and then fewer pixels, until nothing moves.
const SLOW_MS = 40;
// Layers in a sentence each, for those whose name does not say it all.
const LAYER_TITLES = {
  map: "Surface of everything that stands still",
  dynamic: "Objects known to move, at their pose in this frame", static: "Objects known to stand still", uncertain: "Objects whose motion is not known yet",
  later: "Objects that are gone, where they were last seen",
  tracks: "Path of each object",
  swept: "Boxes that an object filled along its path",
  pruned: "Parts of the map that were removed because they were seldom seen",
  planning: "Cells that a planner takes for occupied",
  masks: "Pixels of objects in the left image",
  camera: "Path of the camera, and its view in this frame", truth: "Path that the camera truly took",
};
// Meshes of more triangles have coarse ones as well.
const COARSE_OVER = 60000;

class Viewer {
  constructor(head, renderer) {
    Object.assign(this, { head, renderer, at: Math.floor(head.frames.length / 2), share: 1, isCoarse: Boolean(renderer?.software), triangles: 0, drawn: 0 });
    this.camera = new Camera();
    this.pictures = new Pictures(root, head);
    this.charts = new Charts(find(".charts"), head, (at) => this.go(at));
    this.states = this.statesOfObjects();
    this.layers = this.buildLayers();
    this.buildColours();
    this.readAddress();
    this.buildTime();
    if (renderer) this.buildView();
    this.go(this.at);
  }

  // Motion state of each object's track at each frame: its last one known there.
  statesOfObjects() {
    const states = new Map();
    this.head.tracks.forEach((tracks, at) => tracks.forEach(([id, , state]) => {
      if (!states.has(id)) states.set(id, []);
      states.get(id).push([at, state]);
    }));
    return states;
  }

  stateOf(id) {
    let state = "uncertain";
    for (const [at, known] of this.states.get(id) || []) {
      if (at > this.at) break;
      state = known;
    }
    return state;
  }

  buildLayers() {
    const { head } = this, objects = head.objects.length > 0;
    const known = [
      ["map", "static map", head.tiles.some(({ object }) => object === null)],
      ["dynamic", "dynamic objects", objects], ["static", "static objects", objects], ["uncertain", "uncertain objects", objects],
      ["later", "objects where last seen", objects],
      ["tracks", "tracks", objects || head.tracks.some((tracks) => tracks.length)],
      ["swept", "swept volumes", objects, false],
      ...head.clouds.map(({ layer, name }) => [layer, name, true, false]),
      ["masks", "masks", head.pictures.length > 0 && head.tracks.some((tracks) => tracks.length)],
      ["camera", "camera path", head.poses.length > 0], ["truth", "ground truth", head.truth.length > 0],
    ];
    const layers = {};
    for (const [key, text, there, checked = true] of known) {
      layers[key] = there && checked;
      if (!there) continue;
      const label = document.createElement("label"), box = document.createElement("input");
      label.title = LAYER_TITLES[key] || "";
      Object.assign(box, { type: "checkbox", checked, value: key });
      box.addEventListener("change", () => { layers[key] = box.checked; this.show(); });
      label.append(box, ` ${text}`);
      find(".layers").append(label);
    }
    return layers;
  }

  // Colours by the values that this run's surface has.
  buildColours() {
    this.head.values.forEach((value, at) => {
      if (value) find(".colour").append(new Option(value.name, String(FIRST_VALUE + at)));
    });
  }

  // Between which heights colours differ: y, m.
  heights() {
    const [highest, lowest] = this.head.heights_m;
    return [highest, Math.max(lowest, highest + 0.1)];
  }

  // What the colours mean, where they stand for a value.
  legend(colour) {
    const [highest, lowest] = this.heights(), { values } = this.head, legend = find(".legend");
    const height = colour === 1 && { low: `${(-lowest).toFixed(1)} m`, high: `${(-highest).toFixed(1)} m` };
    const shown = values[colour - FIRST_VALUE] || height;
    legend.hidden = !shown;
    for (const end of ["low", "high"]) legend.querySelector(`.${end}`).textContent = shown ? shown[end] : "";
  }

  // #frame=12&hide=map,tracks&show=pruned&colour=1&view=follow
  readAddress() {
    const given = new URLSearchParams(location.hash.slice(1));
    if (given.has("frame")) this.at = Math.max(0, this.head.frames.findIndex((frame) => frame >= Number(given.get("frame"))));
    for (const [name, checked] of [["hide", false], ["show", true]]) {
      for (const key of (given.get(name) || "").split(",")) {
        const box = find(`.layers input[value="${CSS.escape(key)}"]`);
        if (box) box.checked = this.layers[key] = checked;
      }
    }
    for (const name of ["colour", "view"]) {
      const select = find(name === "view" ? ".mode" : ".colour");
      if ([...select.options].some(({ value }) => value === given.get(name))) select.value = given.get(name);
    }
  }

  buildTime() {
    const slider = find(".slider"), play = find(".play"), last = this.head.frames.length - 1;
    slider.max = Math.max(last, 0);
    slider.addEventListener("input", () => this.go(Number(slider.value)));
    let playing = null;
    const stop = () => { clearInterval(playing); playing = null; play.textContent = "▶"; };
    play.addEventListener("click", () => {
      if (playing) { stop(); return; }
      if (this.at >= last) this.go(0);
      play.textContent = "❚❚";
      playing = setInterval(() => { if (this.at >= last) stop(); else this.go(this.at + 1); }, 100);
    });
    find(".time").hidden = last < 1;
    find(".keys").hidden = false;
    document.addEventListener("keydown", (event) => this.key(event, play));
    window.addEventListener("resize", () => this.show());
  }

  // Space plays, arrows step, F fills the screen; keys of a control are its own.
  key(event, play) {
    const isTaken = event.target.closest?.("input, select, button, summary, a, textarea");
    if (isTaken || event.ctrlKey || event.metaKey || event.altKey) return;
    const actions = {
      Space: () => play.click(),
      ArrowLeft: () => this.go(this.at - 1), ArrowRight: () => this.go(this.at + 1),
      KeyF: () => (document.fullscreenElement ? document.exitFullscreen() : find(".view").requestFullscreen?.()),
    };
    if (!actions[event.code]) return;
    event.preventDefault();
    actions[event.code]();
  }

  buildView() {
    const { head, renderer, camera } = this, canvas = find(".view canvas");
    this.lines = { pyramid: renderer.addLine([], rgb(LINES.now), 1.2, true) };
    const positions = head.poses.map((pose) => pose.slice(0, 3));
    if (positions.length > 1) this.lines.camera = renderer.addLine(positions, rgb(LINES.camera), 1.8);
    if (head.truth.length > 1) this.lines.truth = renderer.addLine(head.truth, rgb(LINES.truth), 1.4);
    this.tracks = head.objects.map(({ id, poses }) => ({ id, line: renderer.addLine(poses.map((pose) => pose.slice(0, 3)), [1, 1, 1], 2.2) }));
    this.swept = head.objects.map(({ id }, at) => ({ id, line: renderer.addLine(this.sweptBoxes(at), [1, 1, 1], 1, true) }));
    steer(canvas, camera, () => find(".mode").value, () => {
      if (["follow", "camera"].includes(find(".mode").value)) find(".mode").value = "orbit";
      this.show();
    });
    find(".mode").addEventListener("change", () => { this.follow(); this.show(); });
    find(".colour").addEventListener("change", () => this.show());
    find(".reset").addEventListener("click", () => { find(".mode").value = "orbit"; this.lookBehind(true); this.show(); });
    this.lookBehind(true);
    find(".controls").hidden = false;
    find(".controls").open = innerWidth > 820;
  }

  // The box around an object's mesh at poses along its trajectory, as pairs of points.
  sweptBoxes(at) {
    const tiles = this.head.tiles.filter(({ object }) => object === at), { poses } = this.head.objects[at];
    if (!tiles.length) return [];
    const side = (most, name) => [0, 1, 2].map((axis) => most(...tiles.map((tile) => tile[name][axis])));
    const low = side(Math.min, "low_m"), high = side(Math.max, "high_m"), every = Math.ceil(poses.length / SWEPT_BOXES);
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((bits) => low.map((least, axis) => (bits >> axis & 1 ? high[axis] : least)));
    return poses.filter((_, pose) => pose % every === 0).flatMap((pose) => {
      const matrix = poseMatrix(pose), points = corners.map((corner) => transform(matrix, corner));
      return BOX_EDGES.flatMap((edge) => edge.map((corner) => points[corner]));
    });
  }

  lookBehind(behind) {
    const pose = this.head.poses[this.at];
    if (!pose) return;
    const matrix = poseMatrix(pose);
    this.camera.lookFrom(pose.slice(0, 3), [matrix[8], matrix[9], matrix[10]], behind);
  }

  follow() {
    const mode = find(".mode").value;
    if (mode === "follow" || mode === "camera") this.lookBehind(mode === "follow");
  }

  go(at) {
    this.at = clamp(at, 0, Math.max(this.head.frames.length - 1, 0));
    if (this.renderer) this.follow();
    this.show();
  }

  // Draws with the next picture of the browser.
  show() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.draw();
    });
  }

  draw() {
    const { head, at } = this, style = getComputedStyle(root), frame = head.frames[at];
    find(".slider").value = at;
    find("output").textContent = frame === undefined ? "no frame" : `frame ${frame}, ${head.times_s[at].toFixed(2)} s`;
    this.pictures.show(frame, this.layers).catch((error) => console.error(error));
    this.charts.draw(at, { line: style.getPropertyValue("--accent"), cursor: LINES.now });
    Object.assign(root.dataset, { frame: String(frame) });
    if (this.renderer) this.draw3d();
  }

  draw3d() {
    const { head, renderer, camera, layers } = this, canvas = find(".view canvas"), began = performance.now();
    const colour = Number(find(".colour").value);
    this.legend(colour);
    const objects = this.posedObjects();
    const lines = Object.entries(this.lines).filter(([key]) => key === "pyramid" ? layers.camera : layers[key]).map(([, line]) => line);
    for (const { id, line } of [...(layers.tracks ? this.tracks : []), ...(layers.swept ? this.swept : [])]) {
      line.colour = rgb(STATE_COLOURS[this.stateOf(id)]);
      lines.push(line);
    }
    renderer.setLine(this.lines.pyramid, this.pyramid());
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    this.triangles = renderer.draw({
      share: this.share, isCoarse: this.isCoarse, clip: camera.clip(canvas.clientWidth / Math.max(canvas.clientHeight, 1)), colour,
      heights: this.heights(),
      background: dark ? [0.07, 0.08, 0.09] : [0.90, 0.92, 0.94], showStatic: layers.map, objects, lines, layers,
    });
    renderer.gl.readPixels(0, 0, 1, 1, renderer.gl.RGBA, renderer.gl.UNSIGNED_BYTE, new Uint8Array(4));
    this.adapt(performance.now() - began);
    Object.assign(root.dataset, { triangles: String(this.triangles), drawn: String(++this.drawn) });
  }

  // Coarser triangles and fewer pixels while drawing is slow, and all of them when nothing has moved for a while.
  adapt(ms) {
    clearTimeout(this.settling);
    if (this.refining) { this.refining = false; return; }
    if (ms > SLOW_MS) {
      if (this.isCoarse) this.share = Math.max(this.share * 0.7, 0.35);
      this.isCoarse = true;
    }
    if (this.share < 1 || this.isCoarse) this.settling = setTimeout(() => this.refine(), 250);
  }

  // Draws everything once.
  refine() {
    const { share, isCoarse } = this;
    Object.assign(this, { share: 1, isCoarse: false, refining: true });
    this.draw3d();
    Object.assign(this, { share, isCoarse });
  }

  // Pose and tint of each object at the current frame; null where it is hidden.
  posedObjects() {
    const { head, layers } = this, now = head.frames[this.at];
    return head.objects.map(({ id, frames, poses }) => {
      let last = -1;
      while (last + 1 < frames.length && frames[last + 1] <= now) last++;
      const state = this.stateOf(id), over = now > frames[frames.length - 1];
      if (last < 0 || !layers[state] || over && !layers.later) return null;
      return { matrix: poseMatrix(poses[last]), tint: rgb(STATE_COLOURS[state]) };
    });
  }

  // The camera's picture as a pyramid, as pairs of points.
  pyramid() {
    const pose = this.head.poses[this.at];
    if (!pose || find(".mode").value === "camera") return [];
    const matrix = poseMatrix(pose), tip = pose.slice(0, 3);
    const corners = PYRAMID.map(([x, y]) => transform(matrix, [x * PYRAMID_M, y * PYRAMID_M, PYRAMID_M]));
    return corners.flatMap((corner, at) => [tip, corner, corner, corners[(at + 1) % 4]]);
  }
}

// Lets the browser paint between two steps of loading.
const breathe = () => new Promise((resolve) => setTimeout(resolve));

async function load() {
  const began = performance.now(), head = await readHead();
  let renderer = null, reason = "this browser has no WebGL 2";
  try {
    renderer = head.tiles.length + head.poses.length > 0 ? Renderer.on(find(".view canvas")) : null;
  } catch (error) {
    reason = `WebGL 2 failed: ${error.message}`;
  }
  const viewer = new Viewer(head, renderer);
  if (renderer) {
    root.classList.add("live");
    const bar = find("progress"), triangles = head.tiles.reduce((sum, tile) => sum + tile.triangles, 0);
    bar.hidden = false;
    let bits = null;
    const decoded = (tile, planes) => {
      const mesh = decodeTile(planes, tile, head.values.length);
      // All tiles of the static map have steps of one size; objects are small.
      if (tile.object === null) bits = bits ?? coarseBits(mesh);
      const coarse = tile.object === null && triangles > COARSE_OVER ? coarseTriangles(mesh, bits) : new Uint16Array(0);
      return { ...mesh, coarse };
    };
    let pause = 0, drawnAt = -Infinity;
    for (const [at, tile] of head.tiles.entries()) {
      renderer.addTile(tile, decoded(tile, await inflate(`dynvox-tile-${at}`)));
      bar.value = (at + 1) / head.tiles.length;
      // Drawing takes a quarter of the time at most, however slow it is.
      if (performance.now() - drawnAt > pause) {
        const before = performance.now();
        viewer.draw();
        drawnAt = performance.now();
        pause = Math.max(3 * (drawnAt - before), 100);
        await breathe();
      }
    }
    for (const [at, cloud] of head.clouds.entries()) renderer.addCloud(cloud, decodeCloud(await inflate(`dynvox-cloud-${at}`), cloud));
    bar.hidden = true;
    clearTimeout(viewer.settling);
    viewer.refine();
    const of = head.tiles.length ? `${triangles.toLocaleString("en")} triangles, of ${head.static_triangles.toLocaleString("en")} of the static map` : "The map is empty";
    find(".note").textContent = of;
  } else {
    find(".reason").textContent = head.frames.length ? `The map as a picture: ${reason}.` : "The run has no frames.";
  }
  Object.assign(root.dataset, { ready: "true", loadMs: String(Math.round(performance.now() - began)) });
  return viewer;
}

load().then((viewer) => { window.dynvoxViewer = viewer; }, (error) => {
  root.classList.remove("live");
  find(".reason").textContent = `The map as a picture: the viewer failed (${error.message}).`;
  console.error(error);
});
