"""agail export: onnxruntime gives the actions that the policy gives."""

import json
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import onnxruntime
import pytest
from small import train
from test_spaces import Discretes

import agail
from agail import _core
from agail.export import export


def command(*words, **options):
    words = [str(Path(sys.executable).with_name("agail")), "export", *map(str, words)]
    return subprocess.run(words, capture_output=True, text=True, timeout=300, **options)


def observations(policy, count=10_000):
    """Like those that it has seen, and far from them."""
    random = np.random.default_rng(0)
    tensors = policy.tensors()
    mean, std = tensors.get("observation.mean", 0), tensors.get("observation.std", 1)
    scale = random.choice([0.3, 1, 10], size=(count, 1))
    return (mean + scale * std * random.normal(size=(count, policy.observation_dim))).astype("f4")


@pytest.mark.parametrize("name", _core.environment_ids())
def test_onnxruntime_agrees(tmp_path, name):
    run = train(name, method="trpo", timesteps=512, policy={"hidden": [100, 100]},
                run={"evaluation_episodes": 1})  # fmt: skip
    out = tmp_path / "policy.onnx"
    done = command(run.folder, "--format", "onnx", "--out", out)
    assert done.returncode == 0 and name in done.stdout, done.stderr
    policy = run.policy
    session = onnxruntime.InferenceSession(out, providers=["CPUExecutionProvider"])
    rows = observations(policy)
    outputs = dict(
        zip([o.name for o in session.get_outputs()], session.run(None, {"observation": rows}))
    )
    actions, _ = policy.predict(rows)
    if policy.n_actions:
        # Two logits that are nearly equal may be ordered either way.
        first, second = np.sort(outputs["logits"], 1)[:, :-3:-1].T
        clear = first - second > 1e-6
        assert clear.mean() > 0.99 and list(outputs) == ["action", "logits"]
        np.testing.assert_array_equal(outputs["action"][clear], actions[clear])
    else:
        assert list(outputs) == ["action", "log_std", "mean"]
        np.testing.assert_allclose(outputs["action"], actions, rtol=0, atol=1e-6)
        log_std = policy.tensors()["policy.log_std"]
        np.testing.assert_array_equal(outputs["log_std"], np.tile(log_std, (len(rows), 1)))
    properties = session.get_modelmeta().custom_metadata_map
    assert properties["environment"] == name and properties["method"] == "trpo"
    assert json.loads(properties["structure"])["hidden"] == [100, 100]


def test_one_observation_at_a_time(hopper_run, tmp_path):
    export(hopper_run.policy, tmp_path / "p.onnx")
    session = onnxruntime.InferenceSession(tmp_path / "p.onnx")
    rows = observations(hopper_run.policy, 5)
    whole = session.run(["action"], {"observation": rows})[0]
    for row, action in zip(rows, whole):
        alone = session.run(["action"], {"observation": row[None]})[0][0]
        np.testing.assert_allclose(alone, action, atol=1e-6)


def test_wrong_input(hopper_run, tmp_path):
    for words in (["absent", "--out", tmp_path / "x"], [hopper_run.folder],
                  [hopper_run.folder, "--format", "pickle", "--out", tmp_path / "x"],
                  [hopper_run.folder, "--out", tmp_path / "absent" / "x"]):  # fmt: skip
        done = command(*words)
        assert done.returncode == 2 and done.stdout == ""
        assert len(done.stderr.splitlines()) == 1 and done.stderr.startswith("agail: "), done.stderr
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").touch()
    for out in (tmp_path / "folder", tmp_path / "file" / "x"):
        done = command(hopper_run.folder, "--out", out)
        assert done.returncode == 2 and len(done.stderr.splitlines()) == 1, done.stderr
        with pytest.raises(agail.InputError, match="cannot be written"):
            export(hopper_run.policy, out)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder"]


def test_no_space(hopper_run, tmp_path):
    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (1024, resource.RLIM_INFINITY))

    done = command(hopper_run.folder, "--out", tmp_path / "x.onnx", preexec_fn=limit)
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1, done.stderr
    assert list(tmp_path.iterdir()) == []


def test_actions_are_the_environments(tmp_path):
    policy = train(Discretes, method="trpo").policy
    export(policy, tmp_path / "p.onnx")
    session = onnxruntime.InferenceSession(tmp_path / "p.onnx")
    (action,) = session.run(["action"], {"observation": np.eye(3, dtype=np.float32)})
    assert action.dtype == np.int64
    np.testing.assert_array_equal(action, policy.predict([5, 6, 7])[0])


def test_safetensors_package_reads_policies(hopper_run):
    from safetensors.numpy import load_file

    tensors = load_file(hopper_run.folder / "policy_best.safetensors")
    mine = hopper_run.policy.tensors()
    assert tensors.keys() >= mine.keys()
    for name, array in mine.items():
        np.testing.assert_array_equal(array, tensors[name])
    assert agail.Policy.load(hopper_run.folder).metadata()["environment"] == "Hopper-v5"
