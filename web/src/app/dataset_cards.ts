// The datasets as cards with small pictures: the list -> what is opened. Pictures come one after
// another, and only of cards that are seen.
import { failureText, type Api } from "../wire/api";
import { failureNote, type DatasetList } from "./dataset_list";
import { make, whenClosed } from "../base/dom";
import type { DatasetSummary } from "../wire/protocol";

export interface CardsHost {
  api: Api;
  list: DatasetList;
  open(id: string): void;
}

const [width, height] = [320, 200]; // of a picture, pixels

const many = (count: number, what: string): string => `${count} ${what}${count === 1 ? "" : "s"}`;

export function cardText({ fields, steps }: DatasetSummary, dims = ""): string {
  const names = fields.map(({ name }) => name).join(", ");
  return [...(dims === "" ? [] : [dims]), many(steps, "step"), names].join(" · ");
}

interface Card {
  face: string; // what it shows
  element: HTMLButtonElement;
}

// What a card shows of a list entry: other changes (such as memory size) do not rebuild it.
export const cardFace = (dataset: DatasetSummary): string =>
  JSON.stringify([
    dataset.title || dataset.id,
    cardText(dataset),
    dataset.state === "failed" && failureNote(dataset),
  ]);

export class Cards {
  private cards = new Map<string, Card>(); // by the dataset's id, in order
  private todo = new Map<Element, () => Promise<void>>(); // pictures of cards not yet seen
  private queue: (() => Promise<void>)[] = [];
  private busy = false;
  private seen: IntersectionObserver | null = null;
  private urls: string[] = [];

  constructor(
    private readonly dialog: HTMLDialogElement,
    private readonly box: HTMLElement,
    private readonly host: CardsHost,
  ) {
    box.addEventListener("keydown", (event) => this.key(event));
    whenClosed(dialog, () => this.clear());
  }

  // With what the server has now: files may have been added since the hello message.
  show(): void {
    if (this.dialog.open) return;
    const { api, list } = this.host;
    this.clear();
    this.dialog.showModal();
    this.seen = this.observe();
    this.fill(list.all);
    api.datasets().then(
      (datasets) => {
        list.set(datasets);
        if (this.dialog.open) this.fill(datasets);
      },
      () => {}, // what is known stays
    );
  }

  private clear(): void {
    this.queue = [];
    this.cards.clear();
    this.todo.clear();
    this.seen?.disconnect();
    for (const url of this.urls.splice(0)) URL.revokeObjectURL(url);
  }

  private observe(): IntersectionObserver {
    return new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) {
        const load = this.todo.get(target);
        if (!isIntersecting || load === undefined) continue;
        this.todo.delete(target);
        this.queue.push(load);
      }
      void this.work();
    });
  }

  // Cards that show the same as before stay as they are, and so does the focus.
  private fill(datasets: DatasetSummary[]): void {
    const old = this.cards;
    this.cards = new Map(
      datasets.map((dataset) => {
        const face = cardFace(dataset);
        const known = old.get(dataset.id);
        if (known?.face === face) return [dataset.id, known];
        return [dataset.id, { face, element: this.card(dataset) }];
      }),
    );
    const { children } = this.box;
    const elements: HTMLElement[] = [...this.cards.values()].map(({ element }) => element);
    if (elements.length === 0) elements.push(make("p", "", "The server has no dataset yet."));
    if (elements.length === children.length && elements.every((e, n) => e === children[n])) return;
    const focused = [...old].find(([, { element }]) => element === document.activeElement);
    this.box.replaceChildren(...elements);
    for (const element of elements) this.seen!.observe(element);
    if (old.size > 0 && focused === undefined) return; // it is elsewhere
    (this.cards.get(focused?.[0] ?? "")?.element ?? elements[0])?.focus();
  }

  private async work(): Promise<void> {
    if (this.busy) return;
    this.busy = true;
    for (let next = this.queue.shift(); next !== undefined; next = this.queue.shift()) await next();
    this.busy = false;
  }

  private card(dataset: DatasetSummary): HTMLButtonElement {
    const card = make("button", "card");
    const picture = make("span", "card-picture");
    const text = make("span", "card-text", cardText(dataset));
    card.append(picture, make("span", "card-title", dataset.title || dataset.id), text);
    card.addEventListener("click", () => {
      this.dialog.close();
      this.host.open(dataset.id);
    });
    const fail = (why: string) => {
      picture.textContent = why;
      card.classList.add("failed");
    };
    if (dataset.state === "failed") fail(failureNote(dataset));
    else {
      this.todo.set(card, async () => {
        if (!card.isConnected) return; // another has taken its place
        await this.load(dataset, picture, text).catch((e) => fail(failureText(e)));
      });
    }
    return card;
  }

  private async load(
    dataset: DatasetSummary,
    picture: HTMLElement,
    text: HTMLElement,
  ): Promise<void> {
    const { api } = this.host;
    const image = make("img");
    const url = URL.createObjectURL(await api.preview(dataset.id, width, height));
    this.urls.push(url);
    image.src = url;
    image.alt = "";
    picture.replaceChildren(image);
    const { x, y, z } = (await api.describe(dataset.id)).dims;
    text.textContent = cardText(dataset, `${x} × ${y} × ${z}`);
  }

  private key(event: KeyboardEvent): void {
    const cards = [...this.box.querySelectorAll<HTMLElement>(".card")];
    const at = cards.indexOf(document.activeElement as HTMLElement);
    const top = (card: HTMLElement | undefined) => card?.offsetTop;
    const columns = cards.filter((card) => top(card) === top(cards[0])).length;
    const by = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: -columns, ArrowDown: columns }[event.key];
    if (by === undefined || at < 0) return;
    event.preventDefault();
    cards[at + by]?.focus();
  }
}
