// Opens the page in browsers without windows: node test.mjs PAGE.html FOLDER BROWSER... In each every
// digest must be equal, the console without an error, and the page usable by all. Leaves screenshots in
// the folder, from whose modules it takes the library that drives browsers and the rules of axe.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { basename, join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [page, folder, ...browsers] = process.argv.slice(2);
const modules = createRequire(join(resolve(folder), "any.js"));
const { default: puppeteer } = await import(pathToFileURL(modules.resolve("puppeteer-core")));
const axe = readFileSync(modules.resolve("axe-core/axe.min.js"), "utf8");
// The longest that a page may take, on a machine that does other work too, ms.
const PATIENCE_MS = 240000;
const CHROMIUM = [
  "--no-sandbox", "--disable-quic", "--disable-background-networking", "--disable-component-update",
  "--disable-sync", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
  "--hide-scrollbars",
];
const fail = (reason) => { throw new Error(reason); };

// A browser that never answers must not hang the check.
setTimeout(() => {
  console.error("FAILED: a browser does not answer in time");
  process.exit(1);
}, 4 * PATIENCE_MS * browsers.length).unref();
for (const browser of browsers) {
  const name = basename(browser);
  const isFirefox = name.includes("firefox");
  const running = await puppeteer.launch({
    browser: isFirefox ? "firefox" : "chrome",
    // Firefox draws maps on a screen only: one in memory will do (xvfb-run).
    headless: !(isFirefox && process.env.DISPLAY),
    executablePath: browser,
    args: isFirefox ? [] : CHROMIUM,
    // Without a graphics card the map is drawn by software.
    extraPrefsFirefox: { "webgl.force-enabled": true },
    protocolTimeout: 2 * PATIENCE_MS,
  });
  try {
    console.log(`${name}: ${await check(await running.newPage(), name)}`);
  } catch (error) {
    console.error(`FAILED: ${name}: ${error.message}`);
    process.exitCode = 1;
  } finally {
    await running.close();
  }
}

// Maps the clip, breaks a digest, maps pairs of one's own; a line with what was measured.
async function check(tab, name) {
  const errors = [];
  tab.on("pageerror", (error) => errors.push(error.message));
  tab.on("console", (message) => { if (message.type() === "error") errors.push(message.text()); });
  tab.on("request", (request) => {
    if (/^https?:/.test(request.url())) errors.push(`the page asks for ${request.url()}`);
  });
  await tab.goto(pathToFileURL(resolve(page)).href);
  const data = await done(tab, errors);
  const expected = await tab.evaluate(`document.querySelectorAll(".digests tbody tr").length`);
  if (data.equal !== data.frames || Number(data.frames) !== expected || expected < 1) {
    fail(`${data.equal} of ${data.frames} digests are equal`);
  }
  if (!(Number(data.triangles) > 1000)) fail(`the map has ${data.triangles} triangles`);
  await isUsable(tab);
  // Nothing overflows, on a desk and on a phone.
  for (const [kind, width, height] of [["desk", 1280, 1000], ["phone", 390, 844]]) {
    await tab.setViewport({ width, height });
    await new Promise((resolve) => setTimeout(resolve, 500));
    await tab.screenshot({ path: join(folder, `${name}-${kind}.png`), fullPage: true });
    const over = await tab.evaluate("document.documentElement.scrollWidth - innerWidth");
    if (over > 0) fail(`at ${width} px the page is ${over} px too wide`);
  }
  // A wrong digest must show: the check is one that can fail.
  await tab.evaluate(`dynvoxPage.expected[0] = "0", void dynvoxPage.mapClip()`);
  const other = await done(tab, errors);
  if (Number(other.equal) !== expected - 1) fail("a digest that differs is not noticed");
  // Pairs of one's own: the same clip's pictures as files.
  const own = await tab.evaluate(ownPairs());
  if (!/^Done: 3 frames/.test(own)) fail(`pairs of one's own: ${own}`);
  if (errors.length) fail(errors.join("\n"));
  return `${data.equal} digests equal, ${data.rate} frames a second, first frame after `
    + `${data.firstMs} ms, ${data.triangles} triangles`;
}

// What the viewer says once the mapper has ended.
async function done(tab, errors) {
  const end = Date.now() + PATIENCE_MS;
  for (;;) {
    const data = await tab.evaluate(`({ ...document.getElementById("dynvox-viewer")?.dataset })`);
    if (data.done === "true") return data;
    if (errors.length) fail(errors.join("\n"));
    if (Date.now() > end) fail(`the page is not done in time: ${JSON.stringify(data)}`);
    await new Promise((resolve) => setTimeout(resolve, 300));
  }
}

// Fails with the rules of axe that the page breaks seriously.
async function isUsable(tab) {
  await tab.evaluate(axe);
  const broken = await tab.evaluate(`axe.run().then(({ violations }) => violations
    .filter(({ impact }) => impact === "serious" || impact === "critical")
    .map(({ id, help, nodes }) => id + ": " + help + ": " + nodes.map(({ html }) => html).join(" ")))`);
  if (broken.length) fail(broken.join("\n"));
}

// Drops three pairs of a textured wall; the text that the page ends with.
function ownPairs() {
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
