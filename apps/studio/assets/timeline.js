// Score and state, or another quantity, of every target over the frames; corrections are marked, a click goes there.

/** @typedef {[number, string, number, number[], number|null, boolean]} RowRecord target, state, score, box, innovation, whether followed backward */
/** @typedef {[number, number, RowRecord[]]} Row frame, time, records */

const COLORS = { tracking: "--tracking", unsure: "--unsure", occluded: "--occluded", lost: "--lost" };
/** Share of the band's height that each state has: told apart without colours. */
const TALL = { tracking: 1, unsure: .8, occluded: .6, lost: .35 };
/** Height of the band that shows a target's state, of all bands together, and of the corrections' marks, in pixels: the curve keeps its place
 * whatever the number of targets. */
const BAND = 7, BANDS = 22, MARKS = 10;

export class Timeline {
  /** @param {HTMLCanvasElement} canvas @param {(frame: number) => void} seek */
  constructor(canvas, seek) {
    this.canvas = canvas;
    this.seek = seek;
    /** @type {Row[]} */
    this.rows = [];
    /** @type {Row[]} */
    this.rival = [];
    /** @type {import("./api.js").Facts|null} */
    this.facts = null;
    /** All targets that there are in any frame. @type {number[]} */
    this.targets = [];
    this.quantity = "score";
    /** Whether nothing can be changed: then a click goes nowhere. */
    this.frozen = false;
    let dragging = false;
    const go = (/** @type {PointerEvent} */ event) => {
      if (this.frozen) return;
      const place = canvas.getBoundingClientRect();
      const [first, last] = this.range();
      this.seek(Math.round(first + (event.clientX - place.left) / place.width * (last - first)));
    };
    canvas.addEventListener("pointerdown", (event) => { dragging = true; canvas.setPointerCapture(event.pointerId); go(event); });
    canvas.addEventListener("pointermove", (event) => { if (dragging) go(event); });
    canvas.addEventListener("pointerup", () => { dragging = false; });
    new ResizeObserver(() => this.draw()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  /** The first and the last frame shown. */
  range() {
    const first = this.facts?.first ?? 0;
    const known = this.facts?.input.frame_count;
    const last = known ? known - 1 : this.facts?.head ?? first + 1;
    return [first, Math.max(last, first + 1)];
  }

  /** @param {import("./api.js").Facts} facts */
  show(facts) {
    this.facts = facts;
    const [first, last] = this.range();
    const now = facts.now?.frame ?? first;
    for (const [name, value] of [["min", first], ["max", last], ["now", now]]) this.canvas.setAttribute(`aria-value${name}`, String(value));
    this.draw();
  }

  draw() {
    const c = this.canvas.getContext("2d");
    if (!c) return;
    const ratio = window.devicePixelRatio || 1;
    const [wide, high] = [this.canvas.clientWidth, this.canvas.clientHeight];
    if (this.canvas.width !== Math.round(wide * ratio) || this.canvas.height !== Math.round(high * ratio)) {
      [this.canvas.width, this.canvas.height] = [Math.round(wide * ratio), Math.round(high * ratio)];
    }
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    const ink = inks();
    c.fillStyle = ink("--field");
    c.fillRect(0, 0, wide, high);
    if (!this.facts) return;
    const [first, last] = this.range();
    const x = (/** @type {number} */ frame) => (frame - first) / (last - first) * (wide - 2) + 1;
    const targets = this.targets = [...new Set(this.rows.flatMap(([, , records]) => records.map((r) => r[0])))].sort((a, b) => a - b);
    const each = Math.min(BAND + 2, BANDS / Math.max(targets.length, 1));
    const [top, bottom] = [MARKS + 2, high - targets.length * each - 15];
    this.grid(c, ink, first, last, x, bottom, high);
    const [low, most] = this.extent();
    const y = (/** @type {number} */ v) => bottom - (v - low) / (most - low || 1) * (bottom - top);
    c.fillStyle = ink("--quiet");
    c.font = "11px system-ui, \"DejaVu Sans\", sans-serif";
    c.fillText(label(most), 4, top + 8);
    c.fillText(label(low), 4, bottom - 1);
    this.curves(c, this.rival, x, y, () => ink("--quiet"), [4, 3]);
    this.curves(c, this.rows, x, y, (state) => ink(COLORS[/** @type {"lost"} */ (state)] ?? "--ink"), []);
    targets.forEach((target, i) => this.band(c, target, bottom + 3 + i * each, Math.max(each - 2, 1), x, ink));
    c.fillStyle = ink("--edit");
    for (const edit of this.facts.edits) {
      const at = x(edit.frame);
      c.beginPath();
      c.moveTo(at - 5, 1);
      c.lineTo(at + 5, 1);
      c.lineTo(at, MARKS - 2);
      c.fill();
    }
    if (this.facts.now) {
      c.fillStyle = ink("--ink");
      c.fillRect(x(this.facts.now.frame) - 1, 0, 2, high);
    }
  }

  /** @param {CanvasRenderingContext2D} c @param {(name: string) => string} ink @param {number} first @param {number} last
   * @param {(frame: number) => number} x @param {number} bottom @param {number} high */
  grid(c, ink, first, last, x, bottom, high) {
    const step = 10 ** Math.ceil(Math.log10((last - first) / 10 || 1));
    const every = (last - first) / step < 4 ? Math.max(step / 4, 1) : step;
    c.font = "11px system-ui, \"DejaVu Sans\", sans-serif";
    for (let frame = Math.ceil(first / every) * every; frame <= last; frame += every) {
      c.fillStyle = ink("--edge");
      c.fillRect(x(frame), MARKS, 1, bottom - MARKS);
      c.fillStyle = ink("--quiet");
      const text = String(Math.round(frame));
      const half = c.measureText(text).width / 2;
      c.fillText(text, Math.min(Math.max(x(frame) - half, 2), this.canvas.clientWidth - 2 * half - 2), high - 3);
    }
  }

  /** @param {CanvasRenderingContext2D} c @param {Row[]} rows @param {(f: number) => number} x @param {(v: number) => number} y
   * @param {(state: string) => string} color @param {number[]} dash */
  curves(c, rows, x, y, color, dash) {
    /** @type {Map<number, [number, number, number]>} */
    const last = new Map();
    c.lineWidth = 1.6;
    c.setLineDash(dash);
    for (const [frame, , records] of rows) {
      for (const record of records) {
        const value = quantity(record, this.quantity);
        if (value === null) { last.delete(record[0]); continue; }
        const before = last.get(record[0]);
        if (before && frame - before[2] <= 60) {
          c.strokeStyle = color(record[1]);
          c.beginPath();
          c.moveTo(before[0], before[1]);
          c.lineTo(x(frame), y(value));
          c.stroke();
        }
        last.set(record[0], [x(frame), y(value), frame]);
      }
    }
    c.setLineDash([]);
  }

  /** @param {CanvasRenderingContext2D} c @param {number} target @param {number} top @param {number} height @param {(f: number) => number} x
   * @param {(name: string) => string} ink */
  band(c, target, top, height, x, ink) {
    for (const [frame, , records] of this.rows) {
      const record = records.find((r) => r[0] === target);
      if (!record) continue;
      c.fillStyle = ink(COLORS[/** @type {"lost"} */ (record[1])]);
      const tall = height * (TALL[/** @type {"lost"} */ (record[1])] ?? 1);
      const wide = Math.max(x(frame + 1) - x(frame) + .5, 1);
      c.fillRect(x(frame), top + height - tall, wide, tall);
      if (!record[5]) continue;
      c.fillStyle = ink("--edit");
      c.fillRect(x(frame), top - 1, wide, 2);
    }
  }

  extent() {
    if (this.quantity === "score") return [0, 1];
    const values = [...this.rows, ...this.rival].flatMap(([, , records]) => records.map((r) => quantity(r, this.quantity)))
      .filter((v) => v !== null);
    if (!values.length) return [0, 1];
    const [low, most] = values.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
    return low === most ? [low - 1, most + 1] : [low, most];
  }
}

/** The style's colours as a canvas takes them: those of light or of dark, as the page has it now. */
function inks() {
  const probe = document.body.appendChild(document.createElement("span"));
  /** @type {Map<string, string>} */
  const colors = new Map();
  for (const name of ["--field", "--ink", "--quiet", "--edge", "--edit", ...Object.values(COLORS)]) {
    probe.style.color = `var(${name})`;
    colors.set(name, getComputedStyle(probe).color);
  }
  probe.remove();
  return (/** @type {string} */ name) => colors.get(name) ?? "";
}

/** @param {RowRecord} record @param {string} name @returns {number|null} */
function quantity([, , score, [l, t, w, h], innovation], name) {
  switch (name) {
    case "x": return l + w / 2;
    case "y": return t + h / 2;
    case "size": return Math.sqrt(w * h);
    case "innovation": return innovation;
    default: return score;
  }
}

/** @param {number} value */
function label(value) {
  return Number(value.toPrecision(3)).toString();
}
