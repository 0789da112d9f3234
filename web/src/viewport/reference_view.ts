// The reference on the page: its picture over the current one, its status in the corner, and the
// button with the same function as the key.
import { byId } from "../base/dom";
import type { View } from "@windsplat/client";
import { Reference } from "./reference";
import { posted, refusal } from "@windsplat/client/parts";

async function request(method: string, path: string, body?: View): Promise<unknown> {
  const response = await fetch(new URL(path, document.baseURI), {
    ...(body === undefined ? { method } : posted(body)),
    keepalive: method === "DELETE", // the request may be sent while the page unloads
  });
  if (!response.ok) throw await refusal(response);
  return response.json().catch(() => null);
}

function holdByButton(button: HTMLElement, reference: Reference): void {
  const on = (types: string, run: (event: Event) => void): void =>
    types.split(" ").forEach((type) => button.addEventListener(type, run));
  on("pointerdown", (event) => {
    button.setPointerCapture((event as PointerEvent).pointerId);
    reference.hold();
  });
  on("keydown", (event) => {
    const { key, repeat } = event as KeyboardEvent;
    if (!repeat && (key === " " || key === "Enter")) reference.hold();
  });
  on("pointerup pointercancel keyup blur", () => reference.release());
  on("contextmenu", (event) => event.preventDefault()); // suppresses the menu of a long press
  on("click", () => reference.prepare()); // assistive technology cannot hold a button
}

export function makeReference(canvas: HTMLElement, view: () => View): Reference {
  const picture = byId("reference-picture", HTMLImageElement);
  const line = byId("reference", HTMLElement);
  const reference = new Reference({
    view,
    request,
    sleep: (ms) => new Promise((done) => window.setTimeout(done, ms)),
    load: (path) => {
      picture.src = new URL(path, document.baseURI).href;
      return picture.decode();
    },
    show: (on) => {
      picture.hidden = !on;
      byId("reference-mark", HTMLElement).hidden = !on;
      byId("mark", HTMLElement).hidden = on;
    },
    report: (text, progress) => {
      line.hidden = text === "";
      const label = byId("reference-words", HTMLElement);
      if (label.textContent !== text) label.textContent = text;
      byId("reference-progress", HTMLElement).textContent = progress;
    },
  });
  holdByButton(byId("reference-button", HTMLButtonElement), reference);
  // These attributes identify the view on the canvas.
  new MutationObserver(() => reference.follow()).observe(canvas, {
    attributeFilter: ["data-wanted", "data-step"],
  });
  window.addEventListener("pagehide", () => reference.abandon());
  return reference;
}
