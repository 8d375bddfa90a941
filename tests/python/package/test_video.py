"""agail video: what is in the files, decoded by others' readers."""

import math
import os
import resource
import subprocess
import sys
from pathlib import Path

import gymnasium
import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image, ImageSequence
from small import train
from test_spaces import Discretes

import agail
from agail import _core
from agail._pictures import captioned
from agail._rendering import Placer
from agail.video import HOLD, film

AGAIL = str(Path(sys.executable).with_name("agail"))


def video(*words, largest_file=resource.RLIM_INFINITY, **environment):
    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file, resource.RLIM_INFINITY))

    return subprocess.run(
        [AGAIL, "video", *map(str, words)], capture_output=True, text=True, timeout=300,
        env={**os.environ, **environment}, preexec_fn=limit,
    )  # fmt: skip


def decode(path):
    """Frames (n, height, width, 3), and how many there are a second."""
    if path.suffix == ".mp4":
        frames = imageio_ffmpeg.read_frames(path)
        about = next(frames)
        width, height = about["size"]
        shape = height, width, 3
        return np.array([np.frombuffer(f, np.uint8).reshape(shape) for f in frames]), about["fps"]
    with Image.open(path) as file:
        shortest = file.info["duration"]
        frames = []
        for frame in ImageSequence.Iterator(file):
            times, rest = divmod(frame.info["duration"], shortest)
            assert rest == 0
            frames += [np.asarray(frame.convert("RGB"))] * times  # equal ones are stored once
    return np.array(frames), 1000 / shortest


def play(policy, name, seed):
    """Steps and return of an episode in Gymnasium's environment."""
    environment = gymnasium.make(name)
    observation, _ = environment.reset(seed=seed)
    steps, total, ended = 0, 0.0, False
    while not ended:
        action, _ = policy.predict(observation)
        observation, reward, terminated, truncated, _ = environment.step(action)
        steps, total, ended = steps + 1, total + reward, terminated or truncated
    return steps, total


def legible(frame, lines):
    """How much brighter the letters of these lines are than what is around them."""
    size = frame.shape[1], frame.shape[0]
    text = np.asarray(captioned(np.zeros_like(frame), size, lines)).mean(2)
    rows = text.max(1) > 0
    return frame[text > 200].mean() - frame[rows][text[rows] == 0].mean()


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_an_episode(hopper_run, tmp_path, suffix):
    out = tmp_path / f"film{suffix}"
    done = video(hopper_run.folder, "--out", out, "--seed", 3, "--size", "320x240", "--fps", 20)
    assert done.returncode == 0, done.stderr
    steps, total = play(hopper_run.policy, "Hopper-v5", 3)
    assert done.stdout == f"{out}: 1 episode, return {total:,.1f}\n"
    assert list(tmp_path.iterdir()) == [out]

    frames, rate = decode(out)
    every = gymnasium.spec("Hopper-v5").make().metadata["render_fps"] / 20
    shown = sorted({math.ceil(every * j) for j in range(math.ceil(steps / every))} | {steps})
    assert rate == 20 and frames.shape == (len(shown) + 20 * HOLD, 240, 320, 3)
    moving = frames[: len(shown)].astype(int)
    assert (np.abs(np.diff(moving, axis=0)).max(axis=(1, 2, 3)) > 60).all()
    assert (np.abs(np.diff(moving[:, 80:], axis=0)).mean(axis=(1, 2, 3)) > 0.1).all(), "still"
    for frame, step in ((frames[0], 0), (frames[3], shown[3]), (frames[-1], steps)):
        label = "trpo policy, episode 1"
        if step in (0, steps):
            caption = f"step {step}   return {total if step else 0:,.1f}"
            caption += "   terminated" if step else ""
            assert legible(frame, (label, caption)) > 120
            other = caption.replace("return ", "return 7")
            assert legible(frame, (label, other)) < legible(frame, (label, caption)) - 20
        assert legible(frame, (label, f"step {step}")) > 120


@pytest.mark.parametrize("name", ["Hopper-v5", "Humanoid-v5", "CartPole-v0"])
def test_beside_demonstrations(tmp_path, monkeypatch, name):
    """The policy that made the demonstrations does the same again, from the same first states."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    run = train(name, method="trpo", out=tmp_path / "run", timesteps=256)
    demos = agail.record(run, 2, seed=5)
    demos.save(tmp_path / "demos.hdf5")
    out = tmp_path / "film.mp4"
    done = video(run.folder, "--out", out, "--demos", tmp_path / "demos.hdf5", "--episodes", 2,
                 "--size", "128x128", "--fps", 15)  # fmt: skip
    assert done.returncode == 0, done.stderr
    returns = ", ".join(f"{episode.rewards.sum():,.1f}" for episode in demos)
    assert done.stdout.strip() == f"{out}: 2 episodes, return {returns}"
    frames, _ = decode(out)
    assert frames.shape[1:] == (128, 256, 3)
    left, right = frames[:, 40:, :128].astype(float), frames[:, 40:, 128:].astype(float)
    apart = np.abs(left - right).mean()
    moved = np.abs(left[0] - left[len(left) // 3]).mean()
    assert apart < 2 and moved > 1 and apart < moved / 2
    assert not list((tmp_path / "here").iterdir()), "MuJoCo's log"


@pytest.mark.parametrize("name", _core.environment_ids())
def test_states_from_observations(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # for MuJoCo's log
    original, copy = gymnasium.make(name), gymnasium.make(name)
    observation, _ = original.reset(seed=1)
    original.action_space.seed(1)
    placer = Placer(copy)
    placer.put(observation)
    if name.startswith("CartPole"):
        np.testing.assert_array_equal(copy.unwrapped.state, observation)
        return
    start = original.unwrapped.data.qpos.copy()
    for _ in range(15):
        observation, *_ = original.step(original.action_space.sample())
        placer.put(observation)
    position, true = copy.unwrapped.data.qpos, original.unwrapped.data.qpos
    hidden = 2 if name.split("-")[0] in ("Ant", "Humanoid", "Swimmer") else 1
    np.testing.assert_array_equal(position[hidden:], true[hidden:])
    # Summed up from the velocities at the ends of the steps only.
    way = true[:hidden] - start[:hidden]
    np.testing.assert_allclose(position[:hidden], way, atol=0.03 + 0.1 * np.abs(way).max())


class Shown(Discretes):
    """Draws itself, and takes nothing but numbers of its action space, which starts at 2."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012

    def __init__(self, render_mode=None):
        self.render_mode = render_mode

    def render(self):
        return np.full((64, 64, 3), 30 * self.seen, np.uint8)


OWN = """
import gymnasium
class Blind(gymnasium.Env):
    observation_space = gymnasium.spaces.Box(-1, 1, (11,))
    action_space = gymnasium.spaces.Box(-1, 1, (3,))
gymnasium.register("Blind-v0", Blind)
class Torn(Blind):
    metadata = {"render_modes": ["rgb_array"]}
    def __init__(self, render_mode=None): self.render_mode = render_mode
    def reset(self, seed=None, options=None): return self.observation_space.sample(), {}
    def render(self): raise ValueError("no\\nink")
gymnasium.register("Torn-v0", Torn, disable_env_checker=True)
"""


@pytest.fixture
def own(tmp_path):
    (tmp_path / "modules").mkdir()
    (tmp_path / "modules" / "own.py").write_text(OWN)
    return {"PYTHONPATH": str(tmp_path / "modules")}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--out", "x.avi"], ".mp4 or .gif"),
        (["--out", "absent/x.mp4"], "give another --out"),
        (["--out", "x.mp4", "--size", "321x240"], "as 640x480"),
        (["--out", "x.mp4", "--size", "9000x240"], "as 640x480"),
        (["--out", "x.mp4", "--fps", "0"], "from 1 to 120"),
        (["--out", "x.mp4", "--episodes", "0"], "episodes = 0 should be"),
        (["--out", "x.mp4", "--episodes", "x"], "invalid int"),
        (["--out", "x.mp4", "--seed", "-1"], "from 0 to"),
        (["--out", "x.mp4", "--env", "Walker2d-v5"], "does not fit Walker2d-v5"),
        (["--out", "x.mp4", "--env", "Hoper-v5"], "Hoper-v5"),
        (["--out", "x.mp4", "--env", "nowhere:Hopper-v5"], "nowhere"),
        (["--out", "x.mp4", "--env", "own:Blind-v0"], "cannot draw itself"),
        (["--out", "x.mp4", "--env", "own:Torn-v0"], "render() raised ValueError: no ink"),
        (["--out", "x.mp4", "--demos", "absent.hdf5"], "absent.hdf5"),
        (["--out", "x.mp4", "--demos", "demos.hdf5", "--episodes", "7"], "there are 6"),
        (["--out", "x.mp4", "--demos", "cartpole.hdf5"], "give demonstrations of Hopper-v5"),
    ],
)
def test_wrong_input(hopper_run, hopper_demos, tmp_path, own, monkeypatch, words, told):
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    if "demos.hdf5" in words:
        hopper_demos.save("demos.hdf5")
        before.append(tmp_path / "demos.hdf5")
    if "cartpole.hdf5" in words:
        steps = np.zeros((2, 4), np.float32), [0, 1]
        agail.Demonstrations.from_arrays(*steps, environment="CartPole-v1").save("cartpole.hdf5")
        before.append(tmp_path / "cartpole.hdf5")
    done = video(hopper_run.folder, *words, **own)
    assert done.returncode == 2 and done.stdout == "", done
    assert len(done.stderr.splitlines()) == 1 and told in done.stderr, done.stderr
    assert sorted(tmp_path.iterdir()) == sorted(before)


def test_wrong_arguments(hopper_run, hopper_demos, tmp_path, monkeypatch):
    """The same from Python, before anything is drawn."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("agail.video.Player", None)
    wrong = (
        {"out": "x.avi"},
        {"episodes": 0},
        {"episodes": 7, "demonstrations": hopper_demos},
        {"fps": 0},
        {"fps": "25"},
        {"seed": -1},
        {"size": (321, 240)},
    )
    for arguments in wrong:
        with pytest.raises(agail.InputError):
            film(hopper_run.policy, **{"out": "x.mp4", **arguments})
    assert list(tmp_path.iterdir()) == []


def test_an_environment_with_its_own_spaces(tmp_path):
    """It is asked with its own observations and gets actions that are its own."""
    gymnasium.register("Shown-v0", Shown)
    policy = train("Shown-v0", method="trpo", timesteps=256).policy
    expected = agail.record(policy, 1, environment="Shown-v0")  # under other seeds
    assert len(expected[0]) == 20
    (total,) = film(policy, tmp_path / "x.gif", size=(64, 64))
    assert 0 <= total <= 20
    gymnasium.registry.pop("Shown-v0")


def test_no_policy(tmp_path):
    done = video(tmp_path, "--out", tmp_path / "x.mp4")
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1
    assert video(tmp_path).returncode == 2  # no --out


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_no_space(tmp_path, suffix):
    """Half a film is none; the one that was there stays."""
    run = train("CartPole-v1", method="trpo", timesteps=256)
    out = tmp_path / f"x{suffix}"
    out.write_text("the last one")
    done = video(run.folder, "--out", out, largest_file=4096)
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1, done
    assert list(tmp_path.iterdir()) == [out] and out.read_text() == "the last one"


def test_no_opengl(hopper_run, tmp_path):
    done = video(hopper_run.folder, "--out", tmp_path / "x.mp4", MUJOCO_GL="glfw", DISPLAY="")
    assert done.returncode == 2 and "apt-get install" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_states_that_observations_do_not_tell():
    with pytest.raises(agail.InputError, match="do not tell"):
        Placer(gymnasium.make("Pendulum-v1"))
