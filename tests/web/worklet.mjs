// worklet.mjs: feeds worklet.js by hand, in node: when it begins to play, and what it plays where blocks are late.
// Started by `run`.
import assert from "node:assert/strict";
import {pathToFileURL} from "node:url";

const processors = {};
const port = () => ({told: [], postMessage(data) { this.told.push(data); }});
globalThis.AudioWorkletProcessor = class {
  constructor() { this.port = port(); }
};
globalThis.registerProcessor = (name, processor) => { processors[name] = processor; };
await import(new URL("worklet.js", pathToFileURL(process.argv[2] + "/")));

const kChannels = 2, kBlockFrames = 512, kQuantumFrames = 128;

class Played {
  constructor(held) {
    this.processor = new processors["clamor-listener"]();
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
const {processor} = late;
processor.state[0] = processor.played = processor.told = 2 ** 31 - 512;
for (let i = 0, at = 0; i < 3; ++i) {
  late.give_block();
  for (let k = 0; k < 4; ++k, at += kQuantumFrames) assert.deepEqual(late.play(), from(at));
}
assert.equal(processor.played, -(2 ** 31) + 3 * 512 - 512);


// Where memory is shared, the Worker writes into the ring itself.
const capacity = 1024, state = new Int32Array(new SharedArrayBuffer(4));
const planes = new Float32Array(new SharedArrayBuffer(4 * kChannels * capacity));
const shared = new Played({capacity, begins_at: 512, ring: planes, state});
for (let block = 0; block < 5; ++block) {
  for (let i = 0; i < kBlockFrames; ++i)
    for (let c = 0; c < kChannels; ++c)
      planes[c * capacity + (512 * block + i) % capacity] = 2 * (512 * block + i) + c + 1;
  assert.deepEqual(shared.play(), silence);
  Atomics.add(state, 0, kBlockFrames);
  for (let k = 0; k < 4; ++k) assert.deepEqual(shared.play(), from(512 * block + 128 * k));
}
console.log("the worklet plays what it is given");
