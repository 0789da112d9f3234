// HTTP requests besides the stream: datasets, fields, forecasts -> typed answers. fetch is
// injected, so that tests can simulate the server.
import type * as Answered from "../generated/answers";
import type {
  FieldRange,
  Folder,
  Forecast,
  Job,
  PickedFeature,
  Probe,
  ProbedValue,
  Series,
} from "../generated/answers";
import type { Dataset, DatasetSummary, View } from "./protocol";
import { indicesOf, nameOf, settingsOf, stepOf, viewOf } from "./arguments";
import { notUnderstood, posted, refusal } from "./requests";
import { isObject } from "../base/values";
import type { Vec3 } from "../base/vec3";

export type {
  FieldRange,
  Folder,
  FolderEntry,
  Forecast,
  ForecastPoint,
  FrameInfo,
  Job,
  Jobs,
  Position,
  Presets,
  Probe,
  SavedView,
  Series,
  SeriesTime,
  Service,
} from "../generated/answers";

export type Range = [number, number];
export type Value = ProbedValue | (number | null)[]; // null: masked

/** range: ends of the first and the last bin; null: there are no values. */
export type Histogram = Answered.Histogram;

/** The sample that contributes most to a pixel. */
export type Feature = NonNullable<PickedFeature>;

/** The opening of a dataset, as a job of the server; its result is the id of the dataset. */
export type OpeningJob = Job & { result: string | null };

/** What is subtracted from the fields; null or undefined: nothing. */
export type Difference = View["difference"];

export interface ProbeOf {
  step: number;
  difference?: Difference;
  derived?: string[];
}

export interface Answer {
  ok: boolean;
  status: number;
  json(): Promise<unknown>;
  blob(): Promise<Blob>;
}

export type Fetch = (url: string, init?: RequestInit) => Promise<Answer>;

const isTime = (value: unknown): boolean => isObject(value) && typeof value.text === "string";

const areTimes = (value: unknown): boolean => Array.isArray(value) && value.every(isTime);

const isRange = (value: unknown): boolean =>
  Array.isArray(value) && value.length === 2 && value.every(Number.isFinite);

export class Api {
  constructor(
    private readonly baseUri: string,
    private readonly fetch: Fetch,
  ) {}

  /** Of the differences if there are any, like all that follow. */
  async histogram(
    id: string,
    field: string,
    step: number,
    bins: number,
    difference?: Difference,
  ): Promise<Histogram> {
    const query = `step=${stepOf(step)}&bins=${bins}${minus(difference)}`;
    const path = `${this.field(id, field)}/histogram?${query}`;
    const looksRight = (a: Record<string, unknown>) =>
      (a.range === null || isRange(a.range)) && Array.isArray(a.counts);
    return this.get<Histogram>(path, looksRight);
  }

  /** The range of one step, or with null of all steps, which may take a long time. */
  async range(
    id: string,
    field: string,
    step: number | null,
    difference?: Difference,
  ): Promise<FieldRange> {
    const query = `${step === null ? "of=all" : `step=${stepOf(step)}`}${minus(difference)}`;
    const path = `${this.field(id, field)}/range?${query}`;
    return this.get<FieldRange>(path, (a) => a.range === null || isRange(a.range));
  }

  /** The range at the step and in the region of a view. */
  async rangeIn(view: View, id: string, field: string): Promise<FieldRange> {
    const looksRight = (a: Record<string, unknown>) => a.range === null || isRange(a.range);
    return this.get<FieldRange>(`${this.field(id, field)}/range`, looksRight, posted(viewOf(view)));
  }

  /**
   * of: indices of the sample. With heights its position has the height of the sample there.
   * derived: fields that the server computes for the answer.
   */
  async probe(
    id: string,
    of: Vec3,
    heights: string | null,
    settings: ProbeOf,
    signal?: AbortSignal,
  ): Promise<Probe> {
    const { step, difference, derived = [] } = settingsOf("such as { step: 0 }", settings);
    const names = derived.filter((name) => !name.includes(",")).map(encodeURIComponent);
    const fields = names.length === 0 ? "" : `&fields=${names.join(",")}`;
    const query = `${place(of, heights)}&step=${stepOf(step)}${minus(difference)}${fields}`;
    return this.getProbe(`${this.dataset(id)}/probe?${query}`, { signal: signal ?? null });
  }

  protected getProbe(path: string, init: RequestInit): Promise<Probe> {
    return this.get<Probe>(path, (a) => isObject(a.position) && isObject(a.values), init);
  }

  /** What the pixel at (x, y) of a view shows; null: nothing of the data. */
  async pick(view: View, [x, y]: [number, number], signal?: AbortSignal): Promise<Feature | null> {
    type Answer = { feature: Feature | null };
    const path = `v1/picks?x=${x}&y=${y}`;
    const looksRight = (a: Record<string, unknown>) => a.feature === null || isObject(a.feature);
    return (await this.get<Answer>(path, looksRight, { ...posted(viewOf(view)), signal })).feature;
  }

  /** Reads every step, so it may take a long time. */
  async series(
    id: string,
    field: string,
    of: Vec3,
    heights: string | null = null,
    difference?: Difference,
  ): Promise<Series> {
    const path = `${this.field(id, field)}/series?${place(of, heights)}${minus(difference)}`;
    return this.get<Series>(path, (a) => areTimes(a.times) && Array.isArray(a.values));
  }

  /** The server's forecast for the settings that it may choose for a view. */
  async forecast(view: View): Promise<Forecast> {
    return this.get<Forecast>("v1/forecasts", (a) => Array.isArray(a.points), posted(viewOf(view)));
  }

  async datasets(): Promise<DatasetSummary[]> {
    type List = { datasets: DatasetSummary[] };
    return (await this.get<List>("v1/datasets", (a) => Array.isArray(a.datasets))).datasets;
  }

  async describe(id: string): Promise<Dataset> {
    return this.get<Dataset>(this.dataset(id), (a) => isObject(a.dims));
  }

  /** Opens the files of a listed dataset at other entries of its choices. */
  async openEntry(entry: { from: string; selection: Record<string, string> }): Promise<OpeningJob> {
    return this.get<OpeningJob>("v1/datasets", isJob, posted(entry));
  }

  /** Opens a file, folder or pattern below the data root. */
  async openPath(path: string): Promise<OpeningJob> {
    return this.get<OpeningJob>("v1/datasets", isJob, posted({ path }));
  }

  /**
   * A page of a folder below the data root: what follows the name `after`. null: the server has no
   * data root.
   */
  async folder(folder: string, after: string): Promise<Folder | null> {
    const query = new URLSearchParams({ folder, ...(after === "" ? {} : { after }) }).toString();
    const answer = await this.answer(`v1/files?${query}`);
    if (answer.status === noContent) return null;
    return understood<Folder>(answer, (a) => Array.isArray(a.entries));
  }

  async job(id: string): Promise<OpeningJob> {
    return this.get<OpeningJob>(`v1/jobs/${encodeURIComponent(id)}`, isJob);
  }

  async cancelJob(id: string): Promise<void> {
    await this.answer(`v1/jobs/${encodeURIComponent(id)}`, { method: "DELETE" });
  }

  /** A small picture of the dataset in its default view. */
  async preview(id: string, width: number, height: number): Promise<Blob> {
    const path = `${this.dataset(id)}/frame.jpg?width=${width}&height=${height}`;
    return (await this.answer(path)).blob();
  }

  /** A picture of a view, after the requests of the stream. */
  async picture(view: View, signal: AbortSignal): Promise<Blob> {
    const init = {
      ...posted(viewOf(view), { Accept: "image/jpeg" }),
      signal,
      priority: "low" as const,
    };
    return (await this.answer("v1/frames", init)).blob();
  }

  protected dataset(id: string): string {
    return `v1/datasets/${encodeURIComponent(nameOf("id", id))}`;
  }

  protected field(id: string, field: string): string {
    return `${this.dataset(id)}/fields/${encodeURIComponent(nameOf("field", field))}`;
  }

  protected async get<T>(
    path: string,
    looksRight: (answer: Record<string, unknown>) => boolean,
    init?: RequestInit,
  ): Promise<T> {
    return understood<T>(await this.answer(path, init), looksRight);
  }

  protected async answer(path: string, init?: RequestInit): Promise<Answer> {
    const response = await this.fetch(new URL(path, this.baseUri).href, init);
    if (response.ok) return response;
    throw await refusal(response);
  }
}

const noContent = 204;

async function understood<T>(
  answer: Answer,
  looksRight: (answer: Record<string, unknown>) => boolean,
): Promise<T> {
  const content = await answer.json().catch(() => null);
  if (!isObject(content) || !looksRight(content)) throw new Error(notUnderstood);
  return content as T;
}

const isJob = (a: Record<string, unknown>): boolean =>
  typeof a.id === "string" && typeof a.state === "string";

const minus = (difference: Difference): string => {
  const { dataset = null, step = null } = difference ?? {};
  return (
    (dataset === null ? "" : `&minus=${encodeURIComponent(dataset)}`) +
    (step === null ? "" : `&minusStep=${step}`)
  );
};

// Of the sample at these indices; heights: the field that places samples in the view.
const place = (of: Vec3, heights: string | null): string => {
  const height = heights === null ? "" : `&heightField=${encodeURIComponent(heights)}`;
  return `index=${indicesOf(of).join(",")}${height}`;
};
