#!/usr/bin/env bash
# omnitone 1.3.0: second and third order hear the scene turned by 180 degrees, first order does not.
#
# Its renderers take AmbiX: channels in ACN order, SN3D. Noise from the left, in that form, is 11 dB louder in the left
# ear by createFOARenderer(), and 12 and 10 dB louder in the right ear by createHOARenderer() of order 2 and 3. Ahead and
# behind are exchanged, too: between 3.5 and 7 kHz, where ears are louder ahead, first order is 4 dB louder ahead and the
# others 4 and 3 dB louder behind. So it is a turn about the vertical: the rotation that is no rotation has two wrong
# signs, and nothing looks wrong in the channels.
#
# It concerns all who play AmbiX of higher orders in a browser, whatever wrote the file, and who compare orders. Call
# renderer.setRotationMatrix3([-1, 0, 0, 0, 1, 0, 0, 0, -1]) for a head that does not turn, or use the first order.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . @sparticuz/chromium@141.0.0 playwright-core@1.65.1 omnitone@1.3.0

cat >run.mjs <<'EOF'
import browser_package from "@sparticuz/chromium";
import {chromium} from "playwright-core";
const browser = await chromium.launch({executablePath: await browser_package.executablePath(), args: ["--no-sandbox", "--disable-gpu"]});
const page = await browser.newPage();
await page.addScriptTag({path: "node_modules/omnitone/build/omnitone.min.js"});

// The levels in both ears of noise from x ahead or y to the left, in decibels.
const levels = (order, x, y, band, turned) => page.evaluate(async ([order, x, y, band, turned]) => {
  // Spherical harmonics of a horizontal direction along an axis, ACN and SN3D.
  const harmonics = [1, y, 0, x, 0, 0, -0.5, 0, Math.sqrt(3) / 2 * (x * x - y * y), -Math.sqrt(5 / 8) * y, 0,
    -Math.sqrt(3 / 8) * y, 0, -Math.sqrt(3 / 8) * x, 0, Math.sqrt(5 / 8) * x];
  const channels = (order + 1) ** 2, audio = new OfflineAudioContext(2, 24000, 48000);
  const buffer = audio.createBuffer(channels, 24000, 48000);
  let seed = 1;
  const noise = Float32Array.from({length: 24000}, () => (seed = seed * 48271 % 2147483647) / 1073741824 - 1);
  for (let c = 0; c < channels; ++c) buffer.copyToChannel(noise.map((sample) => sample * harmonics[c]), c);
  const source = new AudioBufferSourceNode(audio, {buffer});
  const renderer = order === 1 ? Omnitone.createFOARenderer(audio) : Omnitone.createHOARenderer(audio, {ambisonicOrder: order});
  await renderer.initialize();
  if (turned) renderer.setRotationMatrix3([-1, 0, 0, 0, 1, 0, 0, 0, -1]);
  source.connect(renderer.input);
  let last = renderer.output;
  for (const [type, frequency] of band ? [["highpass", 3500], ["lowpass", 7000]] : [])
    last = last.connect(new BiquadFilterNode(audio, {type, frequency}));
  last.connect(audio.destination);
  source.start();
  const heard = await audio.startRendering();
  return [0, 1].map((ear) => 10 * Math.log10(heard.getChannelData(ear).reduce((sum, x) => sum + x * x, 0)));
}, [order, x, y, band, turned]);

const louder = (difference, [a, b]) => `${Math.abs(difference).toFixed(0)} dB louder ${difference > 0 ? a : b}`;
for (const [order, turned] of [[1, false], [2, false], [3, false], [2, true], [3, true]]) {
  const [left, right] = await levels(order, 0, 1, false, turned);
  const [ahead] = await levels(order, 1, 0, true, turned), [behind] = await levels(order, -1, 0, true, turned);
  console.log(`order ${order}${turned ? ", turned" : ""}: from the left ${louder(left - right, ["in the left ear", "in the right ear"])}; ` +
    `3.5 to 7 kHz ${louder(ahead - behind, ["from ahead", "from behind"])}`);
}
await browser.close();
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
order 1: from the left 11 dB louder in the left ear; 3.5 to 7 kHz 4 dB louder from ahead
order 2: from the left 12 dB louder in the right ear; 3.5 to 7 kHz 4 dB louder from behind
order 3: from the left 10 dB louder in the right ear; 3.5 to 7 kHz 3 dB louder from behind
order 2, turned: from the left 12 dB louder in the left ear; 3.5 to 7 kHz 4 dB louder from ahead
order 3, turned: from the left 10 dB louder in the left ear; 3.5 to 7 kHz 3 dB louder from ahead
EOF
cmp -s seen expected || { echo "How omnitone turns a scene has changed."; exit 1; }
