// Asks for the token once the server demands one, as after its token was changed. The page and its
// view stay as they are.
import { byId, whenClosed } from "../base/dom";
import { logIn } from "@windsplat/client/parts";

export class Login {
  private readonly dialog = byId("login", HTMLDialogElement);
  private readonly token = byId("login-token", HTMLInputElement);
  private readonly why = byId("login-error", HTMLElement);
  private dismissed = false; // not asked again before the next connection

  constructor(
    private readonly baseUri: string,
    private readonly loggedIn: () => void,
  ) {
    byId("login-form", HTMLFormElement).addEventListener("submit", (event) => {
      event.preventDefault();
      void this.send();
    });
    byId("login-later", HTMLButtonElement).addEventListener("click", () => this.dialog.close());
    byId("login-button", HTMLButtonElement).addEventListener("click", () => this.open());
    whenClosed(this.dialog, () => {
      this.dismissed = true;
      this.token.value = "";
      this.why.hidden = true;
    });
  }

  ask(): void {
    if (!this.dismissed) this.open();
  }

  // The server needs no token, or another tab has logged in.
  done(): void {
    this.dialog.close();
    this.dismissed = false;
  }

  private open(): void {
    if (this.dialog.open) return;
    this.dialog.showModal();
    this.token.focus();
  }

  private async send(): Promise<void> {
    const why = await logIn((url, init) => fetch(url, init), this.baseUri, this.token.value);
    this.why.textContent = why ?? "";
    this.why.hidden = why === null;
    if (why === null) this.loggedIn();
    else this.token.select();
  }
}
