// The points that were clicked, as numbers that can be typed.

/** @typedef {import("./model.js").Model} Model */
/** @typedef {{ label: string, of: (model: Model) => number[]|null, set: (model: Model, i: number, value: number) => void, names: string[], remove?: (model: Model) => void }} Spot */

export class Spots {
  /** @param {HTMLElement} place @param {(change: (model: Model) => void) => void} changed */
  constructor(place, changed) {
    this.place = place;
    this.changed = changed;
    this.shown = "";
  }

  /** @param {Model} model */
  show(model) {
    const spots = all(model);
    const key = spots.map((spot) => spot.label).join();
    if (key !== this.shown) {
      this.shown = key;
      this.place.replaceChildren(...spots.map((spot) => this.row(spot)));
    }
    spots.forEach((spot, row) => {
      const values = spot.of(model) ?? [];
      this.place.children[row].querySelectorAll("input").forEach((input, i) => { input.value = values[i] === undefined ? "" : String(values[i]); });
    });
  }

  /** @param {Spot} spot */
  row(spot) {
    const row = document.createElement("div");
    row.className = "spot";
    row.append(Object.assign(document.createElement("span"), { textContent: spot.label }));
    spot.names.forEach((name, i) => {
      const input = Object.assign(document.createElement("input"), { type: "number", step: "any", title: name });
      input.setAttribute("aria-label", `${spot.label}, ${name}`);
      input.addEventListener("change", () => { if (input.value !== "") this.changed((model) => spot.set(model, i, Number(input.value))); });
      row.append(input);
    });
    if (spot.remove) {
      const button = Object.assign(document.createElement("button"), { type: "button", textContent: "×" });
      button.setAttribute("aria-label", `Remove ${spot.label}`);
      button.addEventListener("click", () => this.changed(/** @type {(model: Model) => void} */ (spot.remove)));
      row.append(button);
    }
    return row;
  }
}

/** @param {Model} model @returns {Spot[]} */
function all(model) {
  const pixels = ["x in pixels", "y in pixels"];
  const spots = /** @type {Spot[]} */ ([]);
  if (model.ruler === "stick") {
    ["One end", "Other end"].forEach((label, k) => spots.push({ label, names: pixels, of: (m) => m.stick[k], set: (m, i, value) => {
      const end = /** @type {[number, number]} */ (m.stick[k] ? [...m.stick[k]] : [0, 0]);
      end[i] = value;
      m.stick[k] = end;
    } }));
  }
  if (model.ruler === "plane") {
    model.plane.forEach((_, k) => spots.push({ label: `Point ${k + 1}`, names: [...pixels, "first place", "second place"], of: (m) => m.plane[k],
      set: (m, i, value) => { m.plane[k] = m.plane[k].map((v, at) => (at === i ? value : v)); }, remove: (m) => { m.plane.splice(k, 1); } }));
  }
  for (const [label, key] of /** @type {[string, "origin"|"toward"][]} */ ([["Origin", "origin"], ["On the x axis", "toward"]])) {
    if (model[key]) spots.push({ label, names: pixels, of: (m) => m[key], set: (m, i, value) => {
      const point = /** @type {[number, number]} */ ([...(m[key] ?? [0, 0])]);
      point[i] = value;
      m[key] = point;
    }, remove: (m) => { m[key] = null; if (key === "origin") m.toward = null; } });
  }
  return spots;
}
