// What comes over the live connection, and a run of the command line that is watched.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { join } from "node:path";

/** Counts the kinds of pictures that a page is sent from now on. @param {import("playwright-core").Page} page */
export function listen(page) {
  /** @type {Record<string, number>} */
  const kinds = {};
  page.on("websocket", (socket) => socket.on("framereceived", ({ payload }) => {
    if (typeof payload === "string" || payload.length < 4) return;
    const facts = JSON.parse(payload.subarray(4, 4 + payload.readUInt32LE(0)).toString());
    kinds[facts.picture.kind] = (kinds[facts.picture.kind] ?? 0) + 1;
  }));
  return kinds;
}

/** How bright the picture is where something should be, and which frame the page says it is; both of one moment.
 * @param {import("playwright-core").Page} page @param {(frame: number) => number[]} patch */
export async function lookAt(page, patch) {
  return page.getByRole("region", { name: "Monitor", exact: true }).locator("canvas").first().evaluate((canvas, places) => {
    const frame = Number(/frame (\d+)/.exec(document.getElementById("status")?.textContent ?? "")?.[1]);
    const [l, t, w, h] = places[frame];
    const context = /** @type {CanvasRenderingContext2D} */ (/** @type {HTMLCanvasElement} */ (canvas).getContext("2d"));
    // A quarter of the box, off its middle, where the ellipse is.
    const seen = (/** @type {number} */ x, /** @type {number} */ y) => {
      const { data } = context.getImageData(Math.round(x), Math.round(y), Math.round(w / 4), Math.round(h / 4));
      let sum = 0;
      for (let i = 0; i < data.length; i += 4) sum += data[i];
      return 4 * sum / data.length;
    };
    return { frame, inside: seen(l + w / 8, t + h / 8), outside: seen((l + 160) % 270, (t + 110) % 190) };
  }, Array.from({ length: 200 }, (_, k) => patch(k)));
}

/**
 * A run of `pursuit track --watch` in the page: seen, and nothing of it changed.
 * @param {{ browser: import("playwright-core").Browser, pursuit: string, folder: string, shot: (name: string, page: import("playwright-core").Page) => Promise<void> }} parts
 */
export async function watched({ browser, pursuit, folder, shot }) {
  const args = ["track", "scene:drift?seed=7&duration=3000", "--tracker", "kcf", "--watch", "--no-video", "--out", join(folder, "watched")];
  const job = spawn(pursuit, args, { stdio: ["ignore", "ignore", "pipe"] });
  const over = new Promise((done) => { job.once("exit", done); });
  try {
    /** @type {string} */
    const line = await new Promise((done, failed) => {
      // A pipe cuts where it likes, also within a line.
      let said = "";
      job.stderr.on("data", (part) => {
        said += part;
        if (said.includes("\n")) done(said);
      });
      job.once("exit", (code) => failed(new Error(`the job ended with ${code}: ${said}`)));
    });
    assert.match(line, /^watch .* at http:\/\/127\.0\.0\.1:\d+\//);
    const url = /** @type {RegExpExecArray} */ (/http:\S+/.exec(line))[0];
    const page = await browser.newPage({ viewport: { width: 1280, height: 720 } });
    /** @type {string[]} */
    const complaints = [];
    page.on("pageerror", (error) => complaints.push(String(error)));
    const kinds = listen(page);
    await page.goto(url);
    const frame = async () => Number(/frame (\d+)/.exec(await page.getByRole("status").innerText())?.[1]);
    await page.waitForFunction(() => /frame \d+/.test(document.getElementById("status")?.textContent ?? ""));
    const first = await frame();
    await page.waitForFunction((n) => Number(/frame (\d+)/.exec(document.getElementById("status")?.textContent ?? "")?.[1]) > n, first + 5);
    assert.ok(await page.getByText("You are watching a run of the command line").isVisible());
    // The picture and the table, and nothing to set.
    assert.deepEqual(await page.getByRole("button").evaluateAll((all) => all.map((b) => b.getAttribute("aria-label")?.replace(/,.*/, ""))), ["Choose target 1"]);
    assert.equal(await page.locator("input:visible, select:visible, summary:visible").count(), 0);
    assert.ok(await page.getByRole("region", { name: "Targets", exact: true }).getByRole("row").nth(1).isVisible());
    assert.equal(await page.getByRole("button", { name: "Remove target 1" }).count(), 0);
    const refused = await page.evaluate(async () => {
      const { trials } = await (await fetch("/api/info")).json();
      const orders = await fetch(`/api/trials/${trials[0]}/orders`, { method: "POST", body: "{\"order\":\"stop\"}", headers: { "content-type": "application/json" } });
      return [orders.status, (await fetch(`/api/trials/${trials[0]}`, { method: "DELETE" })).status, (await fetch("/api/files")).status];
    });
    assert.deepEqual(refused, [403, 403, 403]);
    assert.ok((kinds.h264 ?? 0) > 3, JSON.stringify(kinds));
    await shot("watched", page);
    job.kill("SIGINT");
    await page.getByText("The run is over; its results are").waitFor();
    await page.getByText("the run is over", { exact: true }).waitFor();
    await shot("watched-over", page);
    assert.equal(await over, 130);
    assert.deepEqual(complaints, []);
    await page.close();
  } finally {
    job.kill("SIGKILL");
  }
}
