// Folders written by `pursuit track`, `eval` and `reproduce`, to look at.

import { call } from "./api.js";

/** @typedef {{ pass: string|null, frame: number, overlap: number, box: number[]|null, truth: number[] }} Judged */

export class Runs {
  /**
   * @param {{ button: HTMLElement, dialog: HTMLDialogElement, trials: HTMLElement, list: HTMLElement, detail: HTMLElement, close: HTMLElement }} parts
   * @param {(tracker: string, source: string, frame: number, judged: Judged) => void} look opens a source and goes to a frame of it
   * @param {(folder: string) => void} take opens a run of a tracker
   * @param {{ own: () => number|null, look: (trial: number, source: string) => void, shut: (trial: number) => Promise<any> }} trials the one that is shown here, and what is done with others
   * @param {(error: unknown) => void} fail
   */
  constructor(parts, look, take, trials, fail) {
    this.parts = parts;
    this.look = look;
    this.take = take;
    this.trials = trials;
    this.fail = (/** @type {unknown} */ error) => { this.parts.dialog.close(); fail(error); };
    parts.button.addEventListener("click", () => this.open().catch(this.fail));
    parts.close.addEventListener("click", () => parts.dialog.close());
  }

  async open() {
    const { dialog, list, detail } = this.parts;
    /** @type {[{ path: string, kind: string, written_ms: number|null, tracker: string|null, edited: boolean }[], any]} */
    const [runs] = await Promise.all([call("GET", "/api/runs"), this.listTrials()]);
    list.replaceChildren(...runs.map((run) => {
      const row = button(run.path || ".", () => this.show(run.path).catch(this.fail));
      const what = { tracking: `followed by ${run.tracker ?? "?"}${run.edited ? " in the studio" : ""}`, evaluation: "evaluation", reproduction: "reproduction of a paper" };
      const when = run.written_ms === null ? "" : new Date(run.written_ms).toLocaleString([], { dateStyle: "medium", timeStyle: "short" });
      row.append(make("small", `${what[/** @type {"tracking"} */ (run.kind)]} · ${when}`));
      return row;
    }));
    detail.replaceChildren(make("p", runs.length ? "Choose a run. What you follow here is kept by itself, and stands in this list." : "Nothing was followed, evaluated or reproduced below this folder yet. What you follow here is kept by itself, and will stand in this list.", "quiet"));
    if (!dialog.open) dialog.showModal();
  }

  /** What is open in this studio, in whatever tab. */
  async listTrials() {
    /** @type {{ trials: { trial: number, source: string, viewers: number, facts: any }[] }} */
    const { trials } = await call("GET", "/api/trials");
    const rows = trials.map(({ trial, source, viewers, facts }) => {
      const row = make("div", "", "open-trial");
      const own = trial === this.trials.own();
      const look = button(source, () => { this.parts.dialog.close(); if (!own) this.trials.look(trial, source); });
      const looked = own ? "shown here" : viewers ? "shown in another tab" : "nobody looks at it";
      look.append(make("small", `${facts?.tracker ?? ""}, frame ${facts?.frame ?? 0}, ${looked}`));
      const shut = button("Close", () => this.trials.shut(trial).then(() => this.open()).catch(this.fail));
      shut.setAttribute("aria-label", `Close ${source}`);
      row.append(look, shut);
      return row;
    });
    this.parts.trials.replaceChildren(...(rows.length ? [make("h3", "Open now"), ...rows, make("h3", "Kept")] : []));
  }

  /** @param {string} folder */
  async show(folder) {
    const run = await call("GET", `/api/runs/results?folder=${encodeURIComponent(folder)}`);
    const shown = { evaluation: () => this.evaluation(folder, run), reproduction: () => reproduction(folder, run), tracking: () => this.tracking(folder, run.run) };
    this.parts.detail.replaceChildren(...shown[/** @type {"tracking"} */ (run.kind)]());
    this.parts.detail.scrollTop = 0;
  }

  /** @param {string} folder @param {any} run @returns {HTMLElement[]} */
  evaluation(folder, run) {
    const parts = [make("h3", `Evaluation, protocol ${run.protocol}`)];
    if (run.interrupted) parts.push(make("p", "It was interrupted: what stands here is not the whole.", "quiet"));
    for (const problem of run.problems ?? []) parts.push(make("p", problem, "quiet"));
    for (const { name, mean, sequences } of run.trackers) {
      parts.push(make("h4", `${name}: area under the success curve ${number(mean.auc)}, mean overlap ${number(mean.average_overlap)}, ${number(mean.fps)} fps`));
      const rows = Object.entries(sequences).map(([sequence, score]) => {
        const worst = button("Worst frames", () => this.worst(folder, name, sequence, cell).catch(this.fail));
        worst.setAttribute("aria-label", `Worst frames of ${name} on ${sequence}`);
        const cell = make("td");
        cell.append(worst);
        return [sequence, number(score.auc), number(score.average_overlap), number(score.normalized_precision), number(score.lost), number(score.fps), String(score.frames), score.error ?? "", cell];
      });
      parts.push(table(`${name} on every sequence`, ["Sequence", "AUC", "Overlap", "Precision", "Lost", "fps", "Frames", "", ""], rows));
    }
    return parts;
  }

  /** @param {string} folder @param {any} run @returns {HTMLElement[]} */
  tracking(folder, run) {
    const { tracker, detector } = run.recipe;
    const { tracking, unsure = 0, occluded, lost } = run.states;
    const facts = [["Input", run.input.name], ["Picture", `${run.input.width} × ${run.input.height}`], ["State", run.error ? `${run.status}: ${run.error}` : run.status],
      ["Frames", String(run.frame_count)], ["Tracking, unsure, occluded, lost", `${tracking}, ${unsure}, ${occluded}, ${lost}`], ["Begun by", detector ?? "boxes"],
      ["Mean overlap with the truth", number(run.accuracy?.mean_iou)], ["Written by", `pursuit ${run.version}`]];
    const open = button("Open this run", () => { this.parts.dialog.close(); this.take(folder); });
    return [make("h3", `A run of ${tracker}`), table("The run", ["", ""], facts), open];
  }

  /** @param {string} folder @param {string} tracker @param {string} sequence @param {HTMLElement} cell */
  async worst(folder, tracker, sequence, cell) {
    const query = new URLSearchParams({ folder, tracker, sequence });
    /** @type {{ source: string|null, first: number, frames: Judged[] }} */
    const { source, first, frames } = await call("GET", `/api/runs/worst?${query}`);
    if (source === null) { cell.replaceChildren("its footage is not below the root"); return; }
    cell.replaceChildren(...frames.map((judged) => {
      const pass = judged.pass ? ` of pass ${judged.pass}` : "";
      const there = button(`${judged.frame}${pass}: ${judged.overlap.toFixed(2)}`, () => {
        this.parts.dialog.close();
        this.look(tracker, source, first + judged.frame, { ...judged, frame: first + judged.frame });
      });
      there.setAttribute("aria-label", `Frame ${judged.frame}${pass}, overlap ${judged.overlap.toFixed(2)}`);
      return there;
    }));
  }
}

/** @param {string} folder @param {any} run @returns {HTMLElement[]} */
function reproduction(folder, run) {
  const rows = run.rows.map((/** @type {any} */ row) => [row.setting, row.figure, number(row.paper), number(row.reference), number(row.ours?.value), number(row.tuned_plain),
    number(row.imm), row.verdict ?? ""]);
  const pictures = run.pictures.map((/** @type {string} */ name) => {
    const image = /** @type {HTMLImageElement} */ (make("img"));
    image.alt = name.replace(/\.\w+$/, "").replaceAll("-", " ");
    image.src = `/api/runs/picture?${new URLSearchParams({ folder, name })}`;
    return image;
  });
  const findings = make("ul");
  findings.append(...(run.findings ?? []).map((/** @type {any} */ f) => make("li", `${f.holds ? "Holds" : "Does not hold"}: ${f.claim} (${f.evidence})`)));
  return [make("h3", `${run.title}, ${run.seeds} seeds`), table("Figures", ["Setting", "Figure", "Paper", "Reference", "Ours", "Tuned plain", "IMM", "Bar"], rows), findings, ...pictures];
}

/** @param {any} value */
function number(value) {
  return typeof value === "number" ? String(Number(value.toPrecision(4))) : "–";
}

/** @param {string} caption @param {string[]} head @param {(string|HTMLElement)[][]} rows */
function table(caption, head, rows) {
  const whole = /** @type {HTMLTableElement} */ (make("table"));
  whole.append(make("caption", caption, "unseen"));
  const top = whole.createTHead().insertRow();
  for (const word of head) top.append(make("th", word));
  const body = whole.createTBody();
  for (const cells of rows) body.insertRow().append(...cells.map((cell) => (typeof cell === "string" ? make("td", cell) : cell)));
  return whole;
}

/** @param {string} text @param {() => void} act */
function button(text, act) {
  const made = /** @type {HTMLButtonElement} */ (make("button", text));
  made.type = "button";
  made.addEventListener("click", act);
  return made;
}

/** @param {string} tag @param {string} [text] @param {string} [style] */
function make(tag, text = "", style = "") {
  const element = document.createElement(tag);
  if (text) element.textContent = text;
  if (style) element.className = style;
  return element;
}
