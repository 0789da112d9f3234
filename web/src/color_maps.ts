// GET v1/colormaps -> names and CSS gradients. Until they are there, or if they never come, a name
// has no gradient and the pickers hold only what the view says.

interface ColorMap {
  name: string;
  colors: string[];
}

export class ColorMaps {
  private maps: ColorMap[] = [];

  async load(baseUri: string): Promise<void> {
    const response = await fetch(new URL("v1/colormaps", baseUri));
    if (!response.ok) throw new Error(`colour maps: HTTP ${response.status}`);
    const answer = (await response.json()) as { colormaps: ColorMap[] };
    this.maps = answer.colormaps;
  }

  get loaded(): boolean {
    return this.maps.length > 0;
  }

  names(): string[] {
    return this.maps.map((map) => map.name);
  }

  gradient(name: string): string {
    const map = this.maps.find((candidate) => candidate.name === name);
    if (map === undefined) return "none";
    // 16 stops are enough for the eye; the last one is always the map's end.
    const step = Math.max(1, Math.floor((map.colors.length - 1) / 16));
    const last = map.colors.length - 1;
    const stops: string[] = [];
    for (let n = 0; n < last; n += step) {
      stops.push(`${map.colors[n]} ${((100 * n) / last).toFixed(1)}%`);
    }
    stops.push(`${map.colors[last]} 100%`);
    return `linear-gradient(to right, ${stops.join(", ")})`;
  }
}
