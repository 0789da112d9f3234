// The small cross of axes that tells how the volume is turned: east, north and up (or x, y, z).
import { cameraFrame, dot, type Camera, type Vec3 } from "./camera";
import { makeSvg } from "./dom";

const labelGap = 15; // below it two labels would cover each other
const radius = 30; // of the longest arm, in the drawing's units
const axes: { name: string; way: Vec3 }[] = [
  { name: "x", way: [1, 0, 0] },
  { name: "y", way: [0, 1, 0] },
  { name: "z", way: [0, 0, 1] },
];

export interface GizmoArm {
  axis: string;
  x: number; // right and up on the screen, -1..1
  y: number;
  depth: number; // > 0: points away from the eye
}

export function gizmoArms(camera: Camera): GizmoArm[] {
  const frame = cameraFrame(camera);
  return axes
    .map(({ name, way }) => ({
      axis: name,
      x: dot(way, frame.right),
      y: dot(way, frame.up),
      depth: dot(way, frame.forward),
    }))
    .sort((a, b) => b.depth - a.depth);
}

// How far a label steps aside, so that arms over each other can still be told apart: the farther
// one to the right, the nearer to the left.
function aside(arm: GizmoArm, arms: GizmoArm[]): number {
  const other = arms.find(
    (one) => one !== arm && radius * Math.hypot(one.x - arm.x, one.y - arm.y) < labelGap,
  );
  if (other === undefined) return 0;
  return arms.indexOf(arm) < arms.indexOf(other) ? 8 : -8;
}

export class Gizmo {
  constructor(
    private readonly element: SVGElement,
    private labels: Record<string, string> = { x: "E", y: "N", z: "Up" },
  ) {}

  setGeographic(geographic: boolean): void {
    this.labels = geographic ? { x: "E", y: "N", z: "Up" } : { x: "x", y: "y", z: "z" };
  }

  show(camera: Camera): void {
    const parts: SVGElement[] = [];
    const arms = gizmoArms(camera);
    for (const arm of arms) {
      const x = arm.x * radius;
      const y = -arm.y * radius;
      const group = makeSvg("g", {
        class: `arm arm-${arm.axis}${arm.depth > 0.02 ? " away" : ""}`,
      });
      group.append(makeSvg("line", { x1: 0, y1: 0, x2: x, y2: y }));
      const label = makeSvg("text", { x: x * 1.28 + aside(arm, arms), y: y * 1.28 });
      label.textContent = this.labels[arm.axis]!;
      group.append(label);
      parts.push(group);
    }
    this.element.replaceChildren(...parts);
  }
}
