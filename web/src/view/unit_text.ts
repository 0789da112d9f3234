// Units of files -> as people write them.
const raised: Record<string, string> = { "-": "⁻" };
[..."⁰¹²³⁴⁵⁶⁷⁸⁹"].forEach((sign, digit) => (raised[String(digit)] = sign));

// Units that are written out, in the singular and lower case -> their symbols.
const symbols: Record<string, string> = {
  ...{ meter: "m", metre: "m", kilometer: "km", kilometre: "km" },
  ...{ centimeter: "cm", centimetre: "cm", millimeter: "mm", millimetre: "mm" },
  ...{ second: "s", sec: "s", minute: "min", hour: "h" },
  ...{ kelvin: "K", degk: "K", deg_k: "K", degree_kelvin: "K" },
  ...{ degc: "°C", deg_c: "°C", celsius: "°C", degree_c: "°C", degree_celsius: "°C", degree: "°" },
  ...{ pascal: "Pa", hectopascal: "hPa", millibar: "mbar", kilogram: "kg", gram: "g" },
  ...{ joule: "J", watt: "W", newton: "N", volt: "V", percent: "%" },
};

function symbolOf(word: string): string {
  const name = word.toLowerCase();
  const singular = name.startsWith("degrees_") ? name.replace("s_", "_") : name.replace(/s$/, "");
  return symbols[name] ?? symbols[singular] ?? word;
}

// As people write it: "m s-1", "m s**-1", "m s^-1", "meter second-1", "meters per second" ->
// "m s⁻¹". In CF, "1" means dimensionless, as "(0 - 1)" of ECMWF.
export function unitText(units: string | undefined): string {
  if (units === undefined || units === "1" || units === "(0 - 1)") return "";
  const celsius = units.replace(/\bdeg(?:rees?)? c(?:elsius)?\b/gi, "°C");
  const parts = /( per )?([A-Za-z_]+)(?:(?:\*\*|\^)?(-?\d+)(?=$|[ ./*]))?/g;
  return celsius.replace(parts, (_, per: string | undefined, word: string, power = "") => {
    const signed = per === undefined ? power : `-${power === "" ? "1" : power}`;
    const high = [...signed].map((sign) => raised[sign] ?? "").join("");
    return `${per === undefined ? "" : " "}${symbolOf(word)}${high}`;
  });
}
