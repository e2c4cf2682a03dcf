// wav.mjs: renders of `clamor render` and how much others differ from them.
import {readFileSync} from "node:fs";

// Interleaved samples of a WAV file of floats.
export function samples_of(path) {
  const bytes = readFileSync(path);
  for (let at = 12; at < bytes.length; at += 8 + bytes.readUInt32LE(at + 4) + bytes.readUInt32LE(at + 4) % 2)
    if (bytes.toString("latin1", at, at + 4) === "data") {
      const begin = bytes.byteOffset + at + 8;
      return new Float32Array(bytes.buffer.slice(begin, begin + bytes.readUInt32LE(at + 4)));
    }
  throw new Error(`${path} has no samples`);
}

// The power of the difference from a render, relative to the render's, in decibels.
export function compared(made, path) {
  const expected = samples_of(path);
  let error = 0;
  let power = 0;
  expected.forEach((sample, i) => {
    error += (made[i] - sample) ** 2;
    power += sample ** 2;
  });
  return 10 * Math.log10(error / power);
}
