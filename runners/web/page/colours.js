// Numbers as colours, from dark to light.

// Of matplotlib's map "inferno", at equal distances.
const STOPS = [
  [0, 0, 4], [22, 11, 57], [66, 10, 104], [106, 23, 110], [147, 38, 103], [188, 55, 84],
  [221, 81, 58], [243, 120, 25], [252, 165, 10], [246, 215, 70], [252, 255, 164],
];

/** Red, green and blue of a share from 0 to 1. */
export const colour = (share) => {
  const place = Math.min(Math.max(share, 0), 1) * (STOPS.length - 1);
  const from = Math.min(Math.floor(place), STOPS.length - 2);
  return STOPS[from].map((c, k) => c + (STOPS[from + 1][k] - c) * (place - from));
};

/** The ends of most of these numbers: a hundredth on each side is left out, so that a few extremes leave the rest their colours. */
export const rangeOf = (numbers) => {
  const sorted = Float64Array.from(numbers.filter(Number.isFinite)).sort();
  if (!sorted.length) return [0, 1];
  const at = (share) => sorted[Math.round(share * (sorted.length - 1))];
  const [low, high] = [at(0.01), at(0.99)];
  return low < high ? [low, high] : [low, low + (Math.abs(low) || 1)];
};

/** A number for people. */
export const short = (value) => Number(value.toPrecision(3)).toString();
