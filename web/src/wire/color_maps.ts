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

  // Places (0..1) and colours; none where the map is not known.
  stops(name: string): [at: number, color: string][] {
    const map = this.maps.find((candidate) => candidate.name === name);
    if (map === undefined) return [];
    // 16 stops are enough for the eye; the last one is always the map's end.
    const step = Math.max(1, Math.floor((map.colors.length - 1) / 16));
    const last = map.colors.length - 1;
    const stops: [number, string][] = [];
    for (let n = 0; n < last; n += step) stops.push([n / last, map.colors[n]!]);
    stops.push([1, map.colors[last]!]);
    return stops;
  }

  // With the map's ends at two places, per cent; what lies beyond them has the ends' colours.
  gradient(name: string, from = 0, to = 100): string {
    const place = (at: number): string => (from + (to - from) * at).toFixed(1);
    const stops = this.stops(name).map(([at, color]) => `${color} ${place(at)}%`);
    if (to < from) stops.reverse();
    return stops.length === 0 ? "none" : `linear-gradient(to right, ${stops.join(", ")})`;
  }
}
