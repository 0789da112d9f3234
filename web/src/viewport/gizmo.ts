// The axis gizmo shows the orientation of the volume. Its six ends are buttons that set the view
// direction: east, north and up (or x, y, z) and their opposites.
import { cameraFrame, type Angles, type Camera, type Dataset } from "@windsplat/client";
import { dot, type Vec3 } from "@windsplat/client/parts";
import { make, makeSvg } from "../base/dom";

const reach = 36; // length of the longest arm, percent of the gizmo's size

export interface Look {
  name: string; // "from the south"
  key: string;
  sign: string; // label on the gizmo; empty for the opposite ends
  way: Vec3 | null; // direction of the axis end; null: not an axis end
  angles: Angles;
}

type Named = [string, string, Look["key"], Vec3 | null, number, number];

const geographic: Named[] = [
  ["from the south", "", "1", [0, -1, 0], 0, 0],
  ["from the north", "N", "2", [0, 1, 0], 180, 0],
  ["from the east", "E", "3", [1, 0, 0], 90, 0],
  ["from the west", "", "4", [-1, 0, 0], -90, 0],
  ["from above", "Up", "5", [0, 0, 1], 0, 90],
  ["from below", "", "6", [0, 0, -1], 0, -90],
  ["isometric", "", "7", null, 45, Math.atan(Math.SQRT1_2) / (Math.PI / 180)],
];
const plain: [string, string][] = [
  ["from −y", ""],
  ["from +y", "y"],
  ["from +x", "x"],
  ["from −x", ""],
  ["from +z", "z"],
  ["from −z", ""],
];

export const looks: Look[] = geographic.map(([name, sign, key, way, azimuth, elevation]) => ({
  name,
  sign,
  key,
  way,
  angles: { azimuth, elevation },
}));

export interface GizmoArm {
  axis: string;
  x: number; // right and up on the screen, -1..1
  y: number;
  depth: number; // > 0: points away from the eye
}

const axisOf = (way: Vec3): string => ["x", "y", "z"][way.findIndex((value) => value !== 0)]!;

function armOf(camera: Camera, way: Vec3): GizmoArm {
  const { right, up, forward } = cameraFrame(camera);
  return { axis: axisOf(way), x: dot(way, right), y: dot(way, up), depth: dot(way, forward) };
}

// The three axes, the farthest first.
export const gizmoArms = (camera: Camera): GizmoArm[] =>
  (
    [
      [1, 0, 0],
      [0, 1, 0],
      [0, 0, 1],
    ] as Vec3[]
  )
    .map((way) => armOf(camera, way))
    .sort((a, b) => b.depth - a.depth);

// Whether x points east and y north: longitudes, or axes that are named so, as those of WRF.
export const isGeographic = (axes: Dataset["axes"]): boolean =>
  axes.x.kind === "longitude" || (/east/i.test(axes.x.name) && /north/i.test(axes.y.name));

export class Gizmo {
  private readonly lines = makeSvg("svg", { viewBox: "-50 -50 100 100", "aria-hidden": "true" });
  private readonly ends: { look: Look; button: HTMLButtonElement }[] = [];

  constructor(element: HTMLElement, lookFrom: (angles: Angles) => void) {
    element.append(this.lines);
    for (const look of looks) {
      if (look.way === null) continue;
      const kind = `gizmo-end arm-${axisOf(look.way)}${look.sign === "" ? " opposite" : ""}`;
      const button = make("button", kind);
      button.append(make("span"));
      button.addEventListener("click", () => lookFrom(look.angles));
      element.append(button);
      this.ends.push({ look, button });
    }
    this.setNames(true);
  }

  setAxes(axes: Dataset["axes"]): void {
    this.setNames(isGeographic(axes));
  }

  private setNames(on: boolean): void {
    this.ends.forEach(({ look, button }, n) => {
      const [name, sign] = on ? [look.name, look.sign] : plain[n]!;
      // What is written on the button is part of its name, so that it can be spoken.
      const written = name.toLowerCase().includes(sign.toLowerCase()) ? "" : ` (${sign})`;
      button.setAttribute("aria-label", `View ${name}${written}`);
      button.title = `View ${name} (${look.key})`;
      button.firstElementChild!.textContent = sign;
    });
  }

  show(camera: Camera): void {
    this.lines.replaceChildren(
      ...gizmoArms(camera).map(({ axis, x, y, depth }) =>
        makeSvg("line", {
          class: `arm-${axis}${depth > 0.02 ? " away" : ""}`,
          x2: x * reach,
          y2: -y * reach,
        }),
      ),
    );
    for (const { look, button } of this.ends) {
      const { x, y, depth } = armOf(camera, look.way!);
      button.style.left = `${(50 + x * reach).toFixed(2)}%`;
      button.style.top = `${(50 - y * reach).toFixed(2)}%`;
      button.style.zIndex = String(Math.round(10 - 9 * depth)); // the nearest is drawn on top
      button.classList.toggle("away", depth > 0.02);
    }
  }
}
