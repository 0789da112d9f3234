// Members and reference times of a forecast ensemble, as netCDF4 for Python writes it: choosing
// them on the page, by mouse and keyboard, links to them, and a server that does not allow it.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { mkdtempSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { drag, finalPicture, launch, ownPage, pixels, shot, state } from "./support.mjs";

const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

// 51 members, 2 reference times, 3 lead times. The temperature of each is a wave whose phase
// follows from member and reference time.
const writeEnsemble = `
import sys, netCDF4, numpy
with netCDF4.Dataset(sys.argv[1], "w") as file:
    def axis(name, values, units="", standard_name=""):
        file.createDimension(name, len(values))
        variable = file.createVariable(name, "f8", (name,))
        variable[:] = values
        variable.units = units
        if standard_name:
            variable.standard_name = standard_name
    axis("number", range(51), "1", "realization")
    axis("reftime", [0, 24], "hours since 2001-01-01", "forecast_reference_time")
    axis("leadtime", [0, 6, 12], "hours", "forecast_period")
    axis("lev", [1000, 850, 500, 250], "hPa", "air_pressure")
    axis("lat", numpy.linspace(-60, 60, 13), "degrees_north")
    axis("lon", numpy.arange(0, 360, 15), "degrees_east")
    lon, lat = numpy.radians(file["lon"][:]), numpy.radians(file["lat"][:])
    number, run = numpy.arange(51), numpy.arange(2)
    phase = 0.12 * number[:, None] + 1.5 * run[None, :]
    wave = numpy.cos(3 * lon[None, None, None, :] - phase[:, :, None, None]) \\
        * numpy.cos(lat)[None, None, :, None]
    shape = (51, 2, 3, 4, 13, 24)
    names = ("number", "reftime", "leadtime", "lev", "lat", "lon")
    temperature = file.createVariable("t", "f4", names)
    temperature.units = "K"
    temperature[:] = numpy.broadcast_to(280 + 20 * wave[:, :, None, None, :, :], shape)
`;

let browser;
let folder;
let file;

before(async () => {
  browser = await launch();
  folder = mkdtempSync(join(tmpdir(), "windsplat-entries-"));
  file = join(folder, "ens.nc");
  execFileSync("/usr/bin/python3", ["-c", writeEnsemble, file]);
});

after(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true, force: true });
});

const entry = (page, name) => page.getByLabel(name, { exact: true });

// Waits until the dataset is shown, whose entries the lists then name.
async function shows(page, id, values) {
  await page.waitForFunction((wanted) => document.querySelector("#dataset").value === wanted, id);
  await finalPicture(page);
  const shown = await page.evaluate(() =>
    [...document.querySelectorAll("#entries select")].map((select) => [
      select.labels[0].textContent,
      select.value,
    ]),
  );
  assert.deepEqual(Object.fromEntries(shown), values);
}

const [first, second] = ["2001-01-01T00:00:00Z", "2001-01-02T00:00:00Z"];

test("members are chosen with camera and settings kept, and undone", async (t) => {
  const { page, daemon } = await ownPage(t, browser, { args: [file] });
  await shows(page, "ens", { number: "0", reftime: first });
  assert.equal(await entry(page, "number").locator("option").count(), 51);
  assert.deepEqual(await entry(page, "reftime").locator("option").allTextContents(), [
    "2001-01-01 00:00Z",
    "2001-01-02 00:00Z",
  ]);
  await drag(page, 120, 40);
  await page.keyboard.press("]");
  await finalPicture(page);
  const before = { ...(await state(page)), ...(await pixels(page)) };
  assert.match(await page.locator("#time-label").textContent(), /2001-01-01 06:00Z/);

  await entry(page, "number").selectOption("13");
  await shows(page, "ens,number=13", { number: "13", reftime: first });
  const thirteenth = { ...(await state(page)), ...(await pixels(page)) };
  for (const key of ["azimuth", "elevation", "distance", "step"]) {
    assert.equal(thirteenth[key], before[key], key);
  }
  assert.notEqual(thirteenth.hash, before.hash, "another member is another picture");

  await entry(page, "reftime").press("Shift"); // another key begins another undo entry
  await entry(page, "reftime").selectOption(second);
  await shows(page, `ens,number=13,reftime=${second}`, { number: "13", reftime: second });
  assert.match(await page.locator("#time-label").textContent(), /2001-01-02 06:00Z/);
  assert.equal((await pixels(page)).hash === thirteenth.hash, false);
  assert.equal(await page.locator("#dataset option").count(), 2, "the list does not fill up");
  await shot(page, "entries-dark");

  await page.locator("#undo-button").click();
  await shows(page, "ens,number=13", { number: "13", reftime: first });
  assert.equal((await pixels(page)).hash, thirteenth.hash);
  await page.locator("#undo-button").click();
  await shows(page, "ens", { number: "0", reftime: first });
  assert.equal((await pixels(page)).hash, before.hash);

  const link = `${daemon.url}#!${encodeURIComponent(JSON.stringify({ dataset: "ens,number=49" }))}`;
  await page.goto("about:blank");
  await page.goto(link);
  await shows(page, "ens,number=49", { number: "49", reftime: first });
  assert.deepEqual(page.faults, []);
});

test("the keyboard steps through members, and a restarted server opens them again", async (t) => {
  const { page, daemon } = await ownPage(t, browser, {
    args: [file],
    colorScheme: "light",
    viewport: { width: 390, height: 844 },
  });
  await shows(page, "ens", { number: "0", reftime: first });
  await entry(page, "number").focus();
  for (const number of ["1", "2"]) {
    await page.keyboard.press("ArrowDown");
    await shows(page, `ens,number=${number}`, { number, reftime: first });
  }
  const focused = await page.evaluate(() => document.activeElement.labels?.[0].textContent);
  assert.equal(focused, "number", "the control keeps the focus");
  await shot(page, "entries-phone");
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() =>
    window.axe.run(document.querySelector("#panel"), { resultTypes: ["violations"] }),
  );
  assert.deepEqual(violations, []);

  const { hash } = await pixels(page);
  await daemon.kill();
  await daemon.start(file);
  await page.waitForFunction(
    () =>
      document.querySelector("#picture").dataset.state === "final" &&
      document.documentElement.dataset.connection === "live",
  );
  await shows(page, "ens,number=2", { number: "2", reftime: first });
  assert.equal((await pixels(page)).hash, hash);
});

test("a server with fixed entries disables the choice and says why", async (t) => {
  const { page } = await ownPage(t, browser, { args: ["--fixed-entries", `${file}?number=7`] });
  await shows(page, "ens,number=7", { number: "7", reftime: first });
  const { hash } = await pixels(page);
  await entry(page, "number").selectOption("8");
  await page.locator("#alert").waitFor();
  await shows(page, "ens,number=7", { number: "7", reftime: first });
  assert.equal(await entry(page, "number").isDisabled(), true);
  assert.match(await page.locator("#entries .entry").first().getAttribute("title"), /disabled/);
  assert.match(await page.locator("#entries").textContent(), /--fixed-entries/);
  assert.equal((await pixels(page)).hash, hash);
  await shot(page, "entries-fixed");
});
