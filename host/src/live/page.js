// The live page: asks the run for news, and shows them.
const find = (selector) => document.querySelector(selector);
const root = document.getElementById("dynvox-viewer");
// Time between questions, ms.
const ASK_MS = 300;
// Questions without an answer after which the run has ended.
const MOST_FAILURES = 5;
const VALUES = 3;
// Heights between which colours differ, m: y points down.
const HEIGHTS_M = [-3.5, 2.6];
const PATH_COLOUR = [0.18, 0.44, 0.87];

async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

class LivePage {
  constructor() {
    Object.assign(this, { camera: new Camera(), version: 0, pictures: 0, path: [], failures: 0, way: 0 });
    this.renderer = Renderer.on(find(".view canvas"));
    if (this.renderer) {
      this.line = this.renderer.addLine([], PATH_COLOUR, 1.8);
      steer(find(".view canvas"), this.camera, () => "orbit", () => { find(".follow").checked = false; this.draw(); });
    } else {
      find(".note").textContent = "The map needs a browser with WebGL 2; pictures and figures do not.";
    }
    find(".colour").addEventListener("change", () => this.draw());
    window.addEventListener("resize", () => this.draw());
  }

  async ask() {
    try {
      const answer = await fetch(`news?since=${this.version}&path=${this.path.length}`);
      if (!answer.ok) throw new Error(`the run answers ${answer.status}`);
      await this.show(await answer.json());
      this.failures = 0;
    } catch (error) {
      this.failures++;
      if (this.failures >= MOST_FAILURES) {
        root.dataset.done = "true";
        find(".state").textContent = this.version ? "The run has ended. Its results are in the folder that it printed." : `No run answers: ${error.message}.`;
        return;
      }
    }
    setTimeout(() => this.ask(), ASK_MS);
  }

  async show(news) {
    const { figures, path, regions } = news;
    for (const position of path) {
      const last = this.path[this.path.length - 1];
      if (last) this.way += length(sub(position, last));
      this.path.push(position);
    }
    if (news.pictures !== this.pictures) this.showPictures(news.pictures);
    if (figures.frames) this.showFigures(news);
    for (const id of regions) await this.showRegion(id);
    this.version = news.version;
    if (this.renderer) this.renderer.setLine(this.line, this.path);
    this.draw();
  }

  showFigures({ figures, triangles }) {
    find(".frames").textContent = figures.of ? `${figures.frames} of ${figures.of}` : figures.frames;
    find(".step").textContent = figures.step_ms.toFixed(0);
    find(".way").textContent = this.way.toFixed(1);
    find(".pool").textContent = `${(100 * figures.pool).toFixed(0)} %`;
    find(".moving").textContent = figures.moving;
    find(".state").textContent = figures.cause ? `Frame ${figures.frame}: ${figures.severity}, ${figures.cause}.` : `Frame ${figures.frame}: ${figures.severity}.`;
    find(".note").textContent = `${triangles.toLocaleString("en")} triangles`;
    Object.assign(root.dataset, { frames: String(figures.frames), triangles: String(triangles) });
    if (find(".follow").checked) {
      const matrix = poseMatrix(figures.pose);
      this.camera.lookFrom(figures.pose.slice(0, 3), [matrix[8], matrix[9], matrix[10]], true);
    }
  }

  // Replaces a region's tiles by its new ones.
  async showRegion(id) {
    if (!this.renderer) return;
    const answer = await fetch(`region?id=${id}`);
    if (!answer.ok) return;
    const bytes = new Uint8Array(await answer.arrayBuffer()), tiles = [];
    if (bytes.length > 4) {
      const size = new DataView(bytes.buffer).getUint32(0, true);
      let at = 4 + size;
      for (const { head, bytes: count } of JSON.parse(new TextDecoder().decode(bytes.subarray(4, at)))) {
        const tile = decodeTile(await inflated(bytes.subarray(at, at + count)), head, VALUES);
        tiles.push([{ ...head, region: id }, { ...tile, coarse: new Uint16Array(0) }]);
        at += count;
      }
    }
    this.renderer.removeTiles((head) => head.region === id);
    for (const [head, tile] of tiles) this.renderer.addTile(head, tile);
  }

  showPictures(version) {
    this.pictures = version;
    for (const name of ["left", "disparity", "masks"]) {
      const image = find(`img.${name}`), next = new Image();
      next.onload = () => { image.src = next.src; image.hidden = false; };
      next.onerror = () => { image.hidden = name === "masks"; };
      next.src = `${name}?version=${version}`;
    }
  }

  draw() {
    if (!this.renderer) return;
    const canvas = find(".view canvas"), dark = matchMedia("(prefers-color-scheme: dark)").matches;
    this.renderer.draw({
      share: 1, isCoarse: false, clip: this.camera.clip(canvas.clientWidth / Math.max(canvas.clientHeight, 1)),
      colour: Number(find(".colour").value), heights: HEIGHTS_M, background: dark ? [0.07, 0.08, 0.09] : [0.90, 0.92, 0.94],
      showStatic: true, objects: [], lines: [this.line], layers: {},
    });
  }
}

new LivePage().ask();
