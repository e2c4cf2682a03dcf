#!/usr/bin/env bash
# audio-decode 3.12.0 finds no sound in a WAV file that has a chunk of odd size before its data.
#
# RIFF pads chunks to even sizes with a byte that the size does not count, and any chunk may come first:
# broadcast recorders write "bext" and editors "LIST" or "JUNK" there, often with text of odd length. The
# package then finds no sound. It does not throw: it resolves to a sound without channels, which a caller that
# adds channels up takes for silence. With a byte less in the chunk, it reads the same sound.
#
# Check that channelData has an entry. node-web-audio-api 1.0.9, libsndfile 1.2.0 and with it Clamor read the
# file.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . audio-decode@3.12.0 node-web-audio-api@1.0.9

cat >run.mjs <<'EOF'
import decode from "audio-decode";
import {OfflineAudioContext} from "node-web-audio-api";

function chunk(name, bytes) {
  const head = Buffer.alloc(8);
  head.write(name);
  head.writeUInt32LE(bytes.length, 4);
  return Buffer.concat([head, bytes, Buffer.alloc(bytes.length % 2)]);
}

function wavFile(text) {
  const format = Buffer.alloc(16), data = Buffer.alloc(9600);
  format.writeUInt16LE(1, 0);
  format.writeUInt16LE(1, 2);
  format.writeUInt32LE(48000, 4);
  format.writeUInt32LE(96000, 8);
  format.writeUInt16LE(2, 12);
  format.writeUInt16LE(16, 14);
  for (let i = 0; i < 4800; ++i) data.writeInt16LE(Math.round(16384 * Math.sin(2 * Math.PI * 440 * i / 48000)), 2 * i);
  return chunk("RIFF", Buffer.concat([Buffer.from("WAVE"), chunk("JUNK", Buffer.from(text)), chunk("fmt ", format), chunk("data", data)]));
}

for (const text of ["a studio", "a theatre"]) {
  const file = wavFile(text);
  const {channelData} = await decode(file);
  const context = new OfflineAudioContext(1, 48000, 48000);
  const other = await context.decodeAudioData(new Uint8Array(file).buffer);
  console.log(`a chunk of ${text.length} bytes: audio-decode ${channelData.length} channels, node-web-audio-api ${other.numberOfChannels} of ${other.length} frames`);
}
process.exit(0);
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
a chunk of 8 bytes: audio-decode 1 channels, node-web-audio-api 1 of 4800 frames
a chunk of 9 bytes: audio-decode 0 channels, node-web-audio-api 1 of 4800 frames
EOF
cmp -s seen expected || { echo "What is read of a WAV file with a chunk of odd size has changed."; exit 1; }
