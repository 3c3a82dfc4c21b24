// Nothing is lost: undo and redo, files out and in, a studio that is started again, the list of what is open.

import assert from "node:assert/strict";
import { existsSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { FRAMES } from "./clip.mjs";

/** @param {{ page: import("playwright-core").Page, patch: (k: number) => number[], [name: string]: any }} parts */
export async function keeping({ page, button, target, panel, drag, until, frame, says, status, shot, download, patch, folder, complaints, restart }) {
  const open = async () => {
    await page.waitForTimeout(1600);
    await page.getByLabel("Source", { exact: true }).fill("clip.y4m");
    await button("Open").click();
    await until(async () => (await frame()) === 0 && (await target(1).count()) === 0, "not opened");
  };
  const facts = () => page.evaluate(async () => {
    const { trial } = JSON.parse(sessionStorage.getItem("trial") ?? "null");
    return (await fetch(`/api/trials/${trial}`)).json();
  });
  const seek = async (/** @type {number} */ k) => {
    await page.getByLabel("Frame", { exact: true }).fill(String(k));
    await page.getByLabel("Frame", { exact: true }).press("Enter");
    await until(async () => (await frame()) === k, `not gone to frame ${k}`);
  };
  const rows = () => page.evaluate(async () => {
    const { trial } = JSON.parse(sessionStorage.getItem("trial") ?? "null");
    return (await (await fetch(`/api/trials/${trial}/rows`)).json()).rows.length;
  });
  await open();
  // Where the line was clicked before the start, frames are followed all the same.
  await seek(50);
  await page.locator("canvas").first().focus();
  await page.keyboard.press("Home");
  await until(async () => (await frame()) === 0, "not at the first frame");
  const [l, t, w, h] = patch(0);
  await drag([l - 20, t - 10, w, h]);
  await target(1).waitFor();
  await page.getByText("Press Start. Another box replaces this one").waitFor();
  // A second box is meant for the same target; with Shift held, or after Add target, it is one more.
  await drag(patch(0));
  await until(async () => (await facts()).now.records[0].box[0] === l, "the box was not replaced");
  assert.equal((await facts()).targets.length, 1);
  await page.keyboard.down("Shift");
  await drag([200, 20, 30, 30]);
  await page.keyboard.up("Shift");
  await target(2).waitFor();
  await button("Add target").click();
  await drag([250, 180, 30, 30]);
  await target(3).waitFor();
  // By the keyboard and by the button, and forward again.
  await page.locator("canvas").first().focus();
  await page.keyboard.press("Control+z");
  await target(3).waitFor({ state: "detached" });
  await button("Undo").click();
  await target(2).waitFor({ state: "detached" });
  await page.locator("canvas").first().focus();
  await page.keyboard.press("Control+Shift+z");
  await target(2).waitFor();
  await button("Undo").click();
  await target(2).waitFor({ state: "detached" });
  assert.deepEqual((await facts()).now.records[0].box, patch(0));
  await page.getByLabel("Pace", { exact: true }).selectOption("max");
  await button("Start").click();
  await says("the end is reached");
  assert.equal(await rows(), FRAMES);
  // The time line has all of them: something is drawn in its first fifth.
  const drawn = () => page.locator("#line").evaluate((line) => {
    const canvas = /** @type {HTMLCanvasElement} */ (line);
    const part = Math.round(canvas.width / 5), seen = new Set();
    const data = canvas.getContext("2d")?.getImageData(0, canvas.height / 2, part, canvas.height / 4).data ?? [];
    for (let i = 0; i < data.length; i += 4) seen.add(`${data[i]},${data[i + 1]},${data[i + 2]}`);
    return seen.size;
  });
  await until(async () => (await drawn()) > 4, "frames before the one that was looked at are missing in the time line");
  const whole = await download("CSV");

  // A correction is undone with all that it took away.
  await seek(60);
  await target(1).click();
  const [x, y, wide, high] = patch(60);
  await drag([x + 30, y + 20, wide, high]);
  await until(async () => (await facts()).backward?.end, "not put right");
  await until(async () => (await facts()).phase !== "running", "it goes on");
  assert.ok((await download("CSV")) !== whole);
  await button("Undo").click();
  await until(async () => (await facts()).head === FRAMES - 1, "what the correction took away does not come back");
  assert.equal(await download("CSV"), whole);
  await button("Redo").click();
  await until(async () => (await facts()).head === 60, "not corrected again");
  await button("Undo").click();
  await until(async () => (await facts()).head === FRAMES - 1, "not undone again");

  // A name and a colour.
  await panel("Targets");
  if ((await target(1).getAttribute("aria-pressed")) !== "true") await target(1).click();
  await page.getByLabel("Name", { exact: true }).fill("queen");
  await page.getByLabel("Name", { exact: true }).press("Enter");
  await page.getByRole("button", { name: "Target queen, tracking" }).waitFor();
  await shot("named");

  // Its folder holds it all; after the studio was started again it is there by itself, and opened from Runs.
  const { folder: own } = await facts();
  assert.match(own, /^pursuit-out\/clip(-\d+)?$/);
  assert.equal(readFileSync(join(folder, own, "trajectory.csv"), "utf8"), whole);
  await restart();
  await page.getByRole("button", { name: "Target queen, tracking" }).waitFor();
  await until(async () => (await facts()).folder === null && (await facts()).head === FRAMES - 1, "not as it was");
  complaints.length = 0;
  const shown = (/** @type {string} */ csv) => csv.trim().split("\n").map((line) => line.split(",").slice(0, 9).join());
  assert.deepEqual(shown(await download("CSV")), shown(whole));

  // What is exported is read back.
  const exported = /** @type {Record<string, string>} */ ({});
  for (const name of ["CSV", "MOT", "COCO", "CVAT"]) exported[name] = await download(name);
  await open();
  for (const [name, text] of Object.entries(exported)) {
    const path = join(folder, `read-${name}`);
    writeFileSync(path, text);
    await page.locator("#import-file").setInputFiles(path);
    await until(async () => (await facts()).head === FRAMES - 1 && (await facts()).undo === "a file read", `${name} was not read`);
    const again = (await download("CSV")).trim().split("\n").slice(1).map((line) => line.split(","));
    const before = whole.trim().split("\n").slice(1).map((line) => line.split(","));
    assert.equal(again.length, before.length, name);
    again.forEach((cells, i) => cells.slice(4, 8).forEach((cell, j) => assert.ok(Math.abs(Number(cell) - Number(before[i][4 + j])) < .002, `${name}: ${cells} and ${before[i]}`)));
    await button("Undo").click();
    await until(async () => (await facts()).head === 0 || (await facts()).targets.length === 0, `${name} was not undone`);
  }
  writeFileSync(join(folder, "read-nothing"), "hello");
  await page.locator("#import-file").setInputFiles(join(folder, "read-nothing"));
  await page.getByText("other forms that can be read").waitFor();
  complaints.length = 0;

  // The clip with what is known drawn in.
  await page.locator("#import-file").setInputFiles(join(folder, "read-CSV"));
  await until(async () => (await facts()).head === FRAMES - 1, "not read again");
  await panel("Targets");
  const [film] = await Promise.all([page.waitForEvent("download"), button("Video").click()]);
  assert.equal(readFileSync(/** @type {string} */ (await film.path())).subarray(4, 8).toString(), "ftyp");

  // Runs: what is open, and what is kept.
  await button("Runs").click();
  const dialog = page.getByRole("dialog", { name: "Runs" });
  await dialog.getByText("shown here").waitFor();
  await dialog.getByRole("button", { name: new RegExp(`^${own}`) }).click();
  await dialog.getByRole("table", { name: "The run" }).waitFor();
  await shot("runs");
  await dialog.getByRole("button", { name: "Open this run" }).click();
  await page.getByRole("button", { name: "Target queen, tracking" }).waitFor();
  await button("Runs").click();
  await dialog.getByRole("button", { name: "Close clip.y4m" }).click();
  await until(async () => (await status()).includes("No source is open"), "not closed");
  await button("Close the runs").click();
  assert.ok(existsSync(join(folder, own, "edits.json")));

  // Who is who: one target becomes two, two become one, and two that were mistaken are swapped.
  await open();
  await drag(patch(0));
  await target(1).waitFor();
  await page.keyboard.down("Shift");
  await drag([200, 20, 30, 30]);
  await page.keyboard.up("Shift");
  await target(2).waitFor();
  await seek(20);
  await panel("Targets");
  await target(1).click();
  await page.getByText("Who is who", { exact: true }).click();
  const boxes = async () => Object.fromEntries((await facts()).now.records.map((/** @type {any} */ r) => [r.target, r.box]));
  const before = await boxes();
  await button("Split here").click();
  await target(3).waitFor();
  assert.deepEqual(await boxes(), { 2: before[2], 3: before[1] });
  await button("Undo").click();
  await target(1).waitFor();
  await target(1).click();
  await page.getByLabel("The other target", { exact: true }).selectOption("2");
  await page.getByLabel("Swap from frame", { exact: true }).fill("10");
  await page.getByLabel("Swap to frame", { exact: true }).fill("20");
  await button("Swap").click();
  await until(async () => (await boxes())[1]?.[0] === before[2][0], "not swapped");
  assert.deepEqual(await boxes(), { 1: before[2], 2: before[1] });
  await shot("identity");
  await button("Undo").click();
  await until(async () => (await boxes())[1]?.[0] === before[1][0], "not swapped back");
  await button("Merge with it").click();
  await target(1).waitFor({ state: "detached" });
  assert.equal((await facts()).undo, "two targets merged");
  // As the checks that follow want it.
  await open();
  await drag(patch(0));
  await target(1).waitFor();
}
