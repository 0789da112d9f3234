// Creates the tables of the report.
import type {
  Study,
  StudyAgreement,
  StudyCalibration,
  StudyPoint,
  StudyScene,
} from "../generated/study";
import { element, table } from "./dom";
import { fixed, percent, scientific, short, yesNo } from "./text";

// Both methods with the settings of each scene's view.
export function summaryTable(study: Study): HTMLElement {
  const rows = study.scenes.map((scene) => {
    const numbers = (["kernel", "slab"] as const).flatMap((method) => {
      const own = scene.points.find(
        (point) => point.own && point.method === method && point.compositing === "analytic",
      );
      return own ? [scientific(own.rmse), fixed(own.ms, 2)] : ["", ""];
    });
    const front = scene.points.filter((point) => point.pareto).length;
    const link = element("a", { href: `#${encodeURIComponent(scene.name)}` }, scene.name);
    return { cells: [link, ...numbers, String(front)] };
  });
  const heads = (["kernel", "slab"] as const).flatMap((method) => [
    `${method} analytic, RMSE`,
    "run time (ms)",
  ]);
  return table(
    "Both methods with the settings of each view",
    ["scene", ...heads, "points on the Pareto front"],
    rows,
  );
}

function remarksOf(point: StudyPoint): string {
  const remarks = [];
  if (point.own) remarks.push("own settings");
  if (point.pareto) remarks.push("Pareto front");
  if (!point.stable) remarks.push("unstable");
  return remarks.join(", ");
}

export function pointsTable(scene: StudyScene): HTMLElement {
  const error = ({ rmse }: StudyPoint) => rmse ?? Infinity;
  const sorted = [...scene.points].sort((a, b) =>
    error(a) < error(b) ? -1 : +(error(a) > error(b)),
  );
  const optional = (value: number | undefined) => (value === undefined ? "" : short(value));
  const rows = sorted.map((point) => ({
    className: point.stable ? (point.pareto ? "front" : "") : "unstable",
    cells: [
      `${point.method} ${point.compositing}`,
      short(point.knobs.stride),
      optional(point.knobs.span),
      optional(point.knobs.slabThickness),
      short(point.knobs.stopTransmittance),
      short(point.knobs.width),
      scientific(point.rmse),
      scientific(point.max),
      point.rmse === 0 ? "∞" : fixed(point.psnr, 1),
      fixed(point.flip, 4),
      fixed(point.ms, 2),
      fixed(point.msMin, 2),
      fixed(point.msMax, 2),
      remarksOf(point),
    ],
  }));
  const heads = [
    "method",
    "stride",
    "span",
    "slab thickness",
    "stop transmittance",
    "width (pixels)",
  ];
  const measured = ["RMSE", "maximum", "PSNR (dB)", "FLIP", "median (ms)", "min (ms)", "max (ms)"];
  return table(`${scene.name}: all points, by error`, [...heads, ...measured, "remarks"], rows);
}

export function encodingTable(scene: StudyScene): HTMLElement {
  return table(
    `${scene.name}: errors of the JPEG encoding alone`,
    ["JPEG quality", "RMSE, linear", "PSNR (dB)", "FLIP", "bytes"],
    scene.jpeg.map(({ quality, rmse, psnr, flip, bytes }) => ({
      cells: [
        String(quality),
        scientific(rmse),
        rmse === 0 ? "∞" : fixed(psnr, 1),
        fixed(flip, 4),
        String(bytes),
      ],
    })),
  );
}

export function agreementTable(scene: string, calibration: StudyCalibration): HTMLElement {
  const names: Record<string, string> = {
    estimated: "all estimates",
    prior: "estimates without calibration",
    measured: "measured by a finer rendering",
    jpeg: "JPEG, after one was measured",
  };
  // Only estimates come with a bound.
  const bound = ({ of, bounded }: StudyAgreement) =>
    of === "measured" || of === "jpeg" ? "" : percent(bounded);
  return table(
    `${scene}: agreement of reported with true errors`,
    [
      "reported errors",
      "compared",
      "within a factor of 2",
      "median of reported over true",
      "within the bound",
    ],
    calibration.agreement.map((one) => ({
      cells: [
        names[one.of] ?? one.of,
        String(one.count),
        percent(one.withinTwo),
        fixed(one.median, 2),
        bound(one),
      ],
    })),
  );
}

export function aimsTable(scene: string, calibration: StudyCalibration): HTMLElement {
  const share = (count: number, all: number) => percent(all === 0 ? null : count / all);
  return table(
    `${scene}: settings chosen for a requested maximum error`,
    [
      "maxError",
      "frames",
      "forecast to meet it",
      "of these, met it",
      "possible",
      "of these, met it",
    ],
    calibration.aims.map((aim) => ({
      cells: [
        short(aim.maxError),
        String(aim.frames),
        String(aim.promised),
        share(aim.promisedKept, aim.promised),
        String(aim.possible),
        share(aim.possibleKept, aim.possible),
      ],
    })),
  );
}

export function stabilityTable(study: Study): HTMLElement {
  const largest = Math.max(...study.stability.map(({ tau }) => tau));
  return table(
    "Stability of the compositing operators",
    [
      "compositing",
      "optical depth τ",
      "largest error",
      "minimum",
      "maximum",
      "within [0, 1]",
      "monotone in τ",
      "layers, minimum",
      "layers, maximum",
      "diverges",
    ],
    study.stability.map((one) => ({
      className: one.bounded && one.monotone && !one.diverges ? "" : "unstable",
      cells: [
        one.compositing,
        one.tau === largest ? `${short(one.tau)} (the largest)` : short(one.tau),
        scientific(one.error, 1),
        short(one.min, 4),
        short(one.max, 4),
        yesNo(one.bounded),
        yesNo(one.monotone),
        short(one.layersMin, 4),
        short(one.layersMax, 4),
        yesNo(one.diverges),
      ],
    })),
  );
}
