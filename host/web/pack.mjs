// Packs the page: node pack.mjs MODULE.wasm CLIP DIGESTS OUT.html
import { readFileSync, writeFileSync } from "node:fs";
import { deflateSync, gzipSync } from "node:zlib";
import { fileURLToPath } from "node:url";
import { dirname, join } from "node:path";

// Largest page as a server sends it, bytes.
const MOST = 1.5e6;
const here = dirname(fileURLToPath(import.meta.url));
const [module, clip, digests, out] = process.argv.slice(2);
const text = (name) => readFileSync(join(here, name), "utf8");
const viewer = (name) => text(join("../src/report/viewer", name));

// Differences to what the neighbours to the left and above foretell (the PNG format's fifth filter): pictures deflate to two thirds.
function differences(bytes, width) {
  return bytes.map((byte, at) => {
    const [a, b, c] = [1, width, width + 1].map((back) => bytes[at - back] ?? 0), p = a + b - c;
    const [toA, toB, toC] = [a, b, c].map((near) => Math.abs(p - near));
    return byte - (toA <= toB && toA <= toC ? a : toB <= toC ? b : c);
  });
}

const clipBytes = new Uint8Array(readFileSync(clip)), width = new DataView(clipBytes.buffer).getUint32(12, true);
const packed = (bytes) => deflateSync(bytes, { level: 9 }).toString("base64");
const expected = readFileSync(digests, "utf8").split("\n").filter((line) => line && !line.startsWith("#")).map((line) => line.split(" ")[1]);
const elements = [
  ["dynvox-module", packed(readFileSync(module))],
  ["dynvox-clip", packed(differences(clipBytes, width))],
  ["dynvox-digests", expected.join(" ")],
];
// The report's renderer, and what is of this page.
const script = ["vector.js", "decode.js", "shaders.js", "renderer.js", "camera.js"].map(viewer).concat(["mapper.js", "sources.js", "page.js"].map(text));
const page = text("page.html")
  .replace("/*STYLE*/", () => text("../src/report/html/style.css") + viewer("viewer.css") + text("page.css"))
  .replace("<!--DATA-->", () => elements.map(([id, data]) => `<script type="text/plain" id="${id}" data-width="${width}">${data}</script>`).join("\n"))
  .replace("/*SCRIPT*/", () => `(() => {\n"use strict";\n${script.join("")}})();`);
const bytes = gzipSync(page, { level: 9 }).length;
writeFileSync(out, page);
console.log(`${out}: ${bytes} bytes packed, ${page.length} as a file`);
if (bytes > MOST) {
  console.error(`FAILED: more than ${MOST} bytes`);
  process.exit(1);
}
