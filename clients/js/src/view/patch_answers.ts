// Outcomes of patches: drawn frames, `unchanged` messages and refusals -> the confirmed changes of
// the view and the `chosen` message of each frame.
import type { ChosenMessage, FrameHeader, UnchangedMessage } from "../wire/protocol";
import type { ViewState } from "./view_state";

const chosenKept = 8; // number of `chosen` messages stored until their frames arrive

export class PatchAnswers {
  private readonly chosen = new Map<number, ChosenMessage>();
  private shownSeq = 0; // seq of the frame on the canvas
  private unchanged: UnchangedMessage | null = null; // its frame is not shown yet
  private refusedRev = 0; // rev of the newest refused patch

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

  // Whether a frame or answer with this rev is newer than the last refusal.
  isAfterRefusal(rev: number): boolean {
    return rev > this.refusedRev;
  }

  // Called when a frame is on the canvas. Returns its `chosen` message if one was received.
  drawn({ seq, rev }: FrameHeader): ChosenMessage | null {
    this.shownSeq = seq;
    this.state.settle(rev);
    const chosen = this.chosen.get(seq) ?? null;
    this.chosen.delete(seq);
    return chosen;
  }

  onUnchanged(message: UnchangedMessage): void {
    this.unchanged = message;
  }

  // For a patch that changed nothing visible, the frame already shown is the answer once it is on
  // the canvas. Returns the rev of that patch; null: there is none.
  settleUnchanged(): number | null {
    if (this.unchanged === null || this.shownSeq < this.unchanged.seq) return null;
    const { rev } = this.unchanged;
    this.unchanged = null;
    this.state.settle(rev);
    return rev;
  }
}
