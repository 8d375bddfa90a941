"""A hook of mkdocs (mkdocs.yml): the site also has what lies outside of docs/.

The pages are written for whoever reads the tree: links are paths, and some lead out of docs/. README.md, CONTRIBUTING.md and
CHANGELOG.md become pages; other files that a page links are copied to the site as they are; a link to a folder, of
which a site can show nothing, becomes plain text.
"""

import posixpath
import re
from pathlib import Path

from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parent.parent
PAGES = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changes.md",
}
ORIGINS = {page: origin for origin, page in PAGES.items()}
# Text and target of links and pictures; code spans are skipped.
LINK = re.compile(r"`[^`\n]+`|(!?)\[((?:[^\[\]]|`[^`]*`)*)\]\(([^()\s]+)\)")


def origin(page: str) -> str:
    """Where a page of the site lies in the tree."""
    return ORIGINS.get(page, f"docs/{page}")


def in_tree(page: str, target: str) -> str | None:
    """The path in the tree that a link means; None for addresses and links within the page."""
    if not target or target.startswith("#") or re.match(r"[a-z]+:", target):
        return None
    return posixpath.normpath(posixpath.join(posixpath.dirname(origin(page)), target))


def in_site(path: str) -> str:
    if path in PAGES:
        return PAGES[path]
    return path.removeprefix("docs/") if path.startswith("docs/") else f"source/{path}"


def on_files(files, config):
    for name, page in PAGES.items():
        files.append(File.generated(config, page, content=(ROOT / name).read_text()))
    for page in list(files.documentation_pages()):
        for match in LINK.finditer(page.content_string):
            path = in_tree(page.src_uri, (match[3] or "").partition("#")[0])
            if path is None or not (ROOT / path).is_file():
                continue
            if files.get_file_from_path(in_site(path)) is None:
                copied = File.generated(config, in_site(path), abs_src_path=str(ROOT / path))
                files.append(copied)
    return files


def on_page_markdown(markdown, page, config, files):
    here = posixpath.dirname(page.file.src_uri)

    def rewritten(match: re.Match) -> str:
        target, hash_, anchor = (match[3] or "").partition("#")
        path = in_tree(page.file.src_uri, target)
        if path is None:
            return match[0]
        if (ROOT / path).is_dir():
            return match[2]
        link = posixpath.relpath(in_site(path), here or ".") + hash_ + anchor
        return f"{match[1]}[{match[2]}]({link})"

    return LINK.sub(rewritten, markdown)
