// Curves of what was measured, with bands of two standard deviations, and a cursor that moves with the video, both ways.

import { short } from "./results.js";

/** @typedef {import("./results.js").Found} Found
 * @typedef {import("./results.js").Motion} Motion
 * @typedef {{ name: string, color: string, values: (number|null)[], errors: (number|null)[] }} Curve */

const SVG = "http://www.w3.org/2000/svg";
const LEFT = 58, RIGHT = 10, TOP = 8, BOTTOM = 30;
/** Colours of Okabe and Ito. */
const COLORS = ["#0072b2", "#d55e00"];
/** What is drawn over time: curves and what stands behind the unit. */
const QUANTITIES = /** @type {Record<string, { names: string[], keys: string[], per: string }>} */ ({
  position: { names: ["x", "y"], keys: ["x", "y"], per: "" },
  velocity: { names: ["x", "y"], keys: ["vx", "vy"], per: "/s" },
  speed: { names: ["speed"], keys: ["speed"], per: "/s" },
  acceleration: { names: ["x", "y"], keys: ["ax", "ay"], per: "/s²" },
});

export class Plots {
  /** @param {HTMLElement} place @param {(frame: number) => void} seek */
  constructor(place, seek) {
    this.place = place;
    /** @type {Found|null} */
    this.found = null;
    this.target = 0;
    this.quantity = "position";
    this.frame = 0;
    /** @type {(frame: number) => void} */
    this.mark = () => {};
    let dragging = false;
    const go = (/** @type {PointerEvent} */ event) => {
      const frame = this.nearest?.(event.clientX - place.getBoundingClientRect().left, event.clientY - place.getBoundingClientRect().top);
      if (frame !== undefined) seek(frame);
    };
    place.addEventListener("pointerdown", (event) => { dragging = true; place.setPointerCapture(event.pointerId); go(event); });
    place.addEventListener("pointermove", (event) => { if (dragging) go(event); });
    place.addEventListener("pointerup", () => { dragging = false; });
    new ResizeObserver(() => this.draw()).observe(place);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  /** @returns {Motion|undefined} */
  get motion() { return this.found?.targets.find((t) => t.target === this.target); }

  /** The frame that a place of the plot stands for. @type {((x: number, y: number) => number|undefined)|undefined} */
  nearest;

  draw() {
    const { motion, found, place } = this;
    const [wide, high] = [place.clientWidth, place.clientHeight];
    this.nearest = undefined;
    this.mark = () => {};
    place.replaceChildren();
    if (!motion || !found || wide < 120 || high < 60) return;
    const style = getComputedStyle(place);
    const [ink, quiet] = [style.color, style.borderTopColor];
    const svg = node("svg", { xmlns: SVG, width: wide, height: high, viewBox: `0 0 ${wide} ${high}`, "font-family": "system-ui, 'DejaVu Sans', sans-serif", "font-size": 11, fill: ink });
    svg.append(node("rect", { width: wide, height: high, fill: style.backgroundColor }));
    const box = { wide, high, ink, quiet };
    if (this.quantity === "path") this.along(svg, motion, found.unit, box);
    else if (this.quantity === "residuals") this.residuals(svg, found, box);
    else this.over(svg, motion, found.unit, box);
    place.append(svg);
    place.setAttribute("aria-label", `Plot of ${this.quantity}`);
    this.cursor(this.frame);
  }

  /** Over time. @param {SVGElement} svg @param {Motion} motion @param {string} unit @param {Box} box */
  over(svg, motion, unit, box) {
    const { names, keys, per } = QUANTITIES[this.quantity] ?? QUANTITIES.position;
    const curves = names.map((name, i) => ({ name, color: COLORS[i], values: /** @type {any} */ (motion)[keys[i]][0], errors: /** @type {any} */ (motion)[keys[i]][1] }));
    const times = motion.time_s;
    const axes = new Axes(box, extent([times]), extent(curves.map((c) => spread(c))));
    axes.draw(svg, "time (s)", `${this.quantity} (${unit}${per})`);
    motion.how.forEach((how, i) => {
      if (how !== "bridged") return;
      const [from, to] = [axes.x(times[Math.max(i - 1, 0)]), axes.x(times[Math.min(i + 1, times.length - 1)])];
      svg.append(node("rect", { x: from, y: TOP, width: Math.max((to - from) / 2, 1), height: axes.bottom - TOP, fill: box.quiet, opacity: .35 }));
    });
    curves.forEach((curve, i) => {
      const dash = i ? "6 3" : "none";
      for (const run of runs(curve.values)) {
        const edge = (/** @type {number} */ k, /** @type {number} */ sign) => `${axes.x(times[k]).toFixed(1)},${axes.y(Number(curve.values[k]) + sign * 2 * Number(curve.errors[k])).toFixed(1)}`;
        const band = [...run.map((k) => edge(k, 1)), ...[...run].reverse().map((k) => edge(k, -1))];
        svg.append(node("polygon", { points: band.join(" "), fill: curve.color, opacity: .22 }));
        svg.append(node("polyline", { points: run.map((k) => `${axes.x(times[k]).toFixed(1)},${axes.y(Number(curve.values[k])).toFixed(1)}`).join(" "), fill: "none", stroke: curve.color, "stroke-width": 1.7, "stroke-dasharray": dash }));
      }
      legend(svg, i, `${curve.name} ± 2 σ`, curve.color, dash);
    });
    const line = svg.appendChild(node("line", { y1: TOP, y2: axes.bottom, stroke: box.ink, "stroke-width": 1.4, visibility: "hidden" }));
    this.mark = (frame) => {
      const i = near(motion.frame, frame);
      const x = axes.x(times[i]);
      [["x1", x], ["x2", x], ["visibility", "visible"]].forEach(([name, value]) => line.setAttribute(String(name), String(value)));
    };
    this.nearest = (x) => motion.frame[near(times, axes.time(x))];
  }

  /** Across the plane. @param {SVGElement} svg @param {Motion} motion @param {string} unit @param {Box} box */
  along(svg, motion, unit, box) {
    const [xs, ys] = [motion.x[0], motion.y[0]];
    const axes = new Axes(box, extent([xs, motion.measured_x]), extent([ys, motion.measured_y]), true);
    axes.draw(svg, `x (${unit})`, `y (${unit})`);
    motion.measured_x.forEach((x, i) => {
      const y = motion.measured_y[i];
      if (x !== null && y !== null) svg.append(node("circle", { cx: axes.x(x), cy: axes.y(y), r: 1.8, fill: COLORS[1] }));
    });
    for (const run of runs(xs)) svg.append(node("polyline", { points: run.map((k) => `${axes.x(Number(xs[k])).toFixed(1)},${axes.y(Number(ys[k])).toFixed(1)}`).join(" "), fill: "none", stroke: COLORS[0], "stroke-width": 1.7 }));
    legend(svg, 0, "estimate", COLORS[0], "none");
    legend(svg, 1, "measured", COLORS[1], "1.5 3");
    const spot = svg.appendChild(node("circle", { r: 5, fill: "none", stroke: box.ink, "stroke-width": 2, visibility: "hidden" }));
    this.mark = (frame) => {
      const i = near(motion.frame, frame);
      if (xs[i] === null || ys[i] === null) { spot.setAttribute("visibility", "hidden"); return; }
      [["cx", axes.x(Number(xs[i]))], ["cy", axes.y(Number(ys[i]))], ["visibility", "visible"]].forEach(([name, value]) => spot.setAttribute(String(name), String(value)));
    };
    this.nearest = (x, y) => {
      let [best, least] = [-1, Infinity];
      xs.forEach((value, i) => {
        if (value === null || ys[i] === null) return;
        const apart = Math.hypot(axes.x(value) - x, axes.y(Number(ys[i])) - y);
        if (apart < least) [best, least] = [i, apart];
      });
      return best < 0 ? undefined : motion.frame[best];
    };
  }

  /** What the fit leaves over. @param {SVGElement} svg @param {Found} found @param {Box} box */
  residuals(svg, found, box) {
    const fit = found.fits.find((f) => f.target === this.target);
    if (!fit) {
      svg.append(node("text", { x: LEFT, y: box.high / 2 }, "Nothing is fitted; choose a fit in the panel."));
      return;
    }
    const names = fit.axis ? [fit.axis] : ["x", "y"];
    const axes = new Axes(box, extent([fit.residuals.map(([t]) => t)]), extent(names.map((_, i) => fit.residuals.map(([, r]) => r[i]))));
    axes.draw(svg, "time (s)", `residual (${found.unit})`);
    names.forEach((name, i) => {
      for (const [t, r] of fit.residuals) svg.append(node("circle", { cx: axes.x(t), cy: axes.y(r[i]), r: 2, fill: COLORS[i] }));
      legend(svg, i, name, COLORS[i], "1.5 3");
    });
  }

  /** @param {number} frame */
  cursor(frame) {
    this.frame = frame;
    this.mark(frame);
    this.place.setAttribute("aria-valuenow", String(frame));
  }

  /** The plot as a file, as it is seen. */
  file() {
    return this.place.firstElementChild ? new XMLSerializer().serializeToString(this.place.firstElementChild) : "";
  }
}

/** @typedef {{ wide: number, high: number, ink: string, quiet: string }} Box */

class Axes {
  /** @param {Box} box @param {number[]} across @param {number[]} up @param {boolean} [equal] whether a unit is as long up as across */
  constructor(box, across, up, equal = false) {
    this.box = box;
    this.bottom = box.high - BOTTOM;
    const room = [box.wide - LEFT - RIGHT, this.bottom - TOP];
    if (equal) {
      const per = Math.max((across[1] - across[0]) / room[0], (up[1] - up[0]) / room[1]);
      const wider = (/** @type {number[]} */ [a, b], /** @type {number} */ side) => [(a + b) / 2 - per * side / 2, (a + b) / 2 + per * side / 2];
      [across, up] = [wider(across, room[0]), wider(up, room[1])];
    }
    this.across = across;
    this.up = up;
    this.room = room;
  }

  /** @param {number} value */
  x(value) { return LEFT + (value - this.across[0]) / (this.across[1] - this.across[0]) * this.room[0]; }
  /** @param {number} value */
  y(value) { return this.bottom - (value - this.up[0]) / (this.up[1] - this.up[0]) * this.room[1]; }
  /** What stands at a place across. @param {number} x */
  time(x) { return this.across[0] + (x - LEFT) / this.room[0] * (this.across[1] - this.across[0]); }

  /** @param {SVGElement} svg @param {string} below @param {string} beside */
  draw(svg, below, beside) {
    const { box, bottom } = this;
    for (const value of ticks(this.across, this.room[0] / 90)) {
      svg.append(node("line", { x1: this.x(value), x2: this.x(value), y1: TOP, y2: bottom, stroke: box.quiet, "stroke-width": .7 }));
      svg.append(node("text", { x: this.x(value), y: bottom + 13, "text-anchor": "middle" }, short(value)));
    }
    for (const value of ticks(this.up, this.room[1] / 34)) {
      svg.append(node("line", { x1: LEFT, x2: box.wide - RIGHT, y1: this.y(value), y2: this.y(value), stroke: box.quiet, "stroke-width": .7 }));
      svg.append(node("text", { x: LEFT - 5, y: this.y(value) + 4, "text-anchor": "end" }, short(value)));
    }
    svg.append(node("text", { x: LEFT + this.room[0] / 2, y: box.high - 4, "text-anchor": "middle" }, below));
    svg.append(node("text", { x: 12, y: TOP + this.room[1] / 2, "text-anchor": "middle", transform: `rotate(-90 12 ${TOP + this.room[1] / 2})` }, beside));
  }
}

/** @param {string} name @param {Record<string, string|number>} attributes @param {string} [text] */
function node(name, attributes, text) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  if (text !== undefined) made.textContent = text;
  return made;
}

/** @param {SVGElement} svg @param {number} i @param {string} text @param {string} color @param {string} dash */
function legend(svg, i, text, color, dash) {
  const x = LEFT + 10 + i * 92;
  svg.append(node("line", { x1: x, x2: x + 18, y1: TOP + 8, y2: TOP + 8, stroke: color, "stroke-width": 2.4, "stroke-dasharray": dash }));
  svg.append(node("text", { x: x + 23, y: TOP + 12 }, text));
}

/** Values with their bands, where bands are not so wide that nothing else could be seen. @param {Curve} curve */
function spread({ values, errors }) {
  const known = values.filter((v) => v !== null);
  const [low, most] = extent([known]);
  const room = most - low || 1;
  const edges = values.flatMap((v, i) => (v === null ? [] : [v - 2 * Number(errors[i]), v + 2 * Number(errors[i])]));
  return edges.map((v) => Math.min(Math.max(v, low - room / 2), most + room / 2));
}

/** @param {(number|null)[][]} columns @returns {[number, number]} */
function extent(columns) {
  let [low, most] = [Infinity, -Infinity];
  for (const value of columns.flat()) if (value !== null && Number.isFinite(value)) [low, most] = [Math.min(low, value), Math.max(most, value)];
  if (low > most) return [0, 1];
  return low === most ? [low - .5, most + .5] : [low, most];
}

/** Stretches in which something is known. @param {(number|null)[]} values */
function runs(values) {
  /** @type {number[][]} */
  const all = [];
  values.forEach((value, i) => {
    if (value === null) return;
    if (all.at(-1)?.at(-1) === i - 1) all.at(-1)?.push(i); else all.push([i]);
  });
  return all;
}

/** Where a sorted column is nearest to a value. @param {number[]} column @param {number} value */
function near(column, value) {
  const after = column.findIndex((v) => v >= value);
  if (after < 0) return column.length - 1;
  return after > 0 && value - column[after - 1] < column[after] - value ? after - 1 : after;
}

/** @param {number[]} extent @param {number} count */
function ticks([low, most], count) {
  const rough = (most - low) / Math.max(count, 1);
  const ten = 10 ** Math.floor(Math.log10(rough));
  const step = ten * ([1, 2, 5].find((s) => s * ten >= rough) ?? 10);
  const all = [];
  for (let k = Math.ceil(low / step); k * step <= most + 1e-9 * step; k += 1) all.push(k * step);
  return all;
}
