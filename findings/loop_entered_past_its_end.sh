#!/usr/bin/env bash
# node-web-audio-api 2.2.0: a loop that is entered at its end or later is played once, and then is silent.
#
# The standard says of start(when, offset): with an offset past loopEnd, playback begins at loopEnd, and at once
# goes on at loopStart. The package does begin at loopEnd, whatever the offset, but then plays on to the end of the
# buffer, past the loop, and is silent from there, with loop still true and no event "ended". One frame before
# loopEnd all is well. web-audio-api 1.5.6 goes to loopStart.
#
# A game that saves where its music or an ambience was, and resumes it there, loses the sound where the file goes
# on after the loop and the place is in that tail; so does one that counts the time played and takes it as offset.
# Take the offset modulo the loop: start(0, loopStart + (offset - loopStart) % (loopEnd - loopStart)).
# Clamor renders loops itself, and is not concerned.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . node-web-audio-api@2.2.0 web-audio-api@1.5.6

cat >run.mjs <<'EOF'
// 100 frames that count from 1, of which those from 10 to 20 are the loop: numbers 11 to 20.
async function played({OfflineAudioContext}, offset) {
  const context = new OfflineAudioContext(1, 48000, 48000);
  const buffer = context.createBuffer(1, 100, 48000);
  buffer.copyToChannel(Float32Array.from({length: 100}, (_, i) => i + 1), 0);
  const source = context.createBufferSource();
  source.buffer = buffer;
  source.loop = true;
  source.loopStart = 10 / 48000;
  source.loopEnd = 20 / 48000;
  source.connect(context.destination);
  source.start(0, offset / 48000);
  const out = Array.from((await context.startRendering()).getChannelData(0), Math.round);
  return `begins with ${out[0]}, reaches ${Math.max(...out)}, ${out.slice(1000).every((x) => x >= 11 && x <= 20) ? "is in the loop" : out.slice(1000).every((x) => x === 0) ? "is silent" : "is elsewhere"} in the end`;
}
for (const name of ["web-audio-api", "node-web-audio-api"])
  for (const offset of [19, 20, 50]) console.log(`${name}, offset of ${offset} frames: ${await played(await import(name), offset)}`);
process.exit(0);
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
web-audio-api, offset of 19 frames: begins with 20, reaches 20, is in the loop in the end
web-audio-api, offset of 20 frames: begins with 11, reaches 20, is in the loop in the end
web-audio-api, offset of 50 frames: begins with 11, reaches 20, is in the loop in the end
node-web-audio-api, offset of 19 frames: begins with 20, reaches 20, is in the loop in the end
node-web-audio-api, offset of 20 frames: begins with 21, reaches 100, is silent in the end
node-web-audio-api, offset of 50 frames: begins with 21, reaches 100, is silent in the end
EOF
cmp -s seen expected || { echo "What a loop plays that is entered past its end has changed."; exit 1; }
