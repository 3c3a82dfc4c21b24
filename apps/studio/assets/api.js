// Calls of the studio, and the live connection that comes back when it was lost.

/**
 * @typedef {{ target: number, state?: string, score?: number, box?: number[], predicted?: number[]|null,
 *   measured?: number[]|null, searched?: number[]|null, covariance?: number[]|null, velocity?: number[]|null,
 *   innovation_px?: number|null, error_px?: number|null, update_ms?: number|null, why?: Record<string, number> }} TargetRecord
 * @typedef {{ frame: number, time_s: number, truth: number[]|null, absent: boolean, records: TargetRecord[] }} Now
 * @typedef {{ phase: string, message: string|null, now: Now|null, first: number|null, head: number|null, targets: number[],
 *   input: { name: string, width: number, height: number, fps: number|null, frame_count: number|null, live: boolean,
 *     decoder: string, truth: boolean },
 *   tracker: string, parameters: Record<string, any>, edits: { frame: number, what: string, target: number|null }[],
 *   speed: number|null, version: number, versions: { number: number, why: string, tracker: string, frames: number }[],
 *   step_ms: number, viewers: number }} Facts
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

/** Shows a trial until closed; connects again when the connection breaks off. */
export class Live {
  /**
   * @param {number} trial
   * @param {(facts: Facts, picture: ImageBitmap|null) => void} show
   * @param {(state: "connecting"|"live"|"lost"|"over") => void} tell
   */
  constructor(trial, show, tell) {
    this.trial = trial;
    this.show = show;
    this.tell = tell;
    this.closed = false;
    this.wait = 250;
    /** @type {Blob|ArrayBuffer|null} */
    this.newest = null;
    this.busy = false;
    /** @type {WebSocket|null} */
    this.socket = null;
    this.connect();
  }

  connect() {
    if (this.closed) return;
    this.tell("connecting");
    const socket = new WebSocket(`ws://${location.host}/api/trials/${this.trial}/live`);
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onmessage = (event) => {
      this.wait = 250;
      this.tell("live");
      // Only the newest is worth showing.
      this.newest = event.data;
      this.paint();
    };
    socket.onclose = async () => {
      if (this.closed || this.socket !== socket) return;
      this.tell("lost");
      await new Promise((done) => setTimeout(done, this.wait));
      this.wait = Math.min(2 * this.wait, 4000);
      try {
        await call("GET", `/api/trials/${this.trial}`);
      } catch (error) {
        if (/** @type {any} */ (error).status) { this.tell("over"); return; }
      }
      this.connect();
    };
  }

  async paint() {
    if (this.busy) return;
    this.busy = true;
    while (this.newest && !this.closed) {
      const data = /** @type {ArrayBuffer} */ (this.newest);
      this.newest = null;
      const length = new DataView(data).getUint32(0, true);
      const facts = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
      const jpeg = data.slice(4 + length);
      let picture = null;
      if (jpeg.byteLength > 0) {
        try { picture = await createImageBitmap(new Blob([jpeg], { type: "image/jpeg" })); } catch { /* none then */ }
      }
      if (!this.closed) this.show(facts, picture);
      picture?.close();
    }
    this.busy = false;
  }

  close() {
    this.closed = true;
    this.socket?.close();
  }
}
