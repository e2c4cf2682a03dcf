// level.mjs: writes the level that goes through the tools: a room of six panels with origins of their own,
// two shelves that share a mesh, a door that turns about its hinge, and two emitters. All materials look
// alike, as in a level that has no textures yet.
//
// `form` is how its author wrote it:
//   plain   KHR_audio_emitter with a sound in the file and one beside it; the door is the mesh that is marked
//   painted as plain, with a colour for each material
//   beside  as plain, but both sounds are files beside the level
//   sturdy  as the table in formats/README.md says: every material has acoustics in its extras, an emitter is
//           MOZ_hubs_components in extras.gltfExtensions, and the door's mark is on a node above its mesh
import {writeFileSync} from "node:fs";
import {join} from "node:path";

export const emitters = {Radio: [1.9, 1.2, 0.8], Fan: [-2, 2.4, -1.1]};
export const hinge = [0.6, 0, -1.95];  // of the door

// A mono WAV file: a short decaying tone.
function sound(frames, hz) {
  const file = Buffer.alloc(44 + 2 * frames);
  file.write("RIFF", 0);
  file.writeUInt32LE(36 + 2 * frames, 4);
  file.write("WAVEfmt ", 8);
  file.writeUInt32LE(16, 16);
  file.writeUInt16LE(1, 20);
  file.writeUInt16LE(1, 22);
  file.writeUInt32LE(48000, 24);
  file.writeUInt32LE(96000, 28);
  file.writeUInt16LE(2, 32);
  file.writeUInt16LE(16, 34);
  file.write("data", 36);
  file.writeUInt32LE(2 * frames, 40);
  for (let i = 0; i < frames; ++i)
    file.writeInt16LE(Math.round(16000 * Math.sin(2 * Math.PI * hz * i / 48000) * Math.exp(-4 * i / frames)), 44 + 2 * i);
  return file;
}

// A level that grows by its parts.
class Builder {
  json = {asset: {version: "2.0", generator: "pipelines"}, scene: 0, scenes: [{nodes: []}], nodes: [],
          meshes: [], accessors: [], bufferViews: [], materials: [], buffers: []};
  chunks = [];
  bytes = 0;

  view(bytes, more = {}) {
    this.json.bufferViews.push({buffer: 0, byteOffset: this.bytes, byteLength: bytes.length, ...more});
    const padding = (4 - bytes.length % 4) % 4;
    this.chunks.push(bytes, Buffer.alloc(padding));
    this.bytes += bytes.length + padding;
    return this.json.bufferViews.length - 1;
  }

  material(name, acoustic) {
    this.json.materials.push({name, ...(acoustic && {extras: {acoustic}})});
    return this.json.materials.length - 1;
  }

  // A mesh of rectangles; each is given by its centre and two halves of its edges, whose cross product
  // points to where it is seen from.
  mesh(name, material, rectangles) {
    const positions = [], normals = [], indices = [];
    for (const [centre, u, v] of rectangles) {
      const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      const length = Math.hypot(...normal), first = positions.length / 3;
      for (const [a, b] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
        positions.push(...centre.map((c, i) => c + a * u[i] + b * v[i]));
        normals.push(...normal.map((n) => n / length));
      }
      indices.push(...[0, 1, 2, 0, 2, 3].map((i) => first + i));
    }
    const points = positions.length / 3;
    const axis = (i) => positions.filter((_, j) => j % 3 === i);
    const accessor = (values, componentType, type, count, target, more) => {
      this.json.accessors.push({bufferView: this.view(Buffer.from(values.buffer), {target}), componentType, type, count, ...more});
      return this.json.accessors.length - 1;
    };
    const range = {min: [0, 1, 2].map((i) => Math.fround(Math.min(...axis(i)))), max: [0, 1, 2].map((i) => Math.fround(Math.max(...axis(i))))};
    this.json.meshes.push({name, primitives: [{
      attributes: {POSITION: accessor(Float32Array.from(positions), 5126, "VEC3", points, 34962, range),
                   NORMAL: accessor(Float32Array.from(normals), 5126, "VEC3", points, 34962)},
      indices: accessor(Uint16Array.from(indices), 5123, "SCALAR", indices.length, 34963), material}]});
    return this.json.meshes.length - 1;
  }

  node(node, parent) {
    this.json.nodes.push(node);
    const index = this.json.nodes.length - 1;
    if (parent === undefined) this.json.scenes[0].nodes.push(index);
    else (this.json.nodes[parent].children ??= []).push(index);
    return index;
  }

  glb() {
    this.json.buffers = [{byteLength: this.bytes}];
    const text = Buffer.from(JSON.stringify(this.json));
    const padded = Buffer.concat([text, Buffer.alloc((4 - text.length % 4) % 4, " ")]);
    const head = (length, type) => {
      const chunk = Buffer.alloc(8);
      chunk.writeUInt32LE(length, 0);
      chunk.writeUInt32LE(type, 4);
      return chunk;
    };
    const magic = Buffer.alloc(12);
    magic.write("glTF", 0);
    magic.writeUInt32LE(2, 4);
    magic.writeUInt32LE(12 + 8 + padded.length + 8 + this.bytes, 8);
    return Buffer.concat([magic, head(padded.length, 0x4E4F534A), padded, head(this.bytes, 0x004E4942), ...this.chunks]);
  }
}

// The materials scatter most of what they reflect, so that few photons know the decay well.
const rough = (absorption) => ({absorption, scattering: 0.9});
const half = [3, 1.5, 2];  // of the room, which stands on the ground around the origin

function room(form) {
  const level = new Builder();
  const plank = level.material("Shelf", rough([0.3, 0.28, 0.25, 0.22, 0.2, 0.2, 0.2, 0.2]));
  const panels = [
    ["Floor", [0, 0, 0], [3, 0, 0], [0, 0, -2], rough([0.1, 0.12, 0.16, 0.22, 0.3, 0.36, 0.4, 0.42])],
    ["Ceiling", [0, 3, 0], [3, 0, 0], [0, 0, 2], rough([0.4, 0.42, 0.44, 0.42, 0.4, 0.36, 0.34, 0.34])],
    ["Wall.Left", [-3, 1.5, 0], [0, 0, -2], [0, 1.5, 0], rough(0.14)],
    ["Wall.Right", [3, 1.5, 0], [0, 0, 2], [0, 1.5, 0], rough([0.34, 0.3, 0.2, 0.14, 0.1, 0.1, 0.1, 0.1])],
    ["Wall.Front", [0, 1.5, 2], [-3, 0, 0], [0, 1.5, 0], rough([0.08, 0.1, 0.12, 0.14, 0.18, 0.2, 0.2, 0.2])]];
  const house = level.node({name: "House"});
  for (const [name, centre, u, v, acoustic] of panels)
    level.node({name, translation: centre, mesh: level.mesh(name, level.material(name, acoustic), [[[0, 0, 0], u, v]])}, house);
  // The back wall's acoustics are those of its name.
  level.node({name: "Wall.Back", translation: [0, 1.5, -2], mesh: level.mesh("Wall.Back", level.material("Brick_Wall_03"), [[[0, 0, 0], [3, 0, 0], [0, 1.5, 0]]])}, house);
  const [x, y, z] = [0.6, 0.5, 0.15];
  const shelf = level.mesh("Shelf", plank, [[[x, 0, 0], [0, 0, -z], [0, y, 0]], [[-x, 0, 0], [0, 0, z], [0, y, 0]],
    [[0, y, 0], [x, 0, 0], [0, 0, -z]], [[0, -y, 0], [x, 0, 0], [0, 0, z]], [[0, 0, z], [x, 0, 0], [0, y, 0]], [[0, 0, -z], [-x, 0, 0], [0, y, 0]]]);
  const turned = [0, Math.sin(0.35), 0, Math.cos(0.35)];
  level.node({name: "Shelf.001", mesh: shelf, translation: [-1.2, 0.75, 0.9], rotation: turned}, house);
  level.node({name: "Shelf.002", mesh: shelf, translation: [1.3, 1.1, -0.9]}, house);
  const leaf = level.mesh("Leaf", level.material("Oak", form === "sturdy" && {preset: "wood"}),
    [[[0.45, 1, 0], [0.45, 0, 0], [0, 1, 0]], [[0.45, 1, -0.04], [-0.45, 0, 0], [0, 1, 0]]]);
  const door = {name: "Door", translation: hinge, extras: {clamor: {movable: true}}};
  if (form === "sturdy") level.node({name: "Leaf", mesh: leaf}, level.node(door, house));
  else level.node({...door, mesh: leaf}, house);
  if (form === "painted")
    for (const [i, material] of level.json.materials.entries()) material.pbrMetallicRoughness = {baseColorFactor: [i / 8, 1 - i / 8, 0.5, 1]};
  return level;
}

// The emitters as KHR_audio_emitter; `radio` is what the audio of the radio refers to.
function writeEmitters(level, cabinet, radio) {
  const node = (name, place, emitter, parent) => level.node({name, translation: place, extensions: {KHR_audio_emitter: {emitter}}}, parent);
  node("Radio", [0.5, 1.2, 0], 0, cabinet);
  node("Fan", emitters.Fan, 1);
  level.json.extensionsUsed = ["KHR_audio_emitter"];
  level.json.extensions = {KHR_audio_emitter: {
    audio: [radio, {uri: "fan.wav"}],
    sources: [0, 1].map((audio) => ({audio, loop: true, autoplay: true})),
    emitters: ["Radio", "Fan"].map((name, i) => ({type: "positional", sources: [i], name}))}};
}

// Writes level.glb, and the sounds that it refers to, into `folder`.
export function writeLevel(folder, form) {
  const level = room(form);
  const radio = sound(4800, 500);
  writeFileSync(join(folder, "radio.wav"), radio);
  writeFileSync(join(folder, "fan.wav"), sound(4800, 200));
  const cabinet = level.node({name: "Cabinet", translation: [1.4, 0, 0.8]});
  if (form === "plain" || form === "painted") writeEmitters(level, cabinet, {bufferView: level.view(radio), mimeType: "audio/wav"});
  if (form === "beside") writeEmitters(level, cabinet, {uri: "radio.wav"});
  if (form === "sturdy") {
    const node = (name, place, parent) => level.node({name, translation: place, extras: {gltfExtensions: {
      MOZ_hubs_components: {audio: {src: name.toLowerCase() + ".wav", loop: true, autoPlay: true}}}}}, parent);
    node("Radio", [0.5, 1.2, 0], cabinet);
    node("Fan", emitters.Fan);
  }
  writeFileSync(join(folder, "level.glb"), level.glb());
}

// Writes the surfaces as OBJ, whose positions are those of the world, and a sidecar that has what OBJ does
// not: acoustics, emitters and the movable part.
export function writeObj(folder) {
  const {json, chunks} = room("plain");
  const bytes = Buffer.concat(chunks), lines = ["mtllib level.mtl"], materials = {};
  const values = (accessor, type) => {
    const {bufferView, count} = json.accessors[accessor], {byteOffset, byteLength} = json.bufferViews[bufferView];
    return [...new type(bytes.buffer.slice(bytes.byteOffset + byteOffset, bytes.byteOffset + byteOffset + byteLength))];
  };
  let first = 1;
  for (const {name, mesh, translation = [0, 0, 0], rotation = [0, 0, 0, 1]} of json.nodes) {
    if (mesh === undefined) continue;
    const {attributes, indices, material} = json.meshes[mesh].primitives[0];
    const angle = 2 * Math.atan2(rotation[1], rotation[3]), [c, s] = [Math.cos(angle), Math.sin(angle)];
    const turned = ([x, y, z]) => [c * x + s * z, y, c * z - s * x];
    const triples = (list) => list.flatMap((_, i) => i % 3 ? [] : [list.slice(i, i + 3)]);
    const points = triples(values(attributes.POSITION, Float32Array)).map(turned);
    lines.push("o " + name, "usemtl " + json.materials[material].name);
    for (const point of points) lines.push("v " + point.map((x, i) => (x + translation[i]).toFixed(6)).join(" "));
    for (const normal of triples(values(attributes.NORMAL, Float32Array))) lines.push("vn " + turned(normal).join(" "));
    for (const corners of triples(values(indices, Uint16Array))) lines.push("f " + corners.map((i) => `${first + i}//${first + i}`).join(" "));
    first += points.length;
  }
  for (const {name, extras} of json.materials) if (extras) materials[name] = extras.acoustic;
  writeFileSync(join(folder, "level.obj"), lines.join("\n") + "\n");
  writeFileSync(join(folder, "level.mtl"), json.materials.map(({name}) => `newmtl ${name}\nKd 0.8 0.8 0.8\n`).join(""));
  return {materials, movable: ["Door"], emitters: Object.entries(emitters).map(([name, at]) => ({name, signal: name.toLowerCase() + ".wav", at}))};
}
