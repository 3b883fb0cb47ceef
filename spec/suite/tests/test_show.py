"""A proof is shown for each kind of question that two triangles decide, and a reason for each other one."""

import contextlib
import io
import sys
import unittest
from pathlib import Path
from unittest import mock

sys.path.insert(0, str(Path(__file__).parent.parent))

import run
import show


def shown(*arguments):
    """Returns what is printed, or the reason for which nothing is."""
    output = io.StringIO()
    with mock.patch.object(sys, "argv", ["show.py", *arguments]), contextlib.redirect_stdout(output):
        try:
            show.main()
        except SystemExit as reason:
            return str(reason)
    return output.getvalue()


class Shows(unittest.TestCase):
    def test_each_kind_of_answer(self):
        kinds = {}
        for case in run.load()[1]:
            for number, item in enumerate(case["items"]):
                found = item["truth"]
                kind = found.get("hit", found.get("free")) if isinstance(found, dict) else found if isinstance(found, str) else None
                kinds.setdefault((case["ask"], kind), (case["id"], str(number), found))
        for (ask, kind), (name, number, found) in kinds.items():
            text = shown(name, number)
            if ask in ("penetration", "self_contacts") or kind == "refused" or (ask, kind) == ("ray", False):
                self.assertRegex(text, "^(no two triangles decide|to be refused)", (ask, kind))
                continue
            touches = (ask, kind) in (("ray", True), ("motion", False)) or kind in ("on", "touching")
            if touches or (ask, kind) in (("motion", True), ("side", "outside"), ("relation", "apart")):
                self.assertIn("a common point in B" if touches else "direction: ", text, (ask, kind))
            self.assertIn("triangle ", text)

    def test_what_is_not_asked(self):
        for arguments in (("placed/9999", "0"), ("placed/0000", "99"), ("placed/0000", "-1")):
            self.assertRegex(shown(*arguments), "^expected a case")
        empty = next(case["id"] for case in run.load()[1] if "empty" in case["needs"]["features"])
        self.assertRegex(shown(empty, "0"), "^no two triangles decide")


if __name__ == "__main__":
    unittest.main()
