#!/usr/bin/env bash
# Chromium 141: a PannerNode in HRTF mode is 3.5 dB louder in a context of 96 kHz than in one of 48 kHz.
#
# The head's responses are made for 44.1 kHz and resampled to the context's rate, and the level goes with the rate: a
# tone of 1 kHz straight ahead, at 1 m, is -5.7 dB at 44.1 kHz, -5.3 dB at 48 kHz and -1.8 dB at 96 kHz in each ear.
# The mode equalpower gives -3.01 dB at all rates, as the standard says. So a mix of panned and other sounds, or of
# both modes, has another balance on an interface that runs at 96 kHz, which nobody hears who tests at 48 kHz.
#
# It concerns all who place sounds with PannerNode, three.js's PositionalAudio and Babylon.js among them. Ask for a
# rate, as new AudioContext({sampleRate: 48000}). Clamor's player renders heads of its own, and is not concerned.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . @sparticuz/chromium@141.0.0 playwright-core@1.65.1

cat >run.mjs <<'EOF'
import browser_package from "@sparticuz/chromium";
import {chromium} from "playwright-core";
const browser = await chromium.launch({executablePath: await browser_package.executablePath(), args: ["--no-sandbox", "--disable-gpu"]});
const page = await browser.newPage();
for (const panningModel of ["HRTF", "equalpower"]) {
  const levels = await page.evaluate((model) => Promise.all([44100, 48000, 96000].map(async (rate) => {
    const audio = new OfflineAudioContext(2, rate, rate);
    const tone = new OscillatorNode(audio, {frequency: 1000});
    const panner = new PannerNode(audio, {panningModel: model, positionX: 0, positionY: 0, positionZ: -1});
    tone.connect(panner).connect(audio.destination);
    tone.start();
    const heard = (await audio.startRendering()).getChannelData(0).slice(rate / 2);
    return (10 * Math.log10(2 * heard.reduce((sum, x) => sum + x * x, 0) / heard.length)).toFixed(1);
  })), panningModel);
  console.log(`${panningModel}: ${levels[0]} dB at 44.1 kHz, ${levels[1]} dB at 48 kHz, ${levels[2]} dB at 96 kHz`);
}
await browser.close();
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
HRTF: -5.7 dB at 44.1 kHz, -5.3 dB at 48 kHz, -1.8 dB at 96 kHz
equalpower: -3.0 dB at 44.1 kHz, -3.0 dB at 48 kHz, -3.0 dB at 96 kHz
EOF
cmp -s seen expected || { echo "The level of a PannerNode has changed."; exit 1; }
