// Data to and from a server: files that a client sends, and samples of fields as arrays.
import type * as Answered from "../generated/answers";
import type { Upload, ValuesAxis } from "../generated/answers";
import { Api, type OpeningJob } from "../wire/api";
import { bytesOf, nameOf, queryOf, settingsOf, type Bytes } from "../wire/arguments";
import type { FetchLike } from "../wire/frame_request";
import { npyOf } from "../wire/npy";
import { notUnderstood, posted, refusal } from "../wire/requests";
import { isObject } from "../base/values";

export type { Upload, ValuesAxis };

export interface UploadOptions {
  keep?: number; // seconds after which the server removes it; by default 3600
  digest?: string; // as that of an Upload; bytes that have another one are refused
  signal?: AbortSignal;
}

/** Samples of a field; without the coordinates that only values.json has. */
export interface Values extends Omit<Answered.Values, "longitudes" | "latitudes"> {
  values: Float32Array; // the last dimension is fastest; masked samples are NaN
}

/** Which samples; without a key all along that axis, at the first step. */
export interface ValuesBox {
  bbox?: [west: number, south: number, east: number, north: number]; // ends included
  level?: number | [number, number]; // one, or the ends of a range, in the vertical axis' unit
  step?: number;
  datetime?: string; // of a step, ISO 8601, instead of its number
  nearest?: boolean; // whether the step nearest to datetime may have another time
  stride?: number | [x: number, y: number, z: number]; // a number is that of x and y
  minus?: string; // id of a dataset to subtract
  minusStep?: number; // step to subtract
}

const isUpload = (answer: Record<string, unknown>): boolean =>
  typeof answer.id === "string" && typeof answer.bytes === "number";

const isJob = (answer: Record<string, unknown>): boolean =>
  typeof answer.id === "string" && typeof answer.state === "string";

export class DataApi extends Api {
  // url: of the server, which ends with a slash. send: adds what its requests need, as a token.
  constructor(
    readonly url: string,
    protected readonly send: FetchLike,
  ) {
    super(url, (to, init) => send(to, init ?? {}));
  }

  /**
   * Sends a file, for servers with --upload-limit. id: its name, which others should not guess: who
   * knows it may read, open and remove the upload. Streams are refused, as the server asks for the
   * length first.
   */
  async upload(id: string, body: Bytes, options: UploadOptions = {}): Promise<Upload> {
    const { keep, digest, signal } = settingsOf("such as { keep: 600 }", options);
    const path = `${this.received(id)}?${queryOf({ keep })}`;
    const headers = {
      "Content-Type": "application/octet-stream",
      ...(digest === undefined ? {} : { "Content-Digest": digest }),
    };
    return this.get<Upload>(path, isUpload, {
      ...{ method: "PUT", headers, body: bytesOf("body", body), signal: signal ?? null },
    });
  }

  uploaded(id: string): Promise<Upload> {
    return this.get<Upload>(this.received(id), isUpload);
  }

  /** Opens an upload; the result of the job is the id of the dataset. */
  async openUpload(id: string): Promise<OpeningJob> {
    return this.get<OpeningJob>("v1/datasets", isJob, posted({ upload: nameOf("id", id) }));
  }

  /** Removes an upload and the datasets opened from it. */
  async removeUpload(id: string): Promise<void> {
    await this.answer(this.received(id), { method: "DELETE" });
  }

  /** Samples of a field, at most 64 MiB of them. */
  async values(
    id: string,
    field: string,
    box: ValuesBox = {},
    signal?: AbortSignal,
  ): Promise<Values> {
    const query = queryOf(settingsOf("a box such as { stride: 2 }", box));
    const path = `${this.field(id, field)}/values.npy?${query}`;
    const response = await this.send(new URL(path, this.url).href, { signal: signal ?? null });
    if (!response.ok) throw await refusal(response);
    const { values, shape } = npyOf(await response.arrayBuffer());
    const told = described(response.headers.get("Windsplat-Values"));
    if (String(told.shape) !== String(shape)) throw new Error(notUnderstood);
    return { ...told, values };
  }

  private received(id: string): string {
    return `v1/uploads/${encodeURIComponent(nameOf("id", id))}`;
  }
}

function described(header: string | null): Omit<Values, "values"> {
  const told: unknown = JSON.parse(header ?? "null");
  if (!isObject(told) || !isObject(told.axes)) throw new Error(notUnderstood);
  return told as unknown as Omit<Values, "values">;
}
