"""The page has the tables that its figures give, and the study of bounds rounds outward, by what the specification says."""

from __future__ import annotations

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import page  # noqa: E402
import predictors  # noqa: E402

CBVH = os.environ.get("CBVH")


class Page(unittest.TestCase):
    def test_tables_are_those_of_the_figures(self) -> None:
        text, told = (page.NOTEBOOK / "paper.md").read_text(), json.loads((page.NOTEBOOK / "paper.json").read_text())
        self.assertEqual(text, page.filled(text, told))
        told["meshes"]["nao"]["triangles"] += 1
        self.assertNotEqual(text, page.filled(text, told))

    def test_a_page_without_a_table_is_refused(self) -> None:
        with self.assertRaises(AssertionError):
            page.filled("<!-- made: machine -->\n\n<!-- end -->\n", {"date": "today", "processor": "none"})


@unittest.skipUnless(CBVH, "CBVH names no command")
class Bounds(unittest.TestCase):
    """Of FCL's environment, which has 2,180 triangles."""

    def bake(self, profile: str) -> tuple[pathlib.Path, dict]:
        file = pathlib.Path(self.folder.name) / f"{profile}.cbvh"
        mesh = page.ROOT / "testdata/fclenv.obj"
        command = [CBVH, "bake", mesh, "-o", file, "--profile", profile, "--triangles", "f32", "--json", "--quiet"]
        return file, json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)

    def setUp(self) -> None:
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.tree = predictors.Tree(self.bake("dop14-f32")[0])
        self.slabs = self.tree.slabs[:, :7]

    def test_the_tree_holds_its_parts(self) -> None:
        below = np.arange(1, len(self.tree.parent))
        outer = self.slabs[self.tree.parent[below]]
        self.assertTrue(np.all(outer[..., 0] <= self.slabs[below, :, 0]) and np.all(self.slabs[below, :, 1] <= outer[..., 1]))
        self.assertTrue(np.all(self.tree.parent[below] < below))

    def test_bounds_are_outward_and_steps_small(self) -> None:
        whole = np.ptp(self.slabs[0], axis=-1)
        for predictor in predictors.PREDICTORS:
            for precision in predictors.PRECISIONS:
                decoded, _ = predictors.rounded(self.tree, self.slabs, predictor, precision)
                outside = np.stack([self.slabs[..., 0] - decoded[..., 0], decoded[..., 1] - self.slabs[..., 1]])
                self.assertTrue(np.all(outside >= -1e-9 * whole.max()), (predictor, precision))
                step = 2.0 ** -(10 if precision == "half" else precision - 1)
                self.assertTrue(np.all(outside <= step * whole.max()), (predictor, precision))

    def test_eight_bits_are_those_of_the_format(self) -> None:
        """The mean over nodes of the mean width of their slabs, relative to tight ones, which the baker reports."""
        decoded, codes = predictors.rounded(self.tree, self.slabs, "parent", 8)
        self.assertTrue(0 <= codes.min() and codes.max() <= 255)
        tight, wide = (np.ptp(slabs[1:], axis=-1) for slabs in (self.slabs, decoded))
        ratios = np.divide(wide, tight, out=np.full_like(wide, np.nan), where=tight > 0)
        self.assertAlmostEqual(np.nanmean(ratios) / self.bake("dop14-u8")[1]["width_inflation"], 1, delta=0.01)


if __name__ == "__main__":
    unittest.main()
