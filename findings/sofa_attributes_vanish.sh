#!/usr/bin/env bash
# jsfive 0.4.2 finds no attributes at all in an HDF5 object that has nine of them.
#
# The HDF5 library stores up to eight attributes in the header of their object and, from the ninth on, all of
# them in a heap with an index ("dense storage"). jsfive reads the header only, and does not say that there
# are more: `attrs` is an empty object, while the data sets of the same file are right to the last bit. A SOFA
# file has more than eight global attributes, so Conventions, SOFAConventions, DataType and RoomType of every
# head are undefined in a browser that reads it with jsfive, among them the MIT KEMAR of libmysofa.
#
# Do not decide by the global attributes there, but by the variables (Data.IR, ReceiverPosition, and so on),
# or read the file with h5wasm 0.10.3, which is the HDF5 library itself.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . h5wasm@0.10.3 jsfive@0.4.2

cat >run.mjs <<'EOF'
import {readFileSync} from "node:fs";
import h5wasm from "h5wasm/node";
import * as jsfive from "jsfive";

await h5wasm.ready;
const names = ["Conventions", "Version", "SOFAConventions", "SOFAConventionsVersion", "DataType", "RoomType", "Title", "DateCreated", "License"];
for (const count of [8, 9]) {
  const written = new h5wasm.File("head.sofa", "w");
  for (const name of names.slice(0, count)) written.create_attribute(name, "text");
  written.create_dataset({name: "Data.SamplingRate", data: new Float64Array([48000])});
  written.close();
  const whole = new h5wasm.File("head.sofa", "r");
  const bytes = new Uint8Array(readFileSync("head.sofa")).buffer;
  const read = new jsfive.File(bytes, "head.sofa");
  console.log(`${Object.keys(whole.attrs).length} attributes by h5wasm: ${Object.keys(read.attrs).length} by jsfive, Data.SamplingRate ${read.get("Data.SamplingRate").value[0]}`);
  whole.close();
}
process.exit(0);
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
8 attributes by h5wasm: 8 by jsfive, Data.SamplingRate 48000
9 attributes by h5wasm: 0 by jsfive, Data.SamplingRate 48000
EOF
cmp -s seen expected || { echo "What jsfive reads of nine attributes has changed."; exit 1; }
