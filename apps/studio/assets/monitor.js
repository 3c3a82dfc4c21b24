// The picture with what is known drawn on it, and boxes that are dragged.

import { proposalAt, snapped } from "./detecting.js";
import { called, colorOf } from "./names.js";

/** @typedef {import("./api.js").Facts} Facts */

/** What can be drawn, with its colour (Okabe and Ito) and dash. */
export const LAYERS = [
  { name: "estimated", label: "Estimated", color: "#ffffff", dash: [], on: true },
  { name: "measured", label: "Measured", color: "#009e73", dash: [], on: true },
  { name: "predicted", label: "Predicted", color: "#ff5a36", dash: [6, 3], on: true },
  { name: "trail", label: "Trail", color: "#f0e442", dash: [], on: true },
  { name: "search", label: "Searched region", color: "#56b4e9", dash: [2, 4], on: false },
  { name: "covariance", label: "Uncertainty", color: "#cc79a7", dash: [], on: true },
  { name: "truth", label: "Truth", color: "#e69f00", dash: [8, 4], on: true },
  { name: "judged", label: "", color: "#7fd6c2", dash: [1, 3], on: true },
  { name: "proposals", label: "Detected", color: "#c8b6ff", dash: [3, 2], on: true },
  { name: "words", label: "Names", color: "", dash: [], on: true },
];
/** The words' colour by state, and the estimated box's dash. */
const WORDS = { tracking: "#8fd0ff", unsure: "#f0a8d4", occluded: "#ffc04d", lost: "#ff9a6b" };
const DASHES = { unsure: [10, 4], lost: [2, 6] };
/** Frames of the trail. */
const TRAIL = 90;
/** A drag below this many pixels of the picture is a click. */
const CLICK = 3;
/** The side of the surroundings by which a point that was clicked is followed, pixels of the picture, as of `pursuit track --point`. */
const SURROUNDINGS = 31;
/** Two standard deviations of a Gaussian in the plane hold 86 % of it. */
const SIGMAS = 2;
/** Small pictures are enlarged by this much at most to fill the page. */
const MOST_FITTED = 6;

export class Monitor {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {((box: number[], more: boolean) => void)|null} picked called with left, top, width, height in pixels of the input, and whether
   *   it is one more target in any case; null where nothing can be picked
   * @param {(target: number) => void} chosen
   */
  constructor(canvas, picked, chosen) {
    this.canvas = canvas;
    this.picked = picked;
    this.chosen = chosen;
    this.picture = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    /** What is known is drawn over the picture as sharp as the screen is. */
    this.over = document.createElement("canvas");
    this.over.className = "over";
    this.over.setAttribute("aria-hidden", "true");
    canvas.after(this.over);
    this.context = /** @type {CanvasRenderingContext2D} */ (this.over.getContext("2d"));
    this.layers = Object.fromEntries(LAYERS.map((l) => [l.name, l.on]));
    /** @type {Facts|null} */
    this.facts = null;
    /** @type {HTMLCanvasElement|null} */
    this.background = null;
    /** @type {number[]|null} */
    this.draft = null;
    /** @type {{ x: number, y: number }|null} */
    this.from = null;
    this.selected = 0;
    /** Where the pointer is that moves the picture. @type {number[]|null} */
    this.held = null;
    /** Fingers on the picture: two of them move and enlarge it. @type {Map<number, { x: number, y: number }>} */
    this.fingers = new Map();
    /** The target under the pointer. */
    this.hovered = 0;
    /** What an evaluation says of one frame. @type {import("./runs.js").Judged|null} */
    this.judged = null;
    /** Whether nothing can be changed: then a drag draws nothing. */
    this.frozen = false;
    /** Whether a box drawn near one of the detector's becomes that one. */
    this.snap = false;
    /** @type {(target: number) => number[][]} */
    this.trailOf = () => [];
    /** Takes what the pointer does in place of the monitor, where it wants it. @type {import("./measuring.js").Measuring|null} */
    this.tool = null;
    /** Called when something was drawn. */
    this.drawn = () => {};
    /** How far the picture is enlarged beyond what fits, and which of its points is in the middle of the stage. */
    this.zoom = { times: 1, x: 0, y: 0 };
    /** Where the picture is on the stage: pixels of the screen for one of its own, and its corner. */
    this.place = { factor: 1, left: 0, top: 0 };
    if (picked !== null) this.listen();
    new ResizeObserver(() => this.fit()).observe(/** @type {HTMLElement} */ (canvas.parentElement));
  }

  listen() {
    this.canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.enlarge(1.25 ** (-event.deltaY / 100), this.at(event));
    }, { passive: false });
    this.canvas.addEventListener("pointerdown", (event) => {
      if (!this.facts || event.button > 1) return;
      this.canvas.setPointerCapture(event.pointerId);
      this.canvas.focus({ preventScroll: true });
      if (event.pointerType === "touch") {
        this.fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
        if (this.fingers.size > 1) { this.from = this.draft = null; this.tool?.leave(); return; }
      }
      if (event.button === 1 || event.ctrlKey || event.metaKey) { event.preventDefault(); this.held = [event.clientX, event.clientY]; return; }
      if (this.tool?.down(this.at(event), event)) return;
      this.from = this.at(event);
      this.draft = null;
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (this.fingers.size > 1) { this.pinch(event); return; }
      if (this.held) {
        this.move(event.clientX - this.held[0], event.clientY - this.held[1]);
        this.held = [event.clientX, event.clientY];
        return;
      }
      if (this.tool?.move(this.at(event))) return;
      if (!this.from) this.hover(this.under(this.at(event)));
      if (!this.from || this.frozen) return;
      this.draft = this.meant(between(this.from, this.at(event)), event);
      this.draw();
    });
    this.canvas.addEventListener("pointerleave", () => { this.tool?.leave(); this.hover(0); });
    this.canvas.addEventListener("pointerup", (event) => {
      // The last finger of two draws nothing.
      if (this.fingers.size > 1) { this.fingers.delete(event.pointerId); return; }
      this.fingers.delete(event.pointerId);
      if (this.held) { this.held = null; return; }
      if (this.tool?.up(this.at(event), event)) return;
      if (!this.from) return;
      const box = this.meant(between(this.from, this.at(event)), event);
      const to = this.at(event);
      this.from = null;
      this.draft = null;
      if (box[2] >= CLICK && box[3] >= CLICK) { if (!this.frozen) this.picked?.(box, event.shiftKey); }
      else {
        // A click on a box of the detector's takes it: for the chosen target, or where no target is.
        const under = this.under(to), proposal = this.frozen || !this.layers.proposals ? null : proposalAt(this.facts, to);
        const elsewhere = this.selected ? under !== this.selected : under === 0;
        if (proposal && elsewhere) this.picked?.(proposal, event.shiftKey || !this.selected);
        // Points are clicked: each is a target, and of the chosen one a click puts it right.
        else if (followsPoints(this.facts) && !this.frozen && (under === 0 || event.shiftKey)) this.picked?.(around(to, SURROUNDINGS), event.shiftKey || !this.selected);
        else this.chosen(under);
      }
      this.draw();
    });
    this.canvas.addEventListener("pointercancel", () => { this.from = this.draft = this.held = null; this.fingers.clear(); this.draw(); });
  }

  /** Moves the picture by pixels of the screen. @param {number} x @param {number} y */
  move(x, y) {
    [this.zoom.x, this.zoom.y] = [this.zoom.x - x / this.place.factor, this.zoom.y - y / this.place.factor];
    this.fit();
  }

  /** Two fingers move the picture with their middle, and enlarge it as they go apart. @param {PointerEvent} event */
  pinch(event) {
    const span = () => {
      const [a, b] = [...this.fingers.values()];
      return { apart: Math.hypot(a.x - b.x, a.y - b.y), clientX: (a.x + b.x) / 2, clientY: (a.y + b.y) / 2 };
    };
    const before = span();
    this.fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const now = span();
    this.move(now.clientX - before.clientX, now.clientY - before.clientY);
    this.enlarge(now.apart / Math.max(before.apart, 1), this.at(now));
  }

  /** @param {number} target */
  hover(target) {
    if (target === this.hovered) return;
    this.hovered = target;
    this.draw();
  }

  /** Makes the picture as large as there is room, and as much larger as it is zoomed. */
  fit() {
    const room = this.canvas.parentElement;
    if (!room?.clientWidth || !room.clientHeight) return;
    const { width, height } = this.canvas;
    const [wide, high] = [room.clientWidth, room.clientHeight];
    const factor = Math.min(wide / width, high / height, MOST_FITTED) * this.zoom.times;
    // No further than that the picture's edge is at the stage's.
    const held = (/** @type {number} */ at, /** @type {number} */ side, /** @type {number} */ room) =>
      (side * factor <= room ? side / 2 : Math.min(Math.max(at, room / factor / 2), side - room / factor / 2));
    [this.zoom.x, this.zoom.y] = [held(this.zoom.x, width, wide), held(this.zoom.y, height, high)];
    this.place = { factor, left: wide / 2 - this.zoom.x * factor, top: high / 2 - this.zoom.y * factor };
    Object.assign(this.canvas.style, { width: `${width * factor}px`, height: `${height * factor}px`, left: `${this.place.left}px`, top: `${this.place.top}px` });
    this.canvas.classList.toggle("enlarged", this.zoom.times > 1 && factor > 3);
    this.draw();
  }

  /** Enlarges the picture, and leaves this point of it where it is. @param {number} times @param {{ x: number, y: number }} [point] */
  enlarge(times, { x, y } = this.zoom) {
    const before = this.zoom.times;
    this.zoom.times = Math.min(Math.max(before * times, 1), 40);
    const turn = before / this.zoom.times;
    [this.zoom.x, this.zoom.y] = [x + (this.zoom.x - x) * turn, y + (this.zoom.y - y) * turn];
    this.fit();
  }

  /** @param {{ clientX: number, clientY: number }} event @returns {{ x: number, y: number }} in pixels of the input, inside the picture */
  at(event) {
    const place = this.canvas.getBoundingClientRect();
    const inside = (/** @type {number} */ v, /** @type {number} */ most) => Math.min(Math.max(v, 0), most);
    return {
      x: inside((event.clientX - place.left) * this.canvas.width / place.width, this.canvas.width),
      y: inside((event.clientY - place.top) * this.canvas.height / place.height, this.canvas.height),
    };
  }

  /** The box that was meant. @param {number[]} box @param {PointerEvent} event */
  meant(box, event) {
    return (this.snap || event.altKey) && box[2] >= CLICK && box[3] >= CLICK ? snapped(this.facts, box) : box;
  }

  /** The target whose box holds this point; 0: none. @param {{ x: number, y: number }} point */
  under({ x, y }) {
    const holds = (/** @type {number[]|undefined} */ b) => b && x >= b[0] && y >= b[1] && x <= b[0] + b[2] && y <= b[1] + b[3];
    return this.facts?.now?.records.find((r) => holds(r.box))?.target ?? 0;
  }

  /** @param {Facts} facts @param {ImageBitmap|VideoFrame|null} picture */
  show(facts, picture) {
    this.facts = facts;
    const { width, height } = facts.input;
    if (this.canvas.width !== width || this.canvas.height !== height) {
      [this.canvas.width, this.canvas.height] = [width, height];
      this.zoom.times = 1;
      this.fit();
    }
    if (picture) {
      this.background ??= document.createElement("canvas");
      [this.background.width, this.background.height] = [width, height];
      const [wide, high] = "displayWidth" in picture ? [picture.displayWidth, picture.displayHeight] : [picture.width, picture.height];
      // Video has even sides: what was added is left out.
      const { width: columns = wide, height: rows = high } = facts.picture;
      // Of an input that is looked at in part, the part stands where it was taken from.
      const [left, top, across, down] = facts.input.region ?? [0, 0, width, height];
      this.background.getContext("2d")?.drawImage(picture, 0, 0, columns, rows, left, top, across, down);
    }
    this.draw();
  }

  /** Shows nothing any more. */
  clear() {
    this.facts = this.background = null;
    this.draw();
  }

  /** Ways to look at a frame, as far as its source has them. @param {HTMLSelectElement} select @param {Facts} facts */
  offer(select, facts) {
    const words = { picture: "picture", depth: "depth, near red, far blue", foreground: "what moves" };
    if ([...select.options].map((o) => o.value).join() !== facts.looks.join()) {
      select.replaceChildren(...facts.looks.map((look) => new Option(words[/** @type {"depth"} */ (look)] ?? look, look)));
    }
    if (document.activeElement !== select) select.value = facts.look;
    select.disabled = facts.looks.length < 2;
  }

  draw() {
    this.picture.clearRect(0, 0, this.canvas.width, this.canvas.height);
    if (this.background) this.picture.drawImage(this.background, 0, 0);
    const ratio = window.devicePixelRatio || 1;
    const size = [this.over.clientWidth, this.over.clientHeight].map((side) => Math.round(side * ratio));
    if (this.over.width !== size[0] || this.over.height !== size[1]) [this.over.width, this.over.height] = size;
    const { factor, left, top } = this.place;
    this.context.setTransform(1, 0, 0, 1, 0, 0);
    this.context.clearRect(0, 0, size[0], size[1]);
    // In pixels of the picture; lines are as thick on the screen whatever its size.
    this.context.setTransform(ratio * factor, 0, 0, ratio * factor, ratio * left, ratio * top);
    const unit = 1 / factor;
    this.drawn();
    const now = this.facts?.now;
    if (!now || !this.facts) return;
    if (this.layers.truth && now.truth) this.box(now.truth, "truth", unit);
    if (this.judged?.frame === now.frame) {
      if (this.judged.box) this.box(this.judged.box, "judged", unit, [], true);
      this.box(this.judged.truth, "truth", unit);
    }
    if (this.layers.proposals) for (const proposal of this.facts.proposals) this.box(proposal.slice(0, 4), "proposals", unit);
    for (const record of now.records) {
      if (!record.box) continue;
      if (this.layers.trail) this.trail(this.trailOf(record.target).slice(-TRAIL), unit);
      if (this.layers.search && record.searched) this.box(record.searched, "search", unit);
      const believed = record.state !== "lost";
      // Below the others, which are thinner: where all agree, each can be seen.
      const several = now.records.length > 1 || this.facts.names?.[record.target]?.color;
      if (this.layers.estimated) this.box(record.box, "estimated", unit, DASHES[/** @type {"lost"} */ (record.state)] ?? [], record.target === this.selected, several ? colorOf(this.facts, record.target) : undefined);
      if (this.layers.predicted && record.predicted && believed) this.box(record.predicted, "predicted", unit);
      if (this.layers.measured && record.measured && believed) this.box(record.measured, "measured", unit);
      if (this.layers.covariance && record.covariance && believed) this.ellipse(record.box, record.covariance, unit);
      if (this.layers.words) this.words(record, unit);
    }
    if (this.draft) this.box(this.draft, "estimated", unit, [5, 3], true);
  }

  /** @param {number[]} box @param {string} layer @param {number} unit @param {number[]} [dash] @param {boolean} [strong] @param {string} [color] */
  box([l, t, w, h], layer, unit, dash, strong = false, color = undefined) {
    const look = /** @type {typeof LAYERS[0]} */ (LAYERS.find((one) => one.name === layer));
    this.stroke(color ?? look.color, unit, dash?.length ? dash : look.dash, strong ? 5 : layer === "estimated" ? 3.4 : 1.5, () => this.context.rect(l, t, w, h));
  }

  /** A line with a dark edge, which shows on every ground.
   * @param {string} color @param {number} unit @param {number[]} dash @param {number} width @param {() => void} path */
  stroke(color, unit, dash, width, path) {
    const c = this.context;
    for (const [style, wide] of [["rgba(0,0,0,.55)", width + 1.6], [color, width]]) {
      c.beginPath();
      path();
      c.setLineDash(dash.map((d) => d * unit));
      c.strokeStyle = String(style);
      c.lineWidth = Number(wide) * unit;
      c.stroke();
    }
    c.setLineDash([]);
  }

  /** @param {number[][]} points @param {number} unit */
  trail(points, unit) {
    if (points.length < 2) return;
    this.stroke("#f0e442", unit, [], 1.4, () => points.forEach(([x, y], i) => (i ? this.context.lineTo(x, y) : this.context.moveTo(x, y))));
  }

  /** @param {number[]} box @param {number[]} covariance xx, xy, yy in square pixels @param {number} unit */
  ellipse([l, t, w, h], [xx, xy, yy], unit) {
    const mean = (xx + yy) / 2, half = Math.hypot((xx - yy) / 2, xy);
    const [a, b] = [mean + half, mean - half].map((v) => SIGMAS * Math.sqrt(Math.max(v, 0)));
    const angle = Math.atan2(2 * xy, xx - yy) / 2;
    this.stroke("#cc79a7", unit, [], 1.4, () => this.context.ellipse(l + w / 2, t + h / 2, Math.max(a, .5), Math.max(b, .5), angle, 0, 2 * Math.PI));
  }

  /** What a target is called; its state where that is not the best; all of the chosen one and of the one under the pointer. So labels hide little.
   * @param {import("./api.js").TargetRecord} record @param {number} unit */
  words(record, unit) {
    const [c, size] = [this.context, 13 * unit];
    const [l, t, , h] = /** @type {number[]} */ (record.box);
    const whole = record.target === this.selected || record.target === this.hovered;
    const name = called(this.facts, record.target);
    const text = whole ? `${name} ${record.state} ${(record.score ?? 0).toFixed(2)}` : record.state === "tracking" ? name : `${name} ${record.state}`;
    c.font = `600 ${size}px system-ui, "DejaVu Sans", sans-serif`;
    const wide = c.measureText(text).width + size * .6;
    const x = Math.min(Math.max(l, 0), Math.max(this.canvas.width - wide, 0));
    const y = t > size * 1.6 ? t - size * 1.55 : Math.min(t + h + size * .2, this.canvas.height - size * 1.4);
    c.fillStyle = "rgba(0,0,0,.72)";
    c.fillRect(x, y, wide, size * 1.35);
    c.fillStyle = WORDS[/** @type {"tracking"} */ (record.state)] ?? WORDS.lost;
    c.fillText(text, x + size * .3, y + size);
  }
}

/** The box between two points, in whole pixels: a hand is no more exact, and such a box can be written down and given again.
 * @param {{ x: number, y: number }} a @param {{ x: number, y: number }} b */
function between(a, b) {
  const [ax, ay, bx, by] = [a.x, a.y, b.x, b.y].map(Math.round);
  return [Math.min(ax, bx), Math.min(ay, by), Math.abs(ax - bx), Math.abs(ay - by)];
}

/** Whether what is followed are single points. @param {Facts|null} facts */
export function followsPoints(facts) { return facts?.tracker === "point"; }

/** A square about a point: left, top, width, height. @param {{ x: number, y: number }} point @param {number} side */
function around({ x, y }, side) { return [x - side / 2, y - side / 2, side, side]; }
