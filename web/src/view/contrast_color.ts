// A colour for something new in the picture that can be told from what is there already: colours of
// media, surfaces and background -> one colour. Pure.
import type { View } from "@windsplat/client";

type Color = readonly [number, number, number];

const neutral = "#d8d8d8"; // the default of surfaces
const apart = 0.2; // from which on two colours are told at a glance; black and white are 0.5 apart
const seenShare = 0.05; // of the greatest opacity, from which on a medium's colours are seen
const shadeWeight = 0.5; // of lightness beside hue and saturation: light and opacity change it

// The neutral colour first, then twelve hues of equal lightness in Oklab.
const offered: readonly string[] = [
  neutral,
  ...Array.from({ length: 12 }, (_, n) => colorOfHue(30 * n)),
];

function colorOfHue(degrees: number): string {
  const [lightness, chroma] = [0.75, 0.14];
  const angle = (degrees * Math.PI) / 180;
  const [a, b] = [chroma * Math.cos(angle), chroma * Math.sin(angle)];
  const [l, m, s] = [
    (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3,
    (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3,
    (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3,
  ];
  const linear = [
    4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
    -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
    -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s,
  ];
  const hex = linear.map((value) => {
    const inside = Math.min(1, Math.max(0, value));
    const encoded = inside <= 0.0031308 ? 12.92 * inside : 1.055 * inside ** (1 / 2.4) - 0.055;
    return Math.round(255 * encoded)
      .toString(16)
      .padStart(2, "0");
  });
  return `#${hex.join("")}`;
}

// Of "#rrggbb", in Oklab (B. Ottosson 2020, "A perceptual color space for image processing").
function labOf(color: string): Color {
  const [r, g, b] = [1, 3, 5].map((at) => {
    const value = parseInt(color.slice(at, at + 2), 16) / 255;
    return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
  }) as [number, number, number];
  const l = Math.cbrt(0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b);
  const m = Math.cbrt(0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b);
  const s = Math.cbrt(0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b);
  return [
    0.2104542553 * l + 0.793617785 * m - 0.0040720468 * s,
    1.9779984951 * l - 2.428592205 * m + 0.4505937099 * s,
    0.0259040371 * l + 0.7827717662 * m - 0.808675766 * s,
  ];
}

const distance = (one: Color, other: Color): number =>
  Math.hypot(shadeWeight * (one[0] - other[0]), one[1] - other[1], one[2] - other[2]);

// The value of an opacity curve, linear between its points and constant beyond them.
function extinctionAt(curve: readonly [number, number][], value: number): number {
  const after = curve.findIndex(([at]) => at >= value);
  if (after < 0) return curve.at(-1)![1];
  if (after === 0) return curve[0]![1];
  const [[x0, y0], [x1, y1]] = [curve[after - 1]!, curve[after]!];
  return x1 === x0 ? y1 : y0 + ((y1 - y0) * (value - x0)) / (x1 - x0);
}

// The colours of the view's media where these are not clear, of its surfaces and of its background.
// stops: positions and colours of a map by its name.
export function colorsIn(view: View, stops: (map: string) => [number, string][]): string[] {
  const media = (view.scalars ?? []).flatMap(({ color, extinction }) => {
    const curve = (extinction ?? []) as [number, number][];
    const least = seenShare * Math.max(0, ...curve.map(([, most]) => most));
    const [from, to] = (color?.range ?? [0, 1]) as [number, number];
    return stops(color?.map ?? "grays")
      .filter(([at]) => curve.length === 0 || extinctionAt(curve, from + at * (to - from)) > least)
      .map(([, one]) => one);
  });
  const surfaces = (view.surfaces ?? []).flatMap(({ color, isovalue }) =>
    (isovalue ?? null) === null || (color?.field ?? null) !== null
      ? []
      : [color?.constant ?? neutral],
  );
  return [...media, ...surfaces, view.image?.background ?? "#000000"];
}

// The neutral colour if it is told from all of `present` ("#rrggbb"), otherwise the one that is the
// farthest from the nearest of them.
export function contrastColor(present: readonly string[]): string {
  const others = present.map(labOf);
  const room = (color: string): number => {
    const lab = labOf(color);
    return Math.min(...others.map((other) => distance(lab, other)));
  };
  if (room(neutral) >= apart) return neutral;
  return offered.reduce((best, color) => (room(color) > room(best) ? color : best));
}

// Black or white, whichever is read on this colour.
export const inkOn = (background = "#000000"): string =>
  labOf(background)[0] > 0.6 ? "#000000" : "#ffffff";
