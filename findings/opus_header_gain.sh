#!/usr/bin/env bash
# ogg-opus-decoder 1.7.5 plays an Opus file as if its header had no output gain.
#
# RFC 7845, section 5.1, says that a decoder must scale its output by the gain in the header OpusHead, by
# which loudness is normalised without encoding again. This package skips the field: it plays a file whose
# header says -12 dB 12 dB louder than opusdec 0.2, libsndfile 1.2.0 and audio-decode 3.12.0 play it, with no
# word about it.
#
# This concerns whoever auditions levels in a browser: sounds have other levels there than in Clamor's bakes,
# which follow the header. Scale the samples by the field (signed, in 1/256 dB, at byte 16 of OpusHead), or
# encode again with the gain applied.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . ogg-opus-decoder@1.7.5 audio-decode@3.12.0 opusscript@0.1.1

cat >run.mjs <<'EOF'
import OpusScript from "opusscript";
import decode from "audio-decode";
import {OggOpusDecoder} from "ogg-opus-decoder";

function crc(page) {
  let sum = 0;
  for (const byte of page) {
    sum = (sum ^ byte << 24) >>> 0;
    for (let bit = 0; bit < 8; ++bit) sum = ((sum & 0x80000000 ? 0x04c11db7 : 0) ^ sum << 1) >>> 0;
  }
  return sum;
}

// One page of an Ogg stream, which holds whole packets.
function page(number, kind, granule, packets) {
  const head = Buffer.alloc(27);
  head.write("OggS");
  head[5] = kind;
  head.writeBigInt64LE(BigInt(granule), 6);
  head.writeUInt32LE(1, 14);
  head.writeUInt32LE(number, 18);
  const lacing = packets.flatMap(({length}) => [...Array(Math.floor(length / 255)).fill(255), length % 255]);
  head[26] = lacing.length;
  const whole = Buffer.concat([head, Buffer.from(lacing), ...packets]);
  whole.writeUInt32LE(crc(whole), 22);
  return whole;
}

const encoder = new OpusScript(48000, 1, OpusScript.Application.AUDIO);
encoder.setBitrate(64000);
const packets = Array.from({length: 50}, (_, block) => {
  const pcm = Buffer.alloc(1920);  // 20 ms
  for (let i = 0; i < 960; ++i) pcm.writeInt16LE(Math.round(16000 * Math.sin(2 * Math.PI * 440 * (960 * block + i) / 48000)), 2 * i);
  return Buffer.from(encoder.encode(pcm, 960));
});

function opusFile(gainDb) {
  const head = Buffer.alloc(19);
  head.write("OpusHead");
  head.set([1, 1], 8);  // version, channels
  head.writeUInt16LE(312, 10);
  head.writeUInt32LE(48000, 12);
  head.writeInt16LE(256 * gainDb, 16);
  const tags = Buffer.concat([Buffer.from("OpusTags"), Buffer.from([4, 0, 0, 0]), Buffer.from("none"), Buffer.alloc(4)]);
  return Buffer.concat([page(0, 2, 0, [head]), page(1, 0, 0, [tags]), page(2, 4, 48000, packets)]);
}

const peak = (samples) => samples.subarray(4800, 43200).reduce((most, x) => Math.max(most, Math.abs(x)), 0);
const decibels = (loud, quiet) => Math.round(20 * Math.log10(peak(quiet) / peak(loud)));
async function withPackage(file) {
  const decoder = new OggOpusDecoder();
  await decoder.ready;
  const {channelData} = await decoder.decodeFile(file);
  decoder.free();
  return channelData[0];
}
const other = async (file) => (await decode(file)).channelData[0];
console.log(`audio-decode: ${decibels(await other(opusFile(0)), await other(opusFile(-12)))} dB`);
console.log(`ogg-opus-decoder: ${decibels(await withPackage(opusFile(0)), await withPackage(opusFile(-12)))} dB`);
process.exit(0);
EOF

node run.mjs | sed 's/-0 dB/0 dB/' | tee seen
cat >expected <<'EOF'
audio-decode: -12 dB
ogg-opus-decoder: 0 dB
EOF
cmp -s seen expected || { echo "What a header gain of -12 dB does has changed."; exit 1; }
