// The page: the clip inside it, or files that are dropped on it, mapped frame by frame.
const root = document.getElementById("dynvox-viewer");
const find = (selector) => document.querySelector(selector);
// The map is drawn anew every so many frames, and in the end.
const MESH_EVERY = 4;
// Heights between which colours differ, m: y points down, and the road lies 1.7 m below the camera.
const HEIGHTS_M = [-3.5, 2.6];
const PATH_COLOUR = [0.18, 0.44, 0.87];

// Bytes of the clip out of differences; see pack.mjs.
function undo(bytes, width) {
  for (let at = 0; at < bytes.length; at++) {
    const a = bytes[at - 1] ?? 0, b = bytes[at - width] ?? 0, c = bytes[at - width - 1] ?? 0, p = a + b - c;
    const toA = Math.abs(p - a), toB = Math.abs(p - b), toC = Math.abs(p - c);
    bytes[at] += toA <= toB && toA <= toC ? a : toB <= toC ? b : c;
  }
  return bytes;
}

class Page {
  constructor(module, clip, expected) {
    Object.assign(this, { module, clip, expected, camera: new Camera(), run: 0, poses: [] });
    this.renderer = Renderer.on(find(".view canvas"));
    if (this.renderer) {
      this.path = this.renderer.addLine([], PATH_COLOUR, 1.8);
      steer(find(".view canvas"), this.camera, () => "orbit", () => { this.isSteered = true; this.draw(); });
    } else {
      find(".note").textContent = "The map needs a browser with WebGL 2; digests and pictures do not.";
    }
    find(".colour").addEventListener("change", () => this.draw());
    find(".again").addEventListener("click", () => this.mapClip());
    window.addEventListener("resize", () => this.draw());
    find(".own").elements.files.addEventListener("change", (event) => this.mapFiles([...event.target.files]));
    const hold = (event, on) => { event.preventDefault(); document.body.classList.toggle("dropping", on); };
    document.addEventListener("dragover", (event) => hold(event, true));
    document.addEventListener("dragleave", (event) => hold(event, false));
    document.addEventListener("drop", async (event) => { hold(event, false); this.mapFiles(await droppedFiles(event.dataTransfer)); });
  }

  say(text) {
    find(".state").textContent = text;
  }

  async mapClip() {
    const mapper = await CoreMapper.make(this.module);
    if (!mapper.beginClip(this.clip)) throw new Error("the clip inside the page is damaged");
    await this.map(mapper, async () => undefined, this.expected);
  }

  async mapFiles(files) {
    const form = find(".own");
    if (!files.length || !form.reportValidity()) return;
    const [focal, baseline, rate, width] = ["focal", "baseline", "rate", "width"].map((name) => Number(form.elements[name].value));
    try {
      const { shrink, next } = await sourceOf(files, { rate, width }), mapper = await CoreMapper.make(this.module);
      const settings = { width: shrink.width, height: shrink.height, focal: focal * shrink.share, baseline };
      if (!mapper.beginPairs(settings)) throw new Error(`pairs of ${shrink.width} x ${shrink.height} px with a focal length of ${focal} px and a baseline of ${baseline} m are refused: check these figures`);
      await this.map(mapper, next, null);
    } catch (error) {
      this.say(`Not mapped: ${error.message}.`);
    }
  }

  // Maps until the pairs end, or another recording begins.
  async map(mapper, next, expected) {
    const run = ++this.run, times = [];
    Object.assign(this, { poses: [], isSteered: false });
    find(".digests tbody").replaceChildren();
    Object.assign(root.dataset, { done: "false", equal: "0", frames: "0" });
    let equal = 0, affected = 0;
    this.say(expected ? "Mapping the synthetic street." : "Mapping your recording.");
    for (let at = 0; ; at++) {
      const pair = await next();
      if (this.run !== run) return;
      const frame = pair === null ? null : mapper.step(pair);
      if (!frame) break;
      times.push(frame.ms);
      affected += Number(frame.severity === 2);
      this.poses.push(frame.pose);
      const same = expected ? frame.digest === expected[at] : null;
      equal += Number(same === true);
      this.show(frame, { times, equal, expected, same, at });
      if (at % MESH_EVERY === 0) this.showMap(mapper);
      // Lets the browser paint.
      await new Promise((resolve) => setTimeout(resolve));
      if (this.run !== run) return;
    }
    this.showMap(mapper);
    const rest = affected ? ` In ${affected} frames the map was affected: the camera was lost or memory was short. Check focal length, baseline and that pictures are rectified.` : "";
    this.say(!expected ? `Done: ${times.length} frames.${rest}` : equal === expected.length ? `All ${equal} digests are the ones that every other machine computes.` : `${equal} of ${expected.length} digests are equal: this browser computes other bits. Please report it with its name and version.`);
    Object.assign(root.dataset, { done: "true" });
  }

  show(frame, { times, equal, expected, same, at }) {
    const seconds = times.reduce((sum, ms) => sum + ms, 0) / 1000;
    const way = this.poses.slice(1).reduce((sum, pose, before) => sum + length(sub(pose.slice(0, 3), this.poses[before].slice(0, 3))), 0);
    find(".frames").textContent = times.length;
    find(".rate").textContent = (times.length / seconds).toFixed(1);
    find(".slab").textContent = (frame.slab / 1048576).toFixed(1);
    find(".way").textContent = way.toFixed(1);
    find(".equal").textContent = expected ? `${equal} of ${expected.length}` : "-";
    find(".equal").className = same === null ? "equal" : `equal ${equal === times.length ? "same" : "differs"}`;
    Object.assign(root.dataset, { frames: String(times.length), equal: String(equal), rate: (times.length / seconds).toFixed(2), firstMs: String(Math.round(this.firstMs ??= performance.now())) });
    const row = find(".digests tbody").insertRow(0);
    for (const text of [at, same === null ? "" : same ? "equal" : "DIFFERS", frame.digest, expected ? expected[at] : ""]) row.insertCell().textContent = text;
    row.cells[0].className = "n";
    row.cells[1].className = same === null ? "" : same ? "same" : "differs";
    paint(find("canvas.left"), frame, (pixel) => { const grey = frame.left[pixel]; return [grey, grey, grey]; });
    // Half of the widest disparity that the matcher looks for is red.
    paint(find("canvas.disparity"), frame, (pixel) => turbo(frame.disparity[pixel] / 256 / (frame.width / 8)));
  }

  showMap(mapper) {
    if (!this.renderer) return;
    const { tiles, count } = mapper.tiles(), last = this.poses[this.poses.length - 1];
    this.renderer.removeTiles();
    for (const tile of tiles) this.renderer.addTile(tile.head, tile);
    this.renderer.setLine(this.path, this.poses.map((pose) => pose.slice(0, 3)));
    if (last && !this.isSteered) {
      const matrix = poseMatrix(last);
      this.camera.lookFrom(last.slice(0, 3), [matrix[8], matrix[9], matrix[10]], true);
    }
    find(".note").textContent = `${count.toLocaleString("en")} triangles`;
    root.dataset.triangles = String(count);
    this.draw();
  }

  draw() {
    if (!this.renderer) return;
    const canvas = find(".view canvas"), dark = matchMedia("(prefers-color-scheme: dark)").matches;
    this.renderer.draw({
      share: 1, isCoarse: false, clip: this.camera.clip(canvas.clientWidth / Math.max(canvas.clientHeight, 1)),
      colour: Number(find(".colour").value), heights: HEIGHTS_M, background: dark ? [0.07, 0.08, 0.09] : [0.90, 0.92, 0.94],
      showStatic: true, objects: [], lines: [this.path], layers: {},
    });
  }
}

// A picture of a frame, pixel by pixel.
function paint(canvas, { width, height }, colourOf) {
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const context = canvas.getContext("2d"), image = context.createImageData(width, height);
  for (let pixel = 0; pixel < width * height; pixel++) image.data.set([...colourOf(pixel), 255], 4 * pixel);
  context.putImageData(image, 0, 0);
}

// Colours from blue (far) to red (near); black for none.
function turbo(share) {
  if (share <= 0) return [0, 0, 0];
  const x = clamp(share, 0, 1), ramp = (at) => 255 * clamp(1.5 - Math.abs(4 * x - at), 0, 1);
  return [ramp(3), ramp(2), ramp(1)];
}

async function start() {
  const expected = document.getElementById("dynvox-digests").textContent.split(" ");
  const width = Number(document.getElementById("dynvox-clip").dataset.width);
  const clip = undo(await inflate("dynvox-clip"), width), module = await WebAssembly.compile(await inflate("dynvox-module"));
  window.dynvoxPage = new Page(module, clip, expected);
  await window.dynvoxPage.mapClip();
}

start().catch((error) => {
  find(".state").textContent = `The page failed: ${error.message}. It needs a browser with WebAssembly SIMD (of 2023 or later).`;
  console.error(error);
});
