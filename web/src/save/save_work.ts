// The jobs of the Save dialog: view and choices -> a picture, or the frames of an animation in one
// file, rendered by the server.
import type { Beside } from "../view/beside";
import type { Camera, Dataset, View } from "@windsplat/client";
import { type ColorMaps, drawFrame, inOrder, type Asked } from "@windsplat/client/parts";
import {
  frameCount,
  framesMax,
  frameView,
  pictureView,
  progressText,
  type Animation,
  type ExportSize,
} from "./export_views";
import { isDocument, mediaTypes, withServerLegend, type PictureFormat } from "./picture_formats";
import type { Job } from "./save_jobs";
import {
  finishJpeg,
  finishPicture,
  hasOwnLegend,
  type FileTarget,
  type Shown,
} from "./saved_picture";
import { VideoFile } from "./video";
import { Zip } from "./zip";

export interface SaveHost {
  isOpen(): boolean; // a dataset is open and the view refers to it
  explicitView(): View;
  view(): View; // with all defaults
  camera(): Camera | null;
  dataset(): Dataset;
  maps: ColorMaps;
  size(): [width: number, height: number]; // CSS pixels
  pixelsMax(): number; // the server's limit for one picture
  files: FileTarget;
  beside(): Beside | null; // the second picture; null: there is none
  openSaved(view: View, beside: Beside | null): void;
}

const safeName = (name: string): string => name.replace(/[^\w.-]+/g, "_");

export interface SaveSetting {
  host: SaveHost;
  baseUri: string;
  pixels: ExportSize;
  legend: Shown | null; // null: without one
  dotsPerInch: number; // the size of pictures in print
}

const draw = (baseUri: string, view: View, signal: AbortSignal, asked: Asked = {}): Promise<Blob> =>
  drawFrame((url, options) => fetch(url, options), baseUri, view, signal, asked);

// `size`: the chosen size, for the file name.
export function pictureJob(setting: SaveSetting, format: PictureFormat, size: string): Job {
  const view = pictureView(setting.host.explicitView(), setting.pixels);
  const suffix = format === "jpeg" ? "jpg" : format;
  return {
    name: `${safeName(view.dataset ?? "")}-${view.step}-${size}.${suffix}`,
    work: (signal, report) => {
      report("drawing…");
      return drawPicture(setting, format, view, signal);
    },
  };
}

async function drawPicture(
  { baseUri, pixels, legend, dotsPerInch }: SaveSetting,
  format: PictureFormat,
  view: View,
  signal: AbortSignal,
): Promise<Blob> {
  const type = mediaTypes[format];
  if (isDocument(format)) {
    const shown = legend === null ? view : withServerLegend(view);
    return draw(baseUri, shown, signal, { type, dotsPerInch });
  }
  const asked = hasOwnLegend(view, legend) ? {} : { type };
  const drawn = await draw(baseUri, view, signal, asked);
  const finish = format === "jpeg" ? finishJpeg : finishPicture;
  return new Blob([await finish(drawn, view, pixels, legend, dotsPerInch)], { type });
}

export function animationJob(setting: SaveSetting, chosen: Animation, video: boolean): Job {
  const { host, baseUri, pixels, legend, dotsPerInch } = setting;
  const whole = pictureView(host.explicitView(), pixels);
  const camera = host.camera()!;
  const count = frameCount(chosen);
  const zip = new Zip(new Date());
  const film = video ? new VideoFile(chosen.fps) : null;
  const name = safeName(`${whole.dataset}-${chosen.over}`);
  const viewOf = (n: number): View => frameView(whole, camera, chosen, n);
  const work: Job["work"] = async (signal, report) => {
    if (count > framesMax) throw new Error(`At most ${framesMax} frames.`);
    const start = performance.now();
    signal.addEventListener("abort", () => film?.close(), { once: true });
    const reportFrame = (n: number) =>
      report(progressText(n, count, performance.now() - start), n / count);
    reportFrame(0);
    await inOrder(
      count,
      (n) => draw(baseUri, viewOf(n), signal),
      async (drawn, n) => {
        const picture = await finishPicture(drawn, viewOf(n), pixels, legend, dotsPerInch);
        signal.throwIfAborted();
        if (film !== null) await film.add(new Blob([picture], { type: "image/png" }));
        else zip.add(`${name}-${String(n).padStart(4, "0")}.png`, picture);
        reportFrame(n + 1);
      },
    );
    return film === null ? zip.finish() : await film.finish();
  };
  return { name: `${name}.${video ? "webm" : "zip"}`, work };
}
