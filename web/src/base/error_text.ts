// Errors as text, in the unit chosen for the whole page: RMSE in linear light, or the corresponding
// PSNR in dB. Parts that show errors observe `errorMetric`.
import { formatNumber } from "./ticks";
import { Observable } from "./observable";

export type ErrorMetric = "rmse" | "psnr";

// PSNR in dB of a linear RMSE, with full brightness 1; Infinity for a zero error.
export const psnrOf = (rmse: number): number => -20 * Math.log10(rmse);

// An RMSE with two digits, like 0.011 and 3.2e-4, or a PSNR to a tenth, like 39.2 dB. `rmse` is in
// linear light.
export function errorText(rmse: number, metric: ErrorMetric): string {
  if (metric === "rmse") return formatNumber(rmse, rmse !== 0 && rmse < 1e-3 ? 3 : 2);
  const decibels = psnrOf(rmse);
  return decibels === Infinity ? "∞ dB" : `${decibels.toFixed(1)} dB`;
}

// One step of 8 bits of sRGB at middle grey, in linear light: the slope of IEC 61966-2-1 at 0.5 is
// 0.925, and 0.925 / 255 = 0.0036.
const greyStep = 0.0036;

// A word for a linear RMSE: less than one step of grey cannot be told from the exact picture, five
// can be seen side by side. It is that of the mean over the picture; parts may differ by more.
export function errorWord(rmse: number): "" | "indistinguishable" | "slight" | "visible" {
  if (!Number.isFinite(rmse)) return "";
  if (rmse < greyStep) return "indistinguishable";
  return rmse < 5 * greyStep ? "slight" : "visible";
}

// The name of the metric, to precede its value: "error 0.011", "PSNR 39.2 dB".
export const errorName = (metric: ErrorMetric): string => (metric === "rmse" ? "error" : "PSNR");

// Page-wide setting.
export const errorMetric = new Observable<ErrorMetric>("rmse");

export const toggleErrorMetric = (): void =>
  errorMetric.set(errorMetric.value === "rmse" ? "psnr" : "rmse");
