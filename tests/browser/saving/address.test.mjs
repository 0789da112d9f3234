// The page's address with a link to a stored view, and dataset cards while their list is refreshed.
import assert from "node:assert/strict";
import { test } from "node:test";
import { drag, finalPicture, sharedDaemon } from "../support.mjs";

const { withPage } = sharedDaemon({ page: { viewport: { width: 900, height: 600 } } });

// Records every address that the page writes.
const watchAddress = () => {
  window.addresses = [];
  const { history } = window;
  const replace = history.replaceState.bind(history);
  history.replaceState = (state, title, url) => {
    window.addresses.push(url);
    replace(state, title, url);
  };
};

// The server never answers, and the page's time limit is shortened.
test("a stored view that fails to load shows the default and the reason", () => {
  const hurry = () => {
    const timeout = AbortSignal.timeout.bind(AbortSignal);
    AbortSignal.timeout = (ms) => timeout(ms / 20);
  };
  return withPage(
    async (page) => {
      assert.match(await page.locator("#alert-text").textContent(), /did not answer in time/);
      assert.equal(await page.locator("#dataset").inputValue(), "climate");
      // By now the page has had time to write its own changes (size, dataset) to the address.
      await page.setViewportSize({ width: 860, height: 580 });
      await finalPicture(page);
      await drag(page, 60, 10);
      await page.waitForFunction(() => window.addresses.length > 0);
      const addresses = await page.evaluate(() => window.addresses);
      assert.match(
        decodeURIComponent(addresses[0]),
        /"camera"/,
        "the address changes only with the user's edit",
      );
    },
    {
      path: "#!view=k7",
      alert: true,
      initScript: [watchAddress, hurry],
      prepare: (page) => page.route("**/v1/views/k7", () => {}),
    },
  );
});

test("a refreshed dataset list keeps cards, pictures and focus", () => {
  const previews = [];
  let release;
  const held = new Promise((resolve) => (release = resolve));
  return withPage(
    async (page) => {
      await page.keyboard.press("d");
      await page.waitForFunction(() => document.querySelectorAll(".card img").length === 3);
      await page.keyboard.press("ArrowRight");
      const focused = () => page.evaluate(() => document.activeElement.textContent);
      assert.match(await focused(), /^Global/);
      await page.evaluate(() => {
        window.oldCards = [...document.querySelectorAll(".card")];
      });
      release();
      await page.locator(".card", { hasText: "One more" }).waitFor();
      assert.match(await focused(), /^Global/);
      const same = await page.evaluate(() =>
        [...document.querySelectorAll(".card")].map((card) => window.oldCards.includes(card)),
      );
      assert.deepEqual(same, [true, true, false, true], "only the third card is new");
      await page.waitForFunction(() => document.querySelectorAll(".card img").length === 4);
      assert.equal(previews.length, 4, previews.join());
    },
    {
      prepare: async (page) => {
        await page.route(/\/v1\/datasets$/, async (route) => {
          await held;
          const { datasets } = await (await route.fetch()).json();
          const [a, b, c] = datasets.map((one) => ({ ...one, residentBytes: 12345 }));
          await route.fulfill({
            json: { datasets: [a, b, { ...c, title: "One more", id: "x" }, c] },
          });
        });
        await page.route(/\/frame\.jpg\?width=320&height=200$/, async (route) => {
          previews.push(route.request().url());
          const url = route.request().url().replace("/x/", "/efield/");
          await route.fulfill({ response: await route.fetch({ url }) });
        });
        await page.route(/\/v1\/datasets\/x$/, async (route) => {
          const url = route.request().url().replace("/x", "/efield");
          await route.fulfill({ response: await route.fetch({ url }) });
        });
      },
    },
  );
});
