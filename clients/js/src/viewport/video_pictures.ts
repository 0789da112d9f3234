// Units of H.264 -> decoded pictures, by the browser's decoder (WebCodecs). Every unit is decoded
// in the order of arrival, since each refers to the one before; a key unit begins a stream.
import type { Frame } from "../wire/protocol";

// The most that the page asks for: H.264, High profile, level 5.1 (RFC 6381).
export const videoCodec = "avc1.640033";
const config: VideoDecoderConfig = { codec: videoCodec, optimizeForLatency: true };

// Whether this browser decodes it; only pages from https or localhost have a decoder.
export async function decodesVideo(): Promise<boolean> {
  if (!globalThis.isSecureContext || typeof VideoDecoder === "undefined") return false;
  try {
    return (await VideoDecoder.isConfigSupported(config)).supported === true;
  } catch {
    return false;
  }
}

// A decoder that holds pictures back would wait for units that the
// server does not send before those in flight are acknowledged.
const longestMs = 3000;

interface Waiting {
  at: number; // time stamp of the unit
  done(picture: VideoFrame | null): void;
  timer: ReturnType<typeof setTimeout>;
}

export class VideoPictures {
  private decoder: VideoDecoder | null = null;
  private waiting: Waiting[] = [];

  // failed: the decoder reported an error, or no picture for longestMs; units are discarded until
  // the next key unit.
  constructor(private readonly failed: () => void) {}

  // The picture of a unit, to be closed by the caller; null: there is none, because the stream
  // began before or the decoder failed.
  decode({ header, picture }: Frame): Promise<VideoFrame | null> {
    if (this.decoder === null && !header.key) return Promise.resolve(null);
    return new Promise((done) => {
      const { seq } = header;
      const timer = setTimeout(() => this.fail(), longestMs);
      this.waiting.push({ at: seq, done, timer });
      try {
        this.decoder ??= this.begin();
        const type = header.key ? "key" : "delta";
        this.decoder.decode(new EncodedVideoChunk({ type, timestamp: seq, data: picture }));
      } catch {
        this.fail();
      }
    });
  }

  // Discards the stream.
  end(): void {
    const { decoder } = this;
    this.decoder = null;
    if (decoder !== null && decoder.state !== "closed") decoder.close();
    for (const { done, timer } of this.waiting.splice(0)) {
      clearTimeout(timer);
      done(null);
    }
  }

  private begin(): VideoDecoder {
    const decoder = new VideoDecoder({
      output: (picture) => {
        if (this.decoder === decoder) this.take(picture);
        else picture.close();
      },
      error: () => {
        if (this.decoder === decoder) this.fail();
      },
    });
    decoder.configure(config);
    return decoder;
  }

  // Pictures leave the decoder in the order of their units.
  private take(picture: VideoFrame): void {
    for (;;) {
      const next = this.waiting.shift();
      if (next === undefined) return picture.close();
      clearTimeout(next.timer);
      if (next.at === picture.timestamp) return next.done(picture);
      next.done(null);
    }
  }

  private fail(): void {
    this.end();
    this.failed();
  }
}
