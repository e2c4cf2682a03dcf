// page_test.mjs: the page of clamor report in a browser: it loads in silence, shows the level, follows the
// hand, the mouse and the keyboard, has names for screen readers, and does without WebGL.
import assert from "node:assert/strict";
import {readFileSync} from "node:fs";
import {after, before, test} from "node:test";
import {pathToFileURL} from "node:url";
import {chromium} from "playwright-core";

const url = pathToFileURL("room.html").href;
const settings = {executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium"};
const common = ["--no-sandbox", "--disable-quic", "--disable-background-networking"];
const withGl = [...common, "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
let browser, page;
const said = [];

async function opened(of, options = {}) {
  const one = await of.newPage({viewport: {width: 1000, height: 800}, ...options});
  one.on("console", (message) => said.push(message.text()));
  one.on("pageerror", (problem) => said.push(problem.message));
  one.on("request", (request) => { if (!request.url().startsWith("file:") && !request.url().startsWith("data:")) said.push("asked for " + request.url()); });
  await one.goto(url);
  await one.waitForFunction(() => window.clamorView !== undefined);
  return one;
}
const listener = (of = page) => of.evaluate(() => window.clamorView.place.join());
const settled = (of = page) => of.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(done)))));
// The colours of the view, 64 x 64 of them.
const pixels = () => page.evaluate(() => {
  const small = document.createElement("canvas");
  small.width = small.height = 64;
  const context = small.getContext("2d");
  context.drawImage(document.getElementById("canvas"), 0, 0, 64, 64);
  return Array.from(context.getImageData(0, 0, 64, 64).data);
});
const differing = (a, b) => a.filter((value, i) => Math.abs(value - b[i]) > 8).length / a.length;

before(async () => {
  browser = await chromium.launch({...settings, args: withGl});
  page = await opened(browser);
  await settled();
});
after(async () => { await browser.close(); });

test("says in one sentence what the room sounds like, and in figures", async () => {
  assert.match(await page.locator(".headline").innerText(), /^It reverberates for [\d.]+ s, like .+The bake found nothing wrong/s);
  assert.equal(await page.locator("h1").innerText(), "How violin_room.glb sounds");
  assert.ok(await page.locator(".facts li").count() >= 6);
});

test("shows the level: its pixels go away with it", async () => {
  await page.locator("#canvas").scrollIntoViewIfNeeded();
  await page.locator("#layer-sources").check();
  await settled();
  const whole = await pixels();
  for (const layer of ["surfaces", "sources", "emitters"]) await page.locator("#layer-" + layer).uncheck();
  await settled();
  const empty = await pixels();
  assert.ok(differing(whole, empty) > 0.15, `only ${differing(whole, empty)} of the view is level`);
  await page.locator("#layer-surfaces").check();
  await settled();
  const surfaces = await pixels();
  assert.ok(differing(surfaces, empty) > 0.15);
  // It is plain grey, lit from one side: colours of different lightness and no hue.
  const shades = new Set();
  for (let i = 0; i < surfaces.length; i += 4) if (differing(surfaces.slice(i, i + 3), empty.slice(i, i + 3)) > 0) shades.add(surfaces[i] >> 3);
  assert.ok(shades.size > 4, `${shades.size} shades`);
  for (const layer of ["sources", "emitters"]) await page.locator("#layer-" + layer).check();
  await settled();
  assert.ok(differing(whole, await pixels()) < 0.01);
});

test("the listener is dragged with the mouse", async () => {
  const before = await listener(), canvas = page.locator("#canvas");
  const box = await canvas.boundingBox();
  const at = await page.evaluate(() => window.clamorView.camera.project(window.clamorView.place, window.clamorView.canvas.clientWidth / window.clamorView.canvas.clientHeight));
  const x = box.x + (at[0] + 1) / 2 * box.width, y = box.y + (1 - at[1]) / 2 * box.height;
  const camera = await page.evaluate(() => window.clamorView.camera.eye().join());
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 60, y + 30, {steps: 4});
  await page.mouse.up();
  await settled();
  assert.notEqual(await listener(), before);
  assert.equal(await page.evaluate(() => window.clamorView.camera.eye().join()), camera, "the camera stays");
  assert.notEqual(await page.locator("#listener-x").inputValue(), "0.0");
  assert.equal(await page.locator("#listener-y").inputValue(), "1.5", "at the same height");
  assert.match(await page.locator("#heard").innerText(), /At 1 kHz, [\d.]+ m from here: level G -?[\d.]+ dB, .*T30/);
  // Dragging elsewhere turns the view alone.
  const still = await listener();
  await page.mouse.move(box.x + 30, box.y + 30);
  await page.mouse.down();
  await page.mouse.move(box.x + 120, box.y + 60, {steps: 3});
  await page.mouse.up();
  await settled();
  assert.notEqual(await page.evaluate(() => window.clamorView.camera.eye().join()), camera);
  assert.equal(await listener(), still);
});

test("the keyboard moves the listener, turns the view and reaches every control", async () => {
  await page.locator("#canvas").focus();
  const from = await page.evaluate(() => window.clamorView.place.slice()), before = await listener();
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("PageUp");
  await settled();
  const to = await page.evaluate(() => window.clamorView.place.slice());
  assert.ok(Math.hypot(to[0] - from[0], to[2] - from[2]) > 0.05 && to[1] > from[1]);
  assert.notEqual(await listener(), before);
  const eye = await page.evaluate(() => window.clamorView.camera.eye().join());
  await page.keyboard.press("Shift+ArrowLeft");
  assert.notEqual(await page.evaluate(() => window.clamorView.camera.eye().join()), eye);
  await page.keyboard.press("Home");
  await page.locator("#canvas").focus();
  const reached = new Set();
  for (let i = 0; i < 120; ++i) {
    await page.keyboard.press("Tab");
    reached.add(await page.evaluate(() => document.activeElement.id));
  }
  for (const id of ["listener-x", "layer-octree", "colour", "delay-from", "band", "power", "surface", "cut", "depth", "floor-quantity", "floor-octave"])
    assert.ok(reached.has(id), id + " cannot be reached");
});

test("screen readers find names for all controls, charts and tables", async () => {
  const nameless = await page.evaluate(() => {
    const list = [];
    for (const one of document.querySelectorAll("button, select, input, canvas, svg, table, form, summary")) {
      const name = one.getAttribute("aria-label") ?? one.labels?.[0]?.innerText ?? one.querySelector(":scope > caption")?.textContent ?? (["BUTTON", "SUMMARY"].includes(one.tagName) ? one.innerText : "");
      if (name.trim() === "") list.push(one.outerHTML.slice(0, 100));
    }
    for (const table of document.querySelectorAll("table")) if (table.querySelector("thead th[scope=col]") === null || table.querySelector("tbody th[scope=row]") === null) list.push("headers of " + table.caption?.textContent);
    return list;
  });
  assert.deepEqual(nameless, []);
  assert.equal(await page.getByRole("status").count(), 1);
  assert.equal(await page.getByRole("application", {name: /three dimensions/}).count(), 1);
  assert.equal(await page.locator("main").count(), 1);
  const levels = await page.evaluate(() => [...document.querySelectorAll("h1, h2, h3")].map((heading) => Number(heading.tagName[1])));
  levels.forEach((level, i) => assert.ok(i === 0 ? level === 1 : level <= levels[i - 1] + 1, "headings skip a level"));
});

test("axe finds nothing serious", async () => {
  await page.addScriptTag({path: "node_modules/axe-core/axe.min.js"});
  const violations = await page.evaluate(async () => (await window.axe.run()).violations);
  assert.deepEqual(violations.filter(({impact}) => ["serious", "critical"].includes(impact)).map(({id, help}) => `${id}: ${help}`), []);
});

test("colours have enough contrast in both schemes", async () => {
  for (const colorScheme of ["light", "dark"]) {
    await page.emulateMedia({colorScheme});
    const ratios = await page.evaluate(() => {
      const light = (colour) => {
        const [r, g, b] = colour.match(/[\d.]+/g).map(Number).map((c) => (c /= 255) <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
      };
      const paper = light(getComputedStyle(document.body).backgroundColor);
      return [".headline", ".setting", "figcaption", "summary", ".kind", "th", "svg.chart text"].map((selector) => {
        const style = getComputedStyle(document.querySelector(selector)), ink = light(selector.startsWith("svg") ? style.fill : style.color);
        return [selector, (Math.max(ink, paper) + 0.05) / (Math.min(ink, paper) + 0.05)];
      });
    });
    for (const [selector, ratio] of ratios) assert.ok(ratio >= 4.5, `${selector} in ${colorScheme}: ${ratio.toFixed(2)}`);
  }
  await page.emulateMedia({colorScheme: "light"});
});

test("maps the floor, as a picture and as a table", async () => {
  const cells = await page.locator("#floor-picture [data-cell]").count();
  assert.ok(cells > 50);
  const label = () => page.locator("#floor-picture svg").getAttribute("aria-label");
  const level = await label();
  assert.match(level, /level G from -?[\d.]+ dB to [\d.]+ dB/);
  await page.locator("#floor-quantity").selectOption("t30_s");
  assert.match(await label(), /T30 from [\d.]+ s to [\d.]+ s/);
  assert.equal(await page.locator("#floor-table tbody tr").count(), cells);
  const before = await listener();
  await page.locator("#floor-picture [data-cell]").first().click();
  await settled();
  assert.notEqual(await listener(), before, "a click on the map moves the listener");
});

test("saves a chart as a picture of its own, light or dark as its reader asks", async () => {
  const save = page.locator("figure .save").first();
  await save.focus();
  const [file] = await Promise.all([page.waitForEvent("download"), save.press("Enter")]);
  assert.equal(file.suggestedFilename(), "T30_s_.svg");
  const svg = readFileSync(await file.path(), "utf8");
  assert.match(svg, /^<svg xmlns="http:\/\/www.w3.org\/2000\/svg".*T30 \(s\).*<\/svg>$/s);
  assert.match(svg, /<style>.*prefers-color-scheme: dark.*<\/style>/s);
});

test("fits a narrow window", async () => {
  await page.setViewportSize({width: 400, height: 800});
  assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth));
  await page.setViewportSize({width: 1000, height: 800});
});

test("says nothing on the console and asks the network for nothing", () => assert.deepEqual(said, []));

test("works without WebGL in all but the view", async () => {
  const plain = await chromium.launch({...settings, args: [...common, "--disable-gpu", "--disable-3d-apis"]});
  try {
    const one = await opened(plain);
    assert.match(await one.locator("#stage").innerText(), /no WebGL2/);
    assert.ok(await one.locator("svg.chart").count() >= 9);
    const before = await listener(one);
    await one.locator("#listener-x").fill("2.5");
    await one.locator("#listener-x").press("Enter");
    await settled(one);
    assert.notEqual(await listener(one), before);
    assert.ok(await one.locator("#floor-picture [data-cell]").count() > 50);
  } finally {
    await plain.close();
  }
});
