"""Demonstrations: trajectories of observations, with actions of which some may be missing."""

from __future__ import annotations

import operator
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, SupportsIndex, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agail import _core
from agail._arguments import MOST_SEED, whole
from agail._core import InputError
from agail.formats import d4rl, imitation, lerobot
from agail.formats.arrays import arrays_of, core_of

if TYPE_CHECKING:
    import minari
    from imitation.data.types import Trajectory


@dataclass(frozen=True, eq=False)  # arrays have no one answer to ==
class Episode:
    """One trajectory of T steps."""

    observations: NDArray[np.float64]  # (T + 1, observation_dim)
    actions: NDArray[np.float64]  # (T, action_dim); missing: NaN, discrete ones 0
    available: NDArray[np.bool_]  # (T, action_dim): whether the entry is known
    rewards: NDArray[np.float64] | None  # (T,)
    terminations: NDArray[np.bool_]  # (T,)
    truncations: NDArray[np.bool_]  # (T,)

    def __len__(self) -> int:
        return len(self.actions)


class Demonstrations(Sequence[Episode]):
    """A sequence of episodes. Does not change; mask() gives another one. Picklable."""

    def __init__(self, core: _core.Demonstrations):
        self._core = core

    @classmethod
    def load(cls, path_or_id: str | os.PathLike[str]) -> Demonstrations:
        """A .hdf5 file, a Minari dataset folder, or the id of a dataset that Minari has here."""
        return cls(_core.Demonstrations.load(os.fspath(path_or_id)))

    def save(self, path: str | os.PathLike[str]) -> None:
        """x.hdf5: one file; any other name: a Minari dataset folder."""
        _core.Demonstrations.save(self._core, os.fspath(path))

    @classmethod
    def from_arrays(
        cls,
        observations: ArrayLike,
        actions: ArrayLike | None = None,
        *,
        episodes: ArrayLike | None = None,
        environment: str = "",
        next_observations: ArrayLike | None = None,
        rewards: ArrayLike | None = None,
        terminations: ArrayLike | None = None,
        truncations: ArrayLike | None = None,
        action_available: ArrayLike | None = None,
    ) -> Demonstrations:
        """From arrays with one row a step, episode after episode.

        observations (N, D); actions (N, A), or (N,) for one dimension, discrete if they are integers,
        and then counted from 0 whatever the start of the environment's Discrete space is; a missing
        entry is NaN, or False in action_available (N,) or (N, A); None: all are missing.
        episodes (N,): a number that names each row's episode; without it episodes end where
        terminations or truncations (N,) say so. Without next_observations (N, D) the last row of an
        episode is its final state, and that row's action and reward are not used. environment: the
        Gymnasium id, which gives the action space.
        """
        arrays = {
            "observations": observations,
            "actions": actions,
            "episodes": episodes,
            "next_observations": next_observations,
            "rewards": rewards,
            "terminations": terminations,
            "truncations": truncations,
            "action_available": action_available,
        }
        return cls(core_of(arrays, environment))

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        """The reverse of from_arrays(): its arguments by name, with next_observations.

        actions are float32, NaN where missing; discrete ones int64, with action_available if any is
        missing. numpy.savez(path, **demos.to_arrays()) is a file that `agail convert` reads.
        """
        return arrays_of(self._core)

    @classmethod
    def from_minari(cls, dataset: str | minari.MinariDataset) -> Demonstrations:
        """A Minari dataset, or the id of one that is on this machine (nothing is downloaded)."""
        if isinstance(dataset, str):
            return cls.load(dataset)
        path = Path(dataset.spec.data_path)
        if not (path / "main_data.hdf5").exists():
            raise InputError(
                f"{dataset.spec.dataset_id} is not stored as HDF5 but as "
                f"{dataset.spec.data_format}; make it again with data_format='hdf5'"
            )
        chosen = sorted(int(index) for index in dataset.episode_indices)
        whole = cls.load(path)
        if len(chosen) != len(whole):
            raise InputError(
                f"this dataset is a part ({len(chosen)} of {len(whole)} episodes) of "
                f"{dataset.spec.dataset_id}, which is read as a whole; give the whole dataset"
            )
        return whole

    @classmethod
    def from_trajectories(
        cls, trajectories: Sequence[Trajectory], *, environment: str = ""
    ) -> Demonstrations:
        """From `imitation`'s trajectories: a sequence of objects with obs (T+1, ...) and acts (T, ...).

        terminal and infos (SB3's "TimeLimit.truncated") say how each ended, rews are kept; arrays of
        more dimensions are laid out in a row. acts (T,) of integers are discrete; NaN is missing.
        """
        return cls(core_of(imitation.read(trajectories), environment, "the trajectories"))

    def to_trajectories(self) -> list[Trajectory]:
        """For `imitation`, which must be installed: TrajectoryWithRew, or Trajectory without rewards.

        Missing actions are NaN there; discrete ones cannot be missing (InputError).
        """
        return imitation.write(self, self._core.discrete, self._core.float32)

    @classmethod
    def from_d4rl(cls, path: str | os.PathLike[str], *, environment: str = "") -> Demonstrations:
        """A D4RL .hdf5 file: observations, actions, rewards, terminals, timeouts, one row a step.

        Without next_observations the last row of an episode is its final state, and that row's action
        is not used. NaN actions are missing. Needs h5py.
        """
        return cls(core_of(d4rl.read(path), environment, os.fspath(path)))

    def to_d4rl(self, path: str | os.PathLike[str]) -> None:
        """The reverse; NaN, or 0 in infos/action_available (discrete), where an action is missing."""
        d4rl.write(self.to_arrays(), path)

    @classmethod
    def from_lerobot(cls, path: str | os.PathLike[str], *, environment: str = "") -> Demonstrations:
        """A LeRobot dataset's folder (v2 or v3), or one of its Parquet files. Needs pyarrow.

        Columns observation.state, action, episode_index; frame_index and next.reward if they are there.
        An action that is null or NaN, or has such entries, is missing. The last frame of an episode is
        its final state, and its action is not used.
        """
        return cls(core_of(lerobot.read(path), environment, os.fspath(path)))

    def to_lerobot(self, path: str | os.PathLike[str], *, fps: int = 30) -> None:
        """A LeRobot dataset (v3.0) in a new folder; fps: frames a second, for the timestamps.

        Missing actions are NaN (discrete: null). Final states are in next.observation.state.
        """
        lerobot.write(self.to_arrays(), path, self.environment or "demonstrations", fps)

    def mask(
        self,
        missing: float,
        pattern: str = "step",
        *,
        seed: int = 0,
        dimension: int | None = None,
    ) -> Demonstrations:
        """The same with the share `missing` of the actions removed, as `agail mask` does it.

        pattern: "step" single steps, "block" runs of 20 steps, "episode" whole episodes, "dimension"
        whole action channels (`dimension` first, if it is given). With one seed a larger share's
        mask contains a smaller one's.
        """
        seed = whole("seed", seed, 0, MOST_SEED)
        return Demonstrations(self._core.masked(missing, pattern, seed, dimension))

    @property
    def missing_ratio(self) -> float:
        """Missing action entries / all entries."""
        return self._core.missing_ratio

    @property
    def environment(self) -> str:
        """Gymnasium id, empty if unknown."""
        return self._core.environment

    @property
    def transitions(self) -> int:
        """Steps of all episodes."""
        return self._core.transitions

    @property
    def observation_dim(self) -> int:
        """Numbers of an observation."""
        return self._core.observation_dim

    @property
    def action_dim(self) -> int:
        """Numbers of an action; 1 if discrete."""
        return self._core.action_dim

    @property
    def mean_return(self) -> float | None:
        """Mean undiscounted return of the episodes; None if rewards are unknown."""
        return self._core.mean_return

    def __len__(self) -> int:
        return len(self._core)

    @overload
    def __getitem__(self, index: SupportsIndex) -> Episode: ...
    @overload
    def __getitem__(self, index: slice) -> list[Episode]: ...
    def __getitem__(self, index: SupportsIndex | slice) -> Episode | list[Episode]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        index = operator.index(index)
        position = index + len(self) if index < 0 else index
        if not 0 <= position < len(self):
            raise IndexError(f"episode {index} of {len(self)}")
        return Episode(**self._core.episode(position))

    def __iter__(self) -> Iterator[Episode]:
        return (self[i] for i in range(len(self)))

    def __repr__(self) -> str:
        name = f" of {self.environment}" if self.environment else ""
        return (
            f"<Demonstrations{name}: {len(self)} episodes, {self.transitions} transitions, "
            f"{100 * self.missing_ratio:.3g} % of the actions missing>"
        )

    def __getstate__(self) -> bytes:
        return self._core.encode()

    def __setstate__(self, state: bytes) -> None:
        self._core = _core.Demonstrations.decode(state)
