"use strict";
// page.js: draws the document that C++ wrote into a page: its blocks, or the sections of a report.

// A chart, and a button that saves it as a file of its own.
function chartHtml(chart) {
  const svg = chart.levels_db !== undefined ? spectrogram(chart) : chart.parts !== undefined ? barChart(chart) : lineChart(chart);
  return `<div class="picture">${svg}<button type="button" class="save" aria-label="Save as SVG: ${escapeText(chart.title)}">Save as SVG</button></div>`;
}

// A folded table has its title above the fold, others have a caption. The first cells are headers.
function tableHtml({title, columns, rows, folded = false}) {
  const cell = (value, c) => {
    const text = typeof value === "string" ? escapeText(value) : shortNumber(value);
    return c === 0 ? `<th scope="row">${text}</th>` : `<td>${text}</td>`;
  };
  const table = `<div class="table"><table><caption${folded ? ' class="skip"' : ""}>${escapeText(title)}</caption><thead><tr>` +
    columns.map((column) => `<th scope="col">${escapeText(column)}</th>`).join("") + "</tr></thead><tbody>" +
    rows.map((row) => `<tr>${row.map(cell).join("")}</tr>`).join("") + "</tbody></table></div>";
  return folded ? `<details><summary>${escapeText(title)}</summary>${table}</details>` : table;
}

const kBlocks = {
  heading: (text) => `<h2>${escapeText(text)}</h2>`,
  subheading: (text) => `<h3>${escapeText(text)}</h3>`,
  paragraph: (text) => `<p>${escapeText(text)}</p>`,
  note: (text) => `<p class="note">${escapeText(text)}</p>`,
  claim: ({paper, ours}) => `<div class="claim"><div><b>The paper</b>${escapeText(paper)}</div><div class="ours"><b>Here</b>${escapeText(ours)}</div></div>`,
  charts: ({list, columns, caption}) => `<figure><div class="row" style="--columns: ${columns}">${list.map(chartHtml).join("")}</div>` +
    (caption === "" ? "" : `<figcaption>${escapeText(caption)}</figcaption>`) + "</figure>",
  table: tableHtml,
  html: (markup) => markup};

function pageHtml(contents) {
  const blocks = contents.blocks ?? reportBlocks(contents);
  return `<header><h1>${escapeText(contents.title)}</h1><p class="setting">${escapeText(contents.setting)}</p></header><main>` +
    blocks.map((block) => Object.entries(block).map(([kind, value]) => kBlocks[kind](value)).join("")).join("\n") + "</main>";
}

// The file has the page's stylesheet, so that it is light or dark by itself.
function saveAsSvg(button) {
  const svg = button.previousElementSibling.cloneNode(true), style = document.createElementNS(svg.namespaceURI, "style"), link = document.createElement("a");
  style.textContent = document.querySelector("style").textContent;
  svg.prepend(style);
  link.download = svg.getAttribute("aria-label").replace(/[^\w]+/g, "_") + ".svg";
  link.setAttribute("href", URL.createObjectURL(new Blob([new XMLSerializer().serializeToString(svg)], {type: "image/svg+xml"})));
  link.click();
}

if (typeof document !== "undefined") {
  const contents = JSON.parse(document.getElementById("contents").textContent);
  document.body.insertAdjacentHTML("afterbegin", pageHtml(contents));
  for (const button of document.querySelectorAll("button.save")) button.addEventListener("click", () => saveAsSvg(button));
  if (contents.level !== undefined) showLevel(contents.level);
}
