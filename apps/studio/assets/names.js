// What targets are called, and the colour that each is drawn in.

/** @typedef {import("./api.js").Facts} Facts */

/** Colours that colour-blind people can tell apart, which show on dark and on light pictures. */
const COLORS = ["#ffffff", "#56b4e9", "#e69f00", "#4fd1a5", "#f0e442", "#ff8f6b", "#dd9cc0", "#b9a3ff"];

/** @param {Facts|null} facts @param {number} target */
export function called(facts, target) {
  return facts?.names?.[target]?.name || String(target);
}

/** @param {Facts|null} facts @param {number} target */
export function colorOf(facts, target) {
  return facts?.names?.[target]?.color || COLORS[(target - 1) % COLORS.length];
}
