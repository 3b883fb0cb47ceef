"""Copies the files of the repository that a built book links to into the book, so that its folder can be served as it is.

    site_files.py BOOK FOLDER     BOOK is what mdBook wrote with `[preprocessor.repository] files = "FOLDER"`

Pictures are copied as they are. Other files become pages that show their text, because browsers would download many of them, and
folders become lists of the files that git tracks in them.
"""

import html
import os
import pathlib
import re
import subprocess
import sys
import urllib.parse

import pages

PICTURES = {".png", ".svg"}
PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<link rel="icon" href="data:,">
<style>
:root {{ color-scheme: light dark; font: 15px/1.45 system-ui, sans-serif; }}
body {{ margin: 1rem; }}
pre {{ font-size: 13px; tab-size: 4; }}
</style>
</head>
<body>
<p>{title}</p>
{body}
</body>
</html>
"""


def copy_of(path: pathlib.PurePath) -> pathlib.PurePosixPath:
    """The path of the copy of a file or folder of the repository, both relative to its root."""
    path = pathlib.PurePosixPath(path.as_posix())
    if (pages.ROOT / path).is_dir():
        return path / "index.html"
    if path.suffix == ".md":
        return path.with_suffix(".html")  # mdBook makes this of the links
    return path if path.suffix in PICTURES else path.with_name(path.name + ".html")


def page_of(path: pathlib.PurePosixPath, tracked: list[pathlib.PurePosixPath]) -> str:
    """The page of a file or folder."""
    if (pages.ROOT / path).is_dir():
        inside = [name for name in tracked if name.parent == path]
        rows = "".join(f'<li><a href="{urllib.parse.quote(copy_of(name).name)}">{html.escape(name.name)}</a></li>\n' for name in inside)
        return PAGE.format(title=html.escape(f"{path}/"), body=f"<ul>\n{rows}</ul>")
    text = (pages.ROOT / path).read_text(encoding="utf-8")
    return PAGE.format(title=html.escape(str(path)), body=f"<pre>{html.escape(text)}</pre>")


def linked(book: pathlib.Path, files: pathlib.Path) -> set[pathlib.Path]:
    """The paths below `files` that pages of the book link to, relative to it."""
    found = set()
    for page in book.rglob("*.html"):
        # The page of all pages, and the one that servers show instead of missing ones, have links as from elsewhere.
        if page.is_relative_to(files) or page.name in ("print.html", "404.html"):
            continue
        for target in re.findall(r'(?:href|src)="([^"#?:]+)', page.read_text(encoding="utf-8")):
            there = pathlib.Path(os.path.normpath(page.parent / urllib.parse.unquote(target)))
            if there.is_relative_to(files):
                found.add(there.relative_to(files))
    return found


def main() -> None:
    book = pathlib.Path(sys.argv[1]).resolve()
    files = book / sys.argv[2]
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=pages.ROOT, capture_output=True, text=True, check=True).stdout
    tracked = [pathlib.PurePosixPath(name) for name in sorted(filter(None, listed.split("\0")))]
    paths = {*tracked, *(folder for name in tracked for folder in name.parents)}
    of_copies = {copy_of(path): path for path in sorted(paths)}
    wanted = [of_copies[pathlib.PurePosixPath(copy.as_posix())] for copy in sorted(linked(book, files))]
    # What lists show, too.
    wanted += [name for folder in wanted if (pages.ROOT / folder).is_dir() for name in tracked if name.parent == folder]
    for path in dict.fromkeys(wanted):
        copy = files / copy_of(path)
        copy.parent.mkdir(parents=True, exist_ok=True)
        if copy_of(path) == path:
            copy.write_bytes((pages.ROOT / path).read_bytes())
        else:
            copy.write_text(page_of(path, tracked), encoding="utf-8")
    print(f"{len(dict.fromkeys(wanted))} files of the repository")


if __name__ == "__main__":
    main()
