#!/usr/bin/env python3
"""A study's study.json -> the tables of docs/benchmarks/error.md, as Markdown.
Usage: table.py DIR/study.json [SCENE...]"""
import json
import sys

COMPOSITINGS = ["analytic", "cd", "cd-naive", "simple", "cd-euler"]
TAUS = [1e-30, 0.1, 0.5, 1, 1.5, 2, 3, 10, 50, 1e30]


def at_own_knobs(scene):
    """The points of one scene with the settings of its view; of the slabs, those of thickness 1."""
    view = scene["view"]
    for point in scene["points"]:
        knobs = point["knobs"]
        stop = knobs["stopTransmittance"] == view["method"]["stopTransmittance"]
        whole = knobs["width"] == view["image"]["width"]
        if stop and whole and knobs["stride"] == 1 and knobs.get("slabThickness", 1) == 1:
            if knobs.get("span", 7) == view["vector"]["span"]:
                yield point


def number(form, value, stable):
    return form % value if stable and value is not None else "fails"


def methods(scene):
    for point in at_own_knobs(scene):
        s = point["stable"]
        print("| %s | %s %s | %s | %s | %s | %.3g | %s |" % (
            scene["name"], point["method"], point["compositing"],
            number("%.1e", point["rmse"], s), number("%.1f", point["psnr"], s),
            number("%.4f", point["flip"], s), point["ms"], "yes" if point["pareto"] else ""))


def words(row):
    if row["diverges"]:
        return "diverges"
    if not row["bounded"]:
        return "leaves [0, 1]"
    return "%.0e" % row["error"] if row["error"] > 1e-6 else "exact"


def stiffness(rows):
    print("| tau | " + " | ".join(COMPOSITINGS) + " |")
    print("|---" * (1 + len(COMPOSITINGS)) + "|")
    for tau in TAUS:
        found = {r["compositing"]: r for r in rows if r["tau"] == tau}
        cells = [words(found[name]) for name in COMPOSITINGS]
        print("| %s | " % ("%g" % tau).replace("e+", "e") + " | ".join(cells) + " |")


def calibrations(scenes):
    print("| sample | reported error | compared | within a factor of 2 | median, reported / true | "
          "within the bound |")
    print("|---|---|---|---|---|---|")
    for scene in scenes:
        for row in scene["calibration"]["agreement"]:
            bound = "%.1f %%" % (100 * row["bounded"])
            if row["of"] in ("measured", "jpeg"):
                bound = ""
            print("| %s | %s | %d | %.1f %% | %.2f | %s |" % (
                scene["name"], row["of"], row["count"], 100 * row["withinTwo"], row["median"],
                bound))


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        study = json.load(file)
    print("| scene | method | RMSE | PSNR, dB | FLIP | ms | Pareto front |")
    print("|---|---|---|---|---|---|---|")
    for scene in study["scenes"]:
        if scene["name"] in sys.argv[2:] or len(sys.argv) == 2:
            methods(scene)
    print()
    stiffness(study["stability"])
    calibrated = [scene for scene in study["scenes"] if "calibration" in scene]
    if calibrated:
        print()
        calibrations(calibrated)


main()
