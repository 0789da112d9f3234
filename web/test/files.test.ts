// Files that change or become unreadable while displayed: the page's handling of a second `opened`
// and of an unsolicited `error`.
import assert from "node:assert/strict";
import { test } from "node:test";
import { fitView, shapeOf } from "@windsplat/client/parts";
import type { View } from "@windsplat/client";
import { described, Page, problem } from "./page";

const gone = 'dataset "storm" has steps 0 to 2';
const damaged = "'storm.nc' is damaged: 'wind' cannot be read";

function shown(): Page {
  const page = new Page([described("storm"), described("calm")]);
  page.opened(described("storm"));
  page.draws();
  return page;
}

test("a view keeps what changed files still contain", () => {
  const view: View = {
    dataset: "storm",
    step: 4,
    camera: { fovY: 50 },
    vector: {
      field: "wind",
      length: 0.2,
      magnitudeRange: [0, 60],
      minMagnitude: 3,
      color: { by: "scalar", field: "humidity", range: [0, 1], map: "magma" },
    },
    scalars: [{ field: "humidity" }, { field: "temperature", stride: 2 }],
    geometry: {
      scale: [1, 1, 3],
      mapping: "sphere",
      heightField: "humidity",
      slice: { axis: "z", index: 7 },
    },
  };
  const same = described("storm", {
    fields: ["wind", "temperature", "humidity"],
    size: 8,
    mappings: ["flat", "sphere"],
  });
  assert.deepEqual(fitView(view, same), view);
  assert.deepEqual(fitView(view, described("storm", { steps: 3, fields: ["temperature"] })), {
    dataset: "storm",
    step: 2,
    camera: { fovY: 50 },
    vector: { length: 0.2, color: { map: "magma" } },
    scalars: [{ field: "temperature", stride: 2 }],
    geometry: { scale: [1, 1, 3], slice: { axis: "z", index: 3 } },
  });
  const filtered = fitView(
    {
      region: {
        x: [1, 2],
        where: [
          { field: "humidity", range: [0, 1] },
          { field: "fog", range: [0, 1] },
        ],
      },
    },
    same,
  );
  assert.deepEqual(filtered.region, {
    x: [1, 2],
    where: [{ field: "humidity", range: [0, 1] }],
  });
  const calm = fitView({ ...view, vector: { field: null } }, described("storm", { fields: [] }));
  assert.deepEqual([calm.vector, calm.scalars], [{ field: null }, undefined]);
  assert.deepEqual(fitView({ scalars: [] }, same), { scalars: [] });
  assert.notEqual(shapeOf(same), shapeOf(described("storm")));
  assert.equal(shapeOf(same), shapeOf({ ...same, residentBytes: 9, notes: ["read again"] }));
});

test("only a plane that misses the box of the data is moved", () => {
  const dataset = described("storm"); // its box, by its longest edge, from -1 to 1
  const { max } = dataset.world;
  const edge = Math.max(...max);
  const through = (point: [number, number, number], scale?: [number, number, number]) => {
    const geometry = { plane: { point, normal: [1, 1, 0] as [number, number, number] }, scale };
    return fitView({ geometry }, dataset).geometry?.plane?.point;
  };
  // Outside of the box, and the plane crosses it.
  assert.deepEqual(through([-4, 4, 0]), [-4, 4, 0]);
  assert.deepEqual(through([4, 4, 0]), [max[0] / edge, max[1] / edge, 0]);
  // Above the box of the data, within that of the stretched one.
  assert.deepEqual(through([0, 0, 0.9], [1, 1, 10]), [0, 0, 0.9]);
});

test("fewer steps select the last one and keep the rest", () => {
  const page = shown();
  page.app.change({ step: 4, vector: { length: 0.2 } });
  page.app.change({ scalars: [{ field: "temperature", stride: 2 }] });
  page.draws();
  const { built } = page;
  page.receives({ type: "error", rev: page.rev, problem: problem(gone, 422, "/step") });
  assert.match(page.alert ?? "", /steps 1 to 3/);
  page.opened(described("storm", { steps: 3 }));
  assert.equal(page.alert, null, "the step is no longer requested");
  const last = page.sent("patch").at(-1)!.patch as View;
  assert.equal(last.step, 2);
  const { step, vector, scalars } = page.app.view();
  assert.deepEqual([step, vector?.length, vector?.field], [2, 0.2, "wind"]);
  assert.deepEqual(scalars, [{ field: "temperature", stride: 2 }]);
  assert.equal(page.element("time-slider").max, "2");
  assert.equal(page.element("time-slider").value, "2");
  assert.equal(page.element("time-step").textContent, "step 3 of 3");
  assert.equal(page.element("time-label").textContent, "2001-01-01 02:00Z");
  assert.equal(page.built, built + 1);
  // The server may already have tried the old step without a patch.
  page.receives({ type: "error", problem: problem(gone, 422, "/step") });
  page.draws();
  assert.equal(page.alert, null);
  assert.equal(page.sent("open").length, 1, "no dataset is opened again");
});

test("the time bar follows the number of steps, and the step is kept", () => {
  const page = shown();
  page.app.change({ step: 3 });
  page.draws();
  const patches = page.sent("patch").length;
  page.opened(described("storm", { steps: 9 }));
  assert.equal(page.sent("patch").length, patches, "no patch is needed");
  assert.equal(page.element("time-slider").max, "8");
  assert.equal(page.element("time-step").textContent, "step 4 of 9");
  page.opened(described("storm", { steps: 1 }));
  assert.equal((page.sent("patch").at(-1)!.patch as View).step, 0);
  assert.equal(page.element("time-step").textContent, "one step");
  assert.equal(page.element("time").inert, true);
});

test("playback continues within the new steps and stops at a single one", () => {
  const page = shown();
  page.app.playback.play(1);
  page.opened(described("storm", { steps: 9 }));
  assert.deepEqual(
    page.sent("play").map(({ from, to }) => [from, to]),
    [
      [0, 4],
      [0, 8],
    ],
  );
  page.opened(described("storm", { steps: 1 }));
  assert.equal(page.app.playback.running, false);
  assert.equal(page.sent("pause").length, 1);
});

test("a removed field is not requested, and defaults are updated", () => {
  const page = shown();
  page.app.change({ scalars: [{ field: "temperature" }], camera: { fovY: 50 } });
  page.draws();
  page.opened(described("storm", { fields: ["wind", "humidity"] }));
  const view = page.app.view();
  assert.deepEqual(view.scalars, [{ field: "humidity" }]);
  assert.deepEqual([view.camera?.fovY, view.vector?.field], [50, "wind"]);
  assert.equal((page.sent("patch").at(-1)!.patch as View).scalars, null);
});

test("the answer to a cancelled request changes nothing", () => {
  const page = shown();
  page.choose("calm");
  page.receives({ type: "opened", id: 1, dataset: described("storm", { steps: 2 }) });
  assert.equal(page.element("time-slider").max, "4");
  page.opened(described("calm", { steps: 7 }));
  assert.equal(page.element("time-slider").max, "6");
  page.receives({ type: "opened", id: 1, dataset: described("storm", { steps: 2 }) });
  assert.equal(page.app.dataset().id, "calm");
});

test("unreadable changed files show an error and keep the old picture", () => {
  const page = shown();
  const patches = page.sent("patch").length;
  page.receives({ type: "error", id: page.openId, problem: problem(damaged) });
  assert.equal(page.alert, damaged);
  assert.deepEqual(page.entries, ["The storm — failed", "The calm"]);
  page.app.change({ step: 1 });
  page.draws();
  assert.equal(page.alert, damaged, "other frames do not clear the error");
  assert.equal(page.sent("patch").length, patches + 1);
  assert.deepEqual([page.sent("open").length, page.app.dataset().id], [1, "storm"]);
  const { built } = page;
  page.opened(described("storm"));
  assert.equal(page.alert, null);
  assert.equal(page.built, built + 1, "rebuilt, because the values may differ");
  assert.deepEqual(page.entries, ["The storm", "The calm"]);
});

test("files unreadable before the page loads are reported by the server note", () => {
  const failed = described("storm", { state: "failed", notes: ["levels were turned", damaged] });
  const page = new Page([failed, described("calm")]);
  assert.equal(page.sent("open").at(-1)!.dataset, "calm", "a readable dataset is preferred");
  page.opened(described("calm"));
  page.choose("storm");
  page.opened(failed);
  page.draws();
  assert.equal(page.alert, damaged);
  page.choose("calm");
  page.opened(described("calm"));
  assert.equal(page.alert, null);
});

test("a failed dataset is reported even after another failed request", () => {
  const page = shown();
  page.choose("calm");
  page.receives({ type: "error", id: page.openId, problem: problem("no") });
  page.opened(described("storm", { steps: 9 }));
  assert.equal(page.element("time-slider").max, "8", "accepts the id of the last request");
  page.receives({ type: "error", id: 1, problem: problem(damaged) });
  assert.equal(page.alert, damaged, "accepts the id of the request that opened it");
  assert.deepEqual(page.entries, ["The storm — failed", "The calm — failed"]);
});
