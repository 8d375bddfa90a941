"""agail.Policy: actions as stable-baselines3 gives them, and as Gymnasium's environments take them."""

import array
import pickle
from concurrent.futures import ThreadPoolExecutor

import gymnasium
import numpy as np
import pytest
from small import train

import agail


@pytest.fixture(scope="module")
def hopper(hopper_run):
    return hopper_run.policy


@pytest.fixture(scope="module")
def cartpole():
    return train("CartPole-v1", method="trpo").policy


def batch(n=50, dim=11):
    return np.random.default_rng(0).normal(size=(n, dim))


def test_shapes(hopper, cartpole):
    action, state = hopper.predict(batch()[0])
    assert action.shape == (3,) and action.dtype == np.float32 and state is None
    assert hopper.predict(batch())[0].shape == (50, 3)
    assert hopper.predict(batch(0))[0].shape == (0, 3)
    action, state = cartpole.predict(batch(dim=4)[0], state="kept", deterministic=False)
    assert action.shape == () and action.dtype == np.int64 and state == "kept"
    assert cartpole.predict(batch(dim=4))[0].shape == (50,)


def test_a_batch_is_its_rows(hopper):
    whole, _ = hopper.predict(batch())
    np.testing.assert_array_equal(whole, [hopper.predict(row)[0] for row in batch()])


def test_what_it_takes(hopper):
    row = batch().astype(np.float32)[0]
    expected, _ = hopper.predict(row)
    double = row.astype(np.float64)
    constant = double.copy()
    constant.flags.writeable = False
    strided = np.stack([double, double], 1)[:, 0]
    packed = np.zeros(1, [("byte", "u1"), ("observation", "f8", (11,))])  # at an odd address
    packed["observation"] = double
    kinds = (packed["observation"], row.tolist(), double, row[None], np.stack([row, row], 1)[:, 0], strided, constant,
             double.astype(">f8"), array.array("d", double), np.asfortranarray(double[None]))  # fmt: skip
    for same in kinds:
        np.testing.assert_array_equal(hopper.predict(same)[0].reshape(3), expected)
    for shape in ((12,), (2, 3, 11), (), (11, 1)):
        with pytest.raises(agail.InputError, match=r"\(11,\) or \(n, 11\)"):
            hopper.predict(np.zeros(shape))
    rows = np.asfortranarray(batch())
    np.testing.assert_array_equal(hopper.predict(rows)[0], hopper.predict(batch())[0])
    for wrong in (b"x" * 88, "text", None):
        with pytest.raises((ValueError, TypeError)):
            hopper.predict(wrong)


def test_the_formula(hopper, hopper_run):
    """The mean action is what the documentation of the file says."""
    from safetensors.numpy import load_file

    tensors = load_file(hopper_run.folder / "policy_best.safetensors")
    x = np.clip((batch() - tensors["observation.mean"]) / tensors["observation.std"], -5, 5)
    for layer in (0, 1):
        x = np.tanh(x @ tensors[f"policy.{layer}.weight"].T + tensors[f"policy.{layer}.bias"])
    mean = x @ tensors["policy.2.weight"].T + tensors["policy.2.bias"]
    np.testing.assert_allclose(hopper.predict(batch())[0], np.clip(mean, -1, 1), atol=1e-5)


def test_stochastic(hopper):
    draw = lambda: hopper.predict(batch(), deterministic=False)[0]  # noqa: E731
    hopper.seed(1)
    first, second = draw(), draw()
    hopper.seed(1)
    np.testing.assert_array_equal(first, draw())
    assert not np.array_equal(first, second) and np.abs(first).max() <= 1
    hopper.seed(np.int64(2**63 - 1))
    for wrong in (-1, 2**64, 1.5, None):
        with pytest.raises(agail.InputError, match=r"seed = .* below 2"):
            hopper.seed(wrong)


def test_pickle(hopper, cartpole):
    for policy, dim in ((hopper, 11), (cartpole, 4)):
        again = pickle.loads(pickle.dumps(policy))
        np.testing.assert_array_equal(
            again.predict(batch(dim=dim))[0], policy.predict(batch(dim=dim))[0]
        )
        assert again.environment == policy.environment and again.timesteps == policy.timesteps
    with pytest.raises(agail.InputError, match="pickled"):
        agail.Policy.__new__(agail.Policy).__setstate__(b"garbage")


def test_threads(hopper):
    expected, _ = hopper.predict(batch(1000))
    with ThreadPoolExecutor(8) as pool:
        for result, _ in pool.map(lambda _: hopper.predict(batch(1000)), range(50)):
            np.testing.assert_array_equal(result, expected)


def test_save_and_load(hopper, hopper_run, tmp_path):
    hopper.save(tmp_path / "p.safetensors")
    best = hopper_run.folder / "policy_best.safetensors"
    assert (tmp_path / "p.safetensors").read_bytes() == best.read_bytes()
    assert agail.Policy.load(tmp_path / "p.safetensors").method == "trpo"
    hopper.save(tmp_path / "new" / "folder" / "p.safetensors")
    assert agail.Policy.load(tmp_path / "new" / "folder" / "p.safetensors").method == "trpo"
    with pytest.raises(agail.InputError, match="no such file"):
        agail.Policy.load(tmp_path / "absent")


def test_drives_gymnasiums_environment(cartpole):
    environment = gymnasium.make("CartPole-v1")
    observation, _ = environment.reset(seed=0)
    for _ in range(5):
        action, _ = cartpole.predict(observation)
        observation, *_ = environment.step(action)
    environment.close()


def test_evaluate(hopper, hopper_run):
    result = agail.evaluate(hopper, 5)
    assert result.returns.shape == (5,) and result.mean_return == result.returns.mean()
    assert agail.evaluate(hopper_run, 5).mean_return == result.mean_return
    assert agail.evaluate(hopper_run.folder, 5, threads=1).mean_return == result.mean_return
    assert agail.evaluate(hopper, 5, seed=1).mean_return != result.mean_return
    assert result.share_of_demonstrations is None
    low, high = result.confidence_interval_95
    assert low <= result.mean_return <= high
    # Gymnasium's own Hopper, through the policy: another reset, the same task.
    environment = agail.evaluate(hopper, 5, environment=lambda: gymnasium.make("Hopper-v5"))
    assert environment.mean_return == pytest.approx(result.mean_return, rel=0.5)
    ours = agail.evaluate(hopper, 5, environment=gymnasium.make("agail/Hopper-v5"))
    assert ours.mean_return == pytest.approx(result.mean_return, rel=0.5)
    with pytest.raises(agail.InputError, match="CartPole"):
        agail.evaluate(hopper, environment=gymnasium.make("CartPole-v1"))
    for episodes in (0, True, 10**7):
        with pytest.raises(agail.InputError, match="episodes"):
            agail.evaluate(hopper, episodes)
    assert result != agail.evaluate(hopper, 5) and result in [result] and len({result}) == 1
