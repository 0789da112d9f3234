// Pictures -> a WebM video by the browser's encoder (WebCodecs): every picture once, at its time,
// as fast as the browser encodes. Only pages from https or localhost have an encoder.
import { clamp } from "@windsplat/client/parts";
import { webmFile, type EncodedPicture, type VideoTrack } from "./webm";

// VP9, profile 0, level 5.1, 8 bits (up to 4096 x 2176 pixels), or else VP8.
const codecs: readonly [name: string, track: VideoTrack["codec"]][] = [
  ["vp09.00.51.08", "V_VP9"],
  ["vp8", "V_VP8"],
];
const keyEverySeconds = 2;
const waitingMax = 4; // pictures in the encoder

export const hasVideoEncoder = (): boolean =>
  globalThis.isSecureContext === true &&
  typeof VideoEncoder === "function" &&
  typeof VideoFrame === "function";

const noEncoder = "This browser has no encoder for this video. Save PNG frames in a ZIP instead.";

type Chosen = [config: VideoEncoderConfig, track: VideoTrack["codec"]];

async function choose(width: number, height: number, fps: number): Promise<Chosen> {
  const bitrate = clamp(width * height * fps * 0.25, 2.5e6, 4e7);
  for (const [codec, track] of codecs) {
    const config: VideoEncoderConfig = {
      codec,
      width,
      height,
      bitrate,
      framerate: fps,
      latencyMode: "quality", // in real time the encoder would leave out pictures
    };
    const { supported } = await VideoEncoder.isConfigSupported(config);
    if (supported === true) return [config, track];
  }
  throw new Error(noEncoder);
}

export class VideoFile {
  private encoder: VideoEncoder | null = null;
  private readonly pictures: EncodedPicture[] = [];
  private track: VideoTrack | null = null;
  private added = 0;
  private fault: Error | null = null;

  constructor(private readonly fps: number) {}

  // Resolves once the encoder has room for another picture.
  async add(picture: Blob): Promise<void> {
    if (!hasVideoEncoder()) throw new Error(noEncoder);
    const bitmap = await createImageBitmap(picture, { colorSpaceConversion: "none" });
    try {
      const encoder = (this.encoder ??= await this.start(bitmap.width, bitmap.height));
      const micros = (1e6 * this.added) / this.fps;
      const frame = new VideoFrame(bitmap, {
        timestamp: Math.round(micros),
        duration: Math.round(1e6 / this.fps),
      });
      const keyEvery = Math.max(1, Math.round(keyEverySeconds * this.fps));
      encoder.encode(frame, { keyFrame: this.added % keyEvery === 0 });
      frame.close();
      this.added += 1;
      while (encoder.encodeQueueSize > waitingMax && this.fault === null) {
        await new Promise((done) => encoder.addEventListener("dequeue", done, { once: true }));
      }
    } finally {
      bitmap.close();
    }
    if (this.fault !== null) throw this.fault;
  }

  async finish(): Promise<Blob> {
    await this.encoder!.flush().catch(() => undefined);
    this.close();
    if (this.fault !== null) throw this.fault;
    if (this.pictures.length !== this.added) {
      throw new Error(
        `The browser's encoder left out ${this.added - this.pictures.length} of ` +
          `${this.added} frames. Save PNG frames in a ZIP instead.`,
      );
    }
    return webmFile(this.track!, this.pictures);
  }

  // Releases the encoder, also without a file.
  close(): void {
    if (this.encoder !== null && this.encoder.state !== "closed") this.encoder.close();
  }

  private async start(width: number, height: number): Promise<VideoEncoder> {
    const [config, codec] = await choose(width, height, this.fps);
    const encoder = new VideoEncoder({
      output: (chunk, metadata) => {
        this.track ??= {
          codec,
          width,
          height,
          fps: this.fps,
          color: metadata?.decoderConfig?.colorSpace as Partial<VideoColorSpaceInit> | undefined,
        };
        const data = new Uint8Array(chunk.byteLength);
        chunk.copyTo(data);
        this.pictures.push({ key: chunk.type === "key", data });
      },
      error: (fault) => {
        this.fault = new Error(`The browser cannot encode this video: ${fault.message}`);
      },
    });
    encoder.configure(config);
    return encoder;
  }
}
