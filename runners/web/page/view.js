// Polygons in space on a canvas, by depth: no graphics card is needed, and the polygon of every pixel is known.

const subtract = (a, b) => a.map((x, k) => x - b[k]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((x) => x / Math.hypot(...a));

/** Nothing nearer is drawn, as a share of the size of all. */
const NEAREST = 1e-3;
const ANGLE = (40 * Math.PI) / 180;
const BACKGROUND = [38, 42, 48];

/** A pixel of this colour, as processors with the lowest byte first have it. */
const packed = ([red, green, blue]) => (255 << 24) | (blue << 16) | (green << 8) | red;

export class View {
  azimuth = -1.4;
  altitude = 0.25;
  zoom = 1;
  polygons = [];

  /** A canvas, and what is called with the number of a polygon that is clicked. */
  constructor(canvas, pick) {
    this.canvas = canvas;
    [canvas.width, canvas.height] = [640, 480];
    let last;
    let way = 0;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      [last, way] = [[event.clientX, event.clientY], 0];
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!last) return;
      const step = [event.clientX - last[0], event.clientY - last[1]];
      last = [event.clientX, event.clientY];
      way += Math.hypot(...step);
      this.turn(-0.008 * step[0], 0.008 * step[1]);
    });
    canvas.addEventListener("pointerup", (event) => {
      last = undefined;
      if (way > 4) return;
      const box = canvas.getBoundingClientRect();
      const place = [
        Math.floor(((event.clientX - box.left) / box.width) * canvas.width),
        Math.floor(((event.clientY - box.top) / box.height) * canvas.height),
      ];
      const found = this.owners?.[place[0] + place[1] * canvas.width];
      if (found >= 0) pick(found);
    });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom *= Math.exp(0.001 * event.deltaY);
      this.ask();
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const { key } = event;
      const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
      const zooms = { "+": 0.9, "-": 1 / 0.9 };
      if (turns[key]) this.turn(...turns[key]);
      else if (zooms[key]) this.zoom *= zooms[key];
      else return;
      event.preventDefault();
      this.ask();
    });
  }

  /** Shows polygons: each the corners of a part of a surface, whose active side sees them anticlockwise. */
  show(polygons) {
    this.polygons = polygons;
    const corners = polygons.flat();
    const ends = [0, 1, 2].map((k) => {
      const [low, high] = corners.reduce(([low, high], c) => [Math.min(low, c[k]), Math.max(high, c[k])], [Infinity, -Infinity]);
      return [low, high];
    });
    this.middle = ends.map(([low, high]) => (low + high) / 2);
    this.size = Math.hypot(...ends.map(([low, high]) => high - low)) || 1;
    this.normals = polygons.map(([a, b, ...rest]) => cross(subtract(b, a), subtract(rest[0], a)));
  }

  /** The colour of every polygon: red, green and blue from 0 to 255. */
  paint(colours) {
    this.colours = colours;
    this.ask();
  }

  turn(azimuth, altitude) {
    this.azimuth += azimuth;
    this.altitude = Math.min(1.5, Math.max(-1.5, this.altitude + altitude));
    this.ask();
  }

  /** Draws before the next frame. */
  ask() {
    this.asked ??= requestAnimationFrame(() => {
      this.asked = undefined;
      this.draw();
    });
  }

  draw() {
    const { width, height } = this.canvas;
    const image = new ImageData(width, height);
    const pixels = new Uint32Array(image.data.buffer);
    pixels.fill(packed(BACKGROUND));
    const depths = new Float32Array(width * height);
    const owners = (this.owners = new Int32Array(width * height).fill(-1));
    const [ca, sa, ch, sh] = [Math.cos(this.azimuth), Math.sin(this.azimuth), Math.cos(this.altitude), Math.sin(this.altitude)];
    const back = [ca * ch, sa * ch, sh];
    const from = this.middle.map((x, k) => x + 1.35 * this.zoom * this.size * back[k]);
    const right = unit([-sa, ca, 0]);
    const up = cross(back, right);
    const focus = height / 2 / Math.tan(ANGLE / 2);
    const nearest = NEAREST * this.size;
    this.polygons.forEach((polygon, number) => {
      // Backs are seen through.
      if (dot(this.normals[number], subtract(from, polygon[0])) <= 0) return;
      const seen = polygon.map((corner) => {
        const ray = subtract(corner, from);
        return [dot(ray, right), dot(ray, up), -dot(ray, back)];
      });
      const clipped = seen.flatMap((a, i) => {
        const b = seen[(i + 1) % seen.length];
        const kept = a[2] >= nearest ? [a] : [];
        if (a[2] >= nearest !== b[2] >= nearest) {
          const share = (nearest - a[2]) / (b[2] - a[2]);
          kept.push(a.map((x, k) => x + share * (b[k] - x)));
        }
        return kept;
      });
      // The inverse of the depth is linear on the picture.
      const places = clipped.map(([x, y, z]) => [width / 2 + (focus * x) / z, height / 2 - (focus * y) / z, 1 / z]);
      const colour = packed(this.colours[number]);
      for (let i = 1; i + 1 < places.length; i++) fill([places[0], places[i], places[i + 1]], colour, number);
    });
    function fill([a, b, c], colour, number) {
      const twice = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
      if (Math.abs(twice) < 1e-9) return;
      const top = Math.max(0, Math.ceil(Math.min(a[1], b[1], c[1]) - 0.5));
      const bottom = Math.min(height - 1, Math.floor(Math.max(a[1], b[1], c[1]) - 0.5));
      const left = Math.max(0, Math.ceil(Math.min(a[0], b[0], c[0]) - 0.5));
      const end = Math.min(width - 1, Math.floor(Math.max(a[0], b[0], c[0]) - 0.5));
      // The shares of b and c at a pixel are linear, too.
      const [vx, vy] = [(c[1] - a[1]) / twice, (a[0] - c[0]) / twice];
      const [wx, wy] = [(a[1] - b[1]) / twice, (b[0] - a[0]) / twice];
      const [toB, toC] = [b[2] - a[2], c[2] - a[2]];
      for (let row = top; row <= bottom; row++) {
        const [x, y] = [left + 0.5 - a[0], row + 0.5 - a[1]];
        let v = x * vx + y * vy;
        let w = x * wx + y * wy;
        for (let at = left + row * width; at <= end + row * width; at++, v += vx, w += wx) {
          if (v < -1e-6 || w < -1e-6 || v + w > 1 + 1e-6) continue;
          const depth = a[2] + v * toB + w * toC;
          if (depth <= depths[at]) continue;
          depths[at] = depth;
          owners[at] = number;
          pixels[at] = colour;
        }
      }
    }
    this.canvas.getContext("2d").putImageData(image, 0, 0);
  }
}
