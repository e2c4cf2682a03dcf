"use strict";
// floor.js: maps of room parameters over the floor, as pictures and as tables.

const kMapped = {
  g_db: {name: "level G", unit: "dB", digits: 1, noticeable: () => 1},
  c80_db: {name: "clarity C80", unit: "dB", digits: 1, noticeable: () => 1},
  t30_s: {name: "reverberation time T30", unit: "s", digits: 2, noticeable: (value) => 0.05 * value}};

class FloorMap {
  constructor(level, view) {
    this.level = level;
    this.view = view;
    this.host = document.getElementById("floor");
    if (this.host === null) return;
    this.storeys = Math.max(...level.map.cells.map((cell) => cell[2])) + 1;
    const selects = {
      quantity: ["What", Object.entries(kMapped).map(([key, {name}]) => [key, name])],
      octave: ["Octave", [[-1, "mean of 500 Hz and 1 kHz"], ...level.bandsHz.map((hz, b) => [b, hertz(hz)])]],
      storey: ["Floor", Array.from({length: this.storeys}, (_, s) => [s, s === 0 ? "lowest floor" : `floor ${s + 1} above others`])]};
    this.host.innerHTML = `<figure class="floor"><div id="floor-picture"></div><div id="floor-controls"></div></figure><details><summary>The map as a table</summary><div id="floor-table"></div></details>`;
    for (const [id, [title, options]] of Object.entries(selects)) {
      const label = document.createElement("label"), select = document.createElement("select");
      select.id = "floor-" + id;
      for (const [value, text] of options) select.append(new Option(text, value));
      select.addEventListener("input", () => this.draw());
      label.append(title, select);
      if (options.length > 1) document.getElementById("floor-controls").append(label);
      this[id] = select;
    }
    const legend = document.createElement("div");
    legend.id = "floor-legend";
    document.getElementById("floor-controls").append(legend);
    this.draw();
  }

  value(cell) {
    const values = cell[7][this.quantity.value], octave = Number(this.octave.value);
    if (octave >= 0) return values[octave];
    return values[3] === null || values[4] === null ? null : (values[3] + values[4]) / 2;
  }

  // The place of a cell in the world, to a centimetre.
  placeOf(cell) { return cell.slice(3, 6).map((x, i) => Math.round(100 * (x + this.level.origin[i])) / 100).join(", "); }

  draw() {
    const {step, lowX, lowZ, cells} = this.level.map, shown = cells.filter((cell) => cell[2] === Number(this.storey.value));
    const kind = kMapped[this.quantity.value], known = shown.map((cell) => this.value(cell)).filter((value) => value !== null);
    const low = Math.min(...known), high = Math.max(...known), text = (value) => value === null ? "too dry" : `${value.toFixed(kind.digits)} ${kind.unit}`;
    const shareOf = (value) => high > low ? (value - low) / (high - low) : 0.5;
    const colour = (value) => value === null ? "none" : `rgb(${scaleColour(shareOf(value))})`;
    const columns = Math.max(...cells.map((cell) => cell[0])) + 1, rows = Math.max(...cells.map((cell) => cell[1])) + 1, margin = 0.6;
    const unit = 560 / Math.max(columns, rows), wide = (columns + 2 * margin) * unit, tall = (rows + 2 * margin) * unit;
    const at = (x, z) => [((x - lowX) / step + margin) * unit, ((z - lowZ) / step + margin) * unit];
    const summary = known.length === 0 ? `${kind.name}: nowhere measurable` : `${kind.name} from ${text(low)} to ${text(high)}`;
    let svg = `<svg viewBox="0 0 ${wide.toFixed(0)} ${(tall + 26).toFixed(0)}" role="img" aria-label="Map of the floor from above. ${summary}.">`;
    for (const cell of shown) {
      const value = this.value(cell);
      svg += `<rect x="${((cell[0] + margin) * unit).toFixed(1)}" y="${((cell[1] + margin) * unit).toFixed(1)}" width="${(unit + 0.3).toFixed(1)}" height="${(unit + 0.3).toFixed(1)}" fill="${colour(value)}" class="${value === null ? "grid" : ""}" data-cell="${cells.indexOf(cell)}"><title>${this.placeOf(cell)} m: ${text(value)}</title></rect>`;
    }
    const emitters = this.level.emitters.places, few = emitters.length / 6 <= 64;
    for (let e = 0; few && e < emitters.length / 6; ++e) {
      const [x, y] = at(emitters[6 * e], emitters[6 * e + 2]);
      svg += `<circle cx="${x.toFixed(1)}" cy="${y.toFixed(1)}" r="6" fill="#c24f00" stroke="#fff" stroke-width="1.5"><title>emitter ${escapeText(this.level.emitters.names[e] ?? "")}</title></circle>`;
    }
    // Doors are filled and portals are dashed, each as seen from above: the two longest of their sides.
    const across = (middle, sides, style, title) => {
      const [u, v] = [...sides].sort((a, b) => Math.hypot(b[0], b[2]) - Math.hypot(a[0], a[2]));
      const corners = [[1, 1], [1, -1], [-1, -1], [-1, 1]].map(([a, b]) => at(middle[0] + a * u[0] + b * v[0], middle[2] + a * u[2] + b * v[2]));
      svg += `<polygon points="${corners.map((c) => c.map((x) => x.toFixed(1)).join()).join(" ")}" ${style}><title>${escapeText(title)}</title></polygon>`;
    };
    for (const part of this.level.parts) across(part.centre, [part.u, part.v, part.w], 'fill="#00805d" stroke="#00805d" stroke-width="2.5" data-part=""', "movable part " + part.name);
    for (const portal of this.level.portals) across(portal.centre, [portal.u, portal.v], 'fill="none" stroke="#3c6edc" stroke-width="2.5" stroke-dasharray="5 3" data-portal=""', "portal " + portal.name);
    this.level.listeners.forEach((place, i) => {
      const [x, y] = at(place[0], place[2]);
      svg += `<circle cx="${x.toFixed(1)}" cy="${y.toFixed(1)}" r="9" fill="#fff" stroke="#d6006e" stroke-width="2"/><text x="${x.toFixed(1)}" y="${(y + 4).toFixed(1)}" text-anchor="middle" style="fill:#111;font-weight:600">${i + 1}</text>`;
    });
    const bar = [1, 2, 5, 10, 20, 50, 100].filter((metres) => metres / step * unit < wide / 3).pop() ?? 1, left = margin * unit, base = tall + 12;
    svg += `<path d="M${left} ${base - 4}v8M${left} ${base}h${bar / step * unit}v-4v8" class="axis" fill="none"/><text x="${left + bar / step * unit + 8}" y="${base + 4}">${bar} m</text></svg>`;
    document.getElementById("floor-picture").innerHTML = svg;
    for (const rect of document.querySelectorAll("#floor-picture [data-cell]"))
      rect.addEventListener("click", () => this.view.moveTo(cells[Number(rect.dataset.cell)].slice(3, 6)));
    const differences = known.length === 0 ? "" : `${((high - low) / kind.noticeable((high + low) / 2)).toFixed(1)} just-noticeable differences between the extremes.`;
    const shownName = `${kind.name}, ${this.octave.selectedOptions[0].text}`;
    document.getElementById("floor-legend").innerHTML = known.length === 0 ? `<p class="note">${summary}.</p>` :
      `<p class="note">${shownName}</p><span class="bar" style="display:block;height:.7rem;border-radius:2px;background: linear-gradient(90deg, ${kScale.map((c) => `rgb(${c})`).join()})"></span>` +
      `<span class="ends note"><span>${text(low)}</span><span>${text(high)}</span></span><p class="note">${differences} Seen from above, X to the right and Z down; numbered rings are listeners${few ? ", dots emitters" : ""}${this.level.parts.length > 0 ? ", green bars movable parts" : ""}${this.level.portals.length > 0 ? ", dashed lines portals" : ""}. Click a place to listen there.</p>`;
    document.getElementById("floor-table").innerHTML =
      tableHtml({title: summary, columns: ["place (m)", kind.name], rows: shown.map((cell) => [this.placeOf(cell), text(this.value(cell))])});
    this.view.paintMap(shown.map((cell) => [cell, this.value(cell)]).filter(([, value]) => value !== null).map(([cell, value]) =>
      ({x: lowX + (cell[0] + 0.5) * step, y: cell[6], z: lowZ + (cell[1] + 0.5) * step, half: step / 2, colour: scaleColour(shareOf(value))})));
  }
}
