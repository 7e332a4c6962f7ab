// A scene in space: means of u over its cells, from one set of walks.
import { colour, rangeOf, short } from "./colours.js";
import { Tab, afterwards } from "./tab.js";
import { View } from "./view.js";

const EXAMPLES = ["cornell.toml", "living-room.toml", "reheating.toml", "satellite.toml"];
const FACTOR_ERROR = 1e-4;
// Grey, before anything is known.
const UNKNOWN = [120, 126, 134];

const isMesh = (name) => /\.(obj|stl|ply|vs3)$/i.test(name);

/** A problem around a mesh: its surfaces are grey, a sun shines from above, and what leaves is lost. */
const around = (name, surfaces, reflectance) => `[problem]
kind = "scene"
mesh = ${JSON.stringify(name)}
open = true

[[problem.light]]
towards = [1, -2, 3]
irradiance = 1

${surfaces.map((surface) => `[[problem.surface]]\nname = ${JSON.stringify(surface)}\nreflectance = ${reflectance}\n`).join("\n")}`;

/** The file with one set of walks for all cells, of which alone it asks. */
const whole = (text, walks, cells) => {
  let isTarget = false;
  const lines = text.split("\n").filter((line) => {
    if (line.startsWith("[")) isTarget = line.startsWith("[[target]]");
    return !isTarget && !/^(global|walks|target_error|relative|method|adjoint|cells)\s*=/.test(line);
  });
  const rest = `${lines.join("\n")}\n[[target]]\nname = "all"\nover = "all"\n`;
  const put = (text, head, lines) =>
    text.match(new RegExp(`^\\[${head}\\]`, "m"))
      ? text.replace(new RegExp(`^\\[${head}\\].*$`, "m"), `[${head}]\n${lines}`)
      : `${text}\n[${head}]\n${lines}\n`;
  return put(put(rest, "walk", `global = true\nwalks = ${walks}`), "galerkin", `cells = ${cells}`);
};

export class Scene extends Tab {
  contents = {};

  constructor(panel) {
    super(panel, "scene");
    this.view = new View(this.plot("view"), (number) => this.pick(number));
    this.field("walks").value = "20000";
    this.field("cells").value = "300";
    this.field("reflectance").value = "0.5";
    this.field("example").replaceChildren(...EXAMPLES.map((name) => new Option(name)));
    this.field("example").addEventListener("change", () => this.open());
    this.field("file").addEventListener("change", ({ target }) => this.take(target.files));
    this.field("colour").addEventListener("change", () => this.colour());
    for (const name of ["walks", "cells"]) this.field(name).addEventListener("input", afterwards(400, () => this.run()));
    this.field("reflectance").addEventListener("input", afterwards(400, () => this.take([])));
    document.addEventListener("dragover", (event) => !panel.hidden && event.preventDefault());
    document.addEventListener("drop", (event) => {
      if (panel.hidden) return;
      event.preventDefault();
      this.take(event.dataTransfer.files);
    });
  }

  async open(files) {
    if (files) return this.load(files);
    const name = this.field("example").value;
    const text = fredholm.examples[name];
    const [, mesh] = text.match(/^mesh = "([^"]+)"/m) ?? [];
    const own = mesh ? { [mesh]: fredholm.examples[mesh] } : {};
    return this.load({ [name]: text, ...own });
  }

  /** Takes files that were dropped; none: the last ones once more. */
  async take(list) {
    const files = await Promise.all(Array.from(list, async (file) => [file.name, new Uint8Array(await file.arrayBuffer())]));
    if (files.length) this.taken = Object.fromEntries(files);
    if (!this.taken) return;
    this.busy(true);
    const names = Object.keys(this.taken);
    const problem = names.find((name) => name.endsWith(".toml"));
    if (problem) {
      const text = new TextDecoder().decode(this.taken[problem]);
      return this.load({ [problem]: text, ...this.taken, [problem]: text });
    }
    this.accept();
    const reflectance = this.numberOf("reflectance", [0, 0.99]);
    const mesh = names.find(isMesh);
    if (!mesh) this.refuse(`${names.join(", ")}: a mesh is an .obj, .stl, .ply or .vs3 file`, "file");
    if (reflectance === undefined || !mesh) return this.busy(false);
    try {
      const { names: surfaces } = JSON.parse(await this.solver.call("faces", [mesh], this.taken));
      await this.load({ "scene.toml": around(mesh, surfaces, reflectance), ...this.taken });
    } catch (error) {
      this.busy(false);
      this.refuse(error.message, "file");
    }
  }

  /** The files, the problem file first, which share and download say. */
  files() {
    const text = (content) => (typeof content === "string" ? content : new TextDecoder().decode(content));
    return Object.fromEntries(Object.entries(this.contents).map(([name, content]) => [name, name === this.name ? this.text() : text(content)]));
  }

  text() {
    return whole(this.contents[this.name], this.field("walks").value, this.field("cells").value);
  }

  /** Shows the faces of a problem file and solves it. */
  async load(files) {
    this.accept();
    this.busy(true);
    this.solver.stop();
    const load = (this.loading = Symbol("load"));
    this.current = undefined;
    const name = Object.keys(files).find((name) => name.endsWith(".toml"));
    try {
      const text = await this.solver.call("faces", [name], files);
      // Another file came meanwhile, or it was stopped.
      if (load !== this.loading) return;
      this.loading = undefined;
      if (text === null) return this.busy(false);
      const found = JSON.parse(text);
      Object.assign(this, { name, contents: files, faces: found.faces, names: found.names, materials: found.materials });
    } catch (error) {
      if (load !== this.loading) return;
      this.loading = undefined;
      this.busy(false);
      return this.refuse(error.message, "file");
    }
    this.numbers = undefined;
    this.field("colour").value = "u";
    this.showFaces();
    this.view.paint(this.faces.map(() => UNKNOWN));
    await this.run();
  }

  showFaces() {
    this.shows = "faces";
    this.view.show(this.faces.map(({ corners }) => corners));
  }

  async run() {
    // What is loaded is solved then.
    if (this.loading) return;
    this.accept();
    const numbers = [this.numberOf("walks", [2, 1e9], true), this.numberOf("cells", [1, 1e5], true)];
    if (numbers.includes(undefined)) return this.busy(false);
    this.solver.stop();
    const run = (this.current = Symbol("run"));
    this.busy(true);
    const begun = performance.now();
    try {
      const files = { ...this.contents, [this.name]: this.text() };
      const answer = await this.solver.solve(this.name, files, this.progress);
      if (run !== this.current) return;
      this.busy(false);
      if (answer === null) return this.say("stopped before the first result");
      this.keep(answer);
      this.print(answer);
      const seconds = ((performance.now() - begun) / 1000).toFixed(2);
      this.say(`${this.isStopped ? "stopped: " : ""}${this.cells.length} cells, ${seconds} s`);
    } catch (error) {
      if (run !== this.current) return;
      this.busy(false);
      this.refuse(error.message);
    }
  }

  keep({ columns }) {
    const { mesh, names, of_targets: numbers } = columns;
    const first = names.length - mesh.length;
    const own = (name) => numbers[name]?.slice(first).map((x) => x ?? NaN);
    const [u, error] = [own("estimate"), own("std_error") ?? own("band")];
    const surfaces = new Map(this.names.map((name, i) => [name, i]));
    const irradiance = u.map((u, i) => {
      const [reflectance, emission] = this.materials[surfaces.get(names[first + i].replace(/\[\d+\]$/, ""))] ?? [NaN, NaN];
      return (u - emission) / reflectance;
    });
    this.cells = mesh;
    this.numbers = { u, error, irradiance: own("irradiance") ?? irradiance };
    this.colour();
  }

  /** Colours what is shown by what is chosen. */
  colour() {
    const what = this.field("colour").value;
    const table = this.panel.querySelector(".factors");
    table.hidden = what !== "factors" || !this.factors;
    this.output("picked", what === "factors" && !this.factors ? "Click a face." : "");
    if (what === "factors") {
      if (this.shows !== "faces") this.showFaces();
      return this.shade(this.factors ?? this.faces.map(() => NaN));
    }
    if (!this.numbers) return;
    if (this.shows !== "cells") {
      this.shows = "cells";
      this.view.show(this.cells);
    }
    this.shade(this.numbers[what]);
  }

  shade(numbers) {
    const [, high] = rangeOf(numbers);
    this.output("low", "0");
    this.output("high", short(high));
    this.view.paint(numbers.map((x) => (Number.isFinite(x) ? colour(x / high) : UNKNOWN)));
  }

  /** A polygon was clicked: the form factors of the face there. */
  async pick(number) {
    if (this.shows === "cells") {
      const what = this.field("colour").value;
      this.output("picked", `There: ${short(this.numbers[what][number])}`);
      return;
    }
    const found = await this.solver.call("factors", [this.name, number, FACTOR_ERROR], this.contents);
    if (found === null) return;
    this.factors = Array.from(found);
    const sums = new Map();
    this.faces.forEach(({ surface }, i) => sums.set(surface, (sums.get(surface) ?? 0) + found[i]));
    const rows = [...sums].filter(([, factor]) => factor > 0).sort(([, a], [, b]) => b - a);
    const cells = (texts) => texts.map((text) => Object.assign(document.createElement("td"), { textContent: text }));
    const made = rows.map(([surface, factor]) => {
      const row = document.createElement("tr");
      row.append(...cells([this.names[surface], factor.toFixed(4)]));
      return row;
    });
    this.panel.querySelector(".factors tbody").replaceChildren(...made);
    this.colour();
    const sum = rows.reduce((sum, [, factor]) => sum + factor, 0);
    this.output("picked", `From ${this.names[this.faces[number].surface]}: the factors' sum is ${sum.toFixed(4)}.`);
  }
}
