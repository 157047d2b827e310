// Draws the report: the device, the fastest variant within each budget, and a section per scene.
"use strict";

const reportText = document.getElementById("report").textContent;
const report = JSON.parse(reportText), extras = JSON.parse(document.getElementById("extras").textContent);
const scenes = report.scenes.map((scene, index) => ({ ...scene, ...extras.scenes[index] })); // with names and images

function drawDevice({ device, glint, perturb }) {
  const entries = {
    Device: `${device.name}: ${device.type}, ${plural(device.units, "unit")} at ${device.clock_mhz} MHz`,
    Platform: `${device.platform}, ${device.platform_version}`,
    Driver: device.driver,
    Program: `glint ${glint}`,
  };
  if (perturb) entries.Perturbed = `rounding errors injected, of ${perturb.scale} times their bound; seed ${perturb.seed}`;
  return Object.entries(entries).flatMap(([term, words]) => [html("dt", {}, term), html("dd", {}, words)]);
}

function budgetText(budget) {
  const exponent = Math.round(Math.log10(budget));
  return Math.abs(budget / 10 ** exponent - 1) < 1e-9 ? powerOfTen(exponent) : formatNumber(budget);
}

// Returns the picked row and those that tie with it.
function tiedRows({ variant, others }) {
  return [variant, ...others.filter(({ ties }) => ties).map((other) => other.variant)];
}

// Describes what is certain about the picked row's time at the report's confidence.
function drawCertainty(scene, { others }) {
  if (!others.length) return ["; no other is within it"];
  const range = ({ low, high }) => `${formatNumber(low)} to ${formatNumber(high)} times as long`;
  const list = (rows, words) => rows.flatMap((row, i) => [i ? ", " : words, variantName(scene, row.variant),
                                                          row.high === null ? "" : ` (${range(row)})`]);
  const ties = others.filter((other) => other.ties);
  const next = others.reduce((least, other) => (other.ratio < least.ratio ? other : least));
  return [...list(ties.filter(({ high }) => high !== null), "; ties with "),
          ...list(ties.filter(({ high }) => high === null), "; too few runs to compare it with "),
          ...(ties.length ? [] : ["; ", variantName(scene, next.variant), ` takes ${range(next)}`])];
}

function drawOverview() {
  const row = (scene, index) => html("tr", {},
    html("th", { scope: "row" }, html("a", { href: `#scene-${index}` }, scene.scene)),
    ...scene.picks.map((pick) =>
      (pick.variant === null ? html("td", {}, "none") : html("td", {},
        ...tiedRows(pick).flatMap((variant, i) => [i ? " or " : "", html("span", {}, variantName(scene, variant))]),
        `, ${formatMs(pick.frame_ms)}`))));
  const headings = scenes[0].picks.map(({ budget }) => html("th", { scope: "col" }, `at most ${budgetText(budget)}`));
  return html("div", { class: "table", role: "region", "aria-label": "The fastest", tabindex: 0 },
              html("table", {}, html("thead", {}, html("tr", {}, html("th", { scope: "col" }, "Scene"), ...headings)),
                   html("tbody", {}, ...scenes.map(row))));
}

function drawFacts({ size: [width, height], pixels, lights, bounces, reference, edges }) {
  const facts = html("p", { class: "facts" },
                     `${width} × ${height} pixels, ${plural(lights, "light")}, at most ${plural(bounces, "bounce")}. `);
  if (reference.kind === "file") {
    facts.append("Compared with ", html("code", {}, reference.file), ", which has colors only.");
  } else {
    const { device, precision, lanes, bvh, samples, kernel_hash: hash } = reference;
    const image = device === report.device.name ? "the device’s own image" : `the image of ${device}`;
    facts.append(`Compared with ${image} at ${precision} (${plural(lanes, "lane")}, BVH ${bvh}, ` +
                 `${plural(samples, "sample")} per pixel, kernel `, html("span", { class: "hash" }, hash), ").");
  }
  if (reference.nonfinite + reference.negative) {
    facts.append(" ", html("strong", {}, `Pixels of the reference: ${formatCount(reference.nonfinite)} not finite, ` +
                                         `${formatCount(reference.negative)} negative.`));
  }
  if (edges.status !== "unavailable") {
    facts.append(` Of its ${formatCount(pixels)} pixels ${formatCount(edges.silhouette)} lie at silhouettes, ` +
                 `${formatCount(edges.path)} where paths change` +
                 (edges.shadow.length ? `; at edges of the lights’ shadows: ${edges.shadow.map(formatCount).join(", ")}.` : "."));
  }
  return facts;
}

// Draws one sentence for all consecutive budgets with the same picked variant.
function drawPicks(scene) {
  const groups = [];
  for (const pick of scene.picks) {
    const last = groups.at(-1)?.[0];
    if (last?.variant === pick.variant && last.others?.length === pick.others?.length) groups.at(-1).push(pick);
    else groups.push([pick]);
  }
  return groups.map((picks) => {
    const budgets = picks.map(({ budget }) => budgetText(budget)), last = budgets.pop();
    const item = html("li", {}, `For an error of at most ${budgets.length ? `${budgets.join(", ")} or ` : ""}${last}: `);
    const { variant: index, frame_ms: time, error } = picks[0];
    if (index === null) {
      item.append("none of these.");
      return item;
    }
    const { errors, status } = scene.variants[index];
    const { edge: objects = 0 } = errors?.object ?? {}, { edge: shadows = 0 } = errors?.shadow ?? {};
    item.append(html("strong", {}, variantName(scene, index)), `, ${formatMs(time)} per frame, `,
                status === "reference" ? "the reference itself" : `error ${formatNumber(error)}`,
                ...drawCertainty(scene, picks[0]),
                objects ? `; ${plural(objects, "pixel")} at silhouettes ${objects === 1 ? "shows" : "show"} another object` : "",
                shadows ? `; ${plural(shadows, "shadow bit is wrong at edges", "shadow bits are wrong at edges")}` : "", ".");
    return item;
  });
}

// Marks the variant under the pointer in every plot and table of its scene.
function linkVariants(section) {
  section.addEventListener("pointerover", (event) => {
    const index = event.target.closest("[data-variant]")?.dataset.variant;
    for (const element of section.querySelectorAll("[data-variant]")) {
      element.classList.toggle("hot", element.dataset.variant === index);
    }
  });
}

function drawScene(scene, index) {
  const section = document.getElementById("scene").content.cloneNode(true).firstElementChild;
  const heading = section.querySelector("h2"), id = `scene-${index}`;
  heading.append(scene.scene);
  heading.id = id;
  section.setAttribute("aria-labelledby", id);
  section.querySelector(".facts").replaceWith(drawFacts(scene));
  section.querySelector(".picks").append(...drawPicks(scene));
  drawPlots(section, scene);
  drawTables(section, scene);
  drawImages(section, scene, extras);
  linkVariants(section);
  return section;
}

document.title = `Speed against error: ${scenes.map(({ scene }) => scene).join(", ")}`;
document.querySelector(".device").append(...drawDevice(report));
document.querySelector(".overview").append(drawOverview());
document.querySelector(".overview").hidden = false;
document.querySelector(".meaning").before(...scenes.map(drawScene));

const save = document.getElementById("save");
save.href = URL.createObjectURL(new Blob([reportText], { type: "application/json" }));
save.append("Save the figures as JSON");
