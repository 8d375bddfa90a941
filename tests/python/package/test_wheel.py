"""The wheel as a file, and installed elsewhere."""

import os
import subprocess
import sys
import sysconfig
import tarfile
import zipfile
from importlib import metadata
from pathlib import Path

import pytest

import agail

ROOT = Path(__file__).resolve().parents[3]
PACKAGE = Path(agail.__file__).parent


def python(*words, executable=sys.executable, **options):
    done = subprocess.run([executable, *map(str, words)], capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_requires_the_mujoco_that_it_was_built_with():
    requirements = metadata.requires("agail")
    assert f"mujoco-core=={agail._core.mujoco_version}" in requirements


def test_typed():
    assert (PACKAGE / "py.typed").exists()
    stub = (PACKAGE / "_core.pyi").read_text()
    assert "class InputError(ValueError)" in stub
    assert (
        "class Policy" in stub and "def predict(self, observation: numpy.typing.ArrayLike" in stub
    )


READ = """
import os, sys
for name in sys.argv[2:]:
    exec(f"import {name}")
import agail, h5py, mujoco, numpy
path = sys.argv[1]
demos = agail.Demonstrations.load(path)
with h5py.File(path) as file:
    numpy.testing.assert_array_equal(file["episode_0/observations"][:], demos[0].observations)
    h5py.File(path + ".copy", "w").create_dataset("x", data=demos[0].actions)
with h5py.File(path + ".copy") as file:
    numpy.testing.assert_array_equal(file["x"][:], demos[0].actions)
demos.save(path + ".again.hdf5")
assert agail.Demonstrations.load(path + ".again.hdf5").transitions == demos.transitions
libraries = {line.split()[-1] for line in open("/proc/self/maps") if "libmujoco" in line}
assert len(libraries) == 1, libraries
print("read")
"""


@pytest.mark.parametrize("order", [("h5py", "agail"), ("agail", "h5py"), ("mujoco", "agail"),
                                   ("agail", "mujoco")], ids="-".join)  # fmt: skip
def test_beside_other_users_of_the_same_libraries(hopper_demos, tmp_path, order):
    hopper_demos.save(tmp_path / "demos.hdf5")
    assert python("-c", READ, tmp_path / "demos.hdf5", *order) == "read\n"


def dynamic(path, flag):
    return subprocess.run(
        ["readelf", flag, "--wide", path], capture_output=True, text=True, check=True
    ).stdout


@pytest.mark.parametrize("path", [Path(agail._core.__file__), PACKAGE / "bin" / "agail"], ids=str)
def test_needs_nothing_but_mujoco(path):
    lines = dynamic(path, "-d").splitlines()
    needed = {line.split("[")[1].rstrip("]") for line in lines if "(NEEDED)" in line}
    system = {"libc.so.6", "libm.so.6", "libstdc++.so.6", "libgcc_s.so.1", "ld-linux-x86-64.so.2"}
    assert needed - system == {f"libmujoco.so.{agail._core.mujoco_version}"}
    (search,) = (line.split("[")[1].rstrip("]") for line in lines if "PATH)" in line)
    assert search in ("$ORIGIN/../mujoco", "$ORIGIN/../../mujoco")


def test_exports_nothing_of_others():
    lines = dynamic(agail._core.__file__, "--dyn-syms").splitlines()
    defined = [line.split()[-1] for line in lines if " GLOBAL " in line and " UND " not in line]
    assert defined == ["PyInit__core"]


def test_installed_at_another_path(tmp_path):
    """A fresh virtual environment, what the wheel requires, and nothing else."""
    wheel = os.environ.get("AGAIL_WHEEL")
    if not wheel:
        pytest.skip("AGAIL_WHEEL does not name the wheel")
    names = zipfile.ZipFile(wheel).namelist()
    assert "agail/bin/agail" in names and not any("mujoco" in name for name in names)
    python("-m", "venv", "--without-pip", tmp_path / "env")
    own = tmp_path / "env" / "bin" / "python"
    python("-m", "pip", "--python", own, "install", "--quiet", wheel)
    moved = tmp_path / "env with a space"
    (tmp_path / "env").rename(moved)  # the scripts' first lines are lost, the libraries are found
    own = moved / "bin" / "python"
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "LD_"))}
    program = (
        moved / sysconfig.get_path("purelib", vars={"base": ""}).lstrip("/") / "agail/bin/agail"
    )
    for words in ([own, "-m", "agail", "envs"], [program, "envs"]):
        done = subprocess.run(words, capture_output=True, text=True, env=environment)
        assert done.returncode == 0 and "Hopper-v5" in done.stdout, done.stderr
    words = ["-m", "agail", "train", "Pendulum-v1", "--method", "trpo", "--timesteps", "256",
             "--set=run.batch_steps=256", "--out", tmp_path / "run"]  # fmt: skip
    assert "mean return" in python(*words, executable=own, env=environment)


def test_source_distribution(tmp_path):
    """Holds whatever the build reads."""
    code = "import sys; from scikit_build_core.build import build_sdist; build_sdist(sys.argv[1])"
    python("-c", code, tmp_path, cwd=ROOT)
    (archive,) = tmp_path.glob("agail-*.tar.gz")
    with tarfile.open(archive) as file:
        names = {name.split("/", 1)[1] for name in file.getnames() if "/" in name}
    for folder in ("src", "apps", "python", "cmake", "models", "presets", "include"):
        for path in (ROOT / folder).rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts:
                assert str(path.relative_to(ROOT)) in names
    assert {"CMakeLists.txt", "pyproject.toml", "LICENSE", "README.md"} <= names
    assert not any(name.startswith((".venv", "build")) for name in names)
    assert {name for name in names if name.startswith("results/")} == {"results/paper/table1.csv"}
