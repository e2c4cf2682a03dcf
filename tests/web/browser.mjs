// browser.mjs: runs browser.html in a browser, plain and cross-origin isolated, and scenes.html, and compares what they
// heard with `clamor render`. Started by `run`, in the folder of the bakes and renders.
import assert from "node:assert/strict";
import {existsSync} from "node:fs";
import {basename} from "node:path";
import {visit} from "./browsers.mjs";
import {compared} from "./wav.mjs";

const [program, folder] = process.argv.slice(2);
const floats = (bytes) => new Float32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
const wavs = {headphones: "headphones.wav", paper: "paper.wav", whole: "paper.wav", khr: "khr.wav", msft: "msft.wav"};
const pages = ["browser.html", "browser.html?isolated"];
if (existsSync("node_modules/babylonjs-loaders/package.json")) pages.push("scenes.html");
else console.log("not tried, because npm does not give the libraries: scenes.html");
for (const page of pages)
  for (const [name, bytes] of Object.entries(await visit(program, folder, page))) {
    if (!wavs[name]) {
      if (bytes.length > 0) console.log(`${basename(program)}: ${name}: ${bytes}`);
      continue;
    }
    const difference = compared(floats(bytes), wavs[name]);
    console.log(`${basename(program)}: ${name}: ${difference.toFixed(1)} dB`);
    assert(difference < -90);  // Chromium divides what is positive in 16-bit sounds by 32767: -93 dB
  }
