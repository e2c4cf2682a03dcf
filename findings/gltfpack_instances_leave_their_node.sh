#!/usr/bin/env bash
# gltfpack 1.3.0 takes instances off their node, although -kn is to keep named nodes and what is attached to
# them.
#
# A node with EXT_mesh_gpu_instancing comes out as two: one without a name, which has the mesh and its
# instances in coordinates of the scene, and one with the name and the extras (-ke), which has nothing. Code
# that finds the node by its name to move, hide or play it gets a node that exists and does nothing.
# Attributes of instances other than their placement are dropped. By its help, -kn keeps meshes on named nodes
# so that these can be moved from outside, and for meshes without instances it does.
#
# A crowd that sings (a node with instances and an emitter) becomes one singer at the node's own origin. Pack
# without instances (a node for each), or pack the rest of the level and add the crowd afterwards.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . gltfpack@1.3.0

cat >run.mjs <<'EOF'
import {execFileSync} from "node:child_process";
import {readFileSync, writeFileSync} from "node:fs";

const vertices = [0, 0, 0, 1, 0, 0, 0, 1, 0], places = [1, 0, 0, 2, 0, 0, 3, 0, 0, 4, 0, 0, 5, 0, 0], delays = [0, 0.25, 0.5, 0.75, 1];
const bytes = Buffer.from(Float32Array.from([...vertices, ...places, ...delays]).buffer);
const instancing = {EXT_mesh_gpu_instancing: {attributes: {TRANSLATION: 1, _DELAY_S: 2}}};
function level(extensions) {
  return {
    asset: {version: "2.0"}, scene: 0, scenes: [{nodes: [0]}],
    ...(extensions && {extensionsUsed: ["EXT_mesh_gpu_instancing"]}),
    nodes: [{name: "Crowd", mesh: 0, translation: [0, 7, 0], extras: {song: "anthem"}, ...(extensions && {extensions})}],
    meshes: [{primitives: [{attributes: {POSITION: 0}}]}],
    accessors: [
      {bufferView: 0, componentType: 5126, count: 3, type: "VEC3", min: [0, 0, 0], max: [1, 1, 0]},
      {bufferView: 1, componentType: 5126, count: 5, type: "VEC3"},
      {bufferView: 2, componentType: 5126, count: 5, type: "SCALAR"}],
    bufferViews: [{buffer: 0, byteLength: 36}, {buffer: 0, byteOffset: 36, byteLength: 60}, {buffer: 0, byteOffset: 96, byteLength: 20}],
    buffers: [{byteLength: bytes.length, uri: "data:application/octet-stream;base64," + bytes.toString("base64")}]};
}

for (const [title, extensions] of [["one place", undefined], ["five instances", instancing]]) {
  writeFileSync("level.gltf", JSON.stringify(level(extensions)));
  execFileSync("node_modules/.bin/gltfpack", ["-i", "level.gltf", "-o", "packed.gltf", "-noq", "-kn", "-ke"]);
  const {nodes} = JSON.parse(readFileSync("packed.gltf"));
  const named = nodes.findIndex(({name}) => name === "Crowd");
  const hasMesh = (index) => nodes[index].mesh !== undefined || (nodes[index].children ?? []).some(hasMesh);
  const instances = nodes.find(({extensions: own}) => own)?.extensions.EXT_mesh_gpu_instancing.attributes ?? {};
  console.log(`${title}: Crowd has ${hasMesh(named) ? "its" : "no"} mesh, and its extras ${JSON.stringify(nodes[named].extras)}; instances have ${Object.keys(instances).join(", ") || "nothing"}`);
}
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
one place: Crowd has its mesh, and its extras {"song":"anthem"}; instances have nothing
five instances: Crowd has no mesh, and its extras {"song":"anthem"}; instances have TRANSLATION, ROTATION, SCALE
EOF
cmp -s seen expected || { echo "What gltfpack does with a named node that has instances has changed."; exit 1; }
