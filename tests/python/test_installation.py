"""The installed CMake package: a program of somebody else's (examples/act) is built with it and acts."""

import shutil
import subprocess

import numpy as np
import pytest
from program import BUILD, ROOT
from safetensors.numpy import load_file


def run(*words, **options):
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    prefix = tmp_path_factory.mktemp("prefix")
    run("cmake", "--install", BUILD, "--prefix", prefix)
    return prefix


@pytest.fixture(scope="module")
def act(prefix, tmp_path_factory):
    """Built outside of the source tree, which it must not need."""
    folder = tmp_path_factory.mktemp("act")
    shutil.copytree(ROOT / "examples" / "act", folder / "source")
    run("cmake", "-S", folder / "source", "-B", folder / "build", f"-DCMAKE_PREFIX_PATH={prefix}")
    run("cmake", "--build", folder / "build")
    return folder / "build" / "act"


def test_installed_program_runs(prefix):
    assert "Hopper-v5" in run(prefix / "bin" / "agail", "envs")


def test_library_needs_neither_physics_nor_hdf5(prefix):
    (library,) = prefix.glob("lib/**/libagail.so")
    needed = run("readelf", "-d", library)
    assert "libstdc++" in needed and "mujoco" not in needed and "hdf5" not in needed


def test_example_acts_as_the_policy_does(small, act):
    run_folder = small / "hopper-expert"
    tensors = load_file(run_folder / "policy_best.safetensors")
    rows = np.random.default_rng(0).normal(size=(50, 11))
    shown = run(act, run_folder, input="\n".join(" ".join(map(repr, row)) for row in rows.tolist()))
    actions = np.array([line.split() for line in shown.splitlines()], float)
    x = np.clip((rows - tensors["observation.mean"]) / tensors["observation.std"], -5, 5)
    for layer in (0, 1):
        x = np.tanh(x @ tensors[f"policy.{layer}.weight"].T + tensors[f"policy.{layer}.bias"])
    mean = x @ tensors["policy.2.weight"].T + tensors["policy.2.bias"]
    np.testing.assert_allclose(actions, np.clip(mean, -1, 1), atol=1e-5)


def test_example_says_what_is_wrong(small, act, tmp_path):
    for words, text in (
        ([tmp_path / "absent"], "no such file"),
        ([small / "hopper-expert"], "11 obs"),
    ):
        done = subprocess.run([act, *words], input="1 2 3\n", capture_output=True, text=True)
        assert done.returncode == 1 and text in done.stderr
