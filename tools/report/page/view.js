"use strict";
// view.js: the level in three dimensions, its sources, and a listener in it. What the listener hears is shown if the
// page sounds (listen.js).

const kPalette = [[194, 79, 0], [0, 105, 171], [0, 128, 93], [176, 86, 139], [47, 143, 201], [178, 123, 0], [122, 79, 191], [128, 96, 34]];
const kLayers = [
  ["surfaces", "surfaces", true, null], ["sources", "sources", true, null],
  ["emitters", "emitters", true, [194, 79, 0]], ["openings", "openings", true, [200, 30, 45]], ["gaps", "thin gaps", false, [224, 150, 0]],
  ["duplicates", "twice there", true, [132, 60, 190]], ["probes", "probes", false, [0, 150, 136]], ["portals", "portals", true, [60, 110, 220]], ["doors", "movable parts", true, [0, 128, 93]],
  ["octree", "octree", false, null], ["map", "map", false, null]];
const kListener = [214, 0, 110];

// A corner, 0 to 7, of a movable part's box.
function cornerOf(part, k) {
  return ["u", "v", "w"].reduce((at, side, bit) => add(at, times(part[side], (k >> bit) & 1 ? 1 : -1)), part.centre);
}

function cornersOf({centre, u, v}) {
  return [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) => add(centre, add(times(u, a), times(v, b))));
}

// Whether a face that is turned to `from` lies between two places (Moeller and Trumbore, 1997).
function isHidden(mesh, from, to) {
  const {positions, corners} = mesh, way = minus(to, from), at = (i) => positions.subarray(3 * corners[i], 3 * corners[i] + 3);
  for (let i = 0; i < corners.length; i += 3) {
    const a = at(i), u = minus(at(i + 1), a), v = minus(at(i + 2), a), h = outer(way, v), turned = inner(u, h);
    if (turned < 1e-12) continue;
    const s = minus(from, a), q = outer(s, u), x = inner(s, h) / turned, y = inner(way, q) / turned, t = inner(v, q) / turned;
    if (x >= 0 && y >= 0 && x + y <= 1 && t > 0 && t < 1) return true;
  }
  return false;
}

class View {
  constructor(level) {
    this.level = level;
    this.place = (level.listeners[0] ?? times(add(level.low, level.high), 0.5)).slice();
    this.layers = Object.fromEntries(kLayers.map(([key, , shown]) => [key, shown]));
    this.focus = null;
    this.camera = new Camera(level.low, level.high);
    this.canvas = document.getElementById("canvas");
    this.stage = document.getElementById("stage");
    this.fitted = false;
    this.longest = Math.max(1e-3, level.sources.delays.reduce((a, b) => Math.max(a, b), 0));
    const delays = level.sources.delays.slice().sort();
    this.late = Math.max(1e-3, delays[Math.floor(0.97 * delays.length)] ?? 0);  // the end of the scale
    this.loudest = this.powerRange();
    this.fillControls();
    try {
      this.drawing = new Drawing(this.canvas);
    } catch (problem) {
      this.drawing = null;
      this.withoutWebGl();
    }
    if (this.drawing !== null) {
      this.paintMesh();
      this.paintSources();
      this.paintMarkers();
      this.paintNodes();
      listenToHands(this);
      new ResizeObserver(() => { this.fitted &&= this.steered === true; this.redraw(); }).observe(this.stage);
      window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { this.paintMesh(); this.redraw(); });
      window.addEventListener("beforeprint", () => this.drawNow());
    }
    this.openRoof();
    this.moved();
    this.tellShown();
  }

  // Cuts off what lies above the listener if it hides him.
  openRoof() {
    const cut = this.get("cut"), {low, high, mesh} = this.level, size = high[1] - low[1];
    if (this.drawing === null || !isHidden(mesh, this.camera.eye(), this.place)) return;
    cut.value = Math.min(1000, Math.round(1000 * (this.place[1] + Math.max(1.2, 0.12 * size) - low[1]) / size));
  }

  withoutWebGl() {
    this.canvas.remove();
    document.getElementById("legend").remove();
    const text = document.createElement("p");
    text.className = "missing";
    text.textContent = "This browser has no WebGL2, so the level cannot be drawn. The listener can be moved with the numbers beside it; all else on this page is there.";
    this.stage.append(text);
    this.stage.style.height = this.stage.style.minHeight = "auto";
    for (const set of document.querySelectorAll("#controls fieldset")) if (set.querySelector("#listener-x") === null) set.hidden = true;
    for (const note of document.querySelectorAll(".note.keys")) note.hidden = true;
    for (const button of document.querySelectorAll("[data-finding]")) button.hidden = true;
  }

  get(id) { return document.getElementById(id); }

  powerRange() {
    const s = this.level.sources;
    let top = -Infinity;
    for (let i = 0; i < s.delays.length; ++i) top = Math.max(top, this.powerDb(i, -1));
    return top;
  }

  powerDb(i, band) {
    const powers = this.level.sources.powers;
    let sum = 0;
    if (band >= 0) sum = powers[8 * i + band];
    else for (let b = 0; b < 8; ++b) sum += powers[8 * i + b];
    return sum > 0 ? 10 * Math.log10(sum) : -Infinity;
  }

  fillControls() {
    const option = (select, value, text) => select.append(new Option(text, value));
    for (const [key, text, shown, colour] of kLayers) {
      const label = document.createElement("label"), box = document.createElement("input");
      box.type = "checkbox";
      box.id = "layer-" + key;
      box.checked = shown;
      box.addEventListener("change", () => {
        this.layers[key] = box.checked;
        if (key === "sources" && this.stale) this.paintSources();
        this.redraw();
      });
      label.append(box);
      if (colour !== null) {
        const swatch = document.createElement("span");
        swatch.className = "swatch";
        swatch.style.background = `rgb(${colour})`;
        label.append(swatch);
      }
      label.append(text);
      this.get("layers").append(label);
    }
    const colour = this.get("colour"), band = this.get("band"), surface = this.get("surface");
    option(colour, "delay", "by delay");
    option(colour, "power", "by power");
    option(colour, "material", "by material");
    if (this.level.kinds.length > 1) option(colour, "emitter", "by emitter");
    option(band, -1, "all octaves");
    option(surface, "plain", "plain");
    option(surface, "material", "by material");
    this.level.bandsHz.forEach((hz, b) => {
      option(band, b, hertz(hz));
      option(surface, b, "absorption at " + hertz(hz));
    });
    const depth = this.get("depth");
    depth.max = Math.max(0, this.level.nodes.shown - 1);
    depth.value = Math.min(2, depth.max);
    for (const id of ["colour", "band", "delay-from", "delay-to", "power"])
      this.get(id).addEventListener("input", () => { this.paintSources(); this.redraw(); });
    surface.addEventListener("input", () => { this.paintMesh(); this.legend(); this.redraw(); });
    this.get("cut").addEventListener("input", () => this.redraw());
    depth.addEventListener("input", () => { this.layers.octree = this.get("layer-octree").checked = true; this.paintNodes(); this.redraw(); });
    ["x", "y", "z"].forEach((axis, i) => {
      const input = this.get("listener-" + axis);
      input.value = this.inWorld(i).toFixed(1);
      input.addEventListener("change", () => { this.place[i] = (Number(input.value) || 0) - this.level.origin[i]; this.moved(); });
    });
    this.get("controls").addEventListener("submit", (event) => event.preventDefault());
    for (const button of document.querySelectorAll("[data-finding]"))
      button.addEventListener("click", () => this.show(Number(button.dataset.finding)));
  }

  // A coordinate of the listener in the world; all others here are relative to the level's origin.
  inWorld(axis) { return this.place[axis] + this.level.origin[axis]; }

  tellShown() {
    const {sources, mesh, nodes, emitters} = this.level, parts = [];
    parts.push(sources.held < sources.total
      ? `The view holds the ${grouped(sources.held)} of ${grouped(sources.total)} reflections of highest power over u: the octree's top, a fair sample of all.`
      : `The view holds all ${grouped(sources.held)} reflections.`);
    if (mesh.corners.length / 3 < mesh.total) parts.push(`It draws the ${grouped(mesh.corners.length / 3)} largest of ${grouped(mesh.total)} triangles.`);
    if (nodes.shown < nodes.depths) parts.push(`Octree nodes are there for the first ${nodes.shown} of ${nodes.depths} depths.`);
    if (emitters.places.length / 6 < emitters.total) parts.push(`It shows ${grouped(emitters.places.length / 6)} of ${grouped(emitters.total)} emitters.`);
    this.get("shown").textContent = parts.join(" ");
  }

  show(index) {
    const finding = this.level.findings[index];
    this.focus = finding;
    const layer = {opening: "openings", gap: "gaps", duplicate: "duplicates"}[finding.kind];
    if (layer !== undefined) this.layers[layer] = this.get("layer-" + layer).checked = true;
    const {low, high} = this.level, cut = this.get("cut");
    const least = 1000 * (finding.place[1] + 0.3 - low[1]) / Math.max(1e-3, high[1] - low[1]);
    if (Number(cut.value) < least) cut.value = Math.min(1000, Math.ceil(least));
    this.steered = this.fitted = true;
    this.camera.lookAt(finding.place.slice(), Math.min(finding.size, 0.4 * this.camera.extent));
    this.stage.scrollIntoView({block: "center"});
    this.canvas.focus({preventScroll: true});
    this.paintMarkers();
    this.redraw();
  }

  // --- What is drawn ---------------------------------------------------------------------------

  isDark() { return window.matchMedia("(prefers-color-scheme: dark)").matches && !window.matchMedia("print").matches; }

  paintMesh() {
    if (this.drawing === null) return;
    const {mesh, materials} = this.level, mode = this.get("surface").value, dark = this.isDark();
    const plain = dark ? [112, 118, 126] : [196, 194, 188];
    const used = [...new Set(mesh.materials)].sort((a, b) => a - b);
    const ofMaterial = materials.map((material, m) => {
      if (mode === "plain") return plain;
      if (mode === "material") return kPalette[used.indexOf(m) % kPalette.length].map((c) => Math.round(0.55 * c + 0.45 * plain[0]));
      return scaleColour(material.absorption[Number(mode)] / this.mostAbsorbed(Number(mode)));
    });
    const places = new Float32Array(3 * mesh.corners.length), shades = new Uint8Array(3 * mesh.corners.length);
    for (let i = 0; i < mesh.corners.length; ++i) {
      const from = 3 * mesh.corners[i], colour = ofMaterial[mesh.materials[Math.floor(i / 3)]];
      for (let axis = 0; axis < 3; ++axis) {
        places[3 * i + axis] = mesh.positions[from + axis];
        shades[3 * i + axis] = colour[axis];
      }
    }
    this.drawing.set("surfaces", "triangles", {place: [3, places], shade: [3, shades]});
  }

  // The highest absorption of a material in an octave: the end of the scale.
  mostAbsorbed(band) { return Math.max(0.01, ...this.level.materials.map((material) => material.absorption[band])); }

  // Tells of a source whether the filters let it pass.
  filter() {
    const s = this.level.sources, band = Number(this.get("band").value), power = Number(this.get("power").value);
    const from = Number(this.get("delay-from").value) / 1000 * this.longest, to = Number(this.get("delay-to").value) / 1000 * this.longest;
    const least = power === 0 ? -Infinity : this.loudest - 60 + 0.6 * power;
    return (i) => s.delays[i] >= from && s.delays[i] <= to && this.powerDb(i, band) >= least;
  }

  // Gives the colour of a source.
  colours() {
    const s = this.level.sources, mode = this.get("colour").value, band = Number(this.get("band").value);
    return (i) => mode === "delay" ? scaleColour(s.delays[i] / this.late)
      : mode === "power" ? scaleColour((this.powerDb(i, band) - this.loudest + 40) / 40)
        : kPalette[(mode === "material" ? s.materials[i] : s.kinds[i]) % kPalette.length];
  }

  placeOf(i) { return this.level.sources.places.subarray(3 * i, 3 * i + 3); }

  paintSources() {
    if (this.drawing === null) return;
    this.legend();
    this.stale = !this.layers.sources;  // painted when it is shown
    if (this.stale) return;
    const s = this.level.sources, passes = this.filter(), colourOf = this.colours(), band = Number(this.get("band").value);
    const places = [], shades = [], sizes = [];
    for (let i = 0; i < s.delays.length; ++i) {
      if (!passes(i)) continue;
      places.push(...this.placeOf(i));
      shades.push(...colourOf(i), 120);
      sizes.push(1.3 + 0.035 * Math.max(0, this.powerDb(i, band) - this.loudest + 40));
    }
    this.drawing.set("sources", "points", {place: [3, Float32Array.from(places)], shade: [4, Uint8Array.from(shades)], size: [1, Float32Array.from(sizes)]});
  }

  legend() {
    const mode = this.get("colour").value, surface = this.get("surface").value, legend = this.get("legend");
    if (legend === null) return;
    const bar = `<span class="bar" style="background: linear-gradient(90deg, ${kScale.map((c) => `rgb(${c})`).join()})"></span>`;
    const scale = (title, low, high) => `<div>${title}${bar}<span class="ends"><span>${low}</span><span>${high}</span></span></div>`;
    const sources = mode === "delay" ? scale("Path delay of sources", "0 ms", `${Math.round(1000 * this.late)} ms and more`)
      : mode === "power" ? scale("Power of sources", `${Math.round(this.loudest - 40)} dB`, `${Math.round(this.loudest)} dB`) : `<div>Sources by ${mode}</div>`;
    const band = Number(surface);
    legend.innerHTML = sources + (Number.isNaN(band) ? "" : scale("Absorption at " + hertz(this.level.bandsHz[band]), "0 %", `${Math.round(100 * this.mostAbsorbed(band))} %`));
  }

  paintMarkers() {
    if (this.drawing === null) return;
    const {emitters, probes, portals, parts, findings} = this.level, colours = Object.fromEntries(kLayers.map(([key, , , colour]) => [key, colour]));
    const many = emitters.places.length / 6 > 200, list = [];
    for (let e = 0; e < emitters.places.length / 6; ++e)
      list.push({place: emitters.places.subarray(6 * e, 6 * e + 3), colour: colours.emitters, size: many ? 3 : 13, alpha: many ? 200 : 255});
    this.drawing.points("emitters", list, {onTop: !many});
    const zones = probes.zones;
    this.drawing.points("probes", Array.from(zones, (_, p) => ({place: probes.places.subarray(3 * p, 3 * p + 3), colour: colours.probes, size: 6})));
    const outlines = [];
    for (const portal of portals) {
      const corners = cornersOf(portal), isClosed = portal.box?.checked === false;  // which is crossed out
      corners.forEach((from, k) => outlines.push({from, to: corners[(k + 1) % 4], colour: colours.portals}));
      if (isClosed) for (const k of [0, 1]) outlines.push({from: corners[k], to: corners[k + 2], colour: colours.portals});
    }
    this.drawing.lines("portals", outlines, {onTop: true});
    this.drawing.lines("doors", parts.flatMap((part) => boxEdges((k) => cornerOf(part, k), colours.doors)), {onTop: true});
    const openings = [], marks = {openings: [], gaps: [], duplicates: []};
    for (const finding of findings) {
      if (finding.place === undefined) continue;
      const layer = {opening: "openings", gap: "gaps", duplicate: "duplicates", warning: "openings"}[finding.kind];
      marks[layer].push({place: finding.place, colour: colours[layer], size: 10});
      if (finding.kind !== "opening") continue;
      openings.push(...circle(finding.place, finding.direction, finding.size / 2, colours.openings));
      openings.push({from: finding.place, to: add(finding.place, times(finding.direction, 0.6 * finding.size + 0.5)), colour: colours.openings});
    }
    for (const [layer, points] of Object.entries(marks)) this.drawing.points(layer, points);
    this.drawing.lines("opening-lines", openings, {onTop: true});
    this.drawing.points("focus", this.focus === null ? [] : [{place: this.focus.place, colour: kListener, size: 30}], {ring: 0.8});
  }

  paintNodes() {
    if (this.drawing === null) return;
    const {boxes, of} = this.level.nodes, depth = Number(this.get("depth").value), list = [], colour = this.isDark() ? [150, 190, 230] : [40, 80, 130];
    for (let n = 0; n < of.length; ++n) {
      if (of[n] !== depth) continue;
      const b = boxes.subarray(6 * n, 6 * n + 6);
      list.push(...boxEdges((k) => [b[k & 1 ? 3 : 0], b[k & 2 ? 4 : 1], b[k & 4 ? 5 : 2]], colour, 130));
    }
    this.drawing.lines("octree", list);
  }

  // Squares of the floor map's colours (floor.js).
  paintMap(squares) {
    if (this.drawing === null) return;
    const places = [], shades = [];
    for (const {x, y, z, half, colour} of squares)
      for (const [u, v] of [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) {
        places.push(x + u * half, y + 0.04, z + v * half);
        shades.push(...colour);
      }
    this.drawing.set("map", "triangles", {place: [3, Float32Array.from(places)], shade: [3, Uint8Array.from(shades)]}, {bothSides: true});
    this.redraw();
  }

  redraw() {
    if (this.drawing === null || this.waiting === true) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.drawNow(); });
  }

  drawNow() {
    if (!this.fitted) {
      this.camera.fit(this.stage.clientWidth / this.stage.clientHeight);
      this.fitted = true;
    }
    const cut = this.level.low[1] + (this.level.high[1] - this.level.low[1]) * Number(this.get("cut").value) / 1000 + 0.01;
    const paper = getComputedStyle(this.stage).backgroundColor.match(/[\d.]+/g).slice(0, 3).map((c) => c / 255);
    const on = (layer) => this.layers[layer] ? [layer] : [];
    this.drawing.draw(this.camera, {paper, cut, heights: [this.level.low[1], this.level.high[1] + 1e-3], names: [
      ...on("surfaces"), ...on("map"), ...on("octree"), ...on("sources"), "heard", ...on("portals"), ...on("doors"),
      ...on("probes"), ...on("gaps"), ...on("duplicates"), ...(this.layers.openings ? ["opening-lines", "openings"] : []), ...on("emitters"), "focus", "listener", "ring"]});
    this.placeLabels();
  }

  nameOf(finding) {
    if (finding.kind === "opening") return finding.text.split(" of ")[0] + " escapes";
    return {gap: "thin gap", duplicate: "there twice"}[finding.kind] ?? "warning";
  }

  // Words beside what is marked, where there is room for them.
  placeLabels() {
    for (const old of this.stage.querySelectorAll(".label")) old.remove();
    const wide = this.stage.clientWidth, high = this.stage.clientHeight, taken = [], wanted = [[this.place, "listener"]];
    if (this.focus !== null) wanted.push([this.focus.place, this.nameOf(this.focus)]);
    if (this.layers.emitters) this.level.emitters.names.slice(0, 8).forEach((name, e) => wanted.push([this.level.emitters.places.subarray(6 * e, 6 * e + 3), name]));
    if (this.layers.doors) this.level.parts.slice(0, 8).forEach((part) => wanted.push([part.centre, part.name]));
    if (this.layers.portals) this.level.portals.slice(0, 8).forEach((portal) => wanted.push([portal.centre, portal.name]));
    if (this.layers.openings) for (const f of this.level.findings) if (f.kind === "opening" && f.place !== undefined && f !== this.focus) wanted.push([f.place, this.nameOf(f)]);
    for (const [place, text] of wanted) {
      if (text === "") continue;
      const seen = this.camera.project(place, wide / high);
      if (seen === null || Math.abs(seen[0]) > 1 || Math.abs(seen[1]) > 1) continue;
      const x = (seen[0] + 1) / 2 * wide, y = (1 - seen[1]) / 2 * high, label = document.createElement("span");
      label.className = "label";
      label.setAttribute("aria-hidden", "true");
      label.textContent = text;
      this.stage.append(label);
      const box = {left: x + 15 + label.offsetWidth > wide ? x - 15 - label.offsetWidth : x + 15, top: y - 10};
      box.right = box.left + label.offsetWidth;
      box.bottom = box.top + label.offsetHeight;
      if (taken.some((t) => t.left < box.right && box.left < t.right && t.top < box.bottom && box.top < t.bottom)) {
        label.remove();
        continue;
      }
      taken.push(box);
      label.style.transform = `translate(${box.left}px, ${box.top}px)`;
    }
  }

  // --- The listener ----------------------------------------------------------------------------

  moveTo(place) {
    this.place = place.slice();
    ["x", "y", "z"].forEach((axis, i) => { this.get("listener-" + axis).value = this.inWorld(i).toFixed(1); });
    this.moved();
  }

  moved() {
    this.tellPlace();
    if (this.drawing === null) return;
    this.drawing.points("listener", [{place: this.place, colour: kListener, size: 11}]);
    this.drawing.points("ring", [{place: this.place, colour: kListener, size: 26}], {ring: 0.78});
    this.redraw();
  }

  // What the floor map says of the place.
  tellPlace() {
    const far = (cell) => Math.hypot(...minus(cell.slice(3, 6), this.place)), {cells} = this.level.map;
    const nearest = cells.reduce((best, cell) => (best !== null && far(best) <= far(cell) ? best : cell), null);
    const known = nearest === null ? [] : Object.entries(kMapped).map(([key, {name, unit, digits}]) => [name, nearest[7][key][4], unit, digits])
      .filter(([, value]) => value !== null).map(([name, value, unit, digits]) => `${name} ${value.toFixed(digits)} ${unit}`);
    this.get("heard").textContent = known.length === 0 ? "" : `At 1 kHz, ${far(nearest).toFixed(1)} m from here: ${known.join(", ")}.`;
  }

  // Lines from the listener to where each voice comes from: {toward, level_db, delay_s}, the longer the louder.
  showHeard(voices) {
    this.heard = voices;
    if (this.drawing === null) return;
    const loudest = Math.max(...voices.map((voice) => voice.level_db)), first = Math.min(...voices.map((voice) => voice.delay_s));
    const length = (voice) => 0.15 * this.camera.extent * Math.max(0, 1 + (voice.level_db - loudest) / 40);
    this.drawing.lines("heard", voices.map((voice) => ({from: this.place, to: add(this.place, times(voice.toward, length(voice))),
      colour: scaleColour((voice.delay_s - first) / this.late), alpha: 200})));
    this.redraw();
  }
}
