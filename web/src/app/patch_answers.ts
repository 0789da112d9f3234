// What has become of the patches: frames drawn, `unchanged` and refusals -> which of the view's
// changes stand, and of each frame what the server told of it.
import type { ChosenMessage, FrameHeader, UnchangedMessage } from "../wire/protocol";
import type { ViewState } from "../view/view_state";

const chosenKept = 8; // `chosen` messages whose frames may still come

export class Answers {
  private readonly chosen = new Map<number, ChosenMessage>();
  private shownSeq = 0; // of the frame on the canvas
  private unchanged: UnchangedMessage | null = null; // its frame is not shown yet
  private refusedRev = 0; // of the newest patch that was refused
  private answeredT = 0; // t of the newest patch that a frame has answered

  constructor(private readonly state: ViewState) {}

  newSession(): void {
    this.chosen.clear();
    this.unchanged = null;
    this.shownSeq = 0;
  }

  tell(chosen: ChosenMessage): void {
    this.chosen.set(chosen.seq, chosen);
    for (const seq of this.chosen.keys()) {
      if (this.chosen.size > chosenKept) this.chosen.delete(seq);
    }
  }

  // What was refused is taken back, so that controls and link tell what is drawn.
  refuse(rev: number): void {
    this.refusedRev = rev;
    this.state.refuse(rev);
  }

  // A frame of this rev or an answer to it: all is well after what was refused.
  mends(rev: number): boolean {
    return rev > this.refusedRev;
  }

  // A frame is on the canvas; how it was drawn, if that was told.
  drawn({ seq, rev }: FrameHeader): ChosenMessage | null {
    this.shownSeq = seq;
    this.state.settle(rev);
    const chosen = this.chosen.get(seq) ?? null;
    this.chosen.delete(seq);
    return chosen;
  }

  // Whether the frame is the first that answers its patch: later ones do not tell how fast.
  isFirst({ t }: FrameHeader): boolean {
    const first = t > 0 && t !== this.answeredT;
    this.answeredT = t;
    return first;
  }

  stays(message: UnchangedMessage): void {
    this.unchanged = message;
  }

  // A patch changed nothing that shows: once its frame is there, that is the answer to it. The rev
  // of that patch; null: there is none.
  settleUnchanged(): number | null {
    if (this.unchanged === null || this.shownSeq < this.unchanged.seq) return null;
    const { rev } = this.unchanged;
    this.unchanged = null;
    this.state.settle(rev);
    return rev;
  }
}
