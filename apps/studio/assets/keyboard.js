// Everything by the keyboard.

/**
 * @typedef {{ state: { facts: import("./api.js").Facts|null, selected: number, nudged: number[]|null, drawn: boolean },
 *   monitor: import("./monitor.js").Monitor, measuring: import("./measuring.js").Measuring, panels: import("./panels.js").Panels, tell: (text: string) => void,
 *   order: (name: string, rest?: Record<string, any>) => Promise<any>, then: (act: () => Promise<any>) => any, fail: (error: unknown) => void,
 *   take: (box: number[], more?: boolean) => Promise<any>, remove: (target: number) => Promise<any>, choose: (target: number) => void }} Page
 */

/** @param {Page} page */
export function listen(page) {
  addEventListener("keydown", (event) => key(page, event));
}

/** @param {Page} page @param {KeyboardEvent} event */
function key(page, event) {
  const { state, monitor, order, then, fail } = page;
  const where = /** @type {HTMLElement} */ (event.target);
  const { facts } = state;
  // What is undone in a field of text is its text.
  if (!where.closest("textarea, input:not([type=checkbox])") && page.measuring.key(event)) { event.preventDefault(); return; }
  const writes = where.closest("textarea, input:not([type=checkbox]):not([type=range])") !== null;
  const frozen = facts?.read_only === true;
  if ((event.ctrlKey || event.metaKey) && !writes && facts && !frozen) {
    const turn = { z: event.shiftKey ? "redo" : "undo", y: "redo" }[event.key.toLowerCase()];
    if (turn && facts[/** @type {"undo"} */ (turn)]) then(() => order(turn));
    if (turn) event.preventDefault();
  }
  if (where.closest("input, select, textarea, button, summary, a, dialog") || event.ctrlKey || event.metaKey || !facts) return;
  const target = () => { state.selected = 0; page.choose(Number(event.key)); };
  if (!frozen && event.key.startsWith("Arrow") && (event.shiftKey || event.altKey)) { nudge(page, event); return; }
  /** @type {Record<string, () => any>} */
  const looks = { f: () => page.panels.full(), "+": () => monitor.enlarge(1.25), "=": () => monitor.enlarge(1.25), "-": () => monitor.enlarge(1 / 1.25) };
  /** @type {Record<string, () => any>} */
  const acts = frozen ? looks : {
    ...looks,
    " ": () => (facts.phase === "running" ? order("pause").catch(fail) : then(() => order("start"))),
    ArrowRight: () => then(() => order("step")), ".": () => then(() => order("step")),
    ArrowLeft: () => then(() => order("back")), ",": () => then(() => order("back")),
    Home: () => then(() => order("seek", { frame: state.facts?.first ?? 0 })),
    End: () => then(() => order("seek", { frame: state.facts?.head ?? 0 })),
    Escape: () => { if (state.nudged) { state.nudged = monitor.draft = null; state.drawn = false; monitor.draw(); } else order("stop").catch(fail); },
    Enter: () => { const box = state.nudged; if (box) { state.nudged = monitor.draft = null; const more = state.selected === 0 && state.drawn; state.drawn = false; then(() => page.take(box, more)); } },
    Delete: () => { const chosen = state.selected; if (chosen) then(() => page.remove(chosen)); },
    p: () => {
      const boxes = facts.proposals.map((box) => box.slice(0, 4));
      const at = boxes.findIndex((box) => state.nudged && box.every((v, i) => v === state.nudged?.[i]));
      if (!boxes.length) return;
      state.nudged = monitor.draft = boxes[(at + 1) % boxes.length];
      page.tell(`Box ${(at + 1) % boxes.length + 1} of ${boxes.length} of the detector: Enter takes it, P goes on.`);
      monitor.draw();
    },
    n: () => {
      const { width, height } = facts.input;
      [state.selected, monitor.selected, state.drawn] = [0, 0, true];
      state.nudged = monitor.draft = [width * .45, height * .45, width * .1, height * .1].map(Math.round);
      page.tell("Shift and the arrows move the box, Alt and the arrows change its size, Enter takes it, Escape gives it up.");
      monitor.draw();
    },
  };
  const act = acts[event.key] ?? (/^\d$/.test(event.key) ? target : null);
  if (!act) return;
  event.preventDefault();
  act();
}

/** Moves the box of the chosen target, or a new one, by a pixel; Enter takes it. @param {Page} page @param {KeyboardEvent} event */
function nudge({ state, monitor, tell }, event) {
  const own = state.facts?.now?.records.find((r) => r.target === state.selected)?.box;
  const box = state.nudged ?? (own ? [...own] : null);
  if (!box) return;
  event.preventDefault();
  const along = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key] ?? [0, 0];
  const at = event.altKey ? 2 : 0;
  box[at] += along[0];
  box[at + 1] += along[1];
  if (box[2] < 2 || box[3] < 2) return;
  state.nudged = monitor.draft = box;
  tell("Enter takes this box, Escape gives it up.");
  monitor.draw();
}
