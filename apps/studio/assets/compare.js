// Two methods on the same input, at the same moment: the second is shown in the frame that the first shows.

import { call } from "./api.js";
import { overlap } from "./detecting.js";
import { Monitor } from "./monitor.js";
import { called } from "./names.js";

/** @typedef {import("./api.js").Facts} Facts */

export class Comparison {
  /** @param {HTMLElement} place @param {Monitor} first the picture of the first */
  constructor(place, first) {
    this.place = place;
    this.first = first;
    this.tracker = "";
    /** @type {number|null} */
    this.trial = null;
    /** Whom it is compared with. @type {number|null} */
    this.beside = null;
    /** @type {Monitor|null} */
    this.monitor = null;
    /** @type {HTMLElement|null} */
    this.difference = null;
    /** What the second trial calls the targets of the first. @type {Map<number, number>} */
    this.numbers = new Map();
  }

  /**
   * Opens a second trial on the same source, with the same boxes.
   * @param {number} beside @param {string} source @param {string} tracker @param {Facts} first @param {{ frame: number, what: string, target: number, box: number[] }[]} boxes
   */
  async open(beside, source, tracker, first, boxes) {
    await this.close();
    const { trial } = await call("POST", "/api/trials", { source, tracker, detector: first.seeking?.name, detector_parameters: first.seeking?.parameters, kept: false });
    [this.trial, this.beside, this.tracker] = [trial, beside, tracker];
    try {
      this.numbers.clear();
      // What a detector finds is the first target of both.
      if (first.seeking) this.numbers.set(1, 1);
      await this.order("speed", { times: null });
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
    this.place.replaceChildren(title, stage, this.difference);
    this.place.hidden = false;
    this.monitor = new Monitor(canvas, null, () => {});
    // From now on the first waits for the second, and tells what that one has.
    this.show(await call("POST", `/api/trials/${beside}/orders`, { order: "beside", trial }));
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

  /** What the first was told, as far as it is meant for both: the second is at the same frame, or ahead. @param {string} order @param {Record<string, any>} rest @param {Facts|null} first */
  async obey(order, rest, first) {
    const frame = first?.now?.frame ?? 0;
    if (order === "start" || order === "pause" || order === "stop") await this.order(order === "stop" ? "pause" : order);
    else if (order === "step") await this.order("seek", { frame: frame + 1 });
    else if (order === "seek") await this.order("seek", { frame: rest.frame });
  }

  /** Shows what the second has in the frame that the first shows. @param {Facts} first */
  show(first) {
    const { monitor, difference } = this;
    if (!monitor || !difference || !first.now || !first.beside) return;
    const { now, step_ms } = first.beside;
    monitor.background = this.first.background;
    monitor.selected = this.numbers.get(this.first.selected) ?? 0;
    monitor.show({ ...first, now: now ?? { ...first.now, records: [] }, names: {}, proposals: [] }, null);
    if (!now) { difference.textContent = `Frame ${first.now.frame} was not followed by ${this.tracker}.`; return; }
    const lines = first.now.records.map((r) => {
      const name = called(first, r.target);
      const box = now.records.find((o) => o.target === this.numbers.get(r.target))?.box;
      if (!r.box || !box) return `Target ${name}: only one of them has it.`;
      const apart = Math.hypot(r.box[0] + r.box[2] / 2 - box[0] - box[2] / 2, r.box[1] + r.box[3] / 2 - box[1] - box[3] / 2);
      return `Target ${name}: centres ${apart.toFixed(1)} px apart, overlap ${overlap(r.box, box).toFixed(2)}.`;
    });
    difference.textContent = `Frame ${now.frame}. ${lines.join(" ")} ${first.tracker}: ${first.step_ms.toFixed(1)} ms a frame, ${this.tracker}: ${step_ms.toFixed(1)} ms.`;
  }

  async close() {
    const { trial, beside } = this;
    [this.trial, this.beside, this.monitor, this.difference] = [null, null, null, null];
    this.place.hidden = true;
    this.place.replaceChildren();
    if (beside !== null) await call("POST", `/api/trials/${beside}/orders`, { order: "beside", trial: null }).catch(() => {});
    if (trial !== null) await call("DELETE", `/api/trials/${trial}`).catch(() => {});
  }
}
