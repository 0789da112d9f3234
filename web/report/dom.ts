// Creates elements and tables of the report.

export type Child = Node | string;

export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Record<string, string> = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

export interface Row {
  cells: Child[]; // the first is the header of the row
  className?: string;
}

export function table(caption: string, heads: string[], rows: Row[]): HTMLElement {
  const head = heads.map((text) => element("th", { scope: "col" }, text));
  const body = rows.map(({ cells, className }) => {
    const row = element("tr", className ? { class: className } : {});
    cells.forEach((cell, n) => {
      row.append(n === 0 ? element("th", { scope: "row" }, cell) : element("td", {}, cell));
    });
    return row;
  });
  const made = element(
    "table",
    {},
    element("caption", {}, caption),
    element("thead", {}, element("tr", {}, ...head)),
    element("tbody", {}, ...body),
  );
  // Focusable, so that it can be scrolled by keyboard.
  const region = { class: "scroll", tabindex: "0", role: "region", "aria-label": caption };
  return element("div", region, made);
}

export const details = (summary: string, ...children: Child[]): HTMLElement =>
  element("details", {}, element("summary", {}, summary), ...children);
