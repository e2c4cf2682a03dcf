// worklet.mjs: feeds worklet.js by hand, in node: when it begins to play, what it plays where blocks are late, and what it
// renders where memory is shared.
// Started by `run`.
import assert from "node:assert/strict";
import {readFileSync} from "node:fs";
import {pathToFileURL} from "node:url";
import {compared, samples_of} from "./wav.mjs";

const processors = {};
const port = () => ({told: [], postMessage(data) { this.told.push(data); }});
globalThis.AudioWorkletProcessor = class {
  constructor() { this.port = port(); }
};
globalThis.registerProcessor = (name, processor) => { processors[name] = processor; };
await import(new URL("worklet.js", pathToFileURL(process.argv[2] + "/")));

const kOptions = {processorOptions: {told_frames: 512}};
const kChannels = 2, kBlockFrames = 512, kQuantumFrames = 128;

class Played {
  constructor(held) {
    this.processor = new processors["clamor-listener"](kOptions);
    this.feed = port();
    this.processor.port.onmessage({data: this.feed});
    this.made = 0;
    this.hold(held);
  }

  hold(held) {
    this.feed.onmessage({data: {channels: kChannels, ...held}});
  }

  // Sample i of channel c is 2 i + c + 1.
  give_block() {
    const block = Float32Array.from({length: kChannels * kBlockFrames}, (_, i) =>
      2 * (this.made + i % kBlockFrames) + Math.floor(i / kBlockFrames) + 1);
    this.made += kBlockFrames;
    this.feed.onmessage({data: {block}});
  }

  // The numbers of the frames that a quantum has, -1 where it is silent.
  play() {
    const output = Array.from({length: kChannels}, () => new Float32Array(kQuantumFrames));
    assert(this.processor.process([], [output]));
    return Array.from(output[0], (sample, i) => {
      assert(sample === 0 ? output[1][i] === 0 : output[1][i] === sample + 1, "the channels are apart");
      return (sample - 1) / 2;
    });
  }

  get missed() {
    return this.processor.port.told.at(-1)?.missed ?? 0;
  }
}

const silence = Array(kQuantumFrames).fill(-0.5);
const from = (begin) => Array.from({length: kQuantumFrames}, (_, i) => begin + i);

// It is silent until the lead is there, however long that takes, and misses nothing by that.
const played = new Played({capacity: 4096, begins_at: 1024});
for (let i = 0; i < 10; ++i) assert.deepEqual(played.play(), silence);
played.give_block();
for (let i = 0; i < 10; ++i) assert.deepEqual(played.play(), silence);
played.give_block();
let frame = 0;
for (; frame < 512; frame += kQuantumFrames) assert.deepEqual(played.play(), from(frame));
assert.equal(played.missed, 0);
assert.deepEqual(played.feed.told, [512]);

// A block that is late is missed quantum by quantum, and is then played where the sound had stopped.
for (; frame < 1024; frame += kQuantumFrames) assert.deepEqual(played.play(), from(frame));
for (let i = 0; i < 3; ++i) assert.deepEqual(played.play(), silence);
assert.equal(played.missed, 3);
for (let i = 0; i < 40; ++i) {  // the ring turns several times
  played.give_block();
  for (let k = 0; k < 4; ++k, frame += kQuantumFrames) assert.deepEqual(played.play(), from(frame));
}
assert.equal(played.missed, 3);

// An OfflineAudioContext's grows before it plays, and begins with what there is.
const offline = new Played({capacity: 1024, begins_at: 1});
offline.give_block();
offline.hold({capacity: 4096, begins_at: 1});
for (let i = 0; i < 6; ++i) offline.give_block();
for (frame = 0; frame < 7 * 512; frame += kQuantumFrames) assert.deepEqual(offline.play(), from(frame));
assert.deepEqual(offline.play(), silence);

// Frames are counted in 32 bits, beyond which it goes on.
const late = new Played({capacity: 4096, begins_at: 512});
const ring = late.processor.ring;
Object.assign(ring, {written: 2 ** 31 - 512, played: 2 ** 31 - 512});
for (let i = 0, at = 0; i < 3; ++i) {
  late.give_block();
  for (let k = 0; k < 4; ++k, at += kQuantumFrames) assert.deepEqual(late.play(), from(at));
}
assert.equal(ring.played, -(2 ** 31) + 3 * 512 - 512);

// Where memory is shared, it renders by an instance of its own what `clamor render` renders.
const folder = pathToFileURL(process.argv[2] + "/");
const {default: createClamor} = await import(new URL("clamor.mjs", folder));
const {instantiate, Native} = await import(new URL("native.js", folder));
const module = await WebAssembly.compile(readFileSync(new URL("clamor.wasm", folder)));
const native = new Native(await instantiate(createClamor, module));
const context = native.call("clamor_create", {caller_updates: 1});
const level = native.open(context, readFileSync("room.clamor"), "room.clamor");
const listener = native.call("clamor_create_listener", context, level,
  {offline: 1, pose: {position_m: [-2, 1.7, 3], orientation: [0, 0, 0, 1]}});
const rendered = new processors["clamor-listener"](kOptions), feed = port(), kStackBytes = 1 << 18;
const planes = native.module._malloc(4 * kChannels * (kQuantumFrames + 1)), table = planes + 4 * kChannels * kQuantumFrames;
for (let c = 0; c < kChannels; ++c) native.view.setUint32(table + 4 * c, planes + 4 * c * kQuantumFrames, true);
rendered.port.onmessage({data: feed});
feed.onmessage({data: {module, memory: native.module.wasmMemory, context, listener, table, planes, channels: kChannels,
  block_frames: kQuantumFrames, stack: native.module._malloc(kStackBytes), stack_bytes: kStackBytes}});
const made = new Float32Array(samples_of("headphones.wav").length);
for (let at = 0; at < made.length; at += kChannels * kQuantumFrames) {
  while (native.call("clamor_next_keyframe", context, listener)[0]) native.call("clamor_update", context, 0);
  const output = Array.from({length: kChannels}, () => new Float32Array(kQuantumFrames));
  assert(rendered.process([], [output]));
  made.set(Float32Array.from({length: kChannels * kQuantumFrames}, (_, i) => output[i % 2][i >> 1]).subarray(0, made.length - at), at);
}
const difference_db = compared(made, "headphones.wav");
console.log(`a worklet that renders: ${difference_db.toFixed(1)} dB`);
assert(difference_db < -100);
assert.deepEqual(feed.told.slice(0, 2), [512, 1024]);
native.call("clamor_destroy_listener", context, listener);
const after = [new Float32Array(kQuantumFrames), new Float32Array(kQuantumFrames)];
assert(rendered.process([], [after]) && after.every((plane) => plane.every((sample) => sample === 0)), "a listener that is gone sounds");

late.processor.port.onmessage({data: "ends"});
assert.equal(late.feed.told.at(-1), "ended");
assert.equal(late.processor.process([], [[]]), false);
console.log("the worklet plays what it is given");
