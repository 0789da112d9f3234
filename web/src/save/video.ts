// Pictures -> a WebM video with the browser's MediaRecorder, which records in real time: the frames
// are painted on a canvas one after another.
import { waitFor } from "../wire/frame_request";
import { clamp } from "../base/values";

const type = "video/webm";

export const canRecord = (): boolean =>
  typeof MediaRecorder === "function" &&
  "captureStream" in HTMLCanvasElement.prototype &&
  MediaRecorder.isTypeSupported(type);

export async function recordVideo(
  frames: Blob[],
  fps: number,
  signal: AbortSignal,
  report: (done: number) => void,
): Promise<Blob> {
  const canvas = document.createElement("canvas");
  const context = canvas.getContext("2d", { alpha: false })!;
  const paint = async (frame: Blob): Promise<void> => {
    const bitmap = await createImageBitmap(frame);
    if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) {
      canvas.width = bitmap.width;
      canvas.height = bitmap.height;
    }
    context.drawImage(bitmap, 0, 0);
    bitmap.close();
  };
  await paint(frames[0]!); // the stream adopts the canvas size
  const stream = canvas.captureStream(0);
  const track = stream.getVideoTracks()[0] as CanvasCaptureMediaStreamTrack;
  const bits = canvas.width * canvas.height * fps * 0.25;
  const videoBitsPerSecond = clamp(bits, 2.5e6, 4e7);
  const recorder = new MediaRecorder(stream, { mimeType: type, videoBitsPerSecond });
  const parts: Blob[] = [];
  recorder.ondataavailable = ({ data }) => parts.push(data);
  const ended = new Promise<void>((resolve, reject) => {
    recorder.onstop = () => resolve();
    recorder.onerror = () => reject(new Error("The browser cannot record this video."));
  });
  ended.catch(() => {});
  try {
    recorder.start();
    const start = performance.now();
    // The last frame is requested again at its end, so that it lasts as long as the others.
    for (let n = 0; n <= frames.length; n++) {
      await waitFor(start + (1000 * n) / fps - performance.now(), signal);
      if (n < frames.length) await paint(frames[n]!);
      track.requestFrame();
      report(n);
    }
    recorder.stop();
    await ended;
  } finally {
    if (recorder.state !== "inactive") recorder.stop();
    track.stop();
  }
  return new Blob(parts, { type });
}
