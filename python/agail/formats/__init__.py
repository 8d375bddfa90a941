"""Demonstrations in other projects' formats; each module has the two directions of one, for agail.Demonstrations.

They meet in the dict of arrays that Demonstrations.to_arrays() gives and from_arrays() takes.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from agail._core import InputError

Arrays = dict[str, Any]


def needed(module: str, why: str) -> Any:
    """The module, or InputError that says how to get it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise InputError(f"{why} needs {package} ({error}); pip install {package}") from error


def numbers(where: str, what: str, value: Any, dims: tuple[int, ...]) -> np.ndarray:
    """As an array of one of these numbers of dimensions; InputError if it is none."""
    try:
        array = np.asarray(value)
        if array.dtype == object:
            array = array.astype(np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{where}: {what} are no array of numbers: {error}") from error
    if array.dtype.kind not in "bfiu":
        raise InputError(f"{where}: {what} are {array.dtype}, not numbers")
    if array.ndim not in dims:
        raise InputError(
            f"{where}: {what} have the shape {array.shape}, not {' or '.join(map(str, dims))} dimensions"
        )
    return array


def rows(where: str, what: str, value: Any, count: int) -> np.ndarray:
    """A column of so many numbers."""
    array = numbers(where, what, value, (1, 2))
    if array.shape not in ((count,), (count, 1)):
        raise InputError(
            f"{where}: {what} have the shape {array.shape}, the observations {count} rows"
        )
    return array.reshape(count)
