// A clip as a phone takes it of a ball that is thrown before a board: the lens bends it, the board is seen obliquely, and 240 frames a second are
// marked as 30.

import { closeSync, openSync, writeFileSync, writeSync } from "node:fs";

export const PHONE = { width: 640, height: 360, fps: 240, frames: 160 };
/** Where the ball is on the board at a time, metres and seconds; y is up. */
export const THROWN = { x: .12, y: .26, vx: 1.7, vy: 3.3, g: 9.81 };
/** Crossings on the board, metres. */
export const MARKED = [[0, 0], [1.4, 0], [1.4, .9], [0, .9]];
/** Half of a mark's side, and the ball's radius, metres. */
const MARK = .08, BALL = .065;
const FOCAL = 540, CENTRE = [320, 180], K1 = -.16, TURNED = .45, AWAY = 2.5, LOOKED_AT = [.7, .5];

/** The camera as OpenCV writes it: its first pixel has its centre at 0. */
export const CAMERA = `%YAML:1.0
---
image_width: ${PHONE.width}
image_height: ${PHONE.height}
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ ${FOCAL}., 0., ${CENTRE[0] - .5}, 0., ${FOCAL}., ${CENTRE[1] - .5}, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ ${K1}, 0., 0., 0., 0. ]
`;

/** Where a place of the board is seen, pixels. @param {number[]} place */
export function seen([a, b]) {
  const [u, v] = [a - LOOKED_AT[0], LOOKED_AT[1] - b];
  const depth = AWAY + u * Math.sin(TURNED);
  const [x, y] = [u * Math.cos(TURNED) / depth, v / depth];
  const bent = 1 + K1 * (x * x + y * y);
  return [CENTRE[0] + FOCAL * x * bent, CENTRE[1] + FOCAL * y * bent];
}

/** The place of the board that a pixel shows. @param {number} px @param {number} py */
function shown(px, py) {
  const [dx, dy] = [(px - CENTRE[0]) / FOCAL, (py - CENTRE[1]) / FOCAL];
  let [x, y] = [dx, dy];
  for (let i = 0; i < 12; i += 1) {
    const bent = 1 + K1 * (x * x + y * y);
    [x, y] = [dx / bent, dy / bent];
  }
  // Of a ray (x, y, 1) t: u cos = x t, with t = away + u sin.
  const u = x * AWAY / (Math.cos(TURNED) - x * Math.sin(TURNED));
  return [LOOKED_AT[0] + u, LOOKED_AT[1] - y * (AWAY + u * Math.sin(TURNED))];
}

/** Where the ball is in a frame, metres. @param {number} frame */
export function thrown(frame) {
  const t = frame / PHONE.fps;
  return [THROWN.x + THROWN.vx * t, THROWN.y + THROWN.vy * t - THROWN.g * t * t / 2];
}

/** The ball's box in a frame: left, top, width and height. @param {number} frame */
export function ballBox(frame) {
  const [a, b] = thrown(frame);
  const [l, t] = [seen([a - BALL, b])[0], seen([a, b + BALL])[1]];
  return [l, t, seen([a + BALL, b])[0] - l, seen([a, b - BALL])[1] - t].map(Math.round);
}

/** @param {number} a @param {number} b @param {number[]} ball */
function level(a, b, [x, y]) {
  const [u, v] = [a - x, b - y];
  if (u * u + v * v < BALL * BALL) return Math.abs(u) < BALL / 3 ? 235 : v > 0 ? 190 : 70;
  const mark = MARKED.find(([p, q]) => Math.abs(a - p) < MARK && Math.abs(b - q) < MARK);
  if (mark) return (a > mark[0]) === (b > mark[1]) ? 25 : 225;
  // A board with a grain.
  return 120 + 8 * Math.sin(9 * a + 3 * b) + 6 * Math.sin(31 * a - 17 * b);
}

/** @param {string} path */
export function writePhoneClip(path) {
  const { width, height, frames } = PHONE;
  const samples = [1 / 6, 3 / 6, 5 / 6];
  const points = new Float64Array(width * height * 18);
  for (let at = 0, y = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1) {
      for (const dy of samples) for (const dx of samples) { [points[at], points[at + 1]] = shown(x + dx, y + dy); at += 2; }
    }
  }
  const mean = (/** @type {number} */ pixel, /** @type {number[]} */ ball) => {
    let sum = 0;
    for (let i = 0; i < 9; i += 1) sum += level(points[18 * pixel + 2 * i], points[18 * pixel + 2 * i + 1], ball);
    return sum / 9;
  };
  const nowhere = [1e9, 1e9];
  const still = Uint8Array.from({ length: width * height }, (_, pixel) => mean(pixel, nowhere));
  const file = openSync(path, "w");
  writeSync(file, `YUV4MPEG2 W${width} H${height} F30:1 Ip A1:1 Cmono\n`);
  let chance = 7;
  for (let k = 0; k < frames; k += 1) {
    const picture = Buffer.from(still);
    const [l, t, w, h] = ballBox(k), ball = thrown(k);
    for (let y = Math.max(t - 3, 0); y < Math.min(t + h + 3, height); y += 1) {
      for (let x = Math.max(l - 3, 0); x < Math.min(l + w + 3, width); x += 1) picture[y * width + x] = mean(y * width + x, ball);
    }
    for (let i = 0; i < picture.length; i += 1) {
      chance = (Math.imul(chance, 1664525) + 1013904223) >>> 0;
      picture[i] = Math.min(Math.max(picture[i] + (chance >>> 29) - 3.5, 0), 255);
    }
    writeSync(file, "FRAME\n");
    writeSync(file, picture);
  }
  closeSync(file);
  writeFileSync(path.replace(/\.y4m$/, ".yml"), CAMERA);
}
