// The Save dialog: choices -> pictures, animations and saved views, rendered by the server and
// downloaded by the browser. One job at a time, with progress and error text.
import { byId } from "../base/dom";
import {
  exportSize,
  frameCount,
  framesMax,
  millimetres,
  scaleOf,
  type Animation,
  type AnimationKind,
  type ExportSize,
} from "./export_views";
import { savedViewList } from "./saved_view_list";
import { aboutFormat, type PictureFormat } from "./picture_formats";
import { button, Jobs, part } from "./save_jobs";
import { animationJob, pictureJob, type SaveHost, type SaveSetting } from "./save_work";
import { openFile } from "./saved_picture";
import { clamp } from "@windsplat/client/parts";
import { hasVideoEncoder } from "./video";

const pictureScaleMax = 4;
const animationScaleMax = 2;
const paperWidth = 170; // mm, between the margins of A4
const about: Record<string, string> = {
  zip: "Every frame lossless, with its view inside.",
  webm: "One file for players, not lossless; every frame at its time.",
};

const input = (id: string) => byId(`save-${id}`, HTMLInputElement);
const select = (id: string) => byId(`save-${id}`, HTMLSelectElement);
const fields = (id: string) => byId(`save-${id}`, HTMLFieldSetElement);

// Sets the defaults for another dataset.
function fill(host: SaveHost, dialog: HTMLElement): void {
  const { id, steps } = host.dataset();
  const filled = `${id} ${steps.count}`;
  if (dialog.dataset.of === filled) return;
  dialog.dataset.of = filled;
  const last = steps.count - 1;
  for (const end of ["from", "to"]) input(end).max = String(steps.count);
  const first = { from: 1, to: steps.count, every: 1, frames: 48, fps: last < 1 ? 12 : 5 };
  for (const [name, value] of Object.entries(first)) input(name).value = String(value);
  select("over").value = last < 1 ? "turn" : "steps";
}

const formatChosen = (): PictureFormat => select("format").value as PictureFormat;

const hasWidth = (): boolean => ["mm", "px"].includes(select("scale").value);

// Pixels per CSS pixel.
function scaleChosen(host: SaveHost): number {
  const chosen = select("scale").value;
  if (chosen !== "mm" && chosen !== "px") return Number(chosen);
  return scaleOf(number("width"), chosen, dotsPerInchChosen(), host.size()[0]);
}

// For the names of files.
function sizeName(): string {
  const chosen = select("scale").value;
  return hasWidth() ? `${input("width").value}${chosen}` : `${chosen}x`;
}

function sizeChosen(host: SaveHost, scaleMax: number): ExportSize {
  const scale = scaleChosen(host);
  const wanted = hasWidth() ? scale : Math.min(scale, scaleMax);
  return exportSize(...host.size(), wanted, host.pixelsMax());
}

// Typed values are rounded and clamped.
function number(id: string): number {
  const { value, min, max } = input(id);
  const most = max === "" ? framesMax : Number(max);
  const right = clamp(Math.round(Number(value)), Number(min), most);
  input(id).value = String(right);
  return right;
}

const dotsPerInchChosen = (): number => number("dpi");

// A width in pixels starts at that of the page, one in mm at that of a page of paper.
function offerWidth(host: SaveHost): void {
  if (!hasWidth()) return;
  const millimetre = select("scale").value === "mm";
  input("width").value = String(millimetre ? paperWidth : Math.round(host.size()[0]));
}

function animationChosen(): Animation {
  const over = select("over").value as AnimationKind;
  const [from, to, every] = [number("from") - 1, number("to") - 1, number("every")];
  return { over, from, to, every, frames: number("frames"), fps: number("fps") };
}

function showChoices(host: SaveHost, dialog: HTMLElement, running: boolean): void {
  const open = host.isOpen();
  fields("choices").disabled = running || !open;
  fields("views").disabled = running;
  button("keep-button").disabled = !open;
  if (!open) return;
  part("first").hidden = host.beside() === null;
  const vector = host.view().vector;
  const [steps, , flow] = select("over").options;
  steps!.disabled = host.dataset().steps.count < 2;
  flow!.disabled = !vector?.field || vector.motion?.mode !== "phase";
  if (select("over").selectedOptions[0]?.disabled) select("over").value = "turn";
  const chosen = animationChosen();
  for (const choice of dialog.querySelectorAll<HTMLElement>(".of-steps, .of-frames")) {
    choice.hidden = choice.classList.contains("of-steps") !== (chosen.over === "steps");
  }
  dialog.querySelector<HTMLElement>(".of-width")!.hidden = !hasWidth();
  part("unit").textContent = select("scale").value === "mm" ? "mm" : "pixels";
  const { width, height, scale } = sizeChosen(host, pictureScaleMax);
  const limited = scale < scaleChosen(host) ? ", the server's limit" : "";
  const printed = (pixels: number): string =>
    Math.round(millimetres(pixels, dotsPerInchChosen())).toString();
  part("size").textContent =
    `${width} × ${height} pixels${limited}, ${printed(width)} × ${printed(height)} mm in print.`;
  part("format-about").textContent = aboutFormat[formatChosen()];
  const count = frameCount(chosen);
  const small = sizeChosen(host, animationScaleMax);
  part("about").textContent =
    `${count} frame${count === 1 ? "" : "s"} of ${small.width} × ${small.height} pixels, ` +
    `${Number((count / chosen.fps).toFixed(1))} s. ${about[select("as").value]}`;
}

// Returns the function that opens the dialog.
export function saveDialog(host: SaveHost, baseUri: string): () => void {
  const dialog = byId("save", HTMLDialogElement);
  const jobs = new Jobs(dialog, () => show());
  const show = (): void => showChoices(host, dialog, jobs.running);
  const showSavedViews = savedViewList(host, baseUri, dialog, jobs);

  const setting = (scaleMax: number): SaveSetting => ({
    host,
    baseUri,
    pixels: sizeChosen(host, scaleMax),
    legend: input("legend").checked
      ? { dataset: host.dataset(), view: host.view(), maps: host.maps }
      : null,
    dotsPerInch: dotsPerInchChosen(),
  });

  const savePicture = (): Promise<void> =>
    jobs.run(pictureJob(setting(pictureScaleMax), formatChosen(), sizeName()));

  const saveAnimation = (): Promise<void> => {
    const chosen = animationChosen();
    return jobs.run(
      animationJob(setting(animationScaleMax), chosen, select("as").value === "webm"),
    );
  };

  const webm = select("as").options[1]!;
  webm.disabled = !hasVideoEncoder();
  if (webm.disabled) webm.text += " (needs WebCodecs: https or localhost)";
  fields("choices").addEventListener("change", show);
  select("scale").addEventListener("change", () => offerWidth(host));
  button("save-picture").addEventListener("click", () => void savePicture());
  button("save-animation").addEventListener("click", () => void saveAnimation());
  const chooser = byId("picture-file", HTMLInputElement);
  button("open-picture").addEventListener("click", () => chooser.click());
  chooser.addEventListener("change", () => {
    dialog.close();
    void openFile(chooser.files?.[0], host.files);
    chooser.value = ""; // allows choosing the same file again
  });

  return () => {
    if (dialog.open) return;
    if (host.isOpen()) fill(host, dialog);
    jobs.clear();
    show();
    showSavedViews();
    dialog.showModal();
  };
}
