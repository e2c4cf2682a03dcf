// minute.mjs: whether every block of many voices is there, in Chromium: of an OfflineAudioContext, and, with --live, of an
// AudioContext on a plain page and on an isolated one. Offline, one that is missing is an error on any machine; live, it
// is a figure, which says something on a machine that does nothing else.
//
// usage: node minute.mjs PACKAGE BAKE [VOICES [SECONDS]] [--live], in the folder of the bake
import assert from "node:assert/strict";
import {loadavg} from "node:os";
import {tree_cpu_ms, visit} from "./browsers.mjs";

const is_live = process.argv.includes("--live");
const [folder, bake, voices = 1000, seconds = 60] = process.argv.slice(2).filter((word) => word !== "--live");

async function open(search) {
  const cpu_ms = {};
  const {result} = await visit("chromium", folder, `minute.html${search}#${bake},${voices},${seconds}`,
    (name, browser) => { cpu_ms[name] = tree_cpu_ms(browser.pid); }, 240 + 40 * seconds);
  return {...JSON.parse(result), cpu_ms};
}

if (!is_live) {
  const {mixed, first, quanta, missing} = await open("");
  console.log(`offline: ${mixed} voices, ${seconds} s: ${missing} of ${quanta} quanta of 128 frames are missing`);
  const is_as_asked = mixed > 0.9 * voices && mixed < 1.1 * voices;  // those that fade are counted, too
  assert(missing === 0 && first < 100 && is_as_asked, `the first sounds after ${first} quanta`);
}
for (const search of is_live ? ["?plain", "?isolated"] : []) {
  const {mixed, played_s, at_start, missing, late_ms, said_ms, cpu_ms: {begin, played}} = await open(search);
  console.log(`live, ${search.slice(1)}: ${mixed} voices, ${played_s.toFixed(1)} s: ${missing} of ${Math.round(375 * played_s)} quanta are missing, ` +
    `and ${at_start} of the 2 s before; ${(0.1 * (played - begin) / played_s).toFixed(1)} % of a core, at a load of ${loadavg()[0].toFixed(1)}; ` +
    `a turn of the head is heard after ${late_ms[late_ms.length >> 1]?.toFixed(0)} ms (median of ${late_ms.length}; ${said_ms.toFixed(0)} are said)`);
}
