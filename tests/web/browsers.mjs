// browsers.mjs: opens a page of this folder in Chromium or Firefox without a window, from a server on this machine.
import assert from "node:assert/strict";
import {spawn} from "node:child_process";
import {createServer} from "node:http";
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {dirname, extname, join} from "node:path";
import {fileURLToPath} from "node:url";

const kinds = {".js": "text/javascript", ".mjs": "text/javascript", ".html": "text/html", ".wasm": "application/wasm"};
const kSparingBytes = 1_000_000;

// Files of folders by name: of `sparing`, which gives 1 MB of each, and all others but `whole`, parts may be asked for.
function send(request, answer, roots, given) {
  const {pathname, search} = new URL(request.url, "http://localhost");
  const [, root, ...path] = pathname.split("/");
  let bytes;
  try {
    bytes = readFileSync(join(roots[root], ...path));
  } catch {
    return answer.writeHead(404).end();
  }
  const headers = {"content-type": kinds[extname(pathname)] ?? "application/octet-stream",
    "cross-origin-embedder-policy": "require-corp"};
  if (search === "?isolated") headers["cross-origin-opener-policy"] = "same-origin";
  const [, from, to] = (root !== "whole" && /^bytes=(\d+)-(\d+)$/.exec(request.headers.range)) || [];
  const part = from === undefined ? bytes : bytes.subarray(Number(from), Number(to) + 1);
  given[pathname] = (given[pathname] ?? 0) + part.length;
  if (root === "sparing" && given[pathname] > kSparingBytes) return answer.writeHead(503).end();
  if (from !== undefined) headers["content-range"] = `bytes ${from}-${Number(from) + part.length - 1}/${bytes.length}`;
  return answer.writeHead(from === undefined ? 200 : 206, headers).end(part);
}

// The arguments of a browser with a profile of its own, in which pages may sound without a click.
function arguments_of(program, profile) {
  if (!/firefox/.test(program))
    return ["--headless=new", "--no-sandbox", "--disable-gpu", `--user-data-dir=${profile}`,
      "--autoplay-policy=no-user-gesture-required"];
  writeFileSync(join(profile, "user.js"), 'user_pref("media.autoplay.default", 0);\n');
  return ["--headless", "--no-remote", "--profile", profile];
}

// Opens test/`page` and returns what it posts to result/NAME; the page ends by posting its error, or nothing, to
// result/end. `posted` is called with each name and the browser's process.
export async function visit(program, folder, page, posted = () => {}) {
  const roots = {package: folder, bakes: process.cwd(), sparing: process.cwd(), whole: process.cwd(),
    test: dirname(fileURLToPath(import.meta.url))};
  const results = {}, given = {};
  let browser, tell;
  const done = new Promise((resolve) => { tell = resolve; });
  const server = createServer((request, answer) => {
    if (request.method !== "POST") return send(request, answer, roots, given);
    const name = request.url.split("/").at(-1), parts = [];
    request.on("data", (part) => parts.push(part));
    request.on("end", () => {
      results[name] = Buffer.concat(parts);
      posted(name, browser);
      answer.end();
      if (name === "end") tell();
    });
  });
  await new Promise((resolve) => { server.listen(0, "127.0.0.1", resolve); });
  const profile = mkdtempSync(join(tmpdir(), "clamor-browser-"));
  browser = spawn(program, [...arguments_of(program, profile), `http://127.0.0.1:${server.address().port}/test/${page}`],
    {stdio: ["ignore", "ignore", "pipe"]});
  let said = "";
  browser.stderr.on("data", (text) => { said += text; });
  const late = setTimeout(tell, 240_000);
  await done;
  clearTimeout(late);
  browser.kill();
  await new Promise((resolve) => { browser.on("exit", resolve); });
  server.close();
  server.closeAllConnections();
  rmSync(profile, {recursive: true, force: true, maxRetries: 5});
  assert(results["end"], `${program} did not come to the end: ${said}`);
  assert.equal(String(results["end"]), "", "the page");
  return results;
}
