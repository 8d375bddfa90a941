"""D4RL's HDF5 files: flat arrays observations, actions, rewards, terminals, timeouts, one row a step."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from agail._core import InputError
from agail.formats import Arrays, needed, numbers, rows

# What D4RL calls what Demonstrations.from_arrays() takes.
NAMES = {
    "rewards": "rewards",
    "terminations": "terminals",
    "truncations": "timeouts",
    "action_available": "infos/action_available",
}


def _array(path: Path, file: Any, name: str) -> Any:
    found = file[name]
    if not hasattr(found, "shape"):
        raise InputError(f"{path}: {name} is a group, not an array; this is no D4RL file")
    return found[()]


def read(path: str | os.PathLike[str]) -> Arrays:
    path = Path(path)
    h5py = needed("h5py", "reading D4RL files")
    if not path.is_file():
        raise InputError(f"{path} is no file; give a D4RL .hdf5 file")
    try:
        with h5py.File(path, "r") as file:
            if "episode_0" in file:
                raise InputError(f"{path} is in Minari's layout; Demonstrations.load() reads it")
            if "observations" not in file:
                raise InputError(
                    f"{path} has no observations but {', '.join(list(file)[:8]) or 'nothing'}; give a "
                    "file with D4RL's arrays"
                )
            wanted = ["observations", "actions", "next_observations", *NAMES.values()]
            found = {name: _array(path, file, name) for name in wanted if name in file}
    except OSError as error:
        raise InputError(f"{path} cannot be read as HDF5: {error}") from error

    observations = numbers(str(path), "observations", found["observations"], (2,))
    count = len(observations)
    if count == 0:
        raise InputError(f"{path} has no rows")
    arrays: Arrays = {"observations": observations}
    if "actions" in found:
        actions = numbers(str(path), "actions", found["actions"], (1, 2))
        if len(actions) != count:
            raise InputError(f"{path} has {len(actions)} actions and {count} observations")
        if np.issubdtype(actions.dtype, np.integer) and actions.shape[1:] == (1,):
            actions = actions[:, 0]  # discrete
        arrays["actions"] = actions
    if "next_observations" in found:
        arrays["next_observations"] = numbers(
            str(path), "next_observations", found["next_observations"], (2,)
        )
    for ours, theirs in NAMES.items():
        if theirs in found:
            arrays[ours] = rows(str(path), theirs, found[theirs], count)
    if "timeouts" not in found and "next_observations" not in found:
        raise InputError(
            f"{path} has neither timeouts nor next_observations, so nobody knows where an episode ended "
            "at a time limit; add timeouts (a bool a row, all False if none did)"
        )
    ends = arrays.get("terminations", np.zeros(count)).astype(bool)
    ends = ends | arrays.get("truncations", np.zeros(count)).astype(bool)
    arrays["episodes"] = np.concatenate([[0], np.cumsum(ends)[:-1]])
    return arrays


def write(arrays: Arrays, path: str | os.PathLike[str]) -> None:
    """next_observations are written too: without them a final state is lost. Whole or not at all."""
    path = Path(path)
    h5py = needed("h5py", "writing D4RL files")
    partial = path.with_name(f"{path.name}.partial")
    titles = {name: NAMES.get(name, name) for name in arrays if name != "episodes"}
    try:
        with h5py.File(partial, "w") as file:
            for name, title in titles.items():
                file[title] = arrays[name]
        partial.replace(path)
    except OSError as error:
        if partial.exists():
            partial.unlink()
        raise InputError(f"{path} cannot be written: {error}") from error
