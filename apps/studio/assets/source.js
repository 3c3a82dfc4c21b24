// Finding an input: names, the folders below the root, an upload.

import { call } from "./api.js";

export class Sources {
  /**
   * @param {{ input: HTMLInputElement, list: HTMLDataListElement, browse: HTMLButtonElement, files: HTMLElement,
   *   upload: HTMLButtonElement, file: HTMLInputElement }} parts
   * @param {(source: string) => void} open @param {(error: unknown) => void} fail @param {(text: string) => void} say
   */
  constructor(parts, open, fail, say) {
    this.parts = parts;
    this.open = open;
    this.fail = fail;
    this.say = say;
    parts.browse.addEventListener("click", () => this.toggle().catch(fail));
    parts.upload.addEventListener("click", () => parts.file.click());
    parts.file.addEventListener("change", () => this.send().catch(fail));
  }

  /** @param {string[]} names */
  suggest(names) {
    this.parts.list.replaceChildren(...names.map((name) => new Option(name, name)));
  }

  async toggle() {
    const open = this.parts.files.hidden;
    this.parts.files.hidden = !open;
    this.parts.browse.setAttribute("aria-expanded", String(open));
    if (open) await this.enter("");
  }

  /** @param {string} folder */
  async enter(folder) {
    /** @type {{ name: string, path: string, folder: boolean, bytes: number }[]} */
    const entries = await call("GET", `/api/files?folder=${encodeURIComponent(folder)}`);
    const rows = entries.map((entry) => this.row(entry.name + (entry.folder ? "/" : ""), entry.folder ? "" : size(entry.bytes),
      () => (entry.folder ? this.enter(entry.path).catch(this.fail) : this.take(entry.path))));
    if (folder) {
      const up = folder.split("/").slice(0, -1).join("/");
      rows.unshift(this.row("Open this folder as a sequence", folder, () => this.take(folder)));
      rows.unshift(this.row("‥", "up", () => this.enter(up).catch(this.fail)));
    }
    if (!entries.length) rows.push(this.row("Nothing here", "", () => {}));
    this.parts.files.replaceChildren(...rows);
  }

  /** @param {string} source */
  take(source) {
    this.parts.input.value = source;
    this.parts.files.hidden = true;
    this.parts.browse.setAttribute("aria-expanded", "false");
    this.open(source);
  }

  /** @param {string} name @param {string} fact @param {() => void} act */
  row(name, fact, act) {
    const button = document.createElement("button");
    button.type = "button";
    const small = document.createElement("small");
    small.textContent = fact;
    button.append(name, small);
    button.addEventListener("click", act);
    return button;
  }

  async send() {
    const file = this.parts.file.files?.[0];
    if (!file) return;
    this.say(`Uploading ${file.name} …`);
    const { source } = await call("POST", `/api/uploads?name=${encodeURIComponent(file.name)}`, file);
    this.parts.file.value = "";
    this.take(source);
  }
}

/** @param {number} bytes */
function size(bytes) {
  return bytes >= 1e6 ? `${(bytes / 1e6).toFixed(1)} MB` : `${Math.max(1, Math.round(bytes / 1e3))} kB`;
}
