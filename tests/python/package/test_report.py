"""agail report: what is on the page, and that it stands alone."""

import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from small import train

from agail.statistics import bootstrap_interval, iqm


def report(*words, **options):
    words = [str(Path(sys.executable).with_name("agail")), "report", *map(str, words)]
    return subprocess.run(words, capture_output=True, text=True, timeout=300, **options)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 6, 10, 23])
def test_statistics_are_rliables(count):
    import rliable.library
    import rliable.metrics

    scores = np.random.default_rng(count).gamma(2, 100, size=(count, 1))
    mine = iqm(scores)[0]
    assert mine == pytest.approx(rliable.metrics.aggregate_iqm(scores), rel=1e-12)
    if count == 1:
        return
    # What rliable draws from. Few runs have so few different resamples that an interval's end could
    # jump from one to the next with the draw.
    np.random.seed(0)
    points, intervals = rliable.library.get_interval_estimates(
        {"x": scores}, lambda each: np.array([rliable.metrics.aggregate_iqm(each)]), reps=4000
    )
    low, high = bootstrap_interval(scores, iqm, 20_000)
    assert points["x"][0] == pytest.approx(mine)
    assert low[0] <= mine <= high[0]
    np.testing.assert_allclose([low[0], high[0]], intervals["x"][:, 0], atol=0.06 * scores.std())


def test_bootstrap_interval():
    values = np.random.default_rng(0).normal(5, 1, size=(400, 2))
    low, high = bootstrap_interval(values, np.mean)
    assert low.shape == (2,) and (low < 5).all() and (high > 5).all()
    np.testing.assert_allclose(high - low, 2 * 1.96 / np.sqrt(400), rtol=0.15)


@pytest.fixture(scope="module")
def runs(hopper_demos, tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    for ratio in (0.25, 0.75):
        for seed in (0, 1, 2):
            train("Hopper-v5", hopper_demos.mask(ratio), seed=seed, timesteps=2048,
                  out=folder / f"agail-{ratio}-{seed}")  # fmt: skip
    train("Hopper-v5", hopper_demos.mask(0.75), method="state-gail", out=folder / "state",
          callback=lambda row: row["time/iterations"] < 2)  # fmt: skip
    return folder


def test_page(runs, tmp_path):
    done = report(runs, "--out", tmp_path / "r.html", "--figures", tmp_path / "figures")
    assert done.returncode == 0 and "7 runs" in done.stdout, done.stderr
    text = (tmp_path / "r.html").read_text()
    assert "7 runs" in text and "3 of 3" in text and "IQM" in text and "missing 0.75" in text
    assert "0 of 1" in text  # one was stopped
    assert not re.search(r"(src|href)=\"?https?:|@import|url\(http", text), "from elsewhere"
    pictures = re.findall(r"<svg.*?</svg>", text, re.DOTALL)
    files = sorted(path.name for path in (tmp_path / "figures").iterdir())
    assert len(pictures) == len(files) / 2 >= 8
    assert any("missing_ratio" in name for name in files)
    for picture in pictures:
        ElementTree.fromstring(picture)
    for path in (tmp_path / "figures").glob("*.png"):
        assert path.read_bytes().startswith(b"\x89PNG") and path.stat().st_size > 10_000


def test_a_run_that_learns_without_updates(runs, hopper_demos, tmp_path):
    train("Hopper-v5", hopper_demos, method="bc", out=tmp_path / "bc")
    done = report(runs / "agail-0.25-0", tmp_path / "bc", "--out", tmp_path / "r.html")
    assert done.returncode == 0 and "2 runs" in done.stdout, done.stderr
    text = (tmp_path / "r.html").read_text()
    assert "Hopper-v5: bc" in text and 'class="broken"' not in text
    done = report(tmp_path / "bc", "--out", tmp_path / "alone.html")
    assert done.returncode == 0 and "1 of 1" in (tmp_path / "alone.html").read_text()


def test_one_run_and_broken_ones(runs, tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "config.toml").write_text("[run")
    words = [runs / "state", tmp_path / "empty", tmp_path / "broken"]
    done = report(*words, "--out", tmp_path / "r.html")
    assert done.returncode == 0 and "1 run," in done.stdout, done.stderr
    text = (tmp_path / "r.html").read_text()
    assert "empty: there is no run in this folder" in text and "broken: " in text


def test_wrong_input(tmp_path):
    done = report(tmp_path / "absent")
    assert done.returncode == 2 and "no such folder" in done.stderr
    done = report(tmp_path, "--out", tmp_path / "absent" / "r.html")
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1
