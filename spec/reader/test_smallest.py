"""Compares each byte of the smallest file with the table of the book that explains it, where CBVH names the command that bakes it."""

import os
import re
import subprocess
import tempfile
import unittest

import cbvh

PAGE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "book", "src", "format", "smallest.md")
# The name of a field, with which a meaning begins.
FIELDS = re.compile(r"^`(\w+)`")


def rows():
    """Returns offset, size, bytes (None where they may differ) and meaning of each row."""
    with open(PAGE, encoding="utf-8") as stream:
        lines = stream.read().split("<!-- table: smallest -->\n")[1].split("\n\n")[0].splitlines()[2:]
    for line in lines:
        offset, size, content, meaning = (cell.strip() for cell in line.strip("|").split("|"))
        if not offset:
            continue
        content = content.strip("`")
        if content == "…":
            yield int(offset, 16), int(size), None, meaning
            continue
        content, _, times = content.partition(" × ")
        yield int(offset, 16), int(size), bytes.fromhex(content) * int(times or 1), meaning


class TestSmallest(unittest.TestCase):
    def test_rows_follow_each_other(self):
        end = 0
        for offset, size, content, meaning in rows():
            self.assertEqual(offset, end, meaning)
            self.assertEqual(size, size if content is None else len(content), meaning)
            end += size
        self.assertGreater(end, 8192)

    @unittest.skipUnless("CBVH" in os.environ, "CBVH names no command")
    def test_rows_are_the_bytes_of_the_file(self):
        with open(PAGE, encoding="utf-8") as stream:
            commands = stream.read().split("```sh\n")[1].split("```")[0].splitlines()
        with tempfile.TemporaryDirectory() as folder:
            command = os.path.abspath(os.environ["CBVH"])
            bake = commands[1].replace("cbvh ", f"'{command}' ", 1)
            subprocess.run(["sh", "-ec", f"{commands[0]}\n{bake}"], cwd=folder, check=True)
            with open(os.path.join(folder, "triangle.cbvh"), "rb") as stream:
                data = stream.read()
        for offset, size, content, meaning in rows():
            if content is not None:
                self.assertEqual(data[offset : offset + size], content, f"{offset:04x}: {meaning}")
        self.assertEqual(offset + size, len(data))

    def test_fields_are_where_the_structures_have_them(self):
        named = {offset: (found[1], size) for offset, size, _, meaning in rows() if (found := FIELDS.match(meaning))}
        structures = [(0, cbvh.HEADER), *((64 + 32 * entry, cbvh.SECTION_ENTRY) for entry in range(4))]
        structures += [(0xC0, cbvh.OBJECT_HEAD), (0xD0, cbvh.OBJECT_RECORD), (0x1000, cbvh.PAGE_HEADER)]
        for start, structure in structures:
            for field in structure.names:
                kind, offset = structure.fields[field][:2]
                self.assertEqual(named.get(start + offset), (field, kind.itemsize))


if __name__ == "__main__":
    unittest.main()
