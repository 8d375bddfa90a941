"""Episodes of policies and of demonstrations, step by step, and as frames."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import gymnasium
import numpy as np
from numpy.typing import NDArray

from agail._core import InputError, Policy
from agail._pictures import beside, captioned
from agail._rendering import Placer, draw, make_drawn
from agail._source import Source
from agail.demonstrations import Episode

if TYPE_CHECKING:
    from PIL import Image


@dataclass(frozen=True)
class Moment:
    """How far an episode is."""

    step: int = 0
    total: float | None = 0.0  # undiscounted return so far; None: rewards are not known
    end: str = ""  # why it has ended

    def after(self, reward: float | None, terminated: bool, truncated: bool) -> Moment:
        total = None if reward is None or self.total is None else self.total + reward
        end = "terminated" if terminated else "time limit" if truncated else ""
        return Moment(self.step + 1, total, end)

    def __str__(self) -> str:
        words = f"step {self.step}", "" if self.total is None else f"return {self.total:,.1f}"
        return "   ".join(filter(None, (*words, self.end)))


@dataclass
class Side:
    """An episode under way, in an environment that draws it."""

    label: str
    environment: gymnasium.Env
    moments: Iterator[Moment]


class Player:
    """A policy in an environment that draws itself."""

    def __init__(self, policy: Policy, name: str, size: tuple[int, int] | None):
        """InputError if they do not fit."""
        self.environment = make_drawn(name, size)
        self._policy = policy
        source = Source(self.environment)
        sizes = source.observations.size, source.actions.size, source.spec(source.name).get("n", 0)
        if sizes != (policy.observation_dim, policy.action_dim, policy.n_actions):
            raise InputError(
                f"the policy for {policy.environment} does not fit {name}: it takes observations of "
                f"{policy.observation_dim} numbers, not {sizes[0]}, or has other actions; give "
                "another --env"
            )
        self._lane = source.make(source.name)

    def moments(self, seed: int, start: NDArray[np.float64] | None) -> Iterator[Moment]:
        """One episode, with the mode of the policy; start: the observation of its first state."""
        placer = None if start is None else Placer(self.environment)
        observation = self._lane.reset(seed)
        if placer is not None:
            placer.put(start)
            observation = start
        moment = Moment()
        yield moment
        while not moment.end:
            self._lane.action[:] = self._policy._predict_rows(observation)
            observation, reward, terminated, truncated = self._lane.step()
            moment = moment.after(reward, terminated, truncated)
            yield moment


def replayed(environment: gymnasium.Env, episode: Episode) -> Iterator[Moment]:
    """The demonstrated states, one after the other."""
    placer = Placer(environment)
    rewards = [None] * len(episode) if episode.rewards is None else episode.rewards
    moment = Moment(total=None if episode.rewards is None else 0.0)
    placer.put(episode.observations[0])
    yield moment
    for t, observation in enumerate(episode.observations[1:]):
        placer.put(observation)
        moment = moment.after(rewards[t], episode.terminations[t], episode.truncations[t])
        if t + 1 == len(episode) and not moment.end:
            moment = Moment(moment.step, moment.total, "end")
        yield moment


def filmed(
    sides: list[Side], steps_a_frame: float, size: tuple[int, int] | None
) -> Iterator[tuple[Image.Image, list[Moment]]]:
    """Frames until all have ended, the last step among them; who ends first stands still."""
    moments = [next(side.moments) for side in sides]
    drawn: list[tuple[Moment, Image.Image] | None] = [None] * len(sides)
    step, due = 0, 0.0
    while True:
        ended = all(moment.end for moment in moments)
        if step >= due or ended:
            due += steps_a_frame
            for i, (side, moment) in enumerate(zip(sides, moments)):
                if drawn[i] is None or drawn[i][0] is not moment:
                    picture = draw(side.environment)
                    size = size or (picture.shape[1] // 2 * 2, picture.shape[0] // 2 * 2)
                    drawn[i] = moment, captioned(picture, size, (side.label, str(moment)))
            yield beside([frame for _, frame in drawn]), moments
        if ended:
            return
        moments = [m if m.end else next(side.moments) for side, m in zip(sides, moments)]
        step += 1
