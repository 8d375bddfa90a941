"""Gymnasium environments, for the C++ core."""

from __future__ import annotations

import copy
import difflib
import importlib
import itertools
import math
import warnings
from collections.abc import Callable
from typing import Any, TypeVar

import gymnasium
import numpy as np
from gymnasium import spaces

from agail import _core, _layout
from agail._core import InputError
from agail._vector import OfOne

EnvironmentLike = (
    str
    | gymnasium.Env
    | gymnasium.vector.VectorEnv
    | Callable[[], gymnasium.Env | gymnasium.vector.VectorEnv]
)


def _unsupported(name: str, kind: str, space: spaces.Space, advice: str) -> InputError:
    return InputError(
        f"environment {name}: {kind} {type(space).__name__} is not supported, Box and Discrete are; "
        f"{advice}"
    )


class _Observations:
    """Box of any shape, or Discrete."""

    def __init__(self, name: str, space: spaces.Space):
        if isinstance(space, spaces.Box):
            self.layout = _layout.Observations(math.prod(space.shape), space.shape)
            self.float32 = space.dtype != np.float64
        elif isinstance(space, spaces.Discrete):
            self.layout = _layout.Observations(int(space.n), (), int(space.start))
            self.float32 = True
        else:
            advice = "wrap it in gymnasium.wrappers.FlattenObservation"
            raise _unsupported(name, "an observation space", space, advice)
        self.space = space
        self.size = self.layout.size
        if self.size == 0:
            raise InputError(f"environment {name}: its observations have no numbers")

    def __call__(self, name: str, value: Any) -> np.ndarray:
        if isinstance(self.space, spaces.Discrete):
            try:
                return self.layout.rows(np.array([int(value)]))[0]
            except ValueError as error:
                raise InputError(
                    f"environment {name}: observation {value} is not in {self.space}; mend the "
                    "environment"
                ) from error
        array = np.array(value, np.float64, order="C")  # a copy: the environment may reuse its own
        if array.shape != self.space.shape:
            raise InputError(
                f"environment {name}: an observation of shape {array.shape}, but its "
                f"observation_space has {self.space.shape}; mend the environment"
            )
        return self.layout.rows(array[None])[0]


class _Actions:
    """Box of any shape, or Discrete."""

    def __init__(self, name: str, space: spaces.Space):
        self.space = space
        if isinstance(space, spaces.Discrete):
            self.layout = _layout.Actions(1, (), int(space.start))
        elif isinstance(space, spaces.Box) and np.issubdtype(space.dtype, np.floating):
            self.layout = _layout.Actions(math.prod(space.shape), space.shape)
        else:
            advice = "continuous ones must be of floating point"
            if isinstance(space, spaces.MultiDiscrete | spaces.MultiBinary):
                advice = "number the combinations in a wrapper with a Discrete space"
            raise _unsupported(name, "an action space", space, advice)
        self.size = self.layout.size
        if self.size == 0:
            raise InputError(f"environment {name}: its actions have no numbers")

    def spec(self) -> dict[str, Any]:
        if isinstance(self.space, spaces.Discrete):
            return {"n": int(self.space.n)}
        low, high = (
            np.asarray(bound, np.float32).reshape(-1).tolist()
            for bound in (self.space.low, self.space.high)
        )
        return {"low": low, "high": high}

    def __call__(self, action: np.ndarray) -> Any:
        if isinstance(self.space, spaces.Discrete):
            return self.layout.own(action.astype(np.int64))[0]
        # A copy, as the environment may keep it; a float32 bound may round outside of a float64 one.
        value = self.layout.own(action.astype(self.space.dtype)[None])[0]
        return np.clip(value, self.space.low, self.space.high)


class Lane:
    """One environment, as the core steps it (python/core/python_environment.h)."""

    def __init__(self, source: Source, environment: gymnasium.Env):
        self._source = source
        self._environment = environment
        self._observe = source.observations
        self._act = source.actions
        self._name = source.name
        self.steps = 0
        self.action = np.zeros(source.actions.size, np.float32)

    def _failed(self, call: str, error: Exception) -> InputError:
        return InputError(
            f"environment {self._name}: {call} raised {type(error).__name__} after {self.steps} "
            f"steps of an episode: {error}"
        )

    def _unexpected(self, call: str, result: Any, expected: str) -> InputError:
        what = f"{len(result)} values" if isinstance(result, tuple) else type(result).__name__
        return InputError(
            f"environment {self._name}: {call} returned {what} in place of {expected}; mend the "
            "environment (gymnasium.utils.env_checker.check_env says more)"
        )

    def reset(self, seed: int) -> np.ndarray:
        self.steps = 0
        try:
            result = self._environment.reset(seed=seed)
        except Exception as error:
            raise self._failed("reset()", error) from error
        if not isinstance(result, tuple) or len(result) != 2:
            raise self._unexpected("reset()", result, "(observation, info)")
        return self._numbers("reset()", result[0])

    def step(self) -> tuple[np.ndarray, float, bool, bool]:
        try:
            result = self._environment.step(self._act(self.action))
        except Exception as error:
            raise self._failed("step()", error) from error
        if not isinstance(result, tuple) or len(result) != 5:
            expected = "(observation, reward, terminated, truncated, info)"
            raise self._unexpected("step()", result, expected)
        self.steps += 1
        observation, reward, terminated, truncated, _ = result
        try:
            reward, terminated, truncated = float(reward), bool(terminated), bool(truncated)
        except (TypeError, ValueError) as error:
            raise self._failed("the reward or an end flag of step()", error) from error
        return self._numbers("step()", observation), reward, terminated, truncated

    def _numbers(self, call: str, observation: Any) -> np.ndarray:
        try:
            return self._observe(self._name, observation)
        except InputError:
            raise
        except Exception as error:
            raise self._failed(f"the observation of {call}", error) from error

    def close(self) -> None:
        self._source.give_back(self._environment)


AnyLane = TypeVar("AnyLane", bound=Lane)


def _is_built_in(environment: EnvironmentLike) -> bool:
    return isinstance(environment, str) and environment in _core.environment_ids()


def close(name: str, environment: gymnasium.Env) -> None:
    """What goes wrong in it is told, but must not take the place of what the environment was for."""
    try:
        environment.close()
    except Exception as error:
        what = f"{type(error).__name__}: {error}"
        warnings.warn(f"environment {name}: close() raised {what}", RuntimeWarning, stacklevel=2)


class Source:
    """Environments of one kind. Those that were made are kept for the next use, until close()."""

    def __init__(self, environment: EnvironmentLike):
        self._made: list[gymnasium.Env] = []
        self._idle: list[gymnasium.Env] = []
        self._make = self._factory(environment)
        first = self._take()
        self.name = self._name_of(environment, first)
        self.observations = _Observations(self.name, first.observation_space)
        self.actions = _Actions(self.name, first.action_space)
        self.lanes = 1
        if isinstance(environment, gymnasium.vector.VectorEnv):
            self.lanes = environment.num_envs
        self._idle.append(first)

    def _factory(self, environment: EnvironmentLike) -> Callable[[], gymnasium.Env]:
        if isinstance(environment, str):
            return lambda: gymnasium.make(environment)
        if isinstance(environment, gymnasium.vector.VectorEnv):
            functions = getattr(environment.unwrapped, "env_fns", None)
            if not functions or environment.unwrapped is not environment:
                raise InputError(
                    f"{environment} does not tell how its environments are made, and steps them all at "
                    "once, but lanes run on their own; give a SyncVectorEnv or AsyncVectorEnv without "
                    "wrappers, or a function that makes one environment (a vector environment with "
                    "num_envs=1 will do), with lanes=N"
                )
            turns = itertools.cycle(functions)
            return lambda: next(turns)()
        if isinstance(environment, gymnasium.Env):
            self._idle.append(environment)
            return lambda: self._copy(environment)
        if callable(environment):
            return environment
        raise InputError(
            f"{environment!r} is no environment; give an id, a gymnasium.Env, a vector environment "
            "or a function that makes an environment"
        )

    @staticmethod
    def _copy(environment: gymnasium.Env) -> gymnasium.Env:
        """Another one of its kind: evaluation must not disturb the episode under way."""
        try:
            return copy.deepcopy(environment)  # with what was changed after it was made
        except Exception as error:
            try:
                if environment.spec is not None:
                    return gymnasium.make(environment.spec)
            except Exception:  # a wrapper that does not say how it was made, an unknown id
                pass
            raise InputError(
                f"{environment} cannot be copied ({type(error).__name__}: {error}), but training "
                "needs another one to evaluate in; give a function that makes the environment"
            ) from error

    @staticmethod
    def _name_of(environment: EnvironmentLike, first: gymnasium.Env) -> str:
        if isinstance(environment, str):
            return environment
        return first.spec.id if first.spec is not None else type(first.unwrapped).__name__

    def _take(self) -> gymnasium.Env:
        if self._idle:
            return self._idle.pop()
        made = self._make()
        if not isinstance(made, gymnasium.Env | gymnasium.vector.VectorEnv):
            raise InputError(f"{self._make!r} returned {made!r}, which is no gymnasium.Env")
        if any(other.unwrapped is made.unwrapped for other in self._made):
            raise InputError(
                f"{self._make!r} returned the same environment twice, but lanes and evaluation need "
                "environments of their own; it must make a new one each time"
            )
        if isinstance(made, gymnasium.vector.VectorEnv):
            made = OfOne(made)
        self._made.append(made)
        return made

    def spec(self, name: str) -> dict[str, Any] | None:
        if name != self.name:
            return None
        sizes = {"observation_dim": self.observations.size, "float32": self.observations.float32}
        layout = _layout.described(self.observations.layout, self.actions.layout)
        return {"id": self.name, **sizes, "layout": layout, **self.actions.spec()}

    def make(self, name: str) -> Lane | None:
        return self.lane(Lane) if name == self.name else None

    def lane(self, kind: type[AnyLane]) -> AnyLane:
        environment = self._take()
        for what, mine in (("observation", self.observations), ("action", self.actions)):
            other = getattr(environment, f"{what}_space")
            if other != mine.space:
                raise InputError(
                    f"environment {self.name}: the {what} space is {other} in one instance and "
                    f"{mine.space} in another; all must be of one kind"
                )
        return kind(self, environment)

    def give_back(self, environment: gymnasium.Env) -> None:
        self._idle.append(environment)

    def close(self) -> None:
        """Closes what was made here, not what was given."""
        for environment in self._made:
            close(self.name, environment)
        self._made, self._idle = [], []


def _unknown(name: str, error: Exception) -> InputError:
    near = difflib.get_close_matches(name, _core.environment_ids(), 1)
    own = f"agail's own: did you mean '{near[0]}'?" if near else "`agail envs` lists agail's own"
    return InputError(f"no environment '{name}': {error}; {own}")


class Registered:
    """Whatever id is registered with Gymnasium and not built in; for the command line."""

    def __init__(self) -> None:
        self._sources: dict[str, Source | None] = {}

    def _source(self, name: str) -> Source | None:
        if _is_built_in(name):
            return None
        if name not in self._sources:
            module, _, registered = name.rpartition(":")
            try:
                if module:  # module:id, as gymnasium.make() takes it
                    importlib.import_module(module)
            except ImportError as error:
                raise InputError(f"environment {name}: {error}") from error
            except Exception as error:
                what = f"{type(error).__name__}: {error}"
                raise InputError(f"environment {name}: importing {module} raised {what}") from error
            try:
                gymnasium.spec(registered)
            except gymnasium.error.Error as error:
                raise _unknown(name, error) from error
            try:
                self._sources[name] = Source(name)
            except InputError:
                raise
            except Exception as error:  # a package that it needs is missing, or its own bug
                what = f"{type(error).__name__}: {error}"
                raise InputError(f"environment {name} cannot be made: {what}") from error
        return self._sources[name]

    def spec(self, name: str) -> dict[str, Any] | None:
        source = self._source(name)
        return None if source is None else source.spec(name)

    def make(self, name: str) -> Lane | None:
        source = self._source(name)
        return None if source is None else source.make(name)

    def close(self) -> None:
        for source in self._sources.values():
            if source is not None:
                source.close()


def source_of(environment: EnvironmentLike) -> tuple[str, Source | Registered]:
    """The environment's name, and where the core gets it from."""
    if isinstance(environment, str):
        if environment.startswith("agail/") and environment[6:] in _core.environment_ids():
            environment = environment[6:]
        return environment, Registered()
    source = Source(environment)
    return source.name, source
