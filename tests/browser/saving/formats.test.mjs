// Formats of saved pictures: JPEG, SVG and PDF at a size in millimetres, pixels and dots per inch.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import { patience, sharedDaemon, shot } from "../support.mjs";

const { withPage } = sharedDaemon({
  args: ["tornado"],
  page: { viewport: { width: 900, height: 600 } },
});

// The name and bytes of the file that these choices save.
async function saved(page, choices) {
  if (!(await page.locator("#save").isVisible())) await page.keyboard.press("s");
  for (const [id, value] of Object.entries(choices)) {
    const control = page.locator(`#save-${id}`);
    if (id === "legend") await control.setChecked(value);
    else if (["format", "scale"].includes(id)) await control.selectOption(value);
    else {
      await control.fill(String(value));
      await control.press("Tab");
    }
  }
  const [download] = await Promise.all([
    page.waitForEvent("download", { timeout: 60_000 * patience }),
    page.locator("#save-picture").click(),
  ]);
  const bytes = await readFile(await download.path());
  return { name: download.suggestedFilename(), bytes, text: bytes.toString("latin1") };
}

const aspect = async (page) => {
  const { width, height } = await page.locator("#picture").boundingBox();
  return height / width;
};

test("a PDF of 120 mm has that width on paper, and texts as texts", () =>
  withPage(async (page) => {
    const wanted = { format: "pdf", dpi: 200, scale: "mm", width: 120 };
    const { name, text } = await saved(page, wanted);
    assert.equal(name, "tornado-0-120mm.pdf");
    assert.ok(text.startsWith("%PDF-"));
    const box = text
      .match(/\/MediaBox\s*\[([^\]]*)\]/)[1]
      .trim()
      .split(/\s+/)
      .map(Number);
    // 120 mm are 340.16 points of 1/72 inch; pixels of 1/200 inch are 0.36 points
    assert.ok(Math.abs(box[2] - 340.16) < 0.36, String(box));
    assert.ok(Math.abs(box[3] / box[2] - (await aspect(page))) < 0.01, String(box));
    assert.match(text, /\/Type\s*\/Font\b/, "the legend and the title");
    // 120 mm at 200 dots to the inch are 944.9 pixels
    assert.match(await page.locator("#save-size").innerText(), /^945 × \d+ pixels, 120 × \d+ mm/);
    await shot(page, "save-pdf");
    const bare = await saved(page, { legend: false });
    assert.doesNotMatch(bare.text, /\/Type\s*\/Font\b/);
  }));

test("an SVG of 800 pixels contains the picture, and the legend as text if asked for", () =>
  withPage(async (page) => {
    const parts = (text) =>
      page.evaluate((source) => {
        const root = new DOMParser().parseFromString(source, "image/svg+xml").documentElement;
        return {
          root: root.nodeName,
          inches: root.getAttribute("width"),
          box: root.getAttribute("viewBox"),
          images: root.querySelectorAll("image").length,
          words: [...root.querySelectorAll("text")].map((one) => one.textContent),
        };
      }, text);
    const wanted = { format: "svg", scale: "px", width: 800, dpi: 100 };
    const { name, bytes } = await saved(page, wanted);
    assert.equal(name, "tornado-0-800px.svg");
    const { words, ...rest } = await parts(bytes.toString("utf8"));
    const height = Math.floor(800 * (await aspect(page)) + 1e-6);
    assert.deepEqual(rest, { root: "svg", inches: "8.00in", box: `0 0 800 ${height}`, images: 1 });
    assert.ok(words.includes("Tornado test function"), words.join());
    const bare = await saved(page, { legend: false });
    assert.deepEqual((await parts(bare.bytes.toString("utf8"))).words, []);
  }));

test("a JPEG has the chosen size and dots per inch, with and without the legend", () =>
  withPage(async (page) => {
    for (const legend of [true, false]) {
      const { name, bytes } = await saved(page, { format: "jpeg", scale: "1", dpi: 150, legend });
      assert.equal(name, "tornado-0-1x.jpg");
      assert.equal(bytes.toString("latin1", 6, 10), "JFIF");
      assert.deepEqual([bytes[13], bytes.readUInt16BE(14), bytes.readUInt16BE(16)], [1, 150, 150]);
      const seen = await page.evaluate(async (text) => {
        const file = new Blob([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))]);
        const { width, height } = await createImageBitmap(file);
        const { clientWidth, clientHeight } = document.querySelector("#picture");
        return [width - clientWidth, height - clientHeight];
      }, bytes.toString("base64"));
      assert.deepEqual(seen, [0, 0]);
    }
  }));
