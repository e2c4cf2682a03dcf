// worker.mjs: runs worker.js in node: what is heard while a call takes long is rendered before it. Started by `run`, in the
// folder of the bakes.
import assert from "node:assert/strict";
import {readFileSync} from "node:fs";
import {pathToFileURL} from "node:url";

const folder = pathToFileURL(process.argv[2] + "/");
const kBlockFrames = 512, kLead_frames = 3840, kRate_hz = 48000;
const bytes = (path) => Uint8Array.from(readFileSync(path));
const answers = [];
globalThis.onmessage = null;
globalThis.postMessage = (answer) => answers.push(answer);
await import(new URL("worker.js", folder));
async function ask(call, ...inputs) {
  await globalThis.onmessage({data: {id: 1, call, inputs}});
  const {result, error} = answers.pop();
  assert.equal(error, undefined);
  return result;
}

// What was ahead of the worklet when each function was called.
const {Native} = await import(new URL("native.js", folder));
const ahead = {};
const {call} = Native.prototype;
Native.prototype.call = function (name, ...inputs) {
  ahead[name] = posted - played;
  return call.call(this, name, ...inputs);
};

let posted = 0, played = 0;
const port = {
  postMessage({block, capacity}) {
    this.capacity ??= capacity;
    if (block) posted += kBlockFrames;
    assert(posted - played <= this.capacity, "the worklet's ring overflows");
  },
};
const play = () => port.onmessage({data: played += kBlockFrames});

const pose = {position_m: [0, 1.7, 3], orientation: [0, 0, 0, 1]};
await ask("create", {wasm: bytes(new URL("clamor.wasm", folder)), options: {}});
const {level} = await ask("open", bytes("room.clamor"), "room"), other = await ask("open", bytes("violin.clamor"), "violin");
const {listener} = await ask("listen", level, {rate_hz: kRate_hz, voices: 200, pose}, {port, lead_frames: kLead_frames});
await ask("start", listener);
const is_at_lead = () => assert(posted - played >= kLead_frames && posted - played < kLead_frames + kBlockFrames);
for (let i = 0; i < 100; ++i, play()) is_at_lead();
await ask("enter", listener, other.level);
assert(ahead.clamor_enter_level >= 0.5 * kRate_hz, `${ahead.clamor_enter_level} frames are there when it enters a level`);
assert(ahead.clamor_update >= 0.5 * kRate_hz, `${ahead.clamor_update} frames are there when it makes the level's first keyframe`);
while (posted - played >= kLead_frames + kBlockFrames) play();
for (let i = 0; i < 10; ++i, play()) is_at_lead();
console.log("the Worker renders ahead of long calls");
