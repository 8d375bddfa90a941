"""agail.Demonstrations: from files, arrays and Minari; masks; pickling."""

import pickle
from typing import get_overloads

import numpy as np
import pytest
from same import same

import agail


@pytest.fixture
def arrays():
    random = np.random.default_rng(0)
    rows = 60
    return {
        "observations": random.normal(size=(rows, 11)),
        "actions": random.uniform(-1, 1, size=(rows, 3)),
        "episodes": np.repeat([0, 1, 2], 20),
    }


def test_save_and_load(hopper_demos, tmp_path):
    for name in ("demos.hdf5", "folder"):
        hopper_demos.save(tmp_path / name)
        loaded = agail.Demonstrations.load(tmp_path / name)
        same(hopper_demos, loaded)
        assert loaded.environment == "Hopper-v5" and loaded.missing_ratio == 0
    same(hopper_demos, pickle.loads(pickle.dumps(hopper_demos)))


def test_episodes(hopper_demos):
    assert len(hopper_demos) == 6 and hopper_demos.transitions == sum(map(len, hopper_demos))
    episode = hopper_demos[-1]
    assert episode.observations.shape == (len(episode) + 1, 11)
    assert episode.actions.shape == (len(episode), 3) and episode.available.all()
    returns = [each.rewards.sum() for each in hopper_demos]
    assert hopper_demos.mean_return == pytest.approx(np.mean(returns))
    with pytest.raises(IndexError):
        hopper_demos[6]
    assert "Hopper-v5" in repr(hopper_demos) and len(hopper_demos[:2]) == 2
    assert episode in [episode] and episode not in hopper_demos and len({episode}) == 1
    kinds = get_overloads(agail.Demonstrations.__getitem__)
    assert [each.__annotations__["return"] for each in kinds] == ["Episode", "list[Episode]"]


def test_mask(hopper_demos):
    half = hopper_demos.mask(0.5, seed=3)
    assert half.missing_ratio == pytest.approx(0.5, abs=0.05) and hopper_demos.missing_ratio == 0
    assert all(np.isnan(e.actions[~e.available]).all() for e in half)
    more = hopper_demos.mask(0.75, seed=3)
    assert all((a.available | ~b.available).all() for a, b in zip(half, more)), "nested"
    channel = hopper_demos.mask(1 / 3, "dimension", dimension=1)
    assert not channel[0].available[:, 1].any() and channel[0].available[:, [0, 2]].all()
    with pytest.raises(agail.InputError, match="block"):
        hopper_demos.mask(0.5, "blok")
    with pytest.raises(ValueError, match="0 \\(none\\) to 1"):
        hopper_demos.mask(2)
    with pytest.raises(agail.InputError, match="seed = -1"):
        hopper_demos.mask(0.5, seed=-1)


def test_from_arrays(arrays):
    arrays["actions"][3, 1] = np.nan
    demos = agail.Demonstrations.from_arrays(**arrays, environment="Hopper-v5")
    assert [len(e) for e in demos] == [19, 19, 19]
    np.testing.assert_array_equal(demos[1].observations, arrays["observations"][20:40])
    np.testing.assert_array_equal(demos[1].actions, arrays["actions"][20:39])
    assert demos.missing_ratio == pytest.approx(1 / (57 * 3))
    known = np.ones(60, bool)
    known[20:40] = False
    demos = agail.Demonstrations.from_arrays(**arrays, action_available=known)
    assert not demos[1].available.any() and demos[2].available.all()
    arrays.pop("actions")
    assert agail.Demonstrations.from_arrays(**arrays).missing_ratio == 1
    demos = agail.Demonstrations.from_arrays(**arrays, environment="agail/Hopper-v5")
    assert demos.environment == "Hopper-v5" and demos.action_dim == 3


def test_from_arrays_with_ends():
    observations = np.arange(12.0).reshape(6, 2)
    demos = agail.Demonstrations.from_arrays(
        observations[:5],
        np.array([1, 0, 1, 2, 0]),
        next_observations=observations[1:],
        rewards=np.ones(5),
        terminations=[0, 0, 0, 0, 1],
    )
    assert len(demos) == 1 and len(demos[0]) == 5 and demos.action_dim == 1
    assert demos[0].terminations.tolist() == [False] * 4 + [True]
    np.testing.assert_array_equal(demos[0].actions[:, 0], [1, 0, 1, 2, 0])
    assert demos.mean_return == 5


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"observations": np.zeros(60)}, "shape"),
        ({"actions": np.zeros((59, 3))}, "60 rows"),
        ({"episodes": np.zeros(61)}, "episodes"),
        ({"actions": np.full((60, 3), np.inf)}, "infinite"),
        ({"observations": np.full((60, 11), np.nan)}, "only actions may be missing"),
        ({"observations": np.zeros((60, 12))}, "Hopper-v5"),
        ({"environment": "no id"}, "Gymnasium id"),
        ({"action_available": np.ones((60, 2))}, "action_available"),
        ({"action_available": np.full(60, np.nan)}, "other than 0"),
        ({"environment": "agail/Hopper-v5", "observations": np.zeros((60, 12))}, "Hopper-v5"),
        ({"observations": [["a"]]}, "observations are <U1, not numbers"),
        ({"observations": [[1, 2], [3]]}, "observations are no array of numbers"),
        ({"actions": [[1], [1, 2]]}, "actions are no array of numbers"),
        ({"episodes": ["a"] * 60}, "episodes are <U1"),
        ({"observations": None}, "observations have the shape"),
    ],
    ids=str,
)
def test_arrays_that_make_no_sense(arrays, change, told):
    with pytest.raises(agail.InputError, match=told):
        agail.Demonstrations.from_arrays(**{"environment": "Hopper-v5", **arrays, **change})


def test_the_command_lines_message(tmp_path):
    with pytest.raises(ValueError, match=r"absent.hdf5 does not exist; give a \.hdf5 file"):
        agail.Demonstrations.load(tmp_path / "absent.hdf5")


def test_from_minari(hopper_demos, tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    part = hopper_demos.mask(0.25)
    part.save(tmp_path / "hopper" / "part-v0")
    for dataset in ("hopper/part-v0", minari.load_dataset("hopper/part-v0")):
        demos = agail.Demonstrations.from_minari(dataset)
        same(part, demos)
        assert demos.missing_ratio == part.missing_ratio
    some = minari.load_dataset("hopper/part-v0").filter_episodes(lambda e: e.id < 2)
    with pytest.raises(agail.InputError, match="part"):
        agail.Demonstrations.from_minari(some)
