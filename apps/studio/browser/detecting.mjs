// A detector in the page: its boxes in the picture, and runs that begin without a box.

import assert from "node:assert/strict";
import { FRAMES } from "./clip.mjs";

/** @param {number[]} a @param {number[]} b */
function overlap(a, b) {
  const shared = (/** @type {number} */ i) => Math.max(0, Math.min(a[i] + a[i + 2], b[i] + b[i + 2]) - Math.max(a[i], b[i]));
  const both = shared(0) * shared(1);
  return both / (a[2] * a[3] + b[2] * b[3] - both);
}

/** What the newest trial says. @param {import("playwright-core").Page} page */
export async function facts(page) {
  return page.evaluate(async () => {
    const { trials } = await (await fetch("/api/info")).json();
    return (await fetch(`/api/trials/${trials.at(-1)}`)).json();
  });
}

/** @param {{ page: import("playwright-core").Page, patch: (k: number) => number[], [name: string]: any }} parts */
export async function detecting({ page, button, region, set, menu, panel, target, drag, at, until, frame, says, shot, download, patch, complaints }) {
  const seek = async (/** @type {number} */ k) => {
    await page.getByLabel("Frame", { exact: true }).fill(String(k));
    await page.getByLabel("Frame", { exact: true }).press("Enter");
    await until(async () => (await frame()) === k, `not gone to frame ${k}`);
  };
  const open = async () => {
    // A second wish to open the same within a moment counts as the first.
    await page.waitForTimeout(1600);
    await page.getByLabel("Source", { exact: true }).fill("clip.y4m");
    await button("Open").click();
    await until(async () => (await frame()) === 0 && (await facts(page)).targets.length === 0, "not opened");
  };
  await panel("Settings");
  const names = await page.getByRole("combobox", { name: "Detector", exact: true }).locator("option").allInnerTexts();
  const known = await page.evaluate(async () => (await (await fetch("/api/trackers")).json()).detectors.map((/** @type {any} */ d) => d.name));
  assert.deepEqual(names, ["none", ...known]);
  await open();
  await set("Detector", "motion");
  await seek(60);
  const near = (/** @type {number[][]} */ boxes, /** @type {number} */ k) => boxes.find((box) => overlap(box, patch(k)) > .5);
  const box = near((await facts(page)).proposals, 60);
  assert.ok(box, `nothing proposed near ${patch(60)}: ${JSON.stringify((await facts(page)).proposals)}`);
  await shot("detector");
  // A click takes it as it is; a box drawn roughly around another snaps to it.
  const place = await at();
  await page.mouse.click(...place(box[0] + box[2] / 2, box[1] + box[3] / 2));
  await target(1).waitFor();
  assert.deepEqual((await facts(page)).now.records[0].box, box.slice(0, 4));
  await seek(70);
  const second = /** @type {number[]} */ (near((await facts(page)).proposals, 70));
  await target(1).click();
  await menu();
  await page.getByLabel("Snap to the detector", { exact: true }).check();
  await drag([second[0] - 6, second[1] - 5, second[2] + 9, second[3] + 12].map(Math.round));
  await until(async () => (await facts(page)).backward?.end && (await facts(page)).now.frame === 70, "not corrected");
  assert.deepEqual((await facts(page)).now.records[0].box, second.slice(0, 4));
  await menu();
  await page.getByLabel("Snap to the detector", { exact: true }).uncheck();
  // By the keyboard.
  await region("Monitor").locator("canvas").first().focus();
  await page.keyboard.press("p");
  await page.getByText(/Box 1 of \d+ of the detector/).waitFor();
  await page.keyboard.press("Escape");
  await open();
  await page.getByText("Start: then the detector finds the target").waitFor();
  await button("Start").click();
  await says("the end is reached");
  const found = (await download("CSV")).split("\n").filter((/** @type {string} */ line) => line.includes(",tracking,")).map((/** @type {string} */ line) => line.split(",").map(Number));
  const right = found.filter((/** @type {number[]} */ cells) => overlap(cells.slice(4, 8), patch(cells[0])) > .5).length;
  console.log(`    found by the detector: tracked in ${found.length} frames, right in ${right}`);
  assert.ok(right > 60, `${right} of ${found.length}`);
  await shot("detected");
  // One that needs a file of the user's says where that is named, and stays chosen.
  await set("Detector", "objects");
  await page.getByText("“objects” needs a file with its network.").waitFor();
  assert.equal(await page.evaluate(() => document.activeElement?.id), "d-model");
  await page.keyboard.type("nowhere.onnx");
  await page.keyboard.press("Enter");
  await page.getByText("there is no such file or folder below the root").waitFor();
  await button("Step back").click();
  await until(async () => (await frame()) < FRAMES - 1, "no step back");
  assert.equal(await page.getByRole("combobox", { name: "Detector", exact: true }).inputValue(), "objects");
  complaints.length = 0; // the browser writes refused requests into its console
  await set("Detector", "");
  await until(async () => (await facts(page)).detector === null, "the detector is still there");
}
