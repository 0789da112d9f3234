// Comparison on the page: two pictures with one camera and equal ranges, and differences.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { test } from "node:test";
import {
  choose,
  control,
  drag,
  finalPicture,
  patience,
  sharedDaemon,
  shot,
  state,
  type,
  unfold,
} from "./support.mjs";

const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

// Records per connection the view that the server reports with each frame.
const watchViews = () => {
  window.reported = [];
  const Native = window.WebSocket;
  window.WebSocket = class extends Native {
    constructor(...args) {
      super(...args);
      const views = [];
      window.reported.push(views);
      this.addEventListener("message", ({ data }) => {
        if (typeof data !== "string") return;
        const message = JSON.parse(data);
        if (message.type === "chosen") views.push(message.view);
      });
    }
  };
};

const { withPage } = sharedDaemon({
  page: { viewport: { width: 1300, height: 640 }, initScript: [watchViews] },
});

// Waits until the second picture shows the newest view, and the first one too.
async function bothFinal(page) {
  await finalPicture(page);
  await page.waitForFunction(
    () => {
      const { rev, wanted, state: now } = document.querySelector("#beside-picture").dataset;
      return now === "final" && rev === wanted;
    },
    null,
    { polling: 20, timeout: 20_000 * patience },
  );
}

const compare = async (page) => {
  await page.locator("#picture").press("c"); // narrow pages have no button
  await bothFinal(page);
};

// The views that the server reported last to the two sessions. The second one begins anew whenever
// its picture is opened.
const views = async (page) => {
  await bothFinal(page);
  return page.evaluate(() => [window.reported[0], window.reported.at(-1)].map((all) => all.at(-1)));
};

const ranges = ({ vector, scalars }) => ({
  magnitudes: vector.magnitudeRange,
  least: vector.minMagnitude,
  length: vector.length,
  lines: vector.color.range,
  media: scalars.map(({ color, extinction }) => [color.range, extinction]),
});

const dragBeside = async (page) => {
  const box = await page.locator("#beside-picture").boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let n = 1; n <= 8; n++) await page.mouse.move(x - 12 * n, y + 4 * n);
  await page.mouse.up();
};

test("a drag in either picture moves both cameras, as the server reports them", () =>
  withPage(async (page) => {
    await compare(page);
    const [first, second] = await views(page);
    assert.deepEqual(second.camera, first.camera);
    assert.notEqual(second.step ?? 0, first.step ?? 0, "another step is shown at first");
    await drag(page, 120, 30);
    const [moved, followed] = await views(page);
    assert.notDeepEqual(moved.camera, first.camera);
    assert.deepEqual(followed.camera, moved.camera);
    await dragBeside(page);
    const [led, leader] = await views(page);
    assert.notDeepEqual(led.camera, moved.camera);
    assert.deepEqual(leader.camera, led.camera);
    await shot(page, "beside");
  }));

test("both pictures have the ranges of the first, and follow its settings until unlinked", () =>
  withPage(async (page) => {
    await compare(page);
    const [first, second] = await views(page);
    assert.deepEqual(ranges(second), ranges(first));
    await type(page, "opacity", 0.35);
    const [changed, followed] = await views(page);
    assert.equal(changed.vector.opacity, 0.35);
    assert.equal(followed.vector.opacity, 0.35);
    await page.locator("#beside-linked").uncheck();
    await type(page, "opacity", 0.9);
    await drag(page, 60, 0);
    const [own, kept] = await views(page);
    assert.equal(own.vector.opacity, 0.9);
    assert.equal(kept.vector.opacity, 0.35, "its own settings");
    assert.deepEqual(kept.camera, own.camera, "the camera stays linked");
    await page.locator("#beside-linked").check();
    assert.equal((await views(page))[1].vector.opacity, 0.9);
  }));

test("cameras are unlinked and linked again; each picture is then moved by itself", () =>
  withPage(async (page) => {
    await compare(page);
    const [{ camera }] = await views(page);
    const linked = page.locator("#beside-camera");
    await linked.uncheck();
    await dragBeside(page);
    const [first, second] = await views(page);
    assert.deepEqual(first.camera, camera, "the first camera stays");
    assert.notDeepEqual(second.camera, camera);
    await drag(page, 120, 30);
    const [moved, kept] = await views(page);
    assert.notDeepEqual(moved.camera, camera);
    assert.deepEqual(kept.camera, second.camera, "so does the second");
    await shot(page, "beside-cameras");
    await page.locator("#beside-picture").press("ArrowLeft"); // keys move the one with the focus
    const [still, turned] = await views(page);
    assert.deepEqual(still.camera, moved.camera);
    assert.notDeepEqual(turned.camera, second.camera);
    await page.locator("#beside-swap").click();
    const [swapped, other] = await views(page);
    assert.deepEqual([swapped.camera, other.camera], [turned.camera, moved.camera]);
    await linked.check();
    const [leader, follower] = await views(page);
    assert.deepEqual(leader.camera, swapped.camera);
    assert.deepEqual(follower.camera, swapped.camera);
  }));

// What a user set in the second picture alone.
const setApart = async (page) => {
  await compare(page);
  await page.locator("#beside-linked").uncheck();
  await page.locator("#beside-camera").uncheck();
  await type(page, "opacity", 0.35); // the first one
  await dragBeside(page);
  await page.locator("#beside-step").fill("3");
  await page.keyboard.press("Enter");
  const both = await views(page);
  assert.notEqual(both[0].vector.opacity, both[1].vector.opacity);
  assert.notDeepEqual(both[0].camera, both[1].camera);
  assert.equal(both[1].step, 2);
  return both;
};

test("the address restores settings and camera of both pictures", () =>
  withPage(async (page) => {
    const before = await setApart(page);
    await page.waitForTimeout(600); // the address is written with a delay
    await page.reload();
    assert.deepEqual(await views(page), before);
    assert.equal(await page.locator("#beside-linked").isChecked(), false);
    assert.equal(await page.locator("#beside-camera").isChecked(), false);
  }));

test("a saved view restores both pictures, and one without a second closes it", () =>
  withPage(async (page) => {
    const save = async (name) => {
      await page.locator("#save-button").click();
      await page.locator("#keep-name").fill(name);
      await page.keyboard.press("Enter");
      await page.locator("#kept li").first().waitFor();
    };
    const reopen = async (name) => page.locator("#save").getByLabel(`Open ${name}`).click();
    await save("alone");
    await page.keyboard.press("Escape");
    const before = await setApart(page);
    await save("both");
    await shot(page, "beside-saved");
    await reopen("alone");
    await finalPicture(page);
    assert.equal(await page.locator("#beside").isVisible(), false);
    await page.locator("#save-button").click();
    await reopen("both");
    assert.deepEqual(await views(page), before);
  }));

test("step and swap, by keyboard alone; the way out gives the room and the focus back", () =>
  withPage(async (page) => {
    const width = () => page.locator("#picture").evaluate(({ clientWidth }) => clientWidth);
    const alone = await width();
    await page.locator("#picture").focus();
    await page.keyboard.press("c");
    await bothFinal(page);
    assert.ok((await width()) < 0.6 * alone);
    assert.equal(await page.evaluate(() => document.activeElement.id), "beside-dataset");
    await page.keyboard.press("Tab");
    await page.keyboard.type("3");
    await page.keyboard.press("Enter");
    assert.equal((await views(page))[1].step, 2, "counted from 1");
    const before = (await views(page))[0].step ?? 0;
    for (let n = 0; n < 3; n++) await page.keyboard.press("Tab");
    await page.keyboard.press("Enter"); // Swap
    await page.waitForFunction(() => document.querySelector("#picture").dataset.step === "2");
    assert.equal((await views(page))[1].step ?? 0, before);
    await page.locator("#beside-step").fill("");
    await page.keyboard.press("Enter");
    assert.equal((await views(page))[1].step, 2, "the step of the first picture");
    await page.locator("#beside-close").press("Enter");
    assert.equal(await page.locator("#beside").isVisible(), false);
    assert.equal(await page.evaluate(() => document.activeElement.id), "compare-button");
    assert.equal(await width(), alone);
  }));

test("the dialog for pictures says that the first of two is saved", () =>
  withPage(async (page) => {
    const note = page.locator("#save-first");
    await finalPicture(page);
    await page.locator("#save-button").click();
    await page.locator("#save[open]").waitFor();
    assert.equal(await note.isVisible(), false, "there is one picture");
    await page.keyboard.press("Escape");
    await compare(page);
    await page.locator("#save-button").click();
    await note.waitFor({ state: "visible" });
    assert.match(await note.textContent(), /the first is saved/);
  }));

test("the address keeps the comparison", () =>
  withPage(async (page) => {
    await compare(page);
    await page.locator("#beside-step").fill("2");
    await page.keyboard.press("Enter");
    const [, second] = await views(page);
    await page.waitForFunction(() => window.location.hash.includes("&beside="));
    await page.waitForTimeout(600); // the address is written with a delay
    await page.reload();
    await bothFinal(page);
    const [, again] = await views(page);
    assert.deepEqual(again, second);
    await page.locator("#beside-close").click();
    await page.waitForFunction(() => !window.location.hash.includes("&beside="));
  }));

test("another dataset whose fields differ says so, and the first picture stays", () =>
  withPage(
    async (page) => {
      await compare(page);
      const other = (await state(page)).seq;
      await page.locator("#beside-dataset").selectOption("efield");
      await page.waitForFunction(() =>
        document.querySelector("#beside-words").classList.contains("refused"),
      );
      assert.match(await page.locator("#beside-words").textContent(), /field/);
      assert.equal((await state(page)).seq, other);
      await page.locator("#beside-dataset").selectOption({ index: 0 });
      await bothFinal(page);
    },
    { faulty: true },
  ));

for (const [name, viewport] of [
  ["wide", { width: 1300, height: 640 }],
  ["narrow", { width: 800, height: 800 }],
  ["phone", { width: 390, height: 844 }],
]) {
  test(`both pictures have room and axe finds nothing: ${name}`, () =>
    withPage(
      async (page) => {
        await compare(page);
        const box = (id) => page.locator(id).boundingBox();
        const [first, second] = [await box("#picture"), await box("#beside-picture")];
        assert.ok(first.width > 200 && first.height > 120, JSON.stringify(first));
        assert.ok(Math.abs(second.width - first.width) <= 2, JSON.stringify([first, second]));
        assert.ok(Math.abs(second.height - first.height) <= 2, JSON.stringify([first, second]));
        if (name === "wide") assert.ok(second.x >= first.x + first.width - 1, "beside it");
        else assert.ok(second.y >= first.y + first.height - 1, "below it");
        const wide = await page.evaluate(() => document.documentElement.scrollWidth);
        assert.ok(wide <= viewport.width, "nothing is cut off");
        await page.evaluate(axe);
        const found = await page.evaluate(() => window.axe.run(document));
        assert.deepEqual(
          found.violations.map(({ id, nodes }) => [id, ...nodes.map(({ target }) => target)]),
          [],
        );
        await shot(page, `beside-${name}`);
      },
      { viewport },
    ));
}

for (const [name, viewport] of [
  ["wide", { width: 1300, height: 640 }],
  ["paper", { width: 700, height: 1000 }],
  ["phone", { width: 390, height: 844 }],
]) {
  test(`printing shows both pictures with captions and legends below them: ${name}`, () =>
    withPage(
      async (page) => {
        await compare(page);
        const [first, second] = await views(page);
        await page.evaluate(() => window.dispatchEvent(new Event("beforeprint")));
        await page.emulateMedia({ media: "print" });
        await page.waitForTimeout(400);
        await shot(page, `beside-printed-${name}`);
        const box = async (id) => {
          const { x, y, width, height } = await page.locator(id).boundingBox();
          return { left: x, right: x + width, top: y, bottom: y + height, width };
        };
        const ids = ["#picture", "#print-caption", "#beside-picture", "#beside-words", "#legend"];
        const [above, caption, below, words, legend] = await Promise.all(ids.map(box));
        assert.equal(await page.locator(".beside-bar").isVisible(), false);
        assert.ok(Math.abs(below.width - above.width) < 2, "of equal size");
        assert.ok(Math.abs(above.left + above.right - viewport.width) < 40, "in the middle");
        const order = [above, caption, below, words, legend];
        for (let n = 1; n < order.length; n++) {
          assert.ok(order[n].top >= order[n - 1].bottom - 1, `${ids[n]} below ${ids[n - 1]}`);
        }
        assert.match(await page.locator("#print-caption").innerText(), /step 1 of 8/);
        assert.match(await page.locator("#beside-words").innerText(), /step 8 of 8/);
        for (const entry of await page.locator(".legend-entry").all()) {
          const { x, width } = await entry.boundingBox();
          assert.ok(x >= 0 && x + width <= viewport.width && width > 200, `${x}, ${width}`);
          assert.ok(await entry.locator(".legend-note").first().isVisible(), "with its note");
        }
        await page.emulateMedia({ media: "screen" });
        const after = await views(page);
        assert.deepEqual(
          after.map(({ image }) => image),
          [first.image, second.image],
        );
      },
      { viewport },
    ));
}

test("a second picture with settings of its own has a legend of its own, also on paper", () =>
  withPage(async (page) => {
    await compare(page);
    const legend = page.locator("#beside-legend");
    assert.equal(await legend.isVisible(), false);
    await page.locator("#beside-linked").uncheck();
    await unfold(page, "Line colour");
    await choose(page, "map", /^plasma$/);
    await bothFinal(page);
    const strips = () =>
      page.evaluate(() =>
        ["#legend", "#beside-legend"].map((id) => {
          const strip = document.querySelector(`${id} .legend-lines .legend-strip`);
          return strip && getComputedStyle(strip).backgroundImage;
        }),
      );
    await legend.waitFor();
    const [first, second] = await strips();
    assert.ok(first !== second && second !== null, `${first} ${second}`);
    await shot(page, "beside-legend");
    await page.emulateMedia({ media: "print" });
    assert.ok(await legend.isVisible());
  }));

// The parts of the bar lie apart within the second picture, and the dataset can be read.
async function assertBarWithin(page) {
  const ids = ["dataset", "step", "linked", "camera", "swap", "close"];
  const box = (id) => page.locator(id).boundingBox();
  const room = await box("#beside-picture");
  const parts = await Promise.all(ids.map((id) => box(`#beside-${id}`)));
  parts.forEach((part, n) => {
    const inside = part.x >= room.x && part.x + part.width <= room.x + room.width;
    assert.ok(inside && part.width >= (n === 0 ? 80 : 12), `${ids[n]} ${JSON.stringify(part)}`);
    for (const other of parts.slice(n + 1)) {
      const apart =
        part.x + part.width <= other.x ||
        other.x + other.width <= part.x ||
        part.y + part.height <= other.y ||
        other.y + other.height <= part.y;
      assert.ok(apart, `${ids[n]} lies over another part`);
    }
  });
}

test("on a phone the pictures have the room: little lies over them, and the panel folds", () =>
  withPage(
    async (page) => {
      await compare(page);
      assert.equal(await page.locator("#panel").isVisible(), false);
      const box = (id) => page.locator(id).boundingBox();
      const [first, second] = [await box("#picture"), await box("#beside-picture")];
      assert.ok(first.height > 300 && second.height > 300, `${first.height}, ${second.height}`);
      const over = async (ids, picture) => {
        const sizes = await Promise.all(ids.map(box));
        const covered = sizes.reduce((sum, one) => sum + one.width * one.height, 0);
        return covered / (picture.width * picture.height);
      };
      assert.ok((await over(["#legend"], first)) < 0.25);
      assert.ok((await over([".beside-bar", "#beside-words"], second)) < 0.25);
      assert.equal(await page.locator(".corner").isVisible(), false);
      await assertBarWithin(page);
      await shot(page, "beside-room-phone");
    },
    { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true },
  ));

test("on a wide and low phone the button folds the panel, too", () =>
  withPage(
    async (page) => {
      await page.locator("#compare-button").click();
      await bothFinal(page);
      assert.equal(await page.locator("#panel").isVisible(), false);
      await assertBarWithin(page);
      await shot(page, "beside-room-low");
    },
    { viewport: { width: 844, height: 390 }, hasTouch: true, isMobile: true },
  ));

test("the panel subtracts another step, and the legend says so", () =>
  withPage(async (page) => {
    await unfold(page, "Compare");
    await page.keyboard.press("]");
    const asked = [];
    page.on("request", (request) => asked.push(request.url()));
    await choose(page, "subtract", /a step/);
    await finalPicture(page);
    const shown = await page.evaluate(() => window.reported.at(-1).at(-1));
    assert.equal(shown.difference.step, 0);
    const [low, high] = shown.scalars[0].color.range;
    assert.equal(low, -high);
    assert.match(await page.locator("#legend").textContent(), /difference of/);
    await page.keyboard.press("i");
    await page.locator(".probe-values dt", { hasText: "cloud (difference)" }).waitFor();
    await page.locator(".probe-values").scrollIntoViewIfNeeded();
    await shot(page, "difference");
    const minus = (path) => asked.some((url) => url.includes(path) && url.includes("minusStep=0"));
    assert.ok(minus("/probe?"), asked.join(" "));
    await unfold(page, "Opacity curve");
    await page.locator(".histogram-caption:visible", { hasText: /^[-−]/ }).first().waitFor();
    assert.ok(minus("/histogram?"), asked.join(" "));
    await control(page, "subtract").selectOption({ label: "nothing" });
    await finalPicture(page);
    const after = await page.evaluate(() => window.reported.at(-1).at(-1));
    assert.equal(after.difference ?? null, null);
    assert.doesNotMatch(await page.locator("#legend").textContent(), /difference/);
  }));
