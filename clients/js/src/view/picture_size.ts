// The size of the picture in a view, which depends on the window that shows it. Pure.
import { clamp } from "../base/values";
import type { View } from "../wire/protocol";

export const sizeOf = ({ image }: View): [number, number] => [
  image?.width ?? 1280,
  image?.height ?? 720,
];

// The pixel at a position in fractions of the picture: its middle.
export function pixelAt(view: View, at: [number, number]): [number, number] {
  const size = sizeOf(view);
  const pixel = (n: 0 | 1) => clamp(Math.floor(at[n] * size[n]), 0, size[n] - 1) + 0.5;
  return [pixel(0), pixel(1)];
}

export function withoutSize(view: View): View {
  const { image, ...rest } = view;
  if (typeof image !== "object" || image === null) return rest;
  const { width: _width, height: _height, ...kept } = image;
  return Object.keys(kept).length === 0 ? rest : { ...rest, image: kept };
}
