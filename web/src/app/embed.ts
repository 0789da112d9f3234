// The embedded view (`?embed`): the picture alone, as other pages show it in a frame. What needs
// the whole page, as files, saved views and the login, is behind a link to it.
import { hashOfView } from "../view/link";
import type { View } from "@windsplat/client";
import { byId } from "../base/dom";
import type { Binding } from "./keyboard";

// Whether the page's address asks for it: a parameter `embed`, with any value.
export const isEmbedded = (search: string): boolean => new URLSearchParams(search).has("embed");

// Keys that open parts of the page which the embedded view lacks.
const wholePageKeys = new Set(["i", "r", "Escape", "\\", "e", "a", "d", "c", "p", "s", "?"]);

export const embeddedKeys = (bindings: Binding[]): Binding[] =>
  bindings.filter(({ keys }) => !keys.some((key) => wholePageKeys.has(key)));

// The wheel scrolls the page around the frame until the picture has been chosen, by a click or by
// the tab key; with ctrl, or a pinch of a trackpad, it always zooms.
export const takesWheel = (picture: Element, { ctrlKey }: WheelEvent): boolean =>
  ctrlKey || document.activeElement === picture;

// The link to the whole page with the present view, of which `view` gives the explicit keys; null:
// none is shown, and the link keeps what the address asks for.
export function openLink(baseUri: string, view: () => View | null): HTMLAnchorElement {
  const link = byId("open-link", HTMLAnchorElement);
  const update = () => {
    const shown = view();
    const hash = shown === null ? window.location.hash : hashOfView(shown);
    link.href = new URL(`./${hash}`, baseUri).href;
  };
  update();
  // Before the browser reads the address: by mouse, touch, keyboard and menu.
  for (const type of ["pointerenter", "pointerdown", "focus", "click"]) {
    link.addEventListener(type, update);
  }
  return link;
}
