// Files of the Save dialog, checked with independent decoders: pictures against the browser and the
// server's own frames, ZIP files with Python, videos with a <video> element; and the views that
// they contain.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import {
  finalPicture,
  patience,
  pixels,
  screenshots,
  sharedDaemon,
  shot,
  state,
} from "../support.mjs";

const shared = sharedDaemon({ basePath: "/a/b/", page: { viewport: { width: 900, height: 600 } } });
const { withPage } = shared;

const hashOf = (view) => `#!${encodeURIComponent(JSON.stringify(view))}`;
const linkTo = (view) => ({ path: hashOf(view) });

// The name and bytes of the file that the button saves.
async function saved(page, button) {
  const [download] = await Promise.all([
    page.waitForEvent("download", { timeout: 120_000 * patience }),
    page.locator(button).click(),
  ]);
  return { name: download.suggestedFilename(), bytes: await readFile(await download.path()) };
}

async function savePicture(page, scale, legend = true) {
  if (!(await page.locator("#save").isVisible())) await page.keyboard.press("s");
  await page.locator("#save-scale").selectOption(String(scale));
  await page.locator("#save-legend").setChecked(legend);
  return saved(page, "#save-picture");
}

// The pixels of a PNG or JPEG, decoded by the browser.
const decoded = (page, bytes) =>
  page.evaluate(async (text) => {
    const file = new Blob([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))]);
    const bitmap = await createImageBitmap(file, { colorSpaceConversion: "none" });
    const { width, height } = bitmap;
    const context = new OffscreenCanvas(width, height).getContext("2d", { alpha: false });
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(0, 0, width, height);
    let word = "";
    for (let n = 0; n < data.length; n += 30_000) {
      word += String.fromCharCode(...data.subarray(n, n + 30_000));
    }
    return { width, height, data: btoa(word) };
  }, bytes.toString("base64"));

const decode = async (page, bytes) => {
  const { width, height, data } = await decoded(page, bytes);
  return { width, height, data: Buffer.from(data, "base64") };
};

// The bounding box of the differing pixels; null: none differ.
function difference(a, b) {
  assert.deepEqual([a.width, a.height], [b.width, b.height]);
  let box = null;
  let count = 0;
  for (let n = 0; n < a.width * a.height; n++) {
    if (a.data.compare(b.data, 4 * n, 4 * n + 4, 4 * n, 4 * n + 4) === 0) continue;
    const [x, y] = [n % a.width, Math.floor(n / a.width)];
    count += 1;
    box ??= { left: x, right: x, top: y, bottom: y };
    box.left = Math.min(box.left, x);
    box.right = Math.max(box.right, x);
    box.bottom = y;
  }
  return box === null ? null : { ...box, count };
}

// The view in a PNG, read without the page's code.
function viewIn(bytes) {
  const text = execFileSync(
    "python3",
    [
      "-c",
      `
import struct, sys, zlib
data, at, found = sys.stdin.buffer.read(), 8, []
while at < len(data):
    (length,) = struct.unpack(">I", data[at:at + 4])
    body = data[at + 4:at + 8 + length]
    assert struct.unpack(">I", data[at + 8 + length:at + 12 + length])[0] == zlib.crc32(body)
    if body.startswith(b"iTXtwindsplat-view\\0\\0\\0\\0\\0"):
        found.append(body[23:])
    at += 12 + length
assert len(found) == 1
sys.stdout.buffer.write(found[0])
`,
    ],
    { input: bytes, encoding: "utf8" },
  );
  return JSON.parse(text);
}

async function drawn(view) {
  const answer = await fetch(`${shared.daemon.url}v1/frames`, {
    method: "POST",
    headers: { "Content-Type": "application/json", Accept: "image/png" },
    body: JSON.stringify(view),
  });
  assert.equal(answer.status, 200);
  return Buffer.from(await answer.arrayBuffer());
}

async function drop(page, bytes, name = "picture.png") {
  const transfer = await page.evaluateHandle(
    ([text, name]) => {
      const data = new DataTransfer();
      data.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
      return data;
    },
    [bytes.toString("base64"), name],
  );
  await page.dispatchEvent("#picture", "dragover", { dataTransfer: transfer });
  assert.ok(
    await page.locator("#drop-hint").isVisible(),
    "a hint is shown while the file is over the page",
  );
  await page.dispatchEvent("#picture", "drop", { dataTransfer: transfer });
  assert.equal(await page.locator("#drop-hint").isVisible(), false);
}

const addressView = (page) =>
  page.evaluate(() => JSON.parse(decodeURIComponent(location.hash.slice(2))));

const turned = { dataset: "climate", step: 3, camera: { eye: [2, -2, 1], target: [0, 0, 0.1] } };

test("a saved picture is n times as large as the view and contains the view", () =>
  withPage(async (page) => {
    const size = await page.locator("#picture").evaluate((c) => [c.clientWidth, c.clientHeight]);
    for (const scale of [1, 2]) {
      const { name, bytes } = await savePicture(page, scale, false);
      assert.equal(name, `climate-3-${scale}x.png`);
      const picture = await decode(page, bytes);
      assert.deepEqual([picture.width, picture.height], [scale * size[0], scale * size[1]]);
      const view = viewIn(bytes);
      assert.deepEqual(view.camera, turned.camera);
      assert.deepEqual(
        { ...view, image: undefined },
        { ...(await addressView(page)), image: undefined },
        "the file contains the page's view",
      );
      assert.equal(difference(picture, await decode(page, await drawn(view))), null);
    }
    await shot(page, "save-dark");
  }, linkTo(turned)));

test("a saved picture contains the visible legend at every scale", () =>
  withPage(async (page) => {
    const stage = await page.locator("#picture").boundingBox();
    const legend = await page.locator("#legend").boundingBox();
    for (const scale of [1, 2]) {
      const plain = await decode(page, (await savePicture(page, scale, false)).bytes);
      const { bytes } = await savePicture(page, scale, true);
      const box = difference(plain, await decode(page, bytes));
      assert.notEqual(box, null);
      // Only the legend and the line above it differ; tolerance one CSS pixel.
      const inPage = (pixels) => pixels / scale;
      assert.ok(Math.abs(inPage(box.left) - 10) <= 1, `left ${box.left}`);
      assert.ok(Math.abs(inPage(box.right + 1) - (legend.x - stage.x + legend.width)) <= 2);
      assert.ok(Math.abs(inPage(box.bottom + 1) - (stage.height - 10)) <= 1, `${box.bottom}`);
      const top = legend.y - stage.y;
      assert.ok(inPage(box.top) > top - 50 && inPage(box.top) < top, `${box.top}`);
      assert.deepEqual(viewIn(bytes).step, 3);
      if (scale === 2) await writeFile(join(screenshots, "saved-2x.png"), bytes);
    }
  }, linkTo(turned)));

test("a picture dropped on another page restores its view exactly", async () => {
  let bytes;
  let before;
  await withPage(
    async (page) => {
      before = await pixels(page);
      ({ bytes } = await savePicture(page, 2));
    },
    linkTo({ ...turned, vector: { field: null } }),
  );
  for (const path of ["", hashOf({ dataset: "tornado", vector: { field: "wind", length: 0.2 } })]) {
    await withPage(
      async (page) => {
        assert.notEqual((await pixels(page)).hash, before.hash);
        await drop(page, bytes);
        await page.waitForFunction(() => document.querySelector("#picture").dataset.step === "3");
        await finalPicture(page);
        assert.equal((await pixels(page)).hash, before.hash);
        assert.equal(await page.locator("#alert").isVisible(), false);
      },
      { path },
    );
  }
  await withPage(async (page) => {
    await page.keyboard.press("s");
    await page.locator("#picture-file").setInputFiles({
      name: "a.png",
      mimeType: "image/png",
      buffer: bytes,
    });
    await page.waitForFunction(() => document.querySelector("#picture").dataset.step === "3");
    await finalPicture(page);
    assert.equal(await page.locator("#save").isVisible(), false);
    assert.equal((await pixels(page)).hash, before.hash);
  });
});

test("a file without a view causes an alert, and the view is unchanged", () =>
  withPage(
    async (page) => {
      const before = await pixels(page);
      for (const [bytes, words] of [
        [await drawn({ ...turned, image: { width: 32, height: 32 } }), /contains no view/],
        [Buffer.from("just a text of some length"), /not a PNG/],
      ]) {
        await drop(page, bytes);
        await page.locator("#alert-text").getByText(words).waitFor();
      }
      assert.equal((await pixels(page)).hash, before.hash);
    },
    { alert: true },
  ));

const pythonZip = `
import base64, json, sys, zipfile
z = zipfile.ZipFile(sys.argv[1])
assert z.testzip() is None
json.dump([[n, base64.b64encode(z.read(n)).decode()] for n in z.namelist()], sys.stdout)
`;

async function filesIn(page, bytes) {
  const folder = await mkdtemp(join(tmpdir(), "windsplat-"));
  try {
    await writeFile(`${folder}/a.zip`, bytes);
    const text = execFileSync("python3", ["-c", pythonZip, `${folder}/a.zip`], {
      maxBuffer: 1 << 28,
      encoding: "utf8",
    });
    return JSON.parse(text).map(([name, data]) => [name, Buffer.from(data, "base64")]);
  } finally {
    await rm(folder, { recursive: true });
  }
}

// The panel's small pictures of views are no frames of an animation.
const isFrame = (one) => one.url().endsWith("/v1/frames") && one.postDataJSON().image.width > 192;

async function setAnimation(page, choices) {
  await page.keyboard.press("s");
  await page.locator("#save-scale").selectOption("1");
  for (const [id, value] of Object.entries(choices)) {
    const control = page.locator(`#save-${id}`);
    if (["over", "as"].includes(id)) await control.selectOption(value);
    else if (id === "legend") await control.setChecked(value);
    else {
      await control.fill(String(value));
      await control.press("Tab");
    }
  }
}

test("an animation over steps is a ZIP of the right frames, requested two at a time", () =>
  withPage(async (page) => {
    let under = 0;
    let most = 0;
    page.on("request", (one) => isFrame(one) && (most = Math.max(most, ++under)));
    page.on("requestfinished", (one) => isFrame(one) && (under -= 1));
    await setAnimation(page, { from: 2, to: 7, every: 2, legend: false, fps: 5 });
    assert.match(await page.locator("#save-about").textContent(), /^3 frames of .*, 0\.6 s\./);
    const { name, bytes } = await saved(page, "#save-animation");
    assert.equal(name, "climate-steps.zip");
    assert.ok(most <= 2, `${most} at once`);
    const files = await filesIn(page, bytes);
    assert.deepEqual(
      files.map(([file]) => file),
      [0, 1, 2].map((n) => `climate-steps-000${n}.png`),
    );
    const pictures = [];
    for (const [n, [, file]] of files.entries()) {
      const view = viewIn(file);
      assert.equal(view.step, 1 + 2 * n, "the dialog counts from 1, as the player");
      pictures.push(await decode(page, file));
      assert.equal(difference(pictures[n], await decode(page, await drawn(view))), null);
    }
    assert.notEqual(difference(pictures[0], pictures[1]), null);
    assert.notEqual(difference(pictures[1], pictures[2]), null);
  }));

test("one orbit shows the volume from all sides", () =>
  withPage(
    async (page) => {
      await setAnimation(page, { over: "turn", legend: false, frames: 4 });
      const files = await filesIn(page, (await saved(page, "#save-animation")).bytes);
      assert.equal(files.length, 4);
      const start = viewIn(files[0][1]).camera.eye;
      const half = viewIn(files[2][1]).camera;
      assert.ok(Math.abs(half.eye[0] - (2 * half.target[0] - start[0])) < 1e-6);
      assert.ok(Math.abs(half.eye[1] - (2 * half.target[1] - start[1])) < 1e-6);
      assert.ok(Math.abs(half.eye[2] - start[2]) < 1e-6);
      const [a, b] = [await decode(page, files[0][1]), await decode(page, files[2][1])];
      assert.notEqual(difference(a, b), null);
    },
    linkTo({ dataset: "tornado" }),
  ));

// Times in ms of the pictures in a WebM file, by a reader of this test (RFC 9559): clusters within
// the segment, blocks of track 1 within the clusters.
function timesInWebm(bytes) {
  const times = [];
  const number = (at, keep) => {
    const length = Math.clz32(bytes[at]) - 23;
    let value = keep ? bytes[at] : bytes[at] & (0xff >> length);
    for (let n = 1; n < length; n++) value = 256 * value + bytes[at + n];
    return [value, at + length];
  };
  const walk = (from, to, cluster) => {
    for (let at = from; at < to;) {
      const [id, afterId] = number(at, true);
      const [size, start] = number(afterId, false);
      if (id === 0x18538067 || id === 0x1f43b675) walk(start, start + size, { ms: 0 });
      if (id === 0xe7) cluster.ms = Number(`0x${bytes.toString("hex", start, start + size)}`);
      if (id === 0xa3) times.push(cluster.ms + bytes.readInt16BE(start + 1));
      at = start + size;
    }
  };
  walk(0, bytes.length, null);
  return times;
}

test("a WebM video has every frame, each at its time", () =>
  withPage(async (page) => {
    const wanted = { over: "turn", as: "webm", frames: 12, fps: 7 };
    await setAnimation(page, wanted);
    assert.match(await page.locator("#save-about").innerText(), /^12 frames of/);
    const { bytes } = await saved(page, "#save-animation");
    assert.deepEqual(
      timesInWebm(bytes),
      Array.from({ length: 12 }, (_, n) => Math.round((1000 * n) / 7)),
    );
  }));

test("without an encoder of videos the page offers the ZIP only", () =>
  withPage(
    async (page) => {
      await page.keyboard.press("s");
      const webm = page.locator('#save-as option[value="webm"]');
      assert.equal(await webm.evaluate((option) => option.disabled), true);
      assert.match(await webm.textContent(), /needs WebCodecs/);
      assert.equal(await page.locator("#save-as").inputValue(), "zip");
    },
    { initScript: () => delete window.VideoEncoder },
  ));

test("a WebM video has the size and duration of its frames", () =>
  withPage(async (page) => {
    await setAnimation(page, { as: "webm", to: 6, fps: 4 });
    const { name, bytes } = await saved(page, "#save-animation");
    assert.equal(name, "climate-steps.webm");
    assert.equal(timesInWebm(bytes).length, 6);
    assert.equal(bytes.subarray(0, 4).toString("hex"), "1a45dfa3", "EBML signature");
    const size = await page.locator("#picture").evaluate((c) => [c.clientWidth, c.clientHeight]);
    // The content security policy of the page forbids media, so the video plays on a blank page.
    const theatre = await page.context().newPage();
    const played = await theatre.evaluate(async (text) => {
      const video = document.createElement("video");
      document.body.append(video);
      video.muted = true;
      const file = new Blob([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))]);
      video.src = URL.createObjectURL(file);
      const canvas = new OffscreenCanvas(64, 64).getContext("2d");
      const seen = new Set();
      const look = () => {
        canvas.drawImage(video, 0, 0, 64, 64);
        seen.add(String(canvas.getImageData(0, 0, 64, 64).data));
        video.requestVideoFrameCallback(look);
      };
      video.requestVideoFrameCallback(look);
      await video.play();
      await new Promise((done) => (video.onended = done));
      return {
        size: [video.videoWidth, video.videoHeight],
        time: video.currentTime,
        seen: seen.size,
      };
    }, bytes.toString("base64"));
    assert.deepEqual(played.size, size);
    assert.ok(Math.abs(played.time - 1.5) < 0.05, `${played.time} s for 6 frames at 4 frames/s`);
    assert.ok(played.seen >= 4, `${played.seen} pictures of 6 steps`);
  }));

test("cancel stops the requests and saves nothing", () =>
  withPage(async (page) => {
    const asked = [];
    const failed = [];
    page.on("requestfailed", (one) => isFrame(one) && failed.push(one));
    page.on("download", () => assert.fail("no file may be saved"));
    // The server answers the first request and delays the others.
    await page.route("**/v1/frames", (route) => {
      if (!isFrame(route.request())) return route.continue();
      asked.push(route.request());
      return asked.length === 1 ? route.continue() : undefined;
    });
    await setAnimation(page, { from: 1, to: 8 });
    await page.locator("#save-animation").click();
    await page
      .locator("#save-progress")
      .getByText(/frame 1 of 8, \d+ s left/)
      .waitFor();
    assert.ok(Math.abs((await page.locator("#save-bar").evaluate((b) => b.value)) - 1 / 8) < 1e-6);
    assert.ok(await page.locator("#save-picture").isDisabled());
    await page.keyboard.press("Escape");
    await page.locator("#save-said").getByText("Cancelled.").waitFor();
    assert.ok(await page.locator("#save").isVisible(), "the dialog remains open");
    await page.waitForFunction(() => document.querySelector("#save-job").hidden);
    assert.equal(asked.length, 3, "no further frame is requested");
    while (failed.length < 2) await page.waitForEvent("requestfailed");
    assert.ok(await page.locator("#save-picture").isEnabled());
    await page.locator("#save-close").click();
    page.faults = page.faults.filter((fault) => !/net::ERR_/.test(fault));
  }));

test("an error of the server is shown in the dialog", () =>
  withPage(async (page) => {
    let tries = 0;
    await page.route("**/v1/frames", (route) => {
      if (!isFrame(route.request())) return route.continue();
      tries += 1;
      const busy = tries === 1;
      return route.fulfill({
        status: busy ? 429 : 507,
        headers: busy ? { "Retry-After": "1" } : {},
        json: { type: "about:blank", title: "No", status: 507, detail: "needs 9 GB of memory" },
      });
    });
    await page.keyboard.press("s");
    await page.locator("#save-picture").click();
    await page.locator("#save-error").getByText("needs 9 GB of memory").waitFor();
    assert.equal(tries, 2, "retried when busy, not when refused");
    page.faults = page.faults.filter((fault) => !/429|507/.test(fault));
  }));

test("shortcuts are disabled while a dialog is open", () =>
  withPage(async (page) => {
    await page.keyboard.press("s");
    await page.evaluate(() => document.activeElement.blur());
    assert.equal(await page.evaluate(() => document.activeElement === document.body), true);
    const before = await state(page);
    await page.keyboard.press("ArrowLeft");
    await page.keyboard.press("]");
    await finalPicture(page);
    const after = await state(page);
    assert.deepEqual([after.azimuth, after.step], [before.azimuth, before.step]);
    await page.keyboard.press("Escape");
    await page.locator("#save").waitFor({ state: "hidden" });
    await page.keyboard.press("ArrowLeft");
    await finalPicture(page);
    assert.notEqual(
      (await state(page)).azimuth,
      before.azimuth,
      "shortcuts work after the dialog is closed",
    );
  }));

test("the dialog fits a phone in both themes and works by keyboard", async () => {
  for (const colorScheme of ["dark", "light"]) {
    await withPage(
      async (page) => {
        await page.locator("#save-button").focus();
        await page.keyboard.press("Enter");
        const out = await page.evaluate(() => {
          const box = document.querySelector("#save").getBoundingClientRect();
          const parts = [...document.querySelectorAll("#save :is(button, input, select, p)")];
          return [
            ...(box.left >= 0 && box.right <= innerWidth ? [] : ["dialog"]),
            ...parts
              .filter((part) => part.getBoundingClientRect().right > box.right)
              .map((part) => part.id),
          ];
        });
        assert.deepEqual(out, []);
        assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 360);
        await shot(page, `save-360-${colorScheme}`);
        await page.keyboard.press("Escape");
        assert.equal(await page.locator("#save").isVisible(), false);
        assert.equal(await page.evaluate(() => document.activeElement.id), "save-button");
      },
      { viewport: { width: 360, height: 780 }, colorScheme, hasTouch: true },
    );
  }
});
