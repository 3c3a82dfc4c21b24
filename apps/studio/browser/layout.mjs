// What the page looks like on a desk, a tablet and a phone: the picture first, everything else on demand, nothing that jumps.

import assert from "node:assert/strict";

const SCREENS = /** @type {const} */ ([["desk", 1280, 800], ["tablet", 1024, 768], ["phone", 390, 844]]);

/** @param {{ browser: import("playwright-core").Browser, url: string, patch: (k: number) => number[], shot: (name: string, page: import("playwright-core").Page) => Promise<void> }} parts */
export async function layout({ browser, url, shot, patch }) {
  for (const [name, width, height] of SCREENS) {
    const touch = name !== "desk";
    const context = await browser.newContext({ viewport: { width, height }, hasTouch: touch, isMobile: name === "phone" });
    const page = await context.newPage();
    const button = (/** @type {string} */ name) => page.getByRole("button", { name, exact: true });
    await page.goto(url);
    await button("Settings").click();
    await page.getByLabel("Tracker", { exact: true }).selectOption("kcf");
    await button("Settings").click();
    await page.evaluate(() => scrollTo(0, 0));
    await page.getByLabel("Source", { exact: true }).fill("clip.y4m");
    await button("Open").click();
    await page.waitForFunction(() => /frame 0/.test(document.getElementById("status")?.textContent ?? ""));
    const place = async (/** @type {string} */ id) => /** @type {{ x: number, y: number, width: number, height: number }} */ (await page.locator(id).boundingBox());
    const stage = await place("#stage");
    const share = stage.width * stage.height / width / height;
    const picture = await place("#picture");
    console.log(`    ${name}, ${width} × ${height}: the stage has ${(100 * share).toFixed(0)} % of the screen, a picture of 4:3 on it ${(100 * picture.width * picture.height / width / height).toFixed(0)} %`);
    assert.ok(share >= (name === "phone" ? .5 : .6), `the stage has ${share} of the screen`);
    const overflow = () => page.evaluate(() => [document.documentElement.scrollWidth, document.documentElement.scrollHeight]);
    assert.ok((await overflow())[0] <= width, `the page is ${await overflow()} wide and high`);
    if (name !== "phone") assert.ok((await overflow())[1] <= height, `the page is ${await overflow()} wide and high`);
    assert.ok(stage.y < 130, `the picture begins at ${stage.y}`);

    // A box is drawn with the mouse or with a finger, and followed; nothing changes its place or size.
    const columns = await page.locator("#picture").evaluate((canvas) => /** @type {HTMLCanvasElement} */ (canvas).width);
    const on = (/** @type {number} */ x, /** @type {number} */ y) => ({ x: picture.x + x * picture.width / columns, y: picture.y + y * picture.width / columns });
    const [l, t, w, h] = patch(0);
    const [from, to] = [on(l, t), on(l + w, t + h)];
    if (touch) {
      const session = await context.newCDPSession(page);
      const finger = (/** @type {"touchStart"|"touchMove"|"touchEnd"} */ type, /** @type {{ x: number, y: number }[]} */ touchPoints) => session.send("Input.dispatchTouchEvent", { type, touchPoints });
      await finger("touchStart", [from]);
      await finger("touchMove", [to]);
      await finger("touchEnd", []);
    } else {
      await page.mouse.move(from.x, from.y);
      await page.mouse.down();
      await page.mouse.move(to.x, to.y);
      await page.mouse.up();
    }
    await page.getByRole("button", { name: "Target 1, tracking" }).waitFor();
    await page.getByLabel("Pace", { exact: true }).selectOption("max");
    await page.evaluate(() => {
      const sizes = /** @type {Set<string>} */ (/** @type {any} */ (globalThis).sizes = new Set());
      const look = () => {
        const boxes = ["picture", "line", "stage"].map((id) => document.getElementById(id)?.getBoundingClientRect());
        sizes.add(boxes.map((b) => (b ? [b.width, b.height, b.top + scrollY].map(Math.round).join() : "")).join(" "));
        requestAnimationFrame(look);
      };
      look();
    });
    await button("Start").click();
    await page.waitForFunction(() => /the end is reached/.test(document.getElementById("status")?.textContent ?? ""));
    const sizes = await page.evaluate(() => [.../** @type {any} */ (globalThis).sizes]);
    assert.equal(sizes.length, 1, `picture and time line have changed: ${sizes}`);
    await page.evaluate(() => scrollTo(0, 0));
    await shot(`screen-${name}`, page);

    if (touch) {
      // Two fingers enlarge the picture and draw nothing.
      const session = await context.newCDPSession(page);
      const fingers = (/** @type {"touchStart"|"touchMove"|"touchEnd"} */ type, /** @type {number[]} */ apart) =>
        session.send("Input.dispatchTouchEvent", { type, touchPoints: apart.map((dx, id) => ({ ...on(100 + dx, 100), id })) });
      await fingers("touchStart", [-20, 20]);
      await fingers("touchMove", [-60, 60]);
      await fingers("touchEnd", []);
      assert.ok((await place("#picture")).width > 2 * picture.width, "two fingers do not enlarge");
      assert.equal(await page.getByRole("button", { name: /^Target \d, / }).count(), 1);
      await button("Fit").click();
    } else {
      // With Ctrl held the picture is moved, to single pixels.
      await page.mouse.move(from.x, from.y);
      for (let i = 0; i < 8; i += 1) await page.mouse.wheel(0, -200);
      await page.waitForFunction((least) => (document.getElementById("picture")?.getBoundingClientRect().width ?? 0) > least, 8 * picture.width);
      const before = await place("#picture");
      await page.keyboard.down("Control");
      await page.mouse.down();
      await page.mouse.move(from.x - 60, from.y - 40);
      await page.mouse.up();
      await page.keyboard.up("Control");
      const after = await place("#picture");
      assert.ok(Math.abs(before.x - after.x - 60) < 2 && Math.abs(before.y - after.y - 40) < 2, `${JSON.stringify(before)} ${JSON.stringify(after)}`);
      await shot("enlarged", page);
      await button("Fit").click();
      // The whole screen by a key.
      await page.locator("#picture").focus();
      await page.keyboard.press("f");
      await page.waitForFunction(() => document.body.classList.contains("full"));
      await page.evaluate(() => document.exitFullscreen());
      await page.waitForFunction(() => !document.body.classList.contains("full"));
    }
    // What is folded away comes when it is asked for.
    for (const panel of ["Targets", "Settings", "Measure"]) {
      await button(panel).click();
      if (name !== "tablet") await shot(`${panel.toLowerCase()}-${name}`, page);
      assert.ok((await overflow())[0] <= width, `with ${panel} the page is ${await overflow()} wide and high`);
    }
    await button("Measure").click();
    await button("Runs").click();
    await page.getByRole("dialog", { name: "Runs" }).getByText("shown here").waitFor();
    await shot(`runs-${name}`, page);
    await button("Close the runs").click();
    await context.close();
  }
}
