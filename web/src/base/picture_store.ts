// Small pictures by key, as addresses for <img>; the ones not shown for the longest time are
// dropped.
const picturesMax = 96; // of a few kB each

export class PictureStore {
  private readonly urls = new Map<string, string>(); // in the order of their last use

  find(key: string): string | undefined {
    const url = this.urls.get(key);
    if (url !== undefined) this.put(key, url);
    return url;
  }

  keep(key: string, picture: Blob): void {
    this.put(key, URL.createObjectURL(picture));
    for (const [oldest, url] of this.urls) {
      if (this.urls.size <= picturesMax) break;
      this.urls.delete(oldest);
      URL.revokeObjectURL(url);
    }
  }

  private put(key: string, url: string): void {
    this.urls.delete(key);
    this.urls.set(key, url);
  }
}
