// listen_test.mjs: a page of clamor report --listen, opened as a file: it sounds, the sound follows the listener, its
// portal opens and closes, the keyboard reaches what sounds, and the network is asked for nothing.
import assert from "node:assert/strict";
import {after, before, test} from "node:test";
import {pathToFileURL} from "node:url";
import {chromium} from "playwright-core";

let browser, page;
const said = [];

before(async () => {
  browser = await chromium.launch({executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--disable-quic", "--disable-background-networking", "--enable-unsafe-swiftshader"]});
  page = await browser.newPage({viewport: {width: 1000, height: 800}});
  page.on("console", (message) => { if (!/GL Driver/.test(message.text())) said.push(message.text()); });
  page.on("pageerror", (problem) => said.push(problem.message));
  page.on("request", (request) => { if (!/^(file|data|blob):/.test(request.url())) said.push(`asked for ${request.url()}`); });
  await page.goto(pathToFileURL("listened.html").href);
  await page.waitForFunction(() => window.clamorListening !== undefined);
});
after(async () => { await browser.close(); });

// The mean power in each ear over some tenths of a second.
const powers = () => page.evaluate(async () => {
  const {audio, ears} = window.clamorListening;
  const splitter = audio.createChannelSplitter(2);
  ears.connect(splitter);
  const meters = [0, 1].map((channel) => {
    const meter = new AnalyserNode(audio, {fftSize: 16384});
    splitter.connect(meter, channel);
    return meter;
  });
  await new Promise((resolve) => { setTimeout(resolve, 900); });
  return meters.map((meter) => {
    const samples = new Float32Array(meter.fftSize);
    meter.getFloatTimeDomainData(samples);
    return samples.reduce((sum, x) => sum + x * x, 0) / samples.length;
  });
});

test("sounds when one asks it to, also as a file", async () => {
  await page.getByRole("button", {name: "Listen"}).click();
  await page.waitForFunction(() => /voices/.test(document.getElementById("listen-status").textContent), null, {timeout: 20_000});
  const [left, right] = await powers();
  assert.ok(left > 1e-10 && right > 1e-10, `powers ${left} and ${right}`);
});

// Moves the listener and waits until keyframes for the place are heard, however busy the machine is.
async function heard_at(place) {
  await page.evaluate(async (to) => {
    const {audio, ears} = window.clamorListening, place = to ?? window.clamorView.level.emitters.places.slice(0, 3);
    window.clamorView.moveTo([...place]);
    const nap = () => new Promise((resolve) => { setTimeout(resolve, 50); });
    for (const {keyframes} = await ears.statistics(); (await ears.statistics()).keyframes < keyframes + 30n;) await nap();
    for (const begin = audio.currentTime; audio.currentTime < begin + 0.5;) await nap();
  }, place);
  return powers();
}

test("gets quieter when the listener is dragged away", async () => {
  const near = await heard_at(null), far = await heard_at([60, 1.7, 60]);
  assert.ok(far[0] + far[1] < 0.1 * (near[0] + near[1]), `${near} near, ${far} far`);
});

test("shows from where voices come, and hears another bake at the same place", async () => {
  await heard_at(null);
  await page.waitForFunction(() => window.clamorView.heard?.length > 10);
  await page.getByLabel("the other bake").check();
  const [left, right] = await heard_at(null);
  assert.ok(left > 1e-10 && right > 1e-10, `powers ${left} and ${right}`);
});

test("closes and opens a portal by its box and by a click in the view", async () => {
  const box = page.getByLabel("Opening is open");
  const click = async () => {
    const [x, y] = await page.evaluate(() => {
      const {camera, canvas, level} = window.clamorView, {left, top, width, height} = canvas.getBoundingClientRect();
      const [u, v] = camera.project(level.portals[0].centre, width / height);
      return [left + (u + 1) / 2 * width, top + (1 - v) / 2 * height];
    });
    await page.mouse.click(x, y);
  };
  await page.evaluate(() => { document.getElementById("canvas").scrollIntoView(); });
  await click();
  assert.equal(await box.isChecked(), false);
  await page.mouse.click(10, 10);
  await box.check();
  await click();
  assert.equal(await box.isChecked(), false);
  await click();
  assert.equal(await box.isChecked(), true);
});

test("the keyboard reaches what sounds, and axe finds nothing serious", async () => {
  await page.locator("#canvas").focus();
  const reached = new Set();
  for (let i = 0; i < 40; ++i) {
    await page.keyboard.press("Tab");
    reached.add(await page.evaluate(() => document.activeElement.innerText || document.activeElement.labels?.[0]?.innerText));
  }
  for (const name of ["Pause", "Opening is open", "the other bake"]) assert.ok(reached.has(name), `${name} cannot be reached`);
  await page.addScriptTag({path: "node_modules/axe-core/axe.min.js"});
  const violations = await page.evaluate(async () => (await window.axe.run()).violations);
  assert.deepEqual(violations.filter(({impact}) => ["serious", "critical"].includes(impact)).map(({id, help}) => `${id}: ${help}`), []);
});

test("sounds without WebGL, too", async () => {
  const plain = await chromium.launch({executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--disable-gpu", "--disable-3d-apis"]});
  try {
    const one = await plain.newPage(), problems = [];
    one.on("pageerror", ({message}) => problems.push(message));
    await one.goto(pathToFileURL("listened.html").href);
    await one.getByRole("button", {name: "Listen"}).click();
    await one.waitForFunction(() => /voices/.test(document.getElementById("listen-status").textContent), null, {timeout: 60_000});
    await one.waitForFunction(() => window.clamorView.heard?.length > 10);
    await one.getByLabel("Opening is open").uncheck();
    await one.getByLabel("the other bake").check();
    assert.match(await one.locator("#stage").innerText(), /no WebGL2/);
    assert.deepEqual(problems, []);
  } finally {
    await plain.close();
  }
});

test("pauses, and has asked the network for nothing", async () => {
  await page.getByRole("button", {name: "Pause"}).click();
  await page.waitForFunction(() => window.clamorListening.audio.state === "suspended");
  assert.deepEqual(said, []);
});
