#!/usr/bin/env bash
# wavefile 11.0.0 reads the floating-point numbers of a WAVE_FORMAT_EXTENSIBLE file as integers.
#
# A WAV file says in its format tag that it holds floating-point numbers (3), or it has the tag 0xFFFE and
# says so in the GUID that follows, as files of several channels must. wavefile accepts the tag 0xFFFE, takes
# the bits per sample and does not look at the GUID: the bit patterns of floats become 32-bit integers.
# Nothing is thrown and the number of frames is right, but a sine with a peak of 0.5 is off by up to 0.7,
# which is loud noise. The same samples behind the tag 3 are read rightly.
#
# Compare the GUID (bytes 24 to 39 of the chunk "fmt ") yourself before you trust toBitDepth() or
# getSamples(), or write floats with the tag 3. Clamor reads both kinds.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . wavefile@11.0.0

cat >run.mjs <<'EOF'
import wavefile from "wavefile";

const frames = 4800;
const tone = Float32Array.from({length: frames}, (_, i) => 0.5 * Math.sin(2 * Math.PI * 440 * i / 48000));

function wavFile(isExtensible) {
  const format = Buffer.alloc(isExtensible ? 40 : 18);
  format.writeUInt16LE(isExtensible ? 0xfffe : 3, 0);
  format.writeUInt16LE(1, 2);
  format.writeUInt32LE(48000, 4);
  format.writeUInt32LE(192000, 8);
  format.writeUInt16LE(4, 12);
  format.writeUInt16LE(32, 14);
  if (isExtensible) {
    format.writeUInt16LE(22, 16);
    format.writeUInt16LE(32, 18);
    format.writeUInt32LE(4, 20);  // the centre
    Buffer.from("0300000000001000800000aa00389b71", "hex").copy(format, 24);  // KSDATAFORMAT_SUBTYPE_IEEE_FLOAT
  }
  const chunk = (name, bytes) => {
    const head = Buffer.alloc(8);
    head.write(name);
    head.writeUInt32LE(bytes.length, 4);
    return Buffer.concat([head, bytes]);
  };
  const fact = Buffer.alloc(4);
  fact.writeUInt32LE(frames);
  return chunk("RIFF", Buffer.concat([Buffer.from("WAVE"), chunk("fmt ", format), chunk("fact", fact), chunk("data", Buffer.from(tone.buffer))]));
}

for (const isExtensible of [false, true]) {
  const wav = new wavefile.WaveFile(wavFile(isExtensible));
  wav.toBitDepth("64");
  const samples = wav.getSamples(false, Float64Array);
  const error = samples.reduce((worst, x, i) => Math.max(worst, Math.abs(x - tone[i])), 0);
  console.log(`${isExtensible ? "tag 0xFFFE and the GUID of floats" : "tag 3"}: ${samples.length} frames, ${error < 1e-6 ? "right" : "wrong by up to " + error.toFixed(1)}`);
}
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
tag 3: 4800 frames, right
tag 0xFFFE and the GUID of floats: 4800 frames, wrong by up to 0.7
EOF
cmp -s seen expected || { echo "What is read of floats in WAVE_FORMAT_EXTENSIBLE has changed."; exit 1; }
