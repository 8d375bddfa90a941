"""The README's snippets, run as they are written."""

import re
import shlex

import numpy as np
import pytest
from program import ROOT

README = (ROOT / "README.md").read_text()


def commands(heading: str) -> list[str]:
    section = README.split(f"## {heading}\n")[1].split("\n## ")[0]
    return [line.strip() for line in section.splitlines() if line.startswith("    ")]


@pytest.fixture
def arrays(tmp_path, monkeypatch):
    """What a user would have: arrays of three episodes, most actions missing."""
    monkeypatch.chdir(tmp_path)
    random = np.random.default_rng(0)
    rows = 300
    observations = random.normal(size=(rows, 11))
    actions = random.uniform(-1, 1, size=(rows, 3))
    actions[random.random(rows) < 0.75] = np.nan
    episodes = np.repeat(np.arange(3), rows // 3)
    return {"observations": observations, "actions": actions, "episodes": episodes}


def test_bring_your_own_demonstrations(agail, arrays):
    lines = commands("Bring your own demonstrations")
    python = [line for line in lines if line.startswith(("import", "np."))]
    exec("\n".join(python), dict(arrays))
    shell = [shlex.split(line)[1:] for line in lines if line.startswith("agail ")]
    # The file is made first, then looked at, trained on (shortly) and evaluated.
    shell.sort(key=lambda words: words[0] != "convert")
    assert [words[0] for words in shell] == ["convert", "inspect", "train", "eval"]
    for words in shell:
        if words[0] == "train":
            words += ["--timesteps", "1024", "--set", "bc.epochs=2"]
        if words[0] == "eval":
            words += ["--episodes", "2"]
        assert agail(*words)


def test_links_lead_somewhere():
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", README):
        assert target.startswith("https://") or (ROOT / target).exists(), target


def test_commands_are_those_of_the_program(agail):
    extensions = {"export", "report", "video"}  # of the Python package
    names = {line.split()[1] for line in commands("Commands")} - extensions
    shown = agail("--help")
    assert all(re.search(rf"^\s+{name}\s", shown, re.MULTILINE) for name in names)


def test_settings_page_is_up_to_date(agail):
    page = (ROOT / "docs/settings.md").read_text()
    assert agail("train", "--help-settings-markdown") == page, (
        "agail train --help-settings-markdown"
    )
