"""agail video: episodes of a policy as a film, alone or beside demonstrations."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING

import gymnasium

from agail._arguments import MOST_EPISODES, whole
from agail._core import InputError, Policy
from agail._extension import Parser, run
from agail._pictures import FORMATS, possible_rate, write_film
from agail._playing import Player, Side, filmed, replayed
from agail._rendering import make_drawn
from agail._source import close
from agail.demonstrations import Demonstrations

if TYPE_CHECKING:
    from PIL import Image

HOLD = 1.0  # seconds that the end of an episode stays in view


def film(
    policy: Policy,
    out: str | os.PathLike[str],
    *,
    environment: str | None = None,
    episodes: int = 1,
    seed: int = 0,
    size: tuple[int, int] | None = None,
    fps: float = 25,
    demonstrations: Demonstrations | None = None,
) -> list[float]:
    """Films episodes of the deterministic policy; the return of each.

    out: .mp4 or .gif. environment: a Gymnasium id; default: the policy's. Episode i is reset with
    seed + i. size: width and height of a picture, even; default: as the environment draws. fps: frames
    a second; at the environment's own speed, so that steps are left out. demonstrations: episode i
    is shown on the left of a policy that begins in its first state. InputError for what cannot be
    filmed; OSError if the disk is full.
    """
    out = Path(out)
    _check(policy, out, episodes, seed, size, fps, demonstrations)
    name = environment or policy.environment
    player = Player(policy, name, size)
    speed = float(player.environment.metadata.get("render_fps") or 30)
    rate = possible_rate(out, min(fps, speed))
    returns = []

    def frames() -> Iterator[Image.Image]:
        for i in range(episodes):
            sides, start = [], None
            if demonstrations is not None:
                start = demonstrations[i].observations[0]
                states = replayed(beside_it, demonstrations[i])
                sides.append(Side(f"demonstration {i + 1}", beside_it, states))
            moments = player.moments(seed + i, start)
            label = f"{policy.method} policy, episode {i + 1}"
            sides.append(Side(label, player.environment, moments))
            for last in filmed(sides, speed / rate, size):
                yield last[0]
            yield from [last[0]] * round(HOLD * rate)
            returns.append(last[1][-1].total)

    environments = [player.environment]
    try:
        if demonstrations is not None:
            beside_it = make_drawn(name, size)
            environments.append(beside_it)
        write_film(out, frames(), rate)
    finally:
        for each in environments:
            close(name, each)
    return returns


def _check(
    policy: Policy,
    out: Path,
    episodes: int,
    seed: int,
    size: tuple[int, int] | None,
    fps: float,
    demonstrations: Demonstrations | None,
) -> None:
    """InputError, before anything is opened."""
    if out.suffix not in FORMATS:
        raise InputError(f"{out}: the name of a film should end in {' or '.join(FORMATS)}")
    whole("episodes", episodes, 1, MOST_EPISODES)
    whole("seed", seed, 0, 2**31 - 1)
    if not (isinstance(fps, Real) and 1 <= fps <= 120):
        raise InputError(f"fps = {fps!r} should be from 1 to 120")
    if size and not all(64 <= side <= 4096 and side % 2 == 0 for side in size):
        raise InputError(
            f"size {'x'.join(map(str, size))}: should be width x height, even and from 64 to 4096, as "
            "640x480"
        )
    if demonstrations is None:
        return
    if demonstrations.observation_dim != policy.observation_dim:
        raise InputError(
            f"the demonstrations have observations of {demonstrations.observation_dim} numbers, the "
            f"policy's have {policy.observation_dim}; give demonstrations of {policy.environment}"
        )
    if len(demonstrations) < episodes:
        raise InputError(
            f"episodes = {episodes}, but there are {len(demonstrations)} demonstrations; give fewer"
        )


def _size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{2,4})x(\d{2,4})", text)
    if not match:
        raise InputError(f"--size {text}: should be width x height, as 640x480")
    return int(match[1]), int(match[2])


def main() -> None:
    parser = Parser("agail video", description="Episodes of a policy as a film.")
    parser.add_argument("policy", metavar="POLICY", help="a run folder or a .safetensors file")
    parser.add_argument("--out", required=True, help="the film: a name that ends in .mp4 or .gif")
    parser.add_argument("--env", help="Gymnasium id, or module:id; default: the policy's own")
    parser.add_argument("--episodes", type=int, default=1, help="how many; default 1")
    parser.add_argument("--seed", type=int, default=0, help="of the first episode; default 0")
    parser.add_argument("--size", metavar="WxH", help="of a picture; default: the environment's")
    parser.add_argument("--fps", type=float, default=25, help="frames a second; default 25")
    parser.add_argument("--demos", metavar="FILE", help="demonstrations to show beside the policy")
    options = parser.parse_args()

    def work() -> None:
        gymnasium.logger.min_level = gymnasium.logger.ERROR  # if the version is old, it is meant
        size = _size(options.size) if options.size else None
        policy = Policy.load(options.policy)
        returns = film(
            policy,
            Path(options.out),
            environment=options.env,
            episodes=options.episodes,
            seed=options.seed,
            size=size,
            fps=options.fps,
            demonstrations=Demonstrations.load(options.demos) if options.demos else None,
        )
        shown = ", ".join(f"{each:,.1f}" for each in returns)
        print(f"{options.out}: {len(returns)} episode{'s'[: len(returns) > 1]}, return {shown}")

    run(work)
