// Announces to the server that this browser decodes video, unless the user or a fault forbids it.
import type { ClientMessage } from "../wire/protocol";
import type { Clock } from "../wire/connection";
import { decodesVideo, videoCodec } from "./video_pictures";

const retryFirstMs = 60_000; // doubled by each failure
const retryMostMs = 3_600_000;

export interface VideoOfferHost {
  send(message: ClientMessage): void;
  note(text: string): void; // to the user
  wanted(): boolean; // the user allows video; call changed() when this has changed
}

export class VideoOffer {
  private broken = false;
  private told = false;
  private retryMs = retryFirstMs;
  private timer: number | undefined;

  constructor(
    private readonly clock: Clock,
    private readonly host: VideoOfferHost,
  ) {}

  changed(): void {
    this.told = false;
    this.retryMs = retryFirstMs;
    this.mend();
    this.announce(true);
  }

  // After each hello; a server that hears nothing sends no video.
  greet(): void {
    this.mend();
    this.announce(false);
  }

  // The decoder failed: pictures as JPEG until the next connection, or for a while.
  failed(): void {
    if (this.broken) return;
    this.broken = true;
    this.announce(true);
    this.timer = this.clock.setTimeout(() => {
      this.mend();
      this.announce(false);
    }, this.retryMs);
    this.retryMs = Math.min(2 * this.retryMs, retryMostMs);
    if (this.told) return;
    this.told = true;
    this.host.note("this browser failed to decode video; moving frames are JPEG for now");
  }

  private mend(): void {
    this.broken = false;
    if (this.timer !== undefined) this.clock.clearTimeout(this.timer);
    this.timer = undefined;
  }

  private announce(withdraw: boolean): void {
    if (!this.host.wanted() || this.broken) {
      if (withdraw) this.host.send({ type: "video", codecs: [] });
      return;
    }
    void decodesVideo().then((decodes) => {
      if (decodes && this.host.wanted() && !this.broken) {
        this.host.send({ type: "video", codecs: [videoCodec] });
      }
    });
  }
}
