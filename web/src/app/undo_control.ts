// User interface of undo and redo: keys, two buttons and status text. Pointer and key events of the
// whole page delimit gestures.
import { ViewHistory } from "../view/history";
import type { View } from "../wire/protocol";

export interface UndoControlHost {
  document(): View; // explicit keys only
  busy(): boolean; // a dataset is being opened: its view is not there yet
  show(view: View): void; // in place of the present one
  edited(): void; // the user has changed the view
  announce(text: string): void;
}

export class UndoControl {
  private readonly history = new ViewHistory();
  private lastKey = "";
  private quiet = false;
  private buttons: [HTMLButtonElement, HTMLButtonElement] | null = null;

  constructor(private readonly host: UndoControlHost) {}

  // Runs a user action; its changes of the view can be undone.
  edit(run: () => void): void {
    const before = this.host.document();
    run();
    if (this.quiet) return;
    if (this.history.note(before, this.host.document(), performance.now())) this.host.edited();
    this.showButtons();
  }

  // Runs a change of the page's own: no entry, and redo stays possible.
  quietly(run: () => void): void {
    this.quiet = true;
    try {
      run();
    } finally {
      this.quiet = false;
    }
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

  // The same key again goes on with what it did; so do the digits of a number.
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
      this.host.show(found.view);
      this.host.edited();
    }
    this.host.announce(found === null ? nothing : `${done}: ${found.what}`);
    this.showButtons();
  }

  // Not `disabled`: the focus would be lost with the last step.
  private showButtons(): void {
    const { canUndo, canRedo } = this.history;
    this.buttons?.forEach((button, n) =>
      button.setAttribute("aria-disabled", String(!(n === 0 ? canUndo : canRedo))),
    );
  }
}
