"""Prepares the chapters for mdBook: includes documents of the repository as a whole, leads their links to where they are in the book, and
writes the references of languages.

A link to a document that a chapter includes becomes a link to that chapter. A link to another file of the repository begins with the
address of the repository, if book.toml states one (`[preprocessor.repository] address`). If a folder of the book is stated (`files`, as
`.ci/site` does), pictures and, without an address, all links lead to copies there, which site_files.py makes. Otherwise links lead to the
file in the checkout in which the book was built.
"""

import json
import os
import pathlib
import re
import sys

import pages
import references
import site_files


def led(
    text: str,
    folder: pathlib.Path,
    chapter: pathlib.Path,
    places: dict,
    address: str | None,
    output: pathlib.Path,
    files: str | None = None,
) -> str:
    """A text from a document in `folder` with links as they are in a chapter."""

    def replaced(found: re.Match) -> str:
        target = found[1]
        path, _, anchor = target.partition("#")
        if not path or ":" in path or path.startswith("/"):
            return found[0]
        there = pathlib.Path(os.path.normpath(folder / path))
        there = places.get(there, there)
        if there.is_relative_to(pages.SOURCES):
            new = os.path.relpath(there, chapter.parent)
        elif address and not (files and there.suffix in site_files.PICTURES):
            new = f"{address}/{there.relative_to(pages.ROOT).as_posix()}"
        elif files:
            copy = pathlib.PurePosixPath(files, site_files.copy_of(there.relative_to(pages.ROOT)))
            new = os.path.relpath(copy, chapter.parent.relative_to(pages.SOURCES))
        else:
            new = os.path.relpath(there, output / chapter.parent.relative_to(pages.SOURCES))
        if not there.is_relative_to(pages.SOURCES) and new.endswith(".md"):
            # mdBook takes what ends in .md for a chapter.
            new = new.removesuffix(".md") + "%2Emd"
        return found[0].replace(target, new.replace(os.sep, "/") + ("#" + anchor if anchor else ""))

    # Blocks and code stay as they are.
    parts = re.split(r"(^\s*```.*?^\s*```[ \t]*$|`[^`\n]+`)", text, flags=re.M | re.S)
    return "".join(part if number % 2 else pages.LINK.sub(replaced, part) for number, part in enumerate(parts))


def main() -> None:
    if sys.argv[1:2] == ["supports"]:
        return
    context, book = json.load(sys.stdin)
    own = context["config"].get("preprocessor", {}).get("repository", {})
    address, files = own.get("address"), own.get("files")
    output = (pages.BOOK / context["config"]["build"]["build-dir"]).resolve()
    places = {}
    for chapter in pages.chapters():
        for name in pages.included(chapter.read_text(encoding="utf-8")):
            places[(chapter.parent / name).resolve()] = chapter

    def prepare(items: list) -> None:
        for item in items:
            if not isinstance(item, dict) or "Chapter" not in item:
                continue
            chapter = pages.SOURCES / item["Chapter"]["path"]

            def whole(found: re.Match) -> str:
                document = (chapter.parent / found[1]).resolve()
                text = document.read_text(encoding="utf-8")
                return led(text, document.parent, chapter, places, address, output, files)

            own = led(item["Chapter"]["content"], chapter.parent, chapter, places, address, output, files)
            item["Chapter"]["content"] = references.replaced(pages.INCLUDE.sub(whole, own))
            prepare(item["Chapter"]["sub_items"])

    prepare(book["items"] if "items" in book else book["sections"])
    json.dump(book, sys.stdout)


if __name__ == "__main__":
    main()
