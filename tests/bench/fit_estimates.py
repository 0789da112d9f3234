#!/usr/bin/env python3
"""Fits the laws of errors to `bench_estimates --list` and judges them (docs/benchmarks/error.md).

usage: fit_estimates.py LIST [--write server/quality/coefficients.hpp]

Prints how estimates agree with measured errors: those of the program that wrote the list, and those
of laws fitted without the dataset that is judged. Needs numpy.
"""

import sys

import numpy

FAMILY = 26  # members; the others are never fitted to
FLOOR = 5e-6
FITTED_ABOVE = 2e-5  # smaller errors are partly those of single precision
JUDGED_ABOVE = 1e-4
RIDGE = 30.0  # in units of one measurement of standardised features
SAFETY = 0.05  # added to logarithms: estimates rather exceed errors
CAUSES = ["kernel", "smaller", "merged", "slab"]
CONTENTS = ["lines", "medium", "both"]
SLAB_OWN = 18  # setting: slabs of the view's thickness
THINNER = [24, 25]  # settings with thinner slabs
# The scatter between viewpoints differs from scene to scene. This is the least factor (in steps of
# 0.1) with which the 95 % bound holds for 95 % of the errors in 95 % of the scenes of the family,
# after a calibration run at another viewpoint.
WIDER = 1.8
FEWEST = 30  # measurements of a group; with fewer the errors of tried pixels are taken as they are
TRIED_CAUSES = [0, 3]  # kernels and slabs
HALF_LEVEL, COARSER, SLAB = 0, 1, 2  # features
HALF_LEVEL_MOST = 8  # those of large pictures are extrapolated
LEAST_EXCESS = 0.3  # of the square of an error, with less it is that of the method

# Columns of the list.
MEMBER, SCENE, VIEW, SETTING, ERROR, PRIOR, AFTER_FINAL, CALIBRATED = range(8)
BOUND, CALIBRATED_BOUND, TYPICAL, TYPICAL_BOUND, MOVED, MOVED_BOUND = range(8, 14)
CAUSE, CONTENT, TRIED, FEATURES = range(14, 18)


def terms(features):
    """terms_of of server/quality/laws.cpp."""
    cell, lines, layers, length, width, depth, cell_depth = (
        features[:, [5, 7, 8, 9, 10, 13, 14]].T)
    return numpy.column_stack([features, cell * cell, layers * layers, lines * cell,
                               depth * depth, length * length, width * width,
                               cell_depth * cell_depth])


class Fit:
    """log(error) = base + slope . terms."""

    def __init__(self, features, logs):
        self.bounds = features.min(axis=0), features.max(axis=0)
        self.bounds[1][HALF_LEVEL] = HALF_LEVEL_MOST
        all_terms = terms(features)
        mean = all_terms.mean(axis=0)
        spread = all_terms.std(axis=0)
        used = spread > 1e-6
        self.slope = numpy.zeros(all_terms.shape[1])
        scaled = (all_terms[:, used] - mean[used]) / spread[used]
        normal = scaled.T @ scaled + RIDGE * numpy.eye(scaled.shape[1])
        solved = numpy.linalg.solve(normal, scaled.T @ (logs - logs.mean()))
        self.slope[used] = solved / spread[used]
        self.base = logs.mean() - self.slope @ mean + SAFETY

    def __call__(self, features):
        return self.base + terms(numpy.clip(features, *self.bounds)) @ self.slope


def groups(table):
    for cause in range(len(CAUSES)):
        for content in range(len(CONTENTS)):
            rows = (table[:, CAUSE] == cause) & (table[:, CONTENT] == content)
            yield cause, content, rows


class Factor:
    """log(error) = base + log(error of tried pixels)."""

    def __init__(self, table):
        judged = table[table[:, ERROR] > JUDGED_ABOVE]
        self.base = 0.0
        if len(judged) >= FEWEST:
            self.base = SAFETY + numpy.median(numpy.log(judged[:, ERROR] / tried(judged)))


def tried(table):
    return numpy.maximum(table[:, TRIED], FLOOR)


def estimates_of(cause, table, features, fitted_to, judged):
    """Estimates of some rows by the law of a cause that is fitted to others."""
    if cause in TRIED_CAUSES:
        return numpy.exp(Factor(table[fitted_to]).base) * tried(table[judged])
    return numpy.exp(fitted(table, features, fitted_to)(features[judged]))


def fitted(table, features, rows):
    rows = rows & (table[:, ERROR] > FITTED_ABOVE)
    return Fit(features[rows], numpy.log(table[rows, ERROR]))


def methods(table, features):
    """The row of the same view and method with every pixel and sample, for each row."""
    at_full = (features[:, HALF_LEVEL] == 0) & (features[:, COARSER] == 0)
    at_full &= ~numpy.isin(table[:, SETTING], THINNER)
    row_of = {(*table[i, :3], features[i, SLAB]): i for i in numpy.flatnonzero(at_full)}
    return numpy.array([row_of[(*table[i, :3], features[i, SLAB])] for i in range(len(table))])


def to_fit(table, features):
    """With the errors that laws are fitted to: of a medium without those of the method."""
    out = table.copy()
    method = methods(table, features)
    worse = (table[:, CONTENT] == 1) & (features[:, HALF_LEVEL] + features[:, COARSER] > 0)
    excess = table[:, ERROR] ** 2 - table[method, ERROR] ** 2
    told = excess > LEAST_EXCESS * table[:, ERROR] ** 2
    out[worse, ERROR] = numpy.where(told, numpy.sqrt(numpy.maximum(excess, 0)), 0)[worse]
    return out


def left_out(table, features):
    """Estimates of each member by laws fitted to the others."""
    known = to_fit(table, features)
    laws = numpy.full(len(table), FLOOR)
    for cause, _, rows in groups(table):
        for member in numpy.unique(table[rows, MEMBER]):
            own = rows & (table[:, MEMBER] == member)
            others = rows & (table[:, MEMBER] < FAMILY) & (table[:, MEMBER] != member)
            laws[own] = estimates_of(cause, known, features, others, own)
    # expected_error of server/quality/laws.cpp
    every = {(*table[i, :3], *features[i, [SLAB, HALF_LEVEL]]): i
             for i in numpy.flatnonzero(features[:, COARSER] == 0)
             if table[i, SETTING] not in THINNER}
    for i in numpy.flatnonzero((features[:, COARSER] > 0) & (features[:, HALF_LEVEL] > 0)):
        as_small = every.get((*table[i, :3], *features[i, [SLAB, HALF_LEVEL]]), i)
        laws[i] = max(laws[i], laws[as_small])
    power = numpy.where(table[:, CONTENT] == 1, 2, 4)
    together = (laws ** power + laws[methods(table, features)] ** power) ** (1 / power)
    worse = features[:, HALF_LEVEL] + features[:, COARSER] > 0
    return numpy.clip(numpy.where(worse, together, laws), FLOOR, 1)


def agreement(estimates, errors):
    judged = errors > JUDGED_ABOVE
    ratio = estimates[judged] / errors[judged]
    if len(ratio) == 0:
        return "0 | | | | | "
    low, middle, high = numpy.quantile(ratio, [0.05, 0.5, 0.95])
    return (f"{len(ratio)} | {100 * numpy.mean((ratio >= 0.5) & (ratio <= 2)):.1f} % | "
            f"{1000 * numpy.mean(ratio < 0.25):.1f} | {ratio.min():.3f} | "
            f"{low:.2f}, {middle:.2f}, {high:.2f}")


HEADER = ("| | | measured > 1e-4 | within a factor of 2 | below a quarter, of 1000 | least ratio | "
          "5, 50, 95 % |\n|---|---|---|---|---|---|---|")


def show(title, table, estimates, chosen):
    print(f"\n{title}\n\n{HEADER}")
    for cause, content, rows in groups(table):
        rows = rows & chosen
        if rows.any():
            print(f"| {CAUSES[cause]} | {CONTENTS[content]} | "
                  f"{agreement(estimates[rows], table[rows, ERROR])} |")
    print(f"| all | | {agreement(estimates[chosen], table[chosen, ERROR])} |")


def show_bounds(table, chosen):
    def kept_by(bound):
        return table[:, ERROR] <= 1.0005 * table[:, bound]  # the list has four digits

    within = kept_by(BOUND)
    later = kept_by(CALIBRATED_BOUND)
    taught = chosen & (table[:, VIEW] > 0)
    scenes = numpy.unique(table[taught][:, [MEMBER, SCENE]], axis=0)
    kept = [later[taught & (table[:, [MEMBER, SCENE]] == scene).all(axis=1)].mean() >= 0.95
            for scene in scenes]
    print("errors within the 95 % bound: "
          f"{100 * within[chosen].mean():.1f} % without measurements, "
          f"{100 * later[taught].mean():.1f} % after a calibration run at another viewpoint; "
          f"at least 95 % in {100 * numpy.mean(kept):.1f} % of {len(scenes)} scenes; "
          f"of unknown content {100 * kept_by(TYPICAL_BOUND)[chosen].mean():.1f} % without "
          f"measurements, {100 * kept_by(MOVED_BOUND)[taught].mean():.1f} % after a final frame")


def scatter(table, residual, rows):
    """Standard deviations between signatures, viewpoints of one, and what typical instead of
    known content adds."""
    rows = rows & (table[:, MEMBER] < FAMILY) & (table[:, ERROR] > FITTED_ABOVE)
    if not rows.any():
        return 0.5, 0.3, 1
    centred = residual[rows] - residual[rows].mean()
    views = {}
    for (member, scene, view), value in zip(table[rows, :3], centred):
        views.setdefault((member, scene), {}).setdefault(view, []).append(value)
    shared = []  # products of views of one signature
    for one in views.values():
        means = [numpy.mean(values) for values in one.values()]
        shared += [a * b for n, a in enumerate(means) for b in means[:n]]
    between = max(0.01, numpy.mean(shared)) if shared else 0.01
    within = max(0.01, centred.var() - between)
    known, typical = (numpy.mean(numpy.log(table[rows, ERROR] / table[rows, estimate]) ** 2)
                      for estimate in (PRIOR, TYPICAL))
    return numpy.sqrt([between, WIDER ** 2 * within, max(0, typical - known)])


def correlations(table, residual):
    """Correlation of the residuals of settings at one view, by their causes."""
    products = {}
    rows = (table[:, MEMBER] < FAMILY) & (table[:, ERROR] > FITTED_ABOVE)
    of_group = {(c, k): residual[rows & g] for c, k, g in groups(table) if (rows & g).any()}
    views = {}
    for i in numpy.flatnonzero(rows):
        group = of_group[int(table[i, CAUSE]), int(table[i, CONTENT])]
        value = (residual[i] - group.mean()) / group.std()
        views.setdefault(tuple(table[i, :3]), []).append((int(table[i, CAUSE]), value))
    for found in views.values():
        for n, (cause, value) in enumerate(found):
            for other_cause, other in found[:n]:
                pair = min(cause, other_cause), max(cause, other_cause)
                products.setdefault(pair, []).append(value * other)
    print("\ncorrelation of settings: " + ", ".join(
        f"{CAUSES[a]} and {CAUSES[b]} {numpy.mean(found):.2f}"
        for (a, b), found in sorted(products.items())))


def numbers(values):
    return ", ".join(f"{value:.4g}" for value in values)


def typical_trials(table, content):
    """Medians over the views of the family."""
    rows = (table[:, MEMBER] < FAMILY) & (table[:, CONTENT] == content)
    medians = [numpy.median(tried(table[rows & (table[:, SETTING] == setting)]))
               for setting in (0, SLAB_OWN, THINNER[0])]
    return f"{{{numbers(medians)}}}"


def write(path, table, features, residual):
    family = table[:, MEMBER] < FAMILY
    known = to_fit(table, features)
    typical = ", ".join(typical_trials(table, content) for content in range(len(CONTENTS)))
    lines = ["// Made by tests/bench/fit_estimates.py (docs/benchmarks/error.md); do not edit.",
             "#pragma once", "", "#include <array>", "", '#include "server/quality/laws.hpp"', "",
             "namespace windsplat::quality {", "",
             "// Medians over the family: lines, a medium, both.",
             f"inline constexpr std::array<Trials, 3> typical_trials{{{{{typical}}}}};", "",
             "// By cause, then lines, a medium, both.",
             "inline constexpr std::array<Law, 12> laws{{"]
    for cause, content, rows in groups(table):
        if cause in TRIED_CAUSES:
            base, slope, least, most = Factor(table[rows & family]).base, [0], [0], [0]
        else:
            fit = fitted(known, features, rows & family)
            base, slope, (least, most) = fit.base, fit.slope, fit.bounds
        signature, viewpoint, guessed = scatter(table, residual, rows)
        lines += [f"    // {CAUSES[cause]}, {CONTENTS[content]}",
                  f"    {{{base:.4g}, {{{numbers(slope)}}}, {{{numbers(least)}}}, "
                  f"{{{numbers(most)}}}, {{{signature:.2f}, {viewpoint:.2f}, "
                  f"0.06, {guessed:.2f}}}}},"]
    lines += ["}};", "", "}  // namespace windsplat::quality", ""]
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(lines))


def main():
    table = numpy.loadtxt(sys.argv[1], delimiter=",", ndmin=2)
    table[:, ERROR] = numpy.maximum(table[:, ERROR], FLOOR)
    features = table[:, FEATURES:]
    family = table[:, MEMBER] < FAMILY
    other_views = table[:, VIEW] > 0
    by_others = left_out(table, features)
    show("Laws fitted without the dataset", table, by_others, family)
    show("Laws of the program", table, table[:, PRIOR], family)
    show("Laws of the program, kinds of data outside the family", table, table[:, PRIOR], ~family)
    show("After a measured final frame from another viewpoint", table, table[:, AFTER_FINAL],
         family & other_views)
    show("After a calibration run at another viewpoint", table, table[:, CALIBRATED],
         family & other_views)
    show("After a calibration run, kinds of data outside the family", table, table[:, CALIBRATED],
         ~family & other_views)
    for kind, rows in ("the family", family), ("other kinds of data", ~family):
        show(f"Unknown content, {kind}", table, table[:, TYPICAL], rows)
        show(f"Unknown content, after a final frame from another viewpoint, {kind}", table,
             table[:, MOVED], rows & other_views)
    print("\nFamily and other kinds of data:")
    show_bounds(table, family)
    show_bounds(table, ~family)
    residual = numpy.log(table[:, ERROR] / by_others)
    correlations(table, residual)
    if len(sys.argv) == 4 and sys.argv[2] == "--write":
        write(sys.argv[3], table, features, residual)


if __name__ == "__main__":
    main()
