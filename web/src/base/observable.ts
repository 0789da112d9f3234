// A value of the whole page that tells when it changes.
export class Watched<T> {
  private readonly watchers: ((value: T) => void)[] = [];

  constructor(private current: T) {}

  get value(): T {
    return this.current;
  }

  set(value: T): void {
    if (value === this.current) return;
    this.current = value;
    for (const watcher of this.watchers) watcher(value);
  }

  watch(run: (value: T) => void): void {
    this.watchers.push(run);
  }
}
