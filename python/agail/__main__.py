"""The command line: `agail` and `python -m agail`."""

import os
import signal
import sys
from pathlib import Path

PROGRAM = Path(__file__).with_name("bin") / "agail"
# These may meet an environment that only Python has; the program alone does the rest.
WITH_ENVIRONMENTS = ("train", "eval", "record")


def main() -> None:
    words = sys.argv[1:]
    if not words or words[0] not in WITH_ENVIRONMENTS:
        # Extensions (agail-report...) are installed beside this Python.
        here = str(Path(sys.executable).parent)
        path = os.environ.get("PATH", os.defpath)
        os.environ["PATH"] = path if here in path.split(os.pathsep) else f"{path}{os.pathsep}{here}"
        os.execv(PROGRAM, ["agail", *words])
    from agail import _core
    from agail._source import Registered

    signal.signal(signal.SIGINT, signal.SIG_DFL)  # as a program, outside of runs: it ends
    source = Registered()
    try:
        code = _core.command_line(["agail", *words], source)
    finally:
        source.close()
    sys.stdout.flush()
    sys.exit(code)


if __name__ == "__main__":
    main()
