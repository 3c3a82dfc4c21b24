// From a phone's clip to g, in the page alone: what the guide to measuring says, step by step.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { ballBox, MARKED, PHONE, seen, THROWN, thrown, writePhoneClip } from "./phone.mjs";

/** @param {{ page: import("playwright-core").Page, canvas: import("playwright-core").Locator, [name: string]: any }} parts */
export async function measuring({ page, button, region, set, panel, target, canvas, pursuit, folder, until, frame, says, shot, complaints }) {
  mkdirSync(join(folder, "phone"));
  writePhoneClip(join(folder, "phone", "throw.y4m"));
  const measure = region("Measuring"), plots = region("Plots");
  const problem = () => page.locator("#measure-problem").innerText();
  const api = async (/** @type {string} */ path) => page.evaluate(async (p) => {
    const { trials } = await (await fetch("/api/info")).json();
    return (await fetch(`/api/trials/${trials.at(-1)}/${p}`)).json();
  }, path);
  /** Where a point of the picture is on the screen. @param {number[]} point */
  const on = async ([x, y]) => {
    const place = /** @type {{ x: number, y: number, width: number, height: number }} */ (await canvas.boundingBox());
    return /** @type {[number, number]} */ ([place.x + x * place.width / PHONE.width, place.y + y * place.height / PHONE.height]);
  };
  const field = (/** @type {string} */ label) => measure.getByLabel(label, { exact: true });
  const file = async (/** @type {() => Promise<void>} */ click) => {
    const [made] = await Promise.all([page.waitForEvent("download"), click()]);
    return readFileSync(/** @type {string} */ (await made.path()));
  };
  const open = async () => {
    await page.waitForTimeout(1600);
    await page.getByLabel("Source", { exact: true }).fill("phone/throw.y4m");
    await button("Open").click();
    await page.waitForFunction(() => /^phone\/throw\.y4m .*frame 0 of/.test(document.getElementById("status")?.textContent ?? ""));
  };
  await set("Tracker", "kcf");
  await open();
  const [l, t, w, h] = ballBox(0);
  await page.mouse.move(...await on([l, t]));
  await page.mouse.down();
  await page.mouse.move(...await on([l + w, t + h]));
  await page.mouse.up();
  await target(1).waitFor();
  await page.getByLabel("Pace", { exact: true }).selectOption("max");
  await button("Start").click();
  await says("the end is reached");

  // A plane by four clicks, each a pixel or two off: the page puts them on the crossings.
  await button("Measure").click();
  await measure.waitFor();
  await button("Click a plane").click();
  for (const [i, place] of MARKED.entries()) {
    const [x, y] = seen(place);
    await page.mouse.move(...await on([x + 1.4, y - 1.1]));
    if (i === 0) {
      assert.ok(await page.locator("#lens").isVisible(), "no magnifier");
      await shot("measure-magnifier");
    }
    await page.mouse.down();
    await page.mouse.up();
    await field(`Point ${i + 1}, x in pixels`).waitFor();
    const put = [Number(await field(`Point ${i + 1}, x in pixels`).inputValue()), Number(await field(`Point ${i + 1}, y in pixels`).inputValue())];
    const off = Math.hypot(put[0] - x, put[1] - y);
    assert.ok(off < .25, `point ${i + 1} was put ${off} px from its crossing`);
    await field(`Point ${i + 1}, first place`).fill(String(place[0]));
    await field(`Point ${i + 1}, second place`).fill(String(place[1]));
    await field(`Point ${i + 1}, second place`).press("Enter");
  }
  await button("Click a plane").click();
  await field("True frames/s").fill(String(PHONE.fps));
  await field("True frames/s").press("Enter");
  await measure.getByText("Axes, lens, method, lines").click();
  await page.locator("#m-camera").setInputFiles(join(folder, "phone", "throw.yml"));
  await measure.getByText(`${PHONE.width} × ${PHONE.height}, focal 540`).waitFor();
  await measure.getByText("Axes, lens, method, lines").click();
  await field("Fit").selectOption("parabola");
  await measure.locator("[data-fit=acceleration]").waitFor();
  await until(async () => (await api("measurement")).fits?.length === 1, "not fitted");
  assert.equal(await problem(), "");
  const found = await api("measurement");
  const fitted = Object.fromEntries(found.fits[0].parameters.map((/** @type {any} */ p) => [p.name, p]));
  console.log(`    g = ${fitted.acceleration.value.toFixed(4)} ± ${fitted.acceleration.error.toFixed(4)} ${fitted.acceleration.unit}`);
  const within = (/** @type {any} */ { value, error }, /** @type {number} */ truth, /** @type {string} */ what) =>
    assert.ok(Math.abs(value - truth) < 3 * error && error < .02 * Math.abs(truth), `${what}: ${value} ± ${error}, and it is ${truth}`);
  within(fitted.acceleration, THROWN.g, "g");
  within({ value: -fitted.ay.value, error: fitted.ay.error }, THROWN.g, "g along y");
  // Frame by frame: where it truly is lies within two standard deviations, as a rule. The box that was drawn is not exactly in the
  // ball's middle, by the same in every frame; a pixel is 5 mm.
  const [own] = found.targets;
  const mean = (/** @type {number} */ axis) => own.frame.reduce((/** @type {number} */ sum, /** @type {number} */ k, /** @type {number} */ i) => sum + (axis ? own.y : own.x)[0][i] - thrown(k)[axis], 0) / own.frame.length;
  const offset = [mean(0), mean(1)];
  assert.ok(Math.hypot(...offset) < .006, `${offset} m off`);
  assert.deepEqual([found.unit, own.frame.length], ["m", PHONE.frames]);
  const inside = own.frame.filter((/** @type {number} */ k, /** @type {number} */ i) => {
    const [x, y] = thrown(k);
    return Math.abs(own.x[0][i] - x - offset[0]) < 2 * own.x[1][i] && Math.abs(own.y[0][i] - y - offset[1]) < 2 * own.y[1][i];
  }).length;
  const fast = own.frame.filter((/** @type {number} */ k, /** @type {number} */ i) => Math.abs(own.vx[0][i] - THROWN.vx) < 2 * own.vx[1][i]).length;
  console.log(`    ${offset.map((o) => (1e3 * o).toFixed(1)).join(", ")} mm off; within 2 σ: places in ${inside}, velocities in ${fast} of ${own.frame.length} frames`);
  assert.ok(inside >= .8 * own.frame.length && fast >= .8 * own.frame.length, `${inside} and ${fast}`);
  await shot("measured");

  // The cursor moves with the video, both ways.
  const plot = plots.locator("#plot");
  const size = /** @type {{ x: number, y: number, width: number, height: number }} */ (await plot.boundingBox());
  await page.mouse.click(size.x + 58 + (size.width - 68) * .5, size.y + size.height / 2);
  await until(async () => Math.abs((await frame()) - PHONE.frames / 2) < 4, "a click in the plot goes nowhere");
  const cursor = () => plot.locator("line[visibility=visible]").getAttribute("x1");
  const before = Number(await cursor());
  await page.getByLabel("Frame", { exact: true }).fill("20");
  await page.getByLabel("Frame", { exact: true }).press("Enter");
  await until(async () => Number(await cursor()) < before - 50, "the cursor stays");
  assert.match(await page.locator("#values").innerText(), /velocity y\s+\d+\.\d+ ± \d+\.\d+ m\/s/);
  for (const quantity of ["velocity", "acceleration", "path", "residuals"]) {
    await plots.getByLabel("Plot of", { exact: true }).selectOption(quantity);
    assert.ok((await plot.locator("polyline, circle").count()) > 1, quantity);
    await shot(`measure-${quantity}`);
  }
  await plots.getByLabel("Plot of", { exact: true }).selectOption("position");

  // Everything can be undone, with the keyboard too.
  await button("Undo").click();
  await until(async () => (await field("Fit").inputValue()) === "" && (await api("measurement")).fits.length === 0, "not undone");
  await button("Redo").click();
  await until(async () => (await field("Fit").inputValue()) === "parabola" && (await api("measurement")).fits.length === 1, "not done again");
  await button("Click the origin").focus();
  await page.keyboard.press("Enter");
  for (const key of ["ArrowRight", "ArrowDown", "Alt+ArrowDown", "Alt+Enter"]) await page.keyboard.press(key);
  await field("Origin, x in pixels").waitFor();
  assert.ok(Math.abs(Number(await field("Origin, y in pixels").inputValue()) - (PHONE.height / 2 + 1.1)) < .051, await field("Origin, y in pixels").inputValue());
  await canvas.focus();
  await page.keyboard.press("Control+z");
  await field("Origin, x in pixels").waitFor({ state: "detached" });
  // A mark is dragged, and put back.
  const corner = seen(MARKED[1]);
  const x = async () => Number(await field("Point 2, x in pixels").inputValue());
  const put = await x();
  await page.mouse.move(...await on(corner));
  await page.mouse.down();
  await page.mouse.move(...await on([corner[0] - 24, corner[1] - 30]));
  await page.mouse.up();
  await until(async () => Math.abs((await x()) - put + 24) < 4, "the mark was not dragged");
  await page.keyboard.press("Control+z");
  await until(async () => (await x()) === put, "the mark was not put back");

  // What makes no ruler is said, with what would.
  await field("Point 4, second place").fill("0");
  await field("Point 4, second place").press("Enter");
  await until(async () => /lie on a line/.test(await problem()), "points on a line are taken");
  assert.ok(await page.locator("#measured-files").isHidden(), "files of no measurement");
  await shot("measure-problem");
  await button("Undo").click();
  await until(async () => (await problem()) === "", "the problem stays");
  await field("Ruler").selectOption("target");
  await field("Length").fill("3 ell");
  await field("Length").press("Enter");
  await until(async () => /no unit `ell`/.test(await problem()), "a unit that there is not is taken");
  complaints.length = 0; // the browser writes refused requests into its console
  for (let i = 0; i < 2; i += 1) await button("Undo").click();
  await until(async () => (await field("Ruler").inputValue()) === "plane" && (await problem()) === "" && (await api("measurement")).fits?.length === 1, "not as before");

  // The calibration is kept beside the clip, and the command measures by it what the page does.
  const kept = join(folder, "phone", "calibration.toml");
  await button("Keep the calibration").click();
  await measure.getByText("Kept as phone/calibration.toml").waitFor();
  assert.equal((await file(() => measure.getByRole("link", { name: "Download it" }).click())).toString(), readFileSync(kept, "utf8"));
  const table = (await file(() => plots.getByRole("link", { name: "Table (CSV)" }).click())).toString();
  await panel("Targets");
  const trajectory = await file(() => page.getByRole("link", { name: "CSV", exact: true }).click());
  await button("Measure").click();
  const run = join(folder, "phone", "run");
  mkdirSync(run);
  writeFileSync(join(run, "trajectory.csv"), trajectory);
  execFileSync(pursuit, ["measure", run, "--calibration", kept, "--measure-fit", "parabola"], { stdio: "ignore" });
  // A trajectory as CSV has places to a thousandth of a pixel.
  const rows = (/** @type {string} */ text) => text.trim().split("\n").map((line) => line.split(","));
  const [ours, commands] = [rows(table), rows(readFileSync(join(run, "measure.csv"), "utf8"))];
  assert.deepEqual([ours[0], ours.length], [commands[0], commands.length]);
  ours.slice(1).forEach((row, i) => row.forEach((cell, j) => {
    const [a, b] = [Number(cell), Number(commands[i + 1][j])];
    assert.ok(cell === commands[i + 1][j] || Math.abs(a - b) < .002 + .001 * Math.abs(b), `${ours[0][j]} of frame ${row[0]}: ${cell} and ${commands[i + 1][j]}`);
  }));
  const svg = (await file(() => button("Plot (SVG)").click())).toString();
  assert.match(svg, /^<svg xmlns="http:\/\/www\.w3\.org\/2000\/svg"[^]*position \(m\)[^]*<\/svg>$/);
  assert.equal((await file(() => button("Picture (PNG)").click())).subarray(1, 4).toString(), "PNG");
  assert.equal((await file(() => plots.getByRole("link", { name: "Spreadsheet" }).click())).subarray(0, 2).toString(), "PK");
  await button("Keep the calibration").click();
  await measure.getByText("there is a calibration already").waitFor();
  complaints.length = 0;
  await button("Replace it").click();
  await measure.getByText("Kept as phone/calibration.toml").waitFor();

  // The picture is enlarged where the pointer is.
  const wide = async () => (await canvas.boundingBox())?.width ?? 0;
  const small = await wide();
  const larger = async (/** @type {number} */ steps) => {
    const before = await wide();
    for (let i = 0; i < steps; i += 1) await page.mouse.wheel(0, -100);
    await until(async () => (await wide()) > 1.24 ** steps * before, "not enlarged");
  };
  await page.mouse.move(...await on(corner));
  await larger(4);
  // As long as the picture fits, it stays in the middle.
  const point = await on(corner);
  await page.mouse.move(...point);
  await larger(3);
  const there = await on(corner);
  assert.ok(Math.hypot(there[0] - point[0], there[1] - point[1]) < 3, `${point} has become ${there}`);
  await shot("measure-enlarged");
  await button("Fit").click();
  await until(async () => Math.abs((await wide()) - small) < 2, "not made small again");

  // Opened again, the clip has its ruler.
  await open();
  await measure.getByText("Read from phone/calibration.toml").waitFor();
  assert.equal(await field("Point 3, second place").inputValue(), String(MARKED[2][1]));
  assert.ok(existsSync(kept));
  await button("Measure").click();
  await measure.waitFor({ state: "hidden" });
}
