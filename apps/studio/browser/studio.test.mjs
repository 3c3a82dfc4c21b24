// The studio in a real browser, as a user has it: through roles and accessible names, the mouse and the keyboard.
//   node studio.test.mjs PURSUIT CHROMIUM SCREENSHOTS

import { chromium } from "playwright-core";
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { browsing } from "./browsing.mjs";
import { detecting } from "./detecting.mjs";
import { keeping } from "./keeping.mjs";
import { layout } from "./layout.mjs";
import { listen, lookAt, watched } from "./live.mjs";
import { looking } from "./looking.mjs";
import { measuring } from "./measuring.mjs";
import { points } from "./points.mjs";
import { FRAMES, HEIGHT, LONG, WIDTH, patch, returning, writeClip, writeClipWithLoss } from "./clip.mjs";

const [pursuit, browserPath, shots] = process.argv.slice(2);
const folder = mkdtempSync(join(tmpdir(), "pursuit-browser-"));
mkdirSync(shots, { recursive: true });
writeClip(join(folder, "clip.y4m"));
writeClipWithLoss(join(folder, "loss.y4m"));

/** Starts a studio and waits for its address. @param {number} port */
async function studio(port) {
  const child = spawn(pursuit, ["studio", "--no-open", "--port", String(port), "--root", folder], { stdio: ["ignore", "pipe", "inherit"] });
  const url = await new Promise((done, failed) => {
    child.stdout.once("data", (data) => done(String(data).trim()));
    child.once("exit", (code) => failed(new Error(`pursuit studio ended with ${code}`)));
  });
  return { child, url: /** @type {string} */ (url) };
}

/** @param {import("node:child_process").ChildProcess} child */
const ended = (child) => new Promise((done) => { child.once("exit", done); child.kill("SIGINT"); });

let { child, url } = await studio(0);
const port = Number(new URL(url).port);
const browser = await chromium.launch({ executablePath: browserPath, args: ["--no-sandbox"] });
const page = await browser.newPage({ viewport: { width: 1280, height: 720 }, colorScheme: "light" });
const kinds = listen(page);
/** @type {string[]} */
const complaints = [];
page.on("pageerror", (error) => complaints.push(String(error)));
page.on("console", (message) => { if (message.type() === "error") complaints.push(message.text()); });

const button = (/** @type {string} */ name) => page.getByRole("button", { name, exact: true });
const region = (/** @type {string} */ name) => page.getByRole("region", { name, exact: true });
/** The chip of a target. @param {number} n */
const target = (n) => page.getByRole("button", { name: new RegExp(`^Target ${n}, `) });
/** Opens a panel beside the picture. @param {string} name */
async function panel(name) {
  if (await button(name).getAttribute("aria-pressed") !== "true") await button(name).click();
}
/** Chooses in the panel of settings. @param {string} label @param {string} value */
async function set(label, value) {
  await panel("Settings");
  await region("Settings").getByLabel(label, { exact: true }).selectOption(value);
}
/** Opens the menu of what is shown. */
async function menu() {
  if (!(await page.locator("#layers").isVisible())) await page.locator("#view summary").click();
}
const status = () => page.getByRole("status").innerText();
const canvas = region("Monitor").locator("canvas").first();
const frame = async () => Number(/frame (\d+)/.exec(await status())?.[1]);

/** @param {() => Promise<boolean>} holds @param {string} what */
async function until(holds, what) {
  const begun = Date.now();
  while (!(await holds())) {
    assert.ok(Date.now() - begun < 60_000, `${what}; the status is: ${await status()}`);
    await page.waitForTimeout(30);
  }
}
const says = (/** @type {string} */ word) => until(async () => (await status()).includes(word), `never ${word}`);

/** Where points of the picture are on the screen. */
async function at() {
  const place = /** @type {{ x: number, y: number, width: number, height: number }} */ (await canvas.boundingBox());
  const [columns, rows] = await canvas.evaluate((c) => [/** @type {HTMLCanvasElement} */ (c).width, /** @type {HTMLCanvasElement} */ (c).height]);
  assert.deepEqual([columns, rows], [WIDTH, HEIGHT]);
  return (/** @type {number} */ x, /** @type {number} */ y) => /** @type {[number, number]} */ ([place.x + x * place.width / columns, place.y + y * place.height / rows]);
}

/** Drags a box given in pixels of the picture. @param {number[]} box */
async function drag([l, t, w, h]) {
  const place = await at();
  await page.mouse.move(...place(l, t));
  await page.mouse.down();
  await page.mouse.move(...place(l + w / 2, t + h / 2));
  await page.mouse.move(...place(l + w, t + h));
  await page.mouse.up();
}

/** @param {string} name @param {import("playwright-core").Page} [of] */
async function shot(name, of = page) {
  for (const scheme of /** @type {const} */ (["light", "dark"])) {
    await of.emulateMedia({ colorScheme: scheme });
    await of.waitForTimeout(120);
    await of.screenshot({ path: join(shots, `${name}-${scheme}.png`) });
  }
  await of.emulateMedia({ colorScheme: "light" });
}

/** @param {string} name */
async function download(name) {
  await panel("Targets");
  const [file] = await Promise.all([page.waitForEvent("download"), page.getByRole("link", { name, exact: true }).click()]);
  return readFileSync(/** @type {string} */ (await file.path()), "utf8");
}

const checks = {
  async "an empty studio says what to do"() {
    await page.goto(url);
    await says("No source is open");
    assert.ok(await page.getByText("No source is open. Name a clip").isVisible());
    for (const name of ["Control", "Monitor", "Timeline"]) assert.ok(await region(name).isVisible(), name);
    for (const name of ["Targets", "Settings", "Measuring"]) assert.equal(await region(name).count(), 0, `${name} is not folded away`);
    await shot("empty");
  },
  async "a source that is not there is said, not swallowed"() {
    await page.getByLabel("Source", { exact: true }).fill("nowhere.mp4");
    await page.getByLabel("Source", { exact: true }).press("Enter");
    await page.getByText("there is no such file or folder below the root").waitFor();
    await shot("error");
    complaints.length = 0; // the browser writes refused requests into its console
  },
  async "a clip is opened and its first frame shown"() {
    await page.getByLabel("Source", { exact: true }).fill("clip.y4m");
    await set("Tracker", "kcf");
    const begun = Date.now();
    await button("Open").click();
    await until(async () => (await frame()) === 0, "no first frame");
    await until(async () => canvas.evaluate((c) => /** @type {any} */ (c).getContext("2d").getImageData(60, 100, 1, 1).data[0] > 0), "no picture");
    console.log(`    first frame after ${Date.now() - begun} ms`);
  },
  async "a box is dragged in picture coordinates and followed"() {
    await drag(patch(0));
    await target(1).waitFor();
    assert.equal(await target(1).getAttribute("aria-label"), "Target 1, tracking");
    // Slowly, so that a machine that has much else to do looks at it while it runs.
    await page.getByLabel("Pace", { exact: true }).selectOption("0.25");
    await button("Start").click();
    await until(async () => (await frame()) > 12, "it does not run");
    // The video is decoded, and boxes and picture are of the same frame.
    for (let i = 0; i < 5; i += 1) {
      const seen = await lookAt(page, patch);
      assert.ok(seen.inside > 110 && seen.inside > seen.outside + 40, `not the picture of frame ${seen.frame}: ${JSON.stringify(seen)}`);
      await page.waitForTimeout(60);
    }
    assert.ok((kinds.h264 ?? 0) > 8, `no video: ${JSON.stringify(kinds)}`);
    await shot("running");
    await button("Pause").click();
    await says("paused");
    // What is used all the time is on the screen, and the time line is painted in colours that can be told apart.
    for (const name of ["Start", "Stop", "Step", "Step back", "Undo"]) {
      const place = await button(name).boundingBox();
      assert.ok(place && place.y + place.height <= 720, `${name} is not on the screen`);
    }
    const colors = await region("Timeline").locator("canvas").evaluate((c) => {
      const line = /** @type {HTMLCanvasElement} */ (c);
      const data = line.getContext("2d")?.getImageData(0, 0, line.width, line.height).data ?? [];
      const seen = new Set();
      for (let i = 0; i < data.length; i += 4) seen.add(`${data[i]},${data[i + 1]},${data[i + 2]}`);
      return seen.size;
    });
    assert.ok(colors > 4, `${colors} colours in the time line`);
    await page.getByLabel("Pace", { exact: true }).selectOption("1");
  },
  async "steps go forward and back"() {
    const before = await frame();
    await button("Step").click();
    await until(async () => (await frame()) === before + 1, "no step");
    await button("Step back").click();
    await button("Step back").click();
    await until(async () => (await frame()) === before - 1, "no step back");
    await canvas.focus();
    await page.keyboard.press("ArrowRight");
    await until(async () => (await frame()) === before, "no step by the keyboard");
    await shot("paused");
  },
  async "the connection is lost and comes back"() {
    const was = await frame();
    await ended(child);
    await page.getByText("connection lost, trying again").waitFor();
    await shot("disconnected");
    ({ child, url } = await studio(port));
    // What was followed is there again by itself, in the frame that was looked at.
    await until(async () => (await page.locator("#connection").innerText()) === "live" && (await frame()) === was, "what was followed is not there again");
    await target(1).waitFor();
    complaints.length = 0;
    await button("Open").click();
    await until(async () => (await frame()) === 0, "not opened again");
    await page.getByText("live", { exact: true }).waitFor();
  },
  async "a parameter is changed, a run goes to its end, and its trajectory is that of the command line"() {
    await set("Motion model", "imm");
    await page.getByLabel("Pace", { exact: true }).selectOption("max");
    await drag(patch(0));
    await target(1).waitFor();
    await button("Start").click();
    await says("the end is reached");
    assert.equal(await frame(), FRAMES - 1);
    const csv = await download("CSV");
    // The box as the page drew it: what was sent is in the first line.
    const box = csv.split("\n")[1].split(",").slice(4, 8);
    assert.deepEqual(box.map(Number), patch(0));
    const out = join(folder, "by-command-line");
    execFileSync(pursuit, ["track", join(folder, "clip.y4m"), "--tracker", "kcf", "--set", "motion.model=imm", "--box", box.join(","), "--no-video", "--out", out], { stdio: "ignore" });
    const own = (/** @type {string} */ text) => text.trim().split("\n").map((line) => line.split(",").toSpliced(17, 1).join(","));
    assert.deepEqual(own(csv), own(readFileSync(join(out, "trajectory.csv"), "utf8")));
    const table = await download("Download table");
    assert.equal(table.trim().split("\n").length, FRAMES + 1);
    assert.match(table, /actual_x +actual_y +pred_x +pred_y/);
    await shot("ended");
  },
  async "a box is put right in a frame, and followed from there"() {
    await page.getByLabel("Frame", { exact: true }).fill("60");
    await page.getByLabel("Frame", { exact: true }).press("Enter");
    await until(async () => (await frame()) === 60, "not gone to frame 60");
    await target(1).click();
    const [l, t, w, h] = patch(60);
    await drag([l + 2, t + 1, w, h]);
    await until(async () => (await page.getByLabel("Version", { exact: true }).locator("option").count()) === 2, "no version kept");
    await until(async () => (await status()).includes("paused"), "not paused");
    await shot("corrected");
    await button("Start").click();
    await says("the end is reached");
    const csv = await download("CSV");
    assert.equal(csv.trim().split("\n").length, FRAMES + 1);
    const x = Number(csv.split("\n")[61].split(",")[4]);
    assert.ok(Math.abs(x - l - 2) < 1, `${x} at frame 60`);
  },
  async "what was done is undone and done again, kept, and found again"() {
    await keeping({ page, button, target, panel, drag, until, frame, says, status, shot, download, patch, folder, complaints,
      restart: async () => { await ended(child); ({ child, url } = await studio(port)); } });
  },
  async "two trackers are compared in the same frame"() {
    await page.getByLabel("Frame", { exact: true }).fill("0");
    await page.getByLabel("Frame", { exact: true }).press("Enter");
    await until(async () => (await frame()) === 0, "not gone to the first frame");
    await set("Compare with", "mosse");
    await region("Comparison").getByText(/Target 1: centres/).waitFor();
    for (let i = 0; i < 4; i += 1) await button("Step").click();
    const compared = async () => /** @type {RegExpExecArray} */ (/^Frame (\d+)\. Target 1/.exec(await region("Comparison").getByText(/^Frame/).innerText()));
    await until(async () => (await compared())?.[1] === "4", "not in step");
    await shot("compared");
    // However different they are in speed, what is shown is of the same frame.
    await page.getByLabel("Pace", { exact: true }).selectOption("max");
    await button("Start").click();
    for (let i = 0; i < 12; i += 1) {
      const [own, other] = await page.evaluate(() => ["status", "comparison"].map((id) => Number(/frame (\d+)/i.exec(document.getElementById(id)?.textContent ?? "")?.[1])));
      assert.equal(own, other, "two moments are shown beside each other");
      await page.waitForTimeout(40);
    }
    await says("the end is reached");
    await until(async () => (await compared())?.[1] === String(FRAMES - 1), "the other is not at the end");
    await set("Compare with", "");
    await region("Comparison").waitFor({ state: "hidden" });
  },
  async "a clip with one loss is annotated with two boxes"() {
    await set("Tracker", "mosse");
    await page.getByLabel("Source", { exact: true }).fill("loss.y4m");
    await button("Open").click();
    await until(async () => (await status()).includes(`of ${LONG}`) && (await frame()) === 0, "not opened");
    await drag(returning(0));
    await target(1).waitFor();
    await button("Start").click();
    await says("the end is reached");
    const right = (/** @type {string} */ csv) => csv.trim().split("\n").slice(1).filter((line) => {
      const cells = line.split(",");
      const [l, t] = returning(Number(cells[0]));
      return Math.abs(Number(cells[4]) - l) < 10 && Math.abs(Number(cells[5]) - t) < 10;
    }).length;
    const before = right(await download("CSV"));
    const bad = 230;
    await page.getByLabel("Frame", { exact: true }).fill(String(bad));
    await page.getByLabel("Frame", { exact: true }).press("Enter");
    await until(async () => (await frame()) === bad, "not gone to the bad frame");
    await shot("before-repair");
    await target(1).click();
    await menu();
    assert.ok(await page.getByLabel("Correct backward too", { exact: true }).isChecked());
    await drag(returning(bad));
    await page.getByText(/Target 1 was followed backward from frame 230 to 1[4-6]\d/).waitFor();
    assert.equal(await frame(), bad);
    await button("Start").click();
    await says("the end is reached");
    const after = right(await download("CSV"));
    console.log(`    frames that are right: ${before} with one box, ${after} with two, of ${LONG}`);
    assert.ok(before < LONG - 60 && after > LONG - 30, `${before} before, ${after} after`);
    await shot("repaired");
    await set("Tracker", "kcf");
    await page.getByLabel("Source", { exact: true }).fill("clip.y4m");
    await button("Open").click();
    await until(async () => (await status()).includes(`of ${FRAMES}`) && (await frame()) === 0, "not opened again");
    await drag(patch(0));
    await target(1).waitFor();
  },
  async "a detector shows boxes, one is taken by a click, and without a box it finds the target"() {
    await detecting({ page, button, region, set, menu, panel, target, drag, at, until, frame, says, shot, download, patch, complaints });
  },
  async "points are clicked and followed together"() {
    await points({ page, button, set, panel, target, at, until, frame, says, shot, download, patch });
  },
  async "depth and what moves are looked at in place of the picture"() {
    await looking({ page, button, menu, canvas, until, frame, shot, patch });
  },
  async "a phone's clip is measured in metres, in the page alone"() {
    await measuring({ page, button, region, set, panel, target, canvas, pursuit, folder, until, frame, says, shot, complaints });
  },
  async "evaluations and reproductions are browsed, and worst frames opened"() {
    await browsing({ page, button, set, panel, pursuit, folder, until, frame, status, shot });
    await page.waitForTimeout(1600);
    await page.getByLabel("Source", { exact: true }).fill("clip.y4m");
    await button("Open").click();
    await until(async () => (await status()).includes(`of ${FRAMES}`) && (await frame()) === 0, "not opened again");
    await drag(patch(0));
    await target(1).waitFor();
  },
  async "a run is stopped"() {
    await button("Start").click();
    await button("Stop").click();
    await says("stopped");
  },
  async "the page complains of nothing"() {
    assert.deepEqual(complaints, []);
  },
  async "the picture is the page, on every screen"() {
    await layout({ browser, url, shot, patch });
  },
  async "a browser that decodes no video is shown JPEG"() {
    const plain = await browser.newPage({ viewport: { width: 1280, height: 720 } });
    await plain.addInitScript(() => { Reflect.deleteProperty(globalThis, "VideoDecoder"); });
    const own = listen(plain);
    await plain.goto(url);
    await plain.getByLabel("Source", { exact: true }).fill("clip.y4m");
    await plain.getByRole("button", { name: "Open", exact: true }).click();
    await plain.waitForFunction(() => /frame 0/.test(document.getElementById("status")?.textContent ?? ""));
    await plain.evaluate(async ([l, t, w, h]) => {
      const { trials } = await (await fetch("/api/info")).json();
      const send = (/** @type {string} */ path, /** @type {any} */ body) => fetch(`/api/trials/${trials.at(-1)}/${path}`, { method: "POST", body: JSON.stringify(body), headers: { "content-type": "application/json" } });
      await send("targets", { box: [l, t, w, h] });
      await send("orders", { order: "start" });
    }, patch(0));
    await plain.waitForFunction(() => Number(/frame (\d+)/.exec(document.getElementById("status")?.textContent ?? "")?.[1]) > 8);
    const seen = await lookAt(plain, patch);
    assert.ok(seen.inside > 110 && seen.inside > seen.outside + 40, JSON.stringify(seen));
    assert.ok(own.jpeg > 5 && !own.h264, JSON.stringify(own));
    await plain.close();
  },
  async "a run of the command line is watched and not touched"() {
    await watched({ browser, pursuit, folder, shot });
  },
};

let failed = 0;
for (const [name, check] of Object.entries(checks)) {
  try {
    await check();
    console.log(`ok: ${name}`);
  } catch (error) {
    failed += 1;
    console.log(`FAILED: ${name}\n${error instanceof Error ? error.stack : error}`);
    await page.screenshot({ path: join(shots, "failed.png") }).catch(() => {});
    break;
  }
}
await browser.close();
await ended(child);
rmSync(folder, { recursive: true });
process.exit(failed ? 1 : 0);
