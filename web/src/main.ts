// Puts the page together: parts, keys, buttons; then lets the app run.
import { orbit, pan, zoom } from "./camera";
import { App } from "./app";
import { byId, make } from "./dom";
import { Gizmo } from "./gizmo";
import { Hud } from "./hud";
import { MoveQueue, PointerInput } from "./input";
import { bindKeys, type Binding } from "./keyboard";
import { Legend } from "./legend";
import { Panels } from "./panels";
import { Status } from "./status";
import { TimeBar } from "./time_bar";
import { Viewport } from "./viewport";

const app = new App(
  {
    setTimeout: (run, ms) => window.setTimeout(run, ms),
    clearTimeout: (timer) => window.clearTimeout(timer),
    random: () => Math.random(),
  },
  document.baseURI,
);

const canvas = byId("picture", HTMLCanvasElement);
const moves = new MoveQueue(app, (run) => window.requestAnimationFrame(run));
new PointerInput(canvas, moves);

const viewport = new Viewport(canvas, {
  drawn: (frame) => app.onDrawn(frame),
  stale: (header, decodeMs) => app.acknowledge(header.seq, decodeMs),
  broken: (header) => app.onBroken(header.seq),
  resized: debouncedResize(),
});
const timeBar = new TimeBar({
  seek: (step) => app.seek(step),
  play: () => app.play(),
  pause: () => app.pause(),
  settings: () => app.playSettings(),
});
const hud = new Hud();
const gizmoElement = document.querySelector<SVGSVGElement>("#gizmo-axes")!;
const panelBox = byId("panel", HTMLElement);
const host = {
  view: () => app.view(),
  change: (patch: Record<string, unknown>) => app.change(patch),
  dataset: () => app.dataset(),
  maps: app.maps,
};
const panels = new Panels(panelBox, host, {
  reset: () => app.resetAll(),
  camera: () => app.camera(),
  setCamera: (camera) => app.setCamera(camera),
  flowing: () => app.isFlowing(),
  flow: (on) => app.flow(on),
});

const help = byId("help", HTMLDialogElement);

function togglePanel(): void {
  const hidden = document.documentElement.classList.toggle("no-panel");
  byId("panel-button", HTMLButtonElement).setAttribute("aria-expanded", String(!hidden));
}

const views: [string, string, number, number][] = [
  ["1", "from the south", 0, 0],
  ["2", "from the north", 180, 0],
  ["3", "from the east", 90, 0],
  ["4", "from the west", -90, 0],
  ["5", "from above", 0, 90],
  ["6", "from below", 0, -90],
];

const turn =
  (azimuth: number, elevation: number, right: number, up: number) => (event: KeyboardEvent) =>
    moves.push((camera) =>
      event.shiftKey ? pan(camera, right, up) : orbit(camera, azimuth, elevation),
    );

const bindings: Binding[] = [
  { keys: ["ArrowLeft"], shown: "←", does: "turn (shift: move) left", run: turn(5, 0, -0.05, 0) },
  { keys: ["ArrowRight"], shown: "→", does: "turn (shift: move) right", run: turn(-5, 0, 0.05, 0) },
  { keys: ["ArrowUp"], shown: "↑", does: "tilt (shift: move) up", run: turn(0, -5, 0, -0.05) },
  { keys: ["ArrowDown"], shown: "↓", does: "tilt (shift: move) down", run: turn(0, 5, 0, 0.05) },
  { keys: ["+", "="], shown: "+", does: "nearer", run: () => moves.push((c) => zoom(c, 1.15)) },
  {
    keys: ["-", "_"],
    shown: "−",
    does: "farther",
    run: () => moves.push((c) => zoom(c, 1 / 1.15)),
  },
  { keys: ["Home", "0"], shown: "0", does: "whole volume", run: () => app.resetCamera() },
  ...views.map(([key, where, azimuth, elevation]) => ({
    keys: [key],
    shown: key,
    does: `look ${where}`,
    run: () => app.lookFrom({ azimuth, elevation }),
  })),
  {
    keys: ["o"],
    shown: "o",
    does: "perspective or orthographic",
    run: () => app.toggleProjection(),
  },
  { keys: [" "], shown: "space", does: "play or pause", run: () => timeBar.toggle() },
  { keys: ["["], shown: "[", does: "step back", run: () => app.seek(timeBar.neighbour(-1)) },
  { keys: ["]"], shown: "]", does: "step on", run: () => app.seek(timeBar.neighbour(1)) },
  { keys: ["\\"], shown: "\\", does: "times of the frames", run: () => hud.toggle() },
  { keys: ["p"], shown: "p", does: "panel", run: togglePanel },
  { keys: ["?"], shown: "?", does: "this list", run: () => help.showModal() },
];

function fillHelp(): void {
  const list = byId("help-keys", HTMLElement);
  for (const binding of bindings) {
    list.append(make("dt", "", binding.shown), make("dd", "", binding.does));
  }
}

function debouncedResize(): (width: number, height: number) => void {
  let timer: number | undefined;
  return (width, height) => {
    window.clearTimeout(timer);
    timer = window.setTimeout(() => app.resize(width, height), 120);
  };
}

function onClick(id: string, run: () => void): void {
  byId(id, HTMLButtonElement).addEventListener("click", run);
}

bindKeys(bindings, document);
fillHelp();
onClick("link-button", () => void app.copyLink());
onClick("help-button", () => help.showModal());
onClick("panel-button", togglePanel);
onClick("hud-button", () => hud.toggle());
onClick("reset-button", () => app.resetCamera());
onClick("projection-button", () => app.toggleProjection());

app.start({
  viewport,
  hud,
  legend: new Legend(byId("legend", HTMLElement), app.maps),
  gizmo: new Gizmo(gizmoElement),
  panels,
  timeBar,
  status: new Status(),
  picker: byId("dataset", HTMLSelectElement),
  facts: byId("facts", HTMLElement),
});
