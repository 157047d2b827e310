// Uses an HTML report, to which test_html.py appends this, as a reader does, and leaves what it finds as JSON.
"use strict";

function readPanels(section) {
  return [...section.querySelectorAll(".panels svg")].map((panel) => {
    const origin = panel.getBoundingClientRect(), scale = panel.getCTM().a;
    const readTicks = (axis) => [...panel.querySelectorAll(`.tick.${axis}`)].map((tick) => ({
      value: Number(tick.dataset.value), position: tick.getCTM()[axis === "x" ? "e" : "f"],
      label: tick.querySelector("text")?.textContent,
    }));
    return {
      kind: panel.dataset.kind, x: readTicks("x"), y: readTicks("y"),
      points: [...panel.querySelectorAll(".point")].map((point) => {
        const { fill, stroke } = getComputedStyle(point.querySelector("use")), { e: x, f: y } = point.getCTM();
        const spread = point.querySelector(".spread").getBBox();
        return {
          variant: Number(point.dataset.variant), y, hollow: fill !== stroke, crossed: point.querySelector(".cross") !== null,
          x: [x + scale * spread.x, x, x + scale * (spread.x + spread.width)],
        };
      }),
    };
  });
}

function choose(select, value) {
  select.value = value;
  select.dispatchEvent(new Event("change"));
}

// By table and heading, after one and after two clicks: each row's variant and text.
function sortTables(section) {
  return [...section.querySelectorAll(".tables table")].map((table) => {
    const headings = [...table.tHead.rows[0].cells];
    return Object.fromEntries(headings.map((heading, column) => {
      const rows = () => [...table.tBodies[0].rows].map((row) => [Number(row.dataset.variant), row.cells[column].textContent]);
      const orders = ["ascending", "descending"].map((order) => {
        heading.querySelector("button").click();
        if (heading.getAttribute("aria-sort") !== order) errors.push(`not ${order}`);
        return [order, rows()];
      });
      return [heading.textContent, Object.fromEntries(orders)];
    }));
  });
}

// Returns the elements wider than the page that are in no scrolling container; in drawings only the svg and its texts.
function readWide() {
  const scrolls = (element) => element && element !== document.body &&
    (/auto|scroll/.test(getComputedStyle(element).overflowX) || scrolls(element.parentElement));
  return [...document.body.querySelectorAll(":not(script, template, noscript, svg *), .panels text")].filter((element) => {
    const { left, right, width } = element.getBoundingClientRect();
    return width > 0 && (left < -0.5 || right > innerWidth + 0.5) && !scrolls(element.parentElement);
  }).map((element) => `${element.tagName} ${element.getAttribute("class")} ${element.textContent.slice(0, 40)}`);
}

// Returns a panel's labels, the labels that cover another text, and the marks that are opaque.
function readLabels(panel) {
  const texts = [...panel.querySelectorAll("text")].map((text) => ({ text, box: text.getBoundingClientRect() }));
  const covers = (a, b) => a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 2 && b.top < a.bottom - 2;
  return {
    labels: texts.filter(({ text }) => text.matches(".label")).map(({ text }) => text.textContent),
    covering: texts.filter(({ text, box }) => text.matches(".label") &&
      texts.some((other) => other.text !== text && covers(box, other.box))).map(({ text }) => text.textContent),
    opaque: [...panel.querySelectorAll(".point use")].filter((use) => {
      const { fill, fillOpacity } = getComputedStyle(use);
      return fill !== "none" && Number(fillOpacity) === 1;
    }).length,
    points: panel.querySelectorAll(".point").length, scale: panel.getCTM().a,
  };
}

function readPixel(source, x, y) {
  const image = [...document.images].find(({ src }) => src === source);
  const canvas = new OffscreenCanvas(image.naturalWidth, image.naturalHeight), context = canvas.getContext("2d");
  context.drawImage(image, 0, 0);
  return [...context.getImageData(x, y, 1, 1).data.slice(0, 3)];
}

function readWorst(scene) {
  return scene.images.slice(1).flatMap(({ image, variants: [variant] }) =>
    Object.entries(scene.variants[variant].worst).filter(([, worst]) => worst).map(([kind, { x, y }]) => (
      { variant, kind, colors: [...readPixel(scene.images[0].image, x, y), ...readPixel(image, x, y)] })));
}

function readSplit(section, percent) {
  const slider = section.querySelector(".stage input");
  slider.value = percent;
  slider.dispatchEvent(new Event("input"));
  const clip = getComputedStyle(section.querySelector("img.left")).clipPath; // inset(0px calc(75%) 0px 0px)
  return 100 - Number(/([\d.]+)%/.exec(clip)[1]);
}

function readScene(section, scene) {
  const find = (selector) => section.querySelector(selector), panels = readPanels(section);
  const readAllLabels = () => [...section.querySelectorAll(".panels svg")].map(readLabels), labels = readAllLabels();
  choose(find(".plot select"), "image");
  const chosen = readPanels(section), chosenLabels = readAllLabels(), chosenWide = readWide(), split = [50, 25].map((percent) => readSplit(section, percent));
  const images = find("select.right").options;
  choose(find("select.right"), images.length - 1);
  const chosenIsShown = find(".stage img.right").src === scene.images.at(-1).difference;
  find(".worst button").click();
  const [x, y] = find(".worst figcaption").textContent.match(/\d+/g).map(Number);
  const stage = find(".stage"), pane = find(".window");
  // how far the pane's scroll position is from that which centers the pixel, or from its end
  const scrollError = (position, scroll, visible, whole) =>
    Math.abs(scroll - Math.min(Math.max(8 * (position + 0.5) - visible / 2, 0), Math.max(whole - visible, 0)));
  return {
    heading: find("h2").textContent, facts: find(".facts").textContent, panels, labels, chosen, chosenLabels, chosenWide, split, chosenIsShown, zoom: stage.offsetWidth / scene.size[0],
    offCenter: [scrollError(x, pane.scrollLeft, pane.clientWidth, stage.offsetWidth),
                scrollError(y, pane.scrollTop, pane.clientHeight, stage.offsetHeight)],
    tables: sortTables(section), pixels: readWorst(scene),
    broken: [...section.querySelectorAll("img")].filter((image) => !image.naturalWidth).length,
  };
}

addEventListener("load", () => {
  const overflow = Math.max(0, document.documentElement.scrollWidth - innerWidth), wide = readWide();
  const hiddenBudgets = [...document.querySelectorAll(".overview .table")].map((table) => table.scrollWidth - table.clientWidth);
  const drawn = [...document.querySelectorAll("section.scene")].map((section, index) => readScene(section, scenes[index]));
  const loaded = performance.getEntriesByType("resource").map(({ name }) => name).filter((name) => !name.startsWith("data:"));
  const found = JSON.stringify({ errors, loaded, width: innerWidth, overflow, wide, hiddenBudgets, scenes: drawn }).replaceAll("<", "\\u003c");
  document.documentElement.replaceChildren(html("script", { id: "found", type: "application/json" }, found));
});
