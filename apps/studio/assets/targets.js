// Every target: a chip below the picture, a row of the table, and all that is known of the chosen one.

import { called, colorOf } from "./names.js";

/** @typedef {import("./api.js").TargetRecord} TargetRecord */

export class Targets {
  /**
   * @param {{ body: HTMLElement, none: HTMLElement, chips: HTMLElement, detail: HTMLElement }} parts
   * @param {(target: number) => void} chosen @param {(target: number) => void} removed
   */
  constructor(parts, chosen, removed) {
    this.parts = parts;
    this.chosen = chosen;
    this.removed = removed;
    /** Whether nothing can be changed. */
    this.frozen = false;
    /** @type {Map<number, { row: HTMLTableRowElement, chip: HTMLButtonElement }>} */
    this.rows = new Map();
  }

  /** @param {import("./api.js").Facts} facts @param {number} selected */
  show(facts, selected) {
    const records = facts.now?.records ?? [];
    this.parts.none.hidden = records.length > 0;
    for (const [target, { row, chip }] of this.rows) {
      if (!records.some((r) => r.target === target)) { row.remove(); chip.remove(); this.rows.delete(target); }
    }
    for (const record of records) {
      const { row, chip } = this.rows.get(record.target) ?? this.add(record.target);
      const own = record.target === selected;
      const name = called(facts, record.target);
      row.setAttribute("aria-selected", String(own));
      chip.setAttribute("aria-pressed", String(own));
      chip.style.borderColor = colorOf(facts, record.target);
      write(chip.firstElementChild, name);
      chip.className = `state ${record.state ?? ""}`;
      chip.title = why(record);
      chip.setAttribute("aria-label", `Target ${name}, ${record.state ?? "looked for"}`);
      write(row.cells[0].firstElementChild, name);
      /** @type {HTMLElement} */ (row.cells[0].firstElementChild).style.borderColor = colorOf(facts, record.target);
      const state = /** @type {HTMLElement} */ (row.cells[1].firstElementChild);
      state.className = `state ${record.state ?? ""}`;
      write(state, record.state ?? "looked for");
      row.title = why(record);
      [record.score?.toFixed(2) ?? "", point(record.box)].forEach((text, i) => write(row.cells[i + 2], text));
    }
    this.describe(records.find((r) => r.target === selected) ?? (records.length === 1 ? records[0] : undefined), facts.now?.truth ?? null);
  }

  /** @param {number} target */
  add(target) {
    const row = document.createElement("tr");
    for (let i = 0; i < 5; i += 1) row.insertCell();
    const choose = button("", `Choose target ${target}`, () => this.chosen(target));
    row.cells[0].append(choose);
    row.cells[1].append(document.createElement("span"));
    if (!this.frozen) row.cells[4].append(button("×", `Remove target ${target}`, () => this.removed(target)));
    const chip = button("", "", () => this.chosen(target));
    chip.append(document.createElement("span"));
    const after = [...this.rows].filter(([t]) => t > target).sort(([a], [b]) => a - b).map(([, both]) => both)[0];
    this.parts.body.insertBefore(row, after?.row ?? null);
    this.parts.chips.insertBefore(chip, after?.chip ?? null);
    this.rows.set(target, { row, chip });
    return { row, chip };
  }

  /** All that is known of one target, always the same lines. @param {TargetRecord|undefined} record @param {number[]|null} truth */
  describe(record, truth) {
    const { detail } = this.parts;
    if (!record) { detail.replaceChildren(); return; }
    const error = record.error_px ?? record.innovation_px;
    const against = record.error_px !== null && record.error_px !== undefined ? "Off the truth by" : "Measured off predicted by";
    const lines = [[truth ? "Truth" : "Measured", point(truth ?? record.measured)], ["Predicted", point(record.predicted)], ["Estimated", point(record.box)],
      [against, error === null || error === undefined ? "–" : `${error.toFixed(2)} px`], ["Why", why(record) || "–"]];
    if (detail.children.length !== 2 * lines.length) detail.replaceChildren(...lines.flatMap(() => [document.createElement("dt"), document.createElement("dd")]));
    lines.forEach(([label, text], i) => { write(detail.children[2 * i], label); write(detail.children[2 * i + 1], text); });
    /** @type {HTMLElement} */ (detail.lastElementChild).title = figures(record);
  }
}

/** @param {string} text @param {string} label @param {() => void} act */
function button(text, label, act) {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = text;
  if (label) made.setAttribute("aria-label", label);
  made.addEventListener("click", act);
  return made;
}

/** What stands there already is not written again: a page reader would read it again. @param {Element|null} place @param {string} text */
function write(place, text) {
  if (place && place.textContent !== text) place.textContent = text;
}

/** @param {number[]|null|undefined} box */
function point(box) {
  return box ? `${(box[0] + box[2] / 2).toFixed(1)}, ${(box[1] + box[3] / 2).toFixed(1)}` : "–";
}

const DOUBTS = { covered: "something covers it", changed: "it looks different", confused: "several things could be it", gone: "it is nowhere to be found" };

/** Why it is said to be in this state, in a few words. @param {TargetRecord} record */
function why(record) {
  if (!record.predicted && record.measured) return "put here";
  const words = [];
  if (record.class) words.push(record.class);
  if (record.doubt) words.push(DOUBTS[/** @type {"gone"} */ (record.doubt)] ?? record.doubt);
  if (record.state !== "tracking" && !record.measured) words.push("nothing measured");
  if (record.backward) words.push("followed backward");
  return words.join(", ");
}

/** The method's own figures. @param {TargetRecord} record */
function figures(record) {
  return Object.entries(record.why ?? {}).map(([name, value]) => `${name.replaceAll("_", " ").replaceAll(".", " ")} ${Number(value.toPrecision(3))}`).join("\n");
}
