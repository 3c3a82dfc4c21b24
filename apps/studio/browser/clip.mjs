// A clip of known content: a patch of texture that moves over another texture. Y4M, which needs no encoder.

import { openSync, writeSync, closeSync } from "node:fs";

export const WIDTH = 320, HEIGHT = 240, FRAMES = 120;
/** The patch, left, top, width and height, in frame `k`. @param {number} k */
export const patch = (k) => [40 + 1.5 * k, 90 + 30 * Math.sin(k / 14), 44, 36].map(Math.round);

const noise = (x, y) => (((x * 73856093) ^ (y * 19349663)) >>> 0) % 97;

/** Frames of the clip with a loss, and those in which its patch is hidden. */
export const LONG = 300, HIDDEN = [140, 160];
/** The patch that goes away and comes back elsewhere, larger and with its other side, in frame `k`. @param {number} k */
export const returning = (k) => (k < HIDDEN[1] ? [30 + 0.8 * k, 60 + 20 * Math.sin(k / 14), 44, 36] : [230 - 0.8 * (k - HIDDEN[1]), 150 + 20 * Math.sin(k / 14), 70, 58]).map(Math.round);

/** @param {string} path */
export function writeClip(path) {
  write(path, FRAMES, patch, () => 0);
}

/** @param {string} path */
export function writeClipWithLoss(path) {
  write(path, LONG, returning, (k) => (k < HIDDEN[0] ? 0 : k >= HIDDEN[1] ? 1 : -1));
}

/** @param {string} path @param {number} frames @param {(k: number) => number[]} patch
 * @param {(k: number) => number} side which side of the patch is seen, -1 for none */
function write(path, frames, patch, side) {
  const file = openSync(path, "w");
  writeSync(file, `YUV4MPEG2 W${WIDTH} H${HEIGHT} F25:1 Ip A1:1 C420jpeg\n`);
  for (let k = 0; k < frames; k += 1) {
    const picture = Buffer.alloc(WIDTH * HEIGHT * 3 / 2, 128);
    const [l, t, w, h] = patch(k);
    for (let y = 0; y < HEIGHT; y += 1) {
      for (let x = 0; x < WIDTH; x += 1) {
        const inside = side(k) >= 0 && x >= l && x < l + w && y >= t && y < t + h;
        // Coarse blocks: texture that stays when it moves by whole pixels.
        picture[y * WIDTH + x] = inside ? 120 + noise(((x - l) >> 2) + 5000 * side(k), (y - t) >> 2) : 30 + noise((x + 999) >> 3, y >> 3) / 2;
        if (inside) picture[WIDTH * HEIGHT + (y >> 1) * (WIDTH >> 1) + (x >> 1)] = 170;
      }
    }
    writeSync(file, "FRAME\n");
    writeSync(file, picture);
  }
  closeSync(file);
}
