#!/usr/bin/env bash
# web-audio-api 1.5.6: a seamless loop clicks once a turn, unless it is played at exactly its own rate.
#
# Between two frames of a buffer the package interpolates. After the last frame of a loop comes the first; the
# package goes on in a straight line through the last two instead, for up to a whole frame, and then is at once at
# the first. At the context's rate and a playbackRate of 1 no value is asked for between frames, and nothing is to
# be heard; it comes with a change of pitch or detune, and with a buffer of another rate. Of a loop of noise, one or
# more samples in each turn are off by up to 1.4 times the peak here. node-web-audio-api 2.2.0 plays it as it should be.
#
# It concerns loops of engines, rain and hums at more than one pitch, and tests of them. Put a copy of the first
# frame after the last, and set loopEnd to the frame between: what is asked for past the last frame is then there.
# Clamor renders loops itself, and is not concerned.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . web-audio-api@1.5.6 node-web-audio-api@2.2.0

cat >run.mjs <<'EOF'
// A loop of 800 frames of noise, and how far what is played is from straight lines between its frames.
const length = 800;
let state = 1;
const noise = Float32Array.from({length}, () => (state = (state * 1103515245 + 12345) % 2 ** 31) / 2 ** 30 - 1);
async function error({OfflineAudioContext}, playbackRate, more = 0) {
  const context = new OfflineAudioContext(1, 24000, 48000);
  const buffer = context.createBuffer(1, length + more, 48000);
  buffer.copyToChannel(Float32Array.from({length: length + more}, (_, i) => noise[i % length]), 0);
  const source = context.createBufferSource();
  source.buffer = buffer;
  source.loop = true;
  source.loopEnd = length / 48000;
  source.playbackRate.value = playbackRate;
  source.connect(context.destination);
  source.start();
  const off = Array.from((await context.startRendering()).getChannelData(0), (x, i) => {
    const at = i * playbackRate, frame = Math.floor(at);
    return Math.abs(x - noise[frame % length] * (frame + 1 - at) - noise[(frame + 1) % length] * (at - frame));
  });
  return `${off.filter((x) => x > 0.001).length} samples off, by up to ${Math.max(...off).toFixed(2)}`;
}
for (const name of ["web-audio-api", "node-web-audio-api"]) {
  const api = await import(name);
  for (const rate of [1, 0.75, 0.375]) console.log(`${name}, rate ${rate}: ${await error(api, rate)}`);
}
console.log(`web-audio-api, rate 0.375, first frame repeated: ${await error(await import("web-audio-api"), 0.375, 1)}`);
process.exit(0);
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
web-audio-api, rate 1: 0 samples off, by up to 0.00
web-audio-api, rate 0.75: 22 samples off, by up to 1.19
web-audio-api, rate 0.375: 26 samples off, by up to 1.39
node-web-audio-api, rate 1: 0 samples off, by up to 0.00
node-web-audio-api, rate 0.75: 0 samples off, by up to 0.00
node-web-audio-api, rate 0.375: 0 samples off, by up to 0.00
web-audio-api, rate 0.375, first frame repeated: 0 samples off, by up to 0.00
EOF
cmp -s seen expected || { echo "What is played at the seam of a loop has changed."; exit 1; }
