"""What ./quickstart found, as a table and a plot of text. Argument: the folder of its runs."""

import csv
import json
import sys
from pathlib import Path

METHODS = {  # folder: what it learned from
    "bc": "the actions that are there (behaviour cloning)",
    "state-gail": "the states",
    "agail": "the states and the actions that are there",
}
CURVES = {"state-gail": "o", "agail": "#"}
BOTH = "@"
WIDTH, HEIGHT = 70, 16

Curve = list[tuple[float, float]]


def table(runs: Path, demonstrations: dict) -> None:
    print(f"\n{'':12} {'mean return':>11} {'std. error':>11} {'share':>7}   learned from")
    shown = f"{demonstrations['mean_return']:11.1f} {'':11} {'100 %':>7}"
    missing = 100 * demonstrations["missing_ratio"]
    print(
        f"{'demos':12} {shown}   {demonstrations['episodes']} episodes, {missing:.0f} % of actions missing"
    )
    for method, source in METHODS.items():
        result = json.loads((runs / f"{method}.json").read_text())
        share = result["share_of_demonstrations"]
        percent = f"{100 * share:.0f} %" if share is not None else "?"
        numbers = f"{result['mean_return']:11.1f} {result['standard_error']:11.1f} {percent:>7}"
        print(f"{method:12} {numbers}   {source}")


def curve(run: Path) -> Curve:
    with (run / "progress.csv").open(newline="") as file:
        return [
            (float(row["time/total_timesteps"]), float(row["eval/mean_reward"]))
            for row in csv.DictReader(file)
            if row["eval/mean_reward"]
        ]


def plot(curves: dict[str, Curve], level: float) -> None:
    """The curves over steps, and a dotted line at `level`."""
    points = [point for curve in curves.values() for point in curve]
    if not points:
        return
    right = max(x for x, _ in points)
    top = max([level, *(y for _, y in points)]) * 1.05
    bottom = min(0.0, *(y for _, y in points))

    def line_of(y: float) -> int:
        return round((top - y) / (top - bottom) * (HEIGHT - 1))

    canvas = [[" "] * WIDTH for _ in range(HEIGHT)]
    canvas[line_of(level)] = list("." * WIDTH)
    for name, points in curves.items():
        for (x0, y0), (x1, y1) in zip(points, points[1:] + points[-1:], strict=True):
            first, last = (round(x / right * (WIDTH - 1)) for x in (x0, x1))
            for column in range(first, last + 1):
                share = (column - first) / max(last - first, 1)
                row, mark = canvas[line_of(y0 + share * (y1 - y0))], CURVES[name]
                row[column] = mark if row[column] in (" ", ".", mark) else BOTH
    marks = [*(f"{CURVES[name]} {name}" for name in curves), f"{BOTH} both", ". demonstrations"]
    key = "   ".join(marks)
    print(f"\nReturn over steps of training (evaluated without noise):   {key}\n")
    for line, row in enumerate(canvas):
        labelled = line in (0, line_of(level), HEIGHT - 1)
        value = top - (top - bottom) * line / (HEIGHT - 1)
        label = f"{level if line == line_of(level) else value:8.0f}" if labelled else ""
        print(f"{label:>8} |{''.join(row).rstrip()}")
    print(f"{'':8} +{'-' * WIDTH}\n{'0':>10}{f'{right:,.0f} steps':>{WIDTH}}")


def main(runs: Path) -> None:
    demonstrations = json.loads((runs / "demonstrations.json").read_text())
    table(runs, demonstrations)
    plot({method: curve(runs / method) for method in CURVES}, demonstrations["mean_return"])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
