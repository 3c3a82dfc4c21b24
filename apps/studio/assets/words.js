// What the page says in sentences.

import { called } from "./names.js";

/** @typedef {import("./api.js").Facts} Facts */

/** What can be done next.
 * @param {Facts} facts @param {{ selected: number, picking: boolean, adding: boolean }} page the chosen target, 0 for none; whether a command waits for a box; whether the next box is one more target */
export function advice(facts, { selected, picking, adding }) {
  const { backward, now, head, phase } = facts;
  if (picking) return "Go to the frame to start in and drag a box around the target: the command goes on in the terminal.";
  if (backward && (!backward.end || now?.frame === backward.from)) return wayBack(facts, backward);
  const points = facts.tracker === "point" && !facts.recorded;
  if (adding) return points ? "Click on one more point." : "Drag a box around one more target.";
  if (facts.recorded && !facts.targets.length) return "A run from a folder, to be looked at: Start plays it.";
  if (!facts.targets.length && facts.detector) return "Click on one of the detector's boxes, or drag one; or press Start: then the detector finds the target.";
  if (!facts.targets.length) return points ? "Click on the points to follow; then press Start." : "Drag a box around the target; then press Start.";
  if (points && selected) return `Point ${called(facts, selected)} is chosen: click where it is in this frame, well beside its square.`;
  if (points && begunHere(facts)) return "Press Start, or click on further points. Targets gives them names.";
  if (selected) return `Target ${called(facts, selected)} is chosen: drag the right box in this frame${now && head !== null && now.frame < head && !facts.input.live ? "; what comes after is followed again" : ""}.`;
  if (phase === "running") return "Following. Pause, or go to any frame in the time line, to put a box right.";
  if (begunHere(facts)) return "Press Start. Another box replaces this one; with Shift held, or after Add target, it is one more.";
  if (now && head !== null && now.frame < head) return "Start goes on from here. Is a box wrong? Click on it, then drag the right one.";
  if (phase === "ended") return "Followed to the end. Is a box wrong? Go there, click on it, drag the right one. Files: under Targets.";
  return "Press Start to go on. Is a box wrong? Click on it, then drag the right one.";
}

/** The target that was begun in the frame shown, and that nothing was followed of yet: a box drawn now is meant for it; 0 for none. @param {Facts} facts */
export function begunHere({ edits, head, now, phase, targets, recorded }) {
  const last = edits.at(-1);
  const here = !recorded && phase !== "running" && now !== null && now.frame === head && last?.frame === head && last.what === "add";
  return here && last.target !== null && targets.includes(last.target) ? last.target : 0;
}

/** How the way back from a corrected frame ended. @param {Facts} facts @param {NonNullable<Facts["backward"]>} way */
function wayBack(facts, { target: number, from, to, end, goes_on }) {
  const target = called(facts, number);
  if (!end) return `Target ${target} is followed backward from frame ${from}: frame ${to} … ${goes_on ? "Then it goes on forward." : ""}`;
  const ends = { met: "where it meets the earlier track", lost: "where it is not seen any more", drawn: "as far as it is more probable than the earlier track", gone: "where the pictures begin",
    stopped: "where you broke it off" };
  if (to === from) return `Target ${target} was put right in frame ${from}; ${end === "met" ? "the track before it agrees" : "nothing better was found before it"}. Start goes on from here.`;
  return `Target ${target} was followed backward from frame ${from} to ${to}, ${ends[end]}. Start goes on from here.`;
}
