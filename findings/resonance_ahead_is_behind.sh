#!/usr/bin/env bash
# resonance-audio 1.0.0: a source ahead sounds behind, unless setListenerOrientation() is called a moment later.
#
# A scene with its defaults looks along -Z. A source there is heard with a negative X channel in AmbiX, which is behind;
# one at +Z is heard ahead, and left and right are right. A call of setListenerOrientation() with the very default,
# (0, 0, -1, 0, 1, 0), exchanges both, but only after the decoder has loaded its responses: before, the call is
# dropped without a word. An AmbiX recording at `ambisonicInput` is right at first, and that call mirrors it, so that
# sources and a recording are never right together. setListenerFromMatrix() with the identity changes nothing.
#
# It concerns all who place sources by it, or compare it with another renderer. Call setListenerOrientation() at each
# frame, as a walking listener does anyway, and give recordings another scene, whose orientation is left alone.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . @sparticuz/chromium@141.0.0 playwright-core@1.65.1 resonance-audio@1.0.0

cat >run.mjs <<'EOF'
import browser_package from "@sparticuz/chromium";
import {chromium} from "playwright-core";
const browser = await chromium.launch({executablePath: await browser_package.executablePath(), args: ["--no-sandbox", "--disable-gpu"]});
const page = await browser.newPage();
await page.addScriptTag({path: "node_modules/resonance-audio/build/resonance-audio.js"});

// Where the AmbiX output of the scene has a click, of a source at -Z or of a recording of a click ahead.
const heard = (what, when) => page.evaluate(async ([what, when]) => {
  const audio = new OfflineAudioContext(4, 4800, 48000);
  const scene = new ResonanceAudio(audio, {ambisonicOrder: 1});
  const loaded = () => new Promise((resolve) => { setTimeout(resolve, 500); });
  const orient = () => scene.setListenerOrientation(0, 0, -1, 0, 1, 0);
  if (when === "at once") orient();
  await loaded();
  if (when === "later") orient();
  const buffer = audio.createBuffer(what === "source" ? 1 : 4, 1, 48000);
  for (const channel of what === "source" ? [0] : [0, 3]) buffer.getChannelData(channel)[0] = 1;
  const click = new AudioBufferSourceNode(audio, {buffer});
  if (what === "source") {
    const source = scene.createSource();
    source.setPosition(0, 0, -2);
    click.connect(source.input);
  } else {
    click.connect(scene.ambisonicInput);
  }
  scene.ambisonicOutput.connect(audio.destination);
  click.start();
  const out = await audio.startRendering();
  const [w, y, , x] = [0, 1, 2, 3].map((channel) => out.getChannelData(channel).reduce((sum, sample) => sum + sample, 0));
  return Math.abs(y) > 0.01 * w ? "aside" : x > 0 ? "ahead" : "behind";
}, [what, when]);
for (const what of ["source", "recording"])
  for (const when of ["never", "at once", "later"])
    console.log(`${what} ahead, setListenerOrientation() called ${when}: ${await heard(what, when)}`);
await browser.close();
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
source ahead, setListenerOrientation() called never: behind
source ahead, setListenerOrientation() called at once: behind
source ahead, setListenerOrientation() called later: ahead
recording ahead, setListenerOrientation() called never: ahead
recording ahead, setListenerOrientation() called at once: ahead
recording ahead, setListenerOrientation() called later: behind
EOF
cmp -s seen expected || { echo "Which way Resonance Audio looks has changed."; exit 1; }
