#!/usr/bin/env bash
# web-audio-api 1.5.6: decodeAudioData leaves a sound at its file's rate, so that a ConvolverNode refuses it.
#
# The standard says that decodeAudioData converts to the context's rate, and browsers do; a ConvolverNode may
# therefore ask for that rate. The package decodes a file of 44.1 kHz in a context of 48 kHz to a buffer of 44.1 kHz,
# and its ConvolverNode throws a NotSupportedError at it, as the standard has it. In an AudioBufferSourceNode
# such a buffer sounds right, and so nothing is seen until an impulse response is loaded. Code that takes a
# buffer's length for a time in the context's frames is off by 9 percent. node-web-audio-api 2.2.0 converts.
#
# It concerns who runs a browser's code on a server with responses of another rate. Make the context at the rate of
# the response, or play the decoded buffer through an OfflineAudioContext of the rate that is wanted.
# Clamor converts sounds by itself, and is not concerned.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --prefix . web-audio-api@1.5.6 node-web-audio-api@2.2.0

cat >run.mjs <<'EOF'
// One second of 16-bit WAV at 44.1 kHz.
const rate = 44100, file = Buffer.alloc(44 + 2 * rate);
file.write("RIFF", 0);
file.writeUInt32LE(36 + 2 * rate, 4);
file.write("WAVEfmt ", 8);
[[16, 4], [1, 2], [1, 2], [rate, 4], [2 * rate, 4], [2, 2], [16, 2]].reduce((at, [value, size]) => file.writeUIntLE(value, at, size), 16);
file.write("data", 36);
file.writeUInt32LE(2 * rate, 40);
for (let i = 0; i < rate; ++i) file.writeInt16LE(Math.round(16384 * Math.exp(-i / 4410) * Math.sin(2 * Math.PI * 440 * i / rate)), 44 + 2 * i);

for (const name of ["node-web-audio-api", "web-audio-api"]) {
  const {OfflineAudioContext} = await import(name);
  const context = new OfflineAudioContext(1, 48000, 48000);
  const buffer = await context.decodeAudioData(new Uint8Array(file).buffer);
  let convolver = "takes it";
  try {
    context.createConvolver().buffer = buffer;
  } catch (error) {
    convolver = `throws a ${error.name}`;
  }
  console.log(`${name}: decoded to ${buffer.sampleRate} Hz, a ConvolverNode ${convolver}`);
}
process.exit(0);
EOF

node run.mjs | tee seen
cat >expected <<'EOF'
node-web-audio-api: decoded to 48000 Hz, a ConvolverNode takes it
web-audio-api: decoded to 44100 Hz, a ConvolverNode throws a NotSupportedError
EOF
cmp -s seen expected || { echo "The rate of decoded sounds has changed."; exit 1; }
