"use strict";
// report.js: the sections of clamor report, from what C++ measured (report_document.cpp).

const kSmall = {width: 420, height: 290}, kSpeechBand = 4;  // 1 kHz
const kMeanings = {
  t30_s: "reverberation time", edt_s: "early decay time", c80_db: "clarity of music", d50: "definition of speech", g_db: "strength, the level"};

const counted = (n, thing) => `${grouped(n)} ${thing}${n === 1 ? "" : "s"}`;
const percent = (share, digits = 1) => `${(100 * share).toFixed(digits)} %`;
const placeText = (place) => place.map((x) => x.toFixed(1)).join(", ");
const listenerTitle = ({place_m}, i) => `Listener ${i + 1} at ${placeText(place_m)} m`;
const titleOf = ({name, unit}) => unit === "" ? name : `${name} (${unit})`;
const noticeableAt = (kind, value) => kind.is_share ? kind.noticeable * value : kind.noticeable;
const sum = (values) => values.reduce((a, b) => a + b, 0);
const numberOr = (text, value, digits) => Number.isFinite(value) ? value.toFixed(digits) : text;
// A mean of several places in fewer digits than a measured value.
const meanText = (kind, value) => `${value.toFixed(kind.is_share ? 2 : kind.digits - 1)}${kind.unit === "" ? "" : ` ${kind.unit}`}`;

// The kinds of a summary that have a mean.
function summarised({kinds, middle, is_crowd}) {
  return kinds.filter(({key}) => kMeanings[key] !== undefined && middle[key] !== null && (!is_crowd || key === "t30_s" || key === "g_db"))
    .sort((a, b) => Object.keys(kMeanings).indexOf(a.key) - Object.keys(kMeanings).indexOf(b.key));
}

// What the room sounds like in a sentence, and in figures.
function answer(report) {
  const {middle, other, bass_ratio, listeners} = report, lost = report.bake.power.through_openings + report.bake.power.through_walls;
  const warnings = report.level.findings.filter(isWarning).length;
  const verdict = warnings > 0 ? `The bake warns of ${warnings === 1 ? "one thing" : `${warnings} things`}.`
    : report.is_mostly_open ? `${percent(lost, 0)} of the power left it. The bake warns of nothing else.` : "The bake found nothing wrong with the level.";
  const facts = summarised(report).map((kind) => {
    const there = other?.middle[kind.key] ?? null;
    return [meanText(kind, middle[kind.key]), `${kind.name}, ${kMeanings[kind.key]}${there === null ? "" : `; ${meanText(kind, there)} in ${other.file}`}`];
  });
  if (bass_ratio !== null) facts.push([bass_ratio.toFixed(2), "bass ratio: T30 below 350 Hz over that above"]);
  facts.push([percent(lost), `of the power left the level${report.lost_ways === "" ? "" : `, ${report.lost_ways}`}`]);
  return [
    {html: `<p class="headline">${escapeText(`${report.described} ${verdict}`)}</p><ul class="facts">` +
      facts.map(([value, words]) => `<li><b>${escapeText(value)}</b><span>${escapeText(words)}</span></li>`).join("") + "</ul>"},
    {note: `Means over ${counted(listeners.length, "listener")} and the octaves of 500 Hz and 1 kHz, for an impulse from ${report.excitation}.`}];
}

const kFindings = {warning: "Warning", fact: "Fine", opening: "Opening", gap: "Thin gap", duplicate: "Twice there"};
const isWarning = ({kind}) => kind === "warning" || kind === "duplicate";

function comparison({kinds, middle, other}) {
  const steps = summarised({kinds, middle}).filter(({key}) => other.middle[key] !== null).flatMap((kind) => {
    const here = middle[kind.key], there = other.middle[kind.key], step = (there - here) / noticeableAt(kind, here);
    return Number.isFinite(step) ? [`${kind.name} is ${meanText(kind, there)} (${signed(step)})`] : [];
  });
  return `In ${other.file} ${steps.join(", ")}; in brackets the difference from this bake in just-noticeable differences.`;
}
const signed = (value) => `${value < 0 ? "" : "+"}${value.toFixed(1)}`;

// What rings, warnings, openings and gaps, each with a button that shows its place in the view.
function findings(report) {
  const {thin_gaps} = report.bake.findings, list = report.level.findings, gaps = list.filter(({kind}) => kind === "gap"), hidden = new Set(gaps.slice(5));
  const item = (kind, text, how = "", button = "<span></span>") => `<li${how}><span class="kind">${kind}</span><span>${escapeText(text)}</span>${button}</li>`;
  const items = report.cause === "" ? [] : [item("What rings", report.cause)];
  list.forEach((finding, i) => {
    if (hidden.has(finding)) return;
    const {kind, text, place} = finding, how = isWarning(finding) ? ' class="wrong"' : kind === "fact" ? ' class="fine"' : "";
    items.push(item(kFindings[kind], text, how, place === undefined ? undefined
      : `<button type="button" data-finding="${i}" aria-label="Show in the view: ${escapeText(text)}">Show in the view</button>`));
  });
  if (hidden.size > 0)
    items.push(item("Thin gap", `and ${thin_gaps - 5} more; ${gaps.length} ${gaps.length < thin_gaps ? "of them are" : "are"} in the view`));
  if (report.other !== undefined) items.push(item("Compared", comparison(report)));
  return [{html: `<ul class="findings" aria-label="Findings">${items.join("")}</ul>`}];
}

// Charts of the parameters over frequency, and what listeners differ by.
function parameters(report) {
  const {kinds, bands_hz, listeners, other} = report, octaves = bands_hz.map(hertz);
  const overBands = (values) => bands_hz.map((hz, b) => [hz, values[b]]);
  const chartOf = (kind) => {
    const ribbon = bands_hz.flatMap((hz, b) => {
      const known = listeners.map((one) => one.parameters[kind.key][b]).filter((value) => value !== null), mean = sum(known) / known.length;
      return known.length === 0 ? [] : [[hz, mean - noticeableAt(kind, mean), mean + noticeableAt(kind, mean)]];
    });
    const lines = (measured, look) => measured.map((one, i) => ({look, colour: `s${i}`, points: overBands(one.parameters[kind.key])}));
    return {...kSmall, title: titleOf(kind), x_label: "octave (Hz)", y_label: titleOf(kind), log_x: true, x_ticks: bands_hz, ribbon,
      series: [...lines(listeners, "dots"), ...lines(other?.listeners ?? [], "dashes")]};
  };
  // The bass of the decay against its middle: what a designer mends first.
  const decay = {...kSmall, title: "Decay over frequency", x_label: "octave (Hz)", y_label: "T30 over its mean at 500 Hz and 1 kHz", log_x: true, x_ticks: bands_hz,
    series: listeners.map(({parameters: {t30_s}, t30_middle_s}, i) => ({look: "dots", colour: `s${i}`,
      points: overBands(t30_s.map((value) => value === null || t30_middle_s === null ? null : value / t30_middle_s))}))};
  const tables = listeners.flatMap((one, i) => {
    const measured = {table: {title: listenerTitle(one, i), columns: ["parameter", ...octaves, "noticeable"], folded: i > 0, rows: kinds.map((kind) => [
      titleOf(kind), ...one.parameters[kind.key].map((value) => numberOr("-", value, kind.digits)),
      kind.is_share ? percent(kind.noticeable, 0) : `${kind.noticeable} ${kind.unit}`.trim()])}};
    if (other === undefined) return [measured];
    const differences = kinds.map((kind) => [kind.name, ...one.parameters[kind.key].map((here, b) => {
      const there = other.listeners[i].parameters[kind.key][b], step = (there - here) / noticeableAt(kind, here);
      return here === null || there === null || !Number.isFinite(step) ? "-" : signed(step);
    })]);
    return [measured, {table: {title: `${listenerTitle(one, i)} in ${other.file}: difference in just-noticeable differences`,
      columns: ["parameter", ...octaves], rows: differences, folded: i > 0}}];
  });
  const legend = listeners.map(({place_m}, i) => `<span class="swatch s${i}"></span>listener ${i + 1}: ${placeText(place_m)} m &emsp;`).join("");
  return [
    {heading: "What it sounds like"},
    {html: `<p class="note">${legend}${other === undefined ? "" : escapeText(`lines: ${report.file}, dashes: ${other.file}`)}</p>`},
    {charts: {list: [...Object.keys(kMeanings).map((key) => chartOf(kinds.find((kind) => kind.key === key))), decay], columns: 3,
      caption: `Room parameters of ISO 3382-1 in octaves${other === undefined ? "" : `, dashed those of ${other.file}`}. ` +
        "Listeners who differ by less than the grey band hear the same: it is one just-noticeable difference either way of their mean."}},
    ...tables,
    {table: {title: "What the bake measured while tracing, as clamor inspect prints it", columns: ["acoustics", ...octaves], rows: report.acoustics, folded: true}}];
}

function decayOf({decay}, bands_hz) {
  const levels_db = floats(decay.levels_db), steps = levels_db.length / 8 - 1, time = (i) => decay.end_s * i / steps;
  const series = bands_hz.map((hz, b) => {
    const points = Array.from({length: steps + 1}, (_, i) => [time(i), levels_db[b * (steps + 1) + i]]), end = points.findIndex(([, level]) => level < -64);
    return {name: hertz(hz), look: "line", colour: `b${b}`, points: end < 0 ? points : points.slice(0, end)};
  });
  const rows = Array.from({length: 21}, (_, row) => {
    const i = row * steps / 20, levels = bands_hz.map((_, b) => levels_db[b * (steps + 1) + i]);
    return [time(i).toFixed(2), ...levels.map((level) => level > -100 ? level.toFixed(1) : "-")];
  });
  return [
    {...kSmall, title: "Energy decay", x_label: "time after the direct sound (s)", y_label: "energy still to come (dB)", y_range: [-60, 0], series},
    {title: "The energy decay as a table (dB)", columns: ["time (s)", ...bands_hz.map(hertz)], rows, folded: true}];
}

function echogramOf({echogram}) {
  const shares = floats(echogram.shares), bin = echogram.bin_ms, floor = -70, perRow = 10;
  const points = Array.from(shares).flatMap((share, i) => {
    const level = Math.max(floor, 10 * Math.log10(share));
    return [[bin * i, level], [bin * (i + 1), level]];
  });
  const rows = Array.from({length: shares.length / perRow}, (_, r) => [
    (bin * perRow * r).toFixed(0), (bin * perRow * (r + 1)).toFixed(0), numberOr("-", 10 * Math.log10(sum(shares.slice(perRow * r, perRow * (r + 1)))), 1)]);
  return [
    {...kSmall, title: "Echogram, 1 kHz", x_label: "time after the direct sound (ms)", y_label: "energy (dB)", y_range: [floor, 0],
      zones: [{from: 0, to: 80, label: "early"}, {from: 80, to: bin * shares.length, label: "late"}], series: [{look: "line", colour: "s1", points}]},
    {title: "The echogram as a table", columns: ["from (ms)", "to (ms)", "energy (dB)"], rows, folded: true}];
}

// Lowest and highest sample of each column of the chart.
function waveformOf({waveform}) {
  const extremes = floats(waveform.extremes), columns = extremes.length / 2, perRow = 25;
  const msAt = (column) => waveform.from_ms + waveform.length_ms * column / columns;
  const points = Array.from(extremes, (value, i) => [msAt(Math.floor(i / 2)), value]);
  const rows = Array.from({length: columns / perRow}, (_, r) => {
    const some = [0, ...extremes.slice(2 * perRow * r, 2 * perRow * (r + 1))];
    return [msAt(perRow * r).toFixed(1), msAt(perRow * (r + 1)).toFixed(1), Math.min(...some).toFixed(4), Math.max(...some).toFixed(4)];
  });
  return [
    {...kSmall, title: "Impulse response", x_label: "time after emission (ms)", y_label: "pressure", series: [{look: "thin", colour: "s1", points}]},
    {title: "The impulse response as a table", columns: ["from (ms)", "to (ms)", "lowest", "highest"], rows, folded: true}];
}

// What each listener hears: decay, echogram and impulse response.
function atListeners({listeners, excitation, bands_hz, bake}) {
  const {sources} = listeners[0], {total} = bake.sources;
  const blocks = [{heading: "At the listeners"}, {paragraph: `An impulse from ${excitation}. ` + (sources < Math.floor(total / 2)
    ? `Each response is that of ${counted(sources, "source")} of the file's ${grouped(total)}, a fair sample chosen for the place: energies are right on average. --exact takes all.`
    : "Each response is that of all sources.")}];
  listeners.forEach((one, i) => {
    blocks.push({subheading: listenerTitle(one, i)});
    if (one.decay === undefined) {
      blocks.push({paragraph: "Nothing is heard there."});
      return;
    }
    const shown = [decayOf(one, bands_hz), echogramOf(one), waveformOf(one)];
    blocks.push({charts: {list: shown.map(([chart]) => chart), columns: 3, caption: i > 0 ? ""
      : "Left: Schroeder's backward integral of the energies; a straight line is an even decay, a knee two rooms in one. " +
        `Middle: energy at 1 kHz in steps of ${one.echogram.bin_ms} ms, relative to all of it. Right: an impulse response with these energies; 1 is the emitter at 1 m.`}});
    blocks.push(...shown.map(([, table]) => ({table})));
  });
  return blocks;
}

// The map itself is drawn by floor.js.
function overTheFloor({level, kinds, listeners, map_sources, map_at_first}) {
  if (level.map.cells.length === 0) return [];
  const differences = ["t30_s", "c80_db", "g_db"].flatMap((key) => {
    const kind = kinds.find((one) => one.key === key), full = listeners[0].parameters[key].slice(1, 7);
    const steps = full.map((value, b) => value === null || map_at_first[key][b + 1] === null ? NaN
      : (map_at_first[key][b + 1] - value) / noticeableAt(kind, value)).filter(Number.isFinite);
    return steps.length === 0 ? [] : [`${Math.sqrt(sum(steps.map((step) => step ** 2)) / steps.length).toFixed(1)} (${kind.name})`];
  });
  return [{heading: "Over the floor"}, {html: '<div id="floor"></div>'},
    {note: `${counted(level.map.cells.length, "place")} at ear height, ${level.map.step} m apart; each value from ${counted(map_sources, "source")} ` +
      `chosen for the place, heard in straight lines. At listener 1 that differs from the full measurement by ${differences.join(", ")} ` +
      "just-noticeable differences (root mean square of 125 Hz to 4 kHz)."}];
}

// Movable parts and portals.
function doors({level: {parts, portals, origin}, bake: {materials}}) {
  if (parts.length + portals.length === 0) return [];
  const worldPlace = (place) => placeText(place.map((x, i) => x + origin[i]));
  const sides = (...halves) => halves.map((half) => (2 * Math.hypot(...half)).toFixed(2)).join(" x ");
  const passing = (m) => {
    const through = materials[m].transmission[kSpeechBand];
    return `${materials[m].name} (lets ${through > 0 ? `${(10 * Math.log10(through)).toFixed(0)} dB` : "nothing"} through${through > 0 ? " at 1 kHz" : ""})`;
  };
  const rows = parts.map((part, p) => [part.name, "movable part", worldPlace(part.centre), sides(part.u, part.v, part.w),
    [...part.materials.map(passing), ...portals.filter((portal) => portal.parts.includes(p)).map(({name}) => `opens and closes '${name}'`)].join(", ")]);
  rows.push(...portals.map((portal) => [portal.name, "portal", worldPlace(portal.centre), sides(portal.u, portal.v),
    (portal.baked_closed ? "baked open and closed" : "baked open") +
      (portal.parts.length === 0 ? "" : `, opened and closed by ${portal.parts.map((p) => `'${parts[p].name}'`).join(", ")}`)]));
  return [{heading: "Doors and portals"},
    {paragraph: `The level has ${counted(parts.length, "movable part")} and ${counted(portals.length, "portal")}. ` +
      "All figures of this page are for parts at rest and open portals; clamor view opens and closes them."},
    {table: {title: "Movable parts and portals: the place of their middle, and their size", columns: ["name", "kind", "place (m)", "size (m)", "what it is"],
      rows, folded: rows.length > 12}}];
}

// Materials by their absorption, and where sound is absorbed.
function materials({materials: met, bake: {power, photons}, bands_hz}) {
  const heading = {heading: "What absorbs the sound"};
  if (met.length === 0)
    return [heading, {paragraph: photons.bounces === 0 ? "Sound met no surfaces." : "The bake was made by an older program, which did not count it: bake again."}];
  const shown = met.slice(0, 7), shortName = ({name}) => name.length > 24 ? name.slice(0, 21) + "..." : name;
  const shares = (powers) => powers.map((value, b) => power.emitted[b] > 0 ? 100 * value / power.emitted[b] : 0);
  const taken = met.map(({dissipated}) => shares(dissipated)), left = shares(power.escaped), unfinished = shares(power.unfinished);
  const total = (list) => bands_hz.map((_, b) => sum(list.map((values) => values[b]))), absorbed = total(taken);
  const parts = shown.map((one, i) => ({name: shortName(one), values: taken[i]}));
  if (met.length > shown.length) parts.push({name: "all others", values: total(taken.slice(shown.length)), colour: "grey"});
  // The photons are a sample, so that what is left for the air may be a little below nothing.
  parts.push({name: "air", values: absorbed.map((value, b) => Math.max(0, 100 - left[b] - unfinished[b] - value)), colour: "s7"});
  const {through_walls, through_openings} = power;
  if (through_walls + through_openings > 0)
    parts.push({name: !(through_walls > 0) ? "left through openings" : !(through_openings > 0) ? "left through walls" : "left the level", values: left, colour: "s8"});
  const arrived = sum(met.map((one) => one.arrived[kSpeechBand])), octaves = bands_hz.map(hertz);
  const rows = met.map((one) => [
    one.name, arrived > 0 ? (100 * one.arrived[kSpeechBand] / arrived).toFixed(1) : "", ...one.absorption.map((share) => share.toFixed(2))]);
  return [heading,
    {charts: {list: [
      {width: 560, height: 340, title: "Absorption by material", x_label: "octave (Hz)", y_label: "share absorbed", log_x: true, x_ticks: bands_hz, y_range: [0, 1],
        series: shown.map((one) => ({name: shortName(one), look: "line", points: one.absorption.map((share, b) => [bands_hz[b], share])}))},
      {title: "Where sound is absorbed", x_label: "octave (Hz)", y_label: "share of the power (%)", columns: bands_hz.map(shortNumber), parts}], columns: 2,
    caption: `The ${counted(shown.length, "material")} that absorb most. Right: where the power of the emitters went, as the photons of the bake met surfaces.`}},
    {table: {title: "Materials by what they absorb: the share of the sound that meets them, and what they absorb of that",
      columns: ["material", "met at 1 kHz (%)", ...octaves], rows, folded: met.length > 12}}];
}

// The file: power by depth, bytes, and how it was made.
function theFile({bake: {octree, instanced, bytes}, making, bands_hz}) {
  const parts = octree.map(({power_share}, d) => ({name: d === 0 ? "depth 0, the first page" : `depth ${d}`, values: power_share.map((share) => 100 * share)}));
  if (instanced.trees > 0) parts.push({name: "in instances", values: instanced.power_share.map((share) => 100 * share)});
  const sections = ["pages", "signals", "geometry", "root"], size = {height: 300};
  return [{heading: "The file"},
    {charts: {list: [
      {...size, title: "Power by octree depth", x_label: "octave (Hz)", y_label: "share of the power (%)", columns: bands_hz.map(shortNumber), parts},
      {...size, title: "Bytes by section", x_label: "section", y_label: "MB", columns: sections,
        parts: [{name: "bytes", values: sections.map((section) => bytes[section] / 1e6), colour: "s1"}]}], columns: 2,
    caption: "Left: how much of the sound a player knows as it reads deeper. Right: where the bytes are."}},
    {table: {title: "Power by octree depth (%)", columns: ["depth", ...bands_hz.map(hertz)], folded: true,
      rows: parts.map(({name, values}) => [name, ...values.map((share) => share.toFixed(1))])}},
    {table: {title: "Bytes by section", columns: ["section", "MB", "% of file"], folded: true,
      rows: [...sections, "file"].map((section) => [section, (bytes[section] / 1e6).toFixed(2), (100 * bytes[section] / bytes.file).toFixed(1)])}},
    {html: '<div class="words">'}, {table: {title: "How it was made", columns: ["what", "how"], rows: making}}, {html: "</div>"}];
}

function reportBlocks(report) {
  return [answer, findings, () => [{html: kViewMarkup}], parameters, atListeners, overTheFloor, doors, materials, theFile].flatMap((section) => section(report));
}

function showLevel(contents) {
  const level = readLevel(contents), view = new View(level);
  view.floor = new FloorMap(level, view);
  window.clamorView = view;
}
