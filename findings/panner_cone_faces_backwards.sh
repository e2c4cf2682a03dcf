#!/usr/bin/env bash
# node-web-audio-api 1.0.9 and 2.2.0: a sound with a cone is loud behind its source and quiet before it.
#
# A PannerNode's orientation is the way in which its source points. A listener straight before it is in the inner
# cone, where the gain is 1, and one straight behind it hears coneOuterGain; so the standard's drawing has it, and
# so browsers play it. The package takes the angle from the listener to the source where it should take that from
# the source to the listener, which turns every cone round. The standard's own pseudo-code subtracts its two points
# in that order. Pan and distance are as they should be, and sources without a cone have nothing to turn, so that
# a listening test on a desk does not show it. web-audio-api 1.5.6 plays cones as browsers do.
#
# It concerns who renders or tests on a server what browsers play: three.js's setDirectionalCone, and glTF emitters
# with cones. Give the negative orientation to this package alone, after a test like this one at start.
# Clamor makes a directivity of a glTF emitter's cone itself, and is not concerned.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . web-audio-api@1.5.6 old@npm:node-web-audio-api@1.0.9 \
  new@npm:node-web-audio-api@2.2.0

cat >run.mjs <<'EOF'
// A source 1 m before the listener, who is at the origin, with a cone of 90 degrees, and silence from 180 on.
async function heard({OfflineAudioContext}, z) {
  const context = new OfflineAudioContext(2, 4800, 48000);
  const source = context.createConstantSource(), panner = context.createPanner();
  panner.positionZ.value = -1;
  panner.orientationX.value = 0;
  panner.orientationZ.value = z;
  panner.coneInnerAngle = 90;
  panner.coneOuterAngle = 180;
  panner.coneOuterGain = 0;
  source.connect(panner);
  panner.connect(context.destination);
  source.start();
  const out = await context.startRendering();
  return Math.hypot(out.getChannelData(0).at(-1), out.getChannelData(1).at(-1)).toFixed(2);
}
for (const [name, library] of [["web-audio-api 1.5.6", "web-audio-api"], ["node-web-audio-api 1.0.9", "old"], ["node-web-audio-api 2.2.0", "new"]]) {
  const api = await import(library);
  console.log(`${name}: ${await heard(api, 1)} where the source faces the listener, ${await heard(api, -1)} where it faces away`);
}
process.exit(0);
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
web-audio-api 1.5.6: 1.00 where the source faces the listener, 0.00 where it faces away
node-web-audio-api 1.0.9: 0.00 where the source faces the listener, 1.00 where it faces away
node-web-audio-api 2.2.0: 0.00 where the source faces the listener, 1.00 where it faces away
EOF
cmp -s seen expected || { echo "Where a PannerNode's cone points has changed."; exit 1; }
