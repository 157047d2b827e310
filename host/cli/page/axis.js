// Logarithmic axes.
"use strict";

// Maps `low` to `from` and `high` to `to`.
const logarithmic = (low, high, from, to) =>
  (value) => from + ((to - from) * Math.log10(value / low)) / Math.log10(high / low);

// Returns 1, 2 and 5 times powers of ten, from the last not above `low` to the first above `high`.
function decadeTicks(low, high) {
  const ticks = Array.from({ length: 90 }, (_, i) => Number(`${[1, 2, 5][i % 3]}e${Math.floor(i / 3) - 12}`));
  return ticks.slice(ticks.findLastIndex((tick) => tick <= low), ticks.findIndex((tick) => tick > high) + 1);
}

// Returns multiples of a round step, for a range of less than a factor of 3, in which decadeTicks has too few.
function stepTicks(low, high) {
  const step = [0.02, 0.05, 0.1, 0.2, 0.5].find((size) => high - low <= 6 * size);
  const first = Math.floor(low / step), last = Math.ceil(high / step);
  return Array.from({ length: last - first + 1 }, (_, i) => Number(((first + i) * step).toFixed(2)));
}
