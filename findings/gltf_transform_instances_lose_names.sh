#!/usr/bin/env bash
# gltf-transform 4.5.1's optimize drops names and extras of nodes that share a mesh, from the fifth on.
#
# One step of `optimize` makes instances (EXT_mesh_gpu_instancing) of five or more nodes that have the same
# mesh. The node that holds them has no name, and extras of none of the five, though they differ. This also
# happens where all that is known to lose nodes is off (--flatten, --join, --prune and --palette false), and
# to nodes whose meshes were five of different names before: the step dedup makes one of equal meshes first.
# Nothing is printed but a tick. Four such nodes keep everything, so a trial with a small level shows no loss.
#
# Five doors of a corridor, each marked as movable in its extras, become one solid with five places; five
# loudspeakers lose their emitters. Give --instance false, or --instance-min a number above all that repeat.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . @gltf-transform/cli@4.5.1

cat >run.mjs <<'EOF'
import {execFileSync} from "node:child_process";
import {readFileSync, writeFileSync} from "node:fs";

const bytes = Buffer.from(Float32Array.from([0, 0, 0, 1, 0, 0, 0, 2, 0]).buffer);
function corridor(doors) {
  const each = Array.from({length: doors}, (_, i) => i);
  return {
    asset: {version: "2.0"}, scene: 0, scenes: [{nodes: each}],
    nodes: each.map((i) => ({name: `Door.${i}`, mesh: i, translation: [3 * i, 0, 0], extras: {room: 100 + i}})),
    meshes: each.map((i) => ({name: `Leaf.${i}`, primitives: [{attributes: {POSITION: 0}}]})),
    accessors: [{bufferView: 0, componentType: 5126, count: 3, type: "VEC3", min: [0, 0, 0], max: [1, 2, 0]}],
    bufferViews: [{buffer: 0, byteLength: 36}],
    buffers: [{byteLength: 36, uri: "data:application/octet-stream;base64," + bytes.toString("base64")}]};
}

function optimized(doors, ...more) {
  writeFileSync("corridor.gltf", JSON.stringify(corridor(doors)));
  const off = ["--flatten", "--join", "--prune", "--palette", "--compress"].flatMap((step) => [step, "false"]);
  execFileSync("node_modules/.bin/gltf-transform", ["optimize", "corridor.gltf", "out.gltf", ...off, ...more], {stdio: "pipe"});
  const {nodes} = JSON.parse(readFileSync("out.gltf"));
  return `${nodes.length} nodes, ${nodes.filter(({name}) => name).length} with a name, ${nodes.filter(({extras}) => extras).length} with extras`;
}
console.log(`4 doors: ${optimized(4)}`);
console.log(`5 doors: ${optimized(5)}`);
console.log(`5 doors, --instance false: ${optimized(5, "--instance", "false")}`);
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
4 doors: 4 nodes, 4 with a name, 4 with extras
5 doors: 1 nodes, 0 with a name, 0 with extras
5 doors, --instance false: 5 nodes, 5 with a name, 5 with extras
EOF
cmp -s seen expected || { echo "What optimize keeps of nodes that share a mesh has changed."; exit 1; }
