// browser.mjs: runs browser.html in a browser, plain and cross-origin isolated, and scenes.html, and compares what they
// heard with `clamor render`. Started by `run`, in the folder of the bakes and renders.
import assert from "node:assert/strict";
import {existsSync} from "node:fs";
import {basename} from "node:path";
import {visit} from "./browsers.mjs";
import {compared, samples_of} from "./wav.mjs";

const [program, folder] = process.argv.slice(2);
const floats = (bytes) => new Float32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
const wavs = {headphones: "headphones.wav", paper: "paper.wav", whole: "paper.wav", khr: "khr.wav", msft: "msft.wav", door: "door.wav"};
const kWindowFrames = 240;

// Asserts that a render at another rate is that of a WAV file at 48 kHz, at one delay throughout.
function assert_same_sound(made, rate_hz, wav) {
  const expected = samples_of(wav), kFrames = 2048;
  const left = (time_s) => {
    const at = time_s * rate_hz, i = Math.floor(at);
    return (i + 1 - at) * made[2 * i] + (at - i) * made[2 * i + 2];
  };
  const alike = (begin, lag) => {
    let xy = 0, xx = 0, yy = 0;
    for (let i = 0; i < kFrames; ++i) {
      const x = left((begin + lag + i) / 48000), y = expected[2 * (begin + i)];
      xy += x * y, xx += x * x, yy += y * y;
    }
    return {lag, correlation: xy / Math.sqrt(xx * yy)};
  };
  const best = (begin) => Array.from({length: 401}, (_, i) => alike(begin, i - 200)).sort((a, b) => b.correlation - a.correlation)[0];
  const early = best(8000), late = best(26000);
  console.log(`at ${rate_hz} Hz: ${early.lag / 48} and ${late.lag / 48} ms late, correlated by ${early.correlation.toFixed(4)} and ${late.correlation.toFixed(4)}`);
  assert(Math.abs(early.lag - late.lag) <= 1 && Math.min(early.correlation, late.correlation) > 0.99);
}

// How much of two sounds is heard in a window: (1 - t) of one and t of the other, by least squares, where t grows in a
// straight line. Returns t in the middle and the power of what remains, relative to that of both.
function mixed(one, other, heard, begin) {
  let dd = 0, du = 0, uu = 0, hd = 0, hu = 0, hh = 0, power = 0;
  for (let i = begin; i < begin + 2 * kWindowFrames; ++i) {
    const d = other[i] - one[i], u = d * (i - begin - kWindowFrames) / kWindowFrames, h = heard[i] - one[i];
    dd += d * d, du += d * u, uu += u * u, hd += h * d, hu += h * u, hh += h * h;
    power += one[i] ** 2 + other[i] ** 2;
  }
  const t = (hd * uu - hu * du) / (dd * uu - du * du), slope = (hu * dd - hd * du) / (dd * uu - du * du);
  return {t, rest: (hh - t * hd - slope * hu) / power};
}

// Asserts that one sound becomes another by a crossfade that begins at `begin_s`, or a little later, and takes a tenth of a
// second.
function assert_crossfades(one, other, heard, begin_s) {
  const windows = [];
  for (let at = 0; at + 2 * kWindowFrames <= heard.length; at += 2 * kWindowFrames)
    windows.push({time_s: at / 96000, ...mixed(one, other, heard, at)});
  const begins = windows.findIndex(({t}) => t > 0.01), ends = windows.findIndex(({t}) => t > 0.99);
  const worst_db = 10 * Math.log10(Math.max(...windows.map(({rest}) => rest)));
  console.log(`a crossfade from ${windows[begins].time_s} to ${windows[ends].time_s} s, within ${worst_db.toFixed(1)} dB`);
  windows.slice(1).forEach(({t}, i) => assert(t > windows[i].t - 0.01 && t < 1.01, `a share of ${t} after one of ${windows[i].t}`));
  assert(windows[begins].time_s >= begin_s - 0.005 && windows[begins].time_s < begin_s + 0.15 && ends - begins < 22 && worst_db < -40);
}

const pages = ["browser.html", "browser.html?isolated"];
if (existsSync("node_modules/babylonjs-loaders/package.json")) pages.push("scenes.html");
else console.log("not tried, because npm does not give the libraries: scenes.html");
for (const page of pages) {
  const results = await visit(program, folder, page);
  if (results.other_rate) assert_same_sound(floats(results.other_rate), 44100, "headphones.wav");
  if (results.entered) assert_crossfades(floats(results.one), floats(results.other), floats(results.entered), 0.3);
  for (const [name, bytes] of Object.entries(results)) {
    if (/^(one|other|entered|other_rate)$/.test(name)) continue;
    if (!wavs[name]) {
      if (bytes.length > 0) console.log(`${basename(program)}: ${name}: ${bytes}`);
      continue;
    }
    const difference = compared(floats(bytes), wavs[name]);
    console.log(`${basename(program)}: ${name}: ${difference.toFixed(1)} dB`);
    assert(difference < -90);  // Chromium divides what is positive in 16-bit sounds by 32767: -93 dB
  }
}
