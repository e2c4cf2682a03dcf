#!/usr/bin/env bash
# gltf-pipeline 4.3.1: a sound inside a GLB is thrown away, and its index then names vertices.
#
# KHR_audio_emitter has a sound at a URI or, as images are kept, in a buffer view with a MIME type. gltf-pipeline removes
# the buffer views that none of the extensions that it knows uses, and counts the others anew where it knows of an index:
# at every conversion, be it only from .gltf to .glb, and with keepUnusedElements, too, which keeps materials, nodes and
# meshes. The extension stays in the file and keeps its number. The bytes of the sound are gone, and the number is beyond
# the list or, where the sound was not the last view, that of another one: below, of vertices as audio/mpeg.
#
# It concerns who packs or compresses levels that have their sounds in them. Keep sounds in files of their own, by URI,
# which the package leaves alone. Clamor tells of a sound whose view does not exist.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . gltf-pipeline@4.3.1

cat >run.mjs <<'EOF'
import pipeline from "gltf-pipeline";

// Two triangles as two meshes, and a radio's sound in a buffer view before, between or after them.
function level(place) {
  const triangle = Buffer.from(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]).buffer);
  const parts = [triangle, triangle];
  parts.splice(place, 0, Buffer.alloc(480, "sound"));
  const accessor = (bufferView) => ({bufferView, componentType: 5126, count: 3, type: "VEC3", min: [0, 0, 0], max: [1, 1, 0]});
  let end = 0;
  return {
    asset: {version: "2.0"}, extensionsUsed: ["KHR_audio_emitter"], scene: 0, scenes: [{nodes: [0, 1]}],
    nodes: [{name: "radio", mesh: 0, extensions: {KHR_audio_emitter: {emitter: 0}}}, {mesh: 1}],
    extensions: {KHR_audio_emitter: {
      audio: [{mimeType: "audio/mpeg", bufferView: place}],
      sources: [{audio: 0, loop: true, autoPlay: true}],
      emitters: [{type: "positional", sources: [0], positional: {}}],
    }},
    meshes: [0, 1].map((POSITION) => ({primitives: [{attributes: {POSITION}}]})),
    accessors: [0, 1, 2].filter((view) => view !== place).map(accessor),
    bufferViews: parts.map(({length}) => ({buffer: 0, byteOffset: (end += length) - length, byteLength: length})),
    buffers: [{byteLength: end, uri: "data:application/octet-stream;base64," + Buffer.concat(parts).toString("base64")}],
  };
}
// What the extension's view holds in a GLB, whose two chunks are JSON and bytes.
function sound(glb) {
  const json = glb.readUInt32LE(12), gltf = JSON.parse(glb.subarray(20, 20 + json).toString());
  const {bufferView} = gltf.extensions.KHR_audio_emitter.audio[0], view = gltf.bufferViews[bufferView];
  if (!view) return `view ${bufferView} of ${gltf.bufferViews.length}, which does not exist`;
  const from = 28 + json + (view.byteOffset ?? 0), bytes = glb.subarray(from, from + view.byteLength);
  return `view ${bufferView} of ${gltf.bufferViews.length}, ${bytes.toString().startsWith("sound") ? "the sound" : "vertices"}, ${bytes.length} bytes`;
}
for (const place of [0, 1, 2])
  for (const keepUnusedElements of [false, true])
    console.log(`sound in view ${place} of 3, gltfToGlb${keepUnusedElements ? " with keepUnusedElements" : ""}: ${sound((await pipeline.gltfToGlb(level(place), {keepUnusedElements})).glb)}`);
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
sound in view 0 of 3, gltfToGlb: view 0 of 2, vertices, 36 bytes
sound in view 0 of 3, gltfToGlb with keepUnusedElements: view 0 of 2, vertices, 36 bytes
sound in view 1 of 3, gltfToGlb: view 1 of 2, vertices, 36 bytes
sound in view 1 of 3, gltfToGlb with keepUnusedElements: view 1 of 2, vertices, 36 bytes
sound in view 2 of 3, gltfToGlb: view 2 of 2, which does not exist
sound in view 2 of 3, gltfToGlb with keepUnusedElements: view 2 of 2, which does not exist
EOF
cmp -s seen expected || { echo "What becomes of sounds in gltf-pipeline has changed."; exit 1; }
