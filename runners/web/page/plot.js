// Curves and bands as SVG.

const SPACE = "http://www.w3.org/2000/svg";
const [WIDTH, HEIGHT] = [420, 270];
const [LEFT, RIGHT, TOP, BOTTOM] = [74, 12, 12, 44];

const element = (name, attributes, ...children) => {
  const made = document.createElementNS(SPACE, name);
  Object.entries(attributes).forEach(([key, value]) => made.setAttribute(key, value));
  made.append(...children);
  return made;
};

/** A number with so many digits as a reader wants beside others that differ by `step`. */
const label = (value, step) => {
  if (value === 0) return "0";
  const digits = Math.max(1, Math.ceil(Math.log10(Math.abs(value) / step) + 1e-9) + 1);
  const text = Number(value.toPrecision(Math.min(15, digits)));
  return Math.abs(text) >= 1e5 || Math.abs(text) < 1e-3 ? text.toExponential() : String(text);
};

/** Round numbers from low to high. */
const ticks = (low, high, count = 5) => {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= rough) ?? rough;
  const first = Math.ceil(low / step - 1e-9);
  const found = Array.from({ length: count + 3 }, (_, k) => (first + k) * step).filter((x) => x <= high + 1e-9 * step);
  return found.map((x) => [x, label(x, step)]);
};

/** Round numbers between powers of ten, of which the logarithms are asked for. */
const powers = (low, high) => {
  const [from, to] = [Math.ceil(low - 1e-9), Math.floor(high + 1e-9)];
  if (to - from < 1) {
    const all = [from - 1, to, to + 1].flatMap((k) => [1, 2, 5].map((m) => m * 10 ** k));
    const seen = [...new Set(all)].filter((x) => Math.log10(x) >= low && Math.log10(x) <= high);
    const close = () => ticks(10 ** low, 10 ** high).filter(([x]) => Math.log10(x) >= low && Math.log10(x) <= high);
    return (seen.length > 1 ? seen.map((x) => [x, label(x, x)]) : close()).map(([x, text]) => [Math.log10(x), text]);
  }
  const every = Math.max(1, Math.ceil((to - from) / 6));
  return Array.from({ length: Math.max(0, to - from + 1) }, (_, k) => from + k)
    .filter((k) => k % every === 0)
    .map((k) => [k, `1e${k}`]);
};

const ends = (numbers) => {
  let [low, high] = [Infinity, -Infinity];
  for (const x of numbers) if (Number.isFinite(x)) [low, high] = [Math.min(low, x), Math.max(high, x)];
  if (low > high) return [0, 1];
  const room = high > low ? 0 : Math.abs(low) * 0.05 || 1;
  return [low - room, high + room];
};

/**
 * A picture of curves { x, y, band?, className, dots? }; `logs` says of each axis whether it is logarithmic. What is not a positive number is left out
 * there. The description is for people who do not see it.
 */
export const plot = (curves, { axes, logs = [false, false], description }) => {
  const scaled = curves.map((curve) => {
    const of = (numbers, log) => Array.from(numbers, (x) => (log ? Math.log10(x) : x));
    return { ...curve, x: of(curve.x, logs[0]), y: of(curve.y, logs[1]) };
  });
  const [left, right] = ends(scaled.flatMap((curve) => curve.x));
  let [low, high] = ends(
    scaled.flatMap(({ y, band }) => y.flatMap((u, i) => (band ? [u - band[i], u + band[i]] : [u]))),
  );
  const margin = 0.04 * (high - low);
  [low, high] = [low - margin, high + margin];
  const x = (value) => LEFT + ((value - left) / (right - left)) * (WIDTH - LEFT - RIGHT);
  const y = (value) => HEIGHT - BOTTOM - ((value - low) / (high - low)) * (HEIGHT - TOP - BOTTOM);
  const svg = element("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": description, class: "plot" });
  for (const [value, text] of (logs[0] ? powers : ticks)(left, right)) {
    svg.append(element("line", { class: "grid", x1: x(value), x2: x(value), y1: TOP, y2: HEIGHT - BOTTOM }));
    svg.append(element("text", { x: x(value), y: HEIGHT - BOTTOM + 17, "text-anchor": "middle" }, text));
  }
  for (const [value, text] of (logs[1] ? powers : ticks)(low, high)) {
    svg.append(element("line", { class: "grid", x1: LEFT, x2: WIDTH - RIGHT, y1: y(value), y2: y(value) }));
    svg.append(element("text", { x: LEFT - 6, y: y(value) + 4, "text-anchor": "end" }, text));
  }
  svg.append(element("text", { x: (LEFT + WIDTH - RIGHT) / 2, y: HEIGHT - 6, "text-anchor": "middle" }, axes[0]));
  const middle = (TOP + HEIGHT - BOTTOM) / 2;
  svg.append(element("text", { transform: `translate(13 ${middle}) rotate(-90)`, "text-anchor": "middle" }, axes[1]));
  for (const { x: xs, y: ys, band, className, dots } of scaled) {
    const seen = xs.map((_, i) => i).filter((i) => Number.isFinite(xs[i]) && Number.isFinite(ys[i]));
    const point = (i, off = 0) => `${x(xs[i]).toFixed(2)},${y(ys[i] + off).toFixed(2)}`;
    if (band) {
      const edge = [...seen.map((i) => point(i, band[i])), ...seen.toReversed().map((i) => point(i, -band[i]))];
      svg.append(element("polygon", { class: `band ${className}`, points: edge.join(" ") }));
    }
    svg.append(element("polyline", { class: `curve ${className}`, points: seen.map((i) => point(i)).join(" ") }));
    if (dots) seen.forEach((i) => svg.append(element("circle", { class: className, cx: x(xs[i]), cy: y(ys[i]), r: 4 })));
  }
  return svg;
};

/** Pictures of all targets of an answer that are grids of one axis, with their bands of 95 %. */
export const gridPlots = ({ columns: { names, coordinates, of_targets: numbers } }) => {
  const grids = new Map();
  names.forEach((name, i) => {
    const [, grid] = name.match(/^(.*)\[\d+\]$/) ?? [];
    if (!grid || coordinates[i].length !== 1) return;
    const curve = grids.get(grid) ?? { x: [], y: [], band: [], className: "u" };
    grids.set(grid, curve);
    curve.x.push(coordinates[i][0]);
    curve.y.push(numbers.estimate[i] ?? NaN);
    curve.band.push(1.96 * (numbers.std_error?.[i] ?? 0));
  });
  return [...grids].map(([name, curve]) => plot([curve], { axes: ["x", name], description: `${name} with its band of 95 %` }));
};
