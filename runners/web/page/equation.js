// An equation on an interval: u with its band as it narrows.
import { plot } from "./plot.js";
import { Tab, afterwards } from "./tab.js";

const NAME = "equation.toml";
const START = { kernel: "0.5 / (1 + (x - y)^2)", source: "1", from: "0", to: "1", error: "1e-6", points: "65" };
// Runs with two cells come first, so that there is something to see at once: their standard errors, if these are larger than the one that is asked for.
const COARSE = [0.1, 0.03, 0.01, 0.003, 0.001];
const FEW_CELLS = "\n[galerkin]\ncells = 2\ndegree = 0\n";
// The normal quantile of 95 %.
const QUANTILE = 1.96;

const FIELDS = Object.keys(START);
/** Where each field stands in the file, from line 1. */
const LINES = { 4: ["from", "to"], 5: ["kernel"], 6: ["source"], 9: ["error"], 13: ["points"] };

/** The largest magnitude, as text. */
const most = (numbers) => Math.max(0, ...numbers.map(Math.abs)).toExponential(1);

/** An end of the interval: a number, or a formula as text. */
const end = (text) => (Number.isFinite(Number(text)) && text.trim() !== "" ? text.trim() : JSON.stringify(text));

export class Equation extends Tab {
  constructor(panel) {
    super(panel, "equation");
    const later = afterwards(350, () => this.run());
    FIELDS.forEach((name) => this.field(name).addEventListener("input", later));
    this.field("magnify").addEventListener("input", () => this.draw());
  }

  /** Fills the fields from a file, or from the start. */
  async open(files) {
    let values = START;
    if (files) {
      const [text] = Object.values(files);
      const tree = JSON.parse(await this.solver.call("tree", [text]));
      const { problem = {}, walk = {}, target = [] } = tree;
      const [from, to] = problem.domain?.[0] ?? [0, 1];
      values = { ...START, ...problem, from, to, error: walk.target_error ?? START.error, points: target[0]?.grid ?? START.points };
    }
    FIELDS.forEach((name) => (this.field(name).value = values[name]));
    await this.run();
  }

  /** The problem file; of a coarse run with its standard error. */
  text(coarse) {
    const error = coarse ?? this.field("error").value;
    const value = Object.fromEntries(FIELDS.map((name) => [name, this.field(name).value]));
    return `[problem]
kind = "cube"
dimension = 1
domain = [[${end(value.from)}, ${end(value.to)}]]
kernel = ${JSON.stringify(value.kernel)}
source = ${JSON.stringify(value.source)}

[walk]
target_error = ${error}

[[target]]
name = "u"
grid = ${value.points}

[[target]]
name = "mean"
over = "all"
${coarse ? FEW_CELLS : ""}`;
  }

  files() {
    return { [NAME]: this.text() };
  }

  /** Says an error beside the field that it is of. */
  explain(message) {
    const [, line, column] = message.match(/^equation\.toml:(\d+):(\d+): /) ?? [];
    const names = LINES[line] ?? [];
    const row = this.text().split("\n")[line - 1] ?? "";
    const isSecond = names.length > 1 && Number(column) > row.indexOf(",") + 1;
    // What stands in the file is before the reader's eyes.
    const [words] = message.replace(/^equation\.toml:\d+:\d+: /, "").split("\n");
    this.refuse(words, names[isSecond ? 1 : 0]);
  }

  /** Solves, coarsely first; what runs already is stopped. */
  async run() {
    this.solver.stop();
    const run = (this.current = Symbol("run"));
    this.accept();
    const error = this.numberOf("error", [1e-15, 1e3]);
    const points = this.numberOf("points", [2, 1001], true);
    if (error === undefined || points === undefined) return;
    this.busy(true);
    this.errors = { x: [], y: [] };
    const begun = performance.now();
    let last;
    for (const coarse of [...COARSE.filter((coarse) => coarse > error), undefined]) {
      try {
        const found = await this.solver.solve(NAME, { [NAME]: this.text(coarse) }, (walked, expected) => {
          if (run === this.current) this.progress(walked, expected);
        });
        if (run !== this.current) return;
        if (found === null || (found.stop === "Cancelled" && last)) break;
        last = found;
      } catch (wrong) {
        if (run !== this.current) return;
        // Two cells do not serve every equation.
        if (coarse) continue;
        this.busy(false);
        return this.explain(wrong.message);
      }
      last.residuals = await this.residuals(last);
      if (run !== this.current) return;
      this.answer = last;
      this.errors.x.push((performance.now() - begun) / 1000);
      this.errors.y.push(Math.max(...this.curves(last).error));
      this.draw();
      this.print(last);
      if (this.isStopped) break;
    }
    this.busy(false);
    const worst = this.errors.y.at(-1);
    const took = `${((performance.now() - begun) / 1000).toFixed(2)} s`;
    if (last === undefined) this.say("stopped before the first result");
    else this.say(`${this.isStopped ? "stopped: " : ""}largest standard error ${worst.toExponential(1)}, ${took}`);
  }

  /** Of an answer: x, u, the standard errors and the solution without walks at the points of the grid. */
  curves({ columns: { names, coordinates, of_targets: columns } }) {
    const grid = (numbers) => numbers.filter((_, i) => names[i].startsWith("u["));
    const [u, error, known] = ["estimate", "std_error", "galerkin"].map((name) => grid(columns[name]));
    return { x: grid(coordinates).map(([x]) => x), u, error, known };
  }

  /** u less ∫ K u dy and F at the points of the grid, each with its standard error; then the same of the solution without walks. */
  async residuals(answer) {
    const { x, u, error, known } = this.curves(answer);
    const texts = ["kernel", "source"].map((name) => this.field(name).value);
    const of = (u, error) => this.solver.call("residual", [...texts, ...[x, u, error].map((numbers) => Float64Array.from(numbers))]);
    const both = await Promise.all([of(u, error), of(known, error.map(() => 0))]);
    // Nothing comes of what was stopped.
    return both.map((found) => [0, 1].map((part) => (found ? Array.from(x, (_, i) => found[2 * i + part]) : [])));
  }

  draw() {
    if (!this.answer) return;
    const { x, u, error } = this.curves(this.answer);
    const [residual, known] = this.answer.residuals;
    const half = error.map((error) => QUANTILE * error);
    const times = 10 ** Number(this.field("magnify").value);
    this.output("magnified", times.toLocaleString("en"));
    const worst = Math.max(...half).toExponential(1);
    const all = [
      ["u", [{ x, y: u, band: half.map((h) => h * times), className: "u" }], { axes: ["x", "u"], description: `u, with a band of ${worst} at most on each side` }],
      ["error", [{ ...this.errors, className: "error", dots: true }], { axes: ["seconds", "standard error"], logs: [true, true], description: "The largest standard error against seconds" }],
      [
        "residual",
        [
          { x, y: known[0], className: "known" },
          { x, y: residual[0], band: residual[1].map((error) => QUANTILE * error), className: "residual" },
        ],
        { axes: ["x", "u − ∫ K u dy − F"], description: `The residual of u, at most ${most(residual[0])}, and of the solution without walks, at most ${most(known[0])}` },
      ],
    ];
    for (const [name, curves, options] of all) this.plot(name).replaceChildren(plot(curves, options));
  }
}
