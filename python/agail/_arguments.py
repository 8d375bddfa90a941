"""Checks of what users give as arguments."""

from __future__ import annotations

from typing import Any

import numpy as np

from agail._core import InputError

MOST_SEED = 2**64 - 1
MOST_EPISODES = 1_000_000  # of an evaluation, as the command line has it


def whole(name: str, value: Any, least: int, most: int = 2**63 - 1) -> int:
    """The number itself. InputError for anything that is not a whole number of this range."""
    number = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not number or not least <= value <= most:
        raise InputError(f"{name} = {value!r} should be a whole number from {least} to {most}")
    return int(value)
