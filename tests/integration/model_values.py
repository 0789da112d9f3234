"""Helpers of the writers of model files."""

import numpy as np

RANDOM = np.random.default_rng(20)


def noise(*shape, low=-10.0, high=10.0):
    return RANDOM.uniform(low, high, shape).astype(np.float32)


def between(values, axis):
    """The mean of neighbours along an axis."""
    values = np.asarray(values, float)
    a = np.take(values, range(values.shape[axis] - 1), axis)
    return (a + np.take(values, range(1, values.shape[axis]), axis)) / 2


def put(file, name, dims, values, fill=None, **attributes):
    variable = file.createVariable(name, values.dtype, dims, fill_value=fill)
    variable.setncatts(attributes)
    variable[:] = values
    return values


def axis(file, name, values, **attributes):
    file.createDimension(name, len(values))
    return put(file, name, (name,), np.asarray(values, float), **attributes)


def as_masked(scalars):
    return {name: np.ma.masked_invalid(np.asarray(values, float))
            for name, values in scalars.items()}
