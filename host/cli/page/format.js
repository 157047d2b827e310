// Makes elements and formats numbers for display.
"use strict";

// Returns a function that makes elements: svg("rect", { width: 1 }, child, …), html("td", { class: "words" }, "text", …).
const elementMaker = (namespace) => (name, attributes = {}, ...children) => {
  const element = document.createElementNS(namespace, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
};
const svg = elementMaker("http://www.w3.org/2000/svg");
const html = elementMaker("http://www.w3.org/1999/xhtml");

const powerOfTen = (exponent) => "10" + String(exponent).replace(/./g, (sign) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[sign] ?? "⁻");

// Formats a number with three digits or, below 0.01 and from 10,000, with two and a power of ten, as 3.1·10⁻⁶. null means not finite.
function formatNumber(value) {
  if (value === null) return "not finite";
  const size = Math.abs(value);
  let text;
  if (size === 0) text = "0";
  else if (size === Infinity) text = "∞";
  else if (size >= 0.01 && size < 9999.5) text = size < 999.5 ? size.toPrecision(3) : size.toFixed(0);
  else text = size.toExponential(1).replace(/e\+?(.*)/, (_, exponent) => "·" + powerOfTen(exponent));
  return value < 0 ? "−" + text : text;
}

// Formats a count with its digits in groups of three, such as 921 600.
function formatCount(value) {
  return value < 10000 ? String(value) : String(value).replace(/\B(?=(\d{3})+$)/g, "\u202F");
}

const formatMs = (value) => formatNumber(value) + "\u00A0ms";
const plural = (count, noun, nouns = noun + "s") => `${formatCount(count)} ${count === 1 ? noun : nouns}`;

// Returns a variant's mark and name.
function variantName({ names, variants }, index) {
  const { precision } = variants[index], name = document.createDocumentFragment();
  name.append(svg("svg", { class: `mark ${precision}`, viewBox: "-7 -7 14 14", "aria-hidden": "true" },
                  svg("use", { href: `#mark-${precision}` })), names[index]);
  return name;
}
