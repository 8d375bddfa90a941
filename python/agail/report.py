"""agail report: runs as one self-contained HTML page."""

from __future__ import annotations

import html
import io
import textwrap
from collections import defaultdict
from collections.abc import Iterable, Sized
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from agail._core import InputError
from agail._extension import Parser, missing, run, unwritten
from agail.statistics import bootstrap_interval, iqm, share_of
from agail.training import Run

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RESAMPLES = 50_000  # for the intervals of returns, as rliable
Curve = tuple[NDArray[np.float64], NDArray[np.float64]]

# Title, the column in progress.csv, and what it is measured in.
DIAGNOSTICS = (
    ("Discriminator: right about the policy's states", "discriminator/policy_accuracy", "share"),
    ("Discriminator: right about demonstrated states", "discriminator/demo_accuracy", "share"),
    ("Reward of the discriminator", "discriminator/reward", "a step"),
    ("Guide: held-out log-likelihood", "guide/held_out_log_likelihood", "nats"),
    ("Guide: what the action decides of its reward", "guide/action_variance_share", "share"),
    ("Log-likelihood of the demonstrated actions", "clone/log_likelihood", "nats"),
    ("Step of the policy", "train/kl_divergence_loss", "KL, nats"),
    ("Value network: explained variance", "train/explained_variance", "share"),
)

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1b1b1f; background: #fff; margin: 0 auto; max-width: 70rem;
  padding: 1rem; overflow-wrap: anywhere; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.2rem; margin-top: 2rem; }
.wide { overflow-x: auto; } table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { border-bottom: 1px solid #d8d8de; padding: .3rem .8rem .3rem 0; text-align: right; white-space: nowrap; }
th:first-child, td:first-child, .text th, .text td { text-align: left; }
td:first-child { white-space: normal; min-width: 12rem; }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 26rem), 1fr)); gap: 1rem; }
figure { margin: 0; } figure svg { width: 100%; height: auto; }
.broken { color: #a3261d; } footer { color: #5c5c64; margin-top: 2rem; }
@media (max-width: 48rem) { /* a row of a table becomes a block of lines */
  table, tbody, tr, td { display: block; } tr.head { display: none; }
  tr { border-bottom: 1px solid #d8d8de; padding: .5rem 0; }
  td, .text td { border: 0; padding: 0; text-align: left; white-space: normal; }
  td:first-child { font-weight: 600; }
  td:not(:first-child)::before { content: attr(data-head) ": "; color: #5c5c64; }
}
"""


class Group:
    """Runs that differ in their seed only."""

    def __init__(self, name: str, runs: list[Run]):
        self.name = name
        self.runs = runs
        self.metrics = [run.metrics for run in runs]

    def curve(self, column: str) -> list[Curve]:
        """Steps and values of each run that has some."""
        result = []
        for metrics in self.metrics:
            values = metrics.get(column, np.array([]))
            there = np.isfinite(values)
            if there.any():
                result.append((metrics["time/total_timesteps"][there], values[there]))
        return result

    def final_returns(self) -> list[float]:
        """Of each finished run, the policy's that it hands out."""
        evaluations = [
            run.summary.get("best_evaluation") or run.summary.get("last_evaluation")
            for run in self.runs
            if run.finished
        ]
        return [each["mean_return"] for each in evaluations if each]

    def reference(self) -> float | None:
        """Mean return of the demonstrations."""
        demonstrations = self.runs[0].summary.get("demonstrations") or {}
        return demonstrations.get("mean_return")

    def missing_ratio(self) -> float | None:
        return (self.runs[0].summary.get("demonstrations") or {}).get("missing_ratio")


def find_runs(folders: Iterable[str | Path]) -> tuple[list[Run], list[tuple[Path, str]]]:
    """Runs in or below the folders, and those that cannot be read, with the reason."""
    runs, broken = [], []
    for folder in map(Path, folders):
        if not folder.is_dir():
            raise InputError(
                f"{folder}: no such folder; give run folders, or folders that hold some"
            )
        found = sorted(path.parent for path in folder.rglob("config.toml"))
        if not found:
            broken.append((folder, "there is no run in this folder"))
        for path in found:
            try:
                each = Run(path)
                _ = each.settings, each.summary
                # bc learns without updates.
                if not any(len(column) for column in each.metrics.values()) and not each.finished:
                    raise ValueError("no update has ended yet")
                runs.append(each)
            except (OSError, ValueError) as error:
                broken.append((path, str(error)))
    return runs, broken


def _flat(run: Run) -> dict[str, Any]:
    settings = {
        f"{section}.{key}": value
        for section, values in run.settings.items()
        for key, value in values.items()
    }
    summary = run.summary
    identity = {"environment": summary.get("environment"), "method": summary.get("method")}
    ratio = (summary.get("demonstrations") or {}).get("missing_ratio")
    episodes = (summary.get("demonstrations") or {}).get("episodes")
    return {
        **identity,
        "missing": ratio and round(ratio, 3),
        "demonstrations": episodes,
        **settings,
    }


def differing(runs: list[Run]) -> list[str]:
    """Settings, and what the runs were trained on, that are not the same in all."""
    flat = [_flat(run) for run in runs]
    return [key for key in flat[0] if any(each.get(key) != flat[0][key] for each in flat)]


def group_runs(runs: list[Run]) -> list[Group]:
    if not runs:
        return []
    keys = differing(runs)
    groups: dict[str, list[Run]] = defaultdict(list)
    for each in runs:
        flat = _flat(each)
        words = [str(flat["method"]) if flat["method"] else each.folder.name]
        words += [f"{key} {flat[key]}" for key in keys if key not in ("method", "environment")]
        groups[f"{flat['environment'] or '?'}: " + ", ".join(words)].append(each)
    return [Group(name, members) for name, members in sorted(groups.items())]


def _count(things: Sized, name: str) -> str:
    return f"{len(things)} {name}{'s' if len(things) != 1 else ''}"


def _figure(title: str, unit: str) -> tuple[Figure, Any]:
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise missing("matplotlib", "report") from error
    figure = Figure(
        figsize=(4.8, 3), layout="constrained"
    )  # small: letters are read on a telephone
    axes = figure.add_subplot()
    axes.set_title(title, loc="left", fontsize=10)
    axes.set_ylabel(unit)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(alpha=0.25)
    axes.margins(y=0.12)
    return figure, axes


def _add_legend(figure: Figure, axes: Any) -> None:
    """Below the axes, which keep their height."""
    lines, labels = axes.get_legend_handles_labels()
    labels = [textwrap.fill(label, 60) for label in labels]
    height = sum(1 + label.count("\n") for label in labels)
    figure.set_figheight(3 + 0.2 * height)
    figure.legend(lines, labels, loc="outside lower left", fontsize=9, frameon=False)


def _look(i: int) -> dict[str, Any]:
    """Of the i-th line: colours first, then dashes."""
    return {"color": f"C{i % 10}", "linestyle": ("-", "--", ":", "-.")[i // 10 % 4]}


def _draw_curves(axes: Any, curves: list[Curve], label: str, look: dict[str, Any]) -> None:
    """Mean over the seeds, 95 % interval around it; on the steps that all have reached."""
    end = min(steps[-1] for steps, _ in curves)
    grid = np.unique(np.concatenate([steps[steps <= end] for steps, _ in curves]))
    values = np.array([np.interp(grid, steps, column) for steps, column in curves])
    marker = "o" if len(grid) == 1 else None
    axes.plot(grid, values.mean(0), label=label, marker=marker, linewidth=1.5, **look)
    if len(values) > 1:
        low, high = bootstrap_interval(values, np.mean)
        axes.fill_between(grid, low, high, color=look["color"], alpha=0.2, linewidth=0)


def curves_figure(groups: list[Group], title: str, column: str, unit: str) -> Figure | None:
    """None if no run has the column."""
    drawn = [(group, group.curve(column)) for group in groups]
    drawn = [(group, curves) for group, curves in drawn if curves]
    if not drawn:
        return None
    figure, axes = _figure(title, unit)
    for i, (group, curves) in enumerate(drawn):
        name = group.name.split(": ", 1)[1]
        _draw_curves(axes, curves, f"{name} ({_count(curves, 'run')})", _look(i))
    if column == "eval/mean_reward":
        for value in sorted({group.reference() for group, _ in drawn} - {None}):
            axes.axhline(value, color="0.4", linestyle=":", linewidth=1)
            axes.annotate("demonstrations", (0.01, value), xycoords=("axes fraction", "data"),
                          va="bottom", fontsize=9, color="0.35")  # fmt: skip
    from matplotlib.ticker import EngFormatter

    axes.set_xlabel("environment steps")
    axes.set_xlim(left=0)
    axes.xaxis.set_major_formatter(EngFormatter(sep=""))
    if column.endswith("_accuracy"):
        axes.set_ylim(0, 1)
        axes.axhline(0.5, color="0.4", linestyle=":", linewidth=1)  # cannot tell
    _add_legend(figure, axes)
    return figure


def ratio_figure(groups: list[Group]) -> Figure | None:
    """Final return against the share of missing actions; None if there is one share only."""
    lines = defaultdict(list)
    for group in groups:
        if group.missing_ratio() is not None and group.final_returns():
            method = group.runs[0].summary["method"]
            lines[method].append((group.missing_ratio(), group.final_returns()))
    if len({ratio for points in lines.values() for ratio, _ in points}) < 2:
        return None
    figure, axes = _figure(
        f"{groups[0].name.split(': ')[0]}: return over missing actions", "return (IQM)"
    )
    for i, (method, points) in enumerate(sorted(lines.items())):
        points.sort()
        ratios = [ratio for ratio, _ in points]
        middle = [iqm(np.array(returns)) for _, returns in points]
        look = _look(i)
        axes.plot(ratios, middle, marker="o", label=method, **look)
        for ratio, returns in points:
            low, high = bootstrap_interval(np.array(returns)[:, None], iqm, RESAMPLES)
            axes.plot([ratio, ratio], [low[0], high[0]], color=look["color"], alpha=0.6)
    axes.set_xlabel("share of the actions that is missing")
    _add_legend(figure, axes)
    return figure


def _table(head: list[str], rows: list[list[str]], kind: str = "") -> str:
    names = [html.escape(name) for name in head]
    lines = ["".join(f"<th>{name}</th>" for name in names)]
    for row in rows:
        cells = zip(names, map(html.escape, row))
        lines.append("".join(f'<td data-head="{name}">{cell}</td>' for name, cell in cells))
    body = "</tr><tr>".join(lines)
    return f'<div class="wide {kind}"><table><tr class="head">{body}</tr></table></div>'


def results_table(groups: list[Group]) -> str:
    rows = []
    for group in groups:
        returns = np.array(group.final_returns())
        row = [group.name, f"{len(returns)} of {len(group.runs)}"]
        if len(returns) == 0:
            rows.append([*row, *["-"] * 4])
            continue
        low, high = bootstrap_interval(returns[:, None], iqm, RESAMPLES)
        interval = f"{low[0]:,.1f} to {high[0]:,.1f}" if len(returns) > 1 else "-"
        share = share_of(returns.mean(), group.reference())
        shown = "-" if share is None else f"{100 * share:.1f} %"
        rows.append([*row, f"{iqm(returns):,.1f}", interval, f"{returns.min():,.1f}", shown])
    head = [
        "runs",
        "finished",
        "IQM of the return",
        "95 % interval",
        "worst",
        "of the demonstrations",
    ]
    return _table(head, rows)


def _inline(figure: Figure) -> str:
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    return text[text.index("<svg") :]


def figures_of(groups: list[Group]) -> dict[str, Figure]:
    """Name to figure: one of each kind for each environment."""
    result: dict[str, Figure] = {}
    for environment in sorted({group.name.split(": ")[0] for group in groups}):
        own = [group for group in groups if group.name.split(": ")[0] == environment]
        wanted = [("Return of the deterministic policy", "eval/mean_reward", "return"),
                  ("Return while training", "rollout/ep_rew_mean", "return"), *DIAGNOSTICS]  # fmt: skip
        made = {
            column: curves_figure(own, f"{environment}: {title}", column, unit)
            for title, column, unit in wanted
        }
        made["missing_ratio"] = ratio_figure(own)
        for name, figure in made.items():
            if figure is not None:
                result[f"{environment}_{name}".replace("/", "_").replace(":", "_")] = figure
    return result


def page(runs: list[Run], broken: list[tuple[Path, str]], figures: dict[str, Figure]) -> str:
    """The page; nothing in it comes from elsewhere."""
    import matplotlib

    matplotlib.rcParams["svg.hashsalt"] = "agail"  # equal runs, equal bytes
    groups = group_runs(runs)
    parts = [f"<h1>{_count(runs, 'run')}</h1>"]
    if groups:
        parts.append(results_table(groups))
    for path, reason in broken:
        parts.append(f'<p class="broken">{html.escape(f"{path}: {reason}")}</p>')
    if figures:
        drawn = "".join(f"<figure>{_inline(figure)}</figure>" for figure in figures.values())
        parts.append(f'<h2>Curves</h2><div class="figures">{drawn}</div>')
    if runs:
        keys = differing(runs)
        flat = [_flat(each) for each in runs]
        rows = [
            [
                str(each.folder),
                str(each.summary.get("seed", "?")),
                *(str(values[key]) for key in keys),
            ]
            for each, values in zip(runs, flat)
        ]
        parts.append("<h2>Runs, and what differs between them</h2>")
        parts.append(_table(["run", "seed", *keys], rows, "text"))
    body = "\n".join(parts)
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>agail: runs</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<style>{STYLE}</style><body>{body}<footer>IQM: mean without the lowest and the highest quarter "
        "of the seeds. Curves: mean. Intervals: 95 %, bootstrap over seeds.</footer></body></html>\n"
    )


def main() -> None:
    parser = Parser("agail report", description="Runs as one self-contained HTML page.")
    parser.add_argument("runs", metavar="DIR", nargs="+", help="run folders, or folders of runs")
    parser.add_argument("--out", default="report.html", help="the page; default report.html")
    parser.add_argument("--figures", metavar="DIR", help="also each figure, as SVG and PNG")
    options = parser.parse_args()

    def work() -> None:
        runs, broken = find_runs(options.runs)
        figures = figures_of(group_runs(runs))
        text = page(runs, broken, figures)
        try:
            Path(options.out).write_text(text)
            if options.figures:
                Path(options.figures).mkdir(parents=True, exist_ok=True)
                for name, figure in figures.items():
                    figure.savefig(Path(options.figures) / f"{name}.svg")
                    figure.savefig(Path(options.figures) / f"{name}.png", dpi=150)
        except OSError as error:
            raise unwritten(error.filename or options.out, error, "give another folder") from error
        print(f"{options.out}: {_count(runs, 'run')}, {_count(figures, 'figure')}")

    run(work)
