#!/usr/bin/env bash
# @wasm-audio-decoders/flac 0.2.11 decodes FLAC of 20 bits to infinity, and reports no error.
#
# 20 bits are a depth of FLAC like 16 and 24: the encoder flac 1.4.2 writes them for a WAV file whose header
# says that 20 of 24 bits are valid. The package finds all frames, the rate and the depth, returns an empty
# list of errors, and the samples are Infinity or NaN; audio-decode 3.12.0, which uses it, hands them on. A
# recursive filter that has met one such sample never recovers. libsndfile 1.2.0 of Debian 12 refuses the file
# instead, as it refuses FLAC of 32 bits; node-web-audio-api 1.0.9 reads it.
#
# Check decoded samples for finite values, and write FLAC of 16 or 24 bits. Clamor says how many bits such a
# file has, and that `flac -d` makes a WAV file of it, which libsndfile reads.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . @wasm-audio-decoders/flac@0.2.11 audio-decode@3.12.0 \
  node-web-audio-api@1.0.9

cat >run.mjs <<'EOF'
import {FLACDecoder} from "@wasm-audio-decoders/flac";
import decode from "audio-decode";
import {OfflineAudioContext} from "node-web-audio-api";

// Bits, the most significant first.
class Bits {
  list = [];
  put(value, count) {
    for (let bit = count - 1; bit >= 0; --bit) this.list.push(Math.floor(value / 2 ** bit) % 2);
    return this;
  }
  bytes() {
    while (this.list.length % 8) this.list.push(0);
    return Buffer.from(Array.from({length: this.list.length / 8}, (_, i) => parseInt(this.list.slice(8 * i, 8 * i + 8).join(""), 2)));
  }
}
function crc(bytes, width, polynomial) {
  let sum = 0;
  for (const byte of bytes) {
    sum ^= byte << width - 8;
    for (let bit = 0; bit < 8; ++bit) sum = (sum >> width - 1 & 1 ? sum << 1 ^ polynomial : sum << 1) & 2 ** width - 1;
  }
  return sum;
}

// FLAC whose frames hold samples as they are (RFC 9639: verbatim subframes), of one channel at 48 kHz.
const size = 4096, frames = 4;
function flacFile(bits, code) {
  const info = new Bits().put(size, 16).put(size, 16).put(0, 48).put(48000, 20).put(0, 3).put(bits - 1, 5).put(size * frames, 36).bytes();
  const parts = [Buffer.from("fLaC"), Buffer.from([0x80, 0, 0, 34]), info, Buffer.alloc(16)];
  for (let frame = 0; frame < frames; ++frame) {
    const head = new Bits().put(0x3ffe, 14).put(0, 2).put(12, 4).put(10, 4).put(0, 4).put(code, 3).put(0, 1).put(frame, 8).bytes();
    const body = new Bits().put(2, 8);  // a verbatim subframe
    for (let i = 0; i < size; ++i) {
      const sample = Math.round(0.5 * 2 ** (bits - 1) * Math.sin(2 * Math.PI * 440 * (size * frame + i) / 48000));
      body.put(sample < 0 ? sample + 2 ** bits : sample, bits);
    }
    const whole = Buffer.concat([head, Buffer.from([crc(head, 8, 7)]), body.bytes()]);
    const check = crc(whole, 16, 0x8005);
    parts.push(whole, Buffer.from([check >> 8, check & 255]));
  }
  return Buffer.concat(parts);
}
const seen = (samples) => samples.every(Number.isFinite) ? "a peak of " + samples.reduce((most, x) => Math.max(most, Math.abs(x)), 0).toFixed(2) : "samples that are not finite";

for (const [bits, code] of [[24, 6], [20, 5]]) {
  const file = flacFile(bits, code);
  const decoder = new FLACDecoder();
  await decoder.ready;
  const {channelData, errors, samplesDecoded} = await decoder.decodeFile(file);
  console.log(`${bits} bits, @wasm-audio-decoders/flac: ${samplesDecoded} frames, ${errors.length} errors, ${seen(channelData[0])}`);
  console.log(`${bits} bits, audio-decode: ${seen((await decode(file)).channelData[0])}`);
  const context = new OfflineAudioContext(1, 48000, 48000);
  console.log(`${bits} bits, node-web-audio-api: ${seen((await context.decodeAudioData(new Uint8Array(file).buffer)).getChannelData(0))}`);
}
process.exit(0);
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
24 bits, @wasm-audio-decoders/flac: 16384 frames, 0 errors, a peak of 0.50
24 bits, audio-decode: a peak of 0.50
24 bits, node-web-audio-api: a peak of 0.50
20 bits, @wasm-audio-decoders/flac: 16384 frames, 0 errors, samples that are not finite
20 bits, audio-decode: samples that are not finite
20 bits, node-web-audio-api: a peak of 0.50
EOF
cmp -s seen expected || { echo "What becomes of FLAC of 20 bits has changed."; exit 1; }
