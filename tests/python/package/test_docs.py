"""The snippets of docs/python.md and docs/demonstrations.md, run in order."""

import importlib.util
import re
from pathlib import Path
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]


def snippets(page):
    return re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.DOTALL)


def test_snippets(tmp_path, monkeypatch, capsys):
    (tmp_path / "data").symlink_to(ROOT / "data")
    monkeypatch.chdir(tmp_path)
    assert len(snippets("docs/python.md")) == 3
    names = {"gymnasium": gymnasium}
    for snippet in snippets("docs/python.md"):
        exec(snippet, names)
    share = float(capsys.readouterr().out.splitlines()[-1])
    assert 0.5 < share < 1.1
    assert names["action"].shape == (3,) and names["many"].num_envs == 64


def test_snippets_of_demonstrations(tmp_path, monkeypatch):
    import agail

    monkeypatch.chdir(tmp_path)
    one = SimpleNamespace(obs=np.zeros((21, 11)), acts=np.zeros((20, 3)), terminal=True)
    model = SimpleNamespace(predict=lambda *_, **__: (np.zeros(1), None))
    names = {"agail": agail, "np": np, "trajectories": [one], "model": model}
    names |= {"observations": np.zeros((60, 11)), "actions": np.zeros((60, 3)),
              "episodes": np.repeat([0, 1, 2], 20)}  # fmt: skip
    lengths = []
    for snippet in snippets("docs/demonstrations.md"):
        if "to_trajectories" in snippet and importlib.util.find_spec("imitation") is None:
            snippet = snippet.splitlines()[0]  # the other direction needs the package
        exec(snippet, names)
        lengths.append(len(names["demos"]))
    assert lengths == [3, 3, 1, 10]
    assert len(agail.Demonstrations.load("my-demos.hdf5")) == 3
    assert np.load("arrays.npz")["observations"].shape == (57, 11)


def test_every_public_name_is_documented():
    import agail

    text = (ROOT / "docs/python.md").read_text()
    for name in agail.__all__:
        assert name in text, name
        assert getattr(agail, name).__doc__, name


@pytest.mark.parametrize("name", ["predict", "seed", "load", "save", "tensors", "metadata"])
def test_policy_says_what_it_does(name):
    import agail

    assert getattr(agail.Policy, name).__doc__
