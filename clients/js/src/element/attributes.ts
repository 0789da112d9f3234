// Attributes and properties of <windsplat-view> -> the view that they ask for.
import { isObject } from "../base/values";
import type { View } from "../wire/protocol";
import { isView } from "../wire/view_shape";

// A copy of a view, which is an object or JSON text. Throws an Error that says what it should have
// been.
export function viewOf(given: unknown): View {
  const text = typeof given === "string" ? given : (JSON.stringify(given) ?? "null");
  let view: unknown;
  try {
    view = text.trim() === "" ? {} : JSON.parse(text);
  } catch (error) {
    throw new Error(`view is no JSON: ${(error as Error).message}`);
  }
  if (!isObject(view) || !isView(view)) {
    throw new Error('view must be an object such as {"dataset": "winds", "scalars": []}');
  }
  return view;
}

// A time step, counted from 0; null: none is asked for.
export function stepOf(text: string | null): number | null {
  if (text === null || text.trim() === "") return null;
  const step = Number(text);
  if (!Number.isInteger(step) || step < 0) {
    throw new Error(`step must be a whole number from 0, not "${text}"`);
  }
  return step;
}

// The view of the attributes: `dataset` and `step` come before those of `view`.
export function asked(view: View, dataset: string | null, step: number | null): View {
  return {
    ...view,
    ...(dataset === null || dataset === "" ? {} : { dataset }),
    ...(step === null ? {} : { step }),
  };
}
