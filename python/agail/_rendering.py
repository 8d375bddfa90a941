"""Environments that draw themselves, without a screen, also in the states that observations tell."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import tempfile
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from agail import _core
from agail._core import InputError
from agail._extension import missing

_MUJOCO = "gymnasium.envs.mujoco"
# In a process of its own: after one way has failed, PyOpenGL cannot be told another one.
_TRY_GL = """
import mujoco
context = mujoco.GLContext(8, 8)
context.make_current()
mujoco.MjrContext(mujoco.MjModel.from_xml_string("<mujoco/>"), mujoco.mjtFontScale.mjFONTSCALE_100)
"""


def _choose_gl() -> None:
    """Sets MUJOCO_GL to what works here without a screen; what the user has set is only tried."""
    wanted = os.environ.get("MUJOCO_GL")
    for name in [wanted] if wanted else ["egl", "osmesa"]:
        environment = {**os.environ, "MUJOCO_GL": name}
        with tempfile.TemporaryDirectory() as log:  # MuJoCo leaves MUJOCO_LOG.TXT where it fails
            tried = subprocess.run(
                [sys.executable, "-c", _TRY_GL], env=environment, cwd=log, capture_output=True
            )
        if tried.returncode == 0:
            os.environ["MUJOCO_GL"] = name
            return
    raise InputError(
        f"MuJoCo cannot draw without a screen here (MUJOCO_GL={wanted or 'egl and osmesa'}); "
        "on Debian: apt-get install libegl1 libgl1 libopengl0"
    )


def make_drawn(name: str, size: tuple[int, int] | None) -> gymnasium.Env:
    """Gymnasium's environment of this id (or module:id), which renders RGB arrays.

    size: width and height, for environments that can be told; default: their own. InputError if
    there is no such environment, if it cannot draw itself, or if something it needs is missing.
    """
    os.environ.setdefault("SDL_VIDEODRIVER", "dummy")  # of pygame
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    module, _, name = name.rpartition(":")
    if name.startswith("agail/") and name[6:] in _core.environment_ids():
        name = name[6:]
    try:
        if module:
            importlib.import_module(module)
        spec = gymnasium.spec(name)
    except Exception as error:  # no such id, or whatever the module does
        reason = " ".join(str(error).split())
        raise InputError(f"environment {name}: {reason}; --env names one of Gymnasium's") from error
    options: dict[str, Any] = {}
    if str(spec.entry_point).startswith(_MUJOCO):
        try:
            import mujoco
        except ImportError as error:
            raise missing("mujoco", "video") from error
        # Of Gymnasium's models. MuJoCo would write them to MUJOCO_LOG.TXT in the present folder.
        mujoco.set_mju_user_warning(lambda message: None)
        _choose_gl()
        options = dict(zip(("width", "height"), size)) if size else {}
        options["camera_name"] = "track"  # follows the robot, if the model has it
    try:
        environment = gymnasium.make(spec, render_mode="rgb_array", **options)
        draws = "rgb_array" in environment.metadata.get("render_modes", [])
    except Exception as error:  # a package that it needs, or its own bug
        if not (isinstance(error, TypeError) and "render_mode" in str(error)):
            raise _failed(name, "make()", error) from error
        draws = False
    if not draws:
        raise InputError(f"environment {name} cannot draw itself: it has no render mode rgb_array")
    if _is_mujoco(environment):
        _prepare(environment.unwrapped.model)
    return environment


def _prepare(model: Any) -> None:
    """Changes what is seen, not what happens."""
    # Without a graphics card the shadow at its full resolution takes a third of the time.
    model.vis.quality.shadowsize = 1024
    # The floor has no end, but is drawn with one, 20 m away.
    for floor in np.flatnonzero(model.geom_type == 0):  # planes
        model.geom_size[floor, :2] *= 10
        if model.geom_matid[floor] >= 0:
            model.mat_texrepeat[model.geom_matid[floor]] *= 10


def _is_mujoco(environment: gymnasium.Env) -> bool:
    return all(hasattr(environment.unwrapped, part) for part in ("model", "data", "set_state"))


def _failed(name: str, call: str, error: Exception) -> InputError:
    if isinstance(error, gymnasium.error.DependencyNotInstalled):
        return missing("that the environment draws with", "video")
    reason = " ".join(str(error).split())
    return InputError(f"environment {name}: {call} raised {type(error).__name__}: {reason}")


def draw(environment: gymnasium.Env) -> NDArray[np.uint8]:
    """The picture of its present state: (height, width, 3)."""
    viewer = getattr(getattr(environment.unwrapped, "mujoco_renderer", None), "viewer", None)
    if viewer is not None:
        viewer.make_context_current()  # another environment may have drawn since
    try:
        return np.asarray(environment.render(), np.uint8)
    except Exception as error:
        raise _failed(environment.spec.id, "render()", error) from error


class Placer:
    """Puts an environment, which has been reset, into the states that observations tell.

    Two kinds tell theirs: those whose state is the observation (CartPole, MountainCar), and MuJoCo's
    whose observation begins with the positions but for the first few, where the robot is (Hopper,
    Walker2d, Humanoid...). Those few are summed up from the velocities that follow the positions.
    """

    def __init__(self, environment: gymnasium.Env):
        """InputError for other kinds."""
        self._base: Any = environment.unwrapped
        observation = np.asarray(environment.reset(seed=0)[0], np.float64).reshape(-1)
        state = np.asarray(getattr(self._base, "state", None), np.float64)
        self._is_state = state.shape == observation.shape and np.allclose(state, observation)
        if self._is_state:
            return
        if _is_mujoco(environment):
            positions = self._base.data.qpos
            for hidden in range(3):
                seen = len(positions) - hidden
                if np.array_equal(observation[:seen], positions[hidden:]):
                    self._hidden, self._seen = hidden, seen
                    self.begin()
                    return
        raise InputError(
            f"a demonstration of {environment.spec.id} cannot be drawn: its observations do not tell "
            "the environment's whole state"
        )

    def begin(self) -> None:
        """What comes next is the first observation of an episode."""
        self._place: NDArray[np.float64] | None = None

    def put(self, observation: NDArray[np.float64]) -> None:
        """One step after the observation before it."""
        if self._is_state:
            self._base.state = np.array(observation)
            return
        velocities = observation[self._seen : self._seen + self._base.model.nv]
        speed = velocities[: self._hidden]
        if self._place is None:
            self._place = np.zeros(self._hidden)
        else:
            self._place = self._place + self._base.dt * (self._speed + speed) / 2
        self._speed = speed
        self._base.set_state(np.concatenate([self._place, observation[: self._seen]]), velocities)
