"""Running the command line. AGAIL_BUILD_DIR names the build folder (default build/release)."""

import json
import os
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ.get("AGAIL_BUILD_DIR", ROOT / "build" / "release")).resolve()

# Updates of a few milliseconds, so that a run has many.
SMALL = [
    f"--set={setting}"
    for setting in (
        "run.batch_steps=256",
        "run.evaluate_every=4",
        "run.evaluation_episodes=3",
        "run.checkpoint_every=2",
        "policy.hidden=[8,8]",
        "value.hidden=[8,8]",
        "discriminator.hidden=[8,8]",
        "discriminator.minibatches=2",
        "discriminator.minibatch=32",
        "guide.hidden=8",
        "bc.epochs=5",
        "inverse_dynamics.epochs=3",
    )
]


class Agail:
    program = BUILD / "agail"

    def run(self, *arguments, **options):
        command = [self.program, *map(str, arguments)]
        options.setdefault("timeout", 300)
        return subprocess.run(command, capture_output=True, text=True, **options)

    def start(self, *arguments):
        command = [self.program, *map(str, arguments)]
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

    def __call__(self, *arguments, **options):
        """Its standard output; it must succeed."""
        done = self.run(*arguments, **options)
        assert done.returncode == 0, done.stderr
        return done.stdout

    def json(self, *arguments):
        return json.loads(self(*arguments, "--json"))

    def refused(self, *arguments):
        """Its error: wrong input is exit code 2 and one line, and no result."""
        done = self.run(*arguments)
        assert done.returncode == 2, f"exit code {done.returncode}: {done.stderr}"
        assert done.stdout == ""
        lines = [line for line in done.stderr.splitlines() if not line.startswith("agail: note: ")]
        assert len(lines) == 1 and lines[0].startswith("agail: "), done.stderr
        return lines[0]
