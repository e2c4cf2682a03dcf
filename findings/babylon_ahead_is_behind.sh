#!/usr/bin/env bash
# @babylonjs/core 9.35.0: with HRTFs, what a left-handed scene's camera looks at is heard from behind.
#
# Babylon.js's scenes are left-handed unless one says otherwise: a camera that is not turned looks along +z. Web Audio is
# right-handed, and ahead of a listener that is not turned is -z. The audio engine hands positions on as they are, and
# turns the vector (0, 0, -1) with the camera for the listener's `forward`. So x and y are right, and left stays left,
# but the listener looks backwards: the sound below is that of a plain PannerNode on the opposite side, ahead and behind.
# Panning by "equalpower", the default, does not tell the two apart. In right-handed scenes both are right.
#
# It concerns who sets spatialPanningModel to "HRTF", above all for VR: what one sees ahead has the spectrum of what is
# behind. Set scene.useRightHandedSystem, with which the directions agree, as the example of Clamor for Babylon.js does.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . @babylonjs/core@9.35.0 node-web-audio-api@2.2.0

cat >run.mjs <<'EOF'
import * as webaudio from "node-web-audio-api";
Object.assign(globalThis, webaudio, {document: {addEventListener() {}, removeEventListener() {}}});
const {NullEngine} = await import("@babylonjs/core/Engines/nullEngine.js");
const {Scene} = await import("@babylonjs/core/scene.js");
const {FreeCamera} = await import("@babylonjs/core/Cameras/freeCamera.js");
const {TransformNode} = await import("@babylonjs/core/Meshes/transformNode.js");
const {Vector3} = await import("@babylonjs/core/Maths/math.vector.js");
const {Logger} = await import("@babylonjs/core/Misc/logger.js");
const {CreateAudioEngineAsync} = await import("@babylonjs/core/AudioV2/webAudio/webAudioEngine.js");
Logger.LogLevels = Logger.ErrorLogLevel;

const frames = 24000;
function noise(context) {
  const buffer = context.createBuffer(1, frames, 48000);
  let seed = 1;
  buffer.copyToChannel(Float32Array.from({length: frames}, () => (seed = seed * 48271 % 2147483647) / 1073741824 - 1), 0);
  return buffer;
}
// The level in the left ear of the second half, when positions have long been reached, in decibels.
async function heard(make) {
  const context = new OfflineAudioContext(2, frames, 48000);
  await make(context);
  const left = (await context.startRendering()).getChannelData(0).slice(frames / 2);
  return 10 * Math.log10(left.reduce((sum, x) => sum + x * x, 0));
}
const plain = (z) => heard((context) => {
  const panner = new PannerNode(context, {panningModel: "HRTF", distanceModel: "linear", positionZ: z});
  const source = new AudioBufferSourceNode(context, {buffer: noise(context)});
  source.connect(panner).connect(context.destination);
  source.start();
});
// A source 2 m before or behind a camera that looks along z, 1 or -1.
const babylon = (right_handed, z, is_ahead) => heard(async (context) => {
  const scene = new Scene(new NullEngine());
  scene.useRightHandedSystem = right_handed;
  const camera = new FreeCamera("camera", Vector3.Zero(), scene);
  camera.setTarget(new Vector3(0, 0, z));
  const radio = new TransformNode("radio", scene);
  radio.position.z = is_ahead ? 2 * z : -2 * z;
  scene.render();
  const audio = await CreateAudioEngineAsync({audioContext: context, disableDefaultUI: true, listenerAutoUpdate: false});
  const sound = await audio.createSoundAsync("sound", noise(context),
    {spatialEnabled: true, spatialAutoUpdate: false, spatialPanningModel: "HRTF", spatialDistanceModel: "linear"});
  audio.listener.attach(camera);
  audio.listener.update();
  sound.spatial.attach(radio);
  sound.spatial.update();
  sound.play();
});
const [ahead, behind] = [await plain(-2), await plain(2)];
for (const right_handed of [false, true])
  for (const z of [1, -1])
    for (const is_ahead of [true, false]) {
      const level = await babylon(right_handed, z, is_ahead);
      const where = [["ahead", ahead], ["behind", behind]].filter(([, plain]) => Math.abs(plain - level) < 0.3).map(([name]) => name);
      console.log(`${right_handed ? "right" : "left"}-handed, camera along ${z > 0 ? "+z" : "-z"}, source ${is_ahead ? "ahead" : "behind"}: heard ${where}`);
    }
console.log(`a plain PannerNode is ${(ahead - behind).toFixed(1)} dB louder ahead than behind`);
process.exit(0);
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
left-handed, camera along +z, source ahead: heard behind
left-handed, camera along +z, source behind: heard ahead
left-handed, camera along -z, source ahead: heard behind
left-handed, camera along -z, source behind: heard ahead
right-handed, camera along +z, source ahead: heard ahead
right-handed, camera along +z, source behind: heard behind
right-handed, camera along -z, source ahead: heard ahead
right-handed, camera along -z, source behind: heard behind
EOF
cmp -s <(head -8 seen) expected || { echo "Where Babylon.js's sounds are heard has changed."; exit 1; }
