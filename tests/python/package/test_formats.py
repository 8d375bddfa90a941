"""Demonstrations in other projects' formats: there and back, files as these projects write them, and broken ones."""

import json
from types import SimpleNamespace

import h5py
import numpy as np
import pandas
import pyarrow
import pyarrow.parquet
import pytest
from same import same

import agail
from agail import Demonstrations

STATE = "observation.state"


@pytest.fixture
def cartpole():
    """Discrete actions of which some are missing, observations of 32 bits, both kinds of ends."""
    random = np.random.default_rng(1)
    return Demonstrations.from_arrays(
        random.normal(size=(20, 4)).astype(np.float32),
        random.integers(0, 2, 20),
        episodes=np.repeat([0, 1], 10),
        rewards=np.ones(20),
        terminations=np.arange(20) == 9,
        action_available=random.random(20) < 0.7,
        environment="CartPole-v1",
    )


@pytest.fixture
def kinds(hopper_demos, cartpole):
    return {
        "complete": hopper_demos,
        "steps missing": hopper_demos.mask(0.5),
        "dimension missing": hopper_demos.mask(1 / 3, "dimension"),
        "discrete": cartpole,
    }


KINDS = ["complete", "steps missing", "dimension missing", "discrete"]


def equal(one, other):
    """Also what only a file shows: types, ends, the environment."""
    same(one, other)
    assert one.environment == other.environment and one.missing_ratio == other.missing_ratio
    for a, b in zip(one, other):
        np.testing.assert_array_equal(a.truncations, b.truncations)
    first, second = one.to_arrays(), other.to_arrays()
    assert {name: v.dtype for name, v in first.items()} == {n: v.dtype for n, v in second.items()}


# --- There and back -----------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_arrays(kinds, kind):
    demos = kinds[kind]
    arrays = demos.to_arrays()
    equal(demos, Demonstrations.from_arrays(**arrays, environment=demos.environment))
    assert len(arrays["observations"]) == demos.transitions


@pytest.mark.parametrize("kind", KINDS)
def test_npz(kinds, kind, tmp_path, program):
    """numpy's file of them is one that `agail convert` reads, and from_arrays()."""
    demos = kinds[kind]
    np.savez(tmp_path / "a.npz", **demos.to_arrays())
    with np.load(tmp_path / "a.npz") as file:
        equal(demos, Demonstrations.from_arrays(**file, environment=demos.environment))
    program("convert", tmp_path / "a.npz", "--env", demos.environment, "--out", tmp_path / "a.hdf5")
    equal(demos, Demonstrations.load(tmp_path / "a.hdf5"))


@pytest.mark.parametrize("kind", KINDS)
def test_csv(kinds, kind, tmp_path, program):
    """The columns that `agail convert` reads, as pandas writes them."""
    demos = kinds[kind]
    arrays = demos.to_arrays()
    table = {}
    for name, title in (("observations", "obs"), ("next_observations", "next_obs")):
        table |= {f"{title}_{i}": column for i, column in enumerate(arrays[name].T)}
    actions = arrays["actions"].reshape(demos.transitions, -1).astype(object)
    if "action_available" in arrays:
        actions[~arrays["action_available"]] = None
    table |= {f"action_{i}": column for i, column in enumerate(actions.T)}
    table |= {"reward": arrays["rewards"], "terminated": arrays["terminations"].astype(int),
              "truncated": arrays["truncations"].astype(int), "episode": arrays["episodes"]}  # fmt: skip
    pandas.DataFrame(table).to_csv(tmp_path / "a.csv", index=False)
    program("convert", tmp_path / "a.csv", "--env", demos.environment, "--out", tmp_path / "a.hdf5")
    equal(demos, Demonstrations.load(tmp_path / "a.hdf5"))


@pytest.mark.parametrize("kind", KINDS)
def test_d4rl(kinds, kind, tmp_path):
    demos = kinds[kind]
    demos.to_d4rl(tmp_path / "d.hdf5")
    equal(demos, Demonstrations.from_d4rl(tmp_path / "d.hdf5", environment=demos.environment))
    assert [each.name for each in tmp_path.iterdir()] == ["d.hdf5"]
    with h5py.File(tmp_path / "d.hdf5") as file:
        assert len(file["terminals"]) == len(file["observations"]) == demos.transitions


@pytest.mark.parametrize("kind", KINDS)
def test_lerobot(kinds, kind, tmp_path):
    demos = kinds[kind]
    demos.to_lerobot(tmp_path / "dataset")
    read = Demonstrations.from_lerobot(tmp_path / "dataset", environment=demos.environment)
    assert read.mean_return == pytest.approx(demos.mean_return, rel=1e-5)
    # next.reward has 32 bits; all else is the same.
    arrays = {**read.to_arrays(), "rewards": demos.to_arrays()["rewards"]}
    equal(demos, Demonstrations.from_arrays(**arrays, environment=demos.environment))
    with pytest.raises(agail.InputError, match="exists already"):
        demos.to_lerobot(tmp_path / "dataset")


def trajectories(demos):
    """As `imitation` has them; its own are in test_peers.py."""
    result = []
    for episode in demos:
        infos = [{} for _ in range(len(episode))]
        infos[-1] = {"TimeLimit.truncated": bool(episode.truncations[-1])}
        result.append(SimpleNamespace(obs=episode.observations, acts=episode.actions.astype(np.float32),
                                      rews=episode.rewards, infos=infos, terminal=True))  # fmt: skip
    return result


@pytest.mark.parametrize("kind", KINDS[:3])
def test_trajectories(kinds, kind):
    demos = kinds[kind]
    equal(demos, Demonstrations.from_trajectories(trajectories(demos), environment="Hopper-v5"))


def test_trajectories_of_shapes_and_without_rewards():
    one = SimpleNamespace(obs=np.zeros((4, 2, 3)), acts=np.zeros((3, 2, 2)), infos=None,
                          terminal=False)  # fmt: skip
    demos = Demonstrations.from_trajectories([one, one])
    assert (demos.observation_dim, demos.action_dim, demos.mean_return) == (6, 4, None)
    assert demos[1].truncations.tolist() == [False, False, True]
    one.acts, one.terminal = np.array([2, 0, 1]), True
    demos = Demonstrations.from_trajectories([one])
    assert demos[0].actions[:, 0].tolist() == [2, 0, 1] and demos[0].terminations[-1]


# --- As others write them -----------------------------------------------------------------------


def d4rl(path, **changes):
    """Two episodes as D4RL's gym datasets have them: one ends in a terminal state, one at the time limit."""
    random = np.random.default_rng(0)
    arrays = {
        "observations": random.normal(size=(12, 11)).astype(np.float32),
        "actions": random.uniform(-1, 1, (12, 3)).astype(np.float32),
        "rewards": np.arange(12, dtype=np.float32),
        "terminals": np.arange(12) == 4,
        "timeouts": np.arange(12) == 11,
        "infos/qpos": np.zeros((12, 6)),
        "metadata/algorithm": "SAC",
    } | changes
    with h5py.File(path, "w") as file:
        for name, value in arrays.items():
            if value is not None:
                file[name] = value
    return arrays


def test_a_file_of_d4rl(tmp_path):
    arrays = d4rl(tmp_path / "d.hdf5")
    demos = Demonstrations.from_d4rl(tmp_path / "d.hdf5", environment="Hopper-v5")
    assert [len(episode) for episode in demos] == [4, 6]
    np.testing.assert_array_equal(demos[0].observations, arrays["observations"][:5])
    np.testing.assert_array_equal(demos[1].actions, arrays["actions"][5:11])
    np.testing.assert_array_equal(demos[1].rewards, arrays["rewards"][5:11])
    assert demos[0].terminations[-1] and not demos[0].truncations.any()
    assert demos[1].truncations[-1] and not demos[1].terminations.any()
    arrays["actions"][6, 1] = np.nan
    d4rl(tmp_path / "d.hdf5", actions=arrays["actions"])
    demos = Demonstrations.from_d4rl(tmp_path / "d.hdf5")
    assert demos[1].available[1].tolist() == [True, False, True]
    d4rl(tmp_path / "d.hdf5", actions=None, rewards=None)
    demos = Demonstrations.from_d4rl(tmp_path / "d.hdf5", environment="Hopper-v5")
    assert demos.missing_ratio == 1 and demos.mean_return is None


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"observations": None}, "no observations but actions"),
        ({"observations": np.zeros((0, 11))}, "no rows"),
        ({"observations": np.zeros(12)}, "shape"),
        ({"observations": np.full((12, 11), np.nan)}, "only actions may be missing"),
        ({"observations": np.array([b"a"] * 12)}, "not numbers"),
        ({"actions": np.zeros((11, 3))}, "11 actions and 12 observations"),
        ({"actions": np.zeros((12, 2))}, "2 action columns"),
        ({"actions": np.full((12, 3), np.inf)}, "infinite actions"),
        ({"rewards": np.zeros((12, 2))}, "rewards have the shape"),
        ({"rewards": np.full(12, np.nan)}, "reward in row 0"),
        ({"timeouts": np.zeros(3)}, "timeouts have the shape"),
        ({"timeouts": None}, "neither timeouts nor next_observations"),
        ({"terminals": np.full(12, 3)}, "neither 0 nor 1"),
        ({"terminals": np.arange(12) == 0}, "single row"),
        ({"next_observations": np.zeros((12, 11))}, "next observation"),
        ({"observations": None, "observations/a": 1}, "group"),
        ({"episode_0/observations": np.zeros((3, 11))}, "Minari"),
    ],
    ids=str,
)
def test_broken_files_of_d4rl(tmp_path, changes, told):
    path = tmp_path / "d.hdf5"
    d4rl(path, **changes)
    with pytest.raises(agail.InputError, match=told) as caught:
        Demonstrations.from_d4rl(path, environment="Hopper-v5")
    assert "\n" not in str(caught.value) and str(path) in str(caught.value)


def test_what_is_no_file_of_d4rl(tmp_path):
    for name, text in (("absent", None), ("text", "observations")):
        if text:
            (tmp_path / name).write_text(text)
        with pytest.raises(agail.InputError, match=f"{name} (is no file|cannot be read as HDF5)"):
            Demonstrations.from_d4rl(tmp_path / name)


def frames(lengths=(5, 7), **changes):
    """As LeRobot's recordings: no final state, no rewards; fixed-size lists, float32."""
    random = np.random.default_rng(0)
    count = sum(lengths)
    fixed = pyarrow.FixedSizeListArray.from_arrays
    columns = {
        STATE: fixed(pyarrow.array(random.normal(size=count * 3).astype(np.float32)), 3),
        "action": fixed(pyarrow.array(random.normal(size=count * 2).astype(np.float32)), 2),
        "timestamp": np.arange(count, dtype=np.float32),
        "frame_index": np.concatenate([np.arange(length) for length in lengths]),
        "episode_index": np.repeat(np.arange(len(lengths)), lengths),
        "index": np.arange(count),
        "task_index": np.zeros(count, np.int64),
    } | changes
    return pyarrow.table({name: value for name, value in columns.items() if value is not None})


def dataset(folder, tables, name="file-{:03d}.parquet"):
    (folder / "data/chunk-000").mkdir(parents=True, exist_ok=True)
    for i, table in enumerate(tables):
        pyarrow.parquet.write_table(table, folder / "data/chunk-000" / name.format(i))
    return folder


def test_datasets_of_lerobot(tmp_path):
    table = frames()
    v3 = Demonstrations.from_lerobot(dataset(tmp_path / "v3", [table]))
    assert [len(episode) for episode in v3] == [4, 6]
    state = np.array(table[STATE].to_pylist())
    np.testing.assert_array_equal(v3[1].observations, state[5:])
    np.testing.assert_array_equal(v3[1].actions, np.array(table["action"].to_pylist())[5:11])
    assert all(episode.truncations[-1] and episode.rewards is None for episode in v3)
    assert v3.to_arrays()["observations"].dtype == np.float32
    parts = [table.slice(0, 5), table.slice(5)]
    v2 = dataset(tmp_path / "v2", parts, "episode_{:06d}.parquet")
    same(v3, Demonstrations.from_lerobot(v2))
    one = Demonstrations.from_lerobot(v2 / "data/chunk-000/episode_000001.parquet")
    same(v3[1:], one)
    shuffled = table.take(np.random.default_rng(0).permutation(12))
    same(v3, Demonstrations.from_lerobot(dataset(tmp_path / "shuffled", [shuffled])))


def test_missing_actions_of_lerobot(tmp_path):
    """A null, a null in the list, and NaN; lists of any length."""
    values = [[0.5, 1.0]] * 12
    values[0], values[1], values[2] = None, [None, 1.0], [0.5, np.nan]
    for kind in (pyarrow.list_(pyarrow.float32()), pyarrow.list_(pyarrow.float32(), 2)):
        actions = pyarrow.array(values, kind)
        folder = dataset(tmp_path / str(kind), [frames(action=actions)])
        known = Demonstrations.from_lerobot(folder)[0].available
        assert known.tolist() == [[False, False], [False, True], [True, False], [True, True]]
    discrete = pyarrow.array([1, None, 0] * 4)
    demos = Demonstrations.from_lerobot(dataset(tmp_path / "n", [frames(action=discrete)]))
    assert demos[0].available[:, 0].tolist() == [True, False, True, True]
    assert (
        demos[0].actions[:, 0].tolist() == [1, 0, 0, 1] and demos.to_arrays()["actions"].ndim == 1
    )
    nulls = pyarrow.array([None] * 12, pyarrow.list_(pyarrow.float32()))
    for i, absent in enumerate([None, nulls, pyarrow.nulls(12)]):
        demos = Demonstrations.from_lerobot(dataset(tmp_path / f"none{i}", [frames(action=absent)]))
        assert demos.action_dim == 0


LISTS = pyarrow.array([[1.0, 2.0]] * 11 + [[1.0]])


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({STATE: None}, "no column observation.state but action"),
        ({"episode_index": None}, "no column episode_index"),
        ({STATE: LISTS}, "1 to 2 numbers in a frame"),
        ({STATE: pyarrow.array(["a"] * 12)}, "no array of numbers|not numbers"),
        ({STATE: pyarrow.array([[1.0, None]] * 12)}, "only actions may be missing"),
        ({STATE: pyarrow.array([[[1.0]]] * 12)}, "no array of numbers|not numbers|dimensions"),
        ({"action": pyarrow.array([[np.inf]] * 12)}, "infinite actions"),
        ({"action": LISTS}, "1 to 2 numbers in a frame"),
        ({"frame_index": np.zeros(12, np.int64)}, "frame 0 after frame 0"),
        ({"next.reward": pyarrow.array([None] * 12, pyarrow.float32())}, "reward in row 0"),
        ({"next.reward": LISTS}, "1 to 2 numbers"),
        ({"next.terminated": np.arange(12) == 1}, "ends an episode that goes on"),
        ({"episode_index": np.arange(12), "frame_index": None}, "single row"),
    ],
    ids=str,
)
def test_broken_datasets_of_lerobot(tmp_path, changes, told):
    folder = dataset(tmp_path / "broken", [frames(**changes)])
    with pytest.raises(agail.InputError, match=told) as caught:
        Demonstrations.from_lerobot(folder)
    assert "\n" not in str(caught.value) and str(folder) in str(caught.value)


def test_what_is_no_dataset_of_lerobot(tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.parquet").write_text("text")
    dataset(tmp_path / "no-frames", [frames().slice(0, 0)])
    dataset(tmp_path / "two", [frames(), frames(action=pyarrow.array(["a"] * 12))])
    for name, told in {"absent": "does not exist", "empty": "no data/", "no-frames": "no frames",
                       "text.parquet": "cannot be read as Parquet", "two": "columns differ"}.items():  # fmt: skip
        with pytest.raises(agail.InputError, match=told) as caught:
            Demonstrations.from_lerobot(tmp_path / name)
        assert "\n" not in str(caught.value)


def test_the_folder_that_lerobot_reads(hopper_demos, tmp_path):
    """What LeRobot 0.4 looks up in meta/: the documented format, v3.0."""
    demos = hopper_demos.mask(0.5)
    demos.to_lerobot(tmp_path / "d", fps=125)
    info = json.loads((tmp_path / "d/meta/info.json").read_text())
    assert info["codebase_version"] == "v3.0" and info["fps"] == 125
    assert info["total_episodes"] == 6 and info["total_frames"] == demos.transitions
    path = tmp_path / "d" / info["data_path"].format(chunk_index=0, file_index=0)
    table = pyarrow.parquet.read_table(path)
    assert set(table.column_names) == set(info["features"])
    for name, feature in info["features"].items():
        kind = table.schema.field(name).type
        scalar = pyarrow.type_for_alias(feature["dtype"])
        assert kind == (
            scalar if feature["shape"] == [1] else pyarrow.list_(scalar, *feature["shape"])
        )
    episodes = pandas.read_parquet(tmp_path / "d/meta/episodes/chunk-000/file-000.parquet")
    assert episodes["length"].tolist() == [len(episode) for episode in demos]
    assert episodes["dataset_to_index"].iloc[-1] == demos.transitions
    tasks = pandas.read_parquet(tmp_path / "d/meta/tasks.parquet")
    assert tasks.index.tolist() == ["Hopper-v5"] and tasks["task_index"].tolist() == [0]
    stats = json.loads((tmp_path / "d/meta/stats.json").read_text())
    actions = demos.to_arrays()["actions"]
    np.testing.assert_allclose(stats["action"]["mean"], np.nanmean(actions, axis=0), rtol=1e-6)
    np.testing.assert_allclose(stats["action"]["std"], np.nanstd(actions, axis=0), rtol=1e-6)
    assert stats["action"]["count"] == [demos.transitions]
    done = np.array(table["next.done"])
    np.testing.assert_array_equal(np.flatnonzero(done), np.cumsum(episodes["length"]) - 1)
    with pytest.raises(agail.InputError, match="fps"):
        demos.to_lerobot(tmp_path / "other", fps=0)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"obs": np.zeros((3, 2))}, "3 observations and 3 actions"),
        ({"acts": np.zeros((0, 1)), "obs": np.zeros((1, 2))}, "0 actions"),
        ({"acts": np.zeros((3, 2))}, "the first one of"),
        ({"obs": np.full((4, 2), np.nan)}, "only actions may be missing"),
        ({"obs": {"a": np.zeros((4, 2))}}, "no array of numbers|not numbers"),
        ({"acts": np.array(["left"] * 3)}, "not numbers"),
        ({"rews": np.zeros(2)}, "2 rews and 3 actions"),
        ({"infos": [{}]}, "1 infos and 3 actions"),
        ({"rews": None}, "rewards and others have none"),
    ],
    ids=str,
)
def test_broken_trajectories(change, told):
    good = {"obs": np.zeros((4, 2)), "acts": np.zeros((3, 1)), "infos": None, "terminal": True,
            "rews": np.zeros(3)}  # fmt: skip
    pair = [SimpleNamespace(**good), SimpleNamespace(**{**good, **change})]
    with pytest.raises(agail.InputError, match=told) as caught:
        Demonstrations.from_trajectories(pair)
    assert "\n" not in str(caught.value)


def test_what_are_no_trajectories():
    for value, told in (([], "no trajectories"), (3, "no sequence"), ([3], "int without obs")):
        with pytest.raises(agail.InputError, match=told):
            Demonstrations.from_trajectories(value)


def test_where_nothing_can_be_written(hopper_demos, tmp_path):
    (tmp_path / "file").write_text("")
    for write in (hopper_demos.to_d4rl, hopper_demos.to_lerobot):
        with pytest.raises(agail.InputError, match="cannot be written"):
            write(tmp_path / "file" / "x")
    assert [each.name for each in tmp_path.iterdir()] == ["file"]


def test_missing_packages_are_named(hopper_demos, tmp_path, monkeypatch):
    import sys

    for module in ("h5py", "pyarrow", "imitation.data.types"):
        monkeypatch.setitem(sys.modules, module, None)
    calls = {
        "h5py": lambda: hopper_demos.to_d4rl(tmp_path / "x.hdf5"),
        "pyarrow": lambda: hopper_demos.to_lerobot(tmp_path / "x"),
        "imitation": hopper_demos.to_trajectories,
    }
    for package, call in calls.items():
        with pytest.raises(agail.InputError, match=f"pip install {package}"):
            call()
