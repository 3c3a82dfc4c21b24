// Measuring: what is clicked in the picture makes a ruler, and the ruler makes metres of the trajectory.

import { call } from "./api.js";
import { Marks } from "./marks.js";
import { corner, empty, model, setting } from "./model.js";
import { Plots } from "./plots.js";
import { Results } from "./results.js";
import { Spots } from "./spots.js";

/** @typedef {import("./model.js").Model} Model
 * @typedef {[number, number]} XY
 * @typedef {import("./marks.js").Handle} Handle
 * @typedef {"stick"|"plane"|"origin"|"toward"} Tool
 * @typedef {{ $: (id: string) => any, monitor: import("./monitor.js").Monitor, panels: import("./panels.js").Panels, then: (act: () => Promise<any>) => any, seek: (frame: number) => void,
 *   fail: (error: unknown) => void }} Page */

/** Fields of the panel and what they are in the model. */
const FIELDS = { ruler: "ruler", length: "length", side: "side", "plane-unit": "plane_unit", angle: "angle", fps: "fps", click: "click", point: "point",
  method: "method", unit: "unit", fit: "fit", from: "from", to: "to", lines: "lines", zones: "zones" };
const SWITCHES = { down: "down", unsure: "unsure" };
const TOOLS = /** @type {Tool[]} */ (["stick", "plane", "origin", "toward"]);
/** How far around a click an edge is looked for, in pixels of the screen, and bounds of it in pixels of the picture. */
const NEAR = 8, RADII = [3, 12];
/** What can be undone at most. */
const MOST_STEPS = 200;
/** While a run goes on it is measured again after this many milliseconds. */
const AGAIN_AFTER = 1500;

export class Measuring {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    const { $, monitor } = page;
    this.model = empty();
    /** @type {string[]} */
    this.past = [];
    /** @type {string[]} */
    this.future = [];
    /** @type {Tool|null} */
    this.tool = null;
    /** @type {Handle|null} */
    this.dragged = null;
    /** @type {number|null} */
    this.trial = null;
    /** Of what the newest results are. */
    this.measured = "";
    this.measuredAt = 0;
    this.marks = new Marks(monitor, $("marks"), $("lens"));
    this.spots = new Spots($("spots"), (change) => this.change(change));
    this.plots = new Plots($("plot"), page.seek);
    this.results = new Results({ now: $("values"), facts: $("found"), events: $("happened") }, page.seek);
    monitor.tool = this;
    this.wire($);
  }

  get active() { return this.page.panels.shown === "measure"; }

  /** @param {Page["$"]} $ */
  wire($) {
    for (const [id, key] of Object.entries({ ...FIELDS, ...SWITCHES })) {
      $(`m-${id}`).addEventListener("change", () => this.change((m) => {
        const field = $(`m-${id}`);
        /** @type {any} */ (m)[key] = field.type === "checkbox" ? field.checked : field.value;
      }));
    }
    for (const tool of TOOLS) $(`click-${tool}`).addEventListener("click", () => this.take(this.tool === tool ? null : tool));
    $("no-axes").addEventListener("click", () => this.change((m) => { [m.origin, m.toward, m.angle] = [null, null, ""]; }));
    $("lens-file").addEventListener("click", () => $("m-camera").click());
    $("no-lens").addEventListener("click", () => this.change((m) => { m.camera = null; }));
    $("m-camera").addEventListener("change", () => this.page.then(async () => {
      const file = $("m-camera").files[0];
      $("m-camera").value = "";
      if (!file) return;
      const camera = await call("POST", "/api/cameras", new Blob([await file.text()], { type: "text/plain" }));
      this.change((m) => { m.camera = camera; });
    }));
    $("keep").addEventListener("click", () => this.page.then(() => this.keep(false)));
    $("replace").addEventListener("click", () => this.page.then(() => this.keep(true)));
    $("m-quantity").addEventListener("change", () => { this.plots.quantity = $("m-quantity").value; this.plots.draw(); });
    $("m-target").addEventListener("change", () => this.follow(Number($("m-target").value)));
    for (const layer of /** @type {("path"|"velocity"|"acceleration")[]} */ (["path", "velocity", "acceleration"])) {
      $(`show-${layer}`).addEventListener("change", () => { this.marks.layers[layer] = $(`show-${layer}`).checked; this.marks.draw(); });
    }
    $("svg").addEventListener("click", () => save(new Blob([this.plots.file()], { type: "image/svg+xml" }), `measure-${this.plots.quantity}.svg`));
    $("png").addEventListener("click", () => this.marks.picture().then((picture) => { if (picture) save(picture, "measure-picture.png"); }));
  }

  /** The panel was opened or closed. */
  async toggle() {
    const { $, monitor } = this.page;
    $("plots").hidden = !this.active;
    this.take(null);
    this.marks.model = this.active ? this.model : null;
    monitor.draw();
    if (this.active) await this.load();
  }

  /** While it is measured, undo and redo are of the ruler. @param {string} order @returns {boolean} whether it is dealt with */
  turnBack(order) {
    if (!this.active || (order !== "undo" && order !== "redo")) return false;
    if (order === "undo") this.turn(this.past, this.future); else this.turn(this.future, this.past);
    return true;
  }

  /** Another trial is looked at. @param {number|null} trial */
  async opened(trial) {
    if (trial === this.trial) return;
    this.trial = trial;
    [this.model, this.past, this.future, this.measured] = [empty(), [], [], ""];
    this.find(null);
    this.take(null);
    if (this.active) await this.load();
  }

  /** What was set before, or read from a file. */
  async load() {
    if (this.trial === null) { this.say("Open a clip first."); return; }
    const told = await call("GET", `/api/trials/${this.trial}/measuring`);
    if (!this.past.length) this.model = model(told);
    this.page.$("spreadsheet").hidden = !told.spreadsheets;
    this.kept(told.file);
    this.fill();
    await this.sync();
  }

  /** @param {{ read: string|null, place: string|null, warning: string|null }} file */
  kept({ read, place, warning }) {
    const { $ } = this.page;
    $("kept").textContent = warning ?? (read ? `Read from ${read}.` : place ? "" : "This source has no folder to keep a calibration in; download it.");
    $("keep").disabled = place === null;
    $("keep").title = place ? `Writes ${place}` : "";
  }

  /** Something was changed: what was before can be had again. @param {(model: Model) => void} change */
  change(change) {
    this.past.push(JSON.stringify(this.model));
    if (this.past.length > MOST_STEPS) this.past.shift();
    this.future = [];
    change(this.model);
    this.fill();
    this.page.then(() => this.sync());
  }

  /** @param {string[]} from @param {string[]} to */
  turn(from, to) {
    const before = from.pop();
    if (before === undefined) return;
    to.push(JSON.stringify(this.model));
    this.model = JSON.parse(before);
    this.fill();
    this.page.then(() => this.sync());
  }

  /** Shows the model in the panel and in the picture. */
  fill() {
    const { $ } = this.page;
    for (const [id, key] of Object.entries(FIELDS)) $(`m-${id}`).value = /** @type {any} */ (this.model)[key];
    for (const [id, key] of Object.entries(SWITCHES)) $(`m-${id}`).checked = /** @type {any} */ (this.model)[key];
    const { ruler, camera } = this.model;
    for (const part of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("#measure [data-of]"))) part.hidden = !part.dataset.of?.split(" ").includes(ruler);
    $("lens-facts").textContent = camera ? `${camera.picture.join(" × ")}, focal ${camera.focal.map((/** @type {number} */ f) => f.toFixed(0)).join(", ")} px` : "";
    $("no-lens").hidden = !camera;
    this.spots.show(this.model);
    if (this.active) this.marks.model = this.model;
    this.marks.draw();
  }

  /** Says what was set, and measures with it. */
  async sync() {
    const { trial, page } = this;
    const input = page.monitor.facts?.input;
    if (trial === null || !input) return;
    const made = setting(this.model, [input.width, input.height]);
    let problem = made.missing;
    if (made.setting) {
      try {
        const told = await call("PUT", `/api/trials/${trial}/measuring`, made.setting);
        problem = told.problem ?? undefined;
      } catch (error) { problem = error instanceof Error ? error.message : String(error); }
    }
    this.say(problem ?? "");
    for (const id of ["keep", "calibration-file"]) page.$(id).setAttribute("aria-disabled", String(problem !== undefined));
    page.$("replace").hidden = true;
    if (problem === undefined) await this.measure(); else this.find(null);
  }

  /** @param {string} problem */
  say(problem) { this.page.$("measure-problem").textContent = problem; }

  async measure() {
    const { trial } = this;
    const facts = this.page.monitor.facts;
    if (trial === null || !facts) return;
    [this.measured, this.measuredAt] = [now(facts), performance.now()];
    const found = await call("GET", `/api/trials/${trial}/measurement`);
    if (trial !== this.trial) return;
    this.say(found.problem ?? "");
    this.find(found.problem ? null : found);
  }

  /** @param {import("./results.js").Found|null} found */
  find(found) {
    const { $ } = this.page;
    this.marks.found = this.plots.found = found;
    const targets = found?.targets.map((t) => t.target) ?? [];
    $("m-target").replaceChildren(...targets.map((t) => new Option(`target ${t}`, String(t))));
    $("m-target").hidden = targets.length < 2;
    $("measured-files").hidden = found === null;
    for (const [id, format] of [["measured-csv", "csv"], ["spreadsheet", "xlsx"], ["measured-json", "json"], ["measured-events", "events"]]) {
      $(id).href = `/api/trials/${this.trial}/measurement/file?format=${format}`;
    }
    $("calibration-file").href = `/api/trials/${this.trial}/measuring/calibration`;
    this.results.show(found);
    this.follow(targets.includes(this.marks.target) ? this.marks.target : targets[0] ?? 0);
  }

  /** @param {number} target whose motion is plotted */
  follow(target) {
    this.page.$("m-target").value = String(target);
    this.marks.target = this.plots.target = this.results.target = target;
    this.plots.draw();
    this.cursor(this.page.monitor.facts);
  }

  /** The trial is somewhere else. @param {import("./api.js").Facts} facts */
  show(facts) {
    if (!this.active) return;
    this.cursor(facts);
    const due = facts.phase !== "running" || performance.now() - this.measuredAt > AGAIN_AFTER;
    if (this.trial !== null && this.measured !== now(facts) && due) {
      this.measured = now(facts);
      this.page.then(() => this.sync());
    }
  }

  /** @param {import("./api.js").Facts|null} facts */
  cursor(facts) {
    const frame = facts?.now?.frame ?? 0;
    this.plots.cursor(frame);
    this.results.cursor(frame);
    this.marks.draw();
  }

  /** Keeps the calibration beside the clip. @param {boolean} overwrite */
  async keep(overwrite) {
    const { $ } = this.page;
    try {
      const told = await call("POST", `/api/trials/${this.trial}/measuring/calibration`, { overwrite });
      this.kept({ ...told.file, warning: `Kept as ${told.file.read}.` });
      $("replace").hidden = true;
    } catch (error) {
      if (/** @type {any} */ (error).status !== 409 || overwrite || !String(error).includes("replaced")) throw error;
      $("kept").textContent = /** @type {Error} */ (error).message;
      $("replace").hidden = false;
    }
  }

  /** What clicks in the picture place from now on. @param {Tool|null} tool */
  take(tool) {
    this.tool = tool;
    this.dragged = null;
    for (const one of TOOLS) this.page.$(`click-${one}`).setAttribute("aria-pressed", String(one === tool));
    const canvas = this.page.monitor.canvas;
    if (tool === null) this.marks.cross = null;
    else {
      // The keyboard begins in the middle of what is seen.
      const { x, y } = this.page.monitor.zoom;
      this.marks.cross ??= [Math.round(x), Math.round(y)];
      if (tool === "plane" || tool === "stick") { if (this.model.ruler !== tool) this.change((m) => { m.ruler = tool; }); }
      canvas.focus();
    }
    this.marks.draw();
  }

  /** @param {{ x: number, y: number }} at @param {PointerEvent} event @returns {boolean} whether it is dealt with */
  down({ x, y }, event) {
    if (!this.active || event.button !== 0) return false;
    this.dragged = this.marks.under([x, y]);
    if (this.tool === null && this.dragged === null) return false;
    this.marks.cross = [x, y];
    this.marks.draw();
    return true;
  }

  /** @param {{ x: number, y: number }} at */
  move({ x, y }) {
    if (!this.active || (this.tool === null && this.dragged === null)) return false;
    this.marks.cross = [x, y];
    this.marks.draw();
    return true;
  }

  leave() {
    if (this.tool === null && this.dragged === null) return;
    this.marks.cross = null;
    this.marks.draw();
  }

  /** @param {{ x: number, y: number }} at @param {PointerEvent} event */
  up({ x, y }, event) {
    if (!this.active || (this.tool === null && this.dragged === null)) return false;
    const { tool, dragged } = this;
    this.dragged = null;
    if (tool === null) this.marks.cross = null;
    this.page.then(() => this.put([x, y], tool, dragged, event.altKey));
    return true;
  }

  /** A point was placed, or moved. @param {XY} at @param {Tool|null} tool @param {Handle|null} dragged @param {boolean} free whether it is taken as it is */
  async put(at, tool, dragged, free) {
    const round = (/** @type {number} */ v) => Math.round(v * 100) / 100;
    const sharp = free || !this.page.$("m-snap").checked ? at : await this.sharpened(at);
    const xy = /** @type {XY} */ (sharp.map(round));
    const of = dragged ?? { group: tool, index: -1 };
    this.change((m) => {
      if (of.group === "stick") {
        if (dragged) m.stick[of.index] = xy;
        else if (m.stick[0] && !m.stick[1]) m.stick[1] = xy;
        else m.stick = [xy, null];
      } else if (of.group === "plane") {
        if (dragged) m.plane[of.index] = [...xy, ...m.plane[of.index].slice(2)];
        else m.plane.push(corner(m, xy));
      } else if (of.group === "origin") m.origin = xy;
      else if (of.group === "toward") { m.toward = xy; m.angle = ""; }
    });
    const over = { stick: this.model.stick[1] !== null, plane: false, origin: true, toward: true };
    if (!dragged && tool && over[tool]) this.take(null);
  }

  /** @param {XY} at @returns {Promise<XY>} */
  async sharpened([x, y]) {
    const radius = Math.min(Math.max(NEAR / this.page.monitor.place.factor, RADII[0]), RADII[1]);
    const told = await call("GET", `/api/trials/${this.trial}/corner?x=${x}&y=${y}&radius=${radius}`);
    return [told.x, told.y];
  }

  /** @param {KeyboardEvent} event @returns {boolean} whether it is dealt with */
  key(event) {
    if (!this.active) return false;
    if (event.ctrlKey || event.metaKey) {
      const order = { z: event.shiftKey ? "redo" : "undo", y: "redo" }[event.key.toLowerCase()];
      return order !== undefined && this.turnBack(order);
    }
    const cross = this.marks.cross;
    if (this.tool === null || document.activeElement !== this.page.monitor.canvas) return false;
    const along = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (along) {
      const step = event.shiftKey ? 10 : event.altKey ? .1 : 1;
      const { x, y } = this.page.monitor.zoom;
      const [from, most] = [cross ?? [x, y], this.page.monitor.canvas];
      this.marks.cross = [Math.min(Math.max(from[0] + along[0] * step, 0), most.width), Math.min(Math.max(from[1] + along[1] * step, 0), most.height)];
      this.marks.draw();
    } else if (event.key === "Enter" && cross) {
      const tool = this.tool;
      this.page.then(() => this.put([...cross], tool, null, event.altKey));
    } else if (event.key === "Escape") this.take(null);
    else return false;
    return true;
  }
}

/** What results are of: they are made anew when it changes. @param {import("./api.js").Facts} facts */
const now = (facts) => `${facts.version} ${facts.head} ${facts.edits.length} ${facts.targets}`;

/** @param {Blob} blob @param {string} name */
export function save(blob, name) {
  const link = document.createElement("a");
  [link.href, link.download] = [URL.createObjectURL(blob), name];
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
