"""agail's environments against Gymnasium's: specs, compiled models, single steps, resets.

Needs AGAIL_BUILD_DIR, the build folder (build/release), for its tests/env_probe. `pytest -s` prints the largest
differences.

Both sides get the same full integration state before every single step. Over many steps a comparison would say little:
contact dynamics amplify any difference.
"""

import os
import pathlib
import subprocess
import warnings

import gymnasium
import mujoco
import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = os.environ.get("AGAIL_BUILD_DIR") and pathlib.Path(os.environ["AGAIL_BUILD_DIR"]).resolve()
INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION
STATES = 1000

MODELS = {  # our file: an environment whose model it must equal
    "hopper": ["Hopper-v4", "Hopper-v5"],
    "walker2d_v4": ["Walker2d-v4"],
    "walker2d_v5": ["Walker2d-v5"],
    "humanoid": ["Humanoid-v4", "Humanoid-v5"],
    "half_cheetah": ["HalfCheetah-v4", "HalfCheetah-v5"],
    "ant": ["Ant-v4", "Ant-v5"],
    "swimmer": ["Swimmer-v4", "Swimmer-v5"],
}
LOCOMOTION = [id for ids in MODELS.values() for id in ids]
CARTPOLE = ["CartPole-v0", "CartPole-v1"]

# Differences allowed in observation and reward; 0 means the same bits.
TOLERANCE = dict.fromkeys(LOCOMOTION, 0.0)
# NumPy's sine and cosine are not those of the C library on every CPU (SIMD versions, 1 ulp apart).
TOLERANCE |= dict.fromkeys(CARTPOLE, 1e-12)


def probe(*arguments, stdin=b""):
    if not BUILD:
        pytest.fail("set AGAIL_BUILD_DIR to the build folder, e.g. build/release")
    command = [BUILD / "tests" / "env_probe", *arguments]
    return subprocess.run(command, input=stdin, stdout=subprocess.PIPE, check=True).stdout


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """MuJoCo's Python package writes MUJOCO_LOG.TXT into the working directory."""
    monkeypatch.chdir(tmp_path)


def make(id):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # v4 environments, CartPole-v0: "out of date"
        return gymnasium.make(id)


def parse_specs():
    specs = {}
    for line in probe("specs").decode().splitlines():
        id, *words = line.split()
        observation, float32, discrete, action, limit, saved = map(int, words[:6])
        bounds = np.array(words[6:], dtype=np.float32)
        specs[id] = dict(
            observation=observation,
            float32=bool(float32),
            discrete=bool(discrete),
            action=action,
            limit=limit,
            saved=saved,
            low=bounds[: len(bounds) // 2],
            high=bounds[len(bounds) // 2 :],
        )
    return specs


@pytest.fixture(scope="module")
def specs():
    return parse_specs()


@pytest.fixture(scope="module")
def report():
    rows = []
    yield rows
    print(
        f"\n{'environment':16} {'states':>7} {'ended':>6} {'max |obs diff|':>15} {'max |reward diff|':>18} same bits"
    )
    for row in rows:
        print("{:16} {:7} {:6} {:15.3g} {:18.3g} {}".format(*row))


def test_every_environment_is_compared(specs):
    assert set(specs) == set(LOCOMOTION + CARTPOLE)


@pytest.mark.parametrize("id", CARTPOLE + LOCOMOTION)
def test_spec(id, specs):
    assert id in gymnasium.registry, (
        "all ids, the old v0 and v4 among them, are registered in Gymnasium 1.4"
    )
    env, ours = make(id), specs[id]
    assert env.observation_space.shape == (ours["observation"],)
    assert env.observation_space.dtype == (np.float32 if ours["float32"] else np.float64)
    assert env.spec.max_episode_steps == ours["limit"]
    if ours["discrete"]:
        assert env.action_space == gymnasium.spaces.Discrete(ours["action"])
    else:
        assert env.action_space == gymnasium.spaces.Box(ours["low"], ours["high"], dtype=np.float32)
        assert env.action_space.shape == (ours["action"],)


# --- Models -----------------------------------------------------------------------------------------------------------

# Not physics: names, how things look (materials, textures, lights, cameras, colours), data that nothing reads
# (keyframes that Humanoid declares but leaves empty, a number per geom, Ant's `init_qpos`), and the sizes of all that.
NOT_PHYSICS = (
    "name", "names", "nnames", "paths", "npaths", "mat_", "nmat", "tex_", "ntex", "light_", "nlight", "cam_", "ncam",
    "geom_rgba", "geom_matid", "geom_user", "nuser_geom", "site_rgba", "skin_", "key_", "nkey", "numeric_", "nnumeric",
    "nbuffer", "signature", "vis.",
)  # fmt: skip


def numbers(model):
    """All numeric fields by name, those of the nested opt, stat and vis, too."""
    found = {}

    def collect(thing, prefix, depth):
        for name in dir(thing):
            if name.startswith("_"):
                continue
            value = getattr(thing, name)
            if isinstance(value, (bool, int, float, np.ndarray)):
                found[prefix + name] = np.asarray(value)
            elif depth < 1 and name in ("opt", "stat", "vis"):
                collect(value, prefix + name + ".", depth + 1)

    collect(model, "", 0)
    return found


@pytest.mark.parametrize("name,id", [(name, id) for name, ids in MODELS.items() for id in ids])
def test_model_fields(name, id):
    ours = numbers(mujoco.MjModel.from_xml_path(str(ROOT / "models" / f"{name}.xml")))
    theirs = numbers(make(id).unwrapped.model)
    assert set(ours) == set(theirs)
    physics = [field for field in sorted(theirs) if not field.startswith(NOT_PHYSICS)]
    assert len(physics) > 300 and {
        "body_mass",
        "geom_friction",
        "opt.timestep",
        "stat.meaninertia",
    } <= set(physics)
    different = [
        field
        for field in physics
        if ours[field].shape != theirs[field].shape
        or ours[field].tobytes() != theirs[field].tobytes()
    ]
    assert different == []


def test_models_are_all_compared():
    assert {path.stem for path in (ROOT / "models").glob("*.xml")} == set(MODELS)


# --- Steps ------------------------------------------------------------------------------------------------------------


def integration_state(env):
    state = np.empty(mujoco.mj_stateSize(env.model, INTEGRATION))
    mujoco.mj_getState(env.model, env.data, state, INTEGRATION)
    return state


def progress(id, env):
    """The x by which Gymnasium measures progress before a step."""
    if id.startswith("Humanoid"):
        num = np.einsum("b,bj->j", env.model.body_mass, env.data.xipos)
        return (num / env.model.body_mass.sum())[0]
    return env.data.xpos[1, 0] if id.startswith("Ant") else env.data.qpos[0]


def draw_action(env, random):
    space = env.action_space
    scale = random.choice([0.0, 0.3, 1.0, 1.0, 3.0])  # 3: out of bounds
    return (scale * random.uniform(space.low, space.high)).astype(np.float32)


def locomotion_cases(id, spec, random):
    """Saved states, actions, and Gymnasium's observation, reward, terminated of that step."""
    env = make(id).unwrapped
    states, actions, outcomes = [], [], []
    while len(states) < STATES:
        if len(states) % 40 == 0:  # a trajectory of 40 steps, past termination
            env.reset(seed=len(states))
            kind = len(states) // 40 % 3
        elif kind == 1 or (
            kind == 2 and len(states) % 8 == 0
        ):  # away from where the trajectory goes
            state = integration_state(env)
            scale = 10 ** random.uniform(-3, 0.3)
            span = slice(1, 1 + env.model.nq + env.model.nv)
            state[span] += scale * random.standard_normal(env.model.nq + env.model.nv)
            mujoco.mj_setState(env.model, env.data, state, INTEGRATION)
            # The derived quantities of this state; the forward pass moves the solver's warm start, so set it again.
            mujoco.mj_forward(env.model, env.data)
            mujoco.mj_setState(env.model, env.data, state, INTEGRATION)
        before = np.concatenate(
            [[random.integers(900)], [progress(id, env)], integration_state(env), env._get_obs()]
        )
        action = draw_action(env, random)
        observation, reward, terminated, truncated, _ = env.step(action)
        if (
            any(env.data.warning[w].number for w in range(len(env.data.warning)))
            or not np.isfinite(observation).all()
        ):
            env.reset(seed=len(states))  # the simulation broke down: nothing to compare
            continue
        states.append(before)
        actions.append(action)
        outcomes.append((observation, reward, terminated))
        assert before.size == spec["saved"] and not truncated
    return states, actions, outcomes


def cartpole_cases(id, spec, random):
    env = make(id).unwrapped
    env.reset(seed=0)
    states, actions, outcomes = [], [], []
    for i in range(STATES):
        if i % 40 == 0:
            env.reset(seed=i)
            env.state = np.array(env.state) * 10 ** random.uniform(-1, 1.5)
        ended = float(env.steps_beyond_terminated is not None)
        states.append(np.concatenate([[0], env.state, [ended]]))
        actions.append(np.array([random.integers(2)]))
        observation, reward, terminated, _, _ = env.step(actions[-1][0])
        outcomes.append((observation, reward, terminated))
    return states, actions, outcomes


def our_steps(id, spec, states, actions):
    records = b"".join(
        np.asarray(np.concatenate(pair), np.float64).tobytes() for pair in zip(states, actions)
    )
    return np.frombuffer(probe("step", id, stdin=records)).reshape(
        len(states), spec["observation"] + 4
    )


@pytest.mark.parametrize("id", CARTPOLE + LOCOMOTION)
def test_single_steps(id, specs, report):
    spec = specs[id]
    cases = cartpole_cases if id in CARTPOLE else locomotion_cases
    gymnasium.logger.min_level = gymnasium.logger.ERROR  # steps past termination are meant
    states, actions, outcomes = cases(id, spec, np.random.default_rng(1))
    ours = our_steps(id, spec, states, actions)
    observations = np.array([np.asarray(observation, np.float64) for observation, _, _ in outcomes])
    rewards = np.array([np.float64(reward) for _, reward, _ in outcomes])
    ended = np.array([terminated for _, _, terminated in outcomes])

    n = spec["observation"]
    observation_difference = np.abs(ours[:, :n] - observations).max()
    reward_difference = np.abs(ours[:, n] - rewards).max()
    same = np.array_equal(ours[:, :n], observations) and np.array_equal(ours[:, n], rewards)
    report.append(
        (
            id,
            len(states),
            int(ended.sum()),
            observation_difference,
            reward_difference,
            "yes" if same else "no",
        )
    )
    assert observation_difference <= TOLERANCE[id]
    assert reward_difference <= TOLERANCE[id]
    assert np.array_equal(ours[:, n + 1], ended)
    assert not ours[:, n + 2 :].any(), "neither truncated nor diverged"
    assert (
        not id.startswith(("Hopper", "Walker", "Humanoid", "Ant", "CartPole"))
        or 0 < ended.sum() < STATES
    )


@pytest.mark.parametrize("id", CARTPOLE + LOCOMOTION)
def test_time_limit(id, specs):
    """The step that reaches the limit is truncated, in Gymnasium's wrapper and in ours."""
    spec, env = specs[id], make(id)
    env.reset(seed=0)
    saved = np.frombuffer(probe("reset", id, stdin=np.float64(1).tobytes())).copy()
    still = np.zeros(env.action_space.shape or 1, np.float32)
    for elapsed in (spec["limit"] - 2, spec["limit"] - 1):
        limiter = env
        while not isinstance(limiter, gymnasium.wrappers.TimeLimit):
            limiter = limiter.env
        limiter._elapsed_steps = elapsed
        truncated = env.step(still if env.action_space.shape else 0)[3]
        saved[0] = elapsed
        assert our_steps(id, spec, [saved], [still])[0, spec["observation"] + 2] == truncated
        assert truncated == (elapsed == spec["limit"] - 1)


@pytest.mark.parametrize("id", LOCOMOTION)
def test_reset_is_gymnasiums_of_the_same_noise(id, specs):
    """The random numbers differ; the state, the observation and the progress that follow from qpos and qvel do not."""
    env = make(id).unwrapped
    saved_states = np.frombuffer(probe("reset", id, stdin=np.arange(20.0).tobytes())).reshape(
        20, -1
    )
    for saved in saved_states:
        state = saved[2 : len(saved) - specs[id]["observation"]]
        mujoco.mj_resetData(env.model, env.data)
        qpos, qvel = np.split(state[1 : 1 + env.model.nq + env.model.nv], [env.model.nq])
        env.set_state(qpos, qvel)
        assert saved[0] == 0
        assert saved[1] == progress(id, env)
        assert np.array_equal(saved[-specs[id]["observation"] :], env._get_obs())
        assert np.array_equal(state, integration_state(env))


@pytest.mark.parametrize("id", CARTPOLE + LOCOMOTION)
def test_reset_noise_has_gymnasiums_distribution(id, specs):
    """Bounds and standard deviation of 2,000 resets, each coordinate pooled with its kind."""
    n = 2000
    saved = np.frombuffer(probe("reset", id, stdin=np.arange(float(n)).tobytes())).reshape(n, -1)
    env = make(id).unwrapped
    if id in CARTPOLE:
        groups = [(saved[:, 1:5], np.array([env.reset(seed=i)[0] for i in range(n)]))]
    else:
        nq, nv = env.model.nq, env.model.nv
        theirs = []
        for i in range(200):
            env.reset(seed=i)
            theirs.append(np.concatenate([env.data.qpos - env.init_qpos, env.data.qvel]))
        theirs, ours = (
            np.array(theirs),
            saved[:, 3 : 3 + nq + nv] - np.concatenate([env.init_qpos, np.zeros(nv)]),
        )
        groups = [(ours[:, :nq], theirs[:, :nq]), (ours[:, nq:], theirs[:, nq:])]
    for ours, theirs in groups:
        assert ours.std() == pytest.approx(theirs.std(), rel=0.08)
        assert abs(ours.mean()) < 0.05 * ours.std()
        # Uniform: fourth moment over squared variance is 1.8; normal: 3.
        kurtosis = [((x - x.mean()) ** 4).mean() / x.var() ** 2 for x in (ours, theirs)]
        assert kurtosis[0] == pytest.approx(kurtosis[1], rel=0.15)
