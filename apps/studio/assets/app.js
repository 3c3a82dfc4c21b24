// The page: what the user does becomes calls, what comes back is shown.

import { allRows, call } from "./api.js";
import { Comparison } from "./compare.js";
import { Detecting } from "./detecting.js";
import { listen } from "./keyboard.js";
import { Files } from "./files.js";
import { Live } from "./live.js";
import { Measuring } from "./measuring.js";
import { LAYERS, Monitor } from "./monitor.js";
import { called } from "./names.js";
import { Panels } from "./panels.js";
import { Parameters, fileWanted } from "./parameters.js";
import { Runs } from "./runs.js";
import { Sources } from "./source.js";
import { Targets } from "./targets.js";
import { Timeline } from "./timeline.js";
import { freeze, outlook } from "./watching.js";
import { advice, begunHere } from "./words.js";

/** @param {string} id @returns {any} */
const $ = (id) => document.getElementById(id);
/** How often the time line asks for what is new, in milliseconds. */
const ROWS_EVERY = 400;
/** The key Enter in the field of the source is a change of it as well as a wish to open it: it is opened once, within these milliseconds. */
const AGAIN_AFTER = 1500;
const PHASES = { ready: "ready", running: "running", paused: "paused", stopped: "stopped", ended: "the end is reached", failed: "failed" };

/** @type {{ trackers: any[], families: any[], info: any, trial: number|null, source: string, facts: import("./api.js").Facts|null, live: Live|null,
 *   selected: number, nudged: number[]|null, adding: boolean, drawn: boolean, shownVersion: string, revision: number }} */
const state = { trackers: [], families: [], info: null, trial: null, source: "", facts: null, live: null, selected: 0, nudged: null, adding: false, drawn: false, shownVersion: "", revision: -1 };
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
function say(text) { $("status").textContent = $("status").title = text; }

const monitor = new Monitor($("picture"), (box, more) => then(() => take(box, more)), choose);
const panels = new Panels($);
const measuring = new Measuring({ $, monitor, panels, then, fail, seek: (frame) => then(() => order("seek", { frame })) });
const targets = new Targets({ body: $("rows"), none: $("no-targets"), chips: $("chips"), detail: $("detail") }, choose, (target) => then(() => removeTarget(target)));
const timeline = new Timeline($("line"), (frame) => then(() => order("seek", { frame })));
const parameters = new Parameters($("schema"), $("filter"), (key, value) => then(() => (pending() ? method($("tracker").value, { [key]: value }) : change({ [key]: value }))));
const detecting = new Detecting({ select: $("detector"), place: $("detector-schema"), filter: $("filter"), snap: $("snap"), label: $("snap-label") },
  (detector, parameters) => then(() => detect(detector, parameters)));
const files = new Files({ $, state, known: () => timeline.targets, then, fail, say, accept });
const comparison = new Comparison($("comparison"), monitor);
new Runs({ button: $("runs"), dialog: $("results"), trials: $("open-trials"), list: $("folders"), detail: $("run-detail"), close: $("close-runs") }, (tracker, source, frame, judged) => then(async () => {
  if (entry(tracker)) { $("tracker").value = tracker; describe(tracker); }
  await open(source);
  monitor.judged = judged;
  await order("seek", { frame });
}), (run) => then(() => open(run, { run })), {
  own: () => state.trial,
  look: (trial, source) => then(async () => { await leave(false); await enter(trial, source); }),
  shut: async (trial) => { if (trial === state.trial) { await leave(); empty(); } else await call("DELETE", `/api/trials/${trial}`); },
}, fail);
const sources = new Sources({ input: $("source"), list: $("sources"), browse: $("browse"), files: $("files"), upload: $("upload"), file: $("file") },
  (source) => then(() => open(source)), fail, say);

/** @param {string} source @param {Record<string, any>} [what] what is opened, where it is no source that is followed by the method chosen */
async function open(source, what) {
  if (!source.trim() && !what) return;
  $("notice").hidden = true;
  const before = $("status").textContent;
  say(`Opening ${source} …`);
  const wished = $("tracker").value;
  // One that waits for a file takes over once that is named.
  const waits = what ? null : fileWanted(entry(wished), {});
  try {
    const tracker = waits ? state.info.default_tracker : wished;
    const answer = await call("POST", "/api/trials", what ?? { source, tracker, parameters: motionWanted(), ...detecting.atOnce(source) });
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
    if (waits) { $("tracker").value = wished; describe(wished); ask(wished, waits); }
    // What comes next is done in the picture.
    if (!$("drawer").contains(document.activeElement)) $("picture").focus({ preventScroll: true });
  } catch (error) {
    // What is shown is still the one before.
    say(before);
    throw error;
  }
}

/** Whether a tracker is chosen that waits for a file before it can follow. */
const pending = () => state.trial !== null && state.facts !== null && $("tracker").value !== state.facts.tracker;

/** Takes another tracker, once it has what it needs. @param {string} tracker @param {Record<string, any>} [changes] */
async function method(tracker, changes = {}) {
  if (ask(tracker, fileWanted(entry(tracker), changes)) || state.trial === null) return;
  accept(await call("PUT", `/api/trials/${state.trial}/method`, { tracker, parameters: changes }));
}

/** Says where the file is named that something cannot do without, and leads there; whether there is one. @param {string|null} who @param {string|null} field @param {string} [prefix] of the field's id */
function ask(who, field, prefix = "p") {
  $("wanted").hidden = field === null;
  if (field === null) return false;
  $("wanted").textContent = `“${who}” needs a file with its network. Name it below, in the field “${field}”: a file below the folder that the studio was started with.`;
  panels.show("settings");
  $("parameters").open = true;
  $(`${prefix}-${field}`)?.focus();
  return true;
}

/** @param {string|null} detector @param {Record<string, any>} parameters */
async function detect(detector, parameters) {
  if (ask(detector, detecting.wants, "d")) return;
  if (state.trial !== null) accept(await call("PUT", `/api/trials/${state.trial}/detector`, { detector, parameters }));
}

/** A motion model chosen before a source was opened is part of the method. */
function motionWanted() {
  const default_model = motionOf(entry($("tracker").value))?.default;
  return $("motion").value && $("motion").value !== default_model ? { motion: { model: $("motion").value } } : {};
}

/** Shows nothing any more. */
function empty() {
  sessionStorage.removeItem("trial");
  $("empty").hidden = false;
  $("exports").hidden = $("label").hidden = true;
  $("connection").dataset.state = "none";
  monitor.clear();
  tell("");
  say("No source is open.");
}

/** Shows a trial that is open already. @param {number} trial @param {string} source */
async function enter(trial, source) {
  Object.assign(state, { trial, source, selected: 0 });
  sessionStorage.setItem("trial", JSON.stringify({ trial, source }));
  accept(await call("GET", `/api/trials/${trial}`));
  await watch();
  await measuring.opened(trial);
}

/** @param {boolean} [shut] whether what was shown is closed */
async function leave(shut = true) {
  await setRival("");
  state.live?.close();
  const old = state.trial;
  Object.assign(state, { trial: null, facts: null, live: null, selected: 0, nudged: null, adding: false });
  timeline.rows = [];
  if (old !== null && shut) await call("DELETE", `/api/trials/${old}`).catch(() => {});
}

async function watch() {
  if (state.trial === null) return;
  state.live = new Live(state.trial, show, (how) => {
    const words = { connecting: "connecting …", live: "live", lost: "connection lost, trying again …", over: "this trial is over", ended: "the run is over" };
    $("connection").dataset.state = how === "over" ? "lost" : how === "ended" ? "over" : how === "connecting" && $("connection").dataset.state === "lost" ? "lost" : how;
    $("connection").textContent = words[how];
    if (how === "over") then(again);
  });
}

/** The studio was started again, or the trial was closed since nobody looked at it: what was done in it is in its folder. */
async function again() {
  // What is no longer there need not be closed.
  state.trial = null;
  const { folder } = state.facts ?? {};
  const frame = state.facts?.now?.frame;
  if (!folder) { await open(state.source); return; }
  await open(folder, { run: folder });
  // Whoever wants to open it anew now means it.
  opened = -Infinity;
  if (frame !== undefined) await order("seek", { frame });
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
  if (!pending()) parameters.fill(facts.parameters);
  detecting.show(facts);
  monitor.offer($("look"), facts);
  const model = facts.parameters.motion?.model;
  if (model && document.activeElement !== $("motion")) $("motion").value = model;
  if (state.selected && !facts.targets.includes(state.selected)) state.selected = 0;
  monitor.selected = state.selected;
  monitor.show(facts, picture);
  targets.show(facts, state.selected);
  timeline.show(facts);
  measuring.show(facts);
  comparison.show(facts);
  const { input, now } = facts;
  const frames = input.frame_count ? ` of ${input.about ? "about " : ""}${input.frame_count}` : "";
  say(`${state.source || input.name} · frame ${now?.frame ?? "–"}${frames} · ${(now?.time_s ?? 0).toFixed(2)} s · ${
    PHASES[/** @type {"ready"} */ (facts.phase)]} · ${input.width} × ${input.height} · ${facts.step_ms.toFixed(1)} ms a frame${facts.remark ? ` · ${facts.remark}` : ""}`);
  if (facts.message && facts.message !== before?.message) fail(new Error(facts.message));
  if (now && document.activeElement !== $("seek")) $("seek").value = now.frame;
  hint();
  buttons(facts);
  versions(facts);
  files.show(facts, state.selected);
}

/** @param {import("./api.js").Facts} facts */
function buttons(facts) {
  const running = facts.phase === "running";
  const useless = { stop: facts.phase === "ready" || facts.phase === "stopped", back: facts.now?.frame === facts.first,
    step: facts.phase === "ended" && facts.now?.frame === facts.head, undo: !facts.undo && !measuring.active, redo: !facts.redo && !measuring.active };
  for (const [id, off] of Object.entries(useless)) $(id).setAttribute("aria-disabled", String(off));
  $("undo").title = facts.undo ? `Ctrl+Z: undo “${facts.undo}”` : "Ctrl+Z";
  $("redo").title = facts.redo ? `Ctrl+Shift+Z: redo “${facts.redo}”` : "Ctrl+Shift+Z";
  // One of the two, in the same place.
  const focused = document.activeElement === $("start") || document.activeElement === $("pause");
  [$("start").hidden, $("pause").hidden] = [running, !running];
  if (focused) $(running ? "pause" : "start").focus();
  $("add").setAttribute("aria-pressed", String(state.adding));
}

function hint() {
  const { facts } = state;
  // What is said of a box that is being moved stands until it is taken.
  if (!facts || state.nudged) return;
  $("backward-label").hidden = facts.input.live || facts.read_only === true || state.info?.picking || !facts.targets.length;
  tell(facts.read_only ? outlook(facts) : advice(facts, { selected: state.selected, picking: state.info?.picking === true, adding: state.adding }));
}

/** @param {string} text */
function tell(text) { $("hint").textContent = $("hint").title = text; }

/** @param {import("./api.js").Facts} facts */
function versions(facts) {
  if (facts.revision !== state.revision) {
    // What the time line has may not be so any more.
    state.revision = facts.revision;
    timeline.rows = [];
  }
  const key = JSON.stringify([facts.version, facts.versions.map((v) => v.number), state.trial]);
  if (key !== state.shownVersion) {
    state.shownVersion = key;
    const old = facts.versions.map((v) => new Option(`${v.number}: ${v.tracker}, until ${v.why}`, String(v.number)));
    $("version").replaceChildren(new Option(`${facts.version}: now`, ""), ...old.reverse());
    files.links(state.trial);
  }
}

/** @param {string} name @param {Record<string, any>} [rest] */
async function order(name, rest = {}) {
  if (state.trial === null) throw new Error("no source is open yet; name one at the top of the page");
  $("notice").hidden = true;
  // What is compared goes first: it is shown in the frame that this one comes to.
  await comparison.obey(name, rest, state.facts);
  accept(await call("POST", `/api/trials/${state.trial}/orders`, { order: name, ...rest }));
  // The other one begins again with what this one has now.
  if (comparison.trial !== null && (name === "undo" || name === "redo")) await setRival($("rival").value);
}

/** @param {import("./api.js").Facts} facts */
function accept(facts) { if (facts) show(facts, null); }

/** A box was drawn: of the chosen target, of the one that was begun just now and not followed yet, or one more.
 * @param {number[]} box @param {boolean} [more] whether it is one more in any case */
async function take(box, more = false) {
  if (state.trial === null || !state.facts) return;
  $("notice").hidden = true;
  const adding = more || state.adding;
  const begun = begunHere(state.facts);
  const target = adding ? 0 : state.selected || begun;
  state.adding = false;
  const path = `/api/trials/${state.trial}/targets`;
  const backward = target !== begun && $("backward").checked && !$("backward-label").hidden;
  if (target && target !== begun) tell(`Putting target ${called(state.facts, target)} right …`);
  const facts = await (target ? call("PUT", `${path}/${target}`, { box, backward }) : call("POST", path, { box }));
  accept(facts);
  await follow((rival) => (target ? rival.put(target, box) : rival.add(Math.max(...facts.targets), box)));
  if (state.info.picking) {
    state.live?.close();
    $("connection").dataset.state = "none";
    tell("The box was taken. The command goes on in the terminal; this page can be closed.");
    say($("hint").textContent);
    sessionStorage.removeItem("trial");
    state.trial = null;
    return;
  }
  await refresh();
}

/** What is done here is done in the trial that it is compared with, in the same frame. @param {(rival: Comparison) => Promise<any>} act */
async function follow(act) {
  const frame = state.facts?.now?.frame;
  if (comparison.trial === null || frame === undefined) return;
  await comparison.order("seek", { frame });
  await act(comparison);
  accept(await call("GET", `/api/trials/${state.trial}`));
}

/** @param {number} target */
async function removeTarget(target) {
  accept(await call("DELETE", `/api/trials/${state.trial}/targets/${target}`));
  await follow((rival) => rival.remove(target));
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
    if (state.facts && !pending()) parameters.fill(state.facts.parameters);
  }
}

/** @param {string} name */
const entry = (name) => state.trackers.find((t) => t.name === name);
/** @param {any} tracker */
const motionOf = (tracker) => tracker?.parameters.find((/** @type {any} */ p) => p.name === "motion")?.parameters.find((/** @type {any} */ p) => p.name === "model");

/** The trackers as choices, family by family. */
const byFamily = () => state.families.map((family) => {
  const group = document.createElement("optgroup");
  [group.label, group.title] = [family.name, family.sentence];
  group.append(...state.trackers.filter((t) => t.family === family.name).map((t) => new Option(t.name, t.name)));
  return group;
});

/** The parameters of a tracker, and the motion models there are. @param {string} name */
function describe(name) {
  const tracker = entry(name);
  if (!tracker) return;
  const family = state.families.find((f) => f.name === tracker.family);
  $("tracker").title = family ? `${tracker.summary}\n\n${family.name}: ${family.sentence}` : tracker.summary;
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
  if (!state.facts || state.trial === null) throw new Error("open a source first, then compare");
  if (state.facts.input.live) throw new Error("a live source cannot be seen twice; compare on a file");
  await order("pause");
  const rows = await allRows(state.trial, 0);
  const boxes = state.facts.edits.filter((e) => e.what === "add" || e.what === "correct").map(({ frame, what, target }) => ({ frame, what,
    target: target ?? 0, box: rows.find((r) => r[0] === frame)?.[2].find((r) => r[0] === target)?.[3] ?? [] })).filter(({ box }) => box.length === 4);
  await comparison.open(state.trial, state.source, tracker, state.facts, boxes);
}

let refreshing = false;
/** Gets what is new for the time line. */
async function refresh() {
  const trial = state.trial;
  if (trial === null || refreshing || !state.facts) return;
  refreshing = true;
  try {
    const { revision } = state;
    const last = timeline.rows.at(-1)?.[0] ?? -1;
    // The newest row may have been edited.
    const fresh = await allRows(trial, Math.max(last, 0));
    if (trial === state.trial && revision === state.revision) {
      const first = state.facts.first ?? 0;
      timeline.rows = [...timeline.rows.filter((r) => r[0] >= first && r[0] < (fresh[0]?.[0] ?? Infinity)), ...fresh];
      if (comparison.trial !== null) timeline.rival = await allRows(comparison.trial, 0);
      timeline.draw();
      // Which targets there are is known by their rows.
      files.show(state.facts, state.selected);
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
    await method(tracker);
  });
  changed("motion", (model) => change({ "motion.model": model }));
  $("speed").addEventListener("change", () => then(setSpeed));
  for (const name of ["start", "pause", "step", "back", "stop", "undo", "redo"]) {
    // A run that goes on to a frame far ahead is not waited for.
    const now = name === "pause" || name === "stop" ? (/** @type {() => Promise<any>} */ act) => act().catch(fail) : then;
    $(name).addEventListener("click", () => now(async () => {
      // A source that was named and not yet opened is opened first.
      if (now === then) await openNamed(false);
      if (measuring.turnBack(name)) return;
      if ($(name).getAttribute("aria-disabled") === "true" && (name === "undo" || name === "redo")) return;
      if (name === "back" && state.facts?.now?.frame === state.facts?.first) return;
      await order(name);
    }));
  }
  $("add").addEventListener("click", () => {
    state.adding = !state.adding;
    if (state.facts) show(state.facts, null);
    if (state.adding) $("picture").focus({ preventScroll: true });
  });
  changed("seek", (frame) => order("seek", { frame: Math.max(0, Math.round(Number(frame) || 0)) }));
  $("quantity").addEventListener("change", () => { timeline.quantity = $("quantity").value; timeline.draw(); });
  changed("rival", (rival) => setRival(rival).catch((error) => { $("rival").value = ""; document.querySelector("main")?.classList.remove("compared"); throw error; }));
  $("version").addEventListener("change", () => files.links(state.trial));
  for (const [id, times] of /** @type {[string, number][]} */ ([["zoom-in", 1.5], ["zoom-out", 1 / 1.5], ["zoom-fit", 0]])) $(id).addEventListener("click", () => monitor.enlarge(times));
  changed("look", (at) => order("look", { at }));
  $("snap").addEventListener("change", () => { monitor.snap = $("snap").checked; });
  panels.changed = (now, before) => {
    if (now === "measure" || before === "measure") then(() => measuring.toggle());
  };
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
  listen({ state, monitor, measuring, panels, tell, order, then, fail, take, remove: removeTarget, choose });
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
  [state.info, state.trackers, state.families] = [info, catalogue.trackers, catalogue.families];
  $("tracker").replaceChildren(...byFamily());
  $("tracker").value = info.default_tracker;
  describe(info.default_tracker);
  if (info.read_only) {
    freeze($, [monitor, targets, timeline, parameters]);
    panels.show("targets");
    Object.assign(state, { trial: info.trials[0] });
    accept(await call("GET", `/api/trials/${state.trial}`));
    await watch();
    return;
  }
  detecting.offer(catalogue.detectors);
  $("measure-open").hidden = info.picking;
  $("rival").append(...byFamily());
  /** @type {{ path: string, folder: boolean }[]} */
  const files = await call("GET", "/api/files").catch(() => []);
  sources.suggest([...(info.input ? [info.input] : []), ...files.map((f) => f.path), ...info.scenes, "camera:0"]);
  say("No source is open.");
  // After the page was loaded again, what was open still is.
  const kept = JSON.parse(sessionStorage.getItem("trial") ?? "null");
  if (kept && info.trials.includes(kept.trial)) {
    await enter(kept.trial, kept.source);
  } else if (info.input) {
    $("source").value = info.input;
    await open(info.input);
  }
}

then(begin);
