// three.js: a camera that hears and objects that sound, for three.js.
//
//   const ears = new ClamorThreeListener(await clamor.listen(level), camera);
//   const bell = new ClamorThreeSource(await clamor.addSource(sound), object);
//   const others = await playThreeEmitters(clamor, await loader.loadAsync("radio.glb"));
//   in the loop: ears.update(); bell.update(); for (const other of others) other.update();
import {LoaderUtils, Quaternion, Vector3} from "three";

const kSteps = 256;
const kMostDirectivity = 1000;
const place = new Vector3();
const turn = new Quaternion();

export class ClamorThreeListener {
  constructor(listener, camera) {
    Object.assign(this, {listener, camera});
  }

  update() {
    this.listener.move(this.camera.getWorldPosition(place).toArray(), this.camera.getWorldQuaternion(turn).toArray());
  }
}

export class ClamorThreeSource {
  // `facing` is the axis of the directivity in the object; +Z is where getWorldDirection() looks.
  constructor(source, object, facing = new Vector3(0, 0, 1)) {
    Object.assign(this, {source, object, facing});
  }

  update() {
    const axis = this.facing.clone().applyQuaternion(this.object.getWorldQuaternion(turn)).toArray();
    this.source.move(this.object.getWorldPosition(place).toArray(), undefined, axis);
  }
}

// Plays the emitters of what GLTFLoader has loaded, by KHR_audio_emitter or else MSFT_audio_emitter, as `clamor bake`
// reads them: for objects that move, as those of a level are in its bake. Gives a ClamorThreeSource for each source.
export async function playThreeEmitters(clamor, {scene, parser}) {
  const {extensions = {}, nodes} = parser.json;
  const name = ["KHR_audio_emitter", "MSFT_audio_emitter"].find((each) => extensions[each]);
  if (!name) return [];
  const read = name === "KHR_audio_emitter" ? khrSources : msftSources;
  const sounds = new Map();
  const sound = (audio, loops) => {
    const key = JSON.stringify([audio, loops]);
    if (!sounds.has(key)) sounds.set(key, loadSound(clamor, parser, audio, loops));
    return sounds.get(key);
  };
  const made = [];
  scene.traverse((object) => {
    const use = nodes[parser.associations.get(object)?.nodes]?.extensions?.[name];
    for (const index of use?.emitters ?? (use?.emitter === undefined ? [] : [use.emitter]))
      for (const {audio, loop, gain, cone, facing} of read(extensions[name], index))
        made.push(sound(audio, loop).then(async (handle) => {
          const directivity = Array(8).fill(exponentOfCone(cone));
          const source = await clamor.addSource(handle, {gain, directivity, position_m: object.getWorldPosition(place).toArray()});
          return new ClamorThreeSource(source, object, facing);
        }));
  });
  return Promise.all(made);
}

function khrSources({audio, sources, emitters}, index) {
  const {gain = 1, sources: played = [], positional: {refDistance = 1, ...shape} = {}} = emitters[index];
  return played.map((each) => sources[each])
    .map((source) => ({
      audio: audio[source.audio], loop: source.loop ?? false, gain: gain * (source.gain ?? 1) * (refDistance || 1),
      cone: shape.shapeType === "omnidirectional" ? {} : {inner: shape.coneInnerAngle, outer: shape.coneOuterAngle, gain: shape.coneOuterGain},
      facing: new Vector3(0, 0, -1)}));
}

// Its angles are half angles.
function msftSources({clips, emitters}, index) {
  const {volume = 1, loop = false, refDistance = 1, innerAngle = Math.PI, outerAngle = Math.PI, clips: [first]} = emitters[index];
  return [{audio: clips[first.clip], loop, gain: volume * (refDistance || 1),
    cone: {inner: 2 * innerAngle, outer: 2 * outerAngle}, facing: new Vector3(0, 0, 1)}];
}

// The exponent of a directivity that radiates as much as a cone of these angles, whose gain falls in a straight line: closed
// forms inside and outside, and Simpson's rule between.
function exponentOfCone({inner = 2 * Math.PI, outer = 2 * Math.PI, gain = 0}) {
  const from = inner / 2, to = Math.max(outer, inner) / 2, step = (to - from) / kSteps;
  let power = (1 - Math.cos(from)) / 2 + gain ** 2 * (1 + Math.cos(to)) / 2;
  for (let i = 0; i <= kSteps; ++i) {
    const weight = i === 0 || i === kSteps ? 1 : i % 2 === 1 ? 4 : 2;
    power += weight * step / 3 * (1 + (gain - 1) * i / kSteps) ** 2 * Math.sin(from + i * step) / 2;
  }
  return Math.min(kMostDirectivity, Math.max(0, 1 / Math.max(power, 1e-9) - 1));
}

async function loadSound(clamor, parser, {uri, bufferView}, loops) {
  const bytes = uri === undefined ? (await parser.getDependency("bufferView", bufferView)).slice(0)
    : await (await fetch(LoaderUtils.resolveURL(uri, parser.options.path))).arrayBuffer();
  return clamor.addSound(await clamor.audio.decodeAudioData(bytes), {loops});
}
