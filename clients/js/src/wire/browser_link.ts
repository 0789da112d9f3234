// The stream's connection in a browser: its sockets, the question whether the server answers
// without them, and the events after which a new attempt is worthwhile at once.
import {
  Connection,
  streamUrl,
  type Clock,
  type ConnectionEvents,
  type SocketLike,
} from "./connection";
import { reachOf } from "./reach";

const presenceMs = 60_000;

export const openConnection = (
  baseUri: string,
  clock: Clock,
  events: ConnectionEvents,
): Connection =>
  new Connection(
    streamUrl(baseUri),
    // SocketLike declares less than the browser's WebSocket.
    (url, protocol) => new WebSocket(url, protocol) as unknown as SocketLike,
    clock,
    events,
    () => reachOf((url, init) => fetch(url, init), baseUri),
  );

// Calls `report` when the page is shown or hidden, and periodically while it is visible: a user who
// only watches is not idle.
export function watchPresence(connection: Connection, report: () => void): void {
  window.addEventListener("online", () => connection.retryNow());
  document.addEventListener("visibilitychange", () => {
    if (!document.hidden) connection.retryNow();
    report();
  });
  window.setInterval(() => {
    if (!document.hidden) report();
  }, presenceMs);
}
