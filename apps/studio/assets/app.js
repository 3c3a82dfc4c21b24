// The page: what the user does becomes calls, what comes back is shown.

import { call } from "./api.js";
import { Comparison } from "./compare.js";
import { Detecting } from "./detecting.js";
import { listen } from "./keyboard.js";
import { Live } from "./live.js";
import { Measuring } from "./measuring.js";
import { LAYERS, Monitor } from "./monitor.js";
import { Parameters } from "./parameters.js";
import { Runs } from "./runs.js";
import { Sources } from "./source.js";
import { Targets } from "./targets.js";
import { Timeline } from "./timeline.js";
import { freeze, outlook } from "./watching.js";
import { advice } from "./words.js";

/** @param {string} id @returns {any} */
const $ = (id) => document.getElementById(id);
/** How often the time line asks for what is new, in milliseconds. */
const ROWS_EVERY = 400;
/** The key Enter in the field of the source is a change of it as well as a wish to open it: it is opened once, within these milliseconds. */
const AGAIN_AFTER = 1500;
const PHASES = { ready: "ready", running: "running", paused: "paused", stopped: "stopped", ended: "the end is reached", failed: "failed" };

/** @type {{ trackers: any[], info: any, trial: number|null, source: string, facts: import("./api.js").Facts|null, live: Live|null,
 *   selected: number, nudged: number[]|null, shownVersion: string }} */
const state = { trackers: [], info: null, trial: null, source: "", facts: null, live: null, selected: 0, nudged: null, shownVersion: "" };
/** When a source was opened last. */
let opened = -Infinity;
/** Things happen in the order they were asked for. */
let queue = Promise.resolve();

/** @param {() => Promise<any>} act */
function then(act) {
  queue = queue.then(act).catch(fail);
  return queue;
}

/** @param {unknown} error */
function fail(error) {
  $("notice").hidden = false;
  $("notice").firstElementChild.textContent = error instanceof Error ? error.message : String(error);
}

/** @param {string} text */
function say(text) { $("status").textContent = text; }

const monitor = new Monitor($("picture"), (box) => then(() => take(box)), choose);
const measuring = new Measuring({ $, monitor, then, fail, seek: (frame) => then(() => order("seek", { frame })) });
const targets = new Targets($("rows"), $("no-targets"), choose, (target) => then(() => removeTarget(target)));
const timeline = new Timeline($("line"), (frame) => then(() => order("seek", { frame })));
const parameters = new Parameters($("schema"), $("filter"), (key, value) => then(() => change({ [key]: value })));
const detecting = new Detecting({ select: $("detector"), place: $("detector-schema"), filter: $("filter"), snap: $("snap"), label: $("snap-label") },
  (detector, parameters) => then(() => detect(detector, parameters)));
const comparison = new Comparison($("comparison"), fail, () => { comparison.tell(state.facts); });
new Runs({ button: $("runs"), dialog: $("results"), list: $("run-list"), detail: $("run-detail"), close: $("close-runs") }, (tracker, source, frame, judged) => then(async () => {
  if (entry(tracker)) { $("tracker").value = tracker; describe(tracker); }
  await open(source);
  monitor.judged = judged;
  await order("seek", { frame });
}), (run) => then(() => open(run, { run })), fail);
const sources = new Sources({ input: $("source"), list: $("sources"), browse: $("browse"), files: $("files"), upload: $("upload"), file: $("file") },
  (source) => then(() => open(source)), fail, say);

/** @param {string} source @param {Record<string, any>} [what] what is opened, where it is no source that is followed by the method chosen */
async function open(source, what) {
  if (!source.trim() && !what) return;
  $("notice").hidden = true;
  say(`Opening ${source} …`);
  try {
    const answer = await call("POST", "/api/trials", what ?? { source, tracker: $("tracker").value, parameters: motionWanted(), ...detecting.atOnce(source) });
    source = answer.source ?? source;
    await leave();
    monitor.judged = null;
    opened = performance.now();
    Object.assign(state, { trial: answer.trial, source, selected: 0 });
    sessionStorage.setItem("trial", JSON.stringify({ trial: answer.trial, source }));
    await watch();
    const detector = what ? null : detecting.name;
    show(answer.facts, null);
    await measuring.opened(answer.trial);
    await setSpeed();
    if (detector) await detect(detector, detecting.changes);
  } catch (error) {
    say(state.facts ? "" : "No source is open.");
    throw error;
  }
}

/** @param {string|null} detector @param {Record<string, any>} parameters */
async function detect(detector, parameters) {
  if (state.trial !== null) accept(await call("PUT", `/api/trials/${state.trial}/detector`, { detector, parameters }));
}

/** A motion model chosen before a source was opened is part of the method. */
function motionWanted() {
  const default_model = motionOf(entry($("tracker").value))?.default;
  return $("motion").value && $("motion").value !== default_model ? { motion: { model: $("motion").value } } : {};
}

async function leave() {
  await setRival("");
  state.live?.close();
  const old = state.trial;
  Object.assign(state, { trial: null, facts: null, live: null, selected: 0, nudged: null });
  timeline.rows = [];
  if (old !== null) await call("DELETE", `/api/trials/${old}`).catch(() => {});
}

async function watch() {
  if (state.trial === null) return;
  state.live = new Live(state.trial, show, (how) => {
    const words = { connecting: "connecting …", live: "live", lost: "connection lost, trying again …", over: "this trial is over", ended: "the run is over" };
    $("connection").dataset.state = how === "over" ? "lost" : how === "ended" ? "over" : how === "connecting" && $("connection").dataset.state === "lost" ? "lost" : how;
    $("connection").textContent = words[how];
    // What is no longer there need not be closed.
    if (how === "over") state.trial = null;
    if (how === "over") fail(new Error("The studio was started again, or the trial was closed. Open the source once more."));
  });
}

/** @param {import("./api.js").Facts} facts @param {ImageBitmap|VideoFrame|null} picture */
function show(facts, picture) {
  const before = state.facts;
  state.facts = facts;
  $("empty").hidden = true;
  $("exports").hidden = facts.read_only === true;
  $("source").value = document.activeElement === $("source") ? $("source").value : state.source;
  if (before?.tracker !== facts.tracker) {
    $("tracker").value = facts.tracker;
    describe(facts.tracker);
  }
  parameters.fill(facts.parameters);
  detecting.show(facts);
  monitor.offer($("look"), facts);
  const model = facts.parameters.motion?.model;
  if (model && document.activeElement !== $("motion")) $("motion").value = model;
  if (state.selected && !facts.targets.includes(state.selected)) state.selected = 0;
  monitor.selected = state.selected;
  monitor.show(facts, picture);
  targets.show(facts.now, state.selected);
  timeline.show(facts);
  measuring.show(facts);
  comparison.tell(facts);
  const { input, now } = facts;
  const frames = input.frame_count ? ` of ${input.frame_count}` : "";
  say(`${state.source || input.name} · ${input.width} × ${input.height} · frame ${now?.frame ?? "–"}${frames} · ${(now?.time_s ?? 0).toFixed(2)} s · ${
    PHASES[/** @type {"ready"} */ (facts.phase)]} · ${facts.step_ms.toFixed(1)} ms a step${facts.remark ? ` · ${facts.remark}` : ""}`);
  if (facts.message && facts.message !== before?.message) fail(new Error(facts.message));
  if (now && document.activeElement !== $("seek")) $("seek").value = now.frame;
  hint();
  buttons(facts);
  versions(facts);
}

/** @param {import("./api.js").Facts} facts */
function buttons(facts) {
  const running = facts.phase === "running";
  const useless = { start: running, pause: !running, stop: facts.phase === "ready" || facts.phase === "stopped", back: facts.now?.frame === facts.first,
    step: facts.phase === "ended" && facts.now?.frame === facts.head };
  for (const [id, off] of Object.entries(useless)) $(id).setAttribute("aria-disabled", String(off));
}

function hint() {
  const { facts } = state;
  if (!facts) return;
  $("backward-label").hidden = facts.input.live || facts.read_only === true || state.info?.picking || !facts.targets.length;
  $("hint").textContent = facts.read_only ? outlook(facts) : advice(facts, state.selected, state.info?.picking === true);
}

/** @param {import("./api.js").Facts} facts */
function versions(facts) {
  const key = JSON.stringify([facts.version, facts.versions.map((v) => v.number), state.trial]);
  if (key !== state.shownVersion) {
    state.shownVersion = key;
    const old = facts.versions.map((v) => new Option(`${v.number}: ${v.tracker}, until ${v.why}`, String(v.number)));
    $("version").replaceChildren(new Option(`${facts.version}: now`, ""), ...old.reverse());
    // What was followed after a correction is followed again.
    timeline.rows = [];
    links();
  }
}

function links() {
  const version = $("version").value ? `&version=${$("version").value}` : "";
  for (const format of ["table", "csv", "mot", "coco", "cvat"]) $(format).href = `/api/trials/${state.trial}/trajectory?format=${format}${version}`;
}

/** @param {string} name @param {Record<string, any>} [rest] */
async function order(name, rest = {}) {
  if (state.trial === null) throw new Error("no source is open yet; name one under “Source”");
  $("notice").hidden = true;
  const both = [call("POST", `/api/trials/${state.trial}/orders`, { order: name, ...rest })];
  if (comparison.trial !== null) both.push(comparison.order(name, rest));
  const [facts] = await Promise.all(both);
  accept(facts);
}

/** @param {import("./api.js").Facts} facts */
function accept(facts) { if (facts) show(facts, null); }

/** A box was drawn: a correction of the chosen target, else one more. @param {number[]} box */
async function take(box) {
  if (state.trial === null) return;
  $("notice").hidden = true;
  const target = state.selected;
  const path = `/api/trials/${state.trial}/targets`;
  const facts = await (target ? call("PUT", `${path}/${target}`, { box, backward: $("backward").checked && !$("backward-label").hidden }) : call("POST", path, { box }));
  accept(facts);
  if (comparison.trial !== null) await (target ? comparison.put(target, box) : comparison.add(Math.max(...facts.targets), box));
  if (state.info.picking) {
    state.live?.close();
    $("connection").dataset.state = "none";
    $("hint").textContent = "The box was taken. The command goes on in the terminal; this page can be closed.";
    say($("hint").textContent);
    sessionStorage.removeItem("trial");
    state.trial = null;
    return;
  }
  await refresh();
}

/** @param {number} target */
async function removeTarget(target) {
  accept(await call("DELETE", `/api/trials/${state.trial}/targets/${target}`));
  if (comparison.trial !== null) await comparison.remove(target);
}

/** @param {number} target */
function choose(target) {
  state.selected = state.selected === target ? 0 : target;
  state.nudged = null;
  if (state.facts) show(state.facts, null);
}

/** @param {Record<string, any>} changes */
async function change(changes) {
  if (state.trial === null) return;
  $("notice").hidden = true;
  try {
    accept(await call("PUT", `/api/trials/${state.trial}/parameters`, changes));
  } finally {
    if (state.facts) parameters.fill(state.facts.parameters);
  }
}

/** @param {string} name */
const entry = (name) => state.trackers.find((t) => t.name === name);
/** @param {any} tracker */
const motionOf = (tracker) => tracker?.parameters.find((/** @type {any} */ p) => p.name === "motion")?.parameters.find((/** @type {any} */ p) => p.name === "model");

/** The parameters of a tracker, and the motion models there are. @param {string} name */
function describe(name) {
  const tracker = entry(name);
  if (!tracker) return;
  $("tracker").title = tracker.summary;
  parameters.build(tracker.parameters);
  const model = motionOf(tracker);
  $("motion").replaceChildren(...(model?.choices ?? []).map((/** @type {string} */ c) => new Option(c, c)));
  if (model) { $("motion").value = model.default; $("motion").title = model.doc; }
}

async function setSpeed() {
  const value = $("speed").value;
  if (state.trial !== null) await order("speed", { times: value === "max" ? null : Number(value) });
}

/** @param {string} tracker */
async function setRival(tracker) {
  $("rival").value = tracker;
  document.querySelector("main")?.classList.toggle("compared", tracker !== "");
  timeline.rival = [];
  if (!tracker) { await comparison.close(); return; }
  if (!state.facts) throw new Error("open a source first, then compare");
  if (state.facts.input.live) throw new Error("a live source cannot be seen twice; compare on a file");
  await order("pause");
  const rows = await allRows(state.trial, 0);
  const boxes = state.facts.edits.filter((e) => e.what === "add" || e.what === "correct").map(({ frame, what, target }) => ({ frame, what,
    target: target ?? 0, box: rows.find((r) => r[0] === frame)?.[2].find((r) => r[0] === target)?.[3] ?? [] })).filter(({ box }) => box.length === 4);
  await comparison.open(state.source, tracker, state.facts, boxes);
}

/** @param {number|null} trial @param {number} from @returns {Promise<import("./timeline.js").Row[]>} */
async function allRows(trial, from) {
  const rows = [];
  for (let next = from; next !== null;) {
    const part = await call("GET", `/api/trials/${trial}/rows?from=${next}`);
    rows.push(...part.rows);
    next = part.next;
  }
  return rows;
}

let refreshing = false;
/** Gets what is new for the time line. */
async function refresh() {
  const trial = state.trial;
  if (trial === null || refreshing || !state.facts) return;
  refreshing = true;
  try {
    const version = state.shownVersion;
    const last = timeline.rows.at(-1)?.[0] ?? -1;
    // The newest row may have been edited.
    const fresh = await allRows(trial, Math.max(last, 0));
    if (trial === state.trial && version === state.shownVersion) {
      const first = state.facts.first ?? 0;
      timeline.rows = [...timeline.rows.filter((r) => r[0] >= first && r[0] < (fresh[0]?.[0] ?? Infinity)), ...fresh];
      if (comparison.trial !== null) timeline.rival = await allRows(comparison.trial, 0);
      timeline.draw();
    }
  } catch { /* said by whatever the user does next */ } finally { refreshing = false; }
}

monitor.trailOf = (target) => {
  const now = state.facts?.now?.frame ?? 0;
  return timeline.rows.filter((r) => r[0] <= now).slice(-90).flatMap(([, , records]) => records.filter((r) => r[0] === target))
    .map(([, , , [l, t, w, h]]) => [l + w / 2, t + h / 2]);
};

function wire() {
  $("dismiss").addEventListener("click", () => { $("notice").hidden = true; });
  $("open-form").addEventListener("submit", (/** @type {Event} */ event) => { event.preventDefault(); then(() => openNamed(performance.now() - opened > AGAIN_AFTER)); });
  $("source").addEventListener("change", () => then(() => openNamed(false)));
  // What is wished for is what stands there now: until its turn comes, what is shown may say otherwise.
  /** @param {string} id @param {(value: string) => Promise<any>} act */
  const changed = (id, act) => $(id).addEventListener("change", () => { const { value } = $(id); then(() => act(value)); });
  changed("tracker", async (tracker) => {
    describe(tracker);
    if (state.trial !== null) accept(await call("PUT", `/api/trials/${state.trial}/method`, { tracker }));
  });
  changed("motion", (model) => change({ "motion.model": model }));
  $("speed").addEventListener("change", () => then(setSpeed));
  for (const name of ["start", "pause", "step", "back", "stop"]) {
    // A run that goes on to a frame far ahead is not waited for.
    const now = name === "pause" || name === "stop" ? (/** @type {() => Promise<any>} */ act) => act().catch(fail) : then;
    $(name).addEventListener("click", () => now(async () => {
      // A source that was named and not yet opened is opened first.
      if (now === then) await openNamed(false);
      if (name === "back" && state.facts?.now?.frame === state.facts?.first) return;
      await order(name);
    }));
  }
  changed("seek", (frame) => order("seek", { frame: Math.max(0, Math.round(Number(frame) || 0)) }));
  $("quantity").addEventListener("change", () => { timeline.quantity = $("quantity").value; timeline.draw(); });
  changed("rival", (rival) => setRival(rival).catch((error) => { $("rival").value = ""; document.querySelector("main")?.classList.remove("compared"); throw error; }));
  $("version").addEventListener("change", links);
  for (const [id, times] of /** @type {[string, number][]} */ ([["zoom-in", 1.5], ["zoom-out", 1 / 1.5], ["zoom-fit", 0]])) $(id).addEventListener("click", () => monitor.enlarge(times));
  changed("look", (at) => order("look", { at }));
  $("snap").addEventListener("change", () => { monitor.snap = $("snap").checked; });
  for (const layer of LAYERS.filter((l) => l.label)) {
    const label = document.createElement("label");
    const box = document.createElement("input");
    Object.assign(box, { type: "checkbox", checked: layer.on });
    box.addEventListener("change", () => { monitor.layers[layer.name] = box.checked; monitor.draw(); });
    const swatch = document.createElement("i");
    if (layer.color) swatch.style.borderColor = layer.color === "#ffffff" ? "light-dark(#555, #fff)" : layer.color;
    else swatch.hidden = true;
    label.append(box, swatch, layer.label);
    $("layers").append(label);
  }
  listen({ state, monitor, measuring, hint: $("hint"), order, then, fail, take, remove: removeTarget, choose });
  addEventListener("resize", () => monitor.draw());
  setInterval(() => { if (state.facts?.phase === "running" || timeline.rows.at(-1)?.[0] !== state.facts?.head) refresh(); }, ROWS_EVERY);
}

/** @param {boolean} again whether a source that is open is opened once more */
async function openNamed(again) {
  const source = $("source").value.trim();
  if (source && (again || source !== state.source || state.trial === null)) await open(source);
}

async function begin() {
  wire();
  const [info, catalogue] = await Promise.all([call("GET", "/api/info"), call("GET", "/api/trackers")]);
  [state.info, state.trackers] = [info, catalogue.trackers];
  $("tracker").replaceChildren(...state.trackers.map((t) => new Option(t.name, t.name)));
  $("tracker").value = info.default_tracker;
  describe(info.default_tracker);
  if (info.read_only) {
    freeze($, [monitor, targets, timeline, parameters]);
    Object.assign(state, { trial: info.trials[0] });
    accept(await call("GET", `/api/trials/${state.trial}`));
    await watch();
    return;
  }
  detecting.offer(catalogue.detectors);
  $("measure-open").hidden = info.picking;
  $("rival").append(...state.trackers.map((t) => new Option(t.name, t.name)));
  /** @type {{ path: string, folder: boolean }[]} */
  const files = await call("GET", "/api/files").catch(() => []);
  sources.suggest([...(info.input ? [info.input] : []), ...files.map((f) => f.path), ...info.scenes, "camera:0"]);
  say("No source is open.");
  // After the page was loaded again, what was open still is.
  const kept = JSON.parse(sessionStorage.getItem("trial") ?? "null");
  if (kept && info.trials.includes(kept.trial)) {
    Object.assign(state, { trial: kept.trial, source: kept.source });
    await watch();
    accept(await call("GET", `/api/trials/${kept.trial}`));
    await measuring.opened(kept.trial);
  } else if (info.input) {
    $("source").value = info.input;
    await open(info.input);
  }
}

then(begin);
