// What is folded away until it is asked for: one panel at a time, beside the picture or, on small screens, below it.

/** @typedef {"targets"|"settings"|"measure"} Panel */
const PANELS = /** @type {Panel[]} */ (["targets", "settings", "measure"]);

export class Panels {
  /** @param {(id: string) => any} $ */
  constructor($) {
    this.$ = $;
    /** @type {Panel|null} */
    this.shown = null;
    /** Called with what is shown now and what was before. @type {(now: Panel|null, before: Panel|null) => void} */
    this.changed = () => {};
    for (const panel of PANELS) $(`${panel}-open`).addEventListener("click", () => this.show(this.shown === panel ? null : panel));
    $("full").addEventListener("click", () => this.full());
    document.addEventListener("fullscreenchange", () => document.body.classList.toggle("full", document.fullscreenElement !== null));
    // A menu closes when something else is used, and with Escape.
    for (const menu of /** @type {NodeListOf<HTMLDetailsElement>} */ (document.querySelectorAll(".menu"))) {
      addEventListener("pointerdown", (event) => { if (!menu.contains(/** @type {Node} */ (event.target))) menu.open = false; });
      // It is on the screen wherever its button stands.
      menu.addEventListener("toggle", () => {
        const shown = /** @type {HTMLElement} */ (menu.lastElementChild);
        shown.style.right = "";
        const { left } = shown.getBoundingClientRect();
        if (menu.open && left < 4) shown.style.right = `${left - 4}px`;
      });
      menu.addEventListener("keydown", (event) => { if (event.key === "Escape" && menu.open) { menu.open = false; menu.querySelector("summary")?.focus(); event.stopPropagation(); } });
    }
  }

  /** @param {Panel|null} panel */
  show(panel) {
    const before = this.shown;
    this.shown = panel;
    this.$("drawer").hidden = panel === null;
    for (const one of PANELS) {
      this.$(one).hidden = one !== panel;
      this.$(`${one}-open`).setAttribute("aria-pressed", String(one === panel));
    }
    if (panel && matchMedia("(max-width: 1100px)").matches) this.$("drawer").scrollIntoView({ block: "nearest" });
    if (panel !== before) this.changed(panel, before);
  }

  /** The picture alone on the whole screen, and back. */
  full() {
    const over = document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen();
    // Where the browser does not allow it, the page stays as it is.
    over.catch(() => {});
  }
}
