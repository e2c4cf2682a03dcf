// play.mjs: renders by the module for WebAssembly what `clamor render` has rendered, and feeds it what is
// damaged or too large. Started by `run`, in the folder of the bakes and renders.
import assert from "node:assert/strict";
import {readFileSync} from "node:fs";
import {pathToFileURL} from "node:url";
import {compared, samples_of} from "./wav.mjs";

const folder = pathToFileURL(process.argv[2] + "/");
const {default: createClamor} = await import(new URL("clamor.mjs", folder));
const {Native} = await import(new URL("native.js", folder));
const native = new Native(await createClamor());
const kBlockFrames = 960;
const kDegree = Math.PI / 180;

const product = ([px, py, pz, pw], [qx, qy, qz, qw]) => [
  pw * qx + px * qw + py * qz - pz * qy, pw * qy + py * qw + pz * qx - px * qz,
  pw * qz + pz * qw + px * qy - py * qx, pw * qw - px * qx - py * qy - pz * qz];

function pose(position_m, yaw_deg, pitch_deg) {
  const turn = (degrees, axis) => [...axis.map((x) => x * Math.sin(degrees * kDegree / 2)),
    Math.cos(degrees * kDegree / 2)];
  return {position_m, orientation: product(turn(yaw_deg, [0, 1, 0]), turn(pitch_deg, [1, 0, 0]))};
}

// Of a walk whose yaw never takes the other way round.
function pose_at(points, time_s) {
  const after = points.findIndex((point) => point.time_s > time_s);
  const [a, b] = after < 0 ? [points.at(-1), points.at(-1)] : [points[Math.max(after - 1, 0)], points[after]];
  const t = b.time_s > a.time_s ? Math.max((time_s - a.time_s) / (b.time_s - a.time_s), 0) : 0;
  const between = (x, y) => x + t * (y - x);
  return pose(a.position_m.map((x, i) => between(x, b.position_m[i])), between(a.yaw_deg, b.yaw_deg),
    between(a.pitch_deg, b.pitch_deg));
}

function render(bake, options, points, expected) {
  const context = native.call("clamor_create", {caller_updates: 1});
  const level = native.open(context, readFileSync(bake), bake);
  const ears = native.call("clamor_create_listener", context, level,
    {offline: 1, pose: pose_at(points, 0), ...options});
  const channels = native.call("clamor_get_channels", context, ears);
  const block = native.module._malloc(4 * channels * kBlockFrames);
  const made = new Float32Array(expected.length);
  for (let at = 0; at < made.length; at += channels * kBlockFrames) {
    for (;;) {
      const [wanted, time_s] = native.call("clamor_next_keyframe", context, ears);
      if (!wanted) break;
      native.call("clamor_move_listener", context, ears, pose_at(points, time_s));
      native.call("clamor_update", context, 0);
    }
    const frames = Math.min(kBlockFrames, (made.length - at) / channels);
    native.call("clamor_render", context, ears, block, frames);
    made.set(native.module.HEAPF32.subarray(block / 4, block / 4 + frames * channels), at);
  }
  native.release(block);
  native.call("clamor_destroy", context);
  return made;
}

function compare(wav, bake, options, points) {
  const difference = compared(render(bake, options, points, samples_of(wav)), wav);
  console.log(`node: ${wav}: ${difference.toFixed(1)} dB`);
  return difference;
}

const at = (...position_m) => [{time_s: 0, position_m, yaw_deg: 0, pitch_deg: 0}];
const within = (bound_db, difference_db) => assert(difference_db < bound_db, `${difference_db} dB`);
within(-100, compare("headphones.wav", "room.clamor", {}, at(-2, 1.7, 3)));
within(-100, compare("edge.wav", "room.clamor", {}, at(0, 1, 0)));
within(-100, compare("loudspeakers.wav", "room.clamor", {output: 1, layout: "5.1"}, at(2, 1.7, 0)));
within(-100, compare("ambisonics.wav", "room.clamor", {output: 2}, at(-2, 1.7, 3)));
within(-100, compare("paper.wav", "paper.clamor", {voices: 500}, at(0, 1.7, 3)));
within(-100, compare("walk.wav", "room.clamor", {voices: 600}, JSON.parse(readFileSync("walk.json")).points));

// A damaged bake is refused with a sentence that names it, or plays; it never ends the module.
const whole = readFileSync("room.clamor");
const context = native.call("clamor_create", {caller_updates: 1});
let refused = 0;
let state = 1;
const random = (below) => {
  state = (state * 48271) % 2147483647;
  return state % below;
};
for (let i = 0; i < 200; ++i) {
  const bytes = i % 2 ? whole.subarray(0, random(whole.length)) : Uint8Array.from(whole);
  if (i % 2 === 0) for (let k = 0; k < 8; ++k) bytes[random(i < 100 ? 4000 : bytes.length)] ^= 1 << random(8);
  try {
    const level = native.open(context, bytes, "damaged.clamor");
    const ears = native.call("clamor_create_listener", context, level, {voices: 100});
    native.call("clamor_update", context, 0);
    native.call("clamor_destroy_listener", context, ears);
    native.call("clamor_close_level", context, level);
    assert(i % 2 === 0, `a bake of ${bytes.length} bytes plays`);  // a bit may be nobody's
  } catch (error) {
    assert.equal(error.code, -3, error.stack ?? error);
    assert.match(error.message, /damaged\.clamor/);
    ++refused;
  }
}

// What 32 bits cannot hold is refused.
const fails = (code, call) => assert.throws(call, (error) => error.code === code && error.message.length > 10);
const never = native.module.addFunction(() => 1, "iijji");
fails(-3, () => native.call("clamor_open_level_with", context, {name: "huge", size: 1n << 40n, read: never}));
for (const frames of [1n << 30n, (1n << 62n) + 1n, 0xffffffffn])
  assert.throws(() => native.call("clamor_add_sound", context, 8, frames), (error) => error.code < 0);
native.call("clamor_destroy", context);

// Memory does not grow over many contexts, whether a level is in memory or read in parts.
const parts = {size: whole.length, read: (offset, into) => into.set(whole.subarray(offset, offset + into.length))};
const open = (i) => {
  const world = native.call("clamor_create", {caller_updates: 1});
  const level = i % 2 ? native.open(world, whole, "room.clamor") : native.open_with(world, parts, "room.clamor");
  native.call("clamor_create_listener", world, level, {voices: 200});
  native.call("clamor_update", world, 0);
  assert(native.add_sound(world, new Float32Array(4410), {rate_hz: 44100}));  // which is resampled
  native.call("clamor_destroy", world);
};
for (let i = 0; i < 4; ++i) open(i);
const bytes = native.module.HEAPU8.length;
for (let i = 0; i < 100; ++i) open(i);
assert.equal(native.module.HEAPU8.length, bytes);
assert.equal(native.bakes.size, 0);
console.log(`${refused} of 200 damaged bakes are refused; ${bytes >> 20} MB of memory`);
