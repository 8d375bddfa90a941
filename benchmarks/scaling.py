#!/usr/bin/env python3
"""What a second core is worth: training and stepping with 2 threads, and as 2 ranks, against one thread.

`agail bench` with 8 lanes and batches of 8,192, the three variants in turn, --rounds times; prints the median of each round's
ratio, and refuses if the bits differ. Leave the machine alone meanwhile.
"""

import argparse
import json
import shutil
import subprocess
import sys
from statistics import median

from machine import AGAIL

MPIRUN = ["mpirun", "--allow-run-as-root", "--bind-to", "none", "-n", "2"]


def bench(environment: str, preset: str, launcher: list[str], threads: int, updates: int) -> dict:
    command = [*launcher, AGAIL, "bench", environment, "--preset", preset, "--json"]
    command += ["--threads", str(threads), "--updates", str(updates)]
    command += ["--set=run.lanes=8", "--set=run.batch_steps=8192"]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    return json.loads(done.stdout)[0]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("environments", nargs="*", default=["Hopper-v5"])
    parser.add_argument("--preset", default="paper")
    parser.add_argument("--updates", type=int, default=8)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    variants = {"1 thread": ([], 1), "2 threads": ([], 2)}
    if shutil.which("mpirun"):
        variants["2 ranks"] = (MPIRUN, 1)
    print("| environment | variant | training, us a sample | times one thread | stepping alone |")
    print("| --- | --- | --- | --- | --- |")
    for environment in options.environments:
        rounds = [
            {
                name: bench(environment, options.preset, launcher, threads, options.updates)
                for name, (launcher, threads) in variants.items()
            }
            for _ in range(options.rounds)
        ]
        if len({result["signature"] for each in rounds for result in each.values()}) != 1:
            sys.exit(f"{environment}: the bits differ")
        for name in variants:
            cost = median(each[name]["training_us"] for each in rounds)
            gain = median(
                each["1 thread"]["training_us"] / each[name]["training_us"] for each in rounds
            )
            bare = median(
                each["1 thread"]["stepping_us"] / each[name]["stepping_us"] for each in rounds
            )
            print(f"| {environment} | {name} | {cost:.1f} | {gain:.2f} | {bare:.2f} |")


if __name__ == "__main__":
    main()
