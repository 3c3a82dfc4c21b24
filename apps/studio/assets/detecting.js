// A detector shows boxes to begin from in the frame shown; without any box, Start lets it find the target.

import { Parameters, fileWanted } from "./parameters.js";

/** @typedef {import("./api.js").Facts} Facts */

/** Of two boxes that overlap by less than this, one is not meant by the other. */
const MEANT = .2;

export class Detecting {
  /**
   * @param {{ select: HTMLSelectElement, place: HTMLElement, filter: HTMLInputElement, snap: HTMLInputElement, label: HTMLElement }} parts
   * @param {(detector: string|null, parameters: Record<string, any>) => void} choose
   */
  constructor(parts, choose) {
    this.parts = parts;
    this.choose = choose;
    /** @type {any[]} */
    this.detectors = [];
    /** What differs from the defaults. @type {Record<string, any>} */
    this.changes = {};
    /** @type {string|null} */
    this.described = null;
    /** What the trial had last. */
    this.told = "";
    this.parameters = new Parameters(parts.place, parts.filter, (key, value) => {
      this.changes[key] = value;
      choose(this.name, this.changes);
    }, "Detector", "d");
    parts.select.addEventListener("change", () => {
      this.changes = {};
      this.describe();
      choose(this.name, this.changes);
    });
  }

  /** The parameter of a file that the chosen one cannot do without. */
  get wants() { return fileWanted(this.detectors.find((d) => d.name === this.name), this.changes); }

  get name() { return this.parts.select.value || null; }

  /** @param {any[]} detectors as the registry has them */
  offer(detectors) {
    this.detectors = detectors;
    this.parts.select.append(...detectors.map((d) => new Option(d.name, d.name)));
  }

  /** What a source is opened with: a live one is searched from its first frame on. @param {string} source */
  atOnce(source) {
    return this.name && !this.wants && /^(camera:|rtsps?:)/.test(source) ? { detector: this.name, detector_parameters: this.changes } : {};
  }

  describe() {
    if (this.described === this.name) return;
    this.described = this.name;
    const detector = this.detectors.find((d) => d.name === this.name);
    this.parts.select.title = detector?.summary ?? "";
    this.parameters.build(detector?.parameters ?? []);
  }

  /** @param {Facts} facts */
  show(facts) {
    const name = facts.detector?.name ?? "";
    // One that was refused, for lack of its file say, stays chosen: its parameters are to be mended.
    if (name !== this.told) this.parts.select.value = this.told = name;
    this.parts.label.hidden = !facts.detector || facts.read_only === true;
    this.describe();
    if (facts.detector) this.parameters.fill(facts.detector.parameters);
  }
}

/** The proposal that holds this point, the smallest of several. @param {Facts|null} facts @param {{ x: number, y: number }} point @returns {number[]|null} */
export function proposalAt(facts, { x, y }) {
  const held = (facts?.proposals ?? []).filter(([l, t, w, h]) => x >= l && y >= t && x <= l + w && y <= t + h);
  return held.sort((a, b) => a[2] * a[3] - b[2] * b[3])[0]?.slice(0, 4) ?? null;
}

/** The proposal that a box drawn by hand means; the box itself where there is none. @param {Facts|null} facts @param {number[]} box */
export function snapped(facts, box) {
  const best = (facts?.proposals ?? []).map((p) => ({ p, shared: overlap(p, box) })).sort((a, b) => b.shared - a.shared)[0];
  return best && best.shared >= MEANT ? best.p.slice(0, 4) : box;
}

/** Intersection over union. @param {number[]} a @param {number[]} b */
export function overlap(a, b) {
  const shared = (/** @type {number} */ i) => Math.max(0, Math.min(a[i] + a[i + 2], b[i] + b[i + 2]) - Math.max(a[i], b[i]));
  const both = shared(0) * shared(1);
  return both / (a[2] * a[3] + b[2] * b[3] - both || 1);
}
