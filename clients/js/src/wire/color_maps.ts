// GET v1/colormaps -> names and CSS gradients. Until the maps are loaded, or if loading fails, no
// name has a gradient and the pickers list only the name in the view.

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

  // Positions (0..1) and colours; empty for an unknown map.
  stops(name: string): [at: number, color: string][] {
    const map = this.maps.find((candidate) => candidate.name === name);
    if (map === undefined) return [];
    // About 16 stops suffice visually; the last one is always the end of the map.
    const step = Math.max(1, Math.floor((map.colors.length - 1) / 16));
    const last = map.colors.length - 1;
    const stops: [number, string][] = [];
    for (let n = 0; n < last; n += step) stops.push([n / last, map.colors[n]!]);
    stops.push([1, map.colors[last]!]);
    return stops;
  }

  // A gradient with the ends of the map at two positions in per cent; beyond them the end colours
  // continue.
  gradient(name: string, from = 0, to = 100): string {
    const place = (at: number): string => (from + (to - from) * at).toFixed(1);
    const stops = this.stops(name).map(([at, color]) => `${color} ${place(at)}%`);
    if (to < from) stops.reverse();
    return stops.length === 0 ? "none" : `linear-gradient(to right, ${stops.join(", ")})`;
  }
}
