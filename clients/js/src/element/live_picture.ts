// A view shown on a canvas: a stream, the frames that it sends, and the size and visibility that
// the server is told. Until stop().
import type { Client } from "../client/client";
import type { StreamEvents, ViewStream } from "../client/view_stream";
import { afterResizing } from "../base/resizing";
import { CameraControl } from "../view/camera_control";
import { VideoOffer } from "../viewport/video_offer";
import { Viewport } from "../viewport/viewport";
import { watchPresence } from "../wire/browser_link";
import type { Clock } from "../wire/connection";
import type { View } from "../wire/protocol";

export interface LiveEvents extends Omit<StreamEvents, "frame"> {
  broken(): void; // a frame could not be decoded
}

const clock: Clock = {
  setTimeout: (run, ms) => window.setTimeout(run, ms),
  clearTimeout: (timer) => window.clearTimeout(timer),
  random: () => Math.random(),
};

export class LivePicture {
  readonly stream: ViewStream;
  readonly cameras: CameraControl;
  private readonly viewport: Viewport;
  private readonly video: VideoOffer;
  private readonly ended = new AbortController();
  private inSight = true;
  private sizing = false;
  private refusedRev = 0; // rev of the view that is left after the last refusal

  constructor(canvas: HTMLCanvasElement, client: Client, view: View, events: LiveEvents) {
    const { signal } = this.ended;
    this.viewport = new Viewport(
      canvas,
      {
        decoded: ({ seq }, decodeMs) => this.stream.acknowledge(seq, decodeMs),
        drawn: ({ header }) => this.stream.show(header),
        broken: ({ seq }) => {
          this.stream.acknowledge(seq);
          events.broken();
        },
        videoFailed: () => this.video.failed(),
        resized: afterResizing(() => this.resize()),
      },
      signal,
    );
    const [width, height] = this.viewport.askedSize();
    this.stream = client.stream(
      { ...view, image: { ...view.image, width, height } },
      {
        ...events,
        frame: (frame) => {
          // A frame that cannot be shown must still return its credit to the server.
          this.viewport.show(frame).catch(() => this.stream.acknowledge(frame.header.seq));
        },
        hello: (hello) => {
          this.viewport.newSession(hello.limits.imagePixelsMax);
          this.video.greet();
          this.resize(); // to the limits of this server
          events.hello?.(hello);
        },
        changed: (changed) => {
          if (!this.sizing) events.changed?.(changed);
        },
        refused: (error) => {
          this.refusedRev = this.stream.model.state.rev;
          events.refused?.(error);
        },
      },
      { acknowledge: "manual", clock },
    );
    this.video = new VideoOffer(clock, {
      send: (message) => void this.stream.send(message),
      note: () => {},
      wanted: () => !signal.aborted,
    });
    this.cameras = new CameraControl(this.stream.model, {
      change: (patch) => this.stream.change(patch),
      size: () => this.viewport.size(),
      ready: () => this.stream.connection.ready,
    });
    watchPresence(this.stream.connection, () => this.tellSight(), signal);
    const sight = new IntersectionObserver((entries) => {
      this.inSight = entries.at(-1)!.isIntersecting;
      this.tellSight();
    });
    sight.observe(canvas);
    signal.addEventListener("abort", () => sight.disconnect(), { once: true });
    this.tellSight();
  }

  // Releases the socket and all that watches the page.
  stop(): void {
    this.ended.abort();
    this.stream.close();
    this.viewport.end();
  }

  /** Whether a picture of this session is shown. */
  get hasShown(): boolean {
    return this.viewport.frame !== null;
  }

  /** Whether the last refusal holds: nothing else was asked for since. */
  get hasRefused(): boolean {
    return !this.isAfterRefusal(this.stream.model.state.rev);
  }

  /** Whether the view of this rev was asked for after the last refusal. */
  isAfterRefusal(rev: number): boolean {
    return rev > this.refusedRev;
  }

  private tellSight(): void {
    if (!this.ended.signal.aborted) this.stream.setHidden(document.hidden || !this.inSight);
  }

  private resize(): void {
    if (this.ended.signal.aborted) return;
    const [width, height] = this.viewport.size();
    const { image } = this.stream.explicit;
    if (image?.width === width && image.height === height) return;
    const { state } = this.stream.model;
    const refused = state.rev === this.refusedRev;
    this.sizing = true;
    this.stream.change({ image: { width, height } });
    this.sizing = false;
    if (refused) this.refusedRev = state.rev; // another size is no answer to it
  }
}
