// A run of the command line that is watched: what would change it cannot be used, and the page says why.

/** What stands in the place of the hint. @param {import("./api.js").Facts} facts */
export function outlook(facts) {
  if (facts.phase === "ended") return "The run is over; its results are where the command in the terminal says.";
  if (facts.phase === "failed") return "The run broke off; the command in the terminal says why.";
  return facts.now ? "You are watching a run of the command line: it can be looked at here, not changed." : "The run has not looked at a frame yet.";
}

/**
 * Puts the page into the state in which nothing can be changed.
 * @param {(id: string) => any} $ @param {{ frozen: boolean }[]} areas
 */
export function freeze($, areas) {
  document.body.classList.add("watching");
  for (const area of areas) area.frozen = true;
  const words = document.createElement("p");
  words.id = "read-only";
  words.textContent = "Read-only: this page shows a run of “pursuit track” or “ptz follow” with “--watch”. It is stopped in its terminal (Ctrl-C). To pick, step and correct, open the clip with “pursuit studio”.";
  $("open-form").before(words);
  for (const id of ["source", "open", "browse", "upload", "speed", "keys", "runs", "measure-open"]) $(id).hidden = true;
  for (const id of ["source", "speed"]) document.querySelector(`label[for=${id}]`)?.setAttribute("hidden", "");
  for (const id of ["tracker", "motion", "detector", "start", "pause", "stop", "back", "step", "seek", "rival"]) $(id).disabled = true;
  $("line").setAttribute("aria-disabled", "true");
  $("picture").setAttribute("aria-label", "Picture");
}
