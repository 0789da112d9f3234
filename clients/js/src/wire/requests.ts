// Requests that post a document, and the errors of refused ones.
import type { Problem, View } from "./protocol";

/**
 * The server's refusal of a request: its HTTP status (0: none) and, if it told one, the problem
 * (RFC 9457).
 */
export class ProblemError extends Error {
  override name = "ProblemError";

  constructor(
    text: string,
    readonly status: number,
    readonly problem: Problem | null = null,
  ) {
    super(text);
  }
}

/**
 * A request had no answer that this program may read: the server is down or its address is wrong,
 * or, if `foreign`, what answers does not allow pages of this origin.
 */
export class UnreachableError extends Error {
  override name = "UnreachableError";

  constructor(
    readonly address: string, // of the server
    override readonly cause: unknown, // the failure as it was reported
    readonly foreign = false,
  ) {
    const { message, cause: reason } = cause as { message?: string; cause?: { code?: string } };
    const silent = `no answer from ${address} (${reason?.code ?? message ?? String(cause)})`;
    super(foreign ? refusesPages(address) : silent);
  }
}

/**
 * The origin of this page as servers see it, which `location` does not have in a frame without an
 * address (srcdoc); undefined outside of browsers.
 */
export const ownOrigin = (): string | undefined => (globalThis as { origin?: string }).origin;

/**
 * Text on a server whose answers this page may not read. The browser does not tell whether they are
 * its own, or those of a proxy whose server is down.
 */
export const refusesPages = (server: string): string =>
  `${server} answers, but not for pages of ${ownOrigin()}: ` +
  "it does not allow them (--allow-origin), or a proxy answers in its place";

/** The entries of a problem with their places, or else its detail or title. */
export function problemText({ title, detail, errors }: Problem): string {
  // The empty pointer is that of the whole document.
  const entries =
    errors?.map((entry) => `${entry.pointer || "the document"}: ${entry.detail}`) ?? [];
  return entries.length > 0 ? entries.join("; ") : detail || title || "";
}

export const posted = (body: View | object, headers = {}): RequestInit => ({
  method: "POST",
  headers: { "Content-Type": "application/json", ...headers },
  body: JSON.stringify(body),
});

type Refused = Pick<Response, "status" | "json">;

/** The error that an answer tells. */
export async function refusal(response: Refused): Promise<ProblemError> {
  const { status } = response;
  const problem = (await response.json().catch(() => null)) as Problem | null;
  const text = problem === null ? "" : problemText(problem);
  return new ProblemError(text || `The server answered with HTTP ${status}.`, status, problem);
}

export const notUnderstood = "The server's answer could not be understood.";

/** Message of a failed promise. */
export const failureText = (failure: unknown): string =>
  failure instanceof Error ? failure.message : String(failure);
