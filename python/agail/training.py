"""Training, evaluation and recording, on the same core as the command line."""

from __future__ import annotations

import csv
import json
import os
import signal
import tempfile
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agail import _core, _recording
from agail._arguments import MOST_EPISODES, MOST_SEED, whole
from agail._core import InputError, Policy
from agail._recording import Predictor
from agail._source import EnvironmentLike, Registered, Source, source_of
from agail.demonstrations import Demonstrations
from agail.statistics import share_of

Callback = Callable[[dict[str, float]], bool | None]


class Run:
    """A run's folder: of a finished run, one that was stopped, or one under way."""

    def __init__(self, folder: str | os.PathLike[str]):
        """InputError if there is no run in the folder."""
        self.folder = Path(folder)
        self._keep: tempfile.TemporaryDirectory[str] | None = None
        if not (self.folder / "config.toml").exists():
            raise InputError(f"{self.folder}: no run in this folder; give what train() got as out")

    @property
    def policy(self) -> Policy:
        """The best-evaluated policy for trpo, the last one for every other method."""
        return Policy.load(self.folder)

    @property
    def metrics(self) -> dict[str, NDArray[np.float64]]:
        """The columns of progress.csv, one entry an update; NaN where there is no value."""
        with (self.folder / "progress.csv").open(newline="") as file:
            names, *rows = csv.reader(file)
        # A run under way may be writing its last row.
        values = [[float(cell or "nan") for cell in row] for row in rows if len(row) == len(names)]
        table = np.array(values, np.float64).reshape(-1, len(names))
        return {name: table[:, i].copy() for i, name in enumerate(names)}

    @property
    def summary(self) -> dict[str, Any]:
        """summary.json: evaluations, demonstrations, versions, wall time. Empty until the run ends."""
        path = self.folder / "summary.json"
        return json.loads(path.read_text()) if path.exists() else {}

    @property
    def settings(self) -> dict[str, Any]:
        """Every setting of the run, by section."""
        return tomllib.loads((self.folder / "config.toml").read_text())

    @property
    def finished(self) -> bool:
        """Whether it came to its end (and was not stopped, and is not under way)."""
        return bool(self.summary.get("finished", False))

    def __repr__(self) -> str:
        what = " ".join(str(self.summary[key]) for key in ("method", "environment") if self.summary)
        state = "finished" if self.finished else "not finished"
        return f"<Run {what + ', ' if what else ''}{state}, in {self.folder}>"


@dataclass(frozen=True, eq=False)  # arrays have no one answer to ==
class Evaluation:
    """Episodes of a policy."""

    returns: NDArray[np.float64]  # undiscounted, one an episode
    lengths: NDArray[np.int64]  # steps
    diverged: int  # episodes that ended because the simulation broke down
    mean_return: float
    standard_error: float
    confidence_interval_95: tuple[float, float]  # of the mean (bootstrap)
    share_of_demonstrations: float | None  # mean return / the demonstrations', if that is above 0


def _assignments(settings: Mapping[str, Any]) -> list[str]:
    """key=value as --set takes them, from {"trpo.max_kl": 0.02} and from {"trpo": {"max_kl": 0.02}}."""

    def text(value: Any) -> str:
        if isinstance(value, np.ndarray | np.generic):
            value = value.tolist()
        try:
            return json.dumps(list(value) if isinstance(value, tuple) else value)
        except TypeError as error:
            raise InputError(f"a setting cannot be {value!r}: {error}") from error

    result = []
    for key, value in settings.items():
        if isinstance(value, Mapping):
            result += [f"{key}.{name}={text(inner)}" for name, inner in value.items()]
        else:
            result.append(f"{key}={text(value)}")
    return result


def _threads(threads: int | None, source: Source | Registered, name: str) -> int:
    """All cores for what is built in; Python runs one environment at a time anyway."""
    if threads is not None:
        return whole("threads", threads, 1, 4096)
    return _core.default_threads() if source.spec(name) is None else 1


def _fitting_batch(name: str, preset: str, assignments: list[str], lanes: int) -> list[str]:
    """A batch that so many lanes can share, where the user has not said how large it is to be."""
    if preset.endswith(".toml") or any(each.startswith("run.batch_steps=") for each in assignments):
        return []
    share = max(1, round(_core.batch_steps(name, preset, assignments) / lanes))
    return [f"run.batch_steps={lanes * share}"]


def _raise_again(caught: int) -> None:
    """A signal that the core noted: to whoever handles it. Python's own handler of SIGINT raises."""
    if caught:
        signal.raise_signal(caught)
        raise KeyboardInterrupt


def train(
    environment: EnvironmentLike,
    demonstrations: Demonstrations | str | os.PathLike[str] | None = None,
    *,
    method: str = "agail",
    out: str | os.PathLike[str] | None = None,
    timesteps: int | None = None,
    seed: int = 0,
    preset: str | os.PathLike[str] = "default",
    threads: int | None = None,
    lanes: int | None = None,
    resume: bool = False,
    callback: Callback | None = None,
    progress: bool = True,
    **settings: Any,
) -> Run:
    """Trains a policy, as `agail train` does.

    environment: an id (built in, or registered with Gymnasium), a gymnasium.Env, a SyncVectorEnv or
    AsyncVectorEnv, or a function that makes an environment.
    demonstrations: a Demonstrations, or what Demonstrations.load() takes; method "trpo" does not use
    them.
    method: "agail", "gail", "state-gail", "bc", "bco" or "trpo".
    out: the run's folder; without it a temporary one, which goes when the Run does.
    timesteps, lanes: short for the settings run.timesteps and run.lanes. Where the lanes come from a
    vector environment, run.batch_steps is the nearest multiple of them, unless it is given.
    preset: "default", "paper" or a .toml file; settings: any setting of docs/settings.md, as
    trpo={"max_kl": 0.02} or **{"trpo.max_kl": 0.02}.
    resume: go on with the run in `out`.
    callback: called after each update with a row of progress.csv as a dict; what is false, but not
    None, stops the run.
    An exception of the callback stops it, too, and is raised when the run has been saved.

    Ctrl-C saves a checkpoint and raises KeyboardInterrupt; resume=True goes on. InputError (a
    ValueError) for anything that is wrong with the arguments or the environment.
    """
    temporary, preset = None, os.fspath(preset)
    if out is None:
        if resume:
            raise InputError("resume=True goes on with a run; give its folder as out")
        temporary = tempfile.TemporaryDirectory(prefix="agail-")
        out = temporary.name
    if resume and preset == "default" and not settings and (Path(out) / "config.toml").exists():
        preset = os.fspath(Path(out) / "config.toml")
    if demonstrations is not None and not isinstance(demonstrations, Demonstrations):
        demonstrations = Demonstrations.load(demonstrations)
    name, source = source_of(environment)
    assignments = _assignments(settings)
    try:
        if lanes is None and isinstance(source, Source) and source.lanes > 1:
            lanes = source.lanes
            assignments += _fitting_batch(name, preset, assignments, lanes)
        caught, _ = _core.train(
            name,
            method,
            None if demonstrations is None else demonstrations._core,
            os.fspath(out),
            preset,
            assignments,
            0 if timesteps is None else whole("timesteps", timesteps, 1),
            0 if lanes is None else whole("lanes", lanes, 1),
            whole("seed", seed, 0, MOST_SEED),
            _threads(threads, source, name),
            resume,
            progress,
            callback,
            source,
        )
    finally:
        source.close()
    _raise_again(caught)
    run = Run(out)
    run._keep = temporary
    return run


def _policy(policy: Policy | Run | str | os.PathLike[str]) -> Policy:
    if isinstance(policy, Policy):
        return policy
    return policy.policy if isinstance(policy, Run) else Policy.load(policy)


def _play(
    work: Callable[..., Any],
    policy: Policy,
    episodes: int,
    environment: EnvironmentLike | None,
    seed: int,
    deterministic: bool,
    threads: int | None,
) -> Any:
    """_core.evaluate or _core.record, in environments that are closed afterwards."""
    name, source = _environment_for(policy, environment)
    try:
        caught, result = work(
            policy,
            whole("episodes", episodes, 1, MOST_EPISODES),
            whole("seed", seed, 0, MOST_SEED),
            not deterministic,
            _threads(threads, source, name),
            source,
        )
    finally:
        source.close()
    _raise_again(caught)
    return result


def evaluate(
    policy: Policy | Run | str | os.PathLike[str],
    episodes: int = 50,
    *,
    environment: EnvironmentLike | None = None,
    seed: int = 0,
    deterministic: bool = True,
    threads: int | None = None,
) -> Evaluation:
    """Runs whole episodes, as `agail eval` does; the same ones for the same seed.

    environment: as for train(); default: the one that the policy names.
    """
    policy = _policy(policy)
    result = _play(_core.evaluate, policy, episodes, environment, seed, deterministic, threads)
    share = share_of(result["mean_return"], policy.demonstrations_mean_return)
    return Evaluation(share_of_demonstrations=share, **result)


def record(
    policy: Policy | Run | str | os.PathLike[str] | Predictor,
    episodes: int,
    *,
    environment: EnvironmentLike | None = None,
    seed: int = 0,
    deterministic: bool = True,
    threads: int | None = None,
) -> Demonstrations:
    """Complete demonstrations from a policy, as `agail record` makes them.

    policy: also a model of stable-baselines3, or any object with its predict(); then `environment` must
    be given. predict() sees the environment's own observations: a model that was trained behind
    VecNormalize needs an environment or an object that normalises.
    """
    if not isinstance(policy, Policy | Run | str | os.PathLike):
        if not callable(getattr(policy, "predict", None)):
            raise InputError(f"{policy!r} is no policy: it has no predict()")
        if environment is None:
            raise InputError("record() of such a policy needs the environment to record in")
        counts = whole("episodes", episodes, 1, MOST_EPISODES), whole("seed", seed, 0, MOST_SEED)
        return Demonstrations(_recording.record(policy, environment, *counts, deterministic))
    policy = _policy(policy)
    core = _play(_core.record, policy, episodes, environment, seed, deterministic, threads)
    return Demonstrations(core)


def _environment_for(
    policy: Policy, environment: EnvironmentLike | None
) -> tuple[str, Source | Registered]:
    if environment is None:
        return source_of(policy.environment)
    name, source = source_of(environment)
    if _registered(name) != _registered(policy.environment):
        source.close()
        raise InputError(f"the policy is for {policy.environment}, the environment is {name}")
    if isinstance(source, Source):
        source.name = policy.environment  # the core asks for it by this name
    return policy.environment, source


def _registered(name: str) -> str:
    """Without the module that registers it, and without the name that ours have in Gymnasium."""
    return name.rpartition(":")[2].removeprefix("agail/")
