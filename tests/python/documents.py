"""What the documents say to type: their blocks of commands and code, and names in running text."""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

from program import ROOT

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
# In front of a block: <!-- synopsis --> lists commands and their options, not to be run as they are;
# <!-- not run: REASON --> says why nobody can run it here.
MARK = re.compile(r"<!-- (synopsis|not run: .+) -->")


@dataclass
class Block:
    page: Path
    line: int
    language: str  # of a fence; "" for an indented block
    text: str
    mark: str = ""

    def __str__(self) -> str:
        return f"{self.page.relative_to(ROOT)}:{self.line}"

    @property
    def is_python(self) -> bool:
        return self.language == "python" or (
            not self.language and self.text.startswith(("import ", "from "))
        )

    def commands(self) -> list[list[str]]:
        """The words of each line; a line that ends in \\ goes on in the next, # begins a comment."""
        joined = self.text.replace("\\\n", " ")
        found = [shlex.split(line, comments=True) for line in joined.splitlines()]
        return [words for words in found if words]


def blocks(page: Path) -> list[Block]:
    """Fenced blocks, and blocks indented by four spaces after an empty line."""
    lines = page.read_text().splitlines()
    found: list[Block] = []
    mark, i = "", 0
    while i < len(lines):
        start = i
        if match := MARK.fullmatch(lines[i]):
            mark = match[1]
            i += 1
            continue
        if lines[i].startswith("```"):
            i += 1
            while not lines[i].startswith("```"):
                i += 1
            content, language = lines[start + 1 : i], lines[start][3:].strip()
            i += 1
        elif lines[i].startswith("    ") and (i == 0 or not lines[i - 1].strip()):
            while i < len(lines) and (lines[i].startswith("    ") or not lines[i].strip()):
                i += 1
            content, language = [line[4:] for line in lines[start:i]], ""
        else:
            mark = "" if lines[i].strip() else mark
            i += 1
            continue
        found.append(Block(page, start + 1, language, "\n".join(content).strip("\n"), mark))
        mark = ""
    return found


def spans(page: Path) -> list[str]:
    """`code` in running text."""
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)
    text = re.sub(r"^    .*$", "", text, flags=re.MULTILINE)
    return [" ".join(span.split()) for span in re.findall(r"`([^`]+)`", text)]


def options(words: list[str]) -> list[str]:
    """The names of the options among words: --set=a=b is --set, [--json] is --json."""
    return [name for word in words for name in re.findall(r"^\[?(--[a-z][a-z-]*)", word)]
