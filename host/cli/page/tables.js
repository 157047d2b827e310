// Draws tables of a scene's variants. A column has a heading, a function from a variant to its value, and a format. Missing values
// are undefined.
"use strict";

function verdict(variant) {
  if (variant.status === "unavailable") return variant.reason;
  if (variant.status === "reference") return "the reference";
  return variant.crossed_out ? `crossed out: ${variant.why.join(", ")}` : "";
}

const number = (heading, value) => ({ heading, value, format: formatNumber });
const count = (heading, value) => ({ heading, value, format: formatCount });
const text = (heading, value, type) => ({ heading, value, type, format: String });

const tables = [
  { caption: "Times", hasEveryVariant: true, columns: [
    number("Frame, ms", (variant) => variant.frame_ms?.median),
    number("Shortest", (variant) => variant.frame_ms?.min),
    number("Longest", (variant) => variant.frame_ms?.max),
    count("Runs", (variant) => variant.frame_ms?.runs),
    number("Kernels, ms", (variant) => variant.kernel_ms?.median),
    text("Clock", (variant) => variant.clock),
    number("Million rays per second", (variant) => variant.mrays_per_s),
    text("Kernel", (variant) => variant.kernel_hash, "hash"),
    text("Verdict", verdict, "words"),
  ] },
  { caption: "Wrong pixels", columns: [
    count("Not finite", ({ errors }) => errors.nonfinite),
    count("Negative", ({ errors }) => errors.negative),
    count("Object, at silhouettes", ({ errors }) => errors.object.edge),
    count("Object, away", ({ errors }) => errors.object.away),
    count("Shadow, at edges", ({ errors }) => errors.shadow.edge),
    count("Shadow, away", ({ errors }) => errors.shadow.away),
    count("Path, at edges", ({ errors }) => errors.path.edge),
    count("Path, away", ({ errors }) => errors.path.away),
  ] },
  { caption: "Errors of the other pixels", columns: [
    number("Shading, RMSE", ({ errors }) => errors.shading.rmse),
    number("Shading, largest", ({ errors }) => errors.shading.max),
    number("Shading, 99.9%", ({ errors }) => errors.shading.p99_9),
    number("Shading, bias", ({ errors }) => errors.shading.bias),
    number("Distance, 99.9%", ({ errors }) => errors.t.relative?.p99_9),
    number("Distance, largest", ({ errors }) => errors.t.relative?.max),
    number("Distance, 99.9%, ulp", ({ errors }) => errors.t.ulps?.p99_9),
    number("Distance, largest, ulp", ({ errors }) => errors.t.ulps?.max),
    number("Normal, 99.9%", ({ errors }) => errors.normal.p99_9),
    number("Normal, largest", ({ errors }) => errors.normal.max),
  ] },
  { caption: "The whole image", columns: [
    number("RMSE", ({ errors }) => errors.image.rmse),
    number("PSNR, dB", ({ errors }) => errors.image.psnr ?? Infinity), // null where nothing differs
    number("relMSE", ({ errors }) => errors.image.rel_mse),
    number("8-bit PSNR, dB", ({ errors }) => errors.image.srgb_psnr ?? Infinity),
    count("8-bit values off by 1", ({ errors }) => errors.image.off_by_1),
    count("off by more", ({ errors }) => errors.image.off_by_more),
    number("FLIP, mean", ({ errors }) => errors.image.flip_mean),
    number("FLIP, largest", ({ errors }) => errors.image.flip_max),
  ] },
];

function drawRow(scene, index, columns) {
  const variant = scene.variants[index];
  const cells = columns.map(({ value, format, type }) => {
    const shown = value(variant);
    return shown === undefined ? html("td", { class: "missing" }, "–") : html("td", type ? { class: type } : {}, format(shown));
  });
  return html("tr", { "data-variant": index, class: variant.crossed_out ? "crossed" : "" },
              html("th", { scope: "row" }, variantName(scene, index)), ...cells);
}

// Compares two values. Missing and non-finite values come last in either order.
function compareValues(a, b, sign) {
  const missing = (a ?? null) === null, otherMissing = (b ?? null) === null;
  if (missing || otherMissing) return missing - otherMissing;
  return sign * (a < b ? -1 : a > b ? 1 : 0);
}

function makeTable({ caption, columns, hasEveryVariant }, scene) {
  const indices = [...scene.variants.keys()].filter((index) => hasEveryVariant || scene.variants[index].status === "measured");
  const values = columns.map((column) => indices.map((index) => column.value(scene.variants[index])));
  if (values.flat().every((value) => value === undefined)) return "";
  const rows = new Map(indices.map((index) => [index, drawRow(scene, index, columns)]));
  const body = html("tbody", {}, ...rows.values());
  const name = { heading: "Variant", value: (variant) => scene.names[scene.variants.indexOf(variant)] };
  const headings = [name, ...columns].map(({ heading, value, type }) => {
    const button = html("button", { type: "button" }, heading);
    const cell = html("th", { scope: "col", class: type === "words" ? type : "" }, button);
    button.addEventListener("click", () => {
      const descends = cell.getAttribute("aria-sort") === "ascending";
      for (const other of headings) other.removeAttribute("aria-sort");
      cell.setAttribute("aria-sort", descends ? "descending" : "ascending");
      const sorted = [...indices].sort((a, b) =>
        compareValues(value(scene.variants[a]), value(scene.variants[b]), descends ? -1 : 1));
      body.append(...sorted.map((index) => rows.get(index)));
    });
    return cell;
  });
  return html("div", { class: "table", role: "region", "aria-label": caption, tabindex: 0 },
              html("table", {}, html("caption", {}, caption), html("thead", {}, html("tr", {}, ...headings)), body));
}

function drawTables(section, scene) {
  const place = section.querySelector(".tables");
  place.append(...tables.map((table) => makeTable(table, scene)));
  const colorsOnly = scene.variants.find((variant) => variant.errors?.object.status === "unavailable");
  if (colorsOnly) {
    place.append(html("p", { class: "note" },
                      `No figures of objects, shadows, paths, shading, distances and normals: ${colorsOnly.errors.object.reason}.`));
  }
}
