"""What bounds take and how wide they get, by number of directions, precision and predictor: a study of one tree, without queries.

The tree is that of a file in dop14-f32, read by the independent reader of spec/reader. Its k-DOPs are computed anew from the
triangles, tight and for each k, and then rounded outward in one of two ways. Without a predictor, both ends of a slab are
written relative to the slab of the whole object. With the predictor of the format, they are written relative to the slab of the
parent, as it is decoded, so that an error goes down the chain of ancestors. Codes are integers of n bits, in equal steps over
that slab, or half floats.
"""

from __future__ import annotations

import bisect
import pathlib
import sys
from typing import Any

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "spec/reader"))
import cbvh as reader  # noqa: E402
import rules  # noqa: E402

DIRECTIONS = np.array(
    [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [1, 1, -1], [1, -1, 1], [-1, 1, 1]]
    + [[1, 1, 0], [1, 0, 1], [0, 1, 1], [1, -1, 0], [1, 0, -1], [0, 1, -1]]
)
PRECISIONS = [4, 6, 8, 10, 12, 16, "half"]
PREDICTORS = ["object", "parent"]
MOST_EXCESS = 0.01  # for the least number of bits that keeps within it
MAX_BITS = 24
CONTEXTS = 16  # classes of the parent's code


class Tree:
    """The nodes below the root of an object, parents first: the place of each parent, and tight slabs [node, slab, end]."""

    def __init__(self, path: pathlib.Path) -> None:
        (one,) = rules.open_file(path.read_bytes()).objects
        pages = {number: reader.Page(one, number) for number in one.page_numbers()}
        node_of, self.parent, packets = {(one.first_page, 0): 0}, [-1], {}
        for number, page in pages.items():
            corners, used = page.offsets().astype(float), page.lanes_used()
            for slot in range(page.treelets):
                for kind, target in page.targets(slot):
                    node = len(self.parent)
                    self.parent.append(node_of[number, slot])
                    if kind in (reader.TREELET, reader.SHORT):
                        node_of[number, target] = node
                    elif kind == reader.REMOTE:
                        node_of[page.remote(target)] = node
                    else:
                        packets[node] = corners[target][used[target]].reshape(-1, 3) @ DIRECTIONS.T
        self.parent, self.triangles = np.array(self.parent), one.triangles
        self.levels = [np.array([0])]
        while len(self.levels[-1]):
            self.levels.append(np.flatnonzero(np.isin(self.parent, self.levels[-1])))
        self.slabs = np.full((len(self.parent), len(DIRECTIONS), 2), np.inf)
        for node, reach in packets.items():
            self.slabs[node] = np.stack([reach.min(0), -reach.max(0)], -1)
        for level in reversed(self.levels[1:]):
            np.minimum.at(self.slabs, self.parent[level], self.slabs[level])
        self.slabs[..., 1] *= -1


def half_below(numbers: np.ndarray) -> np.ndarray:
    """The greatest half floats that are not above the numbers, none of which is negative."""
    with np.errstate(over="ignore"):
        half = numbers.astype(np.float16)
    return np.where(half > numbers, np.nextafter(half, np.float16(0)), half).astype(float)


def rounded(tree: Tree, slabs: np.ndarray, predictor: str, precision: Any) -> tuple[np.ndarray, np.ndarray]:
    """The slabs as they are decoded, and their codes, with those of the root as they are."""
    decoded, codes = slabs.copy(), np.zeros(slabs.shape)
    unit = np.ptp(slabs[0], axis=-1).max() / 32768  # of half floats, so that the largest code is finite
    for level in tree.levels[1:]:
        within = decoded[tree.parent[level] if predictor == "parent" else np.zeros_like(level)]
        lo, hi = within[..., 0], within[..., 1]
        inside = np.stack([slabs[level, :, 0] - lo, hi - slabs[level, :, 1]], -1)
        if precision == "half":
            step, code = unit, half_below(inside / unit)
        else:
            step = ((hi - lo) / (2**precision - 1))[..., None]
            code = np.floor(np.divide(inside, step, out=np.zeros_like(inside), where=step > 0))
        codes[level] = code
        decoded[level] = np.stack([lo, hi], -1) + code * step * [1, -1]
    return decoded, codes


def excess(tight: np.ndarray, decoded: np.ndarray) -> float:
    """How much wider the slabs of a node are, all together, in the mean over nodes with a width."""
    width, wider = (np.ptp(slabs[1:], axis=-1).sum(axis=-1) for slabs in (tight, decoded))
    return float(np.mean(wider[width > 0] / width[width > 0]) - 1)


def entropy(codes: np.ndarray, given: np.ndarray) -> float:
    """The bits per code that a variable-length coding needs at least, if it knows what is given with each code."""
    total = 0.0
    for value in np.unique(given):
        counts = np.unique(codes[given == value], return_counts=True)[1]
        total -= float(np.sum(counts * np.log2(counts / counts.sum())))
    return total / codes.size


def study(path: pathlib.Path) -> dict:
    """All figures of the tree in a file. Bytes are those of bounds alone, per triangle."""
    tree = Tree(path)
    nodes = len(tree.parent) - 1
    rows, least = [], []
    for k in (6, 14, 26):
        slabs = tree.slabs[:, : k // 2]
        per_bit = nodes * k / 8 / tree.triangles
        for predictor in PREDICTORS:
            for precision in PRECISIONS:
                decoded, codes = rounded(tree, slabs, predictor, precision)
                row = {"k": k, "predictor": predictor, "precision": precision, "excess": excess(slabs, decoded)}
                row["bytes"] = per_bit * (16 if precision == "half" else precision)
                if precision in range(1, 9):
                    above = codes[tree.parent[1:]] * CONTEXTS // 2**precision
                    row["bytes_coded"] = per_bit * entropy(codes[1:], np.zeros_like(above))
                    row["bytes_coded_knowing_parent"] = per_bit * entropy(codes[1:], above)
                rows.append(row)
            width = lambda bits: -excess(slabs, rounded(tree, slabs, predictor, bits)[0])  # noqa: E731
            bits = 1 + bisect.bisect_left(range(1, MAX_BITS), -MOST_EXCESS, key=width)
            least.append({"k": k, "predictor": predictor, "bits": bits, "bytes": per_bit * bits})
    return {"nodes": nodes, "triangles": tree.triangles, "depth": len(tree.levels) - 2, "rows": rows, "least": least}
