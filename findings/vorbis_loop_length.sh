#!/usr/bin/env bash
# node-web-audio-api 1.0.9 decodes more frames of an Ogg Vorbis file than the file has.
#
# Vorbis codes blocks, and the granule position of the last page says how many frames of the last block count.
# decodeAudioData() of this package (Web Audio in Rust, on symphonia) returns the whole last block: of 48000
# frames it makes 48704, and after the loop's own end come up to 15 ms that the author never recorded, most of
# them a decaying remnant. Each round of a loop is late by that much, and a loop clicks.
# @wasm-audio-decoders/ogg-vorbis 0.1.20, libvorbisfile and libsndfile return 48000.
#
# Who renders the Web Audio graph of a game on a server, or compares a bake with it, should cut the buffer to
# the granule position (bytes 6 to 13 of the last page), or decode with another package.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . node-web-audio-api@1.0.9 \
  @wasm-audio-decoders/ogg-vorbis@0.1.20 wasm-media-encoders@0.7.0

cat >run.mjs <<'EOF'
import {OggVorbisDecoder} from "@wasm-audio-decoders/ogg-vorbis";
import {OfflineAudioContext} from "node-web-audio-api";
import {createOggEncoder} from "wasm-media-encoders";

const encoder = await createOggEncoder();
encoder.configure({sampleRate: 48000, channels: 1, vbrQuality: 5});
const tone = Float32Array.from({length: 48000}, (_, i) => 0.4 * Math.sin(2 * Math.PI * 200 * i / 48000));
const parts = [];
for (let at = 0; at < tone.length; at += 4800) parts.push(Buffer.from(encoder.encode([tone.subarray(at, at + 4800)])));
parts.push(Buffer.from(encoder.finalize()));
const file = Buffer.concat(parts);
console.log(`the last granule position: ${file.readBigInt64LE(file.lastIndexOf("OggS") + 6)}`);

const decoder = new OggVorbisDecoder();
await decoder.ready;
console.log(`@wasm-audio-decoders/ogg-vorbis: ${(await decoder.decodeFile(file)).samplesDecoded}`);
const context = new OfflineAudioContext(1, 48000, 48000);
const buffer = await context.decodeAudioData(new Uint8Array(file).buffer);
console.log(`node-web-audio-api: ${buffer.length}`);
process.exit(0);
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
the last granule position: 48000
@wasm-audio-decoders/ogg-vorbis: 48000
node-web-audio-api: 48704
EOF
cmp -s seen expected || { echo "The number of frames that are decoded has changed."; exit 1; }
