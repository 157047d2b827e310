// What the page does beyond being read: draws the plots from the figures, sorts tables, lays one picture over another.
"use strict";

const text = document.getElementById("figures").textContent;
const figures = JSON.parse(text);

const both = (count) => count.edge + count.away;
const kinds = [
  { name: "shading", title: "Shading", unit: "RMSE", error: (errors) => errors.shading.rmse },
  { name: "image", title: "Whole picture", unit: "RMSE", error: (errors) => errors.image.rmse },
  { name: "flip", title: "Difference seen", unit: "mean FLIP", error: (errors) => errors.image.flip_mean },
  { name: "object", title: "Wrong object", unit: "pixels", error: (errors) => both(errors.object) },
  { name: "shadow", title: "Wrong shadow", unit: "pixels, for each light", error: (errors) => both(errors.shadow) },
  { name: "path", title: "Wrong path", unit: "pixels", error: (errors) => both(errors.path) },
  { name: "t", title: "Distance", unit: "relative, 99.9 % within", error: (errors) => errors.t.relative.p99_9 },
  { name: "normal", title: "Normal", unit: "radians, 99.9 % within", error: (errors) => errors.normal.p99_9 },
];

function superscript(number) {
  return String(number).replace(/./g, (sign) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[sign] ?? "⁻");
}

const powerOfTen = (exponent) => "10" + superscript(exponent);

function typeset(number) {
  if (number === 0 || (Math.abs(number) >= 0.01 && Math.abs(number) < 1e4)) return String(Number(number.toPrecision(3)));
  const [mantissa, exponent] = number.toExponential(1).split("e");
  return `${mantissa} · ${powerOfTen(Number(exponent))}`;
}

function svg(name, attributes, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

function html(name, properties, ...children) {
  const element = Object.assign(document.createElement(name), properties);
  element.append(...children);
  return element;
}

// The part of an axis from `low` to `high`, both above 0, as pixels from `from` to `to`.
function logarithmic(low, high, from, to) {
  return (value) => from + ((to - from) * Math.log10(value / low)) / Math.log10(high / low);
}

// 1, 2 and 5 times powers of ten: the last not above `low` to the first not below `high`.
function timeTicks(low, high) {
  const ticks = [];
  for (let exponent = Math.floor(Math.log10(low)); ; exponent++) {
    for (const digit of [1, 2, 5]) {
      const tick = Number(`${digit}e${exponent}`);
      if (tick <= low) ticks.length = 0;
      ticks.push(tick);
      if (tick >= high && ticks.length > 1) return ticks;
    }
  }
}

// The variants of a scene as points of one kind of error; those without the figure are left out.
function pointsOf(scene, kind) {
  return scene.variants.flatMap((variant, index) => {
    if (variant.status !== "measured") return [];
    let error;
    try {
      error = kind.error(variant.errors);
    } catch {
      return []; // what has only a status and a reason
    }
    return Number.isFinite(error) ? [{ index, variant, error, time: variant.frame_ms }] : [];
  });
}

function boxesMeet(a, b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

// Names beside the marks, each where it covers nothing; one that fits nowhere is left out.
function placeLabels(marks, width, bottom) {
  const taken = marks.flatMap(({ x, y, from, to }) => [
    { x: x - 7, y: y - 7, width: 14, height: 14 }, { x: from, y: y - 3, width: to - from, height: 6 },
  ]);
  const labels = [];
  for (const { x, y, name } of marks) {
    const length = 5.7 * name.length;
    const places = [
      { x: x + 6, y: y - 19 }, { x: x + 6, y: y + 7 }, { x: x - 6 - length, y: y + 7 }, { x: x - 6 - length, y: y - 19 },
      { x: x + 9, y: y - 6 }, { x: x - 9 - length, y: y - 6 },
    ].map((place) => ({ ...place, width: length, height: 12 }));
    const free = places.find((box) => box.x > 34 && box.x + box.width < width && box.y + box.height <= bottom &&
                                      !taken.some((other) => boxesMeet(box, other)));
    if (!free) continue;
    taken.push(free);
    labels.push(svg("text", { class: "label", x: free.x, y: free.y + 10 }, name));
  }
  return labels;
}

// One kind's errors against the time of a frame. Errors of 0 lie on a line of their own below the axis' end.
function drawPanel(scene, kind, names, width, height) {
  const points = pointsOf(scene, kind);
  const timed = scene.variants.filter((variant) => variant.frame_ms);
  const left = 36, right = width - 12, top = 40, bottom = height - 32;
  const errors = points.map((point) => point.error).filter((error) => error > 0);
  const hasFloor = errors.length < points.length;
  const end = hasFloor ? bottom - 20 : bottom;

  const ticks = timeTicks(Math.min(...timed.map((variant) => variant.frame_ms.min)),
                          Math.max(...timed.map((variant) => variant.frame_ms.max)));
  const x = logarithmic(ticks[0], ticks.at(-1), left, right);
  const lowest = errors.length ? Math.floor(Math.log10(Math.min(...errors))) : 0;
  const highest = Math.max(lowest + 1, errors.length ? Math.ceil(Math.log10(Math.max(...errors))) : 0);
  const logY = logarithmic(10 ** lowest, 10 ** highest, end, top);
  const y = (error) => (error > 0 ? logY(error) : bottom);

  const panel = svg("svg", {
    viewBox: `0 0 ${width} ${height}`, role: "img", "data-kind": kind.name,
    "aria-label": `${kind.title}, ${kind.unit}, against the time of a frame; the tables below have the numbers`,
  });
  panel.append(svg("text", { class: "heading", x: 0, y: 13 }, kind.title),
               svg("text", { class: "unit", x: 0, y: 27 }, kind.unit));

  const crowded = ticks.length > 7;
  for (const tick of ticks) {
    const group = svg("g", { class: "tick x", "data-value": tick, transform: `translate(${x(tick)} 0)` },
                      svg("path", { class: "grid", d: `M0 ${top}V${bottom}` }));
    if (!crowded || String(tick).includes("1")) {
      group.append(svg("text", { y: bottom + 13, "text-anchor": "middle" }, String(tick)));
    }
    panel.append(group);
  }
  panel.append(svg("text", { class: "unit", x: right, y: bottom + 26, "text-anchor": "end" }, "ms a frame"));
  const step = Math.ceil((highest - lowest) / 6);
  const digits = highest - lowest <= 2 ? [1, 2, 5] : [1];
  for (let exponent = lowest; errors.length && exponent <= highest; exponent++) {
    for (const digit of exponent < highest ? digits : [1]) {
      const tick = Number(`${digit}e${exponent}`);
      const group = svg("g", { class: "tick y", "data-value": tick, transform: `translate(0 ${logY(tick)})` },
                        svg("path", { class: "grid", d: `M${left} 0H${right}` }));
      if (digit === 1 && (exponent - lowest) % step === 0) {
        const label = exponent >= 0 && exponent <= 3 ? String(tick) : powerOfTen(exponent);
        group.append(svg("text", { x: left - 5, y: 3.5, "text-anchor": "end" }, label));
      }
      panel.append(group);
    }
  }
  if (errors.length) {
    panel.append(svg("path", { class: "axis", d: `M${left} ${top}V${end}` + (hasFloor ? "" : `H${right}`) }));
  }
  if (hasFloor) {
    panel.append(svg("g", { class: "tick y", "data-value": 0, transform: `translate(0 ${bottom})` },
                     svg("path", { class: "floor", d: `M${left} 0H${right}` }),
                     svg("text", { x: left - 5, y: 3.5, "text-anchor": "end" }, "0")));
  }

  for (const pick of scene.picks) {
    if (pick.measure === kind.name && pick.budget >= 10 ** lowest && pick.budget <= 10 ** highest && errors.length) {
      panel.append(svg("path", { class: "budget", d: `M${left} ${logY(pick.budget)}H${right}` }));
    }
  }
  for (const variant of timed.filter(({ status }) => status === "reference")) {
    panel.append(svg("path", { class: "reference", d: `M${x(variant.frame_ms.median)} ${top}V${bottom}` }));
  }

  if (!errors.length) {
    panel.append(svg("text", { class: "note", x: left + 6, y: (top + bottom) / 2 }, "0 in every variant"));
  }

  const isFront = ({ variant }) => variant.pareto[kind.name] === true;
  const front = points.filter(isFront).sort((a, b) => a.time.median - b.time.median || b.error - a.error);
  if (front.length && errors.length) {
    const corners = front.map((point, i) => (i ? `H${x(point.time.median)}V${y(point.error)}`
                                               : `M${x(point.time.median)} ${top}V${y(point.error)}`));
    panel.append(svg("path", { class: "front", d: corners.join("") + `H${right}` }));
  }
  for (const point of points) {
    const { precision, crossed_out: crossedOut } = point.variant;
    const at = x(point.time.median);
    const mark = svg("g", {
      class: `point ${precision}`, "data-variant": point.index, transform: `translate(${at} ${y(point.error)})`,
    }, svg("path", { class: "spread", d: `M${x(point.time.min) - at} 0H${x(point.time.max) - at}` +
                                         `M${x(point.time.min) - at} -3V3M${x(point.time.max) - at} -3V3` }),
    svg("use", { href: `#mark-${precision}`, class: isFront(point) ? "mark" : "mark hollow" }),
    svg("circle", { class: "halo", r: 10 }));
    if (crossedOut) mark.append(svg("path", { class: "cross", d: "M-8 -8L8 8M-8 8L8 -8" }));
    mark.prepend(svg("title", {}, `${names[point.index]}: ${typeset(point.time.median)} ms ` +
      `(${typeset(point.time.min)} to ${typeset(point.time.max)}), ${kind.unit} ${typeset(point.error)}` +
      (crossedOut ? "; crossed out" : "")));
    panel.append(mark);
  }
  const isLarge = width > 500;
  if (isLarge || (points.length <= 4 && points.every(({ index }) => names[index].length <= 10))) {
    panel.append(...placeLabels(points.map((point) => ({
      x: x(point.time.median), y: y(point.error), from: x(point.time.min), to: x(point.time.max),
      name: names[point.index],
    })), width, bottom));
  }
  return panel;
}

function drawLegend(scene) {
  const item = (drawing, words) => {
    const key = svg("svg", { viewBox: "-10 -7 20 14", "aria-hidden": "true" });
    key.append(...drawing);
    return html("li", {}, key, words);
  };
  const mark = (precision, extra = "") =>
    svg("use", { href: `#mark-${precision}`, class: `mark ${precision} ${extra}` });
  const measured = scene.variants.filter((variant) => variant.status === "measured");
  const precisions = [...new Set(measured.map((variant) => variant.precision))];
  const any = precisions[0];
  if (!any) return "";
  const items = precisions.map((precision) => item([mark(precision)], precision));
  items.push(item([mark(any, "hollow")], "hollow: another is as good and faster, or crossed out"));
  if (measured.some((variant) => variant.crossed_out)) {
    items.push(item([mark(any, "hollow"), svg("path", { class: "cross", d: "M-8 -7L8 7M-8 7L8 -7" })], "crossed out"));
  }
  items.push(item([svg("path", { class: "front", d: "M-10 -5H0V5H10" })], "the Pareto front: nothing is better and faster"),
             item([svg("path", { class: `spread ${any}`, d: "M-9 0H9M-9 -3V3M9 -3V3" })], "shortest to longest run"));
  if (scene.variants.some((variant) => variant.status === "reference")) {
    items.push(item([svg("path", { class: "reference", d: "M0 -7V7" })], "the reference’s time"));
  }
  if (scene.picks.some((pick) => pick.measure)) {
    items.push(item([svg("path", { class: "budget", d: "M-10 0H10" })], "a budget"));
  }
  const list = html("ul", { className: "legend panels-legend" });
  list.append(...items);
  return list;
}

function makePlot(section, scene) {
  const figure = section.querySelector(".plot");
  const names = scene.variants.map((_, index) =>
    section.querySelector(`tr[data-variant="${index}"] th`)?.textContent.trim() ?? String(index));
  const shown = kinds.filter((kind) => pointsOf(scene, kind).length);
  if (!shown.length) return;
  const content = document.getElementById("panel-choice").content.cloneNode(true);
  const choice = content.querySelector("select"), panels = content.querySelector(".panels");
  for (const kind of shown) choice.append(new Option(`${kind.title}: ${kind.unit}`, kind.name));
  const draw = () => {
    const chosen = shown.filter((kind) => kind.name === choice.value);
    panels.classList.toggle("one", chosen.length === 1);
    panels.replaceChildren(...(chosen.length
      ? chosen.map((kind) => drawPanel(scene, kind, names, 760, 420))
      : shown.map((kind) => drawPanel(scene, kind, names, 250, 210))));
  };
  choice.addEventListener("change", draw);
  draw();
  figure.prepend(content, drawLegend(scene));
}

// A variant under the pointer is marked wherever it is: in each panel and each table.
function linkVariants(section) {
  section.addEventListener("pointerover", (event) => {
    const index = event.target.closest("[data-variant]")?.dataset.variant;
    for (const element of section.querySelectorAll("[data-variant]")) {
      element.classList.toggle("hot", element.dataset.variant === index);
    }
  });
}

const cellValue = (row, column) => {
  const cell = row.cells[column];
  const data = cell.querySelector("data");
  return data ? Number(data.value) : cell.textContent.trim();
};

// Cells without a number come last whichever the order.
function compareCells(a, b, sign) {
  const isNumber = [a, b].map((value) => typeof value === "number" && !Number.isNaN(value));
  if (isNumber[0] !== isNumber[1]) return isNumber[0] ? -1 : 1;
  return sign * (isNumber[0] ? (a === b ? 0 : a - b) : String(a).localeCompare(String(b)));
}

function makeSortable(table) {
  const headings = [...table.tHead.rows[0].cells];
  headings.forEach((heading, column) => {
    const button = html("button", { type: "button" });
    button.append(...heading.childNodes);
    heading.append(button);
    button.addEventListener("click", () => {
      const descends = heading.getAttribute("aria-sort") === "ascending";
      for (const other of headings) other.removeAttribute("aria-sort");
      heading.setAttribute("aria-sort", descends ? "descending" : "ascending");
      const body = table.tBodies[0];
      body.append(...[...body.rows].sort((a, b) =>
        compareCells(cellValue(a, column), cellValue(b, column), descends ? -1 : 1)));
    });
  });
}

// The pictures of a section, one laid over another and cut at a place that the reader moves.
function makeComparison(section) {
  const pictures = [...section.querySelectorAll("img[data-name]")];
  const place = section.querySelector(".comparison");
  if (pictures.length < 2) return;
  place.append(document.getElementById("compare").content.cloneNode(true));
  const stage = place.querySelector(".stage"), pane = place.querySelector(".window");
  const zoom = place.querySelector("select.zoom"), range = place.querySelector("input");
  const sides = ["left", "right"].map((side, index) => {
    const select = place.querySelector(`select.${side}`), image = place.querySelector(`img.${side}`);
    pictures.forEach((picture, i) => select.append(new Option(picture.dataset.name, i)));
    const show = () => {
      const picture = pictures[select.value];
      image.src = picture.src;
      image.width = picture.width;
      image.height = picture.height;
      image.alt = picture.alt;
    };
    select.value = index;
    select.addEventListener("change", show);
    show();
    return { select, show };
  });

  const setSplit = () => stage.style.setProperty("--split", `${range.value}%`);
  range.addEventListener("input", setSplit);
  setSplit();

  const width = Number(pictures[0].getAttribute("width")), height = Number(pictures[0].getAttribute("height"));
  // `across` and `down`: what is to be in the middle, as parts of the picture.
  const setZoom = (across, down) => {
    stage.style.width = zoom.value ? `${width * zoom.value}px` : "";
    stage.classList.toggle("zoomed", zoom.value > 1);
    pane.scrollTo(across * stage.offsetWidth - pane.clientWidth / 2, down * stage.offsetHeight - pane.clientHeight / 2);
  };
  const middle = () => [(pane.scrollLeft + pane.clientWidth / 2) / stage.offsetWidth,
                        (pane.scrollTop + pane.clientHeight / 2) / stage.offsetHeight];
  let last = [0.5, 0.5];
  pane.addEventListener("scroll", () => { last = middle(); });
  zoom.addEventListener("change", () => setZoom(...last));

  for (const figure of section.querySelectorAll(".worst figure")) {
    const button = html("button", { type: "button", className: "no-print", textContent: "Show it in the picture" });
    button.addEventListener("click", () => {
      sides[0].select.value = 0;
      sides[1].select.value = pictures.findIndex((picture) => picture.dataset.picture === figure.dataset.picture);
      for (const side of sides) side.show();
      zoom.value = 8;
      last = [(Number(figure.dataset.x) + 0.5) / width, (Number(figure.dataset.y) + 0.5) / height];
      range.value = 100 * last[0];
      setSplit();
      setZoom(...last);
      place.scrollIntoView({ block: "center" });
      range.focus({ preventScroll: true });
    });
    figure.querySelector("figcaption").append(button);
  }
}

document.querySelectorAll("section.scene").forEach((section, index) => {
  makePlot(section, figures.scenes[index]);
  linkVariants(section);
  makeComparison(section);
});
document.querySelectorAll("table.sortable").forEach(makeSortable);

const save = document.getElementById("save");
save.querySelector("a").href = URL.createObjectURL(new Blob([text], { type: "application/json" }));
save.hidden = false;
