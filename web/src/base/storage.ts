// The browser's storage, which it may refuse.

// The result, or null if the browser refuses storage; a setting then lasts until a reload.
export function orNull<T>(run: () => T): T | null {
  try {
    return run();
  } catch {
    return null;
  }
}
