// The datasets as cards with small pictures: dataset list -> the dataset to open. Pictures are
// loaded one after another, and only for visible cards.
import { failureText } from "../base/problem_text";
import type { Api, DatasetSummary } from "@windsplat/client";
import { failureNote, type DatasetList } from "./dataset_list";
import { make, whenClosed } from "../base/dom";

export interface CardsHost {
  api: Api;
  list: DatasetList;
  files: { show(): void; hide(): void };
  current(): string | undefined; // id of the dataset that is shown
  open(id: string): void;
}

const [width, height] = [320, 200]; // size of a card's picture in pixels

const many = (count: number, what: string): string => `${count} ${what}${count === 1 ? "" : "s"}`;

export function cardText({ fields, steps }: DatasetSummary, dims = ""): string {
  const stored = fields.filter(({ dtype }) => dtype !== "derived");
  const names = stored.map(({ name }) => name).join(", ");
  return [...(dims === "" ? [] : [dims]), many(steps, "step"), names].join(" · ");
}

interface Card {
  face: string; // the displayed content, as returned by cardFace
  element: HTMLButtonElement;
}

// The part of a list entry that its card displays. Other changes, such as memory size, do not
// rebuild the card.
export const cardFace = (dataset: DatasetSummary): string =>
  JSON.stringify([
    dataset.title || dataset.id,
    cardText(dataset),
    dataset.state === "failed" && failureNote(dataset),
  ]);

export class Cards {
  private cards = new Map<string, Card>(); // by dataset id, in display order
  // pictures to load once their cards become visible
  private todo = new Map<Element, () => Promise<void>>();
  private queue: (() => Promise<void>)[] = [];
  private busy = false;
  private seen: IntersectionObserver | null = null;
  private urls: string[] = [];

  constructor(
    private readonly dialog: HTMLDialogElement,
    private readonly box: HTMLElement,
    private readonly note: HTMLElement,
    private readonly host: CardsHost,
  ) {
    box.addEventListener("keydown", (event) => this.key(event));
    whenClosed(dialog, () => {
      this.clear();
      host.files.hide();
    });
  }

  // Refreshes the list first: files may have been added since the hello message. why: what the user
  // asked for cannot be shown.
  show(why = ""): void {
    this.note.hidden = why === "";
    this.note.textContent = why === "" ? "" : `Nothing is shown: ${why}.`;
    if (this.dialog.open) return;
    const { api, list } = this.host;
    this.clear();
    this.dialog.showModal();
    this.seen = this.observe();
    this.fill(list.all);
    this.host.files.show();
    api.datasets().then(
      (datasets) => {
        list.set(datasets);
        if (this.dialog.open) this.fill(datasets);
      },
      () => {}, // on failure the cards keep the present list
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

  // Cards with unchanged content are not replaced, and the focus is preserved.
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
    const current = this.host.current();
    for (const [id, { element }] of this.cards) {
      element.setAttribute("aria-current", String(id === current));
    }
    const { children } = this.box;
    const elements: HTMLElement[] = [...this.cards.values()].map(({ element }) => element);
    if (elements.length === 0) elements.push(make("p", "", "The server has no dataset yet."));
    if (elements.length === children.length && elements.every((e, n) => e === children[n])) return;
    const focused = [...old].find(([, { element }]) => element === document.activeElement);
    this.box.replaceChildren(...elements);
    for (const element of elements) this.seen!.observe(element);
    if (old.size > 0 && focused === undefined) return; // the focus is outside the cards
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
        if (!card.isConnected) return; // the card has been replaced
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
