#!/usr/bin/env bash
# assimpjs 0.0.10: a list in a node's glTF extras becomes an object that holds only the list's last value.
#
# assimpjs is assimp for Node, of 5.2's series. It carries the extras of nodes from glTF to glTF: numbers, truths,
# texts and objects in objects come through exactly, so that a trial with a few properties shows no loss. But
# "absorption": [0.1, 0.2, 0.3] becomes "absorption": {"absorption": 0.3}, at any depth, and [] becomes {}. The
# file is valid and nothing is printed. Extras of materials are lost as a whole, whatever they hold.
#
# It concerns who keeps a list in extras: the values of bands of frequencies, a colour, a range. Name each value by
# itself ("absorption_125": 0.1), or use a tool that copies JSON as it is, as gltf-transform does.
# Clamor reads its materials also from a sidecar file, which no converter touches.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . assimpjs@0.0.10

cat >run.mjs <<'EOF'
import assimpjs from "assimpjs";

const assimp = await assimpjs();
const bytes = Buffer.from(Float32Array.from([0, 0, 0, 1, 0, 0, 0, 2, 0]).buffer);
function converted(extras) {
  const list = new assimp.FileList();
  list.AddFile("room.gltf", new TextEncoder().encode(JSON.stringify({
    asset: {version: "2.0"}, scene: 0, scenes: [{nodes: [0, 1]}],
    nodes: [{name: "Door", mesh: 0, extras}, {name: "Wall", mesh: 0}],
    materials: [{name: "Wood", extras}],
    meshes: [{name: "Leaf", primitives: [{attributes: {POSITION: 0}, material: 0}]}],
    accessors: [{bufferView: 0, componentType: 5126, count: 3, type: "VEC3", min: [0, 0, 0], max: [1, 2, 0]}],
    bufferViews: [{buffer: 0, byteLength: 36}],
    buffers: [{byteLength: 36, uri: "data:application/octet-stream;base64," + bytes.toString("base64")}]})));
  const result = assimp.ConvertFileList(list, "gltf2");
  const file = Array.from({length: result.FileCount()}, (_, i) => result.GetFile(i)).find((each) => each.GetPath().endsWith(".gltf"));
  const {nodes, materials} = JSON.parse(new TextDecoder().decode(file.GetContent()));
  const kept = (object) => object.extras === undefined ? "nothing" : JSON.stringify(object.extras);
  console.log(`${JSON.stringify(extras)}: the node has ${kept(nodes.find(({name}) => name === "Door"))}, the material ${kept(materials.find(({name}) => name === "Wood"))}`);
}
converted({clamor: {movable: true}, width: 0.5, note: "oak"});
converted({absorption: [0.1, 0.2, 0.3]});
converted({clamor: {absorption: [0.1, 0.2, 0.3]}});
converted({absorption: []});
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
{"clamor":{"movable":true},"width":0.5,"note":"oak"}: the node has {"clamor":{"movable":true},"width":0.5,"note":"oak"}, the material nothing
{"absorption":[0.1,0.2,0.3]}: the node has {"absorption":{"absorption":0.3}}, the material nothing
{"clamor":{"absorption":[0.1,0.2,0.3]}}: the node has {"clamor":{"absorption":{"absorption":0.3}}}, the material nothing
{"absorption":[]}: the node has {"absorption":{}}, the material nothing
EOF
cmp -s seen expected || { echo "What assimpjs keeps of extras has changed."; exit 1; }
