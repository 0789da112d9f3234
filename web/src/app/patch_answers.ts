// Outcomes of patches: frames drawn, `unchanged` and refusals -> which changes of the view are
// confirmed, and each frame's `chosen` message.
import type { ChosenMessage, FrameHeader, UnchangedMessage } from "../wire/protocol";
import type { ViewState } from "../view/view_state";

const chosenKept = 8; // `chosen` messages whose frames may still come

export class PatchAnswers {
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

  onChosen(chosen: ChosenMessage): void {
    this.chosen.set(chosen.seq, chosen);
    for (const seq of this.chosen.keys()) {
      if (this.chosen.size > chosenKept) this.chosen.delete(seq);
    }
  }

  // A refused patch is reverted, so that controls and link match the picture.
  refuse(rev: number): void {
    this.refusedRev = rev;
    this.state.refuse(rev);
  }

  // Whether a frame or answer of this rev is newer than the last refusal.
  isAfterRefusal(rev: number): boolean {
    return rev > this.refusedRev;
  }

  // A frame is on the canvas: its `chosen` message, if one came.
  drawn({ seq, rev }: FrameHeader): ChosenMessage | null {
    this.shownSeq = seq;
    this.state.settle(rev);
    const chosen = this.chosen.get(seq) ?? null;
    this.chosen.delete(seq);
    return chosen;
  }

  // Whether the frame is the first that answers its patch: later ones do not measure the latency.
  isFirst({ t }: FrameHeader): boolean {
    const first = t > 0 && t !== this.answeredT;
    this.answeredT = t;
    return first;
  }

  onUnchanged(message: UnchangedMessage): void {
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
