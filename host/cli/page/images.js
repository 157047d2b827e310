// Draws the images, their differences, comparisons of two images, and crops around the worst pixels. A scene's first image is the
// reference's.
"use strict";

function imageElement({ size: [width, height] }, source, alt) {
  return html("img", { src: source, alt, width, height, decoding: "async" });
}

// Returns a caption such as "double; equal to it as 32-bit floats: single, strict".
function imageCaption(scene, name, others) {
  const caption = html("figcaption", {}, name);
  others.forEach((index, i) => caption.append(i ? ", " : "; equal to it as 32-bit floats: ", variantName(scene, index)));
  return caption;
}

function drawReference(section, scene) {
  const { image, variants } = scene.images[0];
  section.querySelector(".reference").append(imageElement(scene, image, "Image of the reference"),
                                             imageCaption(scene, "The reference", variants));
}

// Draws the scale of differences with two colors per decade. Every other one is labeled with its upper end.
function drawScale({ difference_decades: decades, difference_colors: colors }) {
  return colors.map((color, step) => {
    let label = step % 2 ? "" : powerOfTen(step / 2 - decades);
    if (step === 0) label = "≤ " + label;
    if (step === colors.length - 1) label = "not finite";
    return html("li", {}, svg("svg", { viewBox: "0 0 1 1", preserveAspectRatio: "none", "aria-hidden": "true" },
                              svg("rect", { width: 1, height: 1, fill: color })), label);
  });
}

const formatDigits = (value, digits) => (value === null ? "not finite" : String(Number(value.toPrecision(digits))));

// The kinds of worst pixels, with the meaning of their errors and the value that is shown in addition to colors.
const worstKinds = {
  object: { error: "color off by", heading: () => "Object", value: (id) => (id === 0xffffffff ? "none" : String(id)) },
  shadow: { error: "color off by", heading: ({ light }) => `Light ${light}`, value: (bit) => (bit ? "occluded" : "visible") },
  path: { error: "color off by", heading: () => "Path signature", value: (hash) => hash.toString(16).padStart(8, "0") },
  shading: { error: "off by" },
  t: { error: "relative error", heading: () => "Distance", value: (t) => formatDigits(t, 9) },
  normal: { error: "angle in radians" },
  image: { error: "off by" },
};

// Draws the 15x15 pixels around a pixel, which is marked by two frames, one of them black.
function drawCrop(scene, source, { x, y }, caption) {
  const [[left, width], [top, height]] = [x, y].map((center, axis) => {
    const side = Math.min(15, scene.size[axis]);
    return [Math.min(Math.max(center - 7, 0), scene.size[axis] - side), side];
  });
  return html("div", {}, svg("svg", { class: "crop", viewBox: `${left} ${top} ${width} ${height}` },
    svg("image", { href: source, width: scene.size[0], height: scene.size[1] }),
    ...[0.3, 0.1].map((gap) => svg("rect", { x: x - gap, y: y - gap, width: 1 + 2 * gap, height: 1 + 2 * gap }))), caption);
}

function drawWorst(scene, name, worst, image, show) {
  const { error, heading, value } = worstKinds[name];
  const place = worst.away === undefined ? "" : worst.away ? ", away from edges" : ", at an edge";
  const row = (title, side) => html("tr", {}, html("th", { scope: "row" }, title),
    value ? html("td", {}, value(worst[side])) : "",
    html("td", {}, worst[`${side}_color`].map((channel) => formatDigits(channel, value ? 5 : 8)).join(" ")));
  const button = html("button", { type: "button", class: "no-print" }, "Show it in the image");
  button.addEventListener("click", () => show(image, worst));
  return html("figure", {},
    html("h4", {}, kinds.find((kind) => kind.name === name).title + place),
    html("div", { class: "crops" }, drawCrop(scene, scene.images[0].image, worst, "reference"),
         drawCrop(scene, image.image, worst, "this variant"), drawCrop(scene, image.difference, worst, "difference")),
    html("figcaption", {}, `Pixel ${worst.x}, ${worst.y}: ${error} ${formatNumber(worst.error)}`,
         html("table", { class: "values" },
              html("tr", {}, html("td"), heading ? html("th", { scope: "col" }, heading(worst)) : "",
                   html("th", { scope: "col" }, "Color, linear")),
              row("reference", "reference"), row("variant", "variant")),
         button));
}

// Makes a comparison of two stacked images, split at a position that the reader moves. Returns a function that shows a pixel of an
// image next to the reference.
function makeComparison(section, scene) {
  const comparison = section.querySelector(".comparison"), find = (selector) => comparison.querySelector(selector);
  const images = scene.images.flatMap(({ variants: [index], image, difference }, i) => [
    { name: i ? scene.names[index] : "the reference", source: image },
    ...(i ? [{ name: `${scene.names[index]}: difference`, source: difference }] : []),
  ]);
  const stage = find(".stage"), pane = find(".window"), zoom = find(".zoom"), range = find("input");
  const [width, height] = scene.size;
  const [setLeft, setRight] = ["left", "right"].map((side, first) => {
    const select = find(`select.${side}`), image = find(`img.${side}`);
    select.append(...images.map(({ name }, i) => new Option(name, i)));
    const set = (index) => {
      select.value = index;
      Object.assign(image, { src: images[index].source, alt: images[index].name, width, height });
    };
    select.addEventListener("change", () => set(select.value));
    set(first);
    return set;
  });
  const setSplit = () => stage.style.setProperty("--split", `${range.value}%`);
  range.addEventListener("input", setSplit);

  let center = [0.5, 0.5]; // center of the visible part, in fractions of the image
  const setZoom = () => {
    stage.style.width = zoom.value ? `${width * zoom.value}px` : "";
    stage.classList.toggle("zoomed", zoom.value > 1);
    pane.scrollTo(center[0] * stage.offsetWidth - pane.clientWidth / 2, center[1] * stage.offsetHeight - pane.clientHeight / 2);
  };
  zoom.addEventListener("change", setZoom);
  pane.addEventListener("scroll", () => {
    center = [(pane.scrollLeft + pane.clientWidth / 2) / stage.offsetWidth,
              (pane.scrollTop + pane.clientHeight / 2) / stage.offsetHeight];
  });

  return ({ image }, { x, y }) => {
    setLeft(0);
    setRight(images.findIndex(({ source }) => source === image));
    zoom.value = 8;
    center = [(x + 0.5) / width, (y + 0.5) / height];
    range.value = 100 * center[0];
    setSplit();
    setZoom();
    comparison.scrollIntoView({ block: "center" });
    range.focus({ preventScroll: true });
  };
}

function drawImages(section, scene, scale) {
  drawReference(section, scene);
  const differences = section.querySelector(".differences"), others = scene.images.slice(1);
  if (!others.length) {
    section.querySelector(".comparison").remove();
    differences.remove();
    return;
  }
  const show = makeComparison(section, scene);
  differences.querySelector(".scale").append(...drawScale(scale));
  for (const shown of others) {
    const [index, ...equal] = shown.variants, name = scene.names[index];
    differences.querySelector(".images").append(
      html("figure", {}, imageElement(scene, shown.image, `Image of ${name}`),
           imageCaption(scene, variantName(scene, index), equal)),
      html("figure", {}, imageElement(scene, shown.difference, `Differences of ${name} from the reference`),
           html("figcaption", {}, variantName(scene, index), ": difference from the reference")));
    const worst = Object.entries(scene.variants[index].worst).filter(([, pixel]) => pixel);
    section.append(html("h3", {}, "The worst pixels of ", variantName(scene, index)),
                   html("div", { class: "worst" }, ...worst.map(([kind, pixel]) => drawWorst(scene, kind, pixel, shown, show))));
  }
}
