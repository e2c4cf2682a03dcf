#!/usr/bin/env bash
# resonance-audio 1.0.0: an early reflection travels the way to the wall and 1 m, but not the way back.
#
# A listener and a source stand in the middle of a room; the sound goes to a wall at the distance d and returns, so
# the reflection has a way of 2 d, and at d = 10 m comes after 58 ms. The package delays it by d + 1 m, 32 ms, and
# takes its level from that distance too, so it is also 5 dB too loud. Only at d = 1 m are both right. Where the
# source is plays no part: all sources of a room have the same reflections, those of the listener's place.
#
# It concerns who compares its rooms with measured or traced ones, or judges a room's size by ear: a hall sounds
# about half as large. No option says otherwise, but the constants can be set before the first room is made:
# ResonanceAudio.Utils.DEFAULT_REFLECTION_MULTIPLIER to 2 and DEFAULT_REFLECTION_MIN_DISTANCE to 0.1, so that a
# listener at a wall divides by no 0. Clamor traces each path from its source to the listener.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . resonance-audio@1.0.0 node-web-audio-api@2.2.0

cat >run.mjs <<'EOF'
import {createRequire} from "node:module";
import {OfflineAudioContext} from "node-web-audio-api";

// The package asks for a browser's name when it is loaded.
console.log = () => {};
globalThis.window = globalThis;
Object.defineProperty(globalThis, "navigator", {value: {userAgent: "Mozilla/5.0 (X11; Linux x86_64) Chrome/120.0.0.0", platform: "Linux"}});
const {ResonanceAudio: {EarlyReflections, Utils}} = createRequire(import.meta.url)("resonance-audio");

// The delay and the gain of the reflection from the left wall, which alone reflects.
async function reflection(width) {
  const context = new OfflineAudioContext(4, 9600, 48000);
  const room = new EarlyReflections(context, {dimensions: {width, height: 50, depth: 50}, coefficients: {left: 1, right: 0, front: 0, back: 0, down: 0, up: 0}});
  const buffer = context.createBuffer(1, 1, 48000);
  buffer.getChannelData(0)[0] = 1;
  const source = context.createBufferSource();
  source.buffer = buffer;
  source.connect(room.input);
  room.output.connect(context.destination);
  source.start();
  const out = (await context.startRendering()).getChannelData(0);
  const sum = out.reduce((all, x) => all + x, 0);  // the gain at 0 Hz: a lowpass is before the delay
  const first = out.findIndex((x) => Math.abs(x) > 1e-3 * sum);
  return `delayed by ${(343 * first / 48000).toFixed(1)} m of way, a gain of 1 / ${(1 / sum).toFixed(1)} m`;
}
for (const distance of [1, 5, 10])
  process.stdout.write(`a wall at ${distance} m, so ${2 * distance} m of way: ${await reflection(2 * distance)}\n`);
Utils.DEFAULT_REFLECTION_MULTIPLIER = 2;
Utils.DEFAULT_REFLECTION_MIN_DISTANCE = 0.1;
for (const distance of [5, 10])
  process.stdout.write(`a wall at ${distance} m, with the constants set: ${await reflection(2 * distance)}\n`);
process.exit(0);
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
a wall at 1 m, so 2 m of way: delayed by 2.0 m of way, a gain of 1 / 2.0 m
a wall at 5 m, so 10 m of way: delayed by 6.0 m of way, a gain of 1 / 6.0 m
a wall at 10 m, so 20 m of way: delayed by 11.0 m of way, a gain of 1 / 11.0 m
a wall at 5 m, with the constants set: delayed by 10.1 m of way, a gain of 1 / 10.1 m
a wall at 10 m, with the constants set: delayed by 20.1 m of way, a gain of 1 / 20.1 m
EOF
cmp -s seen expected || { echo "When early reflections come has changed."; exit 1; }
