// pipelines_test.mjs: a level sounds the same after the tools of the table in formats/README.md, with the
// options that it names; with their defaults, Clamor says every loss.
import assert from "node:assert/strict";
import {execFileSync, spawnSync} from "node:child_process";
import {mkdtempSync, rmSync, writeFileSync} from "node:fs";
import {join, resolve} from "node:path";
import {after, before, test} from "node:test";
import {emitters, hinge, writeLevel, writeObj} from "./level.mjs";

const clamor = resolve(process.env.CLAMOR_PROGRAM);
const folder = mkdtempSync(resolve("work-"));
const tool = (name) => resolve("node_modules/.bin", name);
const three = resolve("three_copy.mjs");

// A folder with the level in the given form.
function fresh(form) {
  const place = mkdtempSync(join(folder, form + "-"));
  writeLevel(place, form);
  return place;
}

// Runs a tool: its name and arguments, with the level's file names where they are needed.
function run(place, name, ...words) {
  const [program, first] = name === "three" ? [process.execPath, [three]] : [tool(name), []];
  execFileSync(program, [...first, ...words], {cwd: place, stdio: "pipe"});
}

// What Clamor reads of a level, as `inspect --json` says it.
function inspected(place, file) {
  return JSON.parse(execFileSync(clamor, ["inspect", file, "--json"], {cwd: place, stdio: "pipe"}));
}

// With this many photons and sources the T30 of two seeds differs by 0.8 % rms.
function baked(place, file) {
  const bake = spawnSync(clamor, ["bake", file, "-o", "out.clamor", "--photons", "100000", "--sources", "100000", "--early-order", "0", "--no-journal"],
    {cwd: place, encoding: "utf8"});
  assert.equal(bake.status, 0, bake.stderr);
  return {...inspected(place, "out.clamor"), said: bake.stderr};
}

let original;
before(() => { original = baked(fresh("plain"), "level.glb"); });
after(() => rmSync(folder, {recursive: true}));

const apart = (a, b) => Math.hypot(...a.map((x, i) => x - b[i]));

// OBJ has no pivots.
function assertSoundsAsTheOriginal(level, hasPivots = true) {
  for (const [band, t30] of level.decay.t30_s.entries())
    assert.ok(Math.abs(t30 / original.decay.t30_s[band] - 1) < 0.03,
      `T30 at ${level.bands_hz[band]} Hz is ${t30} s instead of ${original.decay.t30_s[band]} s`);
  assert.deepEqual(level.emitters.map(({name}) => name).sort(), Object.keys(emitters).sort());
  for (const {name, position_m} of level.emitters)
    assert.ok(apart(position_m, emitters[name]) < 0.01, `${name} is at ${position_m}`);
  assert.equal(level.movable_parts.length, 1);
  if (hasPivots) assert.ok(apart(level.movable_parts[0].position_m, hinge) < 0.01, `the door turns about ${level.movable_parts[0].position_m}`);
  assert.doesNotMatch(level.said, /warning|thin gap/, "a warning about a level that sounds right");
}

// --- With the options of the table ---------------------------------------------------------------------

const kept = ["--palette", "false", "--join", "false", "--flatten", "false", "--prune", "false", "--instance", "false"];
const rows = [
  ["sturdy", "gltfpack", "-i", "level.glb", "-o", "out.glb", "-km", "-ke", "-kn"],
  ["sturdy", "gltfpack", "-i", "level.glb", "-o", "out.glb", "-km", "-ke", "-kn", "-cc"],
  ["sturdy", "gltf-transform", "meshopt", "level.glb", "out.glb"],
  ["sturdy", "gltf-transform", "optimize", "level.glb", "out.glb", ...kept],
  ["sturdy", "gltf-transform", "draco", "level.glb", "out.glb"],
  ["beside", "gltf-pipeline", "-i", "level.glb", "-o", "out.glb"],
  ["beside", "gltf-pipeline", "-i", "level.glb", "-o", "out.glb", "-d", "--draco.quantizePositionBits", "14"],
  ["sturdy", "three", "level.glb", "out.glb"]];
for (const [form, ...words] of rows)
  test(`sounds the same, written ${form}, after ${words.filter((word) => !/level[.]glb|out[.]glb|^-[io]$/.test(word)).join(" ")}`, () => {
    const place = fresh(form);
    run(place, ...words);
    assertSoundsAsTheOriginal(baked(place, "out.glb"));
  });

test("sounds the same from OBJ after obj2gltf, with a sidecar", () => {
  const place = fresh("sturdy");
  writeFileSync(join(place, "out.acoustics.json"), JSON.stringify(writeObj(place)));
  run(place, "obj2gltf", "-i", "level.obj", "-o", "out.glb");
  assertSoundsAsTheOriginal(baked(place, "out.glb"), false);
});

// --- With their defaults ------------------------------------------------------------------------------

const losses = [
  ["plain", ["gltfpack", "-i", "level.glb", "-o", "out.glb"],
    [/gltfpack 1.3 wrote this level, and 'Shelf' covers all.*gltfpack -km -ke -kn/, /gltfpack 1.3 has dropped them/]],
  ["plain", ["gltf-transform", "copy", "level.glb", "out.glb"], [/glTF-Transform v4.5.1 has dropped them/]],
  ["plain", ["gltf-transform", "quantize", "level.glb", "out.glb"],
    [/glTF-Transform v4.5.1 has dropped them/, /movable part 'Door' turns about .*has moved its origin/]],
  ["painted", ["gltf-transform", "optimize", "level.glb", "out.glb"],
    [/'PaletteMaterial001' covers .*--palette false --join false --flatten false --prune false --instance false/, /glTF-Transform v4.5.1 has dropped them/]],
  ["plain", ["gltf-pipeline", "-i", "level.glb", "-o", "out.glb"], [/emitter of 'Radio' is left out/]],
  ["plain", ["gltf-pipeline", "-i", "level.glb", "-o", "out.glb", "-d"], [/emitter of 'Radio' is left out/]],
  ["plain", ["three", "level.glb", "out.glb"],
    [/node 'Radio' has an emitter in extras.gltfExtensions/, /node 'Fan' has an emitter in extras.gltfExtensions/]],
  ["plain", ["three", "level.glb", "out.glb", "custom"], [/emitter of node 'Radio' is left out/, /emitter of node 'Fan' is left out/]]];
for (const [form, words, sentences] of losses)
  test(`says what is lost of a ${form} level after ${words.filter((word) => !/level[.]glb|out[.]glb|^-[io]$/.test(word)).join(" ")}`, () => {
    const place = fresh(form);
    run(place, ...words);
    const {warnings} = inspected(place, "out.glb");
    for (const sentence of sentences)
      assert.ok(warnings.some((warning) => sentence.test(warning)), `${sentence} is in none of ${JSON.stringify(warnings, null, 1)}`);
  });

test("says what is lost of OBJ after obj2gltf, without a sidecar", () => {
  const place = fresh("sturdy");
  writeObj(place);
  run(place, "obj2gltf", "-i", "level.obj", "-o", "out.glb");
  const {warnings} = inspected(place, "out.glb");
  for (const sentence of [/nothing in the level makes a sound/])
    assert.ok(warnings.some((warning) => sentence.test(warning)), `${sentence} is in none of ${JSON.stringify(warnings, null, 1)}`);
});
