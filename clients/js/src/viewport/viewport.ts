// Encoded frames -> canvas. Only the newest is shown: a frame decoded after a newer one was drawn
// is discarded, and a frame replaced while waiting is not decoded, so at most three are in memory.
// Frames of video are all decoded.
// Frames of any size fill the canvas. The displayed state is also published as data attributes of
// the canvas (seq, rev, step, state, level, width, height) for tests and style sheets.
import { isPrinting } from "../base/resizing";
import { frameState } from "./frame_state";
import type { Frame, FrameHeader } from "../wire/protocol";
import { clamp } from "../base/values";
import { VideoPictures } from "./video_pictures";

export interface DrawnFrame {
  header: FrameHeader;
  decodeMs: number;
  arrivedAt: number; // performance.now()
  drawnAt: number; // on the same clock
}

export interface ViewportEvents {
  // decodeMs: time since arrival; called for every decoded frame, shown or not
  decoded(header: FrameHeader, decodeMs: number): void;
  drawn(frame: DrawnFrame): void;
  broken(header: FrameHeader): void; // the frame could not be decoded
  videoFailed(): void; // frames of video cannot be decoded
  resized(): void; // size() may have changed
}

const pixelsMax = 3.7e6; // a picture of 2560 x 1440; more would not justify the rendering time
const edgeMax = 4096;
const densityMax = 2;
const decodesMax = 2; // concurrent decodes; as many as the server sends without an acknowledgement

// Pixels to render for an element of this size; never more than the element can display.
export function pictureSize(
  cssWidth: number,
  cssHeight: number,
  density: number,
  serverPixelsMax: number,
): [number, number] {
  const wanted = clamp(density, 1, densityMax);
  const area = Math.max(1, cssWidth * cssHeight);
  const scale = Math.min(
    wanted,
    Math.sqrt(Math.min(pixelsMax, serverPixelsMax) / area),
    edgeMax / Math.max(cssWidth, cssHeight, 1),
  );
  const pixels = (edge: number) => Math.max(16, Math.floor(edge * scale));
  return [pixels(cssWidth), pixels(cssHeight)];
}

export interface Size {
  width: number;
  height: number;
}

// Rectangle (x, y, width, height) of a picture on the canvas: the whole canvas if both have the
// same aspect ratio, allowing for the rounding of coarse pictures to whole pixels; otherwise
// centred with the picture's own aspect ratio.
export function pictureRect(canvas: Size, picture: Size): [number, number, number, number] {
  const { width, height } = canvas;
  const expected = (picture.width * height) / width;
  if (Math.abs(expected - picture.height) <= Math.max(1, 0.03 * picture.height)) {
    return [0, 0, width, height];
  }
  const scale = Math.min(width / picture.width, height / picture.height);
  const w = picture.width * scale;
  const h = picture.height * scale;
  return [(width - w) / 2, (height - h) / 2, w, h];
}

export class Viewport {
  pixelsMax = pixelsMax; // limit of the server
  private drawn: FrameHeader | null = null; // newest drawn frame of this session
  private readonly context: CanvasRenderingContext2D;
  private onScreen: [number, number] | null = null; // size() when it was asked for last
  private session = 0;
  private decoding = 0;
  // the newest frame while decodesMax others are being decoded
  private waiting: Frame | null = null;
  private readonly video: VideoPictures;

  constructor(
    readonly canvas: HTMLCanvasElement,
    private readonly events: ViewportEvents,
    private readonly signal?: AbortSignal, // ends the watch of the element's size
  ) {
    const context = canvas.getContext("2d", { alpha: false });
    if (context === null) throw new Error("the browser has no 2-D canvas");
    this.context = context;
    this.video = new VideoPictures(() => this.events.videoFailed());
    const sizes = new ResizeObserver(() => this.report());
    sizes.observe(canvas);
    window.addEventListener("resize", () => this.report(), this.until());
    signal?.addEventListener("abort", () => sizes.disconnect(), { once: true });
    this.watchDensity();
  }

  // Watches for another screen or page zoom; each media query matches one pixel density only.
  private watchDensity(): void {
    const query = window.matchMedia(`(resolution: ${window.devicePixelRatio}dppx)`);
    const changed = () => {
      this.watchDensity();
      this.report();
    };
    query.addEventListener("change", changed, { once: true, ...this.until() });
  }

  private until(): { signal?: AbortSignal } {
    return this.signal === undefined ? {} : { signal: this.signal };
  }

  // Header of the frame on the canvas; null: none of this session.
  get frame(): FrameHeader | null {
    return this.drawn;
  }

  size(): [number, number] {
    const { clientWidth, clientHeight } = this.canvas;
    return pictureSize(clientWidth, clientHeight, window.devicePixelRatio, this.pixelsMax);
  }

  // The size to ask the server for: on paper that of the screen.
  askedSize(): [number, number] {
    if (this.onScreen === null || !isPrinting()) this.onScreen = this.size();
    return this.onScreen;
  }

  // seq restarts with each session.
  newSession(serverPixelsMax: number): void {
    this.pixelsMax = serverPixelsMax;
    this.session += 1;
    this.drawn = null;
    this.waiting = null;
    this.video.end();
  }

  // Nothing more is shown.
  end(): void {
    this.newSession(this.pixelsMax);
  }

  // A replaced frame is not acknowledged itself: an acknowledgement covers all earlier frames.
  async show(frame: Frame): Promise<void> {
    if (frame.header.codec === "h264") return this.showVideo(frame);
    if (this.decoding >= decodesMax) {
      this.waiting = frame;
      return;
    }
    this.decoding += 1;
    try {
      await this.decode(frame);
    } finally {
      this.decoding -= 1;
    }
    const next = this.waiting;
    this.waiting = null;
    if (next !== null) await this.show(next);
  }

  private async decode(frame: Frame): Promise<void> {
    const arrivedAt = performance.now();
    const session = this.session;
    const { header } = frame;
    let bitmap: ImageBitmap;
    try {
      bitmap = await createImageBitmap(
        new Blob([frame.picture], { type: `image/${header.codec}` }),
      );
    } catch {
      if (session === this.session) this.events.broken(header);
      return;
    }
    if (session === this.session) this.take(bitmap, header, arrivedAt);
    bitmap.close();
  }

  private async showVideo(frame: Frame): Promise<void> {
    const arrivedAt = performance.now();
    const session = this.session;
    const picture = await this.video.decode(frame);
    if (session === this.session) {
      if (picture !== null) this.take(picture, frame.header, arrivedAt);
      else this.events.decoded(frame.header, 0); // returns its credit
    }
    picture?.close();
  }

  private take(picture: ImageBitmap | VideoFrame, header: FrameHeader, arrivedAt: number): void {
    const decodeMs = performance.now() - arrivedAt;
    this.events.decoded(header, decodeMs);
    if (header.seq <= (this.drawn?.seq ?? 0)) return;
    this.draw(picture, header);
    this.drawn = header;
    this.events.drawn({ header, decodeMs, arrivedAt, drawnAt: performance.now() });
  }

  // A picture of video has even sides; the header tells how much of it belongs to the frame.
  private draw(bitmap: ImageBitmap | VideoFrame, header: FrameHeader): void {
    const { canvas, context } = this;
    const [width, height] = this.size();
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width; // clears the canvas; the picture is drawn before the next repaint
      canvas.height = height;
    }
    const place = pictureRect(canvas, header);
    if (place[2] < width || place[3] < height) context.clearRect(0, 0, width, height);
    context.imageSmoothingEnabled = true;
    // Without a GPU, high-quality scaling takes as long as a display frame, so it is used only at
    // rest.
    const state = frameState(header, this.drawn);
    context.imageSmoothingQuality = state === "moving" ? "low" : "high";
    context.drawImage(bitmap, 0, 0, header.width, header.height, ...place);
    canvas.dataset.seq = String(header.seq);
    canvas.dataset.rev = String(header.rev);
    canvas.dataset.step = String(header.step);
    canvas.dataset.state = state;
    canvas.dataset.level = String(header.level);
    canvas.dataset.width = String(header.width);
    canvas.dataset.height = String(header.height);
  }

  private report(): void {
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth > 0 && clientHeight > 0) this.events.resized();
  }
}
