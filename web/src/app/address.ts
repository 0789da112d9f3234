// Keeps the view in the page's address: view -> `#!{...}`, debounced, and back. If a view is too
// long for a link, the server stores a copy and `#!view=ID` is copied to the clipboard; the page's
// address always contains the whole view, so that it remains valid after a server restart.
import { failureText } from "../base/problem_text";
import {
  debounced,
  type FetchLike,
  loadView,
  storeView,
  withoutSize,
} from "@windsplat/client/parts";
import { hashOfView, viewOfHash } from "../view/link";
import type { View } from "@windsplat/client";
import { linkMax, shortLinkHash, shortLinkId } from "../view/short_link";
import type { Status } from "./status";

export interface AddressHost {
  document(): View; // explicit keys only
  // whether playback or line motion is active, or the view of another address waits for its files
  // to be opened; the address is updated once that has ended
  busy(): boolean;
  restore(view: View): void; // the user has navigated to another address
  // the second picture, which is kept behind the view
  beside?: { readonly suffix: string; take(hash: string): string };
}

const delayMs = 400;
// time limit for fetching a stored view; after it the page starts without the view
const deadlineMs = 10_000;
const request: FetchLike = (url, options) => fetch(url, options);

export class Address {
  readonly save = debounced(() => this.write(), delayMs);
  private reads = 0;
  // The address is not changed while its view is being fetched, nor after a failed fetch until the
  // user changes the view, so that reloading the page retries the fetch.
  private link: "loading" | "lost" | "followed" = "loading";

  constructor(
    private readonly host: AddressHost,
    private readonly status: Status,
    private readonly baseUri: string,
  ) {
    window.addEventListener("hashchange", () =>
      this.read((view) => {
        if (view !== null) host.restore(view);
      }),
    );
  }

  // Passes on the view of the link with which the page was opened: synchronously, unless the view
  // has to be fetched from the server. null: the address contains no link.
  first(begin: (view: View | null) => void): void {
    if (window.location.hash.length > 1) {
      this.read(begin);
    } else {
      this.link = "followed";
      begin(null);
    }
  }

  // The user has changed the view.
  edited(): void {
    if (this.link === "lost") this.link = "followed";
  }

  async copy(): Promise<void> {
    this.write();
    const [link, remark] = await this.linkOf(withoutSize(this.host.document()));
    try {
      await navigator.clipboard.writeText(link);
      this.status.note(`link copied${remark}`);
    } catch {
      window.history.replaceState(null, "", link);
      this.status.note(`the address bar holds the link${remark}`);
    }
  }

  // The link, and a note for the status line.
  private async linkOf(view: View): Promise<[link: string, remark: string]> {
    const suffix = this.host.beside?.suffix ?? "";
    const linkTo = (hash: string): string => new URL(hash + suffix, window.location.href).href;
    const href = linkTo(hashOfView(view));
    if (href.length <= linkMax) return [href, ""];
    try {
      const { id, kept } = await storeView(request, this.baseUri, view);
      const remark = kept === "memory" ? "; valid until the server stops" : "";
      return [linkTo(shortLinkHash(id)), remark];
    } catch (failure) {
      return [href, ` (long form: ${failureText(failure)})`];
    }
  }

  private read(begin: (view: View | null) => void): void {
    const hash = this.host.beside?.take(window.location.hash) ?? window.location.hash;
    const id = shortLinkId(hash);
    this.reads += 1;
    if (id !== null) {
      this.link = "loading";
      void this.load(id, begin, this.reads);
      return;
    }
    this.link = "followed";
    const view = viewOfHash(hash);
    if (view === null) this.status.error("link", "This link contains no valid view.");
    begin(view);
  }

  private async load(id: string, begin: (view: View | null) => void, read: number): Promise<void> {
    const signal = AbortSignal.timeout(deadlineMs);
    const within: FetchLike = (url, options) => fetch(url, { ...options, signal });
    let view: View | null = null;
    let why = "";
    try {
      view = withoutSize((await loadView(within, this.baseUri, id)).view);
    } catch (failure) {
      why = signal.aborted ? "The server did not answer in time." : failureText(failure);
    }
    if (read === this.reads) {
      this.link = view === null ? "lost" : "followed";
      if (view === null) this.status.error("link", `The link's view: ${why}`);
    } else {
      view = null; // the user has navigated to another address in the meantime
    }
    begin(view);
  }

  private write(): void {
    if (this.link !== "followed" || this.host.busy()) return;
    const hash = hashOfView(this.host.document()) + (this.host.beside?.suffix ?? "");
    if (window.location.hash !== hash) window.history.replaceState(null, "", hash);
  }
}
