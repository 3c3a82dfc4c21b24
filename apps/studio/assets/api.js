// Calls of the studio.

/**
 * @typedef {{ target: number, state?: string, score?: number, box?: number[], predicted?: number[]|null,
 *   measured?: number[]|null, searched?: number[]|null, covariance?: number[]|null, velocity?: number[]|null,
 *   innovation_px?: number|null, error_px?: number|null, update_ms?: number|null, class?: string|null, doubt?: string|null, why?: Record<string, number>, backward?: boolean }} TargetRecord
 * @typedef {{ frame: number, time_s: number, truth: number[]|null, absent: boolean, records: TargetRecord[] }} Now
 * @typedef {{ phase: string, message: string|null, now: Now|null, first: number|null, head: number|null, targets: number[],
 *   input: { name: string, width: number, height: number, fps: number|null, frame_count: number|null, about: boolean, live: boolean,
 *     region: number[]|null, decoder: string, truth: boolean },
 *   tracker: string, parameters: Record<string, any>, backward: { target: number, from: number, to: number, end: null|"met"|"lost"|"drawn"|"gone"|"stopped", goes_on?: boolean }|null,
 *   edits: { frame: number, what: string, target: number|null }[],
 *   speed: number|null, look: string, looks: string[], detector: { name: string, parameters: Record<string, any> }|null, proposals: number[][],
 *   seeking: { name: string, parameters: Record<string, any> }|null, beside?: { now: Now|null, step_ms: number }|null, revision: number, undo: string|null, redo: string|null, names?: Record<number, { name?: string, color?: string }>, folder?: string|null, version: number, versions: { number: number, why: string, tracker: string, frames: number }[],
 *   step_ms: number, viewers: number, read_only?: boolean, recorded: boolean, remark?: string|null,
 *   picture: { kind: "jpeg"|"h264"|"none", frame: number, time_s: number, key?: boolean, codec?: string,
 *     width?: number, height?: number } }} Facts
 */

/**
 * @param {string} method @param {string} path @param {any} [body]
 * @returns {Promise<any>}
 */
export async function call(method, path, body) {
  const json = body !== undefined && !(body instanceof Blob);
  /** @type {RequestInit} */
  const options = { method, body: json ? JSON.stringify(body) : body };
  if (json) options.headers = { "content-type": "application/json" };
  let response;
  try {
    response = await fetch(path, options);
  } catch {
    throw new Error("the studio does not answer; is `pursuit studio` still running?");
  }
  if (response.status === 204) return null;
  const text = await response.text();
  if (response.ok) return JSON.parse(text);
  let message = text || response.statusText;
  try { message = JSON.parse(text).error ?? message; } catch { /* not ours: as it is */ }
  const error = new Error(message);
  /** @type {any} */ (error).status = response.status;
  throw error;
}

/** The rows of a time line from a frame on. @param {number|null} trial @param {number} from @returns {Promise<import("./timeline.js").Row[]>} */
export async function allRows(trial, from) {
  const rows = [];
  for (let next = from; next !== null;) {
    const part = await call("GET", `/api/trials/${trial}/rows?from=${next}`);
    rows.push(...part.rows);
    next = part.next;
  }
  return rows;
}
