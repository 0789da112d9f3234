// Fingers on <windsplat-view> in a page of another origin that scrolls: real touch events.
import assert from "node:assert/strict";
import { test } from "node:test";
import { event, finalOf, sharedSite, toldOf } from "./site.mjs";

const shared = sharedSite();
const phone = { hasTouch: true, isMobile: true, viewport: { width: 390, height: 700 } };
const css = `body { margin: 0; height: 3000px; }
  windsplat-view { width: 390px; height: 300px; margin-top: 200px; }`;
const middle = [195, 350];

// Touches of the page's element; each place of a finger is relative to the middle of the picture.
async function touches(page) {
  const cdp = await page.context().newCDPSession(page);
  const send = (type, places) =>
    cdp.send("Input.dispatchTouchEvent", {
      type,
      touchPoints: places.map(([x, y], id) => ({ x: middle[0] + x, y: middle[1] + y, id })),
    });
  return {
    down: (...places) => send("touchStart", places),
    // In several moves, as a hand makes them.
    move: async (before, after, moves = 8) => {
      for (let n = 1; n <= moves; n++) {
        const between = (a, b) => a.map((from, k) => from + ((b[k] - from) * n) / moves);
        await send(
          "touchMove",
          before.map((place, k) => between(place, after[k])),
        );
        await page.waitForTimeout(16);
      }
    },
    up: () => send("touchEnd", []),
  };
}

// Moves fingers from their places to others and lifts them; returns what became of it.
async function gesture(page, before, after) {
  const finger = await touches(page);
  const state = () =>
    page.evaluate(() => ({
      camera: document.querySelector("#a").camera,
      scrolled: scrollY,
      pinched: visualViewport.scale,
    }));
  await finalOf(page);
  const first = await state();
  await finger.down(...before);
  await finger.move(before, after);
  await finger.up();
  await page.waitForTimeout(100);
  await finalOf(page);
  return { first, last: await state() };
}

async function open(t, attributes = "", rules = "") {
  const body = `<meta name="viewport" content="width=device-width">
    <windsplat-view id="a" src="SRC" dataset="tornado" ${attributes}></windsplat-view>`;
  const page = await shared.pageWith(t, body, { css: css + rules, ...phone });
  await finalOf(page);
  return page;
}

const still = ({ first, last }) => assert.deepEqual(last.camera, first.camera);
const near = (a, b, what) => {
  for (const [k, value] of a.entries()) assert.ok(Math.abs(value - b[k]) < 0.01, `${what}: ${a}`);
};

test("a finger across turns the picture by its way, and the page stays", async (t) => {
  const page = await open(t);
  const { first, last } = await gesture(page, [[-50, 0]], [[50, 30]]);
  assert.deepEqual([last.scrolled, last.pinched], [0, 1]);
  near(last.camera.target, first.camera.target, "it turns about the target");
  assert.ok(Math.abs(last.camera.height - first.camera.height) < 1e-4, "it does not zoom");
  // 240 degrees for the height of the picture
  const [x, y] = last.camera.eye.map((value, k) => value - last.camera.target[k]);
  const azimuth = (Math.atan2(x, -y) * 180) / Math.PI;
  assert.ok(Math.abs(azimuth + (240 * 100) / 300) < 1, `azimuth ${azimuth}`);
  assert.ok(last.camera.eye[2] > first.camera.eye[2] + 0.5, "down shows it from above");
});

test("a finger up or down scrolls the page, and the picture stays", async (t) => {
  const page = await open(t);
  const moved = await gesture(page, [[0, 60]], [[10, -60]]);
  still(moved);
  assert.ok(moved.last.scrolled > 60, `scrolled by ${moved.last.scrolled}`);
  assert.deepEqual((await toldOf(page, "view")).length, 0);
});

test("two fingers move and zoom the picture, and neither scroll nor zoom the page", async (t) => {
  const page = await open(t);
  const up = await gesture(
    page,
    [
      [-40, 60],
      [40, 60],
    ],
    [
      [-40, -60],
      [40, -60],
    ],
  );
  assert.deepEqual([up.last.scrolled, up.last.pinched], [0, 1]);
  near([up.last.camera.height], [up.first.camera.height], "the same zoom");
  // The picture goes with the fingers, so that the camera goes down.
  const way = up.last.camera.target.map((value, k) => value - up.first.camera.target[k]);
  const expected = (120 / 300) * up.first.camera.height;
  assert.ok(Math.abs(Math.hypot(...way) - expected) < 0.05 * expected, `${way}`);
  assert.ok(way[2] < 0);
  const apart = await gesture(
    page,
    [
      [0, -40],
      [0, 40],
    ],
    [
      [0, -80],
      [0, 80],
    ],
  );
  near([apart.last.camera.height], [apart.first.camera.height / 2], "twice as far apart");
  assert.deepEqual([apart.last.scrolled, apart.last.pinched], [0, 1]);
});

test("style sheets give all directions to the picture, or all fingers to the page", async (t) => {
  const all = await open(t, "", "windsplat-view { touch-action: none; }");
  const { first, last } = await gesture(all, [[0, 60]], [[0, -60]]);
  assert.equal(last.scrolled, 0);
  assert.ok(last.camera.eye[2] < first.camera.eye[2] - 0.5, "up shows it from below");
  const none = await open(t, 'interactive="false"');
  const left = await gesture(none, [[0, 60]], [[0, -60]]);
  still(left);
  assert.ok(left.last.scrolled > 60);
});

test("a tap picks and takes the focus; a short way is no tap", async (t) => {
  const page = await open(t, "pick");
  const finger = await touches(page);
  await finger.down([0, 0]);
  await finger.move([[0, 0]], [[30, 0]]);
  await finger.up();
  await finalOf(page);
  assert.equal((await toldOf(page, "pick")).length, 0);
  await page.touchscreen.tap(...middle);
  const { detail } = await event(page, "pick");
  assert.deepEqual([detail.x, detail.y], [0.5, 0.5]);
  assert.equal(await page.evaluate(() => document.activeElement.id), "a");
});
