#!/usr/bin/env bash
# node-web-audio-api 2.2.0 and web-audio-api 1.5.6: a linear PannerNode of one distance makes the whole mix NaN.
#
# With distanceModel "linear", a sound falls from refDistance to maxDistance. The two may be equal, as for a sound that
# is to end at one distance: the standard (PannerNode, DistanceModelType) then takes 1 - rolloffFactor, as Chromium 141
# does. Both packages divide 0 by 0, and throw nothing. Below, a sound of 0.1 s goes through such a panner, and another
# one of 1 s does not: the mix of both is NaN as long as the first one lasts, and in web-audio-api to the end.
#
# It concerns who renders or tests in Node what browsers play, with distances from data, and writes files of it, in which
# NaN becomes silence or full scale. Keep maxDistance above refDistance by some millimetres.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . node-web-audio-api@2.2.0 web-audio-api@1.5.6 \
  @sparticuz/chromium@141.0.0 playwright-core@1.65.1

cat >run.mjs <<'EOF'
import browser_package from "@sparticuz/chromium";
import {chromium} from "playwright-core";

// A sound of 0.1 s through a panner and a sound of 1 s meet in a node: the right channel in frame 4000 and the last one.
async function heard(api, maxDistance) {
  const context = new (api ?? globalThis).OfflineAudioContext(2, 48000, 48000);
  const buffer = context.createBuffer(1, 48000, 48000);
  buffer.copyToChannel(new Float32Array(48000).fill(0.5), 0);
  const panner = context.createPanner(), mix = context.createGain();
  Object.assign(panner, {distanceModel: "linear", refDistance: 5, maxDistance, rolloffFactor: 0.5});
  panner.positionX.value = 3;
  const sources = [context.createBufferSource(), context.createBufferSource()];
  for (const source of sources) source.buffer = buffer;
  sources[0].connect(panner);
  panner.connect(mix);
  mix.connect(context.destination);
  sources[1].connect(mix);
  sources[0].start(0, 0, 0.1);
  sources[1].start();
  const right = (await context.startRendering()).getChannelData(1);
  return [4000, 47999].map((frame) => right[frame].toFixed(2)).join(" and then ");
}
const browser = await chromium.launch({executablePath: await browser_package.executablePath(), args: ["--no-sandbox", "--disable-gpu"]});
const page = await browser.newPage();
for (const maxDistance of [5.001, 5]) {
  console.log(`Chromium 141, maxDistance ${maxDistance}: ${await page.evaluate(`(${heard})(null, ${maxDistance})`)}`);
  for (const name of ["node-web-audio-api", "web-audio-api"])
    console.log(`${name}, maxDistance ${maxDistance}: ${await heard(await import(name), maxDistance)}`);
}
await browser.close();
process.exit(0);
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
Chromium 141, maxDistance 5.001: 1.00 and then 0.50
node-web-audio-api, maxDistance 5.001: 1.00 and then 0.50
web-audio-api, maxDistance 5.001: 1.00 and then 0.50
Chromium 141, maxDistance 5: 0.75 and then 0.50
node-web-audio-api, maxDistance 5: NaN and then 0.50
web-audio-api, maxDistance 5: NaN and then NaN
EOF
cmp -s seen expected || { echo "What a linear PannerNode of one distance plays has changed."; exit 1; }
