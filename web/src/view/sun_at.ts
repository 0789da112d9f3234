// Time and place at which the sun of a view stands.
import type { Dataset, View } from "@windsplat/client";

type SunAt = NonNullable<NonNullable<View["light"]>["sunAt"]>;

const noTime = "2024-03-20T12:00"; // an equinox at noon, for steps without dates

// "2024-06-21T12:00:30Z" -> "2024-06-21T12:00"; null: not a time in UTC.
export function minuteOf(text: string): string | null {
  const found = /^(\d{4}-\d{2}-\d{2}T\d{2}:\d{2})(:\d{2}(\.\d+)?)?Z$/.exec(text);
  return found?.[1] ?? null;
}

// The middle of an axis in degrees; 0 for other axes.
function middleOf({ axes }: Dataset, axis: "x" | "y", kind: "longitude" | "latitude"): number {
  const { kind: own, coordinates } = axes[axis];
  if (own !== kind || coordinates.length === 0) return 0;
  const middle = 0.5 * (Math.min(...coordinates) + Math.max(...coordinates));
  return Number(middle.toFixed(2));
}

// At the time of a step, in the middle of the data.
export function sunAtStep(dataset: Dataset, step: number): SunAt {
  const minute = minuteOf(dataset.steps.times[step]?.text ?? "") ?? noTime;
  return {
    utc: `${minute}Z`,
    longitude: middleOf(dataset, "x", "longitude"),
    latitude: middleOf(dataset, "y", "latitude"),
  };
}

const degree = Math.PI / 180;
const daysTo2000 = 10957.5; // from 1970-01-01 00:00 to 2000-01-01 12:00 UTC
const dayMs = 86_400_000;

// Height of the sun in degrees, to a hundredth of a degree and without refraction, by the formulas
// of low precision in the Astronomical Almanac, as the server has them. NaN: no time.
export function sunHeight({ utc, longitude, latitude }: SunAt): number {
  const days = Date.parse(utc) / dayMs - daysTo2000;
  const sine = (degrees: number) => Math.sin(degrees * degree);
  const cosine = (degrees: number) => Math.cos(degrees * degree);
  const anomaly = 357.528 + 0.9856003 * days;
  const ecliptic = 280.46 + 0.9856474 * days + 1.915 * sine(anomaly) + 0.02 * sine(2 * anomaly);
  const obliquity = 23.439 - 4e-7 * days;
  const ascension = Math.atan2(cosine(obliquity) * sine(ecliptic), cosine(ecliptic)) / degree;
  const declination = Math.asin(sine(obliquity) * sine(ecliptic)) / degree;
  const sidereal = 15 * (18.697374558 + 24.06570982441908 * days);
  const hourAngle = longitude - (ascension - sidereal);
  const up =
    sine(latitude) * sine(declination) + cosine(latitude) * cosine(declination) * cosine(hourAngle);
  return Math.asin(Math.min(1, Math.max(-1, up))) / degree;
}

// Why a picture is dark whose sun does not shine; empty: it shines. On a globe it always shines
// somewhere. view: as completed by the server.
export function nightText({ light, geometry }: View): string {
  if (!light || geometry?.mapping === "sphere") return "";
  const { sunAt = null, elevation = 0, brightness = 1 } = light;
  if (brightness === 0) return "";
  const height = sunAt === null ? elevation : sunHeight(sunAt);
  if (!(height < 0)) return "";
  const below = `The sun is ${Math.max(1, Math.round(-height))}° below the horizon`;
  return sunAt === null ? `${below}.` : `${below} here at this time.`;
}
