"""What a measurement prints: one JSON line."""

import json
from importlib.metadata import version


def report(rate: float, packages: list[str], **more: object) -> None:
    """`rate`: samples a second."""
    versions = {name: version(name) for name in packages}
    print(json.dumps({"samples_per_second": rate, "versions": versions, **more}))
