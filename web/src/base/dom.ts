// DOM helpers.

export function byId<T extends HTMLElement>(id: string, type: new () => T): T {
  const element = document.getElementById(id);
  if (!(element instanceof type)) throw new Error(`the page has no #${id}`);
  return element;
}

export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  className = "",
  text = "",
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  if (className !== "") element.className = className;
  if (text !== "") element.textContent = text;
  return element;
}

const svgSpace = "http://www.w3.org/2000/svg";

type Attributes = Record<string, string | number>;

export function setAttributes(element: Element, attributes: Attributes): void {
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
}

export function makeSvg(tag: string, attributes: Attributes): SVGElement {
  const element = document.createElementNS(svgSpace, tag);
  setAttributes(element, attributes);
  return element;
}

// `anchor`: whether x is the start, middle or end of the text.
export function svgText(x: number, y: number, text: string, anchor: string): SVGElement {
  const element = makeSvg("text", { x, y, "text-anchor": anchor });
  element.textContent = text;
  return element;
}

export function numberBox(): HTMLInputElement {
  const box = make("input");
  box.type = "number";
  box.step = "any";
  return box;
}

// A label around a check box.
export function checkLabel(box: HTMLInputElement, text: string, title = ""): HTMLLabelElement {
  const label = make("label", "histogram-check");
  box.type = "checkbox";
  label.append(box, text);
  label.title = title;
  return label;
}

// Calls `run` once the dialog is closed. Browsers fire the close event asynchronously; by then the
// dialog may be open again.
export function whenClosed(dialog: HTMLDialogElement, run: () => void): void {
  dialog.addEventListener("close", () => {
    if (!dialog.open) run();
  });
}

// Calls `report` whenever the visibility of the element changes.
export function observeVisibility(element: Element, report: (visible: boolean) => void): void {
  // Several changes may arrive together; the last one is current.
  new IntersectionObserver((entries) => report(entries.at(-1)!.isIntersecting)).observe(element);
}
