// The inside of <windsplat-view>: elements and styles. Styles are a constructed sheet, which
// content security policies allow.

const css = `
:host { display: block; position: relative; aspect-ratio: 8 / 5; overflow: hidden;
  background: #0b0e14; color: #e8ecf2; font: 13px/1.4 system-ui, sans-serif;
  touch-action: pan-y; }
:host([interactive="false"]) { touch-action: auto; }
:host([hidden]) { display: none; }
.frame { display: grid; height: 100%; grid-template: minmax(0, 1fr) auto / minmax(0, 1fr); }
canvas { display: block; grid-area: 1 / 1; width: 100%; height: 100%;
  touch-action: inherit; cursor: grab; outline: none; }
canvas.dragging { cursor: grabbing; }
:host([interactive="false"]) canvas { cursor: default; }
canvas:focus-visible { box-shadow: inset 0 0 0 2px #6cb2ff; }
[part="message"] { position: absolute; inset: 0.6em 0.6em auto; margin: 0; padding: 0.4em 0.7em;
  width: fit-content; max-width: calc(100% - 2.6em); border-radius: 4px; background: #000b; }
[part="message"]:empty { display: none; }
[part="loading"] { grid-area: 1 / 1; align-self: end; height: 3px; background: #6cb2ff;
  pointer-events: none; }
[part="loading"][hidden] { display: none; }
[part="controls"] { grid-area: 2 / 1; display: flex; gap: 0.3em; align-items: center;
  padding: 0.3em 0.5em; }
[part="controls"][hidden], [part="controls"] > [hidden] { display: none; }
button { font: inherit; color: inherit; background: #000a; border: 1px solid #fff4;
  border-radius: 4px; min-width: 2.2em; min-height: 2.2em; cursor: pointer; }
button:hover { background: #222c; }
button:focus-visible, input:focus-visible { outline: 2px solid #6cb2ff; outline-offset: 1px; }
input { flex: 1; min-width: 3em; accent-color: #6cb2ff; }
output { background: #000a; border-radius: 4px; padding: 0.2em 0.5em; white-space: nowrap; }
`;

export interface Inside {
  canvas: HTMLCanvasElement;
  message: HTMLElement;
  loading: HTMLElement;
  controls: HTMLElement;
  play: HTMLButtonElement;
  slider: HTMLInputElement;
  time: HTMLOutputElement;
  zoomIn: HTMLButtonElement;
  zoomOut: HTMLButtonElement;
  reset: HTMLButtonElement;
}

function button(sign: string, name: string): HTMLButtonElement {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = sign;
  made.title = name;
  made.setAttribute("aria-label", name);
  return made;
}

function part<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  name: string,
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  made.setAttribute("part", name);
  return made;
}

export function fill(root: ShadowRoot): Inside {
  const sheet = new CSSStyleSheet();
  sheet.replaceSync(css);
  root.adoptedStyleSheets = [sheet];
  const canvas = part("canvas", "picture");
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "img");
  const message = part("p", "message");
  message.setAttribute("role", "status");
  const loading = part("div", "loading");
  loading.setAttribute("role", "progressbar");
  loading.hidden = true;
  const controls = part("div", "controls");
  controls.setAttribute("role", "group");
  controls.setAttribute("aria-label", "Controls of the picture");
  controls.hidden = true;
  const slider = document.createElement("input");
  slider.type = "range";
  slider.min = "0";
  slider.setAttribute("aria-label", "Time step");
  const inside: Inside = {
    canvas,
    message,
    loading,
    controls,
    play: button("▶", "Play"),
    slider,
    time: document.createElement("output"),
    zoomOut: button("−", "Zoom out"),
    zoomIn: button("+", "Zoom in"),
    reset: button("⌂", "Whole picture"),
  };
  const { play, time, zoomOut, zoomIn, reset } = inside;
  controls.append(play, slider, time, zoomOut, zoomIn, reset);
  const frame = document.createElement("div");
  frame.className = "frame";
  frame.append(canvas, loading, controls);
  root.append(frame, message);
  return inside;
}
