// Key points: clicked, followed together, put right by a click.

import assert from "node:assert/strict";
import { FRAMES } from "./clip.mjs";
import { facts } from "./detecting.mjs";

/** @param {{ page: import("playwright-core").Page, patch: (k: number) => number[], [name: string]: any }} parts */
export async function points({ page, button, set, target, at, until, frame, says, shot, download, patch, panel }) {
  await page.waitForTimeout(1600);
  await page.getByLabel("Source", { exact: true }).fill("clip.y4m");
  await button("Open").click();
  await until(async () => (await frame()) === 0 && (await facts(page)).targets.length === 0, "not opened");
  await panel("Settings");
  const before = await page.locator("#tracker").inputValue();
  await set("Tracker", "point");
  await until(async () => (await facts(page)).tracker === "point", "no tracker of points");
  await page.getByText("Click on the points to follow").waitFor();
  const offsets = [[16, 18], [28, 18]];
  for (const [i, [x, y]] of offsets.entries()) {
    const [l, t] = patch(0), place = await at();
    // The second lies in the square of the first: with Shift it is one more point all the same.
    await page.keyboard.down("Shift");
    await page.mouse.click(...place(l + x, t + y));
    await page.keyboard.up("Shift");
    await target(i + 1).waitFor();
  }
  await button("Start").click();
  await says("the end is reached");
  const rows = (await download("CSV")).trim().split("\n").slice(1).map((/** @type {string} */ line) => line.split(","));
  assert.equal(rows.length, 2 * FRAMES);
  const off = rows.map((/** @type {string[]} */ cells) => {
    const [x, y] = offsets[Number(cells[2]) - 1], [l, t] = patch(Number(cells[0]));
    return Math.hypot(Number(cells[4]) + 15.5 - l - x, Number(cells[5]) + 15.5 - t - y);
  }).sort((/** @type {number} */ a, /** @type {number} */ b) => a - b);
  console.log(`    two points, ${rows.length} rows: off by ${off[off.length >> 1].toFixed(2)} px, at most ${off.at(-1).toFixed(2)}`);
  assert.ok(rows.every((/** @type {string[]} */ cells) => cells[3] === "tracking") && off.at(-1) < 1.5, `off by ${off.at(-1)}`);
  await shot("points");
  // A click beside its square puts a chosen one right.
  await target(1).click();
  await page.getByText(/Point .+ is chosen/).waitFor();
  const place = await at();
  await page.mouse.click(...place(200, 40));
  await until(async () => (await facts(page)).now.records.some((/** @type {any} */ r) => r.target === 1 && Math.abs(r.box[0] + 15.5 - 200) < 1), "not put right");
  await panel("Settings");
  await set("Tracker", before);
}
