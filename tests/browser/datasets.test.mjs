// Files that cannot be shown, and files that change, in a real browser: the page's messages and
// state.
import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { gzipSync } from "node:zlib";
import { finalPicture, launch, ownPage, shot, unfold } from "./support.mjs";

let browser;
let folder;

before(async () => {
  browser = await launch();
  folder = mkdtempSync(join(tmpdir(), "windsplat-datasets-"));
});

after(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true, force: true });
});

// Writes a cube of n x n x n vectors; all files have the same title.
function writeCube(name, n, damaged = false) {
  const values = Float32Array.from({ length: 3 * n ** 3 }, (_, i) => 5 + 4 * Math.sin(i / 7));
  const packed = gzipSync(Buffer.from(values.buffer), { level: 1 });
  if (damaged) packed.fill(0x55, packed.length / 2);
  const header = [
    "NRRD0004",
    "content: My storm",
    "type: float",
    "dimension: 4",
    `sizes: 3 ${n} ${n} ${n}`,
    "kinds: vector domain domain domain",
    "encoding: gzip",
    "endian: little",
  ];
  const path = join(folder, name);
  writeFileSync(path, Buffer.concat([Buffer.from(`${header.join("\n")}\n\n`), packed]));
  return path;
}

const viewport = { width: 1280, height: 800 };

const texts = (page) => page.locator("#dataset option").allTextContents();

test("the reason why a dataset cannot be shown remains visible", async (t) => {
  const files = [writeCube("ok.nrrd", 12), writeCube("big.nrrd", 190)];
  files.push(writeCube("torn.nrrd", 12, true));
  const args = ["--memory-limit", "192M", ...files];
  const { page } = await ownPage(t, browser, { args, viewport });
  await finalPicture(page);
  assert.deepEqual(await texts(page), ["My storm (ok)", "My storm (big)", "My storm (torn)"]);
  for (const [id, why] of [
    ["big", /--memory-limit \d+M would suffice/],
    ["torn", /torn\.nrrd/],
  ]) {
    await page.locator("#dataset").selectOption(id);
    await page.waitForFunction((one) => {
      const option = document.querySelector(`#dataset option[value=${one}]`);
      return option.textContent.endsWith("failed");
    }, id);
    await finalPicture(page);
    await page.waitForTimeout(500); // time for the server's answer to the restored view
    assert.ok(await page.locator("#alert").isVisible(), id);
    assert.match(await page.locator("#alert-text").textContent(), why);
    assert.equal(await page.locator("#dataset").inputValue(), "ok");
  }
  await shot(page, "unreadable-1280");
  await page.locator("#alert-close").click();
  assert.equal(await page.locator("#alert").isVisible(), false);
  assert.deepEqual(page.faults, []);
});

test("the page follows changed files, their steps and their errors", async (t) => {
  let opened;
  let say;
  const listen = (socket) => {
    say = (message) => socket.send(JSON.stringify(message));
    const server = socket.connectToServer();
    server.onMessage((data) => {
      if (typeof data === "string" && data.includes('"opened"')) opened = JSON.parse(data);
      socket.send(data);
    });
  };
  const { page } = await ownPage(t, browser, {
    args: ["climate"],
    viewport,
    prepare: (fresh) => fresh.routeWebSocket(/\/v1\/stream/, listen),
  });
  await finalPicture(page);
  const { id, dataset } = opened;
  await unfold(page, "Probe");
  await page.locator("#probe-x").fill("100");
  await page.locator("#probe-x").press("Enter");
  const place = await page.locator("#probe-x").inputValue();
  await page.locator("#picture").focus();
  await page.keyboard.press("}");
  await finalPicture(page);
  const times = dataset.steps.times.slice(0, 3);
  say({ type: "opened", id, dataset: { ...dataset, steps: { count: 3, times } } });
  await page.waitForFunction(
    () => document.querySelector("#time-step").textContent === "step 3 of 3",
  );
  await finalPicture(page);
  assert.equal(await page.locator("#picture").getAttribute("data-step"), "2");
  assert.equal(await page.locator("#probe-x").inputValue(), place, "the probe is not moved");
  const detail = "'climate.nc' is damaged: its header cannot be read";
  const problem = { type: "about:blank", title: "Unprocessable Content", status: 422, detail };
  say({ type: "error", id, problem });
  await page.locator("#alert").waitFor();
  await page.keyboard.press("{");
  await finalPicture(page);
  assert.equal(await page.locator("#alert-text").textContent(), detail);
  assert.match((await texts(page))[0], / — failed$/);
  await shot(page, "files-changed-1280");
  say(opened);
  await page.locator("#alert").waitFor({ state: "hidden" });
  assert.deepEqual(page.faults, []);
});

test("the legend states the slow limit, and the probe labels times", async (t) => {
  const path = '#!{"dataset":"climate","vector":{"minMagnitude":3}}';
  const { page } = await ownPage(t, browser, { args: ["climate"], path, viewport });
  await finalPicture(page);
  const leftOut = page.locator(".legend-lines .legend-left-out");
  assert.equal(await leftOut.textContent(), "slower than 3 m s⁻¹ not drawn");
  const name = await page.locator(".legend-lines").getAttribute("aria-label");
  assert.match(name, /slower than 3 m s⁻¹ not drawn$/);
  await unfold(page, "Probe");
  await page.getByRole("button", { name: "Over time" }).click();
  const course = page.locator(".course");
  await course.waitFor();
  const words = await course.getAttribute("aria-label");
  assert.match(words, / between \d{4}-\d\d-\d\d \d\d:\d\dZ and \d{4}-\d\d-\d\d \d\d:\d\dZ$/);
  assert.doesNotMatch(await course.textContent(), /object/);
  await finalPicture(page);
  await course.scrollIntoViewIfNeeded();
  await shot(page, "left-out-1280");
  await page.setViewportSize({ width: 390, height: 844 });
  await finalPicture(page);
  const ahead = page.locator(".legend-lines .legend-note", { hasText: "end ahead" });
  assert.ok(await ahead.isVisible(), "phones are told which end is ahead, too");
  await shot(page, "left-out-390");
  assert.deepEqual(page.faults, []);
});
