// A run of the command line that is watched: what would change it cannot be used, and the page says why.

/** What stands in the place of the hint. @param {import("./api.js").Facts} facts */
export function outlook(facts) {
  if (facts.phase === "ended") return "The run is over; its results are where the command in the terminal says.";
  if (facts.phase === "failed") return "The run broke off; the command in the terminal says why.";
  return facts.now ? "You are watching a run of the command line. Ctrl-C in its terminal stops it; “pursuit studio” opens the clip to pick and correct." : "The run has not looked at a frame yet.";
}

/**
 * Leaves of the page what can be looked at: the picture and the table.
 * @param {(id: string) => any} $ @param {{ frozen: boolean }[]} areas what could be changed
 */
export function freeze($, areas) {
  document.body.classList.add("watching");
  for (const area of areas) area.frozen = true;
  $("line").setAttribute("aria-disabled", "true");
  $("picture").setAttribute("aria-label", "Picture");
}
