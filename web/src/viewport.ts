// Encoded frames -> canvas. Always the newest: a frame that is decoded after a newer one was drawn
// is not shown. What is shown is also told by data attributes of the canvas (seq, rev, step, level,
// final), for tests and style sheets alike.
import type { Frame, FrameHeader } from "./protocol";

export interface DrawnFrame {
  header: FrameHeader;
  decodeMs: number;
  arrivedAt: number; // performance.now()
}

export interface ViewportEvents {
  drawn(frame: DrawnFrame): void;
  stale(header: FrameHeader, decodeMs: number): void; // decoded, not shown
  broken(header: FrameHeader): void; // could not be decoded
  resized(width: number, height: number): void; // pixels to render
}

const pixelsMax = 3.7e6; // a picture of 2560 x 1440; more is not worth its time
const edgeMax = 4096;
const densityMax = 2;

// Pixels to render for an element of this size; never more than it can show.
export function pictureSize(
  cssWidth: number,
  cssHeight: number,
  density: number,
): [number, number] {
  const wanted = Math.min(Math.max(density, 1), densityMax);
  const area = Math.max(1, cssWidth * cssHeight);
  const scale = Math.min(
    wanted,
    Math.sqrt(pixelsMax / area),
    edgeMax / Math.max(cssWidth, cssHeight, 1),
  );
  return [Math.max(16, Math.round(cssWidth * scale)), Math.max(16, Math.round(cssHeight * scale))];
}

export class Viewport {
  private drawnSeq = 0;
  private readonly context: CanvasRenderingContext2D;
  private session = 0;

  constructor(
    readonly canvas: HTMLCanvasElement,
    private readonly events: ViewportEvents,
  ) {
    const context = canvas.getContext("2d", { alpha: false });
    if (context === null) throw new Error("the browser has no 2-D canvas");
    this.context = context;
    new ResizeObserver(() => this.report()).observe(canvas);
    window.addEventListener("resize", () => this.report());
  }

  size(): [number, number] {
    const { clientWidth, clientHeight } = this.canvas;
    return pictureSize(clientWidth, clientHeight, window.devicePixelRatio);
  }

  // seq begins anew with each session.
  newSession(): void {
    this.session += 1;
    this.drawnSeq = 0;
  }

  async show(frame: Frame): Promise<void> {
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
    if (session === this.session && header.seq > this.drawnSeq) {
      this.drawnSeq = header.seq;
      this.draw(bitmap, header);
      this.events.drawn({ header, decodeMs, arrivedAt });
    } else if (session === this.session) {
      this.events.stale(header, decodeMs);
    }
    bitmap.close();
  }

  private draw(bitmap: ImageBitmap, header: FrameHeader): void {
    const { canvas, context } = this;
    const [width, height] = this.size();
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    // A frame of the size before a resize keeps its shape; rounding of a coarser level does not
    // count as another shape.
    const scale = Math.min(width / bitmap.width, height / bitmap.height);
    const same = Math.abs((bitmap.width * height) / (bitmap.height * width) - 1) < 0.03;
    const w = same ? width : bitmap.width * scale;
    const h = same ? height : bitmap.height * scale;
    if (!same) context.clearRect(0, 0, width, height);
    context.imageSmoothingQuality = "high";
    context.drawImage(bitmap, (width - w) / 2, (height - h) / 2, w, h);
    canvas.dataset.seq = String(header.seq);
    canvas.dataset.rev = String(header.rev);
    canvas.dataset.step = String(header.step);
    canvas.dataset.level = String(header.level);
    canvas.dataset.final = String(header.final);
  }

  private report(): void {
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth > 0 && clientHeight > 0) this.events.resized(...this.size());
  }
}
