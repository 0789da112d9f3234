// Views -> pictures from POST v1/frames, in order, at most two requests at a time. If the
// server is busy, the request is repeated after the delay given in its answer.
import type { View } from "./protocol";
import { posted, refusal, UnreachableError } from "./requests";
import { clamp } from "../base/values";

export type FetchLike = (url: string, options: RequestInit) => Promise<Response>;
export type Wait = (ms: number, signal: AbortSignal) => Promise<void>;

const triesMax = 20;
const waitMaxS = 60;
const busyCodes = [409, 429, 503]; // loading, busy, draining

export const waitFor: Wait = (ms, signal) =>
  new Promise((resolve, reject) => {
    const stop = () => {
      clearTimeout(timer);
      reject(signal.reason as Error);
    };
    const timer = setTimeout(() => {
      signal.removeEventListener("abort", stop);
      resolve();
    }, ms);
    if (signal.aborted) stop();
    else signal.addEventListener("abort", stop, { once: true });
  });

export interface Asked {
  type?: string; // media type; a lossless picture without it
  dotsPerInch?: number; // of types that tell a size on paper
  wait?: Wait;
}

export async function drawFrame(
  fetch: FetchLike,
  baseUri: string,
  view: View,
  signal: AbortSignal,
  { type = "image/png", dotsPerInch, wait = waitFor }: Asked = {},
): Promise<Blob> {
  const query = dotsPerInch === undefined ? "" : `?dpi=${dotsPerInch}`;
  for (let tries = 1; ; tries++) {
    const response = await fetch(new URL(`v1/frames${query}`, baseUri).href, {
      ...posted(view, { Accept: type }),
      signal,
    }).catch((failure: unknown) => {
      if (signal.aborted || failure instanceof UnreachableError) throw failure;
      throw new Error("The server cannot be reached.");
    });
    if (response.ok) return response.blob();
    if (tries === triesMax || !busyCodes.includes(response.status)) {
      throw await refusal(response);
    }
    const after = Number(response.headers.get("Retry-After") ?? 1);
    await wait(1000 * clamp(after || 1, 1, waitMaxS), signal);
  }
}

// Calls `start` for each n in order; at most `ahead` results are pending or not yet consumed.
export async function inOrder<T>(
  count: number,
  start: (n: number) => Promise<T>,
  take: (value: T, n: number) => Promise<void> | void,
  ahead = 2,
): Promise<void> {
  const begun: Promise<T>[] = [];
  let next = 0;
  for (let n = 0; n < count; n++) {
    while (next < count && begun.length < ahead) {
      const one = start(next++);
      one.catch(() => {}); // reported when this result is consumed
      begun.push(one);
    }
    await take(await begun.shift()!, n);
  }
}
