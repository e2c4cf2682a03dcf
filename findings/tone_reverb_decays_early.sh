#!/usr/bin/env bash
# Tone.js 15.5.44: a Reverb with a decay of 10 s has fallen by 60 dB after 3.1 s, and one of 30 s after 4.5 s.
#
# Reverb makes a response of noise, and says that `decay` is the duration of the reverb. It calls a Param's
# exponentialApproachValueAtTime(), which is to reach "over 99% of the way" in that time, so that duration / ln(200)
# would be the time constant. The time constant is ln(1 + duration) / ln(200) instead, and the reverberation time
# 1.304 ln(1 + decay), the closed form below: 1.2 s by default, where `decay` is 1.5 s, and never much longer, since
# twice the decay adds 0.9 s. The last two thirds of 10 s are silence that is convolved all the same. Decays and
# releases of envelopes that are "exponential" go the same way.
#
# It concerns who sets a measured or computed reverberation time T60, or matches a browser's reverb to another one's.
# Give decay = exp(T60 / 1.304) - 1, which for 3.1 s is 10 s, or convolve with a response of one's own. Clamor makes its
# reverberation from the level, and is not concerned.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . @sparticuz/chromium@141.0.0 playwright-core@1.65.1 tone@15.5.44

cat >run.mjs <<'EOF'
import browser_package from "@sparticuz/chromium";
import {chromium} from "playwright-core";
const browser = await chromium.launch({executablePath: await browser_package.executablePath(), args: ["--no-sandbox", "--disable-gpu"]});
const page = await browser.newPage();
await page.addScriptTag({path: "node_modules/tone/build/Tone.js"});

const closed_form_s = (decay_s) => Math.log(1000) * Math.log(1 + decay_s) / Math.log(200);

// The reverberation time of a click's echoes, from the fall of their level over about 40 dB.
const reverberation_time_s = (decay_s, span_s) => page.evaluate(async ([decay_s, span_s]) => {
  const heard = await Tone.Offline(async () => {
    const reverb = new Tone.Reverb({decay: decay_s, preDelay: 0, wet: 1}).toDestination();
    await reverb.ready;
    const context = Tone.getContext(), click = context.createBufferSource();
    click.buffer = context.createBuffer(1, 1, 48000);
    click.buffer.getChannelData(0)[0] = 1;
    Tone.connect(click, reverb);
    click.start(0);
  }, decay_s, 2, 48000);
  const level_db = (time_s) => {
    const from = Math.round(time_s * 48000), frames = Math.round(0.05 * decay_s * 48000);
    return 10 * Math.log10([0, 1].reduce((sum, c) => sum + heard.toArray(c).slice(from, from + frames).reduce((s, x) => s + x * x, 0), 0));
  };
  return 60 * span_s / (level_db(0) - level_db(span_s));
}, [decay_s, span_s]);

let worst = 0;
for (const decay_s of [0.2, 1.5, 10, 30]) {
  const formula_s = closed_form_s(decay_s), seen_s = await reverberation_time_s(decay_s, Math.min(2 / 3 * formula_s, 0.7 * decay_s));
  worst = Math.max(worst, Math.abs(seen_s / formula_s - 1));
  console.log(`decay ${decay_s} s: 60 dB in ${seen_s.toFixed(2)} s, by the closed form ${formula_s.toFixed(2)} s`);
}
await browser.close();
process.exit(worst < 0.05 ? 0 : 1);
EOF

node run.mjs || { echo "The reverberation time of Tone.js has changed."; exit 1; }
