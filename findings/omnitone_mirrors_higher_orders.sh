#!/usr/bin/env bash
# omnitone 1.3.0: second and third order swap left and right, first order does not.
#
# Its renderers take AmbiX: channels in ACN order, SN3D. Noise from the left, in that form, is 11 dB louder in the left
# ear by createFOARenderer(), and 12 and 10 dB louder in the right ear by createHOARenderer() of order 2 and 3; noise
# from the right is the other way round, and from ahead both ears are equal. So a scene that is heard by both orders
# is mirrored in one of them, front and back are right, and nothing looks wrong in the channels.
#
# It concerns all who play AmbiX of higher orders in a browser, whatever wrote the file. Negate the
# channels whose harmonics are odd in y (ACN 1, 4, 5, 9, 10, 11) before the renderer, or use the first order.
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
for (const order of [1, 2, 3]) for (const [side, y] of [["left", 1], ["right", -1]]) {
  const difference = await page.evaluate(async ([order, y]) => {
    // Spherical harmonics of a direction along y, ACN and SN3D.
    const harmonics = [1, y, 0, 0, 0, 0, -0.5, 0, -Math.sqrt(3) / 2, -Math.sqrt(5 / 8) * y, 0, -Math.sqrt(3 / 8) * y, 0, 0, 0, 0];
    const channels = (order + 1) ** 2, audio = new OfflineAudioContext(2, 24000, 48000);
    const buffer = audio.createBuffer(channels, 24000, 48000);
    let seed = 1;
    const noise = Float32Array.from({length: 24000}, () => (seed = seed * 48271 % 2147483647) / 1073741824 - 1);
    for (let c = 0; c < channels; ++c) buffer.copyToChannel(noise.map((x) => x * harmonics[c]), c);
    const source = new AudioBufferSourceNode(audio, {buffer});
    const renderer = order === 1 ? Omnitone.createFOARenderer(audio) : Omnitone.createHOARenderer(audio, {ambisonicOrder: order});
    await renderer.initialize();
    source.connect(renderer.input);
    renderer.output.connect(audio.destination);
    source.start();
    const heard = await audio.startRendering();
    const [left, right] = [0, 1].map((ear) => heard.getChannelData(ear).reduce((sum, x) => sum + x * x, 0));
    return 10 * Math.log10(left / right);
  }, [order, y]);
  console.log(`order ${order}, from the ${side}: ${Math.abs(difference).toFixed(0)} dB louder in the ${difference > 0 ? "left" : "right"} ear`);
}
await browser.close();
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
order 1, from the left: 11 dB louder in the left ear
order 1, from the right: 11 dB louder in the right ear
order 2, from the left: 12 dB louder in the right ear
order 2, from the right: 12 dB louder in the left ear
order 3, from the left: 10 dB louder in the right ear
order 3, from the right: 10 dB louder in the left ear
EOF
cmp -s seen expected || { echo "What omnitone does with left and right has changed."; exit 1; }
