"""What benchmarks share: the machine and the build that they measure, measurements that are kept, tables in documents."""

import hashlib
import json
import os
import platform
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
AGAIL = os.environ.get("AGAIL", str(ROOT / "build/release/agail"))


def cpu_model() -> str:
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":")[1].strip()
    return platform.processor()


def fill(page: Path, mark: str, content: str) -> None:
    """Replaces what stands between <!-- MARK --> and the next <!-- end -->."""
    begin = f"<!-- {mark} -->\n"
    before, found, rest = page.read_text().partition(begin)
    _, end, after = rest.partition("<!-- end -->")
    if not (found and end):
        raise SystemExit(f"{page}: no place marked {begin.strip()} ... <!-- end -->")
    page.write_text(f"{before}{begin}{content}\n{end}{after}")


def with_seeds(environment: str, seeds: set[int]) -> str:
    """The heading of an environment's column: with the numbers of seeds of its cells unless all have the experiment's six."""
    if seeds == {6}:
        return environment
    few = sorted({min(seeds, default=0), max(seeds, default=0)})
    return f"{environment}, {' to '.join(map(str, few))} {'seed' if few == [1] else 'seeds'}"


class Kept(dict):
    """A dict of JSON values in a file of `folder`, one of each build of agail; put() writes it, whole or not at all."""

    def __init__(self, folder: Path, quick: bool):
        folder.mkdir(parents=True, exist_ok=True)
        build = hashlib.sha256(Path(AGAIL).read_bytes()).hexdigest()[:12]
        self.path = folder / f"measurements-{build}{'-quick' if quick else ''}.json"
        super().__init__(json.loads(self.path.read_text()) if self.path.exists() else {})

    def put(self, key: str, value: dict) -> None:
        self[key] = value
        partial = self.path.with_suffix(".partial")
        partial.write_text(json.dumps(self, indent=1))
        partial.rename(self.path)
