// A server as programs use it: its resources over REST, with a token if it asks for one, and
// streams of its views.
import type {
  Animation,
  AnimationRequest,
  ColorMaps,
  FrameInfo,
  Job,
  Jobs,
  Presets,
  SavedView,
  Service,
} from "../generated/answers";
import type { Probe } from "../wire/api";
import { addressOf, queryOf, settingsOf, viewOf } from "../wire/arguments";
import type { SocketClass } from "../wire/browser_link";
import { drawFrame, waitFor, type FetchLike, type Wait } from "../wire/frame_request";
import type { View } from "../wire/protocol";
import { isForeign } from "../wire/reach";
import { posted, ProblemError, problemText, UnreachableError } from "../wire/requests";
import { DataApi } from "./data_api";
import { ViewStream, type StreamEvents, type StreamOptions } from "./view_stream";

export interface ClientOptions {
  token?: string | undefined; // of a server with --token-file; sent as a header, never in a URL
  fetch?: FetchLike; // by default the global one
  webSocket?: SocketClass | undefined; // by default the global one, which Node has since 22
}

export interface PictureOptions {
  type?: "image/png" | "image/jpeg" | "image/svg+xml" | "application/pdf" | "application/x-npy";
  dotsPerInch?: number; // of PNG, PDF and SVG
  signal?: AbortSignal;
}

export interface FollowOptions {
  progress?: (job: Job) => void; // called with every state of the job
  signal?: AbortSignal; // ends the job
  wait?: Wait;
}

export interface Place {
  x: number;
  y: number;
  z: number; // a coordinate of the vertical axis; with heightField a height
  step?: number;
  heightField?: string;
  fields?: string[]; // derived fields to compute
}

// With the token as a header; the options of the caller come first.
function authorized(fetch: FetchLike, token: string | undefined): FetchLike {
  if (token === undefined) return fetch;
  return (url, init = {}) => {
    const headers = { Authorization: `Bearer ${token}`, ...(init.headers as object) };
    return fetch(url, { ...init, headers });
  };
}

// With the address in the error of a request that has no answer.
const reaching =
  (address: string, fetch: FetchLike): FetchLike =>
  async (url, init) => {
    try {
      return await fetch(url, init);
    } catch (failure) {
      if (init.signal?.aborted) throw failure;
      throw new UnreachableError(address, failure, await isForeign(fetch, address));
    }
  };

const isList =
  (key: string) =>
  (answer: Record<string, unknown>): boolean =>
    Array.isArray(answer[key]);

const isJob = (answer: Record<string, unknown>): boolean =>
  typeof answer.id === "string" && typeof answer.state === "string";

const isOpen = ({ state }: Job): boolean => state === "queued" || state === "running";

const pollFirstMs = 50;
const pollMostMs = 1000;

const isSaved = (answer: Record<string, unknown>): boolean =>
  typeof answer.id === "string" && typeof answer.view === "object";

export class Client extends DataApi {
  // url: of the server, with its base path; a host with its port counts as http://.
  constructor(
    url: string | URL,
    private readonly options: ClientOptions = {},
  ) {
    const base = addressOf(url);
    if (!base.pathname.endsWith("/")) base.pathname += "/";
    base.search = "";
    base.hash = "";
    const fetchIt = options.fetch ?? ((to: string, init: RequestInit) => fetch(to, init));
    super(base.href, reaching(base.href, authorized(fetchIt, options.token)));
  }

  // --- the stream ------------------------------------------------------------------------

  /** Shows a view over a stream of its own, until close(). */
  stream(view: View, events: StreamEvents = {}, options: StreamOptions = {}): ViewStream {
    const { token, webSocket } = this.options;
    return new ViewStream(this.url, viewOf(view), events, {
      token,
      webSocket,
      fetch: this.send,
      ...options,
    });
  }

  // --- pictures --------------------------------------------------------------------------

  /** A view drawn to a picture. A busy server is asked again after the time that it states. */
  async frame(view: View, { signal, ...asked }: PictureOptions = {}): Promise<Blob> {
    const ended = signal ?? new AbortController().signal;
    return drawFrame(this.send, this.url, viewOf(view), ended, asked);
  }

  // --- movies ----------------------------------------------------------------------------

  /** Begins a movie of a view, as a job of the server: see finished(). */
  createAnimation(request: AnimationRequest): Promise<Job> {
    return this.get<Job>("v1/animations", isJob, posted(request));
  }

  /** Follows a job until it is over: its result. A job that failed is a ProblemError. */
  async finished<J extends Job>(started: J, options: FollowOptions = {}): Promise<J["result"]> {
    const { progress, signal = new AbortController().signal, wait = waitFor } = options;
    let job = started;
    try {
      for (let ms = pollFirstMs; isOpen(job); ms *= 1.5) {
        progress?.(job);
        await wait(Math.min(ms, pollMostMs), signal);
        job = await this.get<J>(`v1/jobs/${encodeURIComponent(job.id)}`, isJob, { signal });
      }
    } catch (failure) {
      if (signal.aborted) await this.cancelJob(job.id).catch(() => {}); // it may have finished
      throw failure;
    }
    progress?.(job);
    if (job.state === "done") return job.result;
    const { problem } = job;
    const text = problem === null ? `the job was ${job.state}` : problemText(problem);
    throw new ProblemError(text, problem?.status ?? 0, problem);
  }

  /** The file of a finished animation, while the server keeps it. */
  async movie({ movie }: Pick<Animation, "movie">, signal?: AbortSignal): Promise<Blob> {
    return (await this.answer(movie, { signal: signal ?? null })).blob();
  }

  /** A movie of a view, once it is drawn. */
  async animate(request: AnimationRequest, options: FollowOptions = {}): Promise<Blob> {
    const result = await this.finished(await this.createAnimation(request), options);
    return this.movie(result as Animation, options.signal);
  }

  // --- resources besides those of the page -----------------------------------------------

  service(): Promise<Service> {
    return this.get<Service>("v1", (answer) => typeof answer.version === "string");
  }

  colorMaps(): Promise<ColorMaps> {
    return this.get<ColorMaps>("v1/colormaps", isList("colormaps"));
  }

  presets(): Promise<Presets> {
    return this.get<Presets>("v1/presets", isList("presets"));
  }

  jobs(): Promise<Jobs> {
    return this.get<Jobs>("v1/jobs", isList("jobs"));
  }

  /** Releases the memory of a dataset; with `forget` it is no longer listed. */
  async closeDataset(id: string, forget = false): Promise<void> {
    await this.answer(`${this.dataset(id)}${forget ? "?forget=true" : ""}`, { method: "DELETE" });
  }

  /** Every field at the sample nearest to a place in the coordinates of the dataset. */
  async probeAt(id: string, place: Place, signal?: AbortSignal): Promise<Probe> {
    const { fields, ...numbers } = settingsOf("a place such as { x: 0, y: 0, z: 0 }", place);
    const query = queryOf(numbers);
    if (fields !== undefined && fields.length > 0) query.set("fields", fields.join(","));
    return this.getProbe(`${this.dataset(id)}/probe?${query}`, { signal: signal ?? null });
  }

  // --- saved views -----------------------------------------------------------------------

  async saveView(view: View): Promise<SavedView> {
    return this.get<SavedView>("v1/views", isSaved, posted(viewOf(view)));
  }

  savedView(id: string): Promise<SavedView> {
    return this.get<SavedView>(this.saved(id), isSaved);
  }

  async replaceView(id: string, view: View): Promise<SavedView> {
    const init = { ...posted(viewOf(view)), method: "PUT" };
    return this.get<SavedView>(this.saved(id), isSaved, init);
  }

  /** patch: a merge patch (RFC 7396). */
  changeView(id: string, patch: object): Promise<SavedView> {
    const headers = { "Content-Type": "application/merge-patch+json" };
    const init = { ...posted(patch, headers), method: "PATCH" };
    return this.get<SavedView>(this.saved(id), isSaved, init);
  }

  async deleteView(id: string): Promise<void> {
    await this.answer(this.saved(id), { method: "DELETE" });
  }

  private saved(id: string): string {
    return `v1/views/${encodeURIComponent(id)}`;
  }
}

export type { Animation, AnimationRequest };
export type { ColorMaps, FrameInfo, Jobs, Presets, SavedView, Service };
