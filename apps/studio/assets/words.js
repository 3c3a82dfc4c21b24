// What the page says in sentences.

/** How the way back from a corrected frame ended. @param {NonNullable<import("./api.js").Facts["backward"]>} way */
export function wayBack({ target, from, to, end }) {
  if (!end) return `Target ${target} is followed backward from frame ${from}: frame ${to} …`;
  const ends = { met: "where it meets the earlier track", lost: "where it is not seen any more", drawn: "as far as it is more probable than the earlier track", gone: "where the pictures begin",
    stopped: "where you broke it off" };
  if (to === from) return `Target ${target} was put right in frame ${from}; ${end === "met" ? "the track before it agrees" : "nothing better was found before it"}. Start goes on from here.`;
  return `Target ${target} was followed backward from frame ${from} to ${to}, ${ends[end]}. Start goes on from here.`;
}
