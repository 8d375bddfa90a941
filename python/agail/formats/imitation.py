"""The `imitation` package's Trajectory and TrajectoryWithRew (obs, acts, infos, terminal, rews)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from agail._core import InputError
from agail.formats import Arrays, needed, numbers

if TYPE_CHECKING:
    from imitation.data.types import Trajectory

    from agail.demonstrations import Episode


def _flat(values: np.ndarray) -> np.ndarray:
    return values.reshape(len(values), -1)


def _one(where: str, trajectory: Any) -> Arrays:
    """A trajectory as arrays with one row a step. Only its attributes count, not its class."""
    missing = [name for name in ("obs", "acts") if not hasattr(trajectory, name)]
    if missing:
        kind = type(trajectory).__name__
        raise InputError(f"{where} is a {kind} without {missing[0]}; give imitation's Trajectory")
    obs = numbers(where, "obs", trajectory.obs, (1, 2, 3, 4))
    acts = numbers(where, "acts", trajectory.acts, (1, 2, 3, 4))
    steps = len(acts)
    if steps == 0 or len(obs) != steps + 1:
        raise InputError(
            f"{where} has {len(obs)} observations and {steps} actions; there must be actions, and one "
            "observation more than these"
        )
    # imitation says "terminal" of a whole episode, however it ended; SB3's infos know more.
    infos = getattr(trajectory, "infos", None)
    if infos is not None and len(infos) != steps:
        raise InputError(f"{where} has {len(infos)} infos and {steps} actions")
    cut = infos is not None and bool(infos[-1].get("TimeLimit.truncated", False))
    terminated = bool(getattr(trajectory, "terminal", False)) and not cut
    last = np.arange(steps) == steps - 1
    flat = _flat(obs)
    result = {
        "observations": flat[:-1],
        "next_observations": flat[1:],
        "actions": acts if acts.ndim == 1 else _flat(acts),
        "terminations": last & terminated,
        "truncations": last & (not terminated),
    }
    if getattr(trajectory, "rews", None) is not None:
        rews = numbers(where, "rews", trajectory.rews, (1,))
        if len(rews) != steps:
            raise InputError(f"{where} has {len(rews)} rews and {steps} actions")
        result["rewards"] = rews
    return result


def read(trajectories: Sequence[Trajectory]) -> Arrays:
    if hasattr(trajectories, "obs") or not isinstance(trajectories, Sequence):
        kind = type(trajectories).__name__
        raise InputError(f"{kind} is no sequence of trajectories; give a list of imitation's")
    parts = [_one(f"trajectory {i}", trajectory) for i, trajectory in enumerate(trajectories)]
    if not parts:
        raise InputError("there are no trajectories in the sequence; record at least one")
    for i, part in enumerate(parts):
        for name in ("observations", "actions"):
            here, first = part[name], parts[0][name]
            if here.shape[1:] != first.shape[1:] or here.dtype.kind != first.dtype.kind:
                raise InputError(
                    f"trajectory {i} has {name} of {here.dtype} {here.shape[1:]}, the first one of "
                    f"{first.dtype} {first.shape[1:]}"
                )
        if set(part) != set(parts[0]):
            raise InputError(f"trajectory {i} has rewards and others have none, or the reverse")
    arrays = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    lengths = [len(part["actions"]) for part in parts]
    return {**arrays, "episodes": np.repeat(np.arange(len(parts)), lengths)}


def _actions(episode: Episode, discrete: bool) -> np.ndarray:
    if not episode.actions.shape[1]:
        raise InputError("these demonstrations have no actions; imitation's trajectories do")
    if not discrete:
        return episode.actions.astype(np.float32)
    if not episode.available.all():
        raise InputError(
            "imitation's trajectories cannot say that a discrete action is missing; give complete "
            "demonstrations (continuous actions are NaN where missing)"
        )
    return episode.actions[:, 0].astype(np.int64)


def write(episodes: Sequence[Episode], discrete: bool, float32: bool) -> list[Trajectory]:
    types = needed("imitation.data.types", "to_trajectories()")
    result = []
    for episode in episodes:
        infos: Any = np.array([{} for _ in range(len(episode))])
        infos[-1]["TimeLimit.truncated"] = bool(episode.truncations[-1])
        common = {
            "obs": episode.observations.astype(np.float32 if float32 else np.float64),
            "acts": _actions(episode, discrete),
            "infos": infos,
            "terminal": True,
        }
        if episode.rewards is None:
            result.append(types.Trajectory(**common))
        else:
            result.append(types.TrajectoryWithRew(**common, rews=episode.rewards))
    return result
