"""Each way to break the promise of CBVH_ABI is found, and what it allows is not."""

import pathlib
import tempfile
import unittest

import older_header

HEADER = pathlib.Path(__file__).resolve().parents[1] / "include" / "cbvh.h"


class OlderHeader(unittest.TestCase):
    def changed(self, *changes):
        """What a header with these changes, pairs of texts, lacks of the present one."""
        text = HEADER.read_text(encoding="utf-8")
        for old, new in changes:
            self.assertEqual(text.count(old), 1, old)
            text = text.replace(old, new)
        with tempfile.TemporaryDirectory() as folder:
            newer = pathlib.Path(folder, "cbvh.h")
            newer.write_text(text, encoding="utf-8")
            return older_header.differences(older_header.Header(HEADER), older_header.Header(newer))

    def breaks(self, change, *found):
        self.assertEqual(self.changed(change), list(found))

    def test_the_header_itself(self):
        self.assertEqual(self.changed(), [])

    def test_additions_are_allowed(self):
        added = [
            ("cbvh_status cbvh_abi(uint32_t *abi);", "cbvh_status cbvh_abi(uint32_t *abi);\ncbvh_status cbvh_more(uint32_t *more);"),
            ("    cbvh_stop stop;\n} cbvh_bake_options;", "    cbvh_stop stop;\n    double more;\n} cbvh_bake_options;"),
            ("    CBVH_STOPPED = 12\n", "    CBVH_STOPPED = 12,\n    CBVH_MORE = 13\n"),
            ("/* The identity pose. */", "#define CBVH_MORE_POSES 7\ntypedef struct cbvh_more_rows { double x; } cbvh_more_rows;"),
            # Names of arguments are no part of the interface.
            ("cbvh_status cbvh_pose_check(const cbvh_pose *pose);", "cbvh_status cbvh_pose_check(const cbvh_pose *checked);"),
        ]
        self.assertEqual(self.changed(*added), [])

    def test_functions(self):
        self.breaks(
            ("cbvh_status cbvh_pose_check(const cbvh_pose *pose);", ""),
            "cbvh_pose_check: expected it among the functions of the newer header, found none",
        )
        for other in ("cbvh_status cbvh_abi(uint64_t *);", "uint32_t cbvh_abi(uint32_t *);", "cbvh_status cbvh_abi(uint32_t *, int32_t);"):
            self.breaks(
                ("cbvh_status cbvh_abi(uint32_t *abi);", other),
                "cbvh_abi: expected the type of the older header, found another one",
            )

    def test_numbers(self):
        self.breaks(
            ("CBVH_OPEN_CROWDED = 2", "CBVH_OPEN_CROWDED = 3"),
            "CBVH_OPEN_CROWDED: expected 2 as in the older header, found another number",
        )
        self.breaks(
            (", CBVH_OPEN_CROWDED = 2", ""),
            "CBVH_OPEN_CROWDED: expected it among the numbers of the newer header, found none",
        )
        abi = older_header.Header(HEADER).macros["CBVH_ABI"]
        self.breaks(
            (f"#define CBVH_ABI {abi}\n", f"#define CBVH_ABI {int(abi) + 1}\n"),
            f"CBVH_ABI: expected {abi} as in the older header, found another number",
        )
        self.breaks(
            ("#define CBVH_IDENTITY", "#define CBVH_OTHER"),
            "CBVH_IDENTITY: expected it among the macros of the newer header, found none",
        )

    def test_structures(self):
        self.breaks(
            ("typedef struct cbvh_pose { double rows[12]; }", "typedef struct cbvh_pose { double lines[12]; }"),
            "cbvh_pose.rows: expected this field in the newer header, found none",
        )
        self.breaks(
            ("typedef struct cbvh_pose { double rows[12]; }", "typedef struct cbvh_pose { float rows[12]; }"),
            "cbvh_pose.rows: expected the type of the older header, found another one",
            "cbvh_pose: expected the size of the older header, found another one",
        )
        # An array of answers has the size of each in it.
        self.breaks(
            ("typedef struct cbvh_pose { double rows[12]; }", "typedef struct cbvh_pose { double rows[12]; double more; }"),
            "cbvh_pose: expected the size of the older header, found another one",
        )
        place = "expected the place of the older header, found another one"
        self.breaks(
            ("    int32_t split_objects;\n", "    int32_t more;\n    int32_t split_objects;\n"),
            *(f"cbvh_bake_options.{field}: {place}" for field in
              ("split_objects", "scene", "no_ids", "no_topology", "force", "solid", "allow_outside", "drop_nan", "round", "weld", "stop")),
            "cbvh_bake_options.more: expected a new field behind the structure of the older header, found it within",
        )

    def test_types(self):
        for old, new in (("double t, cbvh_pose *pose);", "float t, cbvh_pose *pose);"), ("int32_t cbvh_status;", "int64_t cbvh_status;")):
            with self.subTest(new):
                name = "cbvh_status" if "status" in old else "cbvh_pose_function"
                self.assertIn(f"{name}: expected the type of the older header, found another one", self.changed((old, new)))

    def test_padding_is_no_place_for_a_field(self):
        with tempfile.TemporaryDirectory() as folder:
            headers = []
            for name, more in (("older.h", ""), ("newer.h", " int32_t more;")):
                headers.append(pathlib.Path(folder, name))
                headers[-1].write_text(f"#include <stddef.h>\n#include <stdint.h>\nenum {{ X_ONE = 1 }};\n"
                                       f"typedef struct x_options {{ size_t size; int32_t first;{more} }} x_options;\nvoid x(void);\n")
            self.assertEqual(
                older_header.differences(*map(older_header.Header, headers)),
                ["x_options.more: expected a new field behind the structure of the older header, found it within"],
            )


if __name__ == "__main__":
    unittest.main()
