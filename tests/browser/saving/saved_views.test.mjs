// Saved views and links in a real browser: the list in the Save dialog, Share, short links.
import assert from "node:assert/strict";
import { test } from "node:test";
import { finalPicture, pixels, sharedDaemon, state } from "../support.mjs";

const shared = sharedDaemon({ basePath: "/a/b/", page: { viewport: { width: 900, height: 600 } } });
const { withPage } = shared;

const hashOf = (view) => `#!${encodeURIComponent(JSON.stringify(view))}`;
const linkTo = (view) => ({ path: hashOf(view) });

const addressView = (page) =>
  page.evaluate(() => JSON.parse(decodeURIComponent(location.hash.slice(2))));

const turned = { dataset: "climate", step: 3, camera: { eye: [2, -2, 1], target: [0, 0, 0.1] } };

test("views are saved by name and restored after a reload", () =>
  withPage(async (page) => {
    const before = await pixels(page);
    await page.keyboard.press("s");
    await page.locator("#keep-name").fill("from the east");
    await page.keyboard.press("Enter");
    const name = page.locator("#kept li input");
    assert.equal(await name.inputValue(), "from the east");
    await name.fill("east");
    await name.press("Tab");
    await page.locator("#save-close").click();
    await page.goto(`${shared.daemon.url}?again`);
    await finalPicture(page);
    assert.notEqual((await state(page)).step, "3");
    await page.keyboard.press("s");
    await page.getByRole("button", { name: "Open east" }).click();
    await page.waitForFunction(() => document.querySelector("#picture").dataset.step === "3");
    await finalPicture(page);
    assert.equal((await pixels(page)).hash, before.hash);
    await page.keyboard.press("s");
    await page.getByRole("button", { name: "Delete east" }).click();
    assert.equal(await page.locator("#kept li").count(), 0);
  }, linkTo(turned)));

test("renaming a view keeps its row, the focus and the button under the pointer", () =>
  withPage(async (page) => {
    await page.keyboard.press("s");
    for (const name of ["one", "two"]) {
      await page.locator("#keep-name").fill(name);
      await page.keyboard.press("Enter");
      await page.getByRole("button", { name: `Open ${name}` }).waitFor();
    }
    const name = page.locator("#kept li input").last();
    await name.fill("first");
    await name.press("Tab");
    const label = () => page.evaluate(() => document.activeElement.ariaLabel);
    assert.equal(await label(), "Open first");
    // One mouse press removes the focus from the name, which renames the view, and clicks a delete
    // button.
    await name.fill("other");
    await page.locator("#kept li button").last().click();
    assert.equal(await page.locator("#kept li").count(), 1);
    assert.equal(await page.locator("#kept li input").inputValue(), "two");
  }));

test("a link with a malformed view causes an alert and changes nothing", () =>
  withPage(
    async (page) => {
      const before = await pixels(page);
      for (const view of [
        { scalars: 5 },
        { vector: { magnitudeRange: 3 } },
        { camera: { eye: 5 } },
      ]) {
        await page.evaluate((hash) => (location.hash = hash), hashOf(view));
        await page
          .locator("#alert-text")
          .getByText(/no valid view/)
          .waitFor();
      }
      assert.equal((await pixels(page)).hash, before.hash);
    },
    { alert: true },
  ));

// A view whose link is longer than 2000 characters.
const long = {
  ...turned,
  scalars: [
    {
      field: "cloud",
      extinction: Array.from({ length: 64 }, (_, n) => [
        Number((0.2 + n / 97).toFixed(15)),
        Number((40 * Math.sin(n / 61) ** 2).toFixed(15)),
      ]),
    },
  ],
};

const share = async (page) => {
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await page.locator("#share-button").click();
  await page
    .locator("#status")
    .getByText(/link copied/)
    .waitFor();
  return page.evaluate(() => navigator.clipboard.readText());
};

test("Share copies the link, shortened if long, and the short link restores the same pixels", () =>
  withPage(async (page) => {
    assert.ok((await page.evaluate(() => location.href.length)) > 2000);
    const before = await pixels(page);
    const link = await share(page);
    assert.match(link, /\/a\/b\/#!view=[\w.~-]+$/);
    assert.ok(link.length < 200, link);
    await withPage(
      async (other) => {
        assert.equal((await pixels(other)).hash, before.hash);
        // The other page's address contains the whole view, so it remains valid after a server
        // restart.
        await other.waitForFunction(() => location.hash.startsWith("#!{"));
        assert.deepEqual((await addressView(other)).scalars, long.scalars);
      },
      { path: link.slice(shared.daemon.url.length) },
    );
  }, linkTo(long)));

test("Share copies the long link and shows the reason if the server stores no views", () =>
  withPage(async (page) => {
    const problem = { type: "about:blank", title: "No", status: 507, detail: "no room for views" };
    await page.route("**/v1/views", (route) => route.fulfill({ status: 507, json: problem }));
    const link = await share(page);
    assert.deepEqual(JSON.parse(decodeURIComponent(link.split("#!")[1])).scalars, long.scalars);
    assert.match(await page.locator("#status").textContent(), /long form: no room for views/);
    page.faults = page.faults.filter((fault) => !/507/.test(fault));
  }, linkTo(long)));

test("a short link to an unknown view causes an alert, and the default is shown", () =>
  withPage(
    async (page) => {
      assert.match(await page.locator("#alert-text").textContent(), /^The link's view: /);
      assert.equal(await page.locator("#dataset").inputValue(), "climate");
    },
    // The browser logs the 404 response.
    { path: "#!view=no-such-view", alert: true, faulty: true },
  ));
