"""Policies from demonstrations in which part of the actions is missing."""

try:
    from agail import _core
except ImportError as error:
    if "libmujoco" not in str(error):
        raise
    raise ImportError(
        f"{error}; agail needs its exact MuJoCo in the same environment: pip install --force-reinstall agail"
    ) from error

from agail import gym
from agail._core import InputError, Policy
from agail.demonstrations import Demonstrations, Episode
from agail.training import Evaluation, Run, evaluate, record, train

__version__ = _core.version
__all__ = [
    "Demonstrations",
    "Episode",
    "Evaluation",
    "InputError",
    "Policy",
    "Run",
    "evaluate",
    "record",
    "train",
]

gym.register()
