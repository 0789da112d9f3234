// Assembles the page (parts, key bindings, buttons) and starts the application.
import { takeBeside } from "../view/beside";
import { withProjection, type Angles } from "@windsplat/client";
import { pictureCaption } from "../view/caption";
import { About } from "./about";
import { App } from "./app";
import { BesidePicture } from "./beside";
import { Cards } from "./dataset_cards";
import { DatasetList } from "./dataset_list";
import { embeddedKeys, isEmbedded, openLink, takesWheel } from "./embed";
import { entryOf, openEntry } from "./entries";
import { EntryPicker } from "./entry_picker";
import {
  afterResizing,
  cameraKeys,
  MoveQueue,
  PointerInput,
  Turn,
  Viewport,
} from "@windsplat/client/parts";
import { byId, make } from "../base/dom";
import { toggleErrorMetric } from "../base/error_text";
import { FileBrowser } from "./file_browser";
import { Gizmo, looks } from "../viewport/gizmo";
import { hoverOn } from "../view/hover_setting";
import { HoverView } from "../viewport/hover_view";
import { Hud } from "../viewport/hud";
import { bindKeys, modText, type Binding } from "./keyboard";
import { Legend } from "../viewport/legend";
import { Login } from "./login";
import { panelSheet } from "./panel_sheet";
import { Panels } from "../panels/panels";
import { Probe } from "../viewport/probe";
import { RegionBox } from "../viewport/region_box";
import { otherDatasets } from "../view/others";
import { makeReference } from "../viewport/reference_view";
import { saveDialog } from "../save/save_dialog";
import { takeDrops, type FileTarget } from "../save/saved_picture";
import { Status } from "./status";
import { TimeBar } from "./time_bar";

const clock = {
  setTimeout: (run: () => void, ms: number) => window.setTimeout(run, ms),
  clearTimeout: (timer: number) => window.clearTimeout(timer),
  random: () => Math.random(),
};
const app = new App(clock, document.baseURI);

const embedded = isEmbedded(window.location.search);
document.documentElement.classList.toggle("embedded", embedded);
const canvas = byId("picture", HTMLCanvasElement);
const requestFrame = (run: () => void) => void window.requestAnimationFrame(run);
const turnHost = {
  now: () => performance.now(),
  requestFrame,
  still: () => window.matchMedia("(prefers-reduced-motion: reduce)").matches,
};
const moves = new MoveQueue(app.cameras, requestFrame);
const turn = new Turn(moves, turnHost);
const lookFrom = (angles: Angles) =>
  (besideIsSteered() ? besideTurn : turn).to(app.cameras.viewFrom(angles));
new PointerInput(canvas, moves, {
  clicked: (x, y, { altKey, pointerType }) => {
    const { seeds } = panels;
    if (seeds?.picking) {
      void probe.sampleAt([x, y]).then((sample) => seeds.addSample(sample));
      return;
    }
    probe.pick([x, y], altKey && !embedded);
    if (pointerType === "touch") hover.tap([x, y]);
  },
  takesWheel: (event) => !embedded || takesWheel(canvas, event),
});

const viewport = new Viewport(canvas, {
  decoded: (header, decodeMs) => app.acknowledge(header.seq, decodeMs),
  drawn: (frame) => app.onDrawn(frame),
  broken: (header) => app.onBroken(header.seq),
  videoFailed: () => app.video.failed(),
  resized: afterResizing(() => app.resize(...viewport.size())),
});
const timeBar = new TimeBar({
  seek: (step) => app.seek(step),
  scrub: (step) => app.playback.scrub(step),
  scrubbed: () => app.playback.scrubbed(),
  play: (direction) => app.playback.play(direction),
  pause: () => app.playback.pause(),
  settings: () => app.playback.again(),
});
const hud = new Hud();
const about = new About((id) => app.api.describe(id));
const panelBox = byId("panel", HTMLElement);
const host = {
  view: () => app.view(),
  explicitView: () => app.explicitView(),
  atRest: () => isSettled(canvas.dataset) && !app.playback.running,
  change: (patch: Record<string, unknown>) => app.change(patch),
  quietly: (run: () => void) => app.undoControl.quietly(run),
  dataset: () => app.dataset(),
  maps: app.maps,
  api: app.api,
  playing: () => app.playback.running,
  frame: () => viewport.frame,
};
const comparable = {
  others: () => otherDatasets(app.dataset(), list.all),
  openOther: async (id: string): Promise<string> => {
    const entry = list.has(id) ? null : entryOf(id, list.all);
    if (entry === null) return id;
    const sleep = (ms: number) => new Promise<void>((done) => clock.setTimeout(done, ms));
    return (await openEntry(app.api, entry, () => true, sleep))?.id ?? id;
  },
};
const beside = new BesidePicture(document.baseURI, clock, {
  ...comparable,
  view: () => app.view(),
  drawn: () => app.hasPicture(),
  answered: () => app.isOpen() && canvas.dataset.rev === canvas.dataset.wanted,
  cameras: app.cameras,
  maps: app.maps,
  dataset: () => app.dataset(),
  explicitView: () => app.explicitView(),
  openView: (view) => app.openView(view),
  edited: () => app.saveAddress(),
});
const besideMoves = new MoveQueue(beside.cameras, requestFrame);
const besideTurn = new Turn(besideMoves, turnHost);
new PointerInput(beside.canvas, besideMoves, { clicked: () => {}, takesWheel: () => true });
// Whether keys move the second picture alone: it has the focus and a camera of its own.
const besideIsSteered = () => beside.hasOwnCamera && document.activeElement === beside.canvas;
const steered = () => (besideIsSteered() ? besideMoves : moves);
const panels = new Panels(panelBox, host, {
  ...comparable,
  compare,
  reset: () => app.resetAll(),
  openView: (view) => app.openView(view),
  camera: () => app.cameras.camera(),
  setCamera: (camera) => app.cameras.setCamera(camera),
  probed: () => probe.show(),
  cropped: () => regionBox.show(),
  flowing: () => app.isFlowing(),
  flow: (on) => app.flow(on),
});

const probe = new Probe(
  {
    api: app.api,
    camera: () => app.cameras.camera(),
    view: () => app.view(),
    dataset: () => app.dataset(),
    aspect: () => canvas.clientWidth / canvas.clientHeight,
    controls: () => panels.probe,
  },
  document.querySelector<SVGSVGElement>("#probe-mark")!,
  byId("probe-button", HTMLButtonElement),
);

const regionBox = new RegionBox(document.querySelector<SVGSVGElement>("#region-box")!, {
  on: () => app.isOpen() && panels.cropping(),
  camera: () => app.cameras.camera(),
  view: () => app.view(),
  explicitView: () => app.explicitView(),
  dataset: () => app.dataset(),
  change: (patch) => app.change(patch),
  ready: () => app.cameras.ready(),
});
const reference = makeReference(canvas, () => app.view());
const hover = new HoverView(
  canvas,
  byId("hover", HTMLElement),
  document.querySelector<SVGSVGElement>("#hover-ring")!,
  { ...host, find: (at) => probe.find(at) },
);
const list = new DatasetList(byId("dataset", HTMLSelectElement));
const datasets = byId("datasets", HTMLDialogElement);
const files = new FileBrowser({
  api: app.api,
  sleep: (ms) => new Promise((done) => window.setTimeout(done, ms)),
  opened: async (id) => {
    list.set(await app.api.datasets());
    datasets.close();
    app.open(id);
  },
});
const cards = new Cards(datasets, byId("cards", HTMLElement), byId("datasets-note", HTMLElement), {
  api: app.api,
  list,
  files,
  current: () => (app.isOpen() ? app.dataset().id : undefined),
  open: (id) => app.open(id),
});
const help = byId("help", HTMLDialogElement);
const login = new Login(document.baseURI, () => app.connectNow());
const status = new Status();
const pictures: FileTarget = {
  open: (view) => app.openView(view),
  refuse: (text) => status.error("picture", text),
};
const openSaving = saveDialog(
  {
    isOpen: () => app.isOpen(),
    explicitView: () => app.explicitView(),
    view: () => app.view(),
    camera: () => app.cameras.camera(),
    dataset: () => app.dataset(),
    maps: app.maps,
    size: () => [canvas.clientWidth, canvas.clientHeight],
    pixelsMax: () => viewport.pixelsMax,
    beside: () => beside.kept,
    openSaved: (view, kept) => {
      app.openView(view);
      beside.open(kept);
    },
    files: pictures,
  },
  document.baseURI,
);
if (!embedded) takeDrops(byId("drop-hint", HTMLElement), pictures);

// Whether the canvas shows the final picture of the newest view.
function isSettled({ state, rev, wanted }: DOMStringMap): boolean {
  return state === "final" && rev === wanted;
}

function togglePanel(): void {
  const button = byId("panel-button", HTMLButtonElement);
  const hadFocus = panelBox.contains(document.activeElement);
  const hidden = document.documentElement.classList.toggle("no-panel");
  button.setAttribute("aria-expanded", String(!hidden));
  if (hidden && hadFocus) button.focus();
}

// On phones the room is for the pictures.
function compare(): void {
  beside.toggle();
  const phone = "(max-width: 760px), (max-width: 1100px) and (max-height: 560px)";
  if (beside.suffix !== "" && window.matchMedia(phone).matches) foldPanel();
}

function foldPanel(): void {
  if (!document.documentElement.classList.contains("no-panel")) togglePanel();
}

function toggleBesideProjection(): void {
  besideMoves.push((camera) =>
    withProjection(camera, camera.projection === "perspective" ? "orthographic" : "perspective"),
  );
}

const movingKeys = cameraKeys.map(({ move, ...named }) => ({
  ...named,
  run: ({ shiftKey }: KeyboardEvent) => steered().push(move(shiftKey)),
}));

const bindings: Binding[] = [
  ...movingKeys,
  {
    keys: ["Home", "0"],
    shown: "0",
    does: "whole volume or slice, upright",
    run: () => (besideIsSteered() ? beside.resetCamera() : app.cameras.reset()),
  },
  ...looks.map(({ key, name, angles }) => ({
    keys: [key],
    shown: key,
    does: `view ${name}`,
    run: () => lookFrom(angles),
  })),
  {
    keys: ["o"],
    shown: "o",
    does: "perspective or orthographic",
    run: () => (besideIsSteered() ? toggleBesideProjection() : app.cameras.toggleProjection()),
  },
  {
    keys: [" "],
    shown: "space",
    does: "play (shift: backward) or pause",
    run: (event) => timeBar.toggle(event.shiftKey ? -1 : 1),
  },
  { keys: ["["], shown: "[", does: "previous step", run: () => app.seek(timeBar.neighbour(-1)) },
  { keys: ["]"], shown: "]", does: "next step", run: () => app.seek(timeBar.neighbour(1)) },
  { keys: ["{"], shown: "{", does: "first step", run: () => app.seek(0) },
  { keys: ["}"], shown: "}", does: "last step", run: () => app.seek(timeBar.steps - 1) },
  { keys: ["Mod+z"], shown: modText("z"), does: "undo", run: () => app.undoControl.undo() },
  {
    keys: ["Mod+Shift+z", "Mod+y"],
    shown: modText("y"),
    does: "redo (or shift with undo)",
    run: () => app.undoControl.redo(),
  },
  { keys: ["i"], shown: "i", does: "probe: values at a point", run: () => probe.toggle() },
  {
    keys: ["r"],
    shown: "r (hold)",
    does: "reference: this view without error",
    run: () => reference.hold(),
    ends: () => reference.release(),
  },
  { keys: ["Escape"], shown: "esc", does: "discard the reference", run: () => reference.drop() },
  {
    keys: ["I"],
    shown: "shift i",
    does: "values under the cursor",
    run: () => {
      hoverOn.set(!hoverOn.value);
      panels.refresh();
    },
  },
  { keys: ["\\"], shown: "\\", does: "frame times and errors", run: () => hud.toggle() },
  { keys: ["e"], shown: "e", does: "errors as RMSE or PSNR", run: toggleErrorMetric },
  { keys: ["a"], shown: "a", does: "about this dataset", run: showAbout },
  { keys: ["d"], shown: "d", does: "datasets", run: () => cards.show() },
  { keys: ["c"], shown: "c", does: "compare: a second picture", run: compare },
  { keys: ["p"], shown: "p", does: "panel", run: togglePanel },
  { keys: ["s"], shown: "s", does: "save: pictures and views", run: openSaving },
  { keys: ["?"], shown: "?", does: "this list", run: () => help.showModal() },
];

function showAbout(): void {
  if (app.isOpen()) about.show(app.dataset());
}

// In place of the cards.
function showNothing(why = "the server has no dataset open"): void {
  status.clearError();
  status.empty(why);
}

function fillHelp(): void {
  const list = byId("help-keys", HTMLElement);
  for (const binding of bindings) {
    list.append(make("dt", "", binding.shown), make("dd", "", binding.does));
  }
}

function onClick(id: string, run: () => void): void {
  byId(id, HTMLButtonElement).addEventListener("click", run);
}

if (embedded) {
  const shown = () => (app.isOpen() ? app.explicitView() : null);
  openLink(document.baseURI, shown).hidden = false;
}
app.undoControl.bind(
  byId("undo-button", HTMLButtonElement),
  byId("redo-button", HTMLButtonElement),
);
app.undoControl.watch(document);
bindKeys(embedded ? embeddedKeys(bindings) : bindings, document);
fillHelp();
onClick("datasets-button", () => cards.show());
onClick("about-button", showAbout);
onClick("cancel-button", () => app.cancelLoading());
onClick("retry-button", () => app.connectNow());
onClick("compare-button", compare);
onClick("share-button", () => void app.copyLink());
onClick("save-button", openSaving);
panelSheet(byId("panel-handle", HTMLButtonElement), foldPanel);
onClick("help-button", () => help.showModal());
onClick("panel-button", togglePanel);
onClick("hud-button", () => hud.toggle());
onClick("reset-button", () => app.cameras.reset());
onClick("isometric-button", () => lookFrom(looks.at(-1)!.angles));
onClick("projection-button", () => app.cameras.toggleProjection());

window.addEventListener("beforeprint", () => {
  const caption = app.isOpen() ? pictureCaption(app.dataset(), app.view().step ?? 0) : "";
  byId("print-caption", HTMLElement).textContent = caption;
});

app.start({
  viewport,
  hud,
  // The embedded view has one picture; a second one in its address is left out.
  beside: embedded ? { follow: () => {}, suffix: "", take: (hash) => takeBeside(hash)[0] } : beside,
  legend: new Legend(byId("legend", HTMLElement), app.maps),
  gizmo: new Gizmo(byId("gizmo", HTMLElement), lookFrom),
  probe,
  hover,
  panels,
  timeBar,
  list,
  cards: embedded ? { show: (why) => showNothing(why) } : cards,
  status,
  // A page around the frame could show a login of its own, so there is none in it.
  login: embedded ? { ask: () => {}, done: () => {} } : login,
  picker: byId("dataset", HTMLSelectElement),
  entries: new EntryPicker(byId("entries", HTMLElement), (dimension, value) =>
    app.chooseEntry(dimension, value),
  ),
  facts: byId("facts", HTMLElement),
});
