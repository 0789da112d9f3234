// The report of `windsplat study`, opened from disk in a real browser.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { launch, openPage, screenshots } from "./support.mjs";

const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const folder = mkdtempSync(join(tmpdir(), "windsplat-report-"));
const addressOf = (folder) => pathToFileURL(join(folder, "index.html")).href;
let browser, study;

before(async () => {
  const scenes = ["--scene", "vectors", "--scene", "climate"];
  const words = ["study", "--quick", "--no-reference", ...scenes, "-o", folder];
  execFileSync(process.env.WINDSPLAT_PROGRAM, words, { stdio: "pipe" });
  study = JSON.parse(readFileSync(join(folder, "study.json"), "utf8"));
  browser = await launch();
});

after(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true, force: true });
});

async function withReport(run, { address = addressOf(folder), ...options } = {}) {
  const requests = [];
  const prepare = (page) => page.on("request", (request) => requests.push(request.url()));
  const page = await openPage(browser, address, { colorScheme: "light", prepare, ...options });
  try {
    await run(page);
    assert.deepEqual(page.faults, [], "no errors in the browser's console");
    const loaded = requests.filter((url) => !url.startsWith("data:"));
    assert.deepEqual(loaded, [address], "nothing else is loaded");
  } finally {
    await page.context().close();
  }
}

const rowsOf = (page, caption) =>
  page
    .locator("table", { has: page.locator("caption", { hasText: caption }) })
    .evaluateAll((tables) =>
      tables.map((table) =>
        [...table.tBodies[0].rows].map((row) => [...row.cells].map((cell) => cell.textContent)),
      ),
    );

// Centres of marks relative to the frame of a figure: 0 to 1 from its left and lower edges.
const marksOf = (figure, selector) =>
  figure.evaluate((element, selector) => {
    const frame = element.querySelector('[data-label="frame"]').getBoundingClientRect();
    return [...element.querySelectorAll(selector)].map((mark) => {
      const box = mark.getBoundingClientRect();
      return [
        (box.x + box.width / 2 - frame.x) / frame.width,
        (frame.bottom - box.y - box.height / 2) / frame.height,
      ];
    });
  }, selector);

const isWithin = ([x, y]) => x >= -0.005 && x <= 1.005 && y >= -0.005 && y <= 1.005;

test("figures contain a mark for every point, within the frame and in order", () =>
  withReport(async (page) => {
    const figures = page.locator("figure.plot");
    const titles = await figures
      .locator("svg")
      .evaluateAll((all) => all.map((svg) => svg.ariaLabel));
    assert.deepEqual(titles, [
      "vectors: error against run time of every method",
      "climate: error against run time of every method",
      "climate: reported against true errors",
    ]);
    for (const [n, scene] of study.scenes.entries()) {
      const figure = figures.nth(n);
      const marks = await marksOf(figure, ".point > *");
      assert.equal(marks.length, scene.points.length);
      assert.ok(marks.every(isWithin), JSON.stringify(marks));
      const rings = await marksOf(figure, ".pareto > *");
      assert.equal(rings.length, scene.points.filter(({ pareto }) => pareto).length);
      // Along the Pareto front the error decreases as the time increases.
      rings.sort(([a], [b]) => a - b);
      assert.ok(rings.every(([, y], i) => i === 0 || y <= rings[i - 1][1] + 1e-3));
      const labels = await figure.locator("svg text").allTextContents();
      assert.ok(labels.includes("Run time, median (ms)"), labels);
      assert.ok(labels.includes("Error, RMS of linear RGBA"), labels);
      assert.ok(
        labels.some((label) => label.startsWith("slab analytic, slabThickness")),
        labels,
      );
    }
    const { points, measured } = study.scenes[1].calibration;
    const compared = await marksOf(figures.nth(2), ".point > *");
    assert.equal(compared.length, points.length + measured.length);
    assert.ok(compared.every(isWithin));
    await page.screenshot({ path: join(screenshots, "report.png"), fullPage: true });
  }));

test("marks stand at the values on logarithmic axes", () =>
  withReport(async (page) => {
    const figure = page.locator("figure.plot").nth(1);
    const found = await figure.evaluate((element) => {
      const middle = (mark, from, size) => {
        const box = mark.getBoundingClientRect();
        return box[from] + box[size] / 2;
      };
      const labels = [...element.querySelectorAll('[data-label="x-axis tick label"] text')];
      return {
        ticks: labels.map((label) => [Number(label.textContent), middle(label, "x", "width")]),
        points: [...element.querySelectorAll(".point > *")].map((mark) => [
          Number(/, ([\d.]+) ms/.exec(mark.dataset.label)[1]),
          middle(mark, "x", "width"),
        ]),
      };
    });
    const [[low, left]] = found.ticks;
    const [high, right] = found.ticks.at(-1);
    assert.ok(high > low);
    for (const [ms, x] of found.points) {
      const expected = left + ((right - left) * Math.log(ms / low)) / Math.log(high / low);
      assert.ok(Math.abs(x - expected) < 3, `${ms} ms at ${x}, not ${expected}`);
    }
  }));

test("tables contain the numbers of study.json", () =>
  withReport(async (page) => {
    const points = await rowsOf(page, "all points");
    for (const [n, scene] of study.scenes.entries()) {
      const expected = scene.points
        .map((point) => [
          `${point.method} ${point.compositing}`,
          point.rmse.toExponential(2),
          point.ms.toFixed(2),
        ])
        .sort();
      assert.deepEqual(points[n].map((row) => [row[0], row[6], row[10]]).sort(), expected);
      const errors = points[n].map((row) => Number(row[6]));
      assert.deepEqual(
        errors,
        [...errors].sort((a, b) => a - b),
      );
    }
    const agreement = await rowsOf(page, "agreement of reported");
    const [estimated] = study.scenes[1].calibration.agreement;
    const share = `${(100 * estimated.withinTwo).toFixed(1)} %`;
    assert.deepEqual(agreement[0][0].slice(0, 3), [
      "all estimates",
      String(estimated.count),
      share,
    ]);
    const [stability] = await rowsOf(page, "Stability");
    assert.equal(stability.length, study.stability.length);
    const [summary] = await rowsOf(page, "Both methods");
    const own = study.scenes[1].points.find((point) => point.own && point.method === "slab");
    assert.equal(summary[1][3], own.rmse.toExponential(2));
  }));

test("a report of extreme cases states where each method may be trusted", () => {
  const own = join(folder, "extremes");
  const words = ["study", "--extremes", "--group", "opacity", "-o", own];
  execFileSync(process.env.WINDSPLAT_PROGRAM, words, { stdio: "pipe" });
  const { cases, trust } = JSON.parse(readFileSync(join(own, "study.json"), "utf8")).extremes;
  return withReport(
    async (page) => {
      assert.equal(await page.title(), "windsplat: extreme cases");
      assert.equal(await page.locator("#stability").count(), 0);
      const [trusted] = await rowsOf(page, "may be trusted");
      assert.deepEqual(
        trusted.map((row) => [row[0], row[1], ...row.slice(5, 7)]),
        trust.map((one) => [one.group, one.method, ...one.within.map(({ values }) => values)]),
      );
      const [listed] = await rowsOf(page, "opacity: every case");
      assert.deepEqual(
        listed.map((row) => [row[0], row[6], row[7]]),
        cases.map((one) => [one.label, one.outcome, one.truth ?? ""]),
      );
      // An opacity of 0 is not on a logarithmic axis.
      const drawn = cases.filter(({ outcome, value }) => outcome !== "refused" && value > 0);
      const marks = await marksOf(page.locator("figure.plot"), ".point > *");
      assert.equal(marks.length, drawn.length);
      assert.ok(marks.every(isWithin), JSON.stringify(marks));
      await page.screenshot({ path: join(screenshots, "extremes.png"), fullPage: true });
    },
    { address: addressOf(own) },
  );
});

test("pictures are shown and the pointer names a point", () =>
  withReport(async (page) => {
    const sizes = await page
      .locator(".pictures img")
      .evaluateAll((images) => images.map((image) => [image.naturalWidth, image.naturalHeight]));
    const [vectors, climate] = study.scenes.map(({ reference }) => [
      reference.width,
      reference.height,
    ]);
    assert.deepEqual(sizes[0], vectors);
    assert.deepEqual(sizes.at(-1), climate);
    const figure = page.locator("figure.plot").nth(1);
    await figure.locator(".point > *").first().hover({ force: true });
    const tip = figure.locator('[aria-label="tip"] text');
    await tip.waitFor();
    assert.match(await tip.textContent(), /(kernel|slab) .*error .*ms/s);
  }));

test("a figure can be saved as SVG", () =>
  withReport(async (page) => {
    const saved = page.waitForEvent("download");
    await page.getByRole("button", { name: "Save as SVG" }).nth(1).click();
    const download = await saved;
    assert.equal(download.suggestedFilename(), "plot-climate.svg");
    const text = readFileSync(await download.path(), "utf8");
    assert.match(text, /^<svg [^>]*xmlns="http:\/\/www\.w3\.org\/2000\/svg"/);
    assert.match(text, /Pareto front/);
  }));

for (const [name, viewport] of Object.entries({
  window: { width: 1440, height: 900 },
  phone: { width: 390, height: 844 },
})) {
  test(`axe reports no violation: ${name}`, () =>
    withReport(
      async (page) => {
        for (const details of await page.locator("details").all()) {
          await details.evaluate((element) => (element.open = true));
        }
        await page.evaluate(axe);
        const found = await page.evaluate(() => window.axe.run(document));
        const violations = found.violations.map(({ id, nodes }) => [id, nodes[0].html]);
        assert.deepEqual(violations, []);
      },
      { viewport },
    ));
}

test("without JavaScript the report refers to the file with its numbers", () =>
  withReport(
    async (page) => {
      const words = await page.locator("body").innerText();
      assert.match(words, /need JavaScript.*study\.csv/s);
    },
    { javaScriptEnabled: false },
  ));
