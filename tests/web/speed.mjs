// speed.mjs: how long the library of this machine, WebAssembly in node, the same in Chromium and Web Audio's PannerNode
// with its HRTF take for the same voices.
//
// usage: node speed.mjs PACKAGE LIBCLAMOR.so BAKE [VOICES [SECONDS]], in the folder of the bake
import {execFileSync} from "node:child_process";
import {readFileSync} from "node:fs";
import {dirname, join} from "node:path";
import {fileURLToPath, pathToFileURL} from "node:url";
import {tree_cpu_ms, visit} from "./browsers.mjs";

const [folder, library, bake, voices = 1000, seconds = 4] = process.argv.slice(2);
const root = join(dirname(fileURLToPath(import.meta.url)), "..", "..");
const kBlockFrames = 480;
const blocks = Math.round(seconds * 100);
const warm_up = 100;  // blocks, in which V8 compiles the module
const cpu_ms = () => process.cpuUsage().user / 1000;
const place = (i) => [1.5 * Math.sin(i / 100), 1.7, 2 + Math.cos(i / 100)];  // 1 to 1.5 m/s

async function in_node() {
  const package_url = pathToFileURL(folder + "/");
  const {default: createClamor} = await import(new URL("clamor.mjs", package_url));
  const {Native} = await import(new URL("native.js", package_url));
  const native = new Native(await createClamor());
  const context = native.call("clamor_create", {caller_updates: 1});
  const level = native.open(context, readFileSync(bake));
  const ears = native.call("clamor_create_listener", context, level, {offline: 1, voices, pose: {position_m: place(0), orientation: [0, 0, 0, 1]}});
  const block = native.module._malloc(8 * kBlockFrames);
  let keyframes = 0, updates_ms = 0, mixing_ms = 0;
  for (let i = -warm_up; i < blocks; ++i) {
    const begin = cpu_ms();
    while (native.call("clamor_next_keyframe", context, ears)[0]) {
      native.call("clamor_move_listener", context, ears, {position_m: place(i), orientation: [0, 0, 0, 1]});
      native.call("clamor_update", context, 0);
      if (i >= 0) ++keyframes;
    }
    const middle = cpu_ms();
    native.module._clamor_render(context, ears, block, kBlockFrames);
    if (i < 0) continue;
    updates_ms += middle - begin;
    mixing_ms += cpu_ms() - middle;
  }
  return {mixing_ms, updates_ms, keyframes, memory_bytes: native.module.HEAPU8.length};
}

const kNative = `
import json, math, sys, time
import clamor
bake, voices, blocks = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
place = lambda i: clamor.Pose([1.5 * math.sin(i / 100), 1.7, 2 + math.cos(i / 100)])
context = clamor.Context(caller_updates=True)
ears = context.listen(context.open(bake), place(0), offline=True, voices=voices)
updates, mixing, keyframes = 0, 0, 0
for i in range(-int(sys.argv[4]), blocks):
    begin = time.process_time()
    while ears.next_keyframe_s() is not None:
        ears.move(place(i))
        context.update()
        keyframes += i >= 0
    middle = time.process_time()
    ears.render(${kBlockFrames})
    if i >= 0:
        updates += middle - begin
        mixing += time.process_time() - middle
print(json.dumps({"mixing_ms": 1e3 * mixing, "updates_ms": 1e3 * updates, "keyframes": keyframes}))
`;

const native = JSON.parse(execFileSync("/usr/bin/python3", ["-c", kNative, bake, voices, blocks, warm_up], {
  env: {...process.env, PYTHONPATH: join(root, "runtime/bindings/python"), CLAMOR_LIBRARY: library}}));
const wasm = await in_node();
const row = (name, {mixing_ms, updates_ms, keyframes}) => console.log(`${name.padEnd(14)}` +
  `${(1e6 * mixing_ms / (voices * blocks * kBlockFrames)).toFixed(3).padStart(8)} ns for each voice and frame` +
  `${(updates_ms / keyframes).toFixed(2).padStart(8)} ms for each keyframe` +
  `${(100 * (mixing_ms + updates_ms) / (1000 * seconds)).toFixed(1).padStart(7)} % of a core`);
console.log(`${voices} binaural voices, a listener who walks, ${seconds} s`);
row("this machine", native);
row("WebAssembly", wasm);
console.log(`memory of the module: ${wasm.memory_bytes >> 20} MB`);
console.log(`${"ratio".padEnd(14)}${(wasm.mixing_ms / native.mixing_ms).toFixed(2).padStart(8)}${(wasm.updates_ms / native.updates_ms).toFixed(2).padStart(32)}`);

const at = {};
await visit("chromium", folder, `speed.html#${voices},${seconds},${bake}`, (name, browser) => {
  at[name] = tree_cpu_ms(browser.pid);
});
const chromium_ms = at.clamor - at.begin, panners_ms = at.panners - at.begin_panners;
const node_ms = wasm.mixing_ms + wasm.updates_ms;
const percent = (ms) => `${(100 * ms / (1000 * seconds)).toFixed(1)} % of a core`;
console.log(`Chromium, all its processes: ${percent(chromium_ms)}, ${(chromium_ms / node_ms).toFixed(2)} of node`);
console.log(`PannerNode, HRTF, as many that stand still: ${percent(panners_ms)}, ${(panners_ms / chromium_ms).toFixed(2)} of Clamor`);
