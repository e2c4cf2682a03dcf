"use strict";
// charts.js: charts as SVG, in the colours of the stylesheet (style.css).

const kLeft = 74, kTop = 40, kBottom = 56, kRight = 18;

function escapeText(text) {
  return String(text).replace(/[&<>"]/g, (c) => ({"&": "&amp;", "<": "&lt;", ">": "&gt;", "\"": "&quot;"})[c]);
}

// "24 576".
function grouped(n) { return n.toLocaleString("en").replaceAll(",", "\u202f"); }

// "63 Hz", "1 kHz".
function hertz(hz) { return hz < 1000 ? hz + " Hz" : hz / 1000 + " kHz"; }

// A number of an axis or a table: 0.25, 16 384, 3.2.
function shortNumber(value) {
  if (!Number.isFinite(value)) return "-";
  return Math.abs(value) >= 10000 && Number.isInteger(value) ? grouped(value) : String(Number(value.toPrecision(4)));
}

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
const highest = (values, least) => values.reduce((a, b) => Math.max(a, b), least);

// Viridis (S. van der Walt, N. Smith, 2015), at eighths.
const kScale = [[68, 1, 84], [70, 51, 127], [54, 92, 141], [39, 127, 142], [31, 161, 135], [74, 194, 109], [159, 218, 58], [253, 231, 37]];
function scaleColour(share) {
  const x = clamp(share, 0, 1) * (kScale.length - 1), k = Math.min(Math.floor(x), kScale.length - 2);
  return kScale[k].map((value, i) => Math.round(value + (x - k) * (kScale[k + 1][i] - value)));
}

// An axis over values: where it shows each of them, in pixels.
class Axis {
  constructor(values, {log = false, margin = true, range = null}, from, to) {
    Object.assign(this, {log, from, to});
    const shown = values.filter((value) => this.shows(value));
    [this.low, this.high] = shown.length === 0 ? [1, 2] : [-highest(shown.map((value) => -value), -Infinity), highest(shown, -Infinity)];
    if (log) {
      if (this.high / this.low < 1.1) this.low /= 1.5, this.high *= 1.5;
      if (margin) this.low /= 1.15, this.high *= 1.15;
    } else {
      if (this.high - this.low < 1e-9) this.low -= 0.5, this.high += 0.5;
      const beyond = margin ? 0.06 * (this.high - this.low) : 0;
      this.low -= beyond, this.high += beyond;
    }
    if (range !== null) [this.low, this.high] = range;
  }

  // Points that are no numbers, or not positive on a logarithmic axis, are left out.
  shows(value) { return Number.isFinite(value) && (!this.log || value > 0); }

  at(value) {
    const share = this.log ? Math.log(value / this.low) / Math.log(this.high / this.low) : (value - this.low) / (this.high - this.low);
    return this.from + share * (this.to - this.from);
  }

  // Round numbers.
  ticks() {
    const {low, high} = this, ticks = [];
    if (this.log) {
      const digits = Math.log10(high / low) > 3 ? [1] : [1, 2, 5];
      for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); ++power)
        ticks.push(...digits.map((digit) => digit * 10 ** power).filter((tick) => tick >= low * 0.999 && tick <= high * 1.001));
      return ticks;
    }
    const rough = (high - low) / 6, power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((digit) => digit * power).filter((one) => one <= rough * 1.2).pop() ?? power;
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; ++i) ticks.push(i * step);
    return ticks;
  }
}

function svgText(x, y, text, how = "") { return `<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" ${how}>${escapeText(text)}</text>`; }
function svgLine(x1, y1, x2, y2, how) { return `<line x1="${x1.toFixed(1)}" y1="${y1.toFixed(1)}" x2="${x2.toFixed(1)}" y2="${y2.toFixed(1)}" ${how}/>`; }
function svgBox(x, y, width, height, how) { return `<rect x="${x.toFixed(1)}" y="${y.toFixed(1)}" width="${width.toFixed(1)}" height="${height.toFixed(1)}" ${how}/>`; }
const kMiddle = 'text-anchor="middle"', kEnd = 'text-anchor="end"';

// A chart with what is inside its frame.
function svgChart({title, x_label, y_label, width, height}, right, inside) {
  return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${width} ${height}" width="${width}" height="${height}" class="chart" role="img" aria-label="${escapeText(title)}">` +
    svgText(kLeft, 24, title, 'class="title"') + inside + svgText((kLeft + right) / 2, height - 16, x_label, kMiddle) +
    `<text transform="translate(18 ${((kTop + height - kBottom) / 2).toFixed(1)}) rotate(-90)" ${kMiddle}>${escapeText(y_label)}</text></svg>`;
}

// Width of a legend with these names: letters of 11 px are 6 px wide on average.
function legendWidth(names) { return names.length < 2 ? 0 : Math.min(190, 52 + 6 * Math.max(...names.map((name) => name.length))); }

function valueAxis(y, left, right) {
  return y.ticks().map((tick) => svgLine(left, y.at(tick), right, y.at(tick), 'class="grid"') + svgText(left - 8, y.at(tick) + 4, shortNumber(tick), kEnd)).join("");
}

function pathOf(points, x, y, over) {
  return points.map(([px, py], i) => `${i === 0 ? "M" : "L"}${x.at(px).toFixed(1)} ${clamp(y.at(py), y.to - over, y.from + over).toFixed(1)}`).join("");
}

function seriesSvg({look, points}, x, y, colour) {
  const shown = points.filter(([px, py]) => x.shows(px) && y.shows(py));
  if (shown.length === 0) return "";
  const dots = look !== "dots" ? [] : shown.map(([px, py]) => `<circle cx="${x.at(px).toFixed(1)}" cy="${y.at(py).toFixed(1)}" r="3" class="${colour} dot"/>`);
  return `<path d="${pathOf(shown, x, y, 2)}" class="${colour} line ${look}"/>` + dots.join("");
}

// Labels that do not fit would overprint the next; letters are about half as wide as high.
function zoneSvg({from, to, label}, x, y) {
  const left = clamp(x.at(from), x.from, x.to), wide = clamp(x.at(to), x.from, x.to) - left;
  if (!(wide > 0)) return "";
  return svgBox(left, y.to, wide, y.from - y.to, 'class="zone"') +
    (5.5 * label.length < wide ? svgText(left + wide / 2, y.to + 14, label, `${kMiddle} class="small zone-label"`) : "");
}

// Series of points [x, y]. A series without a colour has the next of the palette; `ribbon` is a range of
// y, [x, low, high], and zones are ranges of x in the background.
function lineChart(given) {
  const chart = {width: 760, height: 400, log_x: false, log_y: false, x_ticks: [], y_range: null, zones: [], ribbon: [], ...given};
  const {width, height, series, zones, ribbon} = chart, names = series.map((one) => one.name ?? "").filter((name) => name !== "");
  const x = new Axis(series.flatMap((one) => one.points.map((point) => point[0])), {log: chart.log_x, margin: chart.log_x}, kLeft, width - kRight - legendWidth(names));
  const y = new Axis([...series.flatMap((one) => one.points.map((point) => point[1])), ...ribbon.flatMap(([, low, high]) => [low, high])],
    {log: chart.log_y, range: chart.y_range}, height - kBottom, kTop);
  let svg = zones.map((zone) => zoneSvg(zone, x, y)).join("");
  if (ribbon.length > 0)
    svg += `<path d="${pathOf([...ribbon.map(([at, , high]) => [at, high]), ...ribbon.map(([at, low]) => [at, low]).reverse()], x, y, 0)}Z" class="ribbon"/>`;
  for (const tick of chart.x_ticks.length > 0 ? chart.x_ticks.filter((one) => x.at(one) >= x.from && x.at(one) <= x.to) : x.ticks())
    svg += svgLine(x.at(tick), y.from, x.at(tick), y.to, 'class="grid"') + svgText(x.at(tick), y.from + 18, shortNumber(tick), kMiddle);
  svg += valueAxis(y, x.from, x.to);
  if (!y.log && y.low < 0 && y.high > 0) svg += svgLine(x.from, y.at(0), x.to, y.at(0), 'class="axis"');
  svg += svgLine(x.from, y.from, x.to, y.from, 'class="axis"') + svgLine(x.from, y.from, x.from, y.to, 'class="axis"');
  let turn = 0, legend = y.to + 10;
  for (const one of series) {
    const colour = one.colour ?? `s${turn++ % 9}`;
    svg += seriesSvg(one, x, y, colour);
    if (names.length < 2 || (one.name ?? "") === "") continue;
    svg += svgLine(x.to + 14, legend, x.to + 38, legend, `class="${colour} line ${one.look}"`) + svgText(x.to + 44, legend + 4, one.name, 'class="small"');
    legend += 18;
  }
  return svgChart(chart, x.to, svg);
}

// Columns of stacked bars; `parts` from the bottom, each with a value per column.
function barChart(given) {
  const chart = {width: 560, height: 340, ...given}, {columns, parts, width, height} = chart;
  const totals = columns.map((_, c) => parts.reduce((sum, part) => sum + part.values[c], 0)), right = width - kRight - legendWidth(parts.map((part) => part.name));
  const y = new Axis([], {range: [0, highest(totals, 0) || 1]}, height - kBottom, kTop), step = (right - kLeft) / Math.max(1, columns.length);
  let svg = valueAxis(y, kLeft, right) + columns.map((title, c) => svgText(kLeft + (c + 0.5) * step, y.from + 18, title, kMiddle)).join("");
  const below = columns.map(() => 0);
  let legend = y.to + 10 + 18 * (parts.length - 1);  // in the order of the stack
  parts.forEach(({name, values, colour = null}, p) => {
    const how = `class="${colour ?? `s${p % 9}`} bar"`;
    values.forEach((value, c) => {
      const from = y.at(below[c]), to = y.at(below[c] += value);
      if (from - to > 0.05) svg += svgBox(kLeft + (c + 0.17) * step, to, 0.66 * step, from - to, how);
    });
    if (parts.length > 1) svg += svgBox(right + 16, legend - 6, 12, 12, how) + svgText(right + 34, legend + 4, name, 'class="small"');
    legend -= 18;
  });
  return svgChart(chart, right, svg + svgLine(kLeft, y.from, right, y.from, 'class="axis"'));
}

// Levels of thirds of an octave from 31.5 Hz on, [column][band], in 20 shades of 3 dB below the loudest.
function spectrogram({title, column_s, length_s, levels_db}) {
  const width = 760, height = 330, right = width - 90, wide = right - kLeft, high = height - kTop - kBottom, shades = 20, bands = 29;
  const loudest = 3 * Math.ceil(highest(levels_db.flat(), -200) / 3), columns = Math.max(1, levels_db.length);
  const shadeOf = (level) => clamp(Math.floor(((level - loudest) / 60 + 1) * shades), 0, shades - 1);
  const fill = (shade) => `fill="rgb(${scaleColour(shade / (shades - 1))})"`;
  const paths = Array.from({length: shades}, () => "");  // of runs along a band, in columns and bands
  for (let b = 0; b < bands; ++b)
    for (let c = 0, end; c < levels_db.length; c = end) {
      const shade = shadeOf(levels_db[c][b]);
      for (end = c + 1; end < levels_db.length && shadeOf(levels_db[end][b]) === shade;) ++end;
      if (shade > 0) paths[shade] += `M${c} ${bands - 1 - b}h${end - c}v1H${c}z`;
    }
  paths[0] = `M0 0h${columns}v${bands}H0z`;
  let svg = `<g shape-rendering="crispEdges" transform="translate(${kLeft} ${kTop}) scale(${(wide / columns).toFixed(6)} ${(high / bands).toFixed(6)})">` +
    paths.map((path, shade) => path === "" ? "" : `<path ${fill(shade)} d="${path}"/>`).join("") + "</g>";
  [63, 125, 250, 500, 1000, 2000, 4000, 8000, 16000].forEach((hz, octave) => {
    svg += svgText(kLeft - 8, kTop + high * (1 - (3 * octave + 3.5) / bands) + 4, shortNumber(hz), kEnd);
  });
  const decade = 10 ** Math.floor(Math.log10(Math.max(length_s, 1e-3) / 4));  // the longest of 1, 2 and 5 that gives four ticks
  const tick = [1, 2, 5].map((digit) => digit * decade).filter((one) => 4 * one <= length_s).pop() ?? decade;
  for (let i = 0; i * tick <= length_s * 1.0001; ++i) svg += svgText(kLeft + wide * i * tick / Math.max(column_s * columns, 1e-9), kTop + high + 18, shortNumber(i * tick), kMiddle);
  for (let shade = 0; shade < shades; ++shade) svg += svgBox(right + 12, kTop + high * (1 - (shade + 1) / shades), 14, high / shades + 0.5, fill(shade));
  for (let shade = 0; shade <= shades; shade += 5) svg += svgText(right + 32, kTop + high * (1 - shade / shades) + 4, `${loudest + 3 * shade - 60} dB`);
  return svgChart({title, x_label: "time (s)", y_label: "Hz", width, height}, right, svg);
}
