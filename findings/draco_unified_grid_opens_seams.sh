#!/usr/bin/env bash
# gltf-pipeline 4.3.1's --draco.unifiedQuantization widens the seams that it is there to close.
#
# Draco rounds the positions of each primitive to a grid over its own box, so that the edges of two panels
# part a little. The option takes one grid for all primitives, over the box of them all, which is to avoid
# such gaps. But positions are those before the transform of their node: where panels have origins of their
# own, as editors make them, two grids still differ by an arbitrary share of a step, and the steps of small
# panels have become as large as those of the largest. The corners of this room part by 2.7 instead of 1.3 mm;
# they did by more with the option in six of seven rooms that were tried.
#
# Raise --draco.quantizePositionBits from its default of 11 to 14 instead. Clamor welds what Draco's step
# explains, up to 5 mm.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . gltf-pipeline@4.3.1 @gltf-transform/core@4.5.1 \
  @gltf-transform/extensions@4.5.1 draco3dgltf@1.5.7

cat >run.mjs <<'EOF'
import {execFileSync} from "node:child_process";
import {writeFileSync} from "node:fs";
import {NodeIO} from "@gltf-transform/core";
import {KHRDracoMeshCompression} from "@gltf-transform/extensions";
import draco3d from "draco3dgltf";

// A room of 6.1 by 3.3 by 4.7 m: each panel has its origin in its middle.
const half = [3.05, 1.65, 2.35];
const panels = [0, 1, 2].flatMap((axis) => [-1, 1].map((side) => {
  const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
  const translation = [0, 0, 0];
  translation[axis] = side * half[axis];
  const corners = [[-1, -1], [side, -side], [1, 1], [-side, side]].flatMap(([a, b]) => {
    const corner = [0, 0, 0];
    corner[u] = a * half[u];
    corner[v] = b * half[v];
    return corner;
  });
  return {translation, corners};
}));
const bytes = Buffer.concat([...panels.map(({corners}) => Buffer.from(Float32Array.from(corners).buffer)), Buffer.from(Uint16Array.of(0, 1, 2, 0, 2, 3).buffer)]);
writeFileSync("room.gltf", JSON.stringify({
  asset: {version: "2.0"}, scene: 0, scenes: [{nodes: panels.map((_, i) => i)}],
  nodes: panels.map(({translation}, i) => ({translation, mesh: i})),
  meshes: panels.map((_, i) => ({primitives: [{attributes: {POSITION: i}, indices: panels.length}]})),
  accessors: [...panels.map(({corners}, i) => ({bufferView: i, componentType: 5126, count: 4, type: "VEC3",
    min: [0, 1, 2].map((axis) => Math.fround(Math.min(...corners.filter((_, c) => c % 3 === axis)))),
    max: [0, 1, 2].map((axis) => Math.fround(Math.max(...corners.filter((_, c) => c % 3 === axis))))})),
  {bufferView: panels.length, componentType: 5123, count: 6, type: "SCALAR"}],
  bufferViews: [...panels.map((_, i) => ({buffer: 0, byteOffset: 48 * i, byteLength: 48})), {buffer: 0, byteOffset: 48 * panels.length, byteLength: 12}],
  buffers: [{byteLength: bytes.length, uri: "data:application/octet-stream;base64," + bytes.toString("base64")}]}));

const io = new NodeIO().registerExtensions([KHRDracoMeshCompression]).registerDependencies({"draco3d.decoder": await draco3d.createDecoderModule()});
// How far the corners of three panels are apart that were one point, in millimetres.
async function widest_mm(...options) {
  execFileSync("node_modules/.bin/gltf-pipeline", ["-i", "room.gltf", "-o", "out.glb", "-d", ...options], {stdio: "pipe"});
  const corners = (await io.read("out.glb")).getRoot().listNodes().flatMap((node) => {
    const positions = node.getMesh().listPrimitives()[0].getAttribute("POSITION"), origin = node.getTranslation();
    return Array.from({length: positions.getCount()}, (_, i) => positions.getElement(i, []).map((x, axis) => x + origin[axis]));
  });
  const apart = corners.flatMap((a) => corners.map((b) => Math.hypot(...a.map((x, axis) => x - b[axis])))).filter((gap) => gap < 0.1);
  return (1000 * Math.max(...apart)).toFixed(1);
}
console.log(`a grid for each panel: ${await widest_mm()} mm`);
console.log(`--draco.unifiedQuantization: ${await widest_mm("--draco.unifiedQuantization")} mm`);
console.log(`a grid for each panel, 14 bits: ${await widest_mm("--draco.quantizePositionBits", "14")} mm`);
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
a grid for each panel: 1.3 mm
--draco.unifiedQuantization: 2.7 mm
a grid for each panel, 14 bits: 0.0 mm
EOF
cmp -s seen expected || { echo "How far Draco's grids part the corners of panels has changed."; exit 1; }
