// User interface of undo and redo: keys, two buttons and status text. Pointer and key events
// anywhere on the page delimit the undo entries.
import { ViewHistory } from "../view/history";
import type { View } from "@windsplat/client";

export interface UndoControlHost {
  document(): View; // explicit keys only
  busy(): boolean; // a dataset is being opened and its view is not known yet
  show(view: View): void; // replaces the present view
  edited(): void; // the user has changed the view
  announce(text: string): void;
}

export class UndoControl {
  private readonly history = new ViewHistory();
  private lastKey = "";
  private quiet = false;
  private buttons: [HTMLButtonElement, HTMLButtonElement] | null = null;

  constructor(private readonly host: UndoControlHost) {}

  // Runs a user action whose changes of the view can be undone.
  edit(run: () => void): void {
    const before = this.host.document();
    run();
    if (this.quiet) return;
    if (this.history.note(before, this.host.document(), performance.now())) this.host.edited();
    this.showButtons();
  }

  // Runs a change made by the page itself: it adds no undo entry, and redo remains possible.
  quietly(run: () => void): void {
    this.quiet = true;
    try {
      run();
    } finally {
      this.quiet = false;
    }
  }

  // For a change that follows later: runs it as it would be run now, as an edit or quietly.
  later(): (run: () => void) => void {
    const quiet = this.quiet;
    return (run) => (quiet ? this.quietly(run) : this.edit(run));
  }

  undo(): void {
    this.turn("undo", "undone", "nothing to undo");
  }

  redo(): void {
    this.turn("redo", "redone", "nothing to redo");
  }

  bind(undo: HTMLButtonElement, redo: HTMLButtonElement): void {
    this.buttons = [undo, redo];
    undo.addEventListener("click", () => this.undo());
    redo.addEventListener("click", () => this.redo());
    this.showButtons();
  }

  watch(target: EventTarget): void {
    const on = (type: string, run: (event: Event) => void) =>
      target.addEventListener(type, run, { capture: true, passive: true });
    on("pointerdown", () => this.history.begin(true));
    for (const end of ["pointerup", "pointercancel"]) on(end, () => this.history.end());
    on("keydown", (event) => this.keyDown(event as KeyboardEvent));
  }

  // Pressing the same key again, or further digits of a number, extends the same undo entry.
  private keyDown({ key, repeat, target }: KeyboardEvent): void {
    const again = repeat || key === this.lastKey;
    const types = target instanceof HTMLInputElement && /number|text/.test(target.type);
    this.lastKey = key;
    if (!again && !types) this.history.begin(false);
  }

  private turn(way: "undo" | "redo", done: string, nothing: string): void {
    if (this.host.busy()) return;
    const found = this.history[way](this.host.document());
    if (found !== null) {
      this.quietly(() => this.host.show(found.view));
      this.host.edited();
    }
    this.host.announce(found === null ? nothing : `${done}: ${found.what}`);
    this.showButtons();
  }

  // aria-disabled instead of `disabled`: a disabled button would lose the focus.
  private showButtons(): void {
    const { canUndo, canRedo } = this.history;
    this.buttons?.forEach((button, n) =>
      button.setAttribute("aria-disabled", String(!(n === 0 ? canUndo : canRedo))),
    );
  }
}
