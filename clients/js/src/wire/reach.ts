// What the server says when the stream cannot be opened, which a browser does not tell, and the
// login that it may ask for.
import { ownOrigin, refusal, UnreachableError } from "./requests";

// silent: no answer, or only that of a proxy without its server; foreign: there is one, which pages
// of this origin may not read; answers: the server is there, and the reason lies elsewhere; login:
// it asks for a token.
export type Reach = "silent" | "foreign" | "answers" | "login";

export type AskServer = (
  url: string,
  init: RequestInit,
) => Promise<Pick<Response, "ok" | "status" | "type" | "json">>;

// after it the server counts as silent
const deadlineMs = 5_000;

export async function reachOf(ask: AskServer, baseUri: string): Promise<Reach> {
  try {
    const { status } = await ask(new URL("v1/datasets", baseUri).href, {
      method: "HEAD",
      headers: { Accept: "application/json" },
      signal: AbortSignal.timeout(deadlineMs),
    });
    if (status === 401) return "login";
    return status < 500 ? "answers" : "silent";
  } catch (failure) {
    const known = failure instanceof UnreachableError; // a client has asked already
    const foreign = known ? failure.foreign : await isForeign(ask, baseUri);
    return foreign ? "foreign" : "silent";
  }
}

// Whether a server that gave this page no answer gives one that the page cannot read. Any origin
// may learn whether /livez answers, which tells a server that is down from one that refuses pages
// of this origin; a request to the page's own origin fails only without an answer.
export async function isForeign(
  ask: (url: string, init: RequestInit) => Promise<unknown>,
  baseUri: string,
): Promise<boolean> {
  const own = ownOrigin();
  if (own === undefined || own === new URL(baseUri).origin) return false;
  const init: RequestInit = { mode: "no-cors", signal: AbortSignal.timeout(deadlineMs) };
  return ask(new URL("livez", baseUri).href, init).then(
    () => true,
    () => false,
  );
}

// Exchanges the token for a cookie. Returns why that failed, or null.
export async function logIn(
  ask: AskServer,
  baseUri: string,
  token: string,
): Promise<string | null> {
  try {
    const answer = await ask(new URL("login", baseUri).href, {
      method: "POST",
      headers: { "Content-Type": "application/x-www-form-urlencoded" },
      body: new URLSearchParams({ token }).toString(),
      redirect: "manual", // the answer leads to the page, which is shown already
    });
    if (answer.type === "opaqueredirect" || answer.ok) return null;
    return answer.status === 401 ? "Invalid token." : (await refusal(answer)).message;
  } catch {
    return "The server did not answer.";
  }
}
