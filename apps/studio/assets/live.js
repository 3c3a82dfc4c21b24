// The live connection, which comes back when it was lost: pictures with what is known of them.

import { call } from "./api.js";

/** @typedef {import("./api.js").Facts} Facts */
/** @typedef {(facts: Facts, picture: ImageBitmap|VideoFrame|null) => void} Show */

/** Pictures that wait for the decoder; when there are more, those up to the next key frame are left out. */
const MOST_WAITING = 12;

/** Whether the browser has said that it cannot decode the video: then each picture comes as JPEG. */
let refused = !("VideoDecoder" in globalThis);

/** Decodes H.264 as it comes; pictures come out a little later, with what belongs to them. */
class Video {
  /** @param {(turn: number, facts: Facts, picture: VideoFrame) => void} decoded @param {() => void} ask @param {() => void} failed */
  constructor(decoded, ask, failed) {
    /** @type {Map<number, Facts>} */
    this.waiting = new Map();
    this.codec = "";
    this.late = false;
    this.ask = ask;
    this.decoder = new VideoDecoder({
      output: (picture) => {
        const facts = this.waiting.get(picture.timestamp);
        // What came before it and did not come out will not.
        for (const turn of this.waiting.keys()) if (turn <= picture.timestamp) this.waiting.delete(turn);
        if (facts) decoded(picture.timestamp, facts, picture);
        picture.close();
      },
      error: () => { this.waiting.clear(); failed(); },
    });
  }

  /** @param {number} turn @param {Facts} facts @param {Uint8Array} data */
  take(turn, facts, data) {
    const { key, codec } = facts.picture;
    if (this.decoder.state === "closed" || (!key && (this.late || !this.codec))) return;
    if (!key && this.decoder.decodeQueueSize > MOST_WAITING) {
      this.late = true;
      this.ask();
      return;
    }
    if (key) this.late = false;
    if (key && codec && codec !== this.codec) {
      this.decoder.configure({ codec, optimizeForLatency: true });
      this.codec = codec;
    }
    this.waiting.set(turn, facts);
    this.decoder.decode(new EncodedVideoChunk({ type: key ? "key" : "delta", timestamp: turn, data }));
  }

  /** Other facts of the picture that came last; whether it is still to come out. @param {Facts} facts */
  amend(facts) {
    const last = [...this.waiting.keys()].at(-1);
    if (last !== undefined) this.waiting.set(last, facts);
    return last !== undefined;
  }

  close() {
    this.waiting.clear();
    if (this.decoder.state !== "closed") this.decoder.close();
  }
}

/** Shows a trial until closed; connects again when the connection breaks off. */
export class Live {
  /**
   * @param {number} trial
   * @param {Show} show
   * @param {(state: "connecting"|"live"|"lost"|"over"|"ended") => void} tell
   */
  constructor(trial, show, tell) {
    this.trial = trial;
    this.show = show;
    this.tell = tell;
    this.closed = false;
    this.wait = 250;
    /** The newest JPEG that has not been painted. @type {{ turn: number, facts: Facts, jpeg: Uint8Array<ArrayBuffer> }|null} */
    this.newest = null;
    this.busy = false;
    /** Messages so far, and the one shown. */
    this.turn = 0;
    this.shown = 0;
    /** @type {Facts|null} */
    this.last = null;
    /** @type {WebSocket|null} */
    this.socket = null;
    /** @type {Video|null} */
    this.video = null;
    this.connect();
  }

  connect() {
    if (this.closed) return;
    this.tell("connecting");
    const socket = new WebSocket(`ws://${location.host}/api/trials/${this.trial}/live?video=${refused ? "jpeg" : "h264"}`);
    this.socket = socket;
    const ask = () => { if (socket.readyState === WebSocket.OPEN) socket.send("key"); };
    const failed = () => { refused = true; socket.close(); };
    this.video = refused ? null : new Video((turn, facts, picture) => this.present(turn, facts, picture), ask, failed);
    socket.binaryType = "arraybuffer";
    socket.onmessage = (event) => {
      this.wait = 250;
      this.tell("live");
      this.take(event.data);
    };
    socket.onclose = async () => {
      this.video?.close();
      if (this.closed || this.socket !== socket) return;
      // A job that was watched is over, and its address with it.
      if (this.last?.read_only && this.last.phase !== "running") { this.tell("ended"); return; }
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

  /** @param {ArrayBuffer} message */
  take(message) {
    const length = new DataView(message).getUint32(0, true);
    /** @type {Facts} */
    const facts = JSON.parse(new TextDecoder().decode(new Uint8Array(message, 4, length)));
    const data = new Uint8Array(message, 4 + length);
    this.turn += 1;
    this.last = facts;
    if (facts.picture.kind === "h264") this.video?.take(this.turn, facts, data);
    else if (facts.picture.kind === "none") { if (!this.video?.amend(facts)) this.present(this.turn, facts, null); }
    else {
      // Only the newest is worth showing.
      this.newest = { turn: this.turn, facts, jpeg: data };
      this.paint();
    }
  }

  async paint() {
    if (this.busy) return;
    this.busy = true;
    while (this.newest && !this.closed) {
      const { turn, facts, jpeg } = this.newest;
      this.newest = null;
      let picture = null;
      if (jpeg.byteLength > 0) {
        try { picture = await createImageBitmap(new Blob([jpeg], { type: "image/jpeg" })); } catch { /* none then */ }
      }
      this.present(turn, facts, picture);
      picture?.close();
    }
    this.busy = false;
  }

  /** Shows what came in this turn, unless something newer is shown. @param {number} turn @param {Facts} facts @param {ImageBitmap|VideoFrame|null} picture */
  present(turn, facts, picture) {
    if (this.closed || turn < this.shown) return;
    this.shown = turn;
    this.show(facts, picture);
  }

  close() {
    this.closed = true;
    this.socket?.close();
  }
}
