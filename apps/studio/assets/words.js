// What the page says in sentences.

/** What can be done next. @param {import("./api.js").Facts} facts @param {number} selected the chosen target, 0 for none @param {boolean} picking */
export function advice(facts, selected, picking) {
  const { backward, now, head } = facts;
  if (picking) return "Go to the frame to start in and drag a box around the target: the command goes on in the terminal.";
  if (backward && (!backward.end || now?.frame === backward.from)) return wayBack(backward);
  if (facts.recorded && !facts.targets.length) return "A recorded run, to be looked at: Start plays it.";
  if (facts.recorded && !selected) return "A recorded run: Start plays it; click on a target to correct it, and it is followed again from there.";
  if (!facts.targets.length && facts.detector) return "Click on a box of the detector's, or drag one; or press Start: then the detector finds the target.";
  if (!facts.targets.length) return "Drag a box around the target; then press Start.";
  const again = now && head !== null && now.frame < head && !facts.input.live ? "; what comes after is followed again" : "";
  if (selected) return `Target ${selected} is chosen: drag a box to put it right in this frame${again}.`;
  return "Click on a target, or on its number, to correct it; drag a box for one more.";
}

/** How the way back from a corrected frame ended. @param {NonNullable<import("./api.js").Facts["backward"]>} way */
function wayBack({ target, from, to, end }) {
  if (!end) return `Target ${target} is followed backward from frame ${from}: frame ${to} …`;
  const ends = { met: "where it meets the earlier track", lost: "where it is not seen any more", drawn: "as far as it is more probable than the earlier track", gone: "where the pictures begin",
    stopped: "where you broke it off" };
  if (to === from) return `Target ${target} was put right in frame ${from}; ${end === "met" ? "the track before it agrees" : "nothing better was found before it"}. Start goes on from here.`;
  return `Target ${target} was followed backward from frame ${from} to ${to}, ${ends[end]}. Start goes on from here.`;
}
