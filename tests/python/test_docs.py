"""Every command and snippet of README.md, CONTRIBUTING.md and docs/, run or, where that takes too long, checked.

A page is worked through from top to bottom in a folder of its own. Runs are made short by the settings of `shortened`; what
a command needs and no earlier one has made is put in place by `provide`.
"""

import os
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest
from documents import PAGES, blocks, options, spans
from program import ROOT, SMALL

import agail as package

STARTERS = {"mpirun", "srun"}  # before agail; test_ranks.py is about them
# Neither run nor checked, and why.
NOT_RUN = {
    "cmake": "the build that these tests are run on",
    "ctest": "beside these tests in ./run-tests",
    "pip": "the installation that these tests are run in",
    "python": "builds a source distribution, or runs the tests of the package",
    "tensorboard": "serves until it is stopped; test_runs.py reads what it shows",
    "mkdocs": "test_site builds it",
    "build/act": "test_installation.py builds and runs it",
}
EXTENSIONS = {"export", "report", "video"}
NOT_SETTINGS = {"policy.safetensors", "policy.predict", "policy.seed", "policy.log_std"}


@pytest.fixture(scope="module")
def material(agail, small, tmp_path_factory):
    """Demonstrations by environment, a policy, and arrays as a user has them."""
    folder = tmp_path_factory.mktemp("material")
    agail("train", "Humanoid-v4", "--method=trpo", "--out", folder / "h", "--timesteps=256", *SMALL)
    agail("record", folder / "h", "--episodes", 2, "--out", folder / "Humanoid-v4.hdf5")
    for name, file in {"Hopper-v5": "hopper-part", "CartPole-v1": "cartpole-part"}.items():
        shutil.copy(small / f"{file}.hdf5", folder / f"{name}.hdf5")
    agail(
        "train", "Hopper-v5", "--method=agail", "--demos", folder / "Hopper-v5.hdf5",
        "--out", folder / "policy", "--timesteps=256", *SMALL,
    )  # fmt: skip
    return folder


def arrays():
    random = np.random.default_rng(0)
    actions = random.uniform(-1, 1, size=(300, 3))
    actions[random.random(300) < 0.75] = np.nan
    return {
        "observations": random.normal(size=(300, 11)),
        "actions": actions,
        "episodes": np.repeat(np.arange(3), 100),
    }


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Where a page is worked through: the files of the tree that it may name are there."""
    for name in ("data", "examples", "benchmarks", "presets"):
        (tmp_path / name).symlink_to(ROOT / name)
    shutil.copy(ROOT / "models/hopper.xml", tmp_path)
    np.savez(tmp_path / "my-arrays.npz", **arrays())
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    return tmp_path


def value_of(words, option):
    return words[words.index(option) + 1] if option in words else None


def replace(words, option, change):
    """Gives the option the value change(old), old being None if it is not there."""
    old = value_of(words, option)
    if old is None:
        return [*words, option, str(change(None))]
    at = words.index(option) + 1
    return [*words[:at], str(change(old)), *words[at + 1 :]]


def shortened(words):
    """The same command over in a moment."""
    if words[0] == "train":
        words = replace(words, "--timesteps", lambda old: min(int(old or 512), 2048))
        # Of two values of a setting the later counts.
        return [*words, *SMALL, "--set=run.evaluate_every=0", "--set=run.evaluation_episodes=1"]
    if words[0] in ("eval", "record"):
        return replace(words, "--episodes", lambda old: 2)
    if words[0] == "bench":
        words = (
            words if len(words) > 1 and words[1][0] != "-" else ["bench", "CartPole-v1", *words[1:]]
        )
        return replace(words, "--updates", lambda old: 2)
    return words


def provide(words, material):
    """Puts in place what the command reads; takes away what it is to create."""
    out = value_of(words, "--out")
    if out:
        Path(out).parent.mkdir(parents=True, exist_ok=True)
    if out and "--resume" not in words:
        shutil.rmtree(out) if Path(out).is_dir() else Path(out).unlink(missing_ok=True)
    demos = value_of(words, "--demos")
    if demos and not Path(demos).exists():
        file = material / f"{words[1]}.hdf5"
        if "states-only" in demos:
            package.Demonstrations.load(file).mask(1).save("states-only.hdf5")
            file = Path("states-only.hdf5")
        words = replace(words, "--demos", lambda old: file)
    elif words[0] in ("inspect", "eval", "record", "mask", "export", "report"):
        read = Path(words[1])
        if not read.exists():
            read.parent.mkdir(parents=True, exist_ok=True)
            if read.suffix == ".hdf5":
                shutil.copy(material / "Hopper-v5.hdf5", read)
            else:
                shutil.copytree(material / "policy", read)
    return words


def run_agail(agail, words, where, material):
    # What a page has at the root of its machine belongs into the page's folder here.
    words = [f"root{word}" if word.startswith("/") else word for word in words]
    words = [os.path.expandvars(word) for word in words]
    if words[0] == "reproduce":
        # Hours. An --out that cannot be made is what it looks at after the options.
        Path("taken").write_text("")
        done = agail.run(*replace(words, "--out", lambda old: "taken"))
        assert "cannot create files in taken" in done.stderr, f"{where}: {done.stderr}"
        return
    words = shortened(provide(words, material))
    if where.startswith("docs/environments.md"):  # Gymnasium's, which the package alone has
        command = [sys.executable, "-m", "agail", *map(str, words)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    else:
        done = agail.run(*words)
    assert done.returncode == 0, f"{where}: agail {' '.join(map(str, words))}\n{done.stderr}"


def run_command(agail, words, where, material):
    words = [word for word in words if not re.match(r"[A-Z_]+=", word)]
    program = words[0] if words else ""
    if "agail" in words and (program == "agail" or program in STARTERS):
        run_agail(agail, words[words.index("agail") + 1 :], where, material)
    elif program == "cmp":
        subprocess.run(words, check=True)
    elif program == "python" and words[1].startswith("examples/"):
        run_example(words[1:])
    elif "pytest" in words:
        files = [word for word in words if word.startswith("tests/")]
        assert all((ROOT / file).exists() for file in files), where
    elif (ROOT / program).is_file() and program:  # one of the tree's
        text = (ROOT / program).read_text()
        unknown = [name for name in options(words) if not re.search(rf"{name}(?![\w-])", text)]
        assert not unknown, f"{where}: {program} has no {unknown}"
    elif program:
        assert program in NOT_RUN, f"{where}: {' '.join(words)}: nothing says how to check this"


def run_example(words):
    """In this process, where training is short (python_names)."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", replace(words, "--seeds", lambda old: 1))
        patch.syspath_prepend(str((ROOT / words[0]).parent))
        runpy.run_path(words[0], run_name="__main__")


@pytest.fixture(scope="module")
def known_options(agail):
    """Options of each sub-command, as its help shows them; None: no such sub-command."""
    seen = {}

    def known(name):
        if name not in seen:
            command = [Path(sys.executable).parent / f"agail-{name}"] if name in EXTENSIONS else []
            command = command or [agail.program, name]
            done = subprocess.run([*command, "--help"], capture_output=True, text=True)
            there = done.returncode == 0
            seen[name] = set(re.findall(r"--[a-z][a-z-]*", done.stdout)) if there else None
        return seen[name]

    return known


def check_synopsis(words, where, known_options):
    """`agail x --y` as it stands in a list or in running text: that there are x and y."""
    names = options(words)
    if len(words) > 1 and re.fullmatch(r"[a-z]+", words[1]):
        known = known_options(words[1])
        assert known is not None, f"{where}: agail has no sub-command {words[1]}"
        assert set(names) <= known, f"{where}: agail {words[1]} has no {set(names) - known}"


def within_words(text):
    """`agail ...` in the middle of something else, such as the command of a container."""
    for found in re.findall(r"\bagail, ([^\]]*)\]", text):
        yield [word.strip().strip('"') for word in found.split(",")]


def is_shell(block):
    words = block.text.split()
    first = words[0] if words else ""
    starts = {"agail", "AGAIL_BUILD_DIR=build/release", "#!/bin/bash", "#", *STARTERS, *NOT_RUN}
    return block.language in ("sh", "bash") or (
        not block.language and (first in starts or (ROOT / first).is_file())
    )


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_blocks(agail, page, place, material, known_options, python_names):
    for block in blocks(page):
        where = str(block)
        if block.mark.startswith("not run: "):
            continue
        if block.is_python:
            exec(compile(block.text, where, "exec"), python_names)
        elif block.language == "cpp":
            check_cpp(block, place)
        elif block.mark == "synopsis":
            for line in block.text.splitlines():
                check_synopsis(line.split(), where, known_options)
        elif is_shell(block):
            for words in block.commands():
                run_command(agail, words, where, material)
        else:
            assert not re.search(r"^agail \w", block.text, re.MULTILINE), f"{where}: not run"
            for words in within_words(block.text):
                run_agail(agail, words, where, material)


@pytest.fixture
def python_names(material, place, monkeypatch):
    """What snippets may use: their training is short, and README's have arrays and a file at hand."""
    train = package.train

    def short(*arguments, **settings):
        settings["timesteps"] = min(settings.get("timesteps") or 512, 512)
        small = [setting.removeprefix("--set=").partition("=") for setting in SMALL]
        for key, _, value in small:
            section, _, name = key.partition(".")
            settings.setdefault(section, {}).setdefault(name, eval(value))
        return train(*arguments, **{**settings, "progress": False})

    monkeypatch.setattr(package, "train", short)
    shutil.copy(material / "Hopper-v5.hdf5", place / "my-demos.hdf5")
    names = {"agail": package, "np": np, "gymnasium": gymnasium, "observation": np.zeros(11)}
    steps = SimpleNamespace(obs=np.zeros((21, 11)), acts=np.zeros((20, 3)), terminal=True)
    model = SimpleNamespace(predict=lambda *_, **__: (np.zeros(1), None))
    return {**names, **arrays(), "trajectories": [steps], "model": model}


def check_cpp(block, place):
    """Compiles it; a part of a function stands in one of namespace agail."""
    text = block.text
    if "#include" not in text:
        text = (
            '#include "agail/env/locomotion_task.h"\n'
            "namespace agail { LocomotionTask hopper(const std::string&, bool);\n"
            f"LocomotionTask snippet() {{\n{text}\nreturn task; }} }}"
        )
    elif match := re.search(r"class (\w+) : public", text):
        text += f"\n{match[1]} made;"  # of an abstract class there could be none
    (place / "snippet.cc").write_text(text)
    command = ["c++", "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", "snippet.cc"]
    done = subprocess.run([*command, f"-I{ROOT}/src"], capture_output=True, text=True)
    assert done.returncode == 0, f"{block}: {done.stderr}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_names_in_running_text(page, known_options):
    settings = set(re.findall(r"^\| `([a-z_.]+)`", (ROOT / "docs/settings.md").read_text(), re.M))
    sections = {name.partition(".")[0] for name in settings}
    for span in spans(page):
        where = f"{page.relative_to(ROOT)}: `{span}`"
        if span.startswith("agail "):
            check_synopsis(span.split(), where, known_options)
        match = re.match(r"([a-z_]+)\.[a-z_]+(?![\w.(])", span)
        if match and match[1] in sections and match[0] not in NOT_SETTINGS:
            assert match[0] in settings, f"{where}: no such setting"
        if match := re.match(r"(agail|Demonstrations|Policy)\.([A-Za-z_]+)(?!\w|\.)", span):
            if match[2] in ("cc", "h", "py"):
                continue
            owner = package if match[1] == "agail" else getattr(package, match[1])
            assert hasattr(owner, match[2]) or match[2] == "export", f"{where}: no such name"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    """In the tree, as a code host shows it; within the site mkdocs looks at them and at the headings."""
    text = re.sub(r"```.*?```|`[^`\n]+`", "", page.read_text(), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", text):
        assert target.startswith("https://") or (page.parent / target).exists(), target


def test_files_that_are_named_exist():
    for page in PAGES:
        for span in spans(page):
            if re.fullmatch(r"(src|tests|fuzz|examples|scripts|benchmarks)/[\w./-]+", span):
                assert (ROOT / span).exists(), f"{page.relative_to(ROOT)}: {span}"


def test_commands_of_the_readme_are_those_of_the_program(agail):
    listed = next(b for b in blocks(ROOT / "README.md") if b.mark == "synopsis").text.splitlines()
    shown = set(re.findall(r"^  ([a-z]+) ", agail("--help").partition("Subcommands:")[2], re.M))
    assert {line.split()[1] for line in listed} == shown


def test_settings_page_is_up_to_date(agail):
    page = (ROOT / "docs/settings.md").read_text()
    assert agail("train", "--help-settings-markdown") == page, (
        "agail train --help-settings-markdown"
    )


def test_every_public_name_is_documented():
    text = (ROOT / "docs/python.md").read_text()
    for name in package.__all__:
        assert name in text, name
        assert getattr(package, name).__doc__, name
    for name in ("predict", "seed", "load", "save", "tensors", "metadata"):
        assert getattr(package.Policy, name).__doc__, name


def test_site(tmp_path):
    """mkdocs takes a link or a heading that is not there for an error."""
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "-d", tmp_path]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "missing-actions/index.html").exists()
