// Draws the legend into a saved picture with the position and size that it has on the page: legend
// entries and canvas -> pixels. Lengths are in CSS pixels; the scale of the context converts them.
import { curvePoints, type LegendEntry } from "../view/legend_entries";

export interface LegendPicture {
  caption: string; // the dataset and the time of the step
  entries: LegendEntry[];
  stops(map: string): [at: number, color: string][];
  font: string; // font family
  cardWidth: number;
}

export interface Card {
  x: number;
  y: number;
  width: number;
  height: number;
}

const edge = 10; // distance from the edge of the picture
const gap = 8;
const pad = 14;
const captionHeight = 26;
const stripTop = 28;
const stripHeight = 14;
const heightShare = 0.6; // greatest fraction of a small picture's height that the legend covers

const glass = "rgb(10 13 18 / 68%)";
const covered = "rgb(10 13 18 / 72%)";
const text = "#dde4ee";
const quiet = "#a3afbf";

const notesOf = (entry: LegendEntry): string[] =>
  [entry.note, entry.leftOut].filter((note) => note !== "");

const heightOf = (entry: LegendEntry, lines: number): number =>
  stripTop + stripHeight + (entry.range === null ? 0 : 21) + 18 * lines + 6;

// Lines of a note that are no wider than `wide`, unless a single word is: broken after commas where
// that fits, else between words. widthOf: of a text, in the unit of `wide`.
export function wrapNote(note: string, wide: number, widthOf: (text: string) => number): string[] {
  const pack = (parts: string[]): string[] => {
    const lines: string[] = [];
    for (const part of parts) {
      const longer = lines.length === 0 ? part : `${lines.at(-1)} ${part}`;
      if (lines.length > 0 && widthOf(longer) <= wide) lines[lines.length - 1] = longer;
      else lines.push(part);
    }
    return lines;
  };
  const phrases = pack(note.split(/(?<=,) /));
  return phrases.flatMap((phrase) =>
    widthOf(phrase) <= wide ? [phrase] : pack(phrase.split(" ")),
  );
}

// Cards in rows from the lower left, preceded by the caption above them. `shrink` is the factor by
// which the cards are drawn smaller; the positions are in unshrunk pixels. notes: lines below the
// ticks of each entry.
export function layoutCards(
  entries: LegendEntry[],
  cardWidth: number,
  width: number,
  height: number,
  notes = entries.map(notesOf),
): { cards: Card[]; shrink: number } {
  const wide = Math.min(cardWidth, width - 2 * edge);
  const columns = Math.max(1, Math.floor((width - 2 * edge + gap) / (cardWidth + gap)));
  const rows: number[] = []; // the greatest card height in each row
  entries.forEach((entry, n) => {
    const row = Math.floor(n / columns);
    rows[row] = Math.max(rows[row] ?? 0, heightOf(entry, notes[n]!.length));
  });
  const total = rows.reduce((sum, row) => sum + row + gap, captionHeight + edge);
  const shrink = Math.min(1, (heightShare * height) / total);
  let bottom = height / shrink - total + captionHeight;
  const cards = [{ x: edge, y: bottom - captionHeight, width: wide, height: captionHeight }];
  entries.forEach((entry, n) => {
    const column = n % columns;
    if (column === 0) bottom += gap + rows[n / columns]!;
    const high = heightOf(entry, notes[n]!.length);
    const x = edge + column * (wide + gap);
    cards.push({ x, y: bottom - high, width: wide, height: high });
  });
  return { cards, shrink };
}

export function drawLegend(
  context: CanvasRenderingContext2D,
  { caption, entries, stops, font, cardWidth }: LegendPicture,
  scale: number, // pixels per CSS pixel
): void {
  const { width, height } = context.canvas;
  const page = [width / scale, height / scale] as const;
  const wide = Math.min(cardWidth, page[0] - 2 * edge) - 2 * pad;
  context.font = `11px ${font}`;
  const widthOf = (line: string): number => context.measureText(line).width;
  const notes = entries.map((entry) =>
    notesOf(entry).flatMap((note) => wrapNote(note, wide, widthOf)),
  );
  const { cards, shrink } = layoutCards(entries, cardWidth, ...page, notes);
  const write = (line: string, x: number, y: number, style: string, color: string, max: number) => {
    context.font = `${style} ${font}`;
    context.fillStyle = color;
    context.fillText(line, x, y, max);
  };
  context.save();
  context.scale(scale * shrink, scale * shrink);
  context.font = `600 12px ${font}`;
  cards[0]!.width = Math.min(
    context.measureText(caption).width + 2 * pad,
    width / scale / shrink - 2 * edge,
  );
  for (const card of cards) {
    roundCard(context, card);
    context.fillStyle = glass;
    context.fill();
  }
  const [head, ...rest] = cards as [Card, ...Card[]];
  write(caption, head.x + pad, head.y + 17, "600 12px", text, head.width - 2 * pad);
  entries.forEach((entry, n) => {
    const { x, y } = rest[n]!;
    const left = x + pad;
    context.font = `12px ${font}`;
    const units = context.measureText(entry.units).width;
    write(entry.title, left, y + 19, "600 12px", text, wide - (units > 0 ? units + 10 : 0));
    context.textAlign = "right";
    write(entry.units, left + wide, y + 19, "12px", quiet, wide);
    drawStrip(context, entry, stops, left, y + stripTop, wide);
    let line = y + stripTop + stripHeight;
    context.textAlign = "center";
    for (const tick of entry.ticks) {
      const at = left + tick.at * wide;
      context.fillStyle = text;
      context.fillRect(at - 0.5, line + 1, 1, 5);
      write(tick.text, at, line + 17, "11px", text, wide);
    }
    context.textAlign = "left";
    if (entry.range !== null) line += 21;
    for (const note of notes[n]!) {
      write(note, left, line + 14, "11px", quiet, wide);
      line += 18;
    }
  });
  context.restore();
}

function roundCard(context: CanvasRenderingContext2D, { x, y, width, height }: Card): void {
  const [right, bottom] = [x + width, y + height];
  context.beginPath();
  context.moveTo(x + 8, y);
  context.arcTo(right, y, right, bottom, 8);
  context.arcTo(right, bottom, x, bottom, 8);
  context.arcTo(x, bottom, x, y, 8);
  context.arcTo(x, y, right, y, 8);
}

function drawStrip(
  context: CanvasRenderingContext2D,
  entry: LegendEntry,
  stops: LegendPicture["stops"],
  x: number,
  y: number,
  width: number,
): void {
  const colors = context.createLinearGradient(x, 0, x + width, 0);
  if (entry.map !== null) for (const stop of stops(entry.map)) colors.addColorStop(...stop);
  context.save();
  context.fillStyle = "rgb(255 255 255 / 22%)";
  context.fillRect(x - 1, y - 1, width + 2, stripHeight + 2);
  context.fillStyle = entry.map === null ? (entry.color ?? "") : colors;
  context.fillRect(x, y, width, stripHeight);
  // Triangles at the ends beyond which values lie; the gradient continues with the end's colour.
  for (const [n, at, tip] of [
    [0, x, -8],
    [1, x + width, 8],
  ] as const) {
    if (!entry.beyond[n] || entry.map === null) continue;
    context.beginPath();
    context.moveTo(at, y);
    context.lineTo(at + tip, y + stripHeight / 2);
    context.lineTo(at, y + stripHeight);
    context.fill();
  }
  if (entry.extinction.length > 0) {
    const at = curvePoints(entry.extinction).map(
      ([u, v]) => [x + u * width, y + v * stripHeight] as const,
    );
    const curve = (): void => {
      context.beginPath();
      for (const place of at) context.lineTo(...place);
    };
    context.beginPath();
    context.rect(x, y, width, stripHeight);
    context.clip();
    curve();
    context.lineTo(at.at(-1)![0], y);
    context.lineTo(at[0]![0], y);
    context.fillStyle = covered;
    context.fill();
    curve();
    context.strokeStyle = "#fff";
    context.lineWidth = 1.2;
    context.stroke();
  }
  context.restore();
}
