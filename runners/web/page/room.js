// A room in section: things are drawn with the mouse, and the library finds the light between them.
import { colour, rangeOf, short } from "./colours.js";
import { Tab, afterwards, number } from "./tab.js";

const NAME = "room.toml";
// Pictures from coarse to fine: pixels across, and a share of the walks of a pixel.
const COARSE = { across: 48, walks: 1 };
const FINE = [{ across: 96, walks: 1 }, { across: 160 }];
const STEP = 0.05;
/** Shorter drags are clicks. */
const SHORTEST = 0.04;

const round = (x) => Math.round(x * 1000) / 1000;

/** Twice the area within a polygon, positive if it goes anticlockwise. */
const area = (points) =>
  points.reduce((sum, [x, y], i) => {
    const [nextX, nextY] = points[(i + 1) % points.length];
    return sum + x * nextY - nextX * y;
  }, 0);

/** Active sides are on the left: of the room within, of what stands in it without. */
const turned = (points, inwards) => (area(points) > 0 === inwards ? points : points.toReversed());

const rectangle = ([x0, y0], [x1, y1]) => [[x0, y0], [x1, y0], [x1, y1], [x0, y1]];

const START = [
  { kind: "room", name: "walls", points: rectangle([0, 0], [4, 2.5]), reflectance: "0.6", emission: "0" },
  { kind: "lamp", name: "lamp", points: rectangle([1.6, 2.3], [2.4, 2.35]), reflectance: "0.1", emission: "1" },
  { kind: "block", name: "table", points: rectangle([1.2, 0.7], [2.2, 0.75]), reflectance: "0.3", emission: "0" },
  { kind: "block", name: "cupboard", points: rectangle([3.3, 0.1], [3.8, 1.6]), reflectance: "0.5", emission: "0" },
  { kind: "wall", name: "screen", points: [[0.4, 0.3], [0.8, 1.4]], reflectance: "0.5", emission: "0" },
];

/** The surfaces of a thing, as a file says them: of a thin wall its two sides. */
const surfaces = ({ kind, name, points, reflectance, emission }) => {
  const closed = () => {
    const around = turned(points, kind === "room");
    return [...around, around[0]];
  };
  const lines = kind === "wall" ? [[`${name}, one side`, points], [`${name}, other side`, points.toReversed()]] : [[name, closed()]];
  return lines
    .map(
      ([name, line]) => `[[problem.surface]]
name = ${JSON.stringify(name)}
points = ${JSON.stringify(line.map((point) => point.map(round)))}
reflectance = ${reflectance}
emission = ${emission}
`,
    )
    .join("\n");
};

/** The things of a file's surfaces. */
const thingsOf = (tree) => {
  const found = [];
  for (const { name = "surface", points = [], reflectance = 0, emission = 0 } of tree.problem?.surface ?? []) {
    const isClosed = points.length > 3 && String(points[0]) === String(points.at(-1));
    const material = { reflectance: String(reflectance), emission: String(emission) };
    if (isClosed) {
      const own = points.slice(0, -1);
      const kind = area(own) > 0 ? "room" : emission > 0 ? "lamp" : "block";
      found.push({ kind, name, points: own, ...material });
    } else if (name.endsWith(", one side") && points.length === 2) {
      found.push({ kind: "wall", name: name.replace(/, one side$/, ""), points, ...material });
    }
  }
  return found;
};

export class Room extends Tab {
  things = structuredClone(START);
  chosen = 1;

  constructor(panel) {
    super(panel, "room");
    this.walks = this.field("walks");
    this.walks.value = "4";
    const later = afterwards(300, () => this.run());
    for (const name of ["reflectance", "emission"]) {
      this.field(name).addEventListener("input", () => {
        this.thing[name] = this.field(name).value;
        later();
      });
    }
    this.walks.addEventListener("input", later);
    this.field("thing").addEventListener("change", () => this.choose(Number(this.field("thing").value)));
    this.canvas = this.plot("light");
    this.canvas.addEventListener("pointerdown", (event) => this.begin(event));
    this.canvas.addEventListener("pointermove", (event) => this.move(event));
    this.canvas.addEventListener("pointerup", () => this.end());
    this.canvas.addEventListener("pointercancel", () => this.end());
    this.canvas.addEventListener("keydown", (event) => this.key(event));
    const remove = document.createElement("button");
    remove.type = "button";
    remove.textContent = "Remove the thing";
    remove.addEventListener("click", () => this.remove());
    panel.querySelector(".actions").prepend(remove);
  }

  get thing() {
    return this.things[this.chosen];
  }

  async open(files) {
    if (files) {
      const [text] = Object.values(files);
      const tree = JSON.parse(await this.solver.call("tree", [text]));
      const things = thingsOf(tree);
      if (things.length) this.things = things;
    }
    this.list();
    this.choose(Math.min(1, this.things.length - 1));
    await this.run();
  }

  files() {
    return { [NAME]: this.text() };
  }

  text() {
    return `[problem]
kind = "room"

${this.things.map(surfaces).join("\n")}
[galerkin]
cells = 400

[walk]
walks = 10000

[[target]]
name = "mean"
over = "all"
${this.things
  .filter(({ kind }) => kind !== "wall")
  .map(({ name }) => `\n[[target]]\nname = ${JSON.stringify(name)}\nover = ${JSON.stringify(name)}\n`)
  .join("")}`;
  }

  list() {
    const options = this.things.map(({ name }, i) => new Option(name, i));
    this.field("thing").replaceChildren(...options);
  }

  choose(number) {
    this.chosen = number;
    this.field("thing").value = number;
    for (const name of ["reflectance", "emission"]) this.field(name).value = this.thing[name];
    this.draw();
  }

  remove() {
    if (this.thing.kind === "room") return this.refuse("the walls of the room stay: draw the room anew instead");
    this.things.splice(this.chosen, 1);
    this.list();
    this.choose(0);
    this.run();
  }

  /** The lower left and the upper right corner of all things, with a margin. */
  get bounds() {
    const all = this.frozen ?? this.things.flatMap(({ points }) => points);
    const ends = [0, 1].map((k) => [Math.min(...all.map((p) => p[k])), Math.max(...all.map((p) => p[k]))]);
    const margin = 0.03 * Math.max(...ends.map(([low, high]) => high - low));
    return ends.map(([low, high]) => [low - margin, high + margin]);
  }

  /** The place of the mouse in the room. */
  placeOf(event) {
    const box = this.canvas.getBoundingClientRect();
    const [[left, right], [low, high]] = this.bounds;
    return [
      left + ((event.clientX - box.left) / box.width) * (right - left),
      high - ((event.clientY - box.top) / box.height) * (high - low),
    ];
  }

  get tool() {
    return this.panel.querySelector('[name="tool"]:checked').value;
  }

  begin(event) {
    this.canvas.setPointerCapture(event.pointerId);
    const place = this.placeOf(event);
    this.frozen = this.things.flatMap(({ points }) => points);
    if (this.tool !== "move") {
      this.drag = { from: place };
      return;
    }
    // The nearest thing that is no wall of the room, by the middle of what it covers.
    const distance = ({ points }) => {
      const ends = [0, 1].map((k) => points.map((point) => point[k]));
      const off = ends.map((own, k) => Math.max(Math.min(...own) - place[k], place[k] - Math.max(...own), 0));
      return Math.hypot(...off);
    };
    const near = this.things.map((thing, i) => [thing.kind === "room" ? Infinity : distance(thing), i]);
    const [least, number] = near.reduce((best, next) => (next[0] < best[0] ? next : best), [Infinity, -1]);
    if (least > 0.15 * (this.bounds[0][1] - this.bounds[0][0])) return;
    this.choose(number);
    this.drag = { from: place, points: structuredClone(this.thing.points) };
  }

  move(event) {
    if (!this.drag) return;
    const place = this.placeOf(event);
    const { from, points } = this.drag;
    if (points) {
      this.thing.points = points.map((point) => point.map((x, k) => round(x + place[k] - from[k])));
      this.run(true);
    } else {
      this.drag.to = place;
      this.draw();
    }
  }

  end() {
    const { from, to, points } = this.drag ?? {};
    this.drag = this.frozen = undefined;
    if (points) return this.run();
    if (from && to && Math.hypot(to[0] - from[0], to[1] - from[1]) > SHORTEST) this.add(this.tool, from, to);
    else if (from) this.draw();
  }

  /** Adds what was drawn from one place to another. */
  add(kind, from, to) {
    const ends = [from, to].map((place) => place.map(round));
    const points = kind === "wall" ? ends : rectangle(...ends);
    const material = { reflectance: kind === "lamp" ? "0.1" : "0.5", emission: kind === "lamp" ? "1" : "0" };
    if (kind === "room") this.things[this.things.findIndex((thing) => thing.kind === "room")].points = points;
    else {
      const names = new Set(this.things.map(({ name }) => name));
      let count = 1;
      while (names.has(`${kind} ${count}`)) count += 1;
      this.things.push({ kind, name: `${kind} ${count}`, points, ...material });
    }
    this.list();
    this.choose(kind === "room" ? 0 : this.things.length - 1);
    this.run();
  }

  /** Arrows move the chosen thing; Enter puts a new one in the middle. */
  key(event) {
    if (event.key === "Delete") return this.remove();
    if (event.key === "Enter" && this.tool !== "move") {
      const [x, y] = this.bounds.map(([low, high]) => (low + high) / 2);
      return this.add(this.tool, [x, y], [x + 0.4, y + 0.1]);
    }
    const step = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, STEP], ArrowDown: [0, -STEP] }[event.key];
    if (!step) return;
    event.preventDefault();
    this.thing.points = this.thing.points.map((point) => point.map((x, k) => round(x + step[k])));
    this.run();
  }

  /** The middles of pixels, row by row from the upper left. */
  grid(across) {
    const [[left, right], [low, high]] = this.bounds;
    const down = Math.max(1, Math.round((across * (high - low)) / (right - left)));
    const positions = new Float64Array(2 * across * down);
    for (let i = 0; i < across * down; i++) {
      positions[2 * i] = left + (((i % across) + 0.5) / across) * (right - left);
      positions[2 * i + 1] = high - ((Math.floor(i / across) + 0.5) / down) * (high - low);
    }
    return { across, down, positions };
  }

  checked() {
    this.accept();
    const [walks, ...material] = [
      this.numberOf("walks", [1, 1000], true),
      this.numberOf("reflectance", [0, 1]),
      this.numberOf("emission", [0, 1e9]),
    ];
    return [walks, ...material].includes(undefined) ? undefined : walks;
  }

  /** Finds the light: while a thing is moved coarsely, of which the newest state alone matters, and otherwise finer and finer. */
  async run(isMoving = false) {
    this.draw();
    const walks = this.checked();
    if (walks === undefined) return;
    this.wanted = { walks, isMoving };
    if (this.isRunning) {
      // A coarse picture is soon there; a fine one gives way.
      if (!this.isCoarse) this.solver.stop();
      return this.running;
    }
    this.isRunning = true;
    this.busy(true);
    this.running = this.work();
    await this.running;
  }

  async work() {
    try {
      while (this.wanted) {
        const { walks, isMoving } = this.wanted;
        this.wanted = undefined;
        this.isStopped = false;
        this.say("finding the light");
        for (const step of isMoving ? [COARSE] : [COARSE, ...FINE]) {
          this.isCoarse = step === COARSE;
          await this.see(step.across, step.walks ?? walks);
          if (this.wanted || this.isStopped) break;
        }
        if (!this.wanted && !isMoving && !this.isStopped) await this.solve();
      }
      if (this.isStopped) this.say("stopped; the last picture stays");
    } catch (error) {
      this.wanted = undefined;
      this.refuse(error.message.replace(/^room\.toml:\d+:\d+: /, ""));
    }
    this.busy(false);
    this.isRunning = false;
  }

  async see(across, walks) {
    const grid = this.grid(across);
    const found = await this.solver.call("field", [NAME, grid.positions, walks], this.files(), this.progress);
    if (found === null) return;
    this.picture = { ...grid, numbers: found, bounds: this.bounds };
    this.draw();
  }

  async solve() {
    const answer = await this.solver.solve(NAME, this.files(), this.progress);
    if (answer === null) return;
    this.print(answer);
    this.say(`${this.picture.across} × ${this.picture.down} pixels`);
  }

  /** Fills a canvas with every second number of the picture, from 0 or 1 on. */
  paint(canvas, first, [low, high]) {
    const { across, down, numbers } = this.picture;
    const small = new OffscreenCanvas(across, down);
    const image = new ImageData(across, down);
    for (let i = 0; i < across * down; i++) {
      const value = numbers[2 * i + first];
      const [r, g, b] = Number.isNaN(value) ? [0, 0, 0] : colour((value - low) / (high - low));
      image.data.set([r, g, b, 255], 4 * i);
    }
    small.getContext("2d").putImageData(image, 0, 0);
    const context = canvas.getContext("2d");
    context.imageSmoothingEnabled = false;
    context.drawImage(small, 0, 0, canvas.width, canvas.height);
  }

  draw() {
    const [[left, right], [low, high]] = this.bounds;
    const canvases = [this.canvas, this.plot("errors")];
    for (const canvas of canvases) {
      const [width, height] = [640, Math.round((640 * (high - low)) / (right - left))];
      // Setting a size clears the canvas.
      canvas.width = width;
      canvas.height = height;
    }
    if (this.picture && String(this.picture.bounds) === String(this.bounds)) {
      const { numbers } = this.picture;
      const [values, errors] = [0, 1].map((first) => numbers.filter((_, i) => i % 2 === first));
      const [light, error] = [rangeOf(values), rangeOf(errors)];
      this.paint(canvases[0], 0, [0, light[1]]);
      this.paint(canvases[1], 1, [0, error[1]]);
      const finite = errors.filter(Number.isFinite);
      const mean = Math.sqrt(finite.reduce((sum, x) => sum + x * x, 0) / (finite.length || 1));
      this.output("low", "0");
      this.output("high", short(light[1]));
      this.output("error", short(error[1]));
      this.output("mean-error", short(mean));
    }
    const scale = this.canvas.width / (right - left);
    const at = ([x, y]) => [(x - left) * scale, (high - y) * scale];
    for (const canvas of canvases) {
      const context = canvas.getContext("2d");
      const line = (points, isClosed, style, width) => {
        context.beginPath();
        points.forEach((point) => context.lineTo(...at(point)));
        if (isClosed) context.closePath();
        context.strokeStyle = style;
        context.lineWidth = width;
        context.stroke();
      };
      this.things.forEach(({ kind, points, emission }, i) => {
        const isChosen = i === this.chosen && canvas === this.canvas;
        line(points, kind !== "wall", isChosen ? "#4da3ff" : number(emission) > 0 ? "#fff3a0" : "#c0c6cd", isChosen ? 4 : 2.5);
      });
      if (this.drag?.to) {
        const { from, to } = this.drag;
        line(this.tool === "wall" ? [from, to] : rectangle(from, to), this.tool !== "wall", "#4da3ff", 2);
      }
    }
  }
}
