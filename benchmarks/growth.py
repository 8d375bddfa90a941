#!/usr/bin/env python3
"""How the cost of a sample grows; writes results/growth.csv and the tables of docs/performance.md.

    benchmarks/growth.py [--work DIR] [--rounds N] [--quick] [--only PART]
    benchmarks/growth_figures.py                        draws docs/figures/growth-*.svg from results/growth.csv

Parts: batch (samples an update), width (units of each hidden layer), observations (environments of different sizes),
demonstrations (their number, with the guide's nearest-state look-up), file (reading and training from large HDF5 files), threads,
ranks. All but `file` come from `agail bench`, method agail, preset paper, half of the actions missing, in --rounds of which
the median counts; learning is all of training but the time spent in the environment.

What was measured is kept in --work; run it again after an interruption, remove DIR/measurements*.json to start anew. --quick:
one round of small sizes, to see that everything works. Leave the machine alone meanwhile.
"""

import argparse
import csv
import json
import math
import os
import platform
import shutil
import subprocess
import sys
import time
from datetime import date
from pathlib import Path
from statistics import median

from machine import AGAIL, ROOT, Kept, cpu_model, fill

PAGE = ROOT / "docs/performance.md"
COLUMNS = ["part", "variant", "x", "size", "stepping_us", "training_us", "learning_us"]
COLUMNS += ["guide_us", "peak_memory_mb", "seconds"]


class Growth:
    def __init__(self, work: Path, rounds: int, quick: bool):
        self.work, self.rounds, self.quick = work, rounds, quick
        self.kept = Kept(work, quick)

    def keep(self, key: str, measure) -> dict:
        if key not in self.kept:
            self.kept.put(key, measure())
            print(f"{key}: {json.dumps(self.kept[key])}", flush=True)
        return self.kept[key]

    def bench(
        self, environment: str, turn: int, samples: int, *arguments: str, batch=1024, launcher=()
    ) -> dict:
        """Over about `samples` samples."""
        updates = max(2, round((samples // 8 if self.quick else samples) / batch))
        command = [*launcher, AGAIL, "bench", environment, "--json", "--updates", str(updates)]
        command += [f"--set=run.batch_steps={batch}", *arguments]

        def measure() -> dict:
            done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
            result = json.loads(done.stdout)[0]
            return {
                "stepping_us": result["stepping_us"],
                "training_us": result["training_us"],
                "learning_us": result["training_us"] - result["split_us"]["physics"],
                "guide_us": result["split_us"].get("guide", 0),
                "peak_memory_mb": result["peak_memory_bytes"] / 1e6,
            }

        shown = [*launcher, *command[len(launcher) + 1 :]]
        return self.keep(f"{' '.join(shown)} ({turn})", measure)

    def in_rounds(self, points: list[tuple[dict, object]]) -> list[dict]:
        """points: (columns, function of the turn). The median over the turns, which alternate."""
        turns = [[measure(turn) for _, measure in points] for turn in range(self.rounds)]
        return [
            head | {name: median(turn[i][name] for turn in turns) for name in turns[0][i]}
            for i, (head, _) in enumerate(points)
        ]

    def batch(self) -> list[dict]:
        sizes = [256, 1024, 4096] if self.quick else [256, 1024, 4096, 16384, 65536]
        return self.in_rounds(
            [
                (
                    {"part": "batch", "variant": "Hopper-v5", "x": size, "size": size},
                    lambda turn, size=size: self.bench("Hopper-v5", turn, 1 << 16, batch=size),
                )
                for size in sizes
            ]
        )

    def width(self) -> list[dict]:
        def sets(width: int) -> list[str]:
            layers = [f"--set={net}.hidden=[{width},{width}]" for net in ("policy", "value")]
            layers.append(f"--set=discriminator.hidden=[{width},{width}]")
            return [*layers, f"--set=guide.hidden={width}"]

        widths = [64, 128, 256] if self.quick else [64, 128, 256, 512, 1024]
        return self.in_rounds(
            [
                (
                    # size: the weights of the policy
                    {"part": "width", "variant": "Hopper-v5", "x": w, "size": w * (w + 11 + 3)},
                    lambda turn, w=w: self.bench("Hopper-v5", turn, 1 << 15, *sets(w)),
                )
                for w in widths
            ]
        )

    def observations(self) -> list[dict]:
        environments = {"CartPole-v1": 4, "Hopper-v5": 11, "Walker2d-v5": 17, "HalfCheetah-v5": 17}
        environments |= {"Ant-v5": 105, "Humanoid-v5": 348, "Humanoid-v4": 376}
        if self.quick:
            environments = {"CartPole-v1": 4, "Hopper-v5": 11, "Ant-v5": 105, "Humanoid-v4": 376}
        same = [f"--set={net}.hidden=[100,100]" for net in ("policy", "value")]
        same += ["--set=policy.normalize_observations=true", "--set=discriminator.every=3"]
        return self.in_rounds(
            [
                (
                    {"part": "observations", "variant": name, "x": size, "size": size},
                    lambda turn, name=name: self.bench(name, turn, 1 << 15, *same),
                )
                for name, size in environments.items()
            ]
        )

    def demonstrations(self) -> list[dict]:
        cases = [("Hopper-v5", "random", 7), ("Hopper-v5", "nearest", 7)]
        cases.append(("Humanoid-v4", "nearest", 4))  # nearly a scan: 10^5 takes minutes
        most = 5 if self.quick else 7
        points = []
        for environment, target, largest in cases:
            for exponent in range(3, min(largest, most) + 1):
                n = 10**exponent
                arguments = [f"--demonstrations={n}", f"--set=guide.target={target}"]
                head = {"part": "demonstrations", "variant": f"{environment}, {target}"}
                points.append(
                    (
                        head | {"x": n, "size": n},
                        lambda turn, e=environment, a=tuple(arguments): self.bench(
                            e, turn, 1 << 15, *a
                        ),
                    )
                )
        return self.in_rounds(points)

    def file(self) -> list[dict]:
        rows = []
        for n in [10**4, 10**5] if self.quick else [10**5, 10**6, 10**7]:
            demos = self.work / f"hopper-{n}.hdf5"
            run = self.work / f"run-{n}"
            commands = {
                "inspect": ["inspect", demos],
                "train": [
                    "train",
                    "Hopper-v5",
                    "--method=agail",
                    "--preset=paper",
                    f"--demos={demos}",
                    f"--out={run}",
                    "--timesteps=3072",
                    "--set=run.evaluate_every=0",
                    "--threads=1",
                ],
            }
            for name, command in commands.items():

                def measure(command=command, demos=demos, n=n, run=run) -> dict:
                    # A process of its own: a child's peak memory begins with its parent's.
                    script = ROOT / "benchmarks/growth_file.py"
                    subprocess.run([sys.executable, script, demos, str(n)], check=True)
                    shutil.rmtree(run, ignore_errors=True)
                    return timed([AGAIL, *map(str, command)])

                head = {"part": "file", "variant": name, "x": n, "size": n}
                rows.append(head | self.keep(f"{name} a file of {n} transitions", measure))
            demos.unlink(missing_ok=True)
            shutil.rmtree(run, ignore_errors=True)
        return rows

    def threads(self) -> list[dict]:
        cpus = len(os.sched_getaffinity(0))
        counts = [c for c in (1, 2, 3, 4, 8, 16, 32, 64) if c <= 2 * cpus]
        return self.side_by_side("threads", {c: ((), f"--threads={c}") for c in counts})

    def ranks(self) -> list[dict]:
        if not shutil.which("mpirun"):
            print("ranks: left out, there is no mpirun")
            return []
        cpus = len(os.sched_getaffinity(0))
        counts = [c for c in (1, 2, 4, 8) if c <= 2 * cpus]
        launch = ["mpirun", "--allow-run-as-root", "--oversubscribe", "--bind-to", "none", "-n"]
        return self.side_by_side("ranks", {c: ((*launch, str(c)), "--threads=1") for c in counts})

    def side_by_side(self, part: str, ways: dict) -> list[dict]:
        def measure(turn: int, launcher: tuple, threads: str) -> dict:
            arguments = [threads, "--set=run.lanes=8"]
            return self.bench("Hopper-v5", turn, 1 << 17, *arguments, batch=8192, launcher=launcher)

        return self.in_rounds(
            [
                (
                    {"part": part, "variant": "Hopper-v5", "x": count, "size": count},
                    lambda turn, way=way: measure(turn, *way),
                )
                for count, way in ways.items()
            ]
        )


PARTS = ["batch", "width", "observations", "demonstrations", "file", "threads", "ranks"]


def timed(command: list[str]) -> dict:
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        sys.exit(f"failed: {' '.join(command)}")
    seconds = time.perf_counter() - start
    return {"seconds": seconds, "peak_memory_mb": usage.ru_maxrss * 1024 / 1e6}


def power(rows: list[dict], of: str) -> str:
    """How learning grows with `size` between the two largest sizes."""
    a, b = sorted(rows, key=lambda row: row["size"])[-2:]
    if min(a["learning_us"], b["learning_us"]) <= 0:
        return "Learning is too little to be told from the noise of this machine."
    exponent = math.log(b["learning_us"] / a["learning_us"]) / math.log(b["size"] / a["size"])
    return f"At the end, learning a sample goes with the {exponent:.2f}th power of {of}."


def table(rows: list[dict], columns: dict[str, str], digits: int = 2) -> str:
    """columns: key -> heading"""
    lines = ["| " + " | ".join(columns.values()) + " |", "| --- " * len(columns) + "|"]
    for row in rows:
        cells = [f"{row[key]:,.{digits}f}" if isinstance(row[key], float) else f"{row[key]:,}"
                 if isinstance(row[key], int) else row[key] for key in columns]  # fmt: skip
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def text_of(part: str, rows: list[dict]) -> str:
    costs = {"stepping_us": "stepping, us", "training_us": "training, us"}
    learning = {"learning_us": "learning, us a sample"}
    guide = {"guide_us": "guide, us a sample", "peak_memory_mb": "peak memory, MB"}
    if part == "batch":
        grows = power(rows, "the batch")
        return f"{table(rows, {'x': 'samples a batch'} | costs | learning)}\n\n{grows}"
    if part == "width":
        grows = power(rows, "the number of weights")
        return f"{table(rows, {'x': 'hidden units', 'size': 'weights of the policy'} | learning)}\n\n{grows}"
    if part == "observations":
        columns = {"variant": "environment", "x": "observations"} | costs | learning
        grows = power([rows[0], rows[-1]], "the number of observations")
        return f"{table(rows, columns)}\n\n{grows}"
    if part == "demonstrations":
        return table(rows, {"variant": "environment, guide.target", "x": "transitions"} | guide)
    if part == "file":
        before: dict[str, dict] = {}
        for row in rows:
            last = before.get(row["variant"])
            row["each"] = ""
            if last:
                more = row["peak_memory_mb"] - last["peak_memory_mb"]
                row["each"] = 1e6 * more / (row["x"] - last["x"])
            before[row["variant"]] = row
        columns = {"variant": "command", "x": "transitions", "seconds": "seconds"}
        columns |= {"peak_memory_mb": "peak memory, MB", "each": "bytes a further transition"}
        return table(rows, columns, 1)
    for row in rows:
        row["gain"] = rows[0]["training_us"] / row["training_us"]
    return table(rows, {"x": part} | costs | {"gain": "times one"})


def write_csv(path: Path, rows: list[dict], parts: list[str]) -> None:
    """Parts that were not measured now stay as they are."""
    if path.exists():
        with path.open() as file:
            rows = [row for row in csv.DictReader(file) if row["part"] not in parts] + rows
    rows.sort(key=lambda row: PARTS.index(row["part"]))
    path.parent.mkdir(exist_ok=True)
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n", extrasaction="ignore")
        writer.writeheader()
        for row in rows:
            writer.writerow({k: round(v, 3) if isinstance(v, float) else v for k, v in row.items()})


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--work", type=Path, default=ROOT / "runs/growth")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--quick", action="store_true", help="one round of small sizes")
    parser.add_argument("--only", choices=PARTS, action="append")
    options = parser.parse_args()
    rounds = 1 if options.quick else options.rounds
    growth = Growth(options.work.resolve(), rounds, options.quick)
    parts = options.only or PARTS
    command = "benchmarks/growth.py" + (" --quick" if options.quick else f" --rounds {rounds}")
    about = (
        f"`{command}`, {date.today()}, {cpu_model()}, {len(os.sched_getaffinity(0))} CPUs, Linux {platform.release()}"
        + (
            ": one round, too short to be quoted."
            if options.quick
            else ": one round."
            if rounds == 1
            else f": median of {rounds} rounds."
        )
    )
    rows = []
    for part in parts:
        found = getattr(growth, part)()
        if not found:
            continue
        rows += found
        text = f"{about}\n\n{text_of(part, found)}"
        print(f"\n{part}\n{text}\n", flush=True)
        fill(PAGE, f"growth {part}", text)
    write_csv(ROOT / "results/growth.csv", rows, parts)


if __name__ == "__main__":
    main()
