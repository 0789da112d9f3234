// Announces to the server that this browser decodes video, unless the user or a fault forbids it.
import type { ClientMessage } from "../wire/protocol";
import { videoUse } from "../view/video_setting";
import { decodesVideo, videoCodec } from "../viewport/video_pictures";

export class VideoOffer {
  private broken = false;

  constructor(private readonly send: (message: ClientMessage) => void) {
    videoUse.watch(() => {
      this.broken = false;
      this.announce(true);
    });
  }

  // After each hello; a server that hears nothing sends no video.
  greet(): void {
    this.announce(false);
  }

  // The decoder failed: pictures as JPEG from now on.
  failed(): void {
    this.broken = true;
    this.announce(true);
  }

  private announce(withdraw: boolean): void {
    if (videoUse.value === "never" || this.broken) {
      if (withdraw) this.send({ type: "video", codecs: [] });
      return;
    }
    void decodesVideo().then((decodes) => {
      if (decodes && videoUse.value === "auto" && !this.broken) {
        this.send({ type: "video", codecs: [videoCodec] });
      }
    });
  }
}
