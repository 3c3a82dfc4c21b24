// Folders of `pursuit track`, `eval` and `reproduce` in the page.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { LONG, returning, writeClipWithLoss } from "./clip.mjs";

/** @param {{ page: import("playwright-core").Page, pursuit: string, folder: string, [name: string]: any }} parts */
export async function browsing({ page, button, set, panel, pursuit, folder, until, frame, status, shot }) {
  const data = join(folder, "data");
  mkdirSync(data);
  writeClipWithLoss(join(data, "returning.y4m"));
  const truth = Array.from({ length: LONG }, (_, k) => `${k},${returning(k).join(",")}`);
  writeFileSync(join(data, "returning.csv"), `index,x,y,w,h\n${truth.join("\n")}\n`);
  execFileSync(pursuit, ["eval", data, "--trackers", "mosse,kcf", "--out", join(folder, "out", "evaluated")], { stdio: "ignore" });
  execFileSync(pursuit, ["track", join(data, "returning.y4m"), "--tracker", "kcf", "--no-video", "--out", join(folder, "out", "tracked")], { stdio: "ignore" });
  execFileSync(pursuit, ["reproduce", "qu2010", "--seeds", "2", "--out", join(folder, "out", "reproduced")], { stdio: "ignore" });
  await button("Runs").click();
  const dialog = page.getByRole("dialog", { name: "Runs" });
  await dialog.getByRole("button", { name: /reproduced/ }).click();
  await dialog.getByRole("table", { name: "Figures" }).waitFor();
  assert.ok(await dialog.getByRole("row").count() > 10);
  const pictures = dialog.getByRole("img");
  assert.ok(await pictures.count() > 0);
  await pictures.first().scrollIntoViewIfNeeded();
  await until(async () => pictures.first().evaluate((image) => /** @type {HTMLImageElement} */ (image).naturalWidth > 100), "its picture is not shown");
  await shot("reproduction");
  await dialog.getByRole("button", { name: /evaluated/ }).click();
  await dialog.getByRole("table", { name: "mosse on every sequence" }).waitFor();
  await dialog.getByRole("button", { name: "Worst frames of mosse on returning" }).click();
  const worst = dialog.getByRole("button", { name: /^Frame \d+, overlap/ });
  await worst.first().waitFor();
  await shot("evaluation");
  const wanted = Number(/Frame (\d+)/.exec(await worst.first().getAttribute("aria-label") ?? "")?.[1]);
  assert.ok(wanted >= 140, `frame ${wanted} is the worst`);
  await worst.first().click();
  await until(async () => (await frame()) === wanted && (await status()).includes("returning.y4m"), "the worst frame is not shown");
  assert.equal(await page.locator("#tracker").inputValue(), "mosse");
  await shot("worst-frame");
  // A run of a tracker is opened with what it said, and gone on with after a correction.
  await button("Runs").click();
  await dialog.getByRole("button", { name: /tracked/ }).click();
  await dialog.getByRole("table", { name: "The run" }).waitFor();
  await shot("run");
  await dialog.getByRole("button", { name: "Open this run" }).click();
  await until(async () => (await status()).includes("paused") && (await frame()) === 0, "the run is not opened");
  const told = readFileSync(join(folder, "out", "tracked", "trajectory.csv"), "utf8");
  await panel("Targets");
  const link = await page.getByRole("link", { name: "CSV" }).getAttribute("href");
  const shown = await page.evaluate(async (address) => (await fetch(address)).text(), String(link));
  assert.equal(shown, told, "what is shown is not what was recorded");
  assert.equal(await page.locator("#tracker").inputValue(), "kcf");
  await page.getByLabel("Frame", { exact: true }).fill("60");
  await page.getByLabel("Frame", { exact: true }).press("Enter");
  await until(async () => (await frame()) === 60, "a recorded frame is not shown");
  await shot("recorded");
}
