"""Reads Markdown: the chapters of the book, the fenced blocks of a page, its links, and the anchors of its headings."""

import pathlib
import re
from typing import Iterator, NamedTuple

BOOK = pathlib.Path(__file__).resolve().parent
ROOT = BOOK.parents[1]
SOURCES = BOOK / "src"

INCLUDE = re.compile(r"^\{\{#include ([^}:]+\.md)\}\}$", re.MULTILINE)
# The target of a link or picture. A target has no blanks, and a title may follow.
LINK = re.compile(r"\]\(<?([^()\s<>]*(?:\([^()\s]*\)[^()\s<>]*)*)>?(?:\s+\"[^\"]*\")?\)")
ANCHOR = re.compile(r"<a id=\"([^\"]+)\"></a>")


class Block(NamedTuple):
    """A fenced block: the language and the words behind it, the text, and the line where it begins."""

    language: str
    words: list[str]
    text: str
    line: int


def chapters() -> list[pathlib.Path]:
    """The pages that SUMMARY.md lists, in its order."""
    listed = LINK.findall((SOURCES / "SUMMARY.md").read_text(encoding="utf-8"))
    return [SOURCES / name for name in listed]


def blocks(text: str) -> Iterator[Block]:
    """The fenced blocks of a page, in order."""
    fence, words, lines, start = None, [], [], 0
    for number, line in enumerate(text.splitlines(), 1):
        mark = re.match(r"\s*(```+)(.*)$", line)
        if fence is None and mark:
            fence, words, lines, start = mark[1], [word.strip() for word in mark[2].split(",")], [], number
        elif fence is not None and line.strip() == fence:
            yield Block(words[0], words[1:], "".join(f"{line}\n" for line in lines), start)
            fence = None
        elif fence is not None:
            lines.append(line)


def prose(text: str) -> str:
    """A page without its blocks and its code, on as many lines."""
    text = re.sub(r"^(\s*)(```+)[^\n]*\n.*?^\s*\2[ \t]*$", lambda found: "\n" * found[0].count("\n"), text, flags=re.M | re.S)
    return re.sub(r"(`+)[^`].*?\1", lambda found: "`" * len(found[0]), text)


def links(text: str) -> Iterator[tuple[int, str]]:
    """The targets of all links of a page, with their lines."""
    for number, line in enumerate(prose(text).splitlines(), 1):
        for target in LINK.findall(line):
            yield number, target


def anchors(text: str) -> set[str]:
    """What links to a page may name behind `#`: its headings, as GitHub and mdBook name them, and what it marks itself."""
    found: set[str] = set()
    without_blocks = re.sub(r"^\s*(```+)[^\n]*\n.*?^\s*\1[ \t]*$", "", text, flags=re.M | re.S)
    for heading in re.findall(r"^#+ +(.*?)\s*#*$", without_blocks, re.MULTILINE):
        heading = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        name = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        number = 0
        while (name if number == 0 else f"{name}-{number}") in found:
            number += 1
        found.add(name if number == 0 else f"{name}-{number}")
    return found | set(ANCHOR.findall(text))


def parts(text: str) -> list[tuple[str, str]]:
    """The files of which a chapter includes a part, with the name of the part."""
    return re.findall(r"\{\{#include ([^}:]+):(\w+)\}\}", text)


def included(text: str) -> list[str]:
    """The documents that a chapter includes as a whole."""
    return INCLUDE.findall(text)
