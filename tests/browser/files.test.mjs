// The file browser: what is below the data root is opened by one click; without one a hint says how
// to add data.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { copyFileSync, mkdirSync, mkdtempSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { assertDrawn, finalPicture, ownPage, pixels, sharedDaemon, shot } from "./support.mjs";

const root = mkdtempSync(join(tmpdir(), "windsplat-files-"));
after(() => rmSync(root, { recursive: true }));
mkdirSync(join(root, "runs"));
const sample = join(root, "runs", "gcm.nc");
const synth = ["synth", "climate", "--dims", "40x20x5", "-o", sample];
execFileSync(process.env.WINDSPLAT_PROGRAM, synth);
for (const n of [1, 2, 10]) copyFileSync(sample, join(root, "runs", `s_${n}.nc`));
writeFileSync(join(root, "runs", "damaged.nc"), "CDF\x01 and no more");
writeFileSync(join(root, "notes.txt"), "hello");
symlinkSync("/etc/passwd", join(root, "passwd"));

const shared = sharedDaemon({ args: ["tornado", "--data-root", root] });
const { withPage } = shared;

const rows = (page) => page.locator(".file-row .file-name").allInnerTexts();
const row = (page, name) =>
  page.locator("button.file-row", { has: page.getByText(name, { exact: true }) });

test("a file below the data root is found and opened", () =>
  withPage(async (page) => {
    await page.keyboard.press("d");
    await page.locator("#files").waitFor();
    assert.deepEqual(await rows(page), ["runs/", "notes.txt"]);
    assert.match(await page.locator("#files-note").innerText(), /^1 not listed/);
    assert.equal(await page.locator("#files-hint").isVisible(), false);
    assert.equal(await row(page, "notes.txt").count(), 0, "no button");
    await row(page, "runs/").click();
    await row(page, "gcm.nc").waitFor();
    assert.deepEqual(await rows(page), [
      ...["s_*.nc", "damaged.nc", "gcm.nc", "s_1.nc", "s_2.nc", "s_10.nc"],
    ]);
    await shot(page, "files");
    await row(page, "gcm.nc").click();
    await page.waitForFunction(() => document.querySelector("#dataset").value === "gcm");
    await finalPicture(page);
    assertDrawn(await pixels(page));
    assert.equal(await page.locator("#datasets").isVisible(), false);
    await page.keyboard.press("d");
    const current = page.locator('.card[aria-current="true"]');
    await current.waitFor();
    assert.equal(await current.count(), 1, "the card of the dataset is marked");
  }));

test("files that differ in numbers are opened as one series", () =>
  withPage(async (page) => {
    await page.keyboard.press("d");
    await row(page, "runs/").click();
    await row(page, "s_*.nc").click();
    await page.waitForFunction(() => document.querySelector("#dataset").value === "s");
    await finalPicture(page);
    await page.keyboard.press("d");
    await row(page, "runs/").waitFor({ state: "hidden" });
    await page.locator("#files-trail button", { hasText: "data" }).click();
    await row(page, "runs/").waitFor();
  }));

test("a file that cannot be read says why, and the list stays", () =>
  withPage(
    async (page) => {
      await page.keyboard.press("d");
      await row(page, "runs/").click();
      await row(page, "damaged.nc").click();
      await page.locator("#files-error:visible").waitFor();
      assert.match(
        await page.locator("#files-error").innerText(),
        /^runs\/damaged\.nc cannot be opened: /,
      );
      assert.equal(await row(page, "gcm.nc").isVisible(), true);
    },
    { faulty: true },
  ));

test("without a data root a hint says how to add data", async (t) => {
  const { page } = await ownPage(t, shared.browser, { args: ["tornado"] });
  await finalPicture(page);
  await page.keyboard.press("d");
  await page.locator("#files-hint").waitFor();
  assert.match(await page.locator("#files-hint").innerText(), /--data-root/);
  assert.equal(await page.locator("#files").isVisible(), false);
});
