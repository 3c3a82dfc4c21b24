// Two methods on the same input, in step: what the first is told, the second is told too.

import { call } from "./api.js";
import { overlap } from "./detecting.js";
import { Live } from "./live.js";
import { Monitor } from "./monitor.js";

export class Comparison {
  /** @param {HTMLElement} place @param {(error: unknown) => void} fail @param {() => void} changed */
  constructor(place, fail, changed) {
    this.place = place;
    this.fail = fail;
    this.changed = changed;
    /** @type {number|null} */
    this.trial = null;
    /** @type {Live|null} */
    this.live = null;
    /** @type {import("./api.js").Facts|null} */
    this.facts = null;
    /** @type {Monitor|null} */
    this.monitor = null;
    /** @type {HTMLElement|null} */
    this.difference = null;
    /** What the second trial calls the targets of the first. @type {Map<number, number>} */
    this.numbers = new Map();
  }

  /**
   * Opens a second trial on the same source, with the same boxes.
   * @param {string} source @param {string} tracker @param {import("./api.js").Facts} first @param {{ frame: number, what: string, target: number, box: number[] }[]} boxes
   */
  async open(source, tracker, first, boxes) {
    await this.close();
    const { trial } = await call("POST", "/api/trials", { source, tracker, detector: first.seeking?.name, detector_parameters: first.seeking?.parameters });
    this.trial = trial;
    try {
      this.numbers.clear();
      // What a detector finds is the first target of both.
      if (first.seeking) this.numbers.set(1, 1);
      for (const { frame, what, target, box } of boxes) {
        await this.order("seek", { frame });
        if (what === "add") await this.add(target, box);
        else await this.put(target, box);
      }
      if (first.now) await this.order("seek", { frame: first.now.frame });
    } catch (error) {
      await this.close();
      throw error;
    }
    const title = document.createElement("h2");
    title.textContent = `Compared: ${tracker}`;
    const stage = document.createElement("div");
    stage.className = "stage";
    const canvas = document.createElement("canvas");
    canvas.setAttribute("aria-label", `Picture with ${tracker}`);
    stage.append(canvas);
    this.difference = document.createElement("p");
    this.difference.className = "quiet";
    this.place.replaceChildren(title, stage, this.difference);
    this.place.hidden = false;
    this.monitor = new Monitor(canvas, /** @type {any} */ (null), () => {});
    this.live = new Live(trial, (facts, picture) => {
      this.facts = facts;
      this.monitor?.show(facts, picture);
      this.changed();
    }, () => {});
  }

  /** Follows one more target, which the first trial knows by this number. @param {number} target @param {number[]} box */
  async add(target, box) {
    const facts = await call("POST", `/api/trials/${this.trial}/targets`, { box });
    this.numbers.set(target, Math.max(...facts.targets));
  }

  /** @param {number} target @param {number[]} box */
  async put(target, box) {
    await call("PUT", `/api/trials/${this.trial}/targets/${this.numbers.get(target)}`, { box });
  }

  /** @param {number} target */
  async remove(target) {
    await call("DELETE", `/api/trials/${this.trial}/targets/${this.numbers.get(target)}`);
  }

  /** @param {string} order @param {Record<string, any>} [rest] */
  async order(order, rest = {}) {
    if (this.trial === null) return;
    await call("POST", `/api/trials/${this.trial}/orders`, { order, ...rest });
  }

  /** How far both are apart in the frame that both show. @param {import("./api.js").Facts|null} first */
  tell(first) {
    if (!this.difference || !this.facts?.now || !first?.now) return;
    const [a, b] = [first.now, this.facts.now];
    if (a.frame !== b.frame) { this.difference.textContent = `Frame ${b.frame}; the other is at ${a.frame}.`; return; }
    const lines = a.records.map((r) => {
      const other = b.records.find((o) => o.target === this.numbers.get(r.target));
      if (!r.box || !other?.box) return `Target ${r.target}: only one of them has it.`;
      const [p, q] = [r.box, other.box];
      const apart = Math.hypot(p[0] + p[2] / 2 - q[0] - q[2] / 2, p[1] + p[3] / 2 - q[1] - q[3] / 2);
      return `Target ${r.target}: centres ${apart.toFixed(1)} px apart, overlap ${overlap(p, q).toFixed(2)}.`;
    });
    this.difference.textContent = `Frame ${a.frame}. ${lines.join(" ")} ${first.tracker}: ${first.step_ms.toFixed(1)} ms a step, ${this.facts.tracker}: ${this.facts.step_ms.toFixed(1)} ms.`;
  }

  async close() {
    this.live?.close();
    const trial = this.trial;
    this.live = null;
    this.trial = null;
    this.facts = null;
    this.monitor = null;
    this.difference = null;
    this.place.hidden = true;
    this.place.replaceChildren();
    if (trial !== null) await call("DELETE", `/api/trials/${trial}`).catch(() => {});
  }
}
