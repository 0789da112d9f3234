// Numbers as text. null: not measured in the study.

export type Known = number | null;

const unknown = "–";

export const scientific = (value: Known, digits = 2): string =>
  value === null ? unknown : value.toExponential(digits);

export const fixed = (value: Known, digits: number): string =>
  value === null ? unknown : value.toFixed(digits);

// At most `digits` significant digits without trailing zeros; very small and large numbers with an
// exponent.
export function short(value: Known, digits = 6): string {
  if (value === null) return unknown;
  const size = Math.abs(value);
  if (size === 0 || (size >= 1e-4 && size < 10 ** digits)) {
    return String(Number(value.toPrecision(digits)));
  }
  return value.toExponential(digits - 1).replace(/\.?0*e\+?/, "e");
}

export const percent = (share: Known): string =>
  share === null ? unknown : `${fixed(100 * share, 1)} %`;

export const yesNo = (value: boolean): string => (value ? "yes" : "no");

const superscripts = "⁰¹²³⁴⁵⁶⁷⁸⁹";

// Label of a logarithmic axis: 10⁻³, 2×10⁻³.
export function powerOfTen(value: number): string {
  const [factor, exponent = "0"] = value.toExponential(0).split("e");
  const digits = exponent
    .replace("+", "")
    .replace("-", "⁻")
    .replace(/\d/g, (digit) => superscripts[Number(digit)] ?? "");
  return factor === "1" ? `10${digits}` : `${factor}×10${digits}`;
}
