#!/usr/bin/env bash
# web-audio-api 1.5.6: a normalised convolver is too loud, by 12 dB for a response of 1 s and by 6 dB for 4 s.
#
# ConvolverNode.normalize is true unless one sets it. The standard's formula divides the response by the root of its
# mean power, and multiplies by 0.00125 (-58 dB) and by 44.1 kHz over the rate. The package divides by the root of
# the whole energy instead, without the mean and the factors. A mix of dry and reverberant sound that was balanced
# in a browser is then 12 dB too wet with a response of 1 s, 6 dB with one of 4 s, and 59 dB with a single frame.
# node-web-audio-api 2.2.0 follows the formula.
#
# It concerns who renders on a server, or tests there, what browsers play. Set normalize to false before the buffer,
# and scale the response oneself: the two packages then agree. Clamor convolves by itself, and is
# not concerned.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . web-audio-api@1.5.6 node-web-audio-api@2.2.0

cat >run.mjs <<'EOF'
// What a click becomes in a response that is a click and then silence, so of the energy 1.
async function level({OfflineAudioContext}, seconds, normalize) {
  const context = new OfflineAudioContext(1, 4800, 48000);
  const response = context.createBuffer(1, Math.max(1, seconds * 48000), 48000);
  response.getChannelData(0)[0] = 1;
  const click = context.createBuffer(1, 1, 48000);
  click.getChannelData(0)[0] = 1;
  const source = context.createBufferSource(), convolver = context.createConvolver();
  source.buffer = click;
  convolver.normalize = normalize;
  convolver.buffer = response;
  source.connect(convolver);
  convolver.connect(context.destination);
  source.start();
  return (20 * Math.log10((await context.startRendering()).getChannelData(0)[0]) + 0).toFixed(1);
}
// The standard, "ConvolverNode": calculateNormalizationScale.
const standard = (seconds) => (20 * Math.log10(Math.sqrt(Math.max(1, seconds * 48000)) * 0.00125 * 44100 / 48000)).toFixed(1);
for (const seconds of [0, 1, 4]) console.log(`the standard's formula, ${seconds ? seconds + " s" : "1 frame"}: ${standard(seconds)} dB`);
for (const name of ["node-web-audio-api", "web-audio-api"]) {
  const api = await import(name);
  for (const seconds of [0, 1, 4]) console.log(`${name}, ${seconds ? seconds + " s" : "1 frame"}: ${await level(api, seconds, true)} dB`);
  console.log(`${name}, 1 s, normalize false: ${await level(api, 1, false)} dB`);
}
process.exit(0);
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
the standard's formula, 1 frame: -58.8 dB
the standard's formula, 1 s: -12.0 dB
the standard's formula, 4 s: -6.0 dB
node-web-audio-api, 1 frame: -58.8 dB
node-web-audio-api, 1 s: -12.0 dB
node-web-audio-api, 4 s: -6.0 dB
node-web-audio-api, 1 s, normalize false: 0.0 dB
web-audio-api, 1 frame: 0.0 dB
web-audio-api, 1 s: 0.0 dB
web-audio-api, 4 s: 0.0 dB
web-audio-api, 1 s, normalize false: 0.0 dB
EOF
cmp -s seen expected || { echo "The level of a normalised convolver has changed."; exit 1; }
