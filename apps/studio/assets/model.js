// A calibration as it is clicked together, and as the calls have it.

/** @typedef {[number, number]} XY
 * What the page holds: points may be missing yet, numbers are what stands in their fields.
 * @typedef {{ ruler: "none"|"stick"|"target"|"plane", stick: (XY|null)[], length: string, side: string, plane: number[][], plane_unit: string,
 *   origin: XY|null, toward: XY|null, angle: string, down: boolean, fps: string, camera: any, click: string,
 *   point: string, method: string, unit: string, unsure: boolean, fit: string, from: string, to: string, lines: string, zones: string }} Model
 */

/** @returns {Model} */
export const empty = () => ({ ruler: "none", stick: [null, null], length: "", side: "mean", plane: [], plane_unit: "m", origin: null, toward: null,
  angle: "", down: false, fps: "", camera: null, click: "", point: "center", method: "smoother", unit: "", unsure: false, fit: "", from: "", to: "", lines: "", zones: "" });

/** The places that the first four points of a plane most often have: corners of a square, to be put right. */
const CORNERS = [[0, 0], [1, 0], [1, 1], [0, 1]];

/** @param {Model} model @param {XY} at @returns {number[]} */
export const corner = (model, [x, y]) => [x, y, ...(CORNERS[model.plane.length] ?? [0, 0])];

/** @param {string} text */
const number = (text) => (text.trim() === "" ? undefined : Number(text));
/** @param {string} text */
const list = (text) => text.split("\n").map((line) => line.trim()).filter((line) => line);

/** What the calls take; where something is missing yet, what. @param {Model} model @param {XY} picture
 * @returns {{ setting?: { calibration: any, options: any }, missing?: string }} */
export function setting(model, picture) {
  const click = number(model.click) ?? .5;
  /** @type {Record<string, any>} */
  const calibration = { picture, axes: { click_error_px: click, up: model.down ? "down" : "up" } };
  if (model.ruler === "stick") {
    const [from, to] = model.stick;
    if (!from || !to) return { missing: `Click ${from || to ? "the other end" : "both ends"} of the stick in the picture.` };
    if (!model.length.trim()) return { missing: "Say how long the stick is, for example 0.50 m." };
    calibration.stick = { from, to, length: model.length, click_error_px: click };
  }
  if (model.ruler === "target") {
    if (!model.length.trim()) return { missing: "Say how large the target is, for example 7 cm." };
    calibration.target = { size: model.length, side: model.side };
  }
  if (model.ruler === "plane") {
    const n = model.plane.length;
    if (n < 4) return { missing: `Click at least four points of the plane in the picture; there ${n === 1 ? "is" : "are"} ${n}.` };
    calibration.plane = { unit: model.plane_unit, points: model.plane, click_error_px: click };
  }
  if (model.origin) calibration.axes.origin = model.origin;
  if (model.toward) calibration.axes.toward = model.toward;
  if (number(model.angle) !== undefined) calibration.axes.angle_deg = number(model.angle);
  if (number(model.fps) !== undefined) calibration.true_fps = number(model.fps);
  if (model.unit) calibration.unit = model.unit;
  if (model.camera) calibration.camera = model.camera;
  const span = model.from || model.to ? `@${number(model.from) ?? 0}-${number(model.to) ?? 1e9}` : "";
  const options = { point: model.point, method: model.method, unsure: model.unsure, fits: model.fit ? [model.fit + span] : [], lines: list(model.lines), zones: list(model.zones) };
  return { setting: { calibration, options } };
}

/** What the page holds of what the calls have. @param {{ calibration: any, options: any }} told @returns {Model} */
export function model({ calibration, options }) {
  const { stick, target, plane, axes = {} } = calibration;
  const [fit = "", span = ""] = (options.fits?.[0] ?? "").split("@");
  const [from = "", to = ""] = span.split("-");
  const text = (/** @type {any} */ value) => (value === undefined || value === null ? "" : String(value));
  return {
    ...empty(), ruler: stick ? "stick" : target ? "target" : plane ? "plane" : "none",
    stick: stick ? [stick.from, stick.to] : [null, null], length: stick?.length ?? target?.size ?? "", side: target?.side ?? "mean",
    plane: plane?.points ?? [], plane_unit: plane?.unit ?? "m", origin: axes.origin ?? null, toward: axes.toward ?? null, angle: text(axes.angle_deg),
    down: axes.up === "down", fps: text(calibration.true_fps), camera: calibration.camera ?? null,
    click: text((stick ?? plane ?? axes).click_error_px), point: options.point ?? "center", method: options.method ?? "smoother",
    unit: text(calibration.unit), unsure: options.unsure ?? false, fit, from, to, lines: (options.lines ?? []).join("\n"), zones: (options.zones ?? []).join("\n"),
  };
}
