// browser.mjs: runs browser.html in Chromium without a window and compares what it heard with `clamor render`.
// Started by `run`, in the folder of the bakes and renders.
import assert from "node:assert/strict";
import {spawn} from "node:child_process";
import {createServer} from "node:http";
import {mkdtempSync, readFileSync, rmSync} from "node:fs";
import {tmpdir} from "node:os";
import {dirname, extname, join} from "node:path";
import {fileURLToPath} from "node:url";
import {compared} from "./wav.mjs";

const [chromium, folder] = process.argv.slice(2);
const here = dirname(fileURLToPath(import.meta.url));
const roots = {package: folder, bakes: process.cwd(), test: here};
const kinds = {".js": "text/javascript", ".mjs": "text/javascript", ".html": "text/html", ".wasm": "application/wasm"};

const results = {};
let tell;
const done = new Promise((resolve) => { tell = resolve; });

const server = createServer((request, answer) => {
  const [, root, ...path] = new URL(request.url, "http://localhost").pathname.split("/");
  if (request.method === "POST") {
    const parts = [];
    request.on("data", (part) => parts.push(part));
    request.on("end", () => {
      results[path.join("/")] = Buffer.concat(parts);
      answer.end();
      if (path[0] === "end") tell();
    });
    return;
  }
  try {
    const bytes = readFileSync(join(roots[root], ...path));
    answer.writeHead(200, {"content-type": kinds[extname(request.url)] ?? "application/octet-stream"});
    answer.end(bytes);
  } catch {
    answer.writeHead(404).end();
  }
});
await new Promise((resolve) => { server.listen(0, "127.0.0.1", resolve); });

const profile = mkdtempSync(join(tmpdir(), "clamor-chromium-"));
const browser = spawn(chromium, ["--headless=new", "--no-sandbox", "--disable-gpu", `--user-data-dir=${profile}`,
  "--autoplay-policy=no-user-gesture-required", `http://127.0.0.1:${server.address().port}/test/browser.html`],
{stdio: ["ignore", "ignore", "pipe"]});
let said = "";
browser.stderr.on("data", (text) => { said += text; });
const late = setTimeout(() => tell(), 120_000);
await done;
clearTimeout(late);
browser.kill();
await new Promise((resolve) => { browser.on("exit", resolve); });
server.close();
rmSync(profile, {recursive: true, force: true});

assert(results["end"], `Chromium did not come to the end: ${said}`);
assert.equal(String(results["end"]), "", "the page");
const floats = (bytes) => new Float32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
for (const name of ["headphones", "paper"]) {
  const difference = compared(floats(results[name]), `${name}.wav`);
  console.log(`Chromium: ${name}: ${difference.toFixed(1)} dB`);
  assert(difference < -90);
}
console.log(`Chromium: ${results["live"]}`);
