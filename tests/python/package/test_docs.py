"""The snippets of docs/python.md, run in order."""

import re
from pathlib import Path

import gymnasium
import pytest

ROOT = Path(__file__).resolve().parents[3]
SNIPPETS = re.findall(r"```python\n(.*?)```", (ROOT / "docs/python.md").read_text(), re.DOTALL)


def test_snippets(tmp_path, monkeypatch, capsys):
    (tmp_path / "data").symlink_to(ROOT / "data")
    monkeypatch.chdir(tmp_path)
    assert len(SNIPPETS) == 3
    names = {"gymnasium": gymnasium}
    for snippet in SNIPPETS:
        exec(snippet, names)
    share = float(capsys.readouterr().out.splitlines()[-1])
    assert 0.5 < share < 1.1
    assert names["action"].shape == (3,) and names["many"].num_envs == 64


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
