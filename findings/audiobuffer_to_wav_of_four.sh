#!/usr/bin/env bash
# audiobuffer-to-wav 1.0.0: of four channels, a quarter of the first is written, as a file of four channels.
#
# The package "interleaves multi-channel data, if necessary", which it does for two channels. For three and more, it
# writes the first one alone, and a header with the right number of channels: a reader hands the samples of W out to W,
# Y, Z and X in turn. An AmbiX scene of 1 s becomes one of 0.25 s, two octaves too high, in which all four channels are
# almost the same, so that it comes from one oblique direction; Y, Z and X are lost. Nothing is thrown, and the file is
# valid. 5.1 and impulse responses of more than two channels fare alike.
#
# It concerns who renders ambisonics or loudspeaker layouts with an OfflineAudioContext and saves them. Use wav-encoder
# 1.3.0, which writes all channels, as below.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . audiobuffer-to-wav@1.0.0 node-web-audio-api@2.2.0 wav-encoder@1.3.0 wav-decoder@1.3.0

cat >run.mjs <<'EOF'
import toWav from "audiobuffer-to-wav";
import {AudioBuffer} from "node-web-audio-api";
import decoder from "wav-decoder";
import encoder from "wav-encoder";

// A tone of 400 Hz from azimuth 60 degrees, elevation 30 degrees: W, Y, Z, X in ACN order, SN3D.
const gains = [1, 0.75, 0.5, 0.4330127];
for (const count of [1, 2, 4]) {
  const buffer = new AudioBuffer({numberOfChannels: count, length: 48000, sampleRate: 48000});
  const tone = Float32Array.from({length: 48000}, (_, i) => 0.5 * Math.sin(2 * Math.PI * 400 * i / 48000));
  for (let c = 0; c < count; ++c) buffer.copyToChannel(tone.map((x) => x * gains[c]), c);
  const channelData = Array.from({length: count}, (_, c) => buffer.getChannelData(c));
  const files = {
    "audiobuffer-to-wav": toWav(buffer, {float32: true}),
    "wav-encoder": await encoder.encode({sampleRate: 48000, channelData}, {float: true, bitDepth: 32}),
  };
  for (const [name, file] of Object.entries(files)) {
    const {channelData: read, length} = await decoder.decode(file);
    const peaks = read.map((channel) => channel.reduce((most, x) => Math.max(most, Math.abs(x)), 0).toFixed(2));
    const rises = read[0].reduce((sum, x, i, all) => sum + (i > 0 && all[i - 1] < 0 && x >= 0), 0);
    console.log(`${count} channels by ${name}: ${read.length} channels of ${length / 48000} s, ${Math.round(rises * 48000 / length / 100) * 100} Hz, peaks ${peaks.join(" ")}`);
  }
}
process.exit(0);
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
1 channels by audiobuffer-to-wav: 1 channels of 1 s, 400 Hz, peaks 0.50
1 channels by wav-encoder: 1 channels of 1 s, 400 Hz, peaks 0.50
2 channels by audiobuffer-to-wav: 2 channels of 1 s, 400 Hz, peaks 0.50 0.38
2 channels by wav-encoder: 2 channels of 1 s, 400 Hz, peaks 0.50 0.38
4 channels by audiobuffer-to-wav: 4 channels of 0.25 s, 1600 Hz, peaks 0.50 0.50 0.50 0.50
4 channels by wav-encoder: 4 channels of 1 s, 400 Hz, peaks 0.50 0.38 0.25 0.22
EOF
cmp -s seen expected || { echo "What audiobuffer-to-wav writes of four channels has changed."; exit 1; }
