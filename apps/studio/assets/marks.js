// What is measured with, drawn over the picture as sharp as the screen is, and the magnifier.

/** @typedef {[number, number]} XY
 * @typedef {import("./measuring.js").Model} Model
 * @typedef {import("./results.js").Found} Found
 * @typedef {{ group: "stick"|"plane"|"origin"|"toward", index: number }} Handle */

/** How near a pointer must come to a mark, in pixels of the screen. */
const REACH = 9;
/** How much the magnifier enlarges a pixel of the picture, and how wide it is on the screen. */
const ENLARGED = 8, LENS = 152;
/** How long the longest arrow is that shows a velocity or an acceleration, in pixels of the screen. */
const ARROW = 90;
const RULER = "#ffd23f", AXES = "#7fe0ff", PATH = "#f0e442", VELOCITY = "#5cf08a", ACCELERATION = "#ff8a5c";

export class Marks {
  /** @param {import("./monitor.js").Monitor} monitor @param {HTMLCanvasElement} canvas @param {HTMLCanvasElement} lens */
  constructor(monitor, canvas, lens) {
    this.monitor = monitor;
    this.canvas = canvas;
    this.lens = lens;
    /** @type {Model|null} */
    this.model = null;
    /** @type {Found|null} */
    this.found = null;
    this.target = 0;
    this.layers = { path: true, velocity: true, acceleration: false };
    /** Where the keyboard points, and where the pointer is while something is placed. @type {XY|null} */
    this.cross = null;
    monitor.drawn = () => this.draw();
  }

  /** Where a point of the picture is on the stage, in pixels of the screen. @param {XY} point @returns {XY} */
  on([x, y]) {
    const { factor, left, top } = this.monitor.place;
    return [left + x * factor, top + y * factor];
  }

  /** The mark that is near a point of the picture. @param {XY} point @returns {Handle|null} */
  under(point) {
    const at = this.on(point);
    const near = handles(this.model).map(({ handle, xy }) => {
      const [x, y] = this.on(xy);
      return { handle, apart: Math.hypot(x - at[0], y - at[1]) };
    }).filter(({ apart }) => apart <= REACH).sort((a, b) => a.apart - b.apart);
    return near[0]?.handle ?? null;
  }

  draw() {
    const ratio = window.devicePixelRatio || 1;
    const [wide, high] = [this.canvas.clientWidth, this.canvas.clientHeight];
    if (this.canvas.width !== Math.round(wide * ratio) || this.canvas.height !== Math.round(high * ratio)) {
      [this.canvas.width, this.canvas.height] = [Math.round(wide * ratio), Math.round(high * ratio)];
    }
    const c = this.canvas.getContext("2d");
    if (!c) return;
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.clearRect(0, 0, wide, high);
    if (!this.model) { this.lens.hidden = true; return; }
    this.motion(c);
    this.rulers(c, this.model);
    if (this.cross) cross(c, this.on(this.cross), "#ffffff", 11);
    this.magnify();
  }

  /** @param {CanvasRenderingContext2D} c @param {Model} model */
  rulers(c, model) {
    const { stick, plane, origin, toward } = model;
    if (model.ruler === "stick") {
      const ends = stick.filter((end) => end !== null).map((end) => this.on(/** @type {XY} */ (end)));
      if (ends.length === 2) line(c, ends, RULER, 2);
      ends.forEach((end) => cross(c, end, RULER));
      if (ends.length === 2 && model.length) label(c, [(ends[0][0] + ends[1][0]) / 2, (ends[0][1] + ends[1][1]) / 2 - 8], model.length, RULER);
    }
    if (model.ruler === "plane") {
      const points = plane.map(([x, y]) => this.on([x, y]));
      if (points.length > 2) line(c, [...points, points[0]], RULER, 1.4, [5, 4]);
      points.forEach((point, i) => { cross(c, point, RULER); label(c, [point[0] + 8, point[1] - 8], `${i + 1}: ${plane[i][2]}, ${plane[i][3]}`, RULER); });
    }
    if (!origin) return;
    const at = this.on(origin);
    const to = toward ? this.on(toward) : null;
    const angle = to ? Math.atan2(to[1] - at[1], to[0] - at[0]) : -(Number(model.angle) || 0) * Math.PI / 180;
    const up = angle + (model.down ? Math.PI / 2 : -Math.PI / 2);
    for (const [name, turn] of /** @type {[string, number][]} */ ([["x", angle], ["y", up]])) {
      const tip = /** @type {XY} */ ([at[0] + 46 * Math.cos(turn), at[1] + 46 * Math.sin(turn)]);
      // On a plane the places of its points say where its axes go.
      if (model.ruler !== "plane") { arrow(c, at, tip, AXES); label(c, [tip[0] + 4, tip[1] + 4], name, AXES); }
    }
    cross(c, at, AXES);
    if (to) cross(c, to, AXES, 6);
  }

  /** Path, velocity and acceleration. @param {CanvasRenderingContext2D} c */
  motion(c) {
    const own = this.found?.targets.find((t) => t.target === this.target);
    const frame = this.monitor.facts?.now?.frame;
    if (!own || frame === undefined) return;
    if (this.layers.path) {
      let run = /** @type {XY[]} */ ([]);
      own.seen.forEach((seen, i) => {
        if (seen && own.frame[i] <= frame) { run.push(this.on([seen[0], seen[1]])); return; }
        line(c, run, PATH, 1.6);
        run = [];
      });
      line(c, run, PATH, 1.6);
    }
    const now = own.seen[own.frame.indexOf(frame)];
    if (!now) return;
    const at = this.on([now[0], now[1]]);
    for (const [name, i, color] of /** @type {["velocity"|"acceleration", number, string][]} */ ([["velocity", 2, VELOCITY], ["acceleration", 4, ACCELERATION]])) {
      if (!this.layers[name]) continue;
      const most = Math.max(...own.seen.map((s) => (s ? Math.hypot(s[i], s[i + 1]) : 0)));
      if (most > 0) arrow(c, at, [at[0] + now[i] / most * ARROW, at[1] + now[i + 1] / most * ARROW], color);
    }
  }

  /** The picture around the cross, every pixel a square. */
  magnify() {
    const { cross: at, lens, monitor } = this;
    const shown = at !== null && monitor.background !== null;
    lens.hidden = !shown;
    const c = lens.getContext("2d");
    if (!at || !monitor.background || !c) return;
    const ratio = window.devicePixelRatio || 1;
    [lens.width, lens.height] = [LENS * ratio, LENS * ratio];
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    const across = LENS / ENLARGED;
    c.imageSmoothingEnabled = false;
    c.drawImage(monitor.background, at[0] - across / 2, at[1] - across / 2, across, across, 0, 0, LENS, LENS);
    const inside = (/** @type {XY} */ [x, y]) => /** @type {XY} */ ([(x - at[0]) * ENLARGED + LENS / 2, (y - at[1]) * ENLARGED + LENS / 2]);
    handles(this.model).forEach(({ xy }) => cross(c, inside(xy), RULER, 9));
    cross(c, [LENS / 2, LENS / 2], "#ffffff", 16);
    // Where the pointer is not.
    const [x, y] = this.on(at);
    lens.style.left = x < this.canvas.clientWidth / 2 ? `${this.canvas.clientWidth - LENS - 8}px` : "8px";
    lens.style.top = y < this.canvas.clientHeight / 2 && x >= this.canvas.clientWidth / 2 ? `${Math.max(this.canvas.clientHeight - LENS - 8, 8)}px` : "8px";
  }

  /** The stage as it is seen. @returns {Promise<Blob|null>} */
  async picture() {
    const ratio = window.devicePixelRatio || 1;
    const all = document.createElement("canvas");
    [all.width, all.height] = [this.canvas.width, this.canvas.height];
    const c = all.getContext("2d");
    const { factor, left, top } = this.monitor.place;
    const source = this.monitor.canvas;
    c?.drawImage(source, left * ratio, top * ratio, source.width * factor * ratio, source.height * factor * ratio);
    c?.drawImage(this.monitor.over, 0, 0);
    c?.drawImage(this.canvas, 0, 0);
    return new Promise((done) => all.toBlob(done, "image/png"));
  }
}

/** @param {Model|null} model @returns {{ handle: Handle, xy: XY }[]} */
export function handles(model) {
  if (!model) return [];
  /** @type {{ handle: Handle, xy: XY|null }[]} */
  const all = [];
  if (model.ruler === "stick") model.stick.forEach((xy, index) => all.push({ handle: { group: "stick", index }, xy }));
  if (model.ruler === "plane") model.plane.forEach(([x, y], index) => all.push({ handle: { group: "plane", index }, xy: [x, y] }));
  all.push({ handle: { group: "origin", index: 0 }, xy: model.origin }, { handle: { group: "toward", index: 0 }, xy: model.toward });
  return /** @type {{ handle: Handle, xy: XY }[]} */ (all.filter(({ xy }) => xy !== null));
}

/** A line with a dark edge. @param {CanvasRenderingContext2D} c @param {XY[]} points @param {string} color @param {number} width @param {number[]} [dash] */
function line(c, points, color, width, dash = []) {
  if (points.length < 2) return;
  for (const [style, wide] of /** @type {[string, number][]} */ ([["rgba(0,0,0,.6)", width + 1.8], [color, width]])) {
    c.beginPath();
    points.forEach(([x, y], i) => (i ? c.lineTo(x, y) : c.moveTo(x, y)));
    c.setLineDash(dash);
    [c.strokeStyle, c.lineWidth] = [style, wide];
    c.stroke();
  }
  c.setLineDash([]);
}

/** A cross whose middle is free: what is below it can be seen. @param {CanvasRenderingContext2D} c @param {XY} at @param {string} color @param {number} [long] */
function cross(c, [x, y], color, long = 9) {
  const free = 2.5;
  for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) line(c, [[x + dx * free, y + dy * free], [x + dx * long, y + dy * long]], color, 1.5);
}

/** @param {CanvasRenderingContext2D} c @param {XY} from @param {XY} to @param {string} color */
function arrow(c, from, to, color) {
  const angle = Math.atan2(to[1] - from[1], to[0] - from[0]);
  if (Math.hypot(to[0] - from[0], to[1] - from[1]) < 1) return;
  const barb = (/** @type {number} */ turn) => /** @type {XY} */ ([to[0] - 8 * Math.cos(angle + turn), to[1] - 8 * Math.sin(angle + turn)]);
  line(c, [from, to], color, 2);
  line(c, [barb(.45), to, barb(-.45)], color, 2);
}

/** @param {CanvasRenderingContext2D} c @param {XY} at @param {string} text @param {string} color */
function label(c, [x, y], text, color) {
  c.font = "600 12px system-ui, \"DejaVu Sans\", sans-serif";
  [c.strokeStyle, c.lineWidth, c.fillStyle] = ["rgba(0,0,0,.75)", 3, color];
  c.strokeText(text, x, y);
  c.fillText(text, x, y);
}
