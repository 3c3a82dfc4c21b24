// A row for every target: where it is and was expected, how sure the tracker is, and why.

/** @typedef {import("./api.js").TargetRecord} TargetRecord */

export class Targets {
  /**
   * @param {HTMLElement} body @param {HTMLElement} none
   * @param {(target: number) => void} chosen @param {(target: number) => void} removed
   */
  constructor(body, none, chosen, removed) {
    this.body = body;
    this.none = none;
    this.chosen = chosen;
    this.removed = removed;
    /** Whether nothing can be changed. */
    this.frozen = false;
    /** @type {Map<number, HTMLTableRowElement>} */
    this.rows = new Map();
  }

  /** @param {import("./api.js").Now|null} now @param {number} selected */
  show(now, selected) {
    const records = now?.records ?? [];
    this.none.hidden = records.length > 0;
    for (const [target, row] of this.rows) {
      if (!records.some((r) => r.target === target)) { row.remove(); this.rows.delete(target); }
    }
    for (const record of records) {
      const row = this.rows.get(record.target) ?? this.add(record.target);
      row.setAttribute("aria-selected", String(record.target === selected));
      const actual = now?.truth ?? record.measured;
      const error = record.error_px ?? record.innovation_px;
      const kind = record.error_px !== null && record.error_px !== undefined ? "against the truth" : "measured against predicted";
      const state = row.cells[1].firstElementChild ?? row.cells[1].appendChild(document.createElement("span"));
      state.className = `state ${record.state ?? ""}`;
      state.textContent = record.state ?? "looking";
      const texts = [record.score?.toFixed(3) ?? "", point(actual), point(record.predicted), point(record.box),
        error === null || error === undefined ? "–" : `${error.toFixed(2)} px`, why(record)];
      texts.forEach((text, i) => { row.cells[i + 2].textContent = text; });
      row.cells[6].title = kind;
    }
  }

  /** @param {number} target */
  add(target) {
    const row = document.createElement("tr");
    for (let i = 0; i < 9; i += 1) row.insertCell();
    const choose = document.createElement("button");
    choose.type = "button";
    choose.textContent = String(target);
    choose.setAttribute("aria-label", `Choose target ${target}`);
    choose.addEventListener("click", () => this.chosen(target));
    row.cells[0].append(choose);
    row.cells[7].className = "why";
    const remove = document.createElement("button");
    remove.type = "button";
    remove.textContent = "Remove";
    remove.setAttribute("aria-label", `Remove target ${target}`);
    remove.addEventListener("click", () => this.removed(target));
    if (!this.frozen) row.cells[8].append(remove);
    const after = [...this.rows].filter(([t]) => t > target).map(([, r]) => r)[0] ?? null;
    this.body.insertBefore(row, after);
    this.rows.set(target, row);
    return row;
  }
}

/** @param {number[]|null|undefined} box */
function point(box) {
  return box ? `${(box[0] + box[2] / 2).toFixed(1)}, ${(box[1] + box[3] / 2).toFixed(1)}` : "–";
}

/** What it is, why it is not tracked, and the method's own figures, the first few. @param {TargetRecord} record */
function why(record) {
  const figures = Object.entries(record.why ?? {}).slice(0, 5).map(([name, value]) => `${name.replaceAll("_", " ")} ${Number(value.toPrecision(3))}`);
  if (!record.predicted && record.measured) return "put here";
  if (record.state !== "tracking" && !record.measured) figures.unshift("nothing measured");
  if (record.doubt) figures.unshift(record.doubt);
  if (record.class) figures.unshift(record.class);
  return figures.join(", ");
}
