// Encoded frames -> canvas. Always the newest: a frame that is decoded after a newer one was drawn
// is not shown, and one that a newer overtakes before its turn is not decoded, so that however fast
// frames come no more than three are held. Frames of any size fill the canvas. What is shown is
// also published as data attributes of the canvas (seq, rev, step, state, level, width, height),
// for tests and style sheets.
import { frameState } from "./frame_text";
import type { Frame, FrameHeader } from "../wire/protocol";
import { clamp } from "../base/values";

export interface DrawnFrame {
  header: FrameHeader;
  decodeMs: number;
  arrivedAt: number; // performance.now()
  drawnAt: number; // the same clock
}

export interface ViewportEvents {
  decoded(header: FrameHeader, decodeMs: number): void; // since it came, shown or not
  drawn(frame: DrawnFrame): void;
  broken(header: FrameHeader): void; // could not be decoded
  resized(): void; // size() may be another
}

const pixelsMax = 3.7e6; // a picture of 2560 x 1440; more is not worth its time
const edgeMax = 4096;
const densityMax = 2;
const decodesMax = 2; // at a time; as many as the server sends without an answer

// Pixels to render for an element of this size; never more than it can show.
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

// Where a picture goes on the canvas: all over it if it is of the same shape, but for what rounding
// to whole pixels does to a coarse one; otherwise in its own shape in the middle. x, y, width,
// height.
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
  pixelsMax = pixelsMax; // what the server draws
  private drawn: FrameHeader | null = null; // of this session
  private readonly context: CanvasRenderingContext2D;
  private session = 0;
  private decoding = 0;
  private waiting: Frame | null = null; // the newest, while as many as may be are decoded

  constructor(
    readonly canvas: HTMLCanvasElement,
    private readonly events: ViewportEvents,
  ) {
    const context = canvas.getContext("2d", { alpha: false });
    if (context === null) throw new Error("the browser has no 2-D canvas");
    this.context = context;
    new ResizeObserver(() => this.report()).observe(canvas);
    window.addEventListener("resize", () => this.report());
    this.watchDensity();
  }

  // Another screen or another zoom of the page; the query holds for one density only.
  private watchDensity(): void {
    const query = window.matchMedia(`(resolution: ${window.devicePixelRatio}dppx)`);
    const changed = () => {
      this.watchDensity();
      this.report();
    };
    query.addEventListener("change", changed, { once: true });
  }

  // Of the frame on the canvas; null: none of this session.
  get frame(): FrameHeader | null {
    return this.drawn;
  }

  size(): [number, number] {
    const { clientWidth, clientHeight } = this.canvas;
    return pictureSize(clientWidth, clientHeight, window.devicePixelRatio, this.pixelsMax);
  }

  // seq begins anew with each session.
  newSession(serverPixelsMax: number): void {
    this.pixelsMax = serverPixelsMax;
    this.session += 1;
    this.drawn = null;
    this.waiting = null;
  }

  // What is overtaken gets no answer of its own: answers count for every frame before them.
  async show(frame: Frame): Promise<void> {
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
    const decodeMs = performance.now() - arrivedAt;
    if (session === this.session) {
      this.events.decoded(header, decodeMs);
      if (header.seq > (this.drawn?.seq ?? 0)) {
        this.draw(bitmap, header);
        this.drawn = header;
        this.events.drawn({ header, decodeMs, arrivedAt, drawnAt: performance.now() });
      }
    }
    bitmap.close();
  }

  private draw(bitmap: ImageBitmap, header: FrameHeader): void {
    const { canvas, context } = this;
    const [width, height] = this.size();
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width; // empties the canvas, which is not seen before the picture is on it
      canvas.height = height;
    }
    const place = pictureRect(canvas, bitmap);
    if (place[2] < width || place[3] < height) context.clearRect(0, 0, width, height);
    context.imageSmoothingEnabled = true;
    // Without a GPU the better one takes as long as a display frame: only at rest.
    const state = frameState(header, this.drawn);
    context.imageSmoothingQuality = state === "moving" ? "low" : "high";
    context.drawImage(bitmap, ...place);
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
