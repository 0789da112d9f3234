// The stream's connection: its sockets, the question whether the server answers without them, and
// the events of a page after which a new attempt is worthwhile at once.
import {
  Connection,
  streamUrl,
  type Clock,
  type ConnectionEvents,
  type SocketLike,
} from "./connection";
import { reachOf, type AskServer } from "./reach";

const presenceMs = 60_000;

// A WebSocket as the browser has it, or one of another library with the same interface.
export type SocketClass = new (url: string, protocols: string[]) => object;

export interface LinkOptions {
  token?: string | undefined; // for a server with --token-file
  webSocket?: SocketClass | undefined; // by default the global WebSocket
  fetch?: AskServer | undefined; // with the token; by default the global fetch
}

// The subprotocol that carries a token, because browsers cannot set headers of a WebSocket:
// base64url (RFC 4648, 5) without padding. A token has ASCII characters only.
export const tokenProtocol = (token: string): string =>
  `bearer.${btoa(token).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "")}`;

function globalSocket(): SocketClass {
  if (typeof WebSocket === "undefined") {
    throw new Error(
      "no WebSocket here: Node before 22 needs one, as of the package ws, in " +
        "new Client(url, { webSocket })",
    );
  }
  return WebSocket;
}

export const openConnection = (
  baseUri: string,
  clock: Clock,
  events: ConnectionEvents,
  { token, webSocket, fetch: ask = (url, init) => fetch(url, init) }: LinkOptions = {},
): Connection => {
  const Socket = webSocket ?? globalSocket();
  const offered = token === undefined ? [] : [tokenProtocol(token)];
  return new Connection(
    streamUrl(baseUri),
    (url, protocol) => {
      // SocketLike declares less than a WebSocket has.
      const socket = new Socket(url, [protocol, ...offered]) as SocketLike;
      return Object.assign(socket, { onerror: () => {} }); // `onclose` follows and tells more
    },
    clock,
    events,
    () => reachOf(ask, baseUri),
  );
};

// Calls `report` when the page is shown or hidden, and periodically while it is visible: a user who
// only watches is not idle. Until the signal is aborted.
export function watchPresence(
  connection: Pick<Connection, "retryNow">,
  report: () => void,
  signal?: AbortSignal,
): void {
  const until = signal === undefined ? {} : { signal };
  window.addEventListener("online", () => connection.retryNow(), until);
  document.addEventListener(
    "visibilitychange",
    () => {
      if (!document.hidden) connection.retryNow();
      report();
    },
    until,
  );
  const timer = window.setInterval(() => {
    if (!document.hidden) report();
  }, presenceMs);
  signal?.addEventListener("abort", () => window.clearInterval(timer), { once: true });
}
