"""What the extensions agail-export, agail-report and agail-video share."""

from __future__ import annotations

import argparse
import errno
import os
import sys
from collections.abc import Callable
from typing import NoReturn

from agail._core import InputError


class Parser(argparse.ArgumentParser):
    """Wrong arguments end as agail's: one line, exit code 2."""

    def error(self, message: str) -> NoReturn:
        print(f"agail: {message}; see {self.prog} --help", file=sys.stderr)
        sys.exit(2)


def run(work: Callable[[], None]) -> None:
    """Ends the process: 0 done, 2 the user's input, 1 the machine's failure."""
    try:
        work()
    except InputError as error:
        print(f"agail: {error}", file=sys.stderr)
        sys.exit(2)
    except (OSError, RuntimeError) as error:
        print(f"agail: {error}", file=sys.stderr)
        sys.exit(1)


def unwritten(path: str | os.PathLike[str], error: OSError, advice: str) -> Exception:
    """What to raise: InputError where the path is wrong, RuntimeError where the machine failed."""
    told = f"{os.fspath(path)}: cannot be written ({error.strerror})"
    users = (
        errno.ENOENT,
        errno.EISDIR,
        errno.EACCES,
        errno.ENOTDIR,
        errno.ENAMETOOLONG,
        errno.EROFS,
    )
    if error.errno in users:
        return InputError(f"{told}; {advice}")
    return RuntimeError(told)


def missing(package: str, extra: str) -> InputError:
    return InputError(f"this needs the package {package}; pip install 'agail[{extra}]'")
