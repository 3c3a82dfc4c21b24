// What the monitor shows beside the picture.

import assert from "node:assert/strict";

/** @param {{ page: import("playwright-core").Page, canvas: import("playwright-core").Locator, patch: (k: number) => number[], [name: string]: any }} parts */
export async function looking({ page, button, menu, canvas, until, frame, shot, patch }) {
  const view = page.getByLabel("View", { exact: true });
  const pixel = (/** @type {number} */ x, /** @type {number} */ y) => canvas.evaluate((c, at) =>
    [.../** @type {CanvasRenderingContext2D} */ (/** @type {HTMLCanvasElement} */ (c).getContext("2d")).getImageData(at[0], at[1], 1, 1).data], [x, y]);
  const open = async (/** @type {string} */ source) => {
    await page.waitForTimeout(1600);
    await page.getByLabel("Source", { exact: true }).fill(source);
    await button("Open").click();
    await page.waitForFunction((name) => document.getElementById("status")?.textContent?.startsWith(`${name} `) && /frame 0 of/.test(document.getElementById("status")?.textContent ?? ""), source);
  };
  await open("scene:depth-occluder?duration=2");
  assert.deepEqual(await view.locator("option").evaluateAll((all) => all.map((o) => /** @type {HTMLOptionElement} */ (o).value)), ["picture", "depth", "foreground"]);
  await menu();
  await view.selectOption("depth");
  // Far is blue, which the picture nowhere is.
  await until(async () => { const [r, , b] = await pixel(3, 3); return b > 150 && r < 90; }, "the depth is not shown");
  await shot("depth");
  await open("clip.y4m");
  assert.equal(await view.locator("option").count(), 2);
  assert.equal(await view.inputValue(), "picture");
  await page.getByLabel("Frame", { exact: true }).fill("60");
  await page.getByLabel("Frame", { exact: true }).press("Enter");
  await until(async () => (await frame()) === 60, "not gone to frame 60");
  await menu();
  await view.selectOption("foreground");
  const [l, t, w, h] = patch(60);
  await until(async () => (await pixel(l + w - 4, t + h - 4))[0] > 180 && (await pixel(l + w + 60, t - 20))[0] < 60, "what moves is not shown");
  await shot("foreground");
  await menu();
  await view.selectOption("picture");
  await until(async () => (await pixel(l + w + 60, t - 20))[0] > 20, "the picture does not come back");
}
