// Colours of new surfaces: whatever is seen around them, they can be told from it.
import assert from "node:assert/strict";
import { test } from "node:test";
import { colorsIn, contrastColor, inkOn } from "../../src/view/contrast_color";
import type { View } from "@windsplat/client";

type Channels = [number, number, number];

const channels = (color: string): Channels =>
  [1, 3, 5].map((at) => parseInt(color.slice(at, at + 2), 16)) as Channels;
const colorfulness = (color: string): number =>
  Math.max(...channels(color)) - Math.min(...channels(color));

const white: [number, string][] = [
  [0, "#c8ccd2"],
  [1, "#ffffff"],
];
const hot: [number, string][] = [
  [0, "#000000"],
  [0.4, "#d02000"],
  [0.7, "#ffa000"],
  [1, "#ffff80"],
];
const viewOf = (change: Partial<View>): View => ({ dataset: "a", ...change }) as View;
const cloud = viewOf({
  scalars: [
    {
      field: "q",
      color: { map: "white", range: [0, 1] },
      extinction: [
        [0, 0],
        [1, 8],
      ],
    },
  ],
});

test("a surface in a white cloud is coloured, one over black alone is neutral", () => {
  const inCloud = contrastColor(colorsIn(cloud, () => white));
  assert.ok(colorfulness(inCloud) > 80, inCloud);
  assert.equal(contrastColor(colorsIn(viewOf({}), () => [])), "#d8d8d8");
  const paper = viewOf({ image: { background: "#ffffff" } as View["image"] });
  assert.ok(colorfulness(contrastColor(colorsIn(paper, () => []))) > 80, "light grey on white");
});

test("a surface in a medium of reds and yellows is blue", () => {
  const [red, , blue] = channels(contrastColor(colorsIn(cloud, () => hot)));
  assert.ok(blue > red + 40, `${red}, ${blue}`);
});

test("colours of values that are clear do not count", () => {
  const blues: [number, string][] = [
    [0, "#ff4020"],
    [0.5, "#ff8020"],
    [1, "#2060ff"],
  ];
  const curve: [number, number][] = [
    [0, 0],
    [0.8, 0],
    [1, 5],
  ];
  const scalars = [{ ...cloud.scalars![0]!, extinction: curve }] as View["scalars"];
  const view = viewOf({ scalars });
  assert.deepEqual(
    colorsIn(view, () => blues),
    ["#2060ff", "#000000"],
  );
});

test("each further surface differs from those before", () => {
  const chosen: string[] = [];
  for (let n = 0; n < 4; n++) {
    const surfaces = chosen.map((constant) => ({ field: "q", isovalue: 1, color: { constant } }));
    const next = contrastColor(colorsIn({ ...cloud, surfaces } as View, () => white));
    assert.ok(!chosen.includes(next), `${next} after ${chosen.join()}`);
    chosen.push(next);
  }
});

test("texts are black on light backgrounds and white on dark ones", () => {
  for (const light of ["#ffffff", "#f0f0e8", "#ffff00", "#a0c8ff"]) {
    assert.equal(inkOn(light), "#000000", light);
  }
  for (const dark of [undefined, "#000000", "#101820", "#0000ff", "#803000"]) {
    assert.equal(inkOn(dark), "#ffffff", dark);
  }
});
