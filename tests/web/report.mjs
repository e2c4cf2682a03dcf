// report.mjs: opens a page of `clamor report --listen` from the disk, and presses Listen.
//
// usage: node report.mjs BROWSER LISTENED.html [PLAIN.html [PAIRS]]
//
// With the page of the same report without --listen, it prints the CPU time from the browser's start to the first
// sound, of all processes, less that of the plain page until it is shown.
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from "node:fs";
import {loadavg, tmpdir} from "node:os";
import {basename, join} from "node:path";
import {pathToFileURL} from "node:url";
import {tree_cpu_ms, visit} from "./browsers.mjs";

const [program, listened, plain, pairs = 5] = process.argv.slice(2);
const kScript = `<script type="module">
const problems = [];
addEventListener("error", ({message}) => problems.push(message));
addEventListener("unhandledrejection", ({reason}) => problems.push(String(reason)));
const post = (name, body) => fetch(location.hash.slice(1) + "/result/" + name, {method: "POST", mode: "no-cors", body});
const nap = () => new Promise((resolve) => { setTimeout(resolve, 20); });
try {
  while (document.readyState !== "complete" || !window.clamorView) await nap();
  await post("shown");
  const listening = window.clamorListening, samples = new Float32Array(2048);
  if (listening) {
    document.getElementById("listen").click();
    while (!listening.ears) {
      if (document.getElementById("listen").disabled === false) throw new Error(document.getElementById("listen-status").textContent);
      await nap();
    }
    const meter = new AnalyserNode(listening.audio), end = performance.now() + 60_000;
    listening.ears.connect(meter);
    const clock = performance.now() + 5000;
    while (!samples.some((sample) => Math.abs(sample) > 1e-5)) {
      await nap();
      meter.getFloatTimeDomainData(samples);
      if (performance.now() > clock && listening.audio.currentTime === 0) break;  // there is no sound device
      if (performance.now() > end) throw new Error("silence");
    }
    const {keyframes, voices} = await listening.ears.statistics();
    if (keyframes === 0n || voices === 0) throw new Error("no keyframes");
    const sounds = listening.audio.currentTime > 0, draws = document.createElement("canvas").getContext("webgl2") !== null;
    while (!sounds && !/is there a device/.test(document.getElementById("listen-status").textContent)) {
      if (performance.now() > end) throw new Error("it does not say that there is no device");
      await nap();
    }
    if (!draws && !/no WebGL2/.test(document.getElementById("stage").textContent)) throw new Error("it does not say that there is no WebGL");
    if (problems.length > 0) throw new Error(problems.join("; "));
    await post("sounds", (sounds ? "the report sounds" : "the report renders, and says that there is no sound device") +
      (draws ? "" : "; it says that there is no WebGL"));
  }
  await post("end");
} catch (error) {
  await post("end", error + error.stack);
}
</script>`;

async function opened(html) {
  const folder = mkdtempSync(join(tmpdir(), "clamor-report-"));
  const page = join(folder, basename(html)), cpu_ms = {};
  writeFileSync(page, readFileSync(html, "utf8") + kScript);
  const {sounds} = await visit(program, folder, pathToFileURL(page).href, (name, browser) => {
    cpu_ms[name] = tree_cpu_ms(browser.pid);
  });
  rmSync(folder, {recursive: true});
  return {sounds, cpu_ms};
}

if (plain === undefined) console.log(`${basename(program)}: ${(await opened(listened)).sounds}`);
const more = [];
for (let i = 0; plain !== undefined && i < Number(pairs); ++i) {
  const {cpu_ms: {shown}} = await opened(plain), {cpu_ms: {sounds}} = await opened(listened);
  more.push(sounds - shown);
  console.log(`shown ${shown} ms, sounds ${sounds} ms of CPU: ${sounds - shown} ms more, at a load of ${loadavg()[0].toFixed(1)}`);
}
if (more.length > 0) console.log(`median: ${more.sort((a, b) => a - b)[more.length >> 1]} ms more`);
