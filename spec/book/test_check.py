"""Tests how documents are read, and that the checks find what they are for."""

import io
import json
import pathlib
import re
import sys
import unittest
import unittest.mock

import check
import pages
import preprocess
import references

PAGE = """# A page, with `code` and a [link](there.md#part)

Text with ![a picture](picture.png "Title") and `[no](link.md)`.

```sh,ignore
[no](link.md)
```

## Again

```text
one
```

## Again

<a id="own"></a>
"""


class Documents(unittest.TestCase):
    def test_links_are_those_of_the_prose(self):
        self.assertEqual(list(pages.links(PAGE)), [(1, "there.md#part"), (3, "picture.png")])

    def test_anchors_are_those_of_headings_and_marks(self):
        self.assertEqual(pages.anchors(PAGE), {"a-page-with-code-and-a-link", "again", "again-1", "own"})

    def test_blocks_have_a_language_and_words(self):
        found = [(block.language, block.words, block.line) for block in pages.blocks(PAGE)]
        self.assertEqual(found, [("sh", ["ignore"], 5), ("text", [], 11)])

    def test_an_ellipsis_stands_for_characters_or_lines(self):
        self.assertTrue(check.expected("took …\n", "took 0.1 s\n"))
        self.assertTrue(check.expected("a\n…\nb\n", "a\nc\nd\nb\n"))
        self.assertTrue(check.expected("a\n…\n", "a\n"))
        self.assertFalse(check.expected("took …\n", "took 1\nand more\n"))
        self.assertFalse(check.expected("1.5\n", "1x5\n"))
        self.assertFalse(check.expected("a\n", "a\nb\n"))

    def test_links_of_included_documents_lead_to_chapters_or_files(self):
        glossary, chapter = pages.ROOT / "spec/glossary.md", pages.SOURCES / "reference/glossary.md"
        here, output = pages.SOURCES / "format/versions.md", pages.ROOT / "target/book"

        def led(text, address=None):
            return preprocess.led(text, pages.ROOT / "spec", here, {glossary: chapter}, address, output)

        self.assertEqual(led("[terms](glossary.md#slab)"), "[terms](../reference/glossary.md#slab)")
        self.assertEqual(led("[c](reader/check.py)"), "[c](../../../spec/reader/check.py)")
        self.assertEqual(led("[s](suite/README.md)", "https://x.example/tree"), "[s](https://x.example/tree/spec/suite/README%2Emd)")

        def copied(text, address=None):
            return preprocess.led(text, pages.ROOT / "spec", here, {glossary: chapter}, address, output, "files")

        self.assertEqual(copied("[terms](glossary.md#slab)"), "[terms](../reference/glossary.md#slab)")
        self.assertEqual(copied("[c](reader/check.py)"), "[c](../files/spec/reader/check.py.html)")
        self.assertEqual(copied("[s](suite/README.md) [r](reader)"), "[s](../files/spec/suite/README.html) [r](../files/spec/reader/index.html)")
        self.assertEqual(copied("![p](../bvh-query/view/view.png)", "https://x.example/tree"), "![p](../files/bvh-query/view/view.png)")
        self.assertEqual(copied("[c](reader/check.py)", "https://x.example/tree"), "[c](https://x.example/tree/spec/reader/check.py)")
        self.assertEqual(led("`[a](b.md)` [w](https://x.example) [h](#part)"), "`[a](b.md)` [w](https://x.example) [h](#part)")

    def test_programs_state_their_output(self):
        self.assertEqual(check.stated('"""Task.\n\nIt prints:\n\n    a\n      b\n"""\nprint()\n'), "a\n  b\n")
        self.assertEqual(check.stated("//! Task.\n//!\n//! It prints:\n//!\n//! ```text\n//! a\n//!   b\n//! ```\n#![allow()]\n"), "a\n  b\n")
        self.assertIsNone(check.stated('"""Task."""\n"""It prints:\n\n    a\n"""\n'))
        self.assertIsNone(check.stated("//! Task.\nfn main() {}\n"))

    def test_programs_of_tasks_are_short_and_listed(self):
        listed = {suffix: check.task_programs(suffix) for suffix in (".py", ".rs")}
        self.assertEqual(set(listed[".py"]), set((pages.ROOT / "bvh-query/python/examples/tasks").glob("*.py")))
        self.assertLessEqual(set((pages.ROOT / "bvh-query/cbvh/examples").glob("*.rs")), {*listed[".rs"], *(pages.ROOT / f"bvh-query/cbvh/examples/{name}.rs" for name in ("start", "from_parry"))})
        for path in [*listed[".py"], *listed[".rs"]]:
            with self.subTest(path=path.name):
                _, program = re.split(r'\n"""\n|^#!\[allow.*\n', path.read_text(encoding="utf-8"), maxsplit=1, flags=re.M)
                self.assertIn(sum(bool(line.strip()) for line in program.splitlines()), range(10, 35))
        self.assertGreaterEqual(sum(line.startswith("| ") for line in check.TASKS.read_text(encoding="utf-8").splitlines()), 20)

    def test_all_chapters_are_there(self):
        self.assertGreater(len(pages.chapters()), 30)
        self.assertTrue(all(isinstance(path, pathlib.Path) and path.exists() for path in pages.chapters()))

    def test_what_users_read_is_short(self):
        """Whatever is added there replaces something, or goes into a reference."""
        read = check.for_users()
        self.assertGreater(len(read), 35)
        self.assertLessEqual(check.words(read[0]), 1_200)
        starts = [path for path in read if path.parent.name == "start"]
        self.assertEqual(len(starts), 5)
        for path in starts:
            with self.subTest(path=path.name):
                self.assertIn(check.words(path), range(300, 601))
        self.assertLessEqual(sum(map(check.words, read)), 35_000)

    def test_a_search_finds_the_page_of_each_term(self):
        """The search of the book looks for words in pages, so a page has the words that people search for."""
        lines = (pages.BOOK / "terms.txt").read_text(encoding="utf-8").splitlines()
        terms = [line.split(" | ") for line in lines if line and not line.startswith("#")]
        self.assertGreaterEqual(len(terms), 120)
        texts = {}
        for path in pages.chapters():
            text = path.read_text(encoding="utf-8")
            parts = [text, *((path.parent / name).read_text(encoding="utf-8") for name in pages.included(text))]
            texts[path.relative_to(pages.SOURCES).as_posix()] = " ".join("\n".join(parts).lower().split())
        for term, page in terms:
            with self.subTest(term=term, page=page):
                # As a word of its own, or its plural: EPA is not found in "separation".
                self.assertRegex(texts[page], rf"(?<!\w){re.escape(term.lower())}s?(?!\w)")


class References(unittest.TestCase):
    """The pages that are made from sources."""

    pages = {language: made() for language, made in references.references.items()}
    # Less than there are now: a source that is read otherwise than it is written has fewer.
    least = {"python": (60, 150), "c": (230, 150), "typescript": (70, 150)}

    def test_everything_public_is_there(self):
        for language, page in self.pages.items():
            headings = re.findall(r"^##+ (.*)", page, re.M)
            words = {word for heading in headings for word in re.findall(r"[\w.]+", heading)}
            names = references.names[language]()
            self.assertGreaterEqual(len(names), self.least[language][0], language)
            self.assertGreaterEqual(len(headings), self.least[language][1], language)
            self.assertEqual([name for name in names if name not in words], [], language)
            self.assertEqual(len(headings), len(set(headings)), language)

    def test_members_and_their_words_are_there(self):
        python, c, typescript = self.pages["python"], self.pages["c"], self.pages["typescript"]
        for expected in ("Mesh.collide(other: Mesh, poses: ArrayLike, ", "### Polyline", "APART = 1", "Robot.joints: list"):
            self.assertIn(expected, python)
        self.assertNotIn("_cbvh", re.sub(r"`[^`]*_cbvh`", "", python))
        for expected in ("CBVH_STOPPED = 12", "typedef double (*cbvh_sagitta_function)", "Writes the `CBVH_ABI` of the library"):
            self.assertIn(expected, c)
        for expected in ("#### CbvhWorker.terminate", "#### Scene.pairsInContact", "get triangleCount(): number", "enum Relation {"):
            self.assertIn(expected, typescript)
        for hidden in ("#call", "_raw", "@param", "@internal", "{@link"):
            self.assertNotIn(hidden, typescript)

    def test_every_function_of_c_and_python_has_words(self):
        for language in ("python", "c"):
            parts = re.split(r"^##+ (.*)\n", self.pages[language], flags=re.M)
            for name, part in zip(parts[1::2], parts[2::2]):
                is_group = name in ("Functions", "Classes", "Exceptions") or re.fullmatch(r"[A-Z][a-z ]+", name)
                text = re.sub(r"^```.*?^```", "", part, flags=re.M | re.S).strip()
                self.assertTrue(is_group or text, f"{language}: {name}")

    def test_blocks_are_closed_and_nothing_is_taken_for_html(self):
        for language, page in self.pages.items():
            self.assertEqual(len(re.findall(r"^```", page, re.M)) % 2, 0, language)
            self.assertNotIn("<", pages.prose(page), language)

    def test_declarations_end_where_they_end(self):
        self.assertEqual(references.until("a(b: { c: number } = {}): Map<A, () => B> { return; }", "{;"), "a(b: { c: number } = {}): Map<A, () => B>")
        self.assertEqual(references.folded("f", ["x" * 60, "y" * 60], " -> z"), f"f(\n    {'x' * 60},\n    {'y' * 60},\n) -> z")
        self.assertEqual(references.remark(" * Says.\n * @param a One\n * more.\n * @returns It.\n"), "Says.\n\n- `a`: One\nmore.\n- Returns: It.")
        self.assertEqual(references.plain("a <b> `<c>`"), "a &lt;b> `<c>`")

    def test_the_book_has_them(self):
        chapters = [path for path in pages.chapters() if references.DIRECTIVE.search(path.read_text(encoding="utf-8"))]
        self.assertEqual(len(chapters), len(references.references))
        context = {"config": {"build": {"build-dir": "../../target/book"}}}
        of = [{"Chapter": {"path": path.relative_to(pages.SOURCES).as_posix(), "content": path.read_text(), "sub_items": []}} for path in chapters]
        with unittest.mock.patch.object(sys, "stdin", io.StringIO(json.dumps([context, {"items": of}]))):
            with unittest.mock.patch.object(sys, "stdout", io.StringIO()) as written, unittest.mock.patch.object(sys, "argv", ["x"]):
                preprocess.main()
        made = [item["Chapter"]["content"] for item in json.loads(written.getvalue())["items"]]
        self.assertEqual([text for text in made if "{{#" in text], [])
        for page in self.pages.values():
            self.assertTrue(any(page in text for text in made))


if __name__ == "__main__":
    unittest.main()
