#!/usr/bin/env bash
# three.js r187 writes an invalid glTF file when it saves instances that have an attribute of their own.
#
# EXT_mesh_gpu_instancing lets an instance have more than a place: attributes whose names begin with "_" (in
# Clamor's crowds _DELAY_S, when each fan begins to sing). GLTFLoader reads such an attribute into the
# geometry of an InstancedMesh, next to the positions of vertices. GLTFExporter then writes it as one of the
# mesh's vertices: the extension has lost it, and the primitive has an attribute with as many elements as
# there are instances, not vertices, which glTF 2.0 forbids; the Khronos validator calls it an error. A level
# that has as many instances as its mesh has vertices stays valid, and is wrong all the same.
#
# Move such attributes from the geometry back to the extension after an export.
# glTF-Transform 4.5.1 (copy) and gltf-pipeline 4.3.1 keep them where they are.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . three@0.187.0 gltf-validator@2.0.0-dev.3.10

cat >run.mjs <<'EOF'
import validator from "gltf-validator";
import {GLTFExporter} from "three/addons/exporters/GLTFExporter.js";
import {GLTFLoader} from "three/addons/loaders/GLTFLoader.js";

// Node lacks these parts of a browser, which three.js uses.
globalThis.self = globalThis;
globalThis.ProgressEvent = class extends Event {};
globalThis.FileReader = class {
  readAsDataURL(blob) {
    blob.arrayBuffer().then((bytes) => {
      this.result = "data:application/octet-stream;base64," + Buffer.from(bytes).toString("base64");
      this.onloadend();
    });
  }
};

const vertices = [0, 0, 0, 1, 0, 0, 0, 1, 0], places = [1, 0, 0, 2, 0, 0, 3, 0, 0, 4, 0, 0, 5, 0, 0], delays = [0, 0.25, 0.5, 0.75, 1];
const bytes = Buffer.from(Float32Array.from([...vertices, ...places, ...delays]).buffer);
const level = {
  asset: {version: "2.0"}, scene: 0, scenes: [{nodes: [0]}],
  extensionsUsed: ["EXT_mesh_gpu_instancing"], extensionsRequired: ["EXT_mesh_gpu_instancing"],
  nodes: [{name: "Crowd", mesh: 0, extensions: {EXT_mesh_gpu_instancing: {attributes: {TRANSLATION: 1, _DELAY_S: 2}}}}],
  meshes: [{primitives: [{attributes: {POSITION: 0}}]}],
  accessors: [
    {bufferView: 0, componentType: 5126, count: 3, type: "VEC3", min: [0, 0, 0], max: [1, 1, 0]},
    {bufferView: 1, componentType: 5126, count: 5, type: "VEC3"},
    {bufferView: 2, componentType: 5126, count: 5, type: "SCALAR"}],
  bufferViews: [{buffer: 0, byteLength: 36}, {buffer: 0, byteOffset: 36, byteLength: 60}, {buffer: 0, byteOffset: 96, byteLength: 20}],
  buffers: [{byteLength: bytes.length, uri: "data:application/octet-stream;base64," + bytes.toString("base64")}]};

async function said(title, json) {
  const report = await validator.validateString(JSON.stringify(json));
  const node = json.nodes.find(({extensions}) => extensions?.EXT_mesh_gpu_instancing);
  const own = Object.keys(node.extensions.EXT_mesh_gpu_instancing.attributes).includes("_DELAY_S");
  console.log(`${title}: instances ${own ? "have" : "lack"} _DELAY_S, attributes of vertices: ${Object.keys(json.meshes[0].primitives[0].attributes).join(", ")}`);
  for (const {severity, code} of report.issues.messages) if (severity === 0) console.log(`${title}: the validator's error is ${code}`);
}
await said("before", level);
const {scene} = await new GLTFLoader().parseAsync(JSON.stringify(level), "");
await said("after", await new GLTFExporter().parseAsync(scene));
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
before: instances have _DELAY_S, attributes of vertices: POSITION
after: instances lack _DELAY_S, attributes of vertices: POSITION, _DELAY_S
after: the validator's error is MESH_PRIMITIVE_UNEQUAL_ACCESSOR_COUNT
EOF
cmp -s seen expected || { echo "What three.js does with attributes of instances has changed."; exit 1; }
