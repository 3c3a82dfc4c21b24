// Parameters from the schema: whatever the registry declares stands here, with its range, unit and source.

/**
 * @typedef {{ name: string, type: string, doc: string, unit?: string, source?: string, default?: any, choices?: string[],
 *   minimum?: number, maximum?: number, exclusiveMinimum?: number, exclusiveMaximum?: number, step?: number,
 *   models?: string[], parameters?: Parameter[] }} Parameter
 */

/** Groups that can be changed while running. */
const WHILE_RUNNING = ["motion", "policy", "search"];

export class Parameters {
  /** @param {HTMLElement} place @param {HTMLInputElement} filter @param {(key: string, value: any) => void} changed
   * @param {string} [title] of what belongs to no group @param {string} [prefix] of ids */
  constructor(place, filter, changed, title = "Tracker", prefix = "p") {
    this.title = title;
    this.prefix = prefix;
    this.place = place;
    this.filter = filter;
    this.changed = changed;
    /** @type {Map<string, { row: HTMLElement, set: (value: any) => void, fallback: any }>} */
    this.rows = new Map();
    /** Keys that only some models have. @type {Set<string>} */
    this.ofModels = new Set();
    /** Those of them that the models chosen do not have. @type {Set<string>} */
    this.absent = new Set();
    /** Whether nothing can be changed. */
    this.frozen = false;
    filter.addEventListener("input", () => this.narrow());
  }

  /** @param {Parameter[]} schema */
  build(schema) {
    this.rows.clear();
    this.ofModels.clear();
    this.absent.clear();
    this.place.replaceChildren();
    const own = schema.filter((p) => p.type !== "group");
    const scope = this.title === "Tracker" ? "Of the tracker itself; a change follows again from the first frame." : "Of the detector: what it shows in the picture.";
    if (own.length) this.group(this.title, scope, own, "");
    for (const p of schema.filter((p) => p.type === "group")) {
      const when = WHILE_RUNNING.includes(p.name) ? "Can be changed while running." : "A change follows again from the first frame.";
      this.group(p.name, `${p.doc}\n${when}`, p.parameters ?? [], `${p.name}.`);
    }
    if (this.frozen) for (const field of this.place.querySelectorAll("input, select")) /** @type {HTMLInputElement} */ (field).disabled = true;
    this.narrow();
  }

  /** @param {string} title @param {string} doc @param {Parameter[]} parameters @param {string} path @param {boolean} [some] whether
   * only some models have it */
  group(title, doc, parameters, path, some = false) {
    const set = make("fieldset");
    const legend = make("legend", title[0].toUpperCase() + title.slice(1));
    legend.title = doc;
    set.append(legend);
    for (const p of parameters) {
      const ofSome = some || (p.models?.length ?? 0) > 0;
      if (p.type === "group") this.group(`${title} · ${p.name}`, p.doc, p.parameters ?? [], `${path}${p.name}.`, ofSome);
      else {
        if (ofSome) this.ofModels.add(path + p.name);
        set.append(this.row(p, path + p.name));
      }
    }
    this.place.append(set);
  }

  /** @param {Parameter} p @param {string} key */
  row(p, key) {
    const row = make("div");
    row.className = "parameter";
    row.title = describe(p);
    const label = make("label", p.name.replaceAll("_", " "));
    if (p.unit) label.append(make("small", p.unit));
    const pair = make("div");
    pair.className = "pair";
    const id = `${this.prefix}-${key.replaceAll(".", "-")}`;
    label.setAttribute("for", id);
    const set = this.field(p, key, id, pair);
    row.append(label, pair);
    this.rows.set(key, { row, set, fallback: p.default });
    set(p.default);
    return row;
  }

  /** @param {Parameter} p @param {string} key @param {string} id @param {HTMLElement} pair @returns {(value: any) => void} */
  field(p, key, id, pair) {
    if (p.type === "choice" || p.type === "flag") {
      const select = /** @type {HTMLSelectElement} */ (make("select"));
      select.id = id;
      const words = p.type === "flag" ? ["true", "false"] : p.choices ?? [];
      select.append(...words.map((word) => new Option(p.type === "flag" ? (word === "true" ? "yes" : "no") : word, word)));
      select.addEventListener("change", () => this.changed(key, p.type === "flag" ? select.value === "true" : select.value));
      pair.classList.add("alone");
      pair.append(select);
      return (value) => { select.value = String(value); };
    }
    const input = /** @type {HTMLInputElement} */ (make("input"));
    input.id = id;
    if (p.type === "text" || p.type === "file") {
      input.type = "text";
      input.addEventListener("change", () => this.changed(key, input.value));
      pair.classList.add("alone");
      pair.append(input);
      return (value) => { input.value = value ?? ""; };
    }
    input.type = "number";
    const [low, high] = [p.minimum ?? p.exclusiveMinimum, p.maximum ?? p.exclusiveMaximum];
    const whole = p.type === "integer";
    input.step = whole ? String(p.step ?? 1) : "any";
    if (low !== undefined) input.min = String(low);
    if (high !== undefined) input.max = String(high);
    const send = () => {
      const value = Number(input.value);
      const fits = input.value !== "" && Number.isFinite(value) && allowed(p, value);
      input.setAttribute("aria-invalid", String(!fits));
      if (fits) this.changed(key, value);
    };
    input.addEventListener("change", send);
    const slider = /** @type {HTMLInputElement} */ (make("input"));
    slider.type = "range";
    slider.setAttribute("aria-label", `${p.name.replaceAll("_", " ")}, slider`);
    const scale = scaleOf(p, low, high);
    [slider.min, slider.max, slider.step] = ["0", "1000", "1"];
    slider.addEventListener("input", () => {
      const value = scale.value(Number(slider.value) / 1000);
      input.value = String(whole ? Math.round(value) : Number(value.toPrecision(3)));
    });
    slider.addEventListener("change", send);
    pair.append(slider, input);
    return (value) => {
      input.value = value === undefined || value === null ? "" : String(value);
      slider.value = String(Math.round(1000 * scale.place(Number(value))));
      input.setAttribute("aria-invalid", "false");
    };
  }

  /** Shows the values of a recipe. @param {Record<string, any>} values */
  fill(values) {
    const flat = flatten(values);
    this.absent = new Set([...this.ofModels].filter((key) => !(key in flat)));
    for (const [key, { row, set, fallback }] of this.rows) {
      if (!(key in flat) || row.contains(document.activeElement)) continue;
      set(flat[key]);
      row.classList.toggle("changed", JSON.stringify(flat[key]) !== JSON.stringify(fallback) && Number(flat[key]) !== Number(fallback));
    }
    this.narrow();
  }

  narrow() {
    const word = this.filter.value.trim().toLowerCase();
    for (const [key, { row }] of this.rows) {
      row.hidden = this.absent.has(key) || (word !== "" && !`${key} ${row.title}`.toLowerCase().includes(word));
    }
    for (const set of this.place.querySelectorAll("fieldset")) {
      /** @type {HTMLElement} */ (set).hidden = !set.querySelector(".parameter:not([hidden])");
    }
  }
}

/** @param {Parameter} p @param {number} value */
function allowed(p, value) {
  return (p.minimum === undefined || value >= p.minimum) && (p.maximum === undefined || value <= p.maximum)
    && (p.exclusiveMinimum === undefined || value > p.exclusiveMinimum)
    && (p.exclusiveMaximum === undefined || value < p.exclusiveMaximum)
    && (p.type !== "integer" || Number.isInteger(value));
}

/** Where a slider stands for a value: by its size where the range is wide or open, else evenly.
 * @param {Parameter} p @param {number|undefined} low @param {number|undefined} high */
function scaleOf(p, low, high) {
  const own = Math.abs(Number(p.default)) || 1;
  const from = low ?? (high !== undefined ? Math.min(0, high - 4 * own) : -4 * own);
  const to = high ?? Math.max(from + 1, from + 10 * own);
  const wide = from >= 0 && to / Math.max(from, own / 100) > 50;
  if (!wide) {
    return {
      place: (/** @type {number} */ v) => Math.min(Math.max((v - from) / (to - from || 1), 0), 1),
      value: (/** @type {number} */ x) => from + x * (to - from),
    };
  }
  const [least, span] = [Math.max(from, own / 1000), Math.log(to / Math.max(from, own / 1000))];
  return {
    place: (/** @type {number} */ v) => (v <= least ? 0 : Math.min(Math.log(v / least) / span, 1)),
    value: (/** @type {number} */ x) => (x === 0 && p.exclusiveMinimum === undefined ? from : least * Math.exp(x * span)),
  };
}

/** @param {Parameter} p */
function describe(p) {
  const number = (/** @type {number|undefined} */ v, /** @type {string} */ word) => (v === undefined ? [] : [`${word} ${v}`]);
  const range = [...number(p.minimum, "at least"), ...number(p.exclusiveMinimum, "above"), ...number(p.maximum, "at most"),
    ...number(p.exclusiveMaximum, "below")].join(", ");
  const facts = [p.unit && `Unit: ${p.unit}`, range && `Range: ${range}`, p.choices && `One of: ${p.choices.join(", ")}`,
    p.source && `Source: ${p.source}`, `Default: ${p.default}`];
  return [p.doc, ...facts.filter(Boolean)].join("\n");
}

/** @param {Record<string, any>} values @param {string} [path] @returns {Record<string, any>} */
export function flatten(values, path = "") {
  /** @type {Record<string, any>} */
  const flat = {};
  for (const [key, value] of Object.entries(values)) {
    const group = value !== null && typeof value === "object" && !Array.isArray(value);
    Object.assign(flat, group ? flatten(value, `${path}${key}.`) : { [path + key]: value });
  }
  return flat;
}

/** The file that something of the registry cannot do without and that nobody has named yet: its parameter. @param {any} entry @param {Record<string, any>} changes what differs from the defaults
 * @returns {string|null} */
export function fileWanted(entry, changes) {
  if (!entry?.needs_file) return null;
  const files = entry.parameters.filter((/** @type {Parameter} */ p) => p.type === "file");
  return files.some((/** @type {Parameter} */ p) => changes[p.name] || p.default) ? null : files[0]?.name ?? null;
}

/** @param {string} tag @param {string} [text] */
function make(tag, text) {
  const element = document.createElement(tag);
  if (text !== undefined) element.textContent = text;
  return element;
}
