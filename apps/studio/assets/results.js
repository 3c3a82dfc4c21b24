// What was measured: the values of the frame shown, what was fitted, what happened.

/** Values and standard deviations over the moments of a target; null where nothing is said.
 * @typedef {[(number|null)[], (number|null)[]]} Pair
 * @typedef {{ target: number, every: number, frame: number[], time_s: number[], how: string[], measured_x: (number|null)[], measured_y: (number|null)[],
 *   x: Pair, y: Pair, vx: Pair, vy: Pair, ax: Pair, ay: Pair, speed: Pair, acceleration: Pair, heading: Pair, path: Pair, seen: (number[]|null)[] }} Motion
 * @typedef {{ target: number, asked: { shape: string }, parameters: { name: string, value: number, error: number, unit: string }[], from_s: number, to_s: number,
 *   count: number, axis: string|null, residuals: [number, number[]][], residual_rms: number[] }} Fit
 * @typedef {{ version: number, unit: string, ruler: { kind: string, per_pixel?: number, relative_error?: number, residuals_px?: number[] }, targets: Motion[],
 *   facts: { target: number, measured: number, bridged: number, outside: number, noise_px: number, path: number[], top_speed: number[] }[],
 *   events: { target: number, kind: string, frame: number, time_s: number, time_error_s: number, at: number[], name?: string|null }[],
 *   stays: { target: number, zone: string, inside_s: number, inside_error_s: number, share: number, visits: number, path: number }[], fits: Fit[], warnings: string[] }} Found
 */

const ROWS = /** @type {[string, "x"|"y"|"vx"|"vy"|"speed"|"ax"|"ay"|"acceleration"|"heading"|"path", string][]} */ ([
  ["x", "x", ""], ["y", "y", ""], ["velocity x", "vx", "/s"], ["velocity y", "vy", "/s"], ["speed", "speed", "/s"], ["acceleration x", "ax", "/s²"],
  ["acceleration y", "ay", "/s²"], ["acceleration", "acceleration", "/s²"], ["heading", "heading", "°"], ["path", "path", ""]]);

export class Results {
  /** @param {{ now: HTMLElement, facts: HTMLElement, events: HTMLElement }} parts @param {(frame: number) => void} seek */
  constructor(parts, seek) {
    this.parts = parts;
    this.seek = seek;
    /** @type {Found|null} */
    this.found = null;
    this.target = 0;
  }

  /** @param {Found|null} found */
  show(found) {
    this.found = found;
    const { facts, events } = this.parts;
    facts.replaceChildren();
    events.replaceChildren();
    if (!found) return;
    const { ruler, unit } = found;
    if (ruler.per_pixel !== undefined && ruler.kind !== "pixels") add(facts, "p", `A pixel is ${short(ruler.per_pixel)} ${unit}, ± ${(100 * (ruler.relative_error ?? 0)).toFixed(2)} %.`);
    if (ruler.kind === "pixels") add(facts, "p", "No ruler: lengths are in pixels.");
    // Four points fit any plane.
    if ((ruler.residuals_px?.length ?? 0) > 4) add(facts, "p", `The plane's points are off by ${(ruler.residuals_px ?? []).map((r) => r.toFixed(2)).join(", ")} px.`);
    for (const fit of found.fits) {
      add(facts, "h4", `${fit.asked.shape} of target ${fit.target}, ${fit.count} frames, ${fit.from_s.toFixed(3)} s to ${fit.to_s.toFixed(3)} s`);
      for (const { name, value, error, unit: of } of fit.parameters) add(facts, "p", `${name.replaceAll("_", " ")} ${within(value, error)} ${of.replace("^2", "²")}`).dataset.fit = name;
      add(facts, "p", `left over ${fit.residual_rms.map(short).join(", ")} ${unit} (RMS)`);
    }
    for (const t of found.facts) {
      add(facts, "h4", `Target ${t.target}`);
      add(facts, "p", `measured in ${t.measured} frames, ${t.bridged} bridged, ${t.outside} outside; noise ${t.noise_px.toFixed(2)} px`);
      add(facts, "p", `path ${within(t.path[0], t.path[1])} ${unit}, top speed ${within(t.top_speed[0], t.top_speed[1])} ${unit}/s`);
    }
    for (const s of found.stays) {
      const visits = `${s.visits} ${s.visits === 1 ? "visit" : "visits"}`;
      add(facts, "p", `target ${s.target} in ${s.zone}: ${within(s.inside_s, s.inside_error_s)} s (${(100 * s.share).toFixed(1)} %), ${visits}, ${short(s.path)} ${unit} there`).dataset.zone = s.zone;
    }
    for (const warning of found.warnings) add(facts, "p", warning).className = "warning";
    for (const event of found.events) {
      const button = /** @type {HTMLButtonElement} */ (add(events, "button", `${event.kind}${event.name ? ` ${event.name}` : ""}  ${within(event.time_s, event.time_error_s)} s`));
      button.type = "button";
      button.addEventListener("click", () => this.seek(event.frame));
    }
  }

  /** @param {number} frame */
  cursor(frame) {
    const { now } = this.parts;
    const own = this.found?.targets.find((t) => t.target === this.target);
    const at = own ? own.frame.findIndex((f) => f >= frame) : -1;
    if (!own || !this.found || at < 0) { now.replaceChildren(); return; }
    const rows = ROWS.map(([label, key, per]) => {
      const [value, error] = [own[key][0][at], own[key][1][at]];
      const unit = key === "heading" ? "°" : `${this.found?.unit}${per}`;
      return [label, value === null || error === null ? "–" : `${within(value, error)} ${unit}`];
    });
    rows.unshift(["time", `${own.time_s[at].toFixed(4)} s, ${own.how[at]}`]);
    if (now.children.length !== 2 * rows.length) now.replaceChildren(...rows.flatMap(() => [document.createElement("dt"), document.createElement("dd")]));
    rows.forEach(([label, text], i) => { [now.children[2 * i].textContent, now.children[2 * i + 1].textContent] = [label, text]; });
  }
}

/** @param {HTMLElement} place @param {string} kind @param {string} text */
function add(place, kind, text) {
  return place.appendChild(Object.assign(document.createElement(kind), { textContent: text }));
}

/** A number with its standard deviation, to two digits of that. @param {number} value @param {number} error */
export function within(value, error) {
  if (!Number.isFinite(value) || !Number.isFinite(error)) return "–";
  const digits = error > 0 ? Math.min(Math.max(1 - Math.floor(Math.log10(error)), 0), 9) : 6;
  return `${value.toFixed(digits)} ± ${error.toFixed(digits)}`;
}

/** @param {number} value */
export const short = (value) => Number(value.toPrecision(4)).toString();
