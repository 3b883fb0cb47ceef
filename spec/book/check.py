"""Checks documents: links and anchors of all Markdown files of the repository, and the blocks of the book that are commands.

    check.py links                  every relative link leads to a file and an anchor; the book's pages are all listed, and show
                                    programs of the repository as they are
    check.py commands CBVH [PAGE]   runs the shell blocks of the book with this command, and compares their output
    check.py programs FOLDER...     runs the example programs that pages show or that state their output, from these folders, and
                                    compares it
    check.py tasks                  runs the Python programs of the page of tasks with this Python, and compares the output that they state
    check.py site FOLDER            every link of the pages that mdBook wrote there leads to a file
    check.py words                  prints the number of words of each page, and of all that users read

A shell block runs unless `ignore` follows its language. The blocks of a page run in one new folder, in order, where `testdata` is that of
the repository. If the next block is `text`, it must be the output; `…` in it stands for any characters of a line, and for any lines where
it stands alone.
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import textwrap
import urllib.parse

import pages

# The page of examples by task.
TASKS = pages.SOURCES / "reference/examples.md"


def expected(shown: str, found: str) -> bool:
    """Whether an output is the one that is shown."""
    parts = []
    for line in shown.splitlines():
        parts.append(r"(?:.*\n)*" if line == "…" else re.escape(line).replace("…", ".*") + r"\n")
    return re.fullmatch("".join(parts), found if not found or found.endswith("\n") else found + "\n") is not None


def name(path: pathlib.Path) -> str:
    return path.relative_to(pages.ROOT).as_posix()


def check_links() -> list[str]:
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "*.md"], cwd=pages.ROOT, capture_output=True, text=True)
    listed.check_returncode()
    documents = [pages.ROOT / line for line in sorted(set(listed.stdout.splitlines()))]
    documents = [path for path in documents if path.exists()]
    known: dict[pathlib.Path, set[str]] = {}

    def anchors(path: pathlib.Path) -> set[str]:
        if path not in known:
            text = path.read_text(encoding="utf-8")
            whole = [(path.parent / of).resolve() for of in pages.included(text)]
            known[path] = pages.anchors(text).union(*map(anchors, whole))
        return known[path]

    wrong, count = [], 0
    for path in documents:
        text = path.read_text(encoding="utf-8")
        for line, target in [*pages.links(text), *((0, of) for of in pages.included(text))]:
            if re.match(r"[a-z]+:", target):
                continue
            count += 1
            to, _, anchor = target.partition("#")
            there = pathlib.Path(os.path.normpath(path.parent / to)) if to else path
            if not there.exists():
                wrong.append(f"{name(path)}:{line}: {target}: no such file")
            elif not there.is_relative_to(pages.ROOT):
                wrong.append(f"{name(path)}:{line}: {target}: leads out of the repository")
            elif anchor and (there.suffix != ".md" or anchor not in anchors(there)):
                wrong.append(f"{name(path)}:{line}: {target}: no such anchor")
        # A cell that names a file and something in it, as in spec/numerics.md.
        if path.is_relative_to(pages.SOURCES):
            for file, called in re.findall(r"\| `([\w/.-]+\.\w+)` `(\w+)` \|", text):
                there = pages.ROOT / file
                if not there.exists() or not re.search(rf"\bfn {called}\b", there.read_text(encoding="utf-8")):
                    wrong.append(f"{name(path)}: {file}: no function {called}")
        for file, part in pages.parts(text):
            there = path.parent / file
            if not there.exists() or f"ANCHOR: {part}\n" not in there.read_text(encoding="utf-8").replace(" -->", ""):
                wrong.append(f"{name(path)}: {file}:{part}: no such part")
    chapters = pages.chapters()
    own = {path for path in pages.SOURCES.rglob("*.md") if path.name != "SUMMARY.md"}
    wrong += [f"{name(path)}: not in SUMMARY.md" for path in sorted(own - set(chapters))]
    if len(documents) < 100 or count < 400:
        wrong.append(f"expected more documents and links, found {len(documents)} and {count}")
    print(f"{count} links of {len(documents)} documents")
    return wrong


def pairs(path: pathlib.Path):
    """The blocks of a page, each with the text that is shown as its output, if any."""
    found = list(pages.blocks(path.read_text(encoding="utf-8")))
    for block, after in zip(found, [*found[1:], None]):
        yield block, after.text if after is not None and after.language == "text" else None


def check_commands(command: str, page: str = "") -> list[str]:
    wrong, count = [], 0
    folder = str(pathlib.Path(command).resolve().parent)
    environment = {**os.environ, "PATH": folder + os.pathsep + os.environ["PATH"], "LC_ALL": "C.UTF-8"}
    environment.pop("CBVH_ISA", None)
    for path in pages.chapters():
        if page not in name(path):
            continue
        with tempfile.TemporaryDirectory() as place:
            os.symlink(pages.ROOT / "testdata", os.path.join(place, "testdata"))
            for block, shown in pairs(path):
                if block.language != "sh" or "ignore" in block.words:
                    continue
                count += 1
                ended = subprocess.run(
                    ["bash", "-euo", "pipefail", "-c", f"exec 2>&1\n{block.text}"],
                    cwd=place, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300,
                )
                if ended.returncode != 0:
                    wrong.append(f"{name(path)}:{block.line}: exit code {ended.returncode}\n{ended.stdout}{ended.stderr}")
                elif shown is not None and not expected(shown, ended.stdout):
                    wrong.append(f"{name(path)}:{block.line}: expected\n{shown}found\n{ended.stdout}")
    if count < 12 and not page:
        wrong.append(f"expected more shell blocks, found {count}")
    print(f"{count} shell blocks")
    return wrong


def shown_file(block: pages.Block) -> pathlib.Path | None:
    """The file of the repository that a block shows, as its word `file=PATH` says."""
    files = [word.removeprefix("file=") for word in block.words if word.startswith("file=")]
    return pages.ROOT / files[0] if files else None


def check_files() -> list[str]:
    """Blocks that show a file, or the part of it between the lines ANCHOR and ANCHOR_END, have its text."""
    wrong = []
    for path in pages.chapters():
        for block, _ in pairs(path):
            file = shown_file(block)
            if file is None:
                continue
            text = file.read_text(encoding="utf-8") if file.exists() else ""
            if "// ANCHOR: program\n" in text:
                text = text.split("// ANCHOR: program\n")[1].split("// ANCHOR_END: program\n")[0]
            if block.text != text:
                wrong.append(f"{name(path)}:{block.line}: expected the text of {name(file)}")
    return wrong


def stated(text: str) -> str | None:
    """The output that the documentation at the head of a program states, of Python behind `It prints:`, of Rust in a block of text."""
    if found := re.match(r'"""(?:(?!""").)*?\nIt prints:\n\n(.*?)"""', text, re.S):
        return textwrap.dedent(found[1])
    head = re.match(r"(?://!.*\n)*", text)[0]
    found = re.search(r"^//! It prints:\n//!\n//! ```text\n(.*?)^//! ```$", head, re.S | re.M)
    return re.sub("^//! ?", "", found[1], flags=re.M) if found else None


def task_programs(suffix: str) -> list[pathlib.Path]:
    """The programs that the page of tasks links to and that state their output."""
    text = TASKS.read_text(encoding="utf-8")
    linked = (pathlib.Path(os.path.normpath(TASKS.parent / target)) for _, target in pages.links(text) if target.endswith(suffix))
    return [path for path in dict.fromkeys(linked) if stated(path.read_text(encoding="utf-8")) is not None]


def run(command: list, place: str) -> subprocess.CompletedProcess:
    """Runs a program in a folder that has testdata as the repository has it."""
    os.symlink(pages.ROOT / "testdata", os.path.join(place, "testdata"))
    return subprocess.run(command, cwd=place, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300)


def check_tasks() -> list[str]:
    wrong, programs = [], task_programs(".py")
    for path in programs:
        with tempfile.TemporaryDirectory() as place:
            ended = run([sys.executable, path], place)
        if ended.returncode != 0 or ended.stdout != stated(path.read_text(encoding="utf-8")):
            wrong.append(f"{name(path)}: expected the output that it states, found\n{ended.stdout}{ended.stderr}")
    if len(programs) < 20:
        wrong.append(f"expected more programs of tasks, found {len(programs)}")
    print(f"{len(programs)} tasks")
    return wrong


def check_programs(folders: list[str]) -> list[str]:
    """Of all programs that pages show, those that are in these folders: programs of each language are built apart."""
    wrong, count = [], 0
    for path in task_programs(".rs"):
        for folder in folders:
            program = pathlib.Path(folder).resolve() / path.stem
            if program.parent.name != "examples" or not program.exists():
                continue
            count += 1
            with tempfile.TemporaryDirectory() as place:
                ended = run([program], place)
            if ended.returncode != 0 or ended.stdout != stated(path.read_text(encoding="utf-8")):
                wrong.append(f"{name(path)}: expected the output that it states, found\n{ended.stdout}{ended.stderr}")
    for path in pages.chapters():
        for block, shown in pairs(path):
            file = shown_file(block)
            if file is None:
                continue
            for folder in folders:
                program = pathlib.Path(folder).resolve() / (file.name if file.suffix == ".mjs" else file.stem)
                if (file.suffix == ".rs") != (program.parent.name == "examples") or not program.exists():
                    continue
                command = ["node", program] if file.suffix == ".mjs" else [program]
                count += 1
                with tempfile.TemporaryDirectory() as place:
                    ended = run(command, place)
                if ended.returncode != 0 or shown is None or not expected(shown, ended.stdout):
                    wrong.append(f"{name(path)}:{block.line}: expected\n{shown}found\n{ended.stdout}{ended.stderr}")
    if count == 0:
        wrong.append("expected programs that pages show, found none")
    print(f"{count} programs")
    return wrong


def check_site(folder: str) -> list[str]:
    wrong, count = [], 0
    for page in sorted(pathlib.Path(folder).resolve().rglob("*.html")):
        # The page of all pages, and the one that servers show instead of missing ones, have links as from elsewhere.
        if page.name in ("print.html", "404.html"):
            continue
        for target in re.findall(r'(?:href|src)="([^"#?]+)', page.read_text(encoding="utf-8")):
            if re.match(r"[a-z]+:", target):
                continue
            count += 1
            if not pathlib.Path(os.path.normpath(page.parent / urllib.parse.unquote(target))).exists():
                wrong.append(f"{page.name}: {target}: no such file")
    if count < 1000:
        wrong.append(f"expected more links, found {count}")
    print(f"{count} links of the site")
    return wrong


def words(path: pathlib.Path) -> int:
    """The number of words of a page, with the documents and the parts that it includes."""
    text = path.read_text(encoding="utf-8")
    count = len(text.split()) + sum(words(path.parent / of) for of in pages.included(text))
    for file, part in pages.parts(text):
        found = re.search(rf"ANCHOR: {part}\b.*?\n(.*?)[^\n]*ANCHOR_END: {part}\b", (path.parent / file).read_text(encoding="utf-8"), re.S)
        count += len(found[1].split())
    return count


def for_users() -> list[pathlib.Path]:
    """README.md and the pages that users read one after another: not the references that are made, the format and the development."""
    made = {pages.SOURCES / f"reference/{of}.md" for of in ("options", "python-api", "c-api", "typescript-api")}
    others = ("format", "design", "development")
    chosen = [path for path in pages.chapters() if path not in made and path.relative_to(pages.SOURCES).parts[0] not in others]
    return [pages.ROOT / "README.md", *chosen]


def count_words() -> list[str]:
    for path in pages.chapters():
        print(f"{words(path):6} {name(path)}")
    print(f"{sum(map(words, for_users())):6} README.md and all that users read here")
    return []


def main() -> int:
    match sys.argv[1:]:
        case ["links"]:
            wrong = check_links() + check_files()
        case ["commands", command, *page] if len(page) < 2:
            wrong = check_commands(command, *page)
        case ["programs", *folders] if folders:
            wrong = check_programs(folders)
        case ["tasks"]:
            wrong = check_tasks()
        case ["site", folder]:
            wrong = check_site(folder)
        case ["words"]:
            wrong = count_words()
        case _:
            print(__doc__, file=sys.stderr)
            return 2
    for line in wrong:
        print(line, file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
