// Draws a comparison of benchmark reports: their origins, a line per row and report, and all figures.
"use strict";

const { reports, rows, confidence, tolerance } =
  JSON.parse(document.getElementById("report").textContent);
const hasRatios = reports.length > 1;
const find = (selector) => document.querySelector(selector);
const percent = (ratio) => `${formatNumber(100 * ratio)}%`.replace(/\.0+(?=\D)/, "");
const reportClass = (index) => `report-${index % 6}`;
const letterOf = (index) => String.fromCharCode(65 + index);
const drawLetter = (index) => html("span", { class: `letter ${reportClass(index)}` }, letterOf(index));

const rangeText = (low, high) => `${formatNumber(low)} to ${formatNumber(high)}`;

// Converts 2026-11-27T10:00:26Z to 2026-11-27 10:00 UTC.
const formatDate = (date) => date.replace("T", " ").replace(/:\d\d(\.\d+)?Z$/, " UTC");

function drawSummary({ common, rows: count, mean_ratio: ratio, why_not: reason, ...verdicts }, index) {
  if (index === 0) return plural(count, "row") + ".";
  const start = `${plural(count, "row")}, ${formatCount(common)} of them with times in A`;
  if (!common) return start + ".";
  const words = ["faster", "slower", "same", "undecided"].filter((name) => verdicts[name])
    .map((name) => `${formatCount(verdicts[name])} ${name}`);
  return `${start}: ${formatNumber(ratio)} times A’s frame time (geometric mean)` +
         (reason ? `. No verdicts, since ${reason}.` : words.length ? `; ${words.join(", ")}.` : ".");
}

function drawReport(report, index) {
  const commit = report.commit.slice(0, 12), isChanged = report.commit.endsWith("-dirty");
  const entries = {
    Date: formatDate(report.date),
    Program: `glint ${report.glint}` + (commit ? `, ${commit}` : "") + (isChanged ? ", changed" : ""),
    Device: report.device + (report.board ? ` (${report.board})` : ""),
    Platform: report.platform,
    Driver: report.driver,
    Host: report.host || "unknown",
  };
  return html("article", { class: reportClass(index) },
    html("h2", {}, drawLetter(index), report.file),
    html("dl", { class: "device" },
         ...Object.entries(entries).flatMap(([term, words]) => [html("dt", {}, term), html("dd", {}, words)])),
    html("p", {}, drawSummary(report, index)));
}

// Returns the cells' positions on the axis, relative to the first report's median if there are several, else in milliseconds.
function placesOf(row, measure) {
  const base = hasRatios ? row.cells[0][measure]?.median : 1;
  return row.cells.map((cell) => {
    const time = cell[measure];
    if (!base || !time) return null;
    const { median, lower_quartile: lower = median, upper_quartile: upper = median } = time;
    return { median: median / base, lower: lower / base, upper: upper / base };
  });
}

// Returns ticks and positions in percent. Small differences are not stretched to the whole axis.
function layOut(places) {
  const values = places.flat().flatMap((place) => (place ? [place.lower, place.upper] : []));
  if (hasRatios) values.push(0.9, 1.1);
  const low = Math.min(...values), high = Math.max(...values);
  const ticks = high < 3 * low && hasRatios ? stepTicks(low, high) : decadeTicks(low, high);
  return { ticks, x: logarithmic(ticks[0], ticks.at(-1), 2, 98) };
}

function drawAxis({ ticks, x }) {
  const isCrowded = ticks.length > 9;
  const labeled = ticks.filter((tick) => !isCrowded || String(tick).replace(/e.*/, "").includes("1"));
  const labels = labeled.filter((tick, i) => labeled.length <= 9 || i % 2 === 0);
  const middle = Math.max(0, labels.indexOf(1));
  return svg("svg", { "aria-hidden": "true" }, ...labels.map((tick, i) =>
    svg("text", { x: `${x(tick)}%`, y: 14, "text-anchor": "middle", class: (i - middle) % 2 ? "minor" : "" },
        tick >= 0.001 && tick < 1e5 ? String(tick) : formatNumber(tick))));
}

function drawBar(place, label, { ticks, x }) {
  const line = (at, type) => svg("line", { class: type, x1: `${x(at)}%`, x2: `${x(at)}%`, y1: 0, y2: "100%" });
  const lines = ticks.map((tick) => line(tick, hasRatios && tick === 1 ? "base" : ""));
  if (!place) return svg("svg", { "aria-hidden": "true" }, ...lines);
  const { median, lower, upper } = place;
  return svg("svg", { role: "img", "aria-label": label }, ...lines,
    svg("title", {}, label),
    hasRatios ? svg("line", { class: "away", x1: `${x(1)}%`, x2: `${x(median)}%`, y1: "50%", y2: "50%" }) : "",
    svg("rect", { x: `${x(lower)}%`, y: "20%", width: `${x(upper) - x(lower)}%`, height: "60%", rx: 1 }),
    svg("circle", { cx: `${x(median)}%`, cy: "50%", r: 4 }));
}

// Draws cells with the ratio to the first report, and its interval and verdict where there are any.
function drawRatio(cell, measure) {
  const { ratio, low, high, verdict = "" } = (measure === "frame_ms" ? cell.comparison : { ratio: cell.kernel_ratio }) ?? {};
  if (!ratio) return [html("td"), html("td")];
  return [
    html("td", {}, formatNumber(ratio), verdict && html("span", { class: "interval" }, ` (${rangeText(low, high)})`)),
    html("td", { class: `verdict ${verdict}` }, verdict),
  ];
}

function drawLine(row, index, place, measure, layout) {
  const cell = row.cells[index], time = cell[measure];
  const line = html("tr", { class: reportClass(index) }, html("th", { scope: "row" }, drawLetter(index)));
  if (!time) {
    line.append(html("td", { class: "words", colspan: hasRatios ? 4 : 2 }, cell.reason ?? "no time"));
    return line;
  }
  const label = `${letterOf(index)}: ${formatMs(time.median)}` + (time.lower_quartile === undefined ? "" :
    `, quartiles ${rangeText(time.lower_quartile, time.upper_quartile)}`);
  line.append(html("td", { class: "plot" }, drawBar(place, label, layout)), html("td", {}, formatNumber(time.median)));
  if (hasRatios) line.append(...drawRatio(cell, measure));
  return line;
}

// Draws the row's name, if it has one, across all columns.
function drawName(row, width) {
  const name = nameOf(row);
  return name ? html("tr", { class: "name" }, html("th", { scope: "rowgroup", colspan: width }, name)) : "";
}

function drawBars() {
  const what = find(".controls select").value, measure = `${what}_ms`;
  const places = rows.map((row) => placesOf(row, measure));
  if (!places.flat().some((place) => place)) {
    find(".bars").replaceChildren(html("caption", {}, `${hasRatios ? "The first" : "This"} report has no times of ${what}s.`));
    return;
  }
  const layout = layOut(places), width = hasRatios ? 5 : 3;
  const unit = hasRatios ? `times A’s ${what} time` : "ms per frame";
  const heading = (words) => html("th", { scope: "col" }, words);
  find(".bars").replaceChildren(
    html("thead", {}, html("tr", {}, html("th"),
      html("th", { class: "plot", scope: "col" }, html("span", { class: "unit" }, unit), drawAxis(layout)),
      heading("ms"), ...(hasRatios ? [heading("times A"), html("th")] : []))),
    ...rows.map((row, i) => html("tbody", {},
      drawName(row, width),
      ...row.cells.map((_, index) => drawLine(row, index, places[i][index], measure, layout)))));
}

// Joins members of a row's name. Scene, size, precision and variant need no heading; other values do.
const joinMembers = (row, members) => members.flatMap((member) => {
  const value = [row[member] ?? ""].flat().join("x");
  if (!value) return [];
  return ["scene", "size", "precision", "variant"].includes(member) ? value : `${member === "bvh" ? "BVH" : member} ${value}`;
}).join(", ");

// A row is named by the members in which rows differ. Scenes are compared by hash, not by path. Reports may differ in a row's lanes,
// which are part of its name only if names would otherwise be ambiguous.
const members = ["scene", "size", "precision", "lanes", "bvh", "samples", "bounces", "variant"];
const valuesOf = (member) => rows.flatMap((row) => row.cells.map((cell) => String(cell[member] ?? row[member])));
const areEqual = (member) => new Set(valuesOf(member === "scene" ? "scene_hash" : member)).size === 1;
const shared = members.filter(areEqual), named = members.filter((member) => !areEqual(member));
const areShort = new Set(rows.map((row) => joinMembers(row, named.filter((member) => member !== "lanes")))).size === rows.length;
const nameOf = (row) => joinMembers(row, named.filter((member) => member !== "lanes" || !areShort));

const figures = [
  ["Frame, ms", (cell) => cell.frame_ms?.median, formatNumber],
  ["Quartiles", ({ frame_ms: time }) => time?.lower_quartile && rangeText(time.lower_quartile, time.upper_quartile), String],
  ["Least to most", ({ frame_ms: time }) => time && rangeText(time.min, time.max), String],
  ["Runs", (cell) => cell.frame_ms?.runs, formatCount],
  ["Kernels, ms", (cell) => cell.kernel_ms?.median, formatNumber],
  ["Million rays per second", (cell) => cell.mrays_per_s, formatNumber],
  ["Lanes", (cell) => cell.lanes, formatCount],
];
const ratioFigures = [
  ["Times A", ({ comparison }) => comparison?.ratio, formatNumber],
  ["Interval", ({ comparison }) => comparison?.verdict && rangeText(comparison.low, comparison.high), String],
  ["Verdict", ({ comparison }, report) =>
    comparison && (comparison.verdict ?? (report.why_not ? "none" : `none: ${comparison.why_not}`)), String],
];

function drawFigures() {
  const shown = hasRatios ? [...figures, ...ratioFigures] : figures;
  const values = (cell, index) => shown.map(([, value, format]) => {
    const found = value(cell, reports[index]);
    return found === undefined ? html("td", { class: "missing" }, "–") : html("td", {}, format(found));
  });
  find(".figures").append(
    html("thead", {}, html("tr", {}, html("th"), ...shown.map(([heading]) => html("th", { scope: "col" }, heading)))),
    ...rows.map((row) => html("tbody", {}, drawName(row, shown.length + 1), ...row.cells.map((cell, index) => html("tr", {},
      html("th", { scope: "row" }, drawLetter(index)), ...values(cell, index))))));
}

document.title = reports.map(({ file }) => file).join(", ");
find(".reports").append(...reports.map(drawReport));
find(".facts").append(shared.length ? `All rows: ${joinMembers(rows[0], shared)}.` : "");
find(".note").append(`The axis is logarithmic; to the left is faster${hasRatios ? " than A" : ""}. A dot is the median, a box ` +
                     "spans the quartiles of the runs.");
find("#verdict").append(`“Same”: the interval lies within ${formatNumber(1 / tolerance)} to ${formatNumber(tolerance)}. Otherwise ` +
  `“faster” or “slower”: it does not contain 1. On a CPU, processor times are compared in addition: a row is slower if ` +
  `either time is, and faster only if the processor time is. All intervals of this page hold together with a ` +
  `probability of at least ${percent(confidence)}.`);
if (!hasRatios) document.querySelectorAll(".several").forEach((element) => element.remove());
find(".controls").addEventListener("change", drawBars);
drawBars();
drawFigures();
