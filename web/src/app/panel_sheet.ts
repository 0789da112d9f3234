// The handle of the panel where it is a sheet below the picture, on narrow screens: a click or a
// drag downward folds the sheet. The panel's button in the header shows it again.
const foldPixels = 32; // a shorter drag is none

export function panelSheet(handle: HTMLElement, fold: () => void): void {
  let from: number | null = null;
  handle.addEventListener("pointerdown", (event) => {
    from = event.clientY;
    handle.setPointerCapture(event.pointerId);
  });
  handle.addEventListener("pointermove", (event) => {
    if (from === null || event.clientY - from < foldPixels) return;
    from = null;
    fold();
  });
  for (const end of ["pointerup", "pointercancel"]) {
    handle.addEventListener(end, () => (from = null));
  }
  handle.addEventListener("click", fold);
}
