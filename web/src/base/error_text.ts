// Errors as text, on the whole page alike: as root mean square in linear light, or as the peak
// signal-to-noise ratio in dB that belongs to it. Who shows errors follows `errorMetric`.
import { formatNumber } from "./ticks";
import { Observable } from "./observable";

export type ErrorMetric = "rmse" | "psnr";

// dB of a linear RMSE, where full brightness is 1; no error at all is Infinity.
export const psnrOf = (rmse: number): number => -20 * Math.log10(rmse);

// Two digits, like 0.011 and 3.2e-4, or dB to a tenth, like 39.2 dB. `rmse` in linear light.
export function errorText(rmse: number, metric: ErrorMetric): string {
  if (metric === "rmse") return formatNumber(rmse, rmse !== 0 && rmse < 1e-3 ? 3 : 2);
  const decibels = psnrOf(rmse);
  return decibels === Infinity ? "∞ dB" : `${decibels.toFixed(1)} dB`;
}

// The quantity, before its figure: "error 0.011", "PSNR 39.2 dB".
export const errorName = (metric: ErrorMetric): string => (metric === "rmse" ? "error" : "PSNR");

// Page-wide setting.
export const errorMetric = new Observable<ErrorMetric>("rmse");

export const toggleErrorMetric = (): void =>
  errorMetric.set(errorMetric.value === "rmse" ? "psnr" : "rmse");
