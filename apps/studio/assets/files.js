// What is taken out of a trial and brought into it as files, and who its targets are.

import { call } from "./api.js";
import { save } from "./measuring.js";
import { called, colorOf } from "./names.js";

/** @typedef {import("./api.js").Facts} Facts
 * @typedef {{ $: (id: string) => any, state: { trial: number|null, facts: Facts|null, selected: number }, then: (act: () => Promise<any>) => any,
 *   known: () => number[], fail: (error: unknown) => void, say: (text: string) => void, accept: (facts: Facts) => void }} Page */

export class Files {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    const { $, then, fail } = page;
    $("label").addEventListener("submit", (/** @type {Event} */ event) => event.preventDefault());
    for (const id of ["label-name", "label-color"]) $(id).addEventListener("change", () => then(() => this.label()));
    $("import").addEventListener("click", () => $("import-file").click());
    $("import-file").addEventListener("change", () => then(() => this.read()));
    $("film").addEventListener("click", () => this.film().catch(fail));
    const other = () => Number($("other").value);
    $("merge").addEventListener("click", () => then(() => this.identify({ change: "merge", into: other() }, other())));
    $("split").addEventListener("click", () => then(() => this.identify({ change: "split" }, 0)));
    $("swap").addEventListener("click", () => then(() => this.identify({ change: "swap", with: other(), from: Number($("swap-from").value), to: Number($("swap-to").value) })));
  }

  /** @param {number|null} trial */
  links(trial) {
    const { $ } = this.page;
    const version = $("version").value ? `&version=${$("version").value}` : "";
    for (const format of ["table", "csv", "mot", "coco", "cvat"]) $(format).href = `/api/trials/${trial}/trajectory?format=${format}${version}`;
  }

  /** @param {Facts} facts @param {number} selected */
  show(facts, selected) {
    const { $ } = this.page;
    $("label").hidden = !selected || facts.read_only === true;
    if (selected && !$("label").contains(document.activeElement)) {
      $("label-name").value = facts.names?.[selected]?.name ?? "";
      $("label-name").placeholder = `Target ${selected}`;
      $("label-color").value = colorOf(facts, selected);
    }
    this.others(facts, selected);
    const folder = facts.folder ? `Kept in ${facts.folder} as it goes.` : "Kept in a folder of its own once something is followed.";
    if ($("kept-in").textContent !== folder) $("kept-in").textContent = folder;
  }

  /** Offers the targets that the chosen one could be. @param {Facts} facts @param {number} selected */
  others(facts, selected) {
    const { $ } = this.page;
    $("identity").hidden = $("label").hidden || facts.input.live;
    const others = this.page.known().filter((t) => t !== selected);
    const key = others.map((t) => called(facts, t)).join();
    if ($("other").dataset.key !== key) {
      $("other").dataset.key = key;
      $("other").replaceChildren(...others.map((t) => new Option(called(facts, t), String(t))));
    }
    for (const id of ["merge", "swap"]) $(id).disabled = others.length === 0;
    const now = facts.now?.frame ?? 0;
    for (const [id, frame] of /** @type {[string, number][]} */ ([["swap-from", now], ["swap-to", facts.head ?? now]])) if (!$("identity").open) $(id).value = frame;
  }

  /** Says who the chosen target is. @param {Record<string, any>} change @param {number} [chosen] the target that is chosen afterwards; 0 for none */
  async identify(change, chosen) {
    const { state, accept } = this.page;
    const facts = await call("PUT", `/api/trials/${state.trial}/targets/${state.selected}/identity`, change);
    if (chosen !== undefined) state.selected = chosen;
    accept(facts);
  }

  /** Names the chosen target and gives it a colour. */
  async label() {
    const { $, state, accept } = this.page;
    const target = state.selected;
    const color = $("label-color").value;
    const own = state.facts?.names?.[target]?.color;
    const body = { name: $("label-name").value, color: own || color !== colorOf(null, target) ? color : null };
    accept(await call("PUT", `/api/trials/${state.trial}/targets/${target}/label`, body));
  }

  /** Reads boxes from a file in place of what there is. */
  async read() {
    const { $, state, say, accept } = this.page;
    const file = $("import-file").files[0];
    $("import-file").value = "";
    if (!file || state.trial === null) return;
    say(`Reading ${file.name} …`);
    accept(await call("POST", `/api/trials/${state.trial}/import`, file));
  }

  /** Has the clip made into a video with what is known drawn in. */
  async film() {
    const { $, state } = this.page;
    if (state.trial === null) return;
    $("film").disabled = true;
    $("film").textContent = "Making the video …";
    try {
      const answer = await fetch(`/api/trials/${state.trial}/video`);
      if (!answer.ok) throw new Error((await answer.json()).error);
      save(await answer.blob(), "overlay.mp4");
    } finally {
      $("film").disabled = false;
      $("film").textContent = "Video";
    }
  }
}
