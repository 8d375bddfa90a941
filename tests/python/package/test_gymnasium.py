"""Gymnasium's environments in agail, and agail's in Gymnasium."""

import re
import subprocess
import sys
import time
from collections import Counter

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from small import Line, train

import agail
from agail import _core
from agail._source import Lane, Source

NATIVE = _core.environment_ids()


# --- Training on Gymnasium's environments -------------------------------------------------------


@pytest.mark.parametrize("name", ["Pendulum-v1", "Acrobot-v1", "MountainCarContinuous-v0"])
def test_trains_on(name):
    run = train(name, method="trpo", timesteps=2048, run={"batch_steps": 512})
    assert run.finished and run.policy.environment == name
    rows = run.metrics
    assert rows["time/total_timesteps"][-1] == 2048 and np.isfinite(rows["eval/mean_reward"][-1])
    result = agail.evaluate(run, 2)
    demos = agail.record(run, 2)
    assert demos.environment == name and len(demos) == 2
    limit = gymnasium.spec(name).max_episode_steps
    if name == "Pendulum-v1":  # never terminates
        assert result.lengths.tolist() == [limit, limit]
        assert demos[0].truncations[-1] and not demos[0].terminations.any()
    imitator = train(name, demos.mask(0.5), method="agail", timesteps=512)
    assert imitator.policy.demonstrations_mean_return == pytest.approx(demos.mean_return)


@pytest.mark.parametrize("continuous", [False, True])
def test_lunar_lander(continuous):
    """An environment of another package (Box2D), with a keyword that changes its actions."""

    def make():
        return gymnasium.make("LunarLander-v3", continuous=continuous)

    run = train(make, method="trpo", timesteps=2048, run={"batch_steps": 512})
    assert run.finished and run.policy.n_actions == (0 if continuous else 4)
    demos = agail.record(run, 2, environment=make)
    assert demos.environment == "LunarLander-v3" and demos.action_dim == (2 if continuous else 1)
    assert train(make, demos.mask(0.5), method="agail", timesteps=512).finished
    if not continuous:  # also by its id
        assert train("LunarLander-v3", demos.mask(0.5), method="bc", timesteps=1).finished


def test_learns_on_a_gymnasium_environment():
    """Gymnasium's CartPole, in Python, is learned as well as ours."""
    # Not by its id, which is ours.
    run = agail.train(lambda: gymnasium.make("CartPole-v1"), method="trpo", timesteps=25_000,
                      progress=False)  # fmt: skip
    assert np.nanmax(run.metrics["eval/mean_reward"]) > 300


def test_the_same_bits_for_any_threads():
    policies = [
        train("Pendulum-v1", method="trpo", lanes=4, threads=threads).policy for threads in (1, 3)
    ]
    rows = np.random.default_rng(0).normal(size=(20, 3))
    np.testing.assert_array_equal(*[policy.predict(rows)[0] for policy in policies])


def test_kinds_of_environments():
    """An instance, a factory and a vector environment are trained alike."""
    functions = [Line] * 2
    given = Line()
    kinds = [given, Line, gymnasium.vector.SyncVectorEnv(functions)]
    policies = [train(kind, method="trpo", lanes=2).policy for kind in kinds]
    assert {policy.environment for policy in policies} == {"Line"}
    rows = np.random.default_rng(0).normal(size=(20, 2))
    for policy in policies[1:]:
        np.testing.assert_array_equal(policies[0].predict(rows)[0], policy.predict(rows)[0])
    run = train(kinds[2], method="trpo")
    assert run.settings["run"]["lanes"] == 2
    given.step(np.zeros(1, np.float32))  # still the caller's, not closed


class Weighted(Line):
    """Counts the steps of each weight."""

    def __init__(self, weight, steps):
        super().__init__()
        self.weight, self.counted = weight, steps

    def __deepcopy__(self, memo):
        return Weighted(self.weight, self.counted)

    def step(self, action):
        self.counted[self.weight] += 1
        return super().step(action)


def test_a_vector_of_different_environments():
    steps = Counter()
    vector = gymnasium.vector.SyncVectorEnv([lambda w=w: Weighted(w, steps) for w in (1, 2)])
    train(vector, method="trpo", timesteps=512, run={"evaluate_every": 0})
    assert steps == {1: 256, 2: 256}


def test_an_instance_is_copied_as_it_is():
    steps = Counter()
    given = Weighted(1, steps)
    given.weight = 5
    train(given, method="trpo", lanes=2, timesteps=512)
    assert set(steps) == {5}
    changed = gymnasium.make("Pendulum-v1")
    changed.unwrapped.max_torque = 5
    source = Source(changed)
    torques = [source.lane(Lane)._environment.unwrapped.max_torque for _ in range(2)]
    assert torques == [5, 5]


def test_a_function_that_makes_one_environment_only():
    given = Line()
    with pytest.raises(agail.InputError, match="same environment twice"):
        train(lambda: given, method="trpo")
    vector = gymnasium.vector.SyncVectorEnv([Line])
    with pytest.raises(agail.InputError, match="same environment twice"):
        train(lambda: vector, method="trpo")


def test_share_of_less_than_nothing():
    run = train(Line, method="trpo")
    demos = agail.record(run, 3, environment=Line)
    imitator = train(Line, demos, method="bc")
    assert imitator.policy.demonstrations_mean_return == pytest.approx(demos.mean_return)
    assert demos.mean_return < 0
    assert agail.evaluate(imitator, 2, environment=Line).share_of_demonstrations is None


def test_vector_environment_that_cannot_be_taken_apart():
    vector = gymnasium.make_vec("agail/CartPole-v1", 2, vectorization_mode="vector_entry_point")
    with pytest.raises(agail.InputError, match="lanes=N"):
        train(vector, method="trpo")


def test_environments_that_were_made_are_closed():
    closed = []

    class Closing(Line):
        def close(self):
            closed.append(self)

    given = Closing()
    train(given, method="trpo", lanes=4)
    assert given not in closed and len(closed) == 4 and len(set(map(id, closed))) == 4


def test_resumed_run(tmp_path):
    """The state of such an environment cannot be saved: its episode begins anew."""
    train("Pendulum-v1", method="trpo", out=tmp_path / "run", callback=lambda row: False)
    run = train("Pendulum-v1", method="trpo", out=tmp_path / "run", resume=True)
    assert run.finished and run.metrics["time/total_timesteps"].tolist() == [256, 512, 768, 1024]


def broken(how, after=300):
    """An environment that fails in the step after so many."""

    class Broken(Line):
        total = 0

        def step(self, action):
            observation, reward, *ends, info = super().step(action)
            type(self).total += 1
            if type(self).total > after:
                if how == "raises":
                    raise ZeroDivisionError("the user's own")
                if how == "nan":
                    observation[1] = np.nan
                if how == "shape":
                    observation = np.zeros(3, np.float32)
                if how == "large":
                    observation = np.array([1e300, 1])
                if how == "reward":
                    reward = np.inf
                if how == "text":
                    observation = "observation"
                if how == "four":
                    return observation, reward, ends[0], info
            return observation, reward, *ends, info

    return Broken


@pytest.mark.parametrize(
    ("how", "told"),
    [
        ("raises", "step.. raised ZeroDivisionError after .* the user's own"),
        ("nan", "nan at index 1"),
        ("shape", r"shape \(3,\), but its observation_space has \(2,\)"),
        ("large", r"with 1e\+300 at index 0 .* too large for float32"),
        ("reward", "reward inf"),
        ("text", "observation of step"),
        ("four", "4 values in place of .observation, reward, terminated"),
    ],
)
def test_environments_with_bugs(tmp_path, how, told):
    kind, out = broken(how, after=1000), tmp_path / "run"
    options = {"method": "trpo", "out": out, "timesteps": 4096, "run": {"checkpoint_every": 1}}
    with pytest.raises(agail.InputError, match=f"environment Broken: .*{told}") as caught:
        train(kind, **options)
    if how == "raises":
        assert isinstance(caught.value.__cause__, ZeroDivisionError)
    run = agail.Run(out)
    steps = run.metrics["time/total_timesteps"]
    assert len(steps) >= 1 and not run.finished
    # Mended, it goes on from the last checkpoint.
    kind.step = Line.step
    resumed = train(kind, resume=True, **options)
    assert resumed.finished
    assert resumed.metrics["time/total_timesteps"].tolist() == list(range(256, 4097, 256))


def test_a_broken_environment_is_not_asked_again():
    run = train(Line, method="trpo")
    kind = broken("raises", after=0)
    kind.__name__ = "Line"
    with pytest.raises(agail.InputError, match="ZeroDivisionError"):
        agail.evaluate(run, 1000, environment=kind)
    assert kind.total == 1


class Unclosable(Line):
    closed = 0

    def close(self):
        type(self).closed += 1
        raise RuntimeError("the viewer is gone")


def test_close_that_fails_is_a_warning():
    with pytest.warns(RuntimeWarning, match=r"Unclosable: close\(\) raised .*viewer is gone"):
        run = train(Unclosable, method="trpo", lanes=2)
    assert run.finished and Unclosable.closed == 3  # two lanes and one to evaluate in

    class Worse(Unclosable):
        def step(self, action):
            raise ZeroDivisionError("the cause")

    with (
        pytest.warns(RuntimeWarning, match="viewer is gone"),
        pytest.raises(agail.InputError, match="the cause"),
    ):
        train(Worse, method="trpo")


def test_batches_fit_the_lanes_of_a_vector():
    vector = gymnasium.vector.SyncVectorEnv([Line] * 3)
    options = {"method": "trpo", "timesteps": 1, "progress": False}
    assert agail.train(vector, **options).settings["run"]["batch_steps"] == 1023
    with pytest.raises(agail.InputError, match=r"run\.batch_steps = 256 .*choose a multiple"):
        train(vector, method="trpo")


def test_bug_at_the_first_reset(tmp_path):
    class Broken(Line):
        def reset(self, **options):
            raise ValueError("no")

    with pytest.raises(agail.InputError, match=r"reset.. raised ValueError"):
        train(Broken, method="trpo", out=tmp_path / "run")


def test_a_factory_that_makes_nothing():
    with pytest.raises(agail.InputError, match=r"no gymnasium\.Env"):
        train(lambda: 3, method="trpo")


# --- The command line ---------------------------------------------------------------------------


def command(*words, **options):
    words = [sys.executable, "-m", "agail", *map(str, words)]
    return subprocess.run(words, capture_output=True, text=True, timeout=300, **options)


def test_command_line_takes_registered_ids(tmp_path):
    run = tmp_path / "run"
    done = command("train", "Pendulum-v1", "--method", "trpo", "--out", run, "--timesteps", 2048,
                   "--set=run.evaluation_episodes=1")  # fmt: skip
    assert done.returncode == 0 and done.stdout.startswith(f"{run}: mean return"), done.stderr
    done = command("eval", run, "--episodes", 2, "--json")
    assert done.returncode == 0 and '"environment": "Pendulum-v1"' in done.stdout
    done = command("record", run, "--episodes", 2, "--out", tmp_path / "demos.hdf5")
    assert done.returncode == 0 and "Pendulum-v1" in done.stdout
    done = command("inspect", tmp_path / "demos.hdf5")
    assert done.returncode == 0 and "Pendulum-v1" in done.stdout


def test_command_line_is_the_same():
    assert command("envs").stdout.count("\n") == len(NATIVE) + 1
    assert command("--version").stdout == f"agail {agail.__version__}\n"
    for words in (["trian"], ["train", "Pendulm-v1", "--method", "trpo", "--out", "x"],
                  ["eval", "absent"], ["inspect", "absent"]):  # fmt: skip
        done = command(*words)
        assert done.returncode == 2 and done.stdout == ""
        assert len(done.stderr.splitlines()) == 1 and done.stderr.startswith("agail: ")


def test_command_line_with_a_bug_in_the_environment(tmp_path):
    (tmp_path / "mine.py").write_text(
        "import gymnasium\nclass Bad(gymnasium.Env):\n"
        "  observation_space = gymnasium.spaces.Box(-1, 1, (2,))\n"
        "  action_space = gymnasium.spaces.Discrete(2)\n"
        "  def reset(self, seed=None, options=None): raise ValueError('bug')\n"
        "gymnasium.register('Bad-v0', Bad)\n"
    )
    words = ["train", "mine:Bad-v0", "--method", "trpo", "--out", "run"]
    done = command(*words, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert "reset() raised ValueError" in done.stderr.splitlines()[-1]
    assert done.stderr.splitlines()[-1].startswith("agail: environment mine:Bad-v0")


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("Pendulum-v9", "versioned environments: .* `v1`"),
        ("ALE/Pong-v5", "ALE not found"),
        ("Hoper-v5", "did you mean 'Hopper-v5'"),
        ("broken_module:Own-v0", "importing broken_module raised ValueError: bad"),
    ],
)
def test_ids_that_nobody_has(tmp_path, name, told):
    (tmp_path / "broken_module.py").write_text("raise ValueError('bad')\n")
    done = command("train", name, "--method", "trpo", "--out", "run", cwd=tmp_path)
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1, done.stderr
    assert re.search(told, done.stderr) and "'Ant" not in done.stderr


# --- agail's environments in Gymnasium ----------------------------------------------------------


@pytest.mark.parametrize("name", NATIVE)
@pytest.mark.filterwarnings("ignore:.*render")
def test_passes_gymnasiums_checker(name):
    environment = gymnasium.make(f"agail/{name}")
    check_env(environment.unwrapped, skip_render_check=True)
    reference = gymnasium.spec(name)
    assert environment.spec.max_episode_steps == reference.max_episode_steps
    environment.close()


def test_native_episode():
    environment = gymnasium.make("agail/CartPole-v1")
    first, _ = environment.reset(seed=3)
    second, _ = environment.reset()
    third, _ = environment.reset(seed=3)
    np.testing.assert_array_equal(first, third)
    assert not np.array_equal(first, second) and first.dtype == np.float32
    ended = False
    for _ in range(500):
        _, reward, ended, *_ = environment.step(1)
        assert reward == 1
        if ended:
            break
    assert ended


@pytest.mark.parametrize("name", ["CartPole-v1", "Hopper-v5"])
def test_vector_is_its_environments(name):
    """As Gymnasium's SyncVectorEnv of the single ones, autoreset included."""
    count, threads = 3, 2
    ours = gymnasium.make_vec(f"agail/{name}", count, vectorization_mode="vector_entry_point",
                              threads=threads)  # fmt: skip
    assert ours.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    single = [lambda: gymnasium.make(f"agail/{name}")] * count
    theirs = gymnasium.vector.SyncVectorEnv(single, autoreset_mode=AutoresetMode.NEXT_STEP)
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    seeds = [5, 6, 7]
    np.testing.assert_array_equal(ours.reset(seed=seeds)[0], theirs.reset(seed=seeds)[0])
    theirs.action_space.seed(0)
    resets = 0
    for _ in range(200):
        actions = theirs.action_space.sample()
        mine, reference = ours.step(actions), theirs.step(actions)
        for a, b in zip(mine[:4], reference[:4]):
            np.testing.assert_array_equal(a, b)
            assert a.dtype == b.dtype
        assert ours.observation_space.contains(mine[0])
        resets += int(mine[2].sum())
    assert resets > 3
    same = [ours.reset(seed=9)[0] for _ in range(2)]
    np.testing.assert_array_equal(*same)
    assert len(np.unique(same[0], axis=0)) == count
    # None: that environment goes on with the numbers that it has.
    for seeds in ([5, 6, 7], [None] * count, [None, 9, None], [None] * count):
        np.testing.assert_array_equal(ours.reset(seed=seeds)[0], theirs.reset(seed=seeds)[0])


def test_vector_is_asked_for_what_it_has_not():
    many = gymnasium.make_vec("agail/CartPole-v1", 4, vectorization_mode="vector_entry_point")
    with pytest.raises(agail.InputError, match="2 seeds for 4 environments"):
        many.reset(seed=[1, 2])
    with pytest.raises(agail.InputError, match="1 entries of reset_mask for 4"):
        many.reset(options={"reset_mask": np.array([True])})
    options = {"vectorization_mode": "vector_entry_point"}
    with pytest.raises(agail.InputError, match="num_envs is 0"):
        gymnasium.make_vec("agail/CartPole-v1", 0, **options)
    for threads in (0, -1):
        with pytest.raises(agail.InputError, match=f"threads = {threads} should be"):
            gymnasium.make_vec("agail/CartPole-v1", 2, **options, threads=threads)
    many.reset(seed=0)
    with pytest.raises(agail.InputError, match=r"no action 0\.5"):
        many.step(np.array([0, 0.5, 1, 0]))


def test_vector_is_fast():
    count = 64
    ours = gymnasium.make_vec("agail/CartPole-v1", count, vectorization_mode="vector_entry_point")
    theirs = gymnasium.make_vec("CartPole-v1", count, vectorization_mode="sync")

    def seconds(vector):
        vector.reset(seed=0)
        actions = np.zeros(count, np.int64)
        vector.step(actions)
        begin = time.perf_counter()
        for _ in range(50):
            vector.step(actions)
        return time.perf_counter() - begin

    assert seconds(ours) < seconds(theirs) / 3
