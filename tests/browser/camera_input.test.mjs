// Camera controls in a real browser: axis gizmo, roll, touch and wheel.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  assertDrawn,
  finalPicture,
  framesOf,
  pictureBox,
  pixels,
  sharedDaemon,
  shot,
  state,
  watchFrames,
  watchPatches,
} from "./support.mjs";

const { withPage } = sharedDaemon({
  page: { viewport: { width: 1000, height: 600 }, initScript: [watchPatches, watchFrames] },
});
const phone = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true };

const patches = (page) => page.evaluate(() => window.patches);
const cameras = async (page) =>
  (await patches(page)).map(({ patch }) => patch.camera).filter((camera) => camera?.eye);
const hashOf = async (page) => {
  await finalPicture(page);
  return (await pixels(page)).hash;
};
const until = (page, key, value) =>
  page.waitForFunction(
    ([k, v]) => document.querySelector("#picture").dataset[k] === v,
    [key, value],
  );
const settled = (page) =>
  page.waitForFunction(
    () => {
      const { elevation, azimuth, roll } = document.querySelector("#picture").dataset;
      const now = `${elevation} ${azimuth} ${roll}`;
      const stands = window.lastSeen === now;
      window.lastSeen = now;
      return stands;
    },
    null,
    { polling: 400 },
  );

// --- axes and roll ---------------------------------------------------------------------------

test("each axis end sets its view direction, animated or at once", async () => {
  const ways = [
    ["View from the east", "90.0", "0.0"],
    ["View from the north", "180.0", "0.0"],
    ["View from above", "0.0", "90.0"],
    ["Isometric view", "45.0", "35.3"],
    ["View from the west", "-90.0", "0.0"],
    ["View from below", "0.0", "-90.0"],
    ["View from the south", "0.0", "0.0"],
  ];
  await withPage(async (page) => {
    for (const [name, azimuth, elevation] of ways) {
      const frames = await framesOf(page, async () => {
        await page.evaluate(() => (window.patches.length = 0));
        await page.getByRole("button", { name }).click();
        await until(page, "elevation", elevation);
        await until(page, "azimuth", azimuth);
      });
      assert.ok(frames.length >= 2);
      assert.ok((await patches(page)).length >= 3, `${name}: a turn, not a jump`);
    }
    await page.keyboard.press("Control+z");
    await until(page, "elevation", "-90.0");
    for (const end of await page.locator(".gizmo-end").all()) {
      const { width, height } = await end.boundingBox();
      assert.ok(Math.min(width, height) >= 24);
    }
    await page.getByRole("button", { name: "View from the east" }).press("Enter");
    await until(page, "azimuth", "90.0");
    await page.keyboard.press("7");
    await until(page, "azimuth", "45.0");
    await shot(page, "gizmo");
  });
  await withPage(
    async (page) => {
      await page.getByRole("button", { name: "View from the east" }).press("Enter");
      await until(page, "azimuth", "90.0");
      await finalPicture(page);
      assert.equal((await cameras(page)).length, 1, "with reduced motion one patch is sent");
    },
    { reducedMotion: "reduce" },
  );
});

test("touching the picture ends a camera animation", () =>
  withPage(async (page) => {
    await page.locator("#picture").focus();
    await page.keyboard.press("2");
    await page.keyboard.press("ArrowLeft");
    await finalPicture(page);
    await settled(page);
    const sent = await cameras(page);
    const { azimuth } = await state(page);
    assert.notEqual(azimuth, "180.0");
    assert.ok(sent.length < 30);
  }));

test("keys roll the picture, orbiting keeps the roll, and 0 resets it", () =>
  withPage(async (page) => {
    const start = await state(page);
    const first = await hashOf(page);
    for (let n = 0; n < 3; n++) await page.keyboard.press(".");
    await until(page, "roll", "15.0");
    assert.notEqual(await hashOf(page), first);
    for (let n = 0; n < 4; n++) await page.keyboard.press("ArrowRight");
    await settled(page);
    const turned = await state(page);
    assert.equal(turned.roll, "15.0", "orbiting preserves the roll");
    assert.notEqual(turned.azimuth, start.azimuth);
    for (let n = 0; n < 2; n++) await page.keyboard.press(",");
    await until(page, "roll", "5.0");
    await page.keyboard.press("0");
    await until(page, "roll", "0.0");
    assert.equal(await hashOf(page), first);
  }));

// --- fingers and wheel -----------------------------------------------------------------------

const upOf = async (page) => (await cameras(page)).at(-1).up;

test("twisting two fingers rolls the camera by their angle", () =>
  withPage(
    async (page) => {
      await page.keyboard.press("1"); // view from the south: up is z, right is x
      await until(page, "elevation", "0.0");
      const cdp = await page.context().newCDPSession(page);
      const box = await pictureBox(page);
      const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
      const touch = async (type, ...degrees) => {
        for (const angle of degrees) {
          const [dx, dy] = [60 * Math.cos(angle / 57.29578), 60 * Math.sin(angle / 57.29578)];
          await cdp.send("Input.dispatchTouchEvent", {
            type,
            touchPoints: [
              { x: x + dx, y: y + dy, id: 0 },
              { x: x - dx, y: y - dy, id: 1 },
            ],
          });
        }
      };
      const { distance } = await state(page);
      await touch("touchStart", 0);
      await touch("touchMove", 2, 4);
      await finalPicture(page);
      assert.equal((await state(page)).roll, "0.0", "small rotations of the fingers do not roll");
      await touch("touchMove", 10, 15, 20, 25, 30);
      await cdp.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
      await finalPicture(page);
      // After 30 degrees clockwise, the former direction 30 degrees left of up points up.
      const up = await upOf(page);
      for (const [n, value] of [-0.5, 0, Math.sqrt(3) / 2].entries()) {
        assert.ok(Math.abs(up[n] - value) < 0.01, `${up}`);
      }
      const turned = await state(page);
      assert.ok(Math.abs(Number(turned.roll) - 30) < 0.5);
      assert.ok(Math.abs(Number(turned.distance) / Number(distance) - 1) < 0.01);
      assert.equal(await page.locator("#hover").isVisible(), false);
    },
    { hasTouch: true, viewport: { width: 390, height: 700 }, isMobile: true },
  ));

test("a burst of wheel events reaches the right zoom with few patches and no scrolling", () =>
  withPage(async (page) => {
    const start = Number((await state(page)).distance);
    const before = (await cameras(page)).length;
    const frames = await framesOf(page, () =>
      page.evaluate(() => {
        const picture = document.querySelector("#picture");
        for (let n = 0; n < 200; n++) {
          const event = new WheelEvent("wheel", { deltaY: 3, bubbles: true, cancelable: true });
          if (picture.dispatchEvent(event)) throw new Error("the page would scroll");
        }
      }),
    );
    const { distance } = await state(page);
    assert.ok(Math.abs(Number(distance) / (start * 1.0015 ** 600) - 1) < 2e-3);
    assert.ok((await cameras(page)).length - before <= 3);
    assert.ok(frames.length >= 1);
    await page.keyboard.press("Control+z");
    await until(page, "distance", start.toFixed(4));
    // A trackpad pinch arrives as a wheel event with ctrl, which by default would zoom the page.
    await page.evaluate(() => {
      const picture = document.querySelector("#picture");
      for (let n = 0; n < 10; n++) {
        const look = { deltaY: -7, ctrlKey: true, bubbles: true, cancelable: true };
        if (picture.dispatchEvent(new WheelEvent("wheel", look))) throw new Error("zooms the page");
      }
    });
    await finalPicture(page);
    const pinched = Number((await state(page)).distance);
    assert.ok(Math.abs(pinched / (start / 1.01 ** 70) - 1) < 2e-3, `${start} to ${pinched}`);
  }));

test("one finger orbits, two fingers pan and pinch", () =>
  withPage(async (page) => {
    const cdp = await page.context().newCDPSession(page);
    const box = await pictureBox(page);
    const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
    const touch = async (path) => {
      const points = (at) => at.map(([dx, dy], id) => ({ x: x + dx, y: y + dy, id }));
      await cdp.send("Input.dispatchTouchEvent", {
        type: "touchStart",
        touchPoints: points(path[0]),
      });
      for (const at of path.slice(1)) {
        await cdp.send("Input.dispatchTouchEvent", {
          type: "touchMove",
          touchPoints: points(at),
        });
        await page.waitForTimeout(20);
      }
      await cdp.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
      await finalPicture(page);
      return state(page);
    };
    const start = await state(page);
    const turned = await touch([[[0, 0]], [[30, 0]], [[60, 0]]]);
    assert.ok(Number(turned.azimuth) < Number(start.azimuth) - 5);
    assert.equal(turned.distance, start.distance);
    const pinched = await touch([
      [
        [-40, 0],
        [40, 0],
      ],
      [
        [-60, 0],
        [60, 0],
      ],
      [
        [-80, 0],
        [80, 0],
      ],
    ]);
    assert.ok(
      Number(pinched.distance) < 0.7 * Number(turned.distance),
      "doubling the finger distance halves the camera distance",
    );
    assert.equal(pinched.azimuth, turned.azimuth, "pinching does not turn");
    const moved = await touch([
      [
        [-40, 0],
        [40, 0],
      ],
      [
        [-40, 30],
        [40, 30],
      ],
    ]);
    assert.equal(moved.distance, pinched.distance);
    assert.equal(moved.azimuth, pinched.azimuth);
    assert.notEqual(moved.rev, pinched.rev);
    assertDrawn(await pixels(page));
  }, phone));
