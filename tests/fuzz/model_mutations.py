"""The mutants by number: a dataset of each format in turn, with one to three mutations applied
in a valid order."""

import numpy as np

import model as models
import model_grib
import mutations_layout as layout
import mutations_values as values

# Types and sizes first, mutations that depend on values after those of values, chunk tables last.
STAGES = (
    (values.integers, values.unsigned, layout.lone_sample, layout.many_samples,
     layout.pressure_levels),
    (values.special_values, values.huge_doubles, values.flipped_signs, values.uniform,
     values.all_masked, values.one_unmasked, values.swapped_bytes, values.random_bits,
     values.unnamed, values.attribute_of_wrong_type, layout.descending_axis, layout.uneven_axis,
     layout.scaled_axis, layout.warped, layout.malformed_axis, layout.renamed_axis,
     layout.other_times, layout.odd_times, layout.grib_scaling, layout.grib_scan,
     layout.grib_points),
    (values.filled, values.missing_values, values.valid_limits, layout.grib_bitmap,
     layout.grib_9999),
    (values.packed, layout.stored_otherwise, layout.transposed),
    (layout.chunks_swapped, layout.chunks_missing, layout.grib_messages))
STAGE_OF = {way: number for number, stage in enumerate(STAGES) for way in stage}
OF_GRIB = (layout.grib_bitmap, layout.grib_scaling, layout.grib_9999, layout.grib_scan,
           layout.grib_points, layout.grib_messages, layout.descending_axis, layout.lone_sample,
           values.uniform)
OF_OTHERS = tuple(way for way in STAGE_OF if not way.__name__.startswith("grib_"))
STEPS = {"raw+json": (1, 4), "grads": (1, 4)}
RULES = {"raw+json": "listed", "grads": "near undef"}


def model_of(kind, dice):
    if kind in values.CF:
        out = models.cf_model(kind, dice)
        if kind == "zarr":
            out.options |= layout.zarr_version(dice)
        return out
    if kind in values.GRIB:
        return model_grib.grib_model(kind, dice)
    steps = int(dice.integers(*STEPS.get(kind, (1, 2))))
    out = models.grouped_model(kind, dice, RULES.get(kind, "plain"), steps)
    if kind == "vtu":
        out.exact = out.placed = False
        out.resampled = True
    if kind == "grads":
        for field, name in zip(out.fields, "uvwt"):
            field.name = name
            field.attributes["missing"] = float(dice.choice([-999.0, 1e20, 9.999e20, -2.56e33]))
        undef = out.fields[0].attributes["missing"]
        for field in out.fields:
            field.attributes["missing"] = undef
        out.vectors = {}
    return out


def mutate(model, dice):
    """Applies one to three mutations."""
    ways = OF_GRIB if model.kind in values.GRIB else OF_OTHERS
    while not model.applied:
        chosen = {ways[int(i)] for i in dice.choice(len(ways), int(dice.integers(1, 4)))}
        for way in sorted(chosen, key=lambda way: (STAGE_OF[way], way.__name__)):
            if way(model, dice):
                model.applied.append(way.__name__)


def mutant(seed, number, kind=None):
    """The mutated Model that seed and number determine; its format is `kind` or, if that is None,
    follows from the number."""
    dice = np.random.default_rng([seed, number])
    model = model_of(kind or values.ALL[number % len(values.ALL)], dice)
    mutate(model, dice)
    return model
