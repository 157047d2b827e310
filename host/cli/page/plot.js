// Plots each kind of error against frame time, on logarithmic axes.
"use strict";

const both = (count) => count.edge + count.away;
const kinds = [
  { name: "shading", title: "Shading", unit: "RMSE", error: (errors) => errors.shading.rmse },
  { name: "image", title: "Whole image", unit: "RMSE", error: (errors) => errors.image.rmse },
  { name: "flip", title: "Perceived difference", unit: "mean FLIP", error: (errors) => errors.image.flip_mean },
  { name: "object", title: "Wrong object", unit: "pixels", error: (errors) => both(errors.object) },
  { name: "shadow", title: "Wrong shadow", unit: "pixels, per light", error: (errors) => both(errors.shadow) },
  { name: "path", title: "Wrong path", unit: "pixels", error: (errors) => both(errors.path) },
  { name: "t", title: "Distance", unit: "relative, 99.9% within", error: (errors) => errors.t.relative?.p99_9 },
  { name: "normal", title: "Normal", unit: "radians, 99.9% within", error: (errors) => errors.normal.p99_9 },
];

// Returns the measured variants that have this kind's error.
function pointsOf(scene, kind) {
  return scene.variants.flatMap((variant, index) => {
    const error = variant.status === "measured" ? kind.error(variant.errors) : NaN;
    return Number.isFinite(error) ? [{ index, variant, error, time: variant.frame_ms }] : [];
  });
}

// Maps a plot's times and errors to its `width` and `height`. Errors of 0 lie on a floor below the error axis.
function layOut(scene, points, width, height) {
  const times = scene.variants.flatMap((variant) => variant.frame_ms ?? []);
  const errors = points.map((point) => point.error).filter((error) => error > 0);
  const left = 36, right = width - 12, top = 40, bottom = height - 32;
  const hasFloor = errors.length < points.length, end = hasFloor ? bottom - 20 : bottom;
  const ticks = decadeTicks(Math.min(...times.map((time) => time.min)), Math.max(...times.map((time) => time.max)));
  const lowest = errors.length ? Math.floor(Math.log10(Math.min(...errors))) : 0;
  const highest = errors.length ? Math.max(lowest + 1, Math.ceil(Math.log10(Math.max(...errors)))) : lowest;
  const aboveFloor = logarithmic(10 ** lowest, 10 ** highest, end, top);
  return {
    left, right, top, bottom, end, hasFloor, ticks, lowest, highest, hasAxis: errors.length > 0,
    x: logarithmic(ticks[0], ticks.at(-1), left, right),
    y: (error) => (error > 0 ? aboveFloor(error) : bottom),
  };
}

function drawTimeAxis({ x, ticks, right, top, bottom }) {
  const isCrowded = ticks.length > 7;
  return [...ticks.map((tick) => {
    const group = svg("g", { class: "tick x", "data-value": tick, transform: `translate(${x(tick)} 0)` },
                      svg("path", { class: "grid", d: `M0 ${top}V${bottom}` }));
    if (!isCrowded || String(tick).includes("1")) {
      group.append(svg("text", { y: bottom + 13, "text-anchor": "middle" }, String(tick)));
    }
    return group;
  }), svg("text", { class: "unit", x: right, y: bottom + 26, "text-anchor": "end" }, "ms per frame")];
}

function drawErrorAxis({ y, left, right, top, bottom, end, hasFloor, hasAxis, lowest, highest }) {
  const tick = (value, line, label) =>
    svg("g", { class: "tick y", "data-value": value, transform: `translate(0 ${y(value)})` },
        svg("path", { class: line, d: `M${left} 0H${right}` }),
        label ? svg("text", { x: left - 5, y: 3.5, "text-anchor": "end" }, label) : "");
  const step = Math.ceil((highest - lowest) / 6), digits = highest - lowest <= 2 ? [1, 2, 5] : [1];
  const axis = [];
  for (let exponent = lowest; hasAxis && exponent <= highest; exponent++) {
    for (const digit of exponent < highest ? digits : [1]) {
      const value = Number(`${digit}e${exponent}`), isLabeled = digit === 1 && (exponent - lowest) % step === 0;
      axis.push(tick(value, "grid", isLabeled && (exponent >= 0 && exponent <= 3 ? String(value) : powerOfTen(exponent))));
    }
  }
  if (hasAxis) axis.push(svg("path", { class: "axis", d: `M${left} ${top}V${end}` + (hasFloor ? "" : `H${right}`) }));
  else axis.push(svg("text", { class: "note", x: left + 6, y: (top + bottom) / 2 }, "0 in every variant"));
  if (hasFloor) axis.push(tick(0, "floor", "0"));
  return axis;
}

const isOnFront = ({ variant }, kind) => variant.pareto[kind.name] === true;

function drawFront(points, kind, { x, y, right, top }) {
  const front = points.filter((point) => isOnFront(point, kind))
                      .sort((a, b) => a.time.median - b.time.median || b.error - a.error);
  if (!front.length) return "";
  const corners = front.map(({ time, error }, i) => (i ? `H${x(time.median)}` : `M${x(time.median)} ${top}`) + `V${y(error)}`);
  return svg("path", { class: "front", d: corners.join("") + `H${right}` });
}

function drawPoint({ index, variant, error, time }, name, kind, { x, y }) {
  const at = x(time.median), from = x(time.min) - at, to = x(time.max) - at, isCrossed = variant.crossed_out;
  const hollow = isOnFront({ variant }, kind) ? "" : "hollow";
  return svg("g", { class: `point ${variant.precision}`, "data-variant": index, transform: `translate(${at} ${y(error)})` },
    svg("title", {}, `${name}: ${formatMs(time.median)} (${formatNumber(time.min)} to ${formatNumber(time.max)}), ` +
                     `${kind.unit} ${formatNumber(error)}${isCrossed ? "; crossed out" : ""}`),
    svg("path", { class: "spread", d: `M${from} 0H${to}M${from} -3V3M${to} -3V3` }),
    svg("use", { href: `#mark-${variant.precision}`, class: `mark ${hollow}` }),
    svg("circle", { class: "halo", r: 10 }),
    isCrossed ? svg("path", { class: "cross", d: "M-8 -8L8 8M-8 8L8 -8" }) : "");
}

const overlap = (a, b) =>
  a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;

const KEY_WIDTH = 11; // width of the mark before a name

// Returns a name's candidate positions relative to its mark: next to it, else above or below, with a second mark before the name.
function labelPlaces(width) {
  const near = [[6, -19], [6, 7], [-6 - width, 7], [-6 - width, -19], [9, -6], [-9 - width, -6]];
  const far = Array.from({ length: 12 }, (_, i) => [-32 - 13 * i, 20 + 13 * i]).flat();
  return [...near.map(([dx, dy]) => ({ dx, dy, width, key: 0 })),
          ...far.flatMap((dy) => [6, -6 - width - KEY_WIDTH].map((dx) => ({ dx, dy, width: width + KEY_WIDTH, key: KEY_WIDTH })))];
}

// Draws the names where they cover nothing.
function drawLabels(points, scene, { x, y, left, right, top, bottom, hasAxis }) {
  const taken = points.flatMap(({ time, error }) => [
    { x: x(time.median) - 7, y: y(error) - 7, width: 14, height: 14 },
    { x: x(time.min), y: y(error) - 3, width: x(time.max) - x(time.min), height: 6 },
  ]);
  if (!hasAxis) taken.push({ x: left, y: (top + bottom) / 2 - 12, width: 110, height: 16 }); // the note
  return points.flatMap(({ index, variant, time, error }) => {
    const name = scene.names[index];
    const boxes = labelPlaces(5.7 * name.length).map(({ dx, dy, width, key }) =>
      ({ x: x(time.median) + dx, y: y(error) + dy, width, height: 12, key }));
    const free = boxes.find((box) => box.x > left - 2 && box.x + box.width < right + 12 && box.y > top - 10 &&
                                     box.y + box.height <= bottom && !taken.some((other) => overlap(box, other)));
    if (!free) return [];
    taken.push(free);
    const mark = svg("use", { href: `#mark-${variant.precision}`, class: `mark ${variant.precision}`,
                              transform: `translate(${free.x + 4} ${free.y + 6.5}) scale(0.75)` });
    return [...(free.key ? [mark] : []), svg("text", { class: "label", x: free.x + free.key, y: free.y + 10 }, name)];
  });
}

function drawPanel(scene, kind, width, height) {
  const points = pointsOf(scene, kind), layout = layOut(scene, points, width, height);
  const { x, y, left, right, top, bottom, lowest, highest, hasAxis } = layout;
  const budgets = scene.picks.filter(({ measure, budget }) =>
    hasAxis && measure === kind.name && budget >= 10 ** lowest && budget <= 10 ** highest);
  const references = scene.variants.filter(({ status }) => status === "reference");
  const isLabeled = width > 300 ||
    (points.length <= 4 && points.every(({ index }) => scene.names[index].length <= 10));
  return svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "data-kind": kind.name,
                      "aria-label": `${kind.title}, ${kind.unit}, against time; the tables below have the numbers` },
    svg("text", { class: "heading", x: 0, y: 13 }, kind.title),
    svg("text", { class: "unit", x: 0, y: 27 }, kind.unit),
    ...drawTimeAxis(layout),
    ...drawErrorAxis(layout),
    ...budgets.map(({ budget }) => svg("path", { class: "budget", d: `M${left} ${y(budget)}H${right}` })),
    ...references.map(({ frame_ms: time }) =>
      svg("path", { class: "reference", d: `M${x(time.median)} ${top}V${bottom}` })),
    hasAxis ? drawFront(points, kind, layout) : "",
    ...points.map((point) => drawPoint(point, scene.names[point.index], kind, layout)),
    ...(isLabeled ? drawLabels(points, scene, layout) : []));
}

function drawLegend(scene) {
  const mark = (precision, more = "") => svg("use", { href: `#mark-${precision}`, class: `mark ${precision} ${more}` });
  const line = (name, d) => svg("path", { class: name, d });
  const measured = scene.variants.filter((variant) => variant.status === "measured");
  const precisions = [...new Set(measured.map((variant) => variant.precision))], any = precisions[0];
  return [
    ...precisions.map((precision) => [precision, mark(precision)]),
    ["hollow: another is as good and faster, or crossed out", mark(any, "hollow")],
    measured.some((variant) => variant.crossed_out) &&
      ["crossed out", mark(any, "hollow"), line("cross", "M-8 -7L8 7M-8 7L8 -7")],
    ["the Pareto front: nothing is better and faster", line("front", "M-10 -5H0V5H10")],
    ["shortest to longest run", line(`spread ${any}`, "M-9 0H9M-9 -3V3M9 -3V3")],
    scene.variants.some(({ status }) => status === "reference") &&
      ["the reference’s time", line("reference", "M0 -7V7")],
    ["a budget", line("budget", "M-10 0H10")],
  ].filter(Boolean).map(([words, ...drawing]) =>
    html("li", {}, svg("svg", { viewBox: "-10 -7 20 14", "aria-hidden": "true" }, ...drawing), words));
}

function drawPlots(section, scene) {
  const shown = kinds.filter((kind) => pointsOf(scene, kind).length), plot = section.querySelector(".plot");
  if (!shown.length) {
    plot.remove();
    return;
  }
  const choice = plot.querySelector("select"), panels = plot.querySelector(".panels");
  choice.append(...shown.map((kind) => new Option(`${kind.title}: ${kind.unit}`, kind.name)));
  const draw = () => {
    const chosen = shown.filter((kind) => kind.name === choice.value);
    panels.classList.toggle("one", chosen.length === 1);
    const [width, height] = panels.clientWidth >= 600 ? [760, 420] : [380, 320]; // so that text stays readable
    panels.replaceChildren(...(chosen.length ? chosen.map((kind) => drawPanel(scene, kind, width, height))
                                             : shown.map((kind) => drawPanel(scene, kind, 250, 210))));
  };
  choice.addEventListener("change", draw);
  draw();
  plot.querySelector(".legend").append(...drawLegend(scene));
}
