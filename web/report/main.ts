// The report of the command study: the JSON in its page -> figures, tables and pictures.
import type { Study, StudyCalibration, StudyPicture, StudyScene } from "../generated/study";
import { calibrationFigure } from "./calibration_figure";
import { details, element } from "./dom";
import { errorFigure } from "./error_figure";
import { extremesSection } from "./extremes";
import {
  agreementTable,
  aimsTable,
  encodingTable,
  pointsTable,
  stabilityTable,
  summaryTable,
} from "./tables";
import { fixed, scientific } from "./text";

function introduction(study: Study): string {
  const { machine } = study;
  const skipped = study.skipped > 0 ? `, ${study.skipped} taken from earlier runs` : "";
  return [
    `windsplat ${machine.windsplat} (${machine.kernels}), built by ${machine.compiler},`,
    `on ${machine.processor}, ${machine.system}:`,
    `render threads: ${machine.threads}, hardware threads: ${machine.hardwareThreads}.`,
    study.extremes ? "" : `Each time is the median of ${study.runs} runs after one to warm up.`,
    study.extremes ? "" : `${study.measured} points measured${skipped}.`,
    `${fixed(study.seconds, 1)} s in all.`,
    study.quick ? "A quick study: small pictures and few points." : "",
  ].join(" ");
}

function reference(scene: StudyScene): string {
  const of = scene.reference;
  const size = `${of.width} × ${of.height} pixels.`;
  if (of.kind === "extrapolated") {
    const error = `its own error is about ${scientific(of.estimate, 1)}`;
    return `${size} The reference is extrapolated from slabs of thickness 1/4 and 1/8; ${error}.`;
  }
  const seconds = of.seconds === null ? "" : `, ${fixed(of.seconds, 1)} s`;
  return [
    `${size} The reference is the rendering integral in double precision:`,
    `tolerance ${scientific(of.tolerance, 0)}, ${of.pieces} pieces,`,
    `${of.evaluations} evaluations${seconds}.`,
  ].join(" ");
}

function picture(scene: StudyScene, png: string, caption: string): HTMLElement {
  const width = Math.max(200, Math.min(2 * scene.reference.width, 320));
  const image = element("img", {
    alt: `${scene.name}, ${caption}`,
    width: String(width),
    src: `data:image/png;base64,${png}`,
  });
  return element("figure", {}, image, element("figcaption", {}, caption));
}

function pair(scene: StudyScene, { title, png, differencePng }: StudyPicture): HTMLElement {
  const pair = element("div", { class: "pair" }, picture(scene, png, title));
  if (differencePng) pair.append(picture(scene, differencePng, `${title}, difference × 10`));
  return pair;
}

function calibrationSection(scene: string, calibration: StudyCalibration): HTMLElement {
  const { looks, surveyed, heldOut, width, height } = calibration;
  const checks = calibration.checks.map(
    ({ look, apart, estimate }) =>
      `${look} ${scientific(apart, 1)} (estimated as ${scientific(estimate, 1)})`,
  );
  const words = [
    `Of each of ${looks.length} variants of the scene, ${surveyed} views were calibrated and`,
    `${heldOut} other views rendered at every setting, ${width} × ${height} pixels, at any azimuth`,
    "and a zoom of 0.6 to 4. Their reference is extrapolated from slabs of 1/4 and 1/8 of a cell.",
  ];
  if (checks.length > 0) {
    words.push(`RMS difference of that reference from the integral: ${checks.join("; ")}.`);
  }
  return element(
    "section",
    {},
    element("h3", {}, "Accuracy of reported errors"),
    element("p", {}, words.join(" ")),
    calibrationFigure(scene, calibration),
    agreementTable(scene, calibration),
    aimsTable(scene, calibration),
  );
}

function sceneSection(scene: StudyScene): HTMLElement {
  const section = element(
    "section",
    {},
    element("h2", { id: scene.name }, scene.name),
    element("p", {}, reference(scene)),
    errorFigure(scene),
  );
  if (scene.reconstructionRipple) {
    const words = [
      `Reconstruction ripple: ${scientific(scene.reconstructionRipple, 1)}. It is the error of`,
      "overlapping footprints against a uniform medium of optical depth 1, and not part of the",
      "errors above: the reference consists of the same footprints.",
    ];
    section.append(element("p", {}, words.join(" ")));
  }
  section.append(
    details("All points", pointsTable(scene)),
    details("JPEG encoding", encodingTable(scene)),
    details("View", element("pre", {}, JSON.stringify(scene.view, null, 1))),
    element("div", { class: "pictures" }, ...(scene.pictures ?? []).map((one) => pair(scene, one))),
  );
  if (scene.calibration) section.append(calibrationSection(scene.name, scene.calibration));
  return section;
}

function stabilitySection(study: Study): HTMLElement {
  const words = [
    "One kernel with a line of opacity 0.6 at nine depths of a cell of optical depth τ, rendered",
    `by the engine and compared with its closed form; and ${study.stabilityLayers} such cells`,
    "behind each other, without the line. A view's extinction is at most 1e30 per world unit,",
    "which gives the largest τ.",
  ];
  return element(
    "section",
    {},
    element("h2", { id: "stability" }, "Stiffness"),
    element("p", {}, words.join(" ")),
    stabilityTable(study),
  );
}

const study = JSON.parse(document.getElementById("study")!.textContent!) as Study;
document.title = `windsplat: ${study.extremes ? "extreme cases" : "error against run time"}`;
document
  .getElementById("report")!
  .append(
    element("h1", {}, document.title),
    element("p", {}, introduction(study)),
    ...(study.extremes
      ? [extremesSection(study.extremes)]
      : [summaryTable(study), ...study.scenes.map(sceneSection), stabilitySection(study)]),
  );
