#!/usr/bin/env bash
# three.js r187: half a second after a pause of half a second, sounds jump for a frame to where they were after it.
#
# AudioListener and PositionalAudio move by ramps of AudioParams, which they set once a frame, each as long as the last
# frame took. The first one after a pause (a hidden tab, a dialog, a level that loads) takes as long as the pause, and the
# very first one as long as the listener had existed. The ramps of the next frames end earlier and are followed. But the
# end of the long one stays in the timeline, and when its time has come, everything is for a moment where it was when the
# pause ended. The listener's Timer could be told of hidden pages, but is not. Below, a sound passes from left to right,
# the first frame comes a second after the listener was made, and there is no frame between 3 s and 3.5 s: at 2 s and at
# 4 s, the sound clicks, and is heard up to 28 degrees from where it is.
#
# It concerns all who use PositionalAudio with heads or sources that move, as A-Frame does. Give the ramps one length:
# Object.defineProperty(listener, "timeDelta", {get: () => 0.02, set() {}}). Clamor's listener for three.js hands the
# camera's pose to Clamor's player, and sets no ramps.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . @sparticuz/chromium@141.0.0 playwright-core@1.65.1 three@0.187.0

cat >run.mjs <<'EOF'
import browser_package from "@sparticuz/chromium";
import {chromium} from "playwright-core";
const browser = await chromium.launch({executablePath: await browser_package.executablePath(), args: ["--no-sandbox", "--disable-gpu"]});
const page = await browser.newPage();
await page.route("http://localhost/*", (route) => {
  const name = new URL(route.request().url()).pathname;
  return route.fulfill(name === "/" ? {contentType: "text/html", body: ""} : {contentType: "text/javascript", path: "node_modules/three/build" + name});
});
await page.goto("http://localhost/");

// The moments at which the sound is heard 10 degrees or more from where it is, the clock being that of the sound.
const jumps = (first_s, pause_s, ramp_s) => page.evaluate(async ([first_s, pause_s, ramp_s]) => {
  const THREE = await import("http://localhost/three.module.js");
  const rate = 48000, frame = 1024, seconds = 5, context = new OfflineAudioContext(2, seconds * rate, rate);
  let now_s = 0;
  performance.now = () => 1000 * now_s;
  THREE.AudioContext.setContext(context);
  const listener = new THREE.AudioListener(), sound = new THREE.PositionalAudio(listener), scene = new THREE.Scene();
  if (ramp_s) Object.defineProperty(listener, "timeDelta", {get: () => ramp_s, set() {}});
  scene.add(listener, sound);
  const buffer = context.createBuffer(1, rate, rate);
  buffer.copyToChannel(new Float32Array(rate).fill(0.5), 0);
  sound.setBuffer(buffer).setLoop(true).setRolloffFactor(0);
  sound.panner.panningModel = "equalpower";
  const x_m = (time_s) => 0.8 * time_s - 2;
  for (let i = Math.ceil(first_s * rate / frame) * frame; i < seconds * rate; i += frame) {
    const time_s = i / rate;
    if (time_s > 3 && time_s < 3 + pause_s) continue;
    context.suspend(time_s).then(() => {
      now_s = time_s;
      sound.position.set(x_m(time_s), 0, -1);
      if (!sound.isPlaying) sound.play();
      scene.updateMatrixWorld(true);
      context.resume();
    });
  }
  const heard = await context.startRendering(), [left, right] = [heard.getChannelData(0), heard.getChannelData(1)];
  const seen = [];
  for (let i = Math.round((first_s + 0.2) * rate); i < seconds * rate; i += 16) {
    const true_degrees = Math.atan(x_m(i / rate)) * 180 / Math.PI, degrees = Math.atan2(right[i], left[i]) * 360 / Math.PI - 90;
    const last = seen.at(-1);
    if (Math.abs(degrees - true_degrees) < 10 || i / rate > 3 && i / rate < 3.05 + pause_s) continue;
    if (!last || i / rate - last.to_s > 0.1) seen.push({from_s: i / rate, to_s: i / rate, degrees, true_degrees});
    else {
      last.to_s = i / rate;
      if (Math.abs(degrees - true_degrees) > Math.abs(last.degrees - last.true_degrees)) Object.assign(last, {degrees, true_degrees});
    }
  }
  return seen.map(({from_s, to_s, degrees, true_degrees}) => `at ${from_s.toFixed(2)} s for ${Math.round(1000 * (to_s - from_s))} ms ` +
    `at ${degrees.toFixed(0)} degrees instead of ${true_degrees.toFixed(0)}`).join("; ") || "nowhere else";
}, [first_s, pause_s, ramp_s]);

console.log(`no pause, heard: ${await jumps(0, 0)}`);
console.log(`first frame after 1 s, pause from 3 s to 3.5 s, heard: ${await jumps(1, 0.5)}`);
console.log(`the same, ramps of 20 ms, heard: ${await jumps(1, 0.5, 0.02)}`);
await browser.close();
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
no pause, heard: nowhere else
first frame after 1 s, pause from 3 s to 3.5 s, heard: at 1.99 s for 16 ms at -50 degrees instead of -22; at 4.05 s for 3 ms at 39 degrees instead of 51
the same, ramps of 20 ms, heard: nowhere else
EOF
cmp -s seen expected || { echo "Where three.js lets a sound be heard has changed."; exit 1; }
