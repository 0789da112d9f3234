// When an element's size may be acted on.

// Paper shows the present picture; its size on paper is none to draw at.
export const isPrinting = (): boolean => window.matchMedia("print").matches;

// After the picture's place has changed its size, once that rests.
export const afterResizing = (run: () => void): (() => void) =>
  debounced(() => {
    if (!isPrinting()) run();
  }, 120);

// Runs `run` once, `ms` after the last call.
export function debounced(run: () => void, ms: number): () => void {
  let timer: number | undefined;
  return () => {
    window.clearTimeout(timer);
    timer = window.setTimeout(run, ms);
  };
}
