// Other entries of the dimensions of a dataset (members, bands, reference times): ids and choices
// -> a request to the server -> the opened dataset.
import { ProblemError, type Api, type OpeningJob, type Dataset } from "@windsplat/client";

export interface Entry {
  from: string; // id of a listed dataset of the same files
  selection: Record<string, string>; // dimension -> value of the entry
}

export type EntryApi = Pick<Api, "openEntry" | "job" | "cancelJob" | "describe">;

// The ids of such datasets name their entries: "gcm,number=3,band=2". null: the id is none of them.
export function entryOf(id: string, datasets: readonly { id: string }[]): Entry | null {
  const [from] = datasets
    .map((dataset) => dataset.id)
    .filter((known) => id.startsWith(`${known},`))
    .sort((a, b) => a.length - b.length); // the one with the fewest entries of its own
  if (from === undefined) return null;
  const selection: Record<string, string> = {};
  for (const part of id.slice(from.length + 1).split(",")) {
    const equals = part.indexOf("=");
    if (equals < 1 || equals === part.length - 1) return null;
    selection[part.slice(0, equals)] = part.slice(equals + 1);
  }
  return { from, selection };
}

export const entryText = ({ selection }: Entry): string =>
  Object.entries(selection)
    .map(([dimension, value]) => `${dimension} ${value}`)
    .join(", ");

const firstPollMs = 40;
const pollMsMax = 1000;

export async function openEntry(
  api: EntryApi,
  entry: Entry,
  wanted: () => boolean,
  sleep: (ms: number) => Promise<void>,
): Promise<Dataset | null> {
  const id = await resultOf(api, await api.openEntry(entry), wanted, sleep);
  return id === null ? null : api.describe(id);
}

// The id of the dataset that the job opens. Returns null, and cancels the request, once it is no
// longer wanted. A refused request fails with a ProblemError.
export async function resultOf(
  api: Pick<Api, "job" | "cancelJob">,
  started: OpeningJob,
  wanted: () => boolean,
  sleep: (ms: number) => Promise<void>,
): Promise<string | null> {
  let job = started;
  for (let ms = firstPollMs; job.state === "queued" || job.state === "running"; ms *= 2) {
    if (!wanted()) {
      await api.cancelJob(job.id).catch(() => {}); // it may have finished
      return null;
    }
    await sleep(Math.min(ms, pollMsMax));
    job = await api.job(job.id);
  }
  if (!wanted()) return null;
  if (job.result === null) {
    throw new ProblemError(job.problem?.detail ?? job.state, job.problem?.status ?? 0);
  }
  return job.result;
}
