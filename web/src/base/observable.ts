// A page-wide value that notifies watchers of changes.
export class Observable<T> {
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
