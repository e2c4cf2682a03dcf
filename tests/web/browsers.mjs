// browsers.mjs: opens a page in Chromium or Firefox without a window, of this folder from a server on this machine, or
// from the disk; and how much CPU time a browser takes.
import assert from "node:assert/strict";
import {spawn} from "node:child_process";
import {createServer} from "node:http";
import {mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {dirname, extname, join} from "node:path";
import {fileURLToPath} from "node:url";

const kinds = {".js": "text/javascript", ".mjs": "text/javascript", ".html": "text/html", ".wasm": "application/wasm"};
const kSparingBytes = 1_000_000;

// Files of folders by name, or of the folder in which this runs: of `sparing`, which gives 1 MB of each, and all others
// but `whole`, parts may be asked for.
function send(request, answer, roots, given) {
  const {pathname, search} = new URL(request.url, "http://localhost");
  const [, root, ...path] = pathname.split("/");
  let bytes;
  try {
    bytes = readFileSync(roots[root] ? join(roots[root], ...path) : join(process.cwd(), pathname));
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
    return ["--headless=new", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader",
      `--user-data-dir=${profile}`, "--autoplay-policy=no-user-gesture-required"];
  writeFileSync(join(profile, "user.js"), 'user_pref("media.autoplay.default", 0);\n');
  return ["--headless", "--no-remote", "--profile", profile];
}

// CPU time of a process and all that it has started.
export function tree_cpu_ms(root) {
  const stats = readdirSync("/proc").filter((name) => /^\d+$/.test(name)).flatMap((pid) => {
    try {
      const text = readFileSync(`/proc/${pid}/stat`, "latin1");
      const fields = text.slice(text.lastIndexOf(")") + 2).split(" ");
      return [{pid: Number(pid), parent: Number(fields[1]), ms: 10 * (Number(fields[11]) + Number(fields[12]))}];
    } catch {
      return [];  // it has ended
    }
  });
  const sum = (pid) => stats.filter(({parent}) => parent === pid)
    .reduce((ms, child) => ms + sum(child.pid), stats.find((one) => one.pid === pid)?.ms ?? 0);
  return sum(root);
}

// Chromium's other processes write to its profile for a moment after the first has ended.
async function remove(folder) {
  for (let tries = 0; ; ++tries) {
    try {
      return rmSync(folder, {recursive: true, force: true});
    } catch (error) {
      if (tries === 50) throw error;
    }
    await new Promise((resolve) => { setTimeout(resolve, 100); });
  }
}

// Opens test/`page`, or a `file:` URL with the server's address behind a #, and returns what it posts to result/NAME;
// the page ends by posting its error, or nothing, to result/end, within `most_s`. `posted` is called with each name and the
// browser's process.
export async function visit(program, folder, page, posted = () => {}, most_s = 240) {
  const roots = {package: folder, sparing: process.cwd(), whole: process.cwd(), test: dirname(fileURLToPath(import.meta.url))};
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
  const address = `http://127.0.0.1:${server.address().port}`;
  const url = page.startsWith("file:") ? `${page}#${address}` : `${address}/test/${page}`;
  browser = spawn(program, [...arguments_of(program, profile), url], {stdio: ["ignore", "ignore", "pipe"]});
  let said = "";
  browser.stderr.on("data", (text) => { said += text; });
  const late = setTimeout(tell, 1000 * most_s);
  await done;
  clearTimeout(late);
  browser.kill();
  await new Promise((resolve) => { browser.on("exit", resolve); });
  server.close();
  server.closeAllConnections();
  await remove(profile);
  assert(results["end"], `${program} did not come to the end: ${said}`);
  assert.equal(String(results["end"]), "", "the page");
  return results;
}
