// Opens the page in a browser without a window: node test.mjs BROWSER PAGE.html FOLDER. Every digest must be equal, the console without an error; leaves screenshots in the folder.
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";

const [browser, page, folder] = process.argv.slice(2);
// The longest that a page may take, on a machine that does other work too, ms.
const PATIENCE_MS = 240000;
const ARGUMENTS = ["--headless=new", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars", "--remote-debugging-pipe"];
const fail = (reason) => { throw new Error(reason); };

// A page over the browser's debugging protocol: messages on two pipes, each with a zero behind it.
class Tab {
  static async open([input, output], url) {
    const tab = Object.assign(new Tab(), { input, waiting: new Map(), errors: [], last: 0 });
    let rest = "";
    output.setEncoding("utf8").on("data", (data) => {
      const messages = (rest + data).split("\0");
      rest = messages.pop();
      messages.forEach((message) => tab.take(JSON.parse(message)));
    });
    const { targetInfos } = await tab.send("Target.getTargets"), { targetId } = targetInfos.find(({ type }) => type === "page");
    tab.sessionId = (await tab.send("Target.attachToTarget", { targetId, flatten: true })).sessionId;
    for (const domain of ["Page", "Runtime", "Log", "Network"]) await tab.send(`${domain}.enable`);
    await tab.send("Page.navigate", { url });
    return tab;
  }

  take({ id, result, method, params }) {
    if (id) { this.waiting.get(id)?.(result); this.waiting.delete(id); }
    if (method === "Runtime.exceptionThrown") this.errors.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    if (method === "Runtime.consoleAPICalled" && params.type === "error") this.errors.push(JSON.stringify(params.args));
    if (method === "Log.entryAdded" && params.entry.level === "error") this.errors.push(params.entry.text);
    if (method === "Network.requestWillBeSent" && /^https?:/.test(params.request.url)) this.errors.push(`the page asks for ${params.request.url}`);
  }

  send(method, params = {}) {
    const id = ++this.last, { sessionId } = this;
    this.input.write(`${JSON.stringify({ id, method, params, sessionId })}\0`);
    return new Promise((done) => { this.waiting.set(id, done); });
  }

  async value(expression) {
    return (await this.send("Runtime.evaluate", { expression, returnByValue: true, awaitPromise: true })).result.value;
  }

  async done() {
    const end = Date.now() + PATIENCE_MS;
    for (;;) {
      const data = await this.value(`({ ...document.getElementById("dynvox-viewer")?.dataset })`);
      if (data?.done === "true") return data;
      if (this.errors.length) fail(this.errors.join("\n"));
      if (Date.now() > end) fail(`the page is not done in time: ${JSON.stringify(data)}`);
      await new Promise((resolve) => setTimeout(resolve, 300));
    }
  }

  async screenshot(name, [width, height]) {
    await this.send("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: false });
    await new Promise((resolve) => setTimeout(resolve, 500));
    const { data } = await this.send("Page.captureScreenshot", { captureBeyondViewport: true });
    writeFileSync(join(folder, name), Buffer.from(data, "base64"));
    return this.value("document.documentElement.scrollWidth - innerWidth");
  }
}

const profile = mkdtempSync(join(tmpdir(), "dynvox-web-"));
const running = spawn(browser, [...ARGUMENTS, `--user-data-dir=${profile}`, "about:blank"], { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
// A browser that never answers must not hang the check.
setTimeout(() => { console.error("FAILED: the browser does not answer in time"); running.kill(); process.exit(1); }, 4 * PATIENCE_MS).unref();
try {
  const tab = await Tab.open([running.stdio[3], running.stdio[4]], `file://${resolve(page)}`);
  const data = await tab.done(), expected = await tab.value(`document.querySelectorAll(".digests tbody tr").length`);
  if (data.equal !== data.frames || Number(data.frames) !== expected || expected < 1) fail(`${data.equal} of ${data.frames} digests are equal`);
  if (!(Number(data.triangles) > 1000)) fail(`the map has ${data.triangles} triangles`);
  // Nothing overflows, on a desk and on a phone.
  for (const [name, size] of [["desk.png", [1280, 1000]], ["phone.png", [390, 844]]]) {
    const over = await tab.screenshot(name, size);
    if (over > 0) fail(`at ${size[0]} px the page is ${over} px too wide`);
  }
  // A wrong digest must show: the check is one that can fail.
  await tab.value(`dynvoxPage.expected[0] = "0", dynvoxPage.mapClip()`);
  const other = await tab.done();
  if (Number(other.equal) !== expected - 1) fail("a digest that differs is not noticed");
  // Pairs of one's own: the same clip's pictures as files.
  const own = await tab.value(await ownPairs());
  if (!/^Done: 3 frames/.test(own)) fail(`pairs of one's own: ${own}`);
  if (tab.errors.length) fail(tab.errors.join("\n"));
  console.log(`${data.equal} digests equal, ${data.rate} frames a second, first frame after ${data.firstMs} ms, ${data.triangles} triangles`);
} catch (error) {
  console.error(`FAILED: ${error.message}`);
  process.exitCode = 1;
} finally {
  running.kill();
  await new Promise((resolve) => setTimeout(resolve, 300));
  rmSync(profile, { recursive: true, force: true, maxRetries: 5 });
  process.exit();
}

// Drops three pairs of a textured wall; the text that the page ends with.
async function ownPairs() {
  return `(async () => {
    const files = [];
    for (const [side, shift] of [["left", 0], ["right", 8]]) for (let at = 0; at < 3; at++) {
      const canvas = new OffscreenCanvas(320, 96), context = canvas.getContext("2d");
      for (let v = 0; v < 96; v += 3) for (let u = 0; u < 360; u += 3) {
        const grey = Math.imul(u * 2654435761 ^ v * 40503777, 2246822519) >>> 24;
        context.fillStyle = \`rgb(\${grey},\${grey},\${grey})\`;
        context.fillRect(u - shift, v, 3, 3);
      }
      const blob = await canvas.convertToBlob();
      files.push(Object.assign(new File([blob], at + ".png", { type: "image/png" }), { path: \`/rig/\${side}/\${at}.png\` }));
    }
    await dynvoxPage.mapFiles(files);
    return document.querySelector(".state").textContent;
  })()`;
}
