"""The bounds of gaps are right on random triangles, poses, rays and points are proved again, and a runner that lies is found out in the tables."""

import contextlib
import io
import json
import os
import random
import shlex
import subprocess
import sys
import tempfile
import unittest
from fractions import Fraction
from pathlib import Path

SUITE = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(SUITE / "speed"), str(SUITE)]

try:
    import numpy as np

    import forms
    import gaps
    import poses
    import probes
except ModuleNotFoundError as missing:
    raise unittest.SkipTest(f"numpy is missing: {missing}") from None

import report
import truth

RUN = SUITE / "speed" / "run.py"


def soup(count, seed, reach):
    """Returns random triangles on a grid of 1/8, every third a segment."""
    source = random.Random(seed)
    corners = np.array([[source.randint(-reach, reach) / 8 for _ in range(3)] for _ in range(3 * count)], np.float32)
    corners[6::9] = corners[7::9]
    return corners, np.arange(3 * count).reshape(-1, 3)


def exactly(corners, faces, pose):
    """Returns the placed triangles as integers in units of 2^-60, which no pose of these tests rounds."""
    rows = [list(map(Fraction, pose[k : k + 4])) for k in (0, 4, 8)]
    at = [tuple(int((sum(r * Fraction(float(x)) for r, x in zip(row, p)) + row[3]) * 2**60) for row in rows) for p in corners]
    return [tuple(at[i] for i in face) for face in faces.tolist()]


class Page(unittest.TestCase):
    def test_page_plots_and_files_are_those_of_the_raw_times(self):
        drawn, text = report.made(SUITE / "speed" / "results", SUITE / "SPEED.md")
        self.assertEqual((SUITE / "SPEED.md").read_text(encoding="utf-8"), text)
        for file, plotted in drawn.items():
            self.assertEqual((SUITE / "speed" / "results" / file).read_text(encoding="utf-8"), plotted, file)


class Gaps(unittest.TestCase):
    def test_bounds_and_contacts_are_those_of_the_exact_search(self):
        touching = 0
        for seed in range(60):
            a, b = soup(1 + seed % 13, seed, 20), soup(1 + seed % 9, seed + 1000, 12)
            shift = [0.0, 0.5, 3.0, 2.0**-20][seed % 4]
            pose = [0.6, -0.8, 0.0, shift, 0.8, 0.6, 0.0, 0.25 + shift, 0.0, 0.0, 1.0, 4.0 * shift]
            # 0.6 and 0.8 are multiples of 2^-54: with coordinates on the grid of 1/8, the units of 2^-60 hold everything.
            t, u = exactly(*a, [1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0, 0]), exactly(*b, pose)
            of_a, of_b = gaps.Tree(*a).placed(None), gaps.Tree(*b).placed(pose)
            square = truth.squared_distance(t, u) / 4**60
            lower, upper = gaps.bounds(of_a, of_b)
            self.assertTrue(Fraction(lower) ** 2 <= square <= Fraction(upper) ** 2, (seed, lower, upper, float(square)))
            self.assertLess(upper - lower, 1e-12, seed)
            self.assertEqual(sorted(map(list, gaps.contacts(of_a, of_b))), truth.contacts(t, u), seed)
            touching += square == 0
        self.assertTrue(10 < touching < 50, touching)

    def test_a_mesh_whose_bytes_change_is_refused(self):
        record = forms.catalogue()["meshes"]["scan-1k"]
        self.assertEqual(len(forms.make(record)[1]), record["triangles"])
        with self.assertRaises(ValueError):
            forms.make(record | {"arguments": [9, 2]})

    def test_an_instance_is_where_its_pose_says(self):
        known = forms.catalogue()
        field = known["fields"]["field-512"] | {"side": 2}
        corners, faces, owners = forms.flattened(field, known["meshes"])
        numbers, rows = forms.instances(field)
        for owner, (number, row) in enumerate(zip(numbers, rows)):
            points, triangles = forms.make(known["meshes"][field["meshes"][number]])
            expected = gaps.moved(points.astype(float)[triangles], row)
            self.assertTrue(np.array_equal(corners[faces[owners == owner]], expected))
            self.assertGreater(np.linalg.det(np.array(row).reshape(3, 4)[:, :3]), 0.5)


    def test_a_joint_turns_points_and_keeps_lengths(self):
        points = np.array([[1.0, 2.0, 3.0], [-4.0, 0.5, 0.25]])
        # The tangent of 45 degrees, so a quarter turn.
        self.assertTrue(np.array_equal(forms.turned(points, 2, 1.0), [[-2.0, 1.0, 3.0], [-0.5, -4.0, 0.25]]))
        for axis in range(3):
            found = forms.turned(points, axis, 0.375)
            self.assertTrue(np.array_equal(found[:, axis], points[:, axis]))
            self.assertTrue(np.allclose(forms.length(found), forms.length(points), rtol=1e-15, atol=0.0))
            self.assertFalse(np.allclose(found, points))


class Poses(unittest.TestCase):
    def test_they_are_proved_again_and_a_changed_bound_is_found(self):
        # Every fourth of 20 poses at 8 presets, and one pose at each of them where many triangles are slivers.
        self.assertEqual(poses.check("scan-1k", 4), (40, []))
        self.assertEqual(poses.check("parts", 20), (8, []))
        lines = [json.loads(line) for line in poses.path("scan-1k").read_text(encoding="utf-8").splitlines()]
        for line in lines:
            line["1%"]["lower"] = (float.fromhex(line["1%"]["lower"]) * (1 + 1e-9)).hex()
            line["deep"]["contacts"] += 1
        with tempfile.TemporaryDirectory() as folder:
            changed = Path(folder) / "scan-1k.jsonl"
            changed.write_text("\n".join(map(json.dumps, lines)), encoding="utf-8")
            original, poses.path = poses.path, lambda pair: changed
            try:
                self.assertEqual(len(poses.check("scan-1k", 4)[1]), 10)
            finally:
                poses.path = original


class Probes(unittest.TestCase):
    def test_lines_leave_out_no_triangle_that_a_ray_hits(self):
        hits = 0
        for seed in range(40):
            corners, faces = soup(8 + seed % 4, seed, 16)
            source = random.Random(seed + 1000)
            # On the grid of the corners. Every other ray is towards a corner, where all turns but one are 0.
            origin = [source.randint(-16, 16) / 8 for _ in range(3)]
            towards = corners[seed % len(corners)].tolist() if seed % 2 else [source.randint(-16, 16) / 8 for _ in range(3)]
            ray = origin + [x - y for x, y in zip(towards, origin)]
            exact = exactly(corners, faces, [1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0, 0])
            o, d = (tuple(int(x * 2**60) for x in ray[k : k + 3]) for k in (0, 3))
            expected = truth.first_hit(o, d, exact)
            self.assertEqual(probes.Mesh(corners, faces).first_hit(ray), expected, seed)
            hits += expected is not None
        self.assertTrue(5 < hits < 35, hits)

    def test_sides_are_those_of_the_winding_number(self):
        corners, faces = forms.make(forms.catalogue()["meshes"]["scan-1k"])
        mesh = probes.Mesh(corners, faces)
        exact = exactly(corners, faces, [1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0, 0])
        found = []
        for k in range(8):
            point = (0.25 * k - 0.875, 0.125, 0.0625 * k)
            found.append(mesh.side(point))
            self.assertEqual(found[-1], 1 if truth.winding(tuple(int(x * 2**60) for x in point), exact) else -1)
        self.assertEqual(set(found), {1, -1})
        self.assertEqual(mesh.side(tuple(map(float, corners[faces[5][0]]))), 0)

    def test_they_are_proved_again_and_a_changed_answer_is_found(self):
        # Every 90th of 1,093 proved rays or points of each of five kinds.
        self.assertEqual(probes.check("scan-10k", 90), (60, []))
        lines = [json.loads(line) for line in probes.path("scan-10k").read_text(encoding="utf-8").splitlines()]
        for line in lines:
            line["proved"] = [self.changed(fact) for fact in line.get("proved", ())] or line.pop("proved", None)
        with tempfile.TemporaryDirectory() as folder:
            changed = Path(folder) / "scan-10k.jsonl"
            changed.write_text("\n".join(map(json.dumps, lines)), encoding="utf-8")
            original, probes.path = probes.path, lambda mesh: changed
            try:
                count, faults = probes.check("scan-10k", 90)
                self.assertEqual(len(faults), count)
            finally:
                probes.path = original

    @staticmethod
    def changed(fact):
        """Returns another answer: of a ray the next parameter or a hit, of a point a bound that is a little too high."""
        if fact is None:
            return "0x1p+0"
        if isinstance(fact, str):
            return (float.fromhex(fact) * (1 + 2.0**-52)).hex()
        return [(float.fromhex(fact[0]) * (1 + 1e-9)).hex(), *fact[1:]]

    def test_an_answer_is_right_to_within_the_claimed_error_only(self):
        profile = {"distance_error": 1e-3, "error_unit": "size"}
        ray, point = (0.0, 0.0, 4.0, 0.0, 0.0, -2.0), (0.0, 3.0, 0.0)
        right = lambda what, answer, probe, fact: probes.is_right(what, answer, probe, fact, 1.0, profile)
        # The largest coordinate is 4, and the direction is two long.
        self.assertTrue(right("ray", 1.5019, ray, 1.5) and not right("ray", 1.5021, ray, 1.5) and not right("ray", -1.0, ray, 1.5))
        self.assertTrue(right("ray", -1.0, ray, None) and not right("ray", 1.5, ray, None) and not right("ray", -0.5, ray, 0.0))
        self.assertTrue(right("hit", 1.0, ray, 1.5) and not right("hit", 1.0, ray, None) and not right("hit", 0.0, ray, 0.0))
        self.assertTrue(right("closest", 2.0029, point, [2.0, 2.0]) and not right("closest", 1.9969, point, [2.0, 2.0]))
        self.assertTrue(right("side", 1.0, point, [2.0, 2.0, 1]) and not right("side", 0.0, point, [2.0, 2.0, 1]))


def timed(folder, *arguments):
    """Runs a smoke test of the runner of these tests, and returns the exit code and the page, or the errors."""
    command = [sys.executable, str(SUITE / "tests" / "gaps_runner.py"), *arguments]
    joined = shlex.join(command) if os.name == "posix" else subprocess.list2cmdline(command)
    done = subprocess.run([sys.executable, str(RUN), "--out", folder, "--smoke", "--runner", f"gaps={joined}"], capture_output=True, text=True, check=False)
    return done.returncode, (Path(folder) / "SPEED.md").read_text(encoding="utf-8") if done.returncode != 2 else done.stderr


class Runs(unittest.TestCase):
    def test_an_honest_runner_is_timed(self):
        with tempfile.TemporaryDirectory() as folder:
            code, page = timed(folder)
            self.assertEqual(code, 0, page)
            self.assertIn("no results are wrong", page)
            self.assertIn("\nside,one call,scan-10k,near,gaps,1,45,3,0,", (Path(folder) / "probes.csv").read_text(encoding="utf-8"))
            self.assertIn("### Is the point inside? (`side`)", page)
            self.assertIn("collide,scan-1k,touching,gaps,2,0,", (Path(folder) / "queries.csv").read_text(encoding="utf-8"))
            self.assertTrue((Path(folder) / "distance-scan-1k.svg").read_text(encoding="utf-8").startswith("<svg"))

    def test_a_liar_is_marked_and_never_best(self):
        with tempfile.TemporaryDirectory() as folder:
            code, page = timed(folder, "7")
            self.assertEqual(code, 1)
            self.assertIn("2 of 2 |", page)

    def test_a_runner_that_ends_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            code, page = timed(folder, "-9")
            self.assertEqual(code, 1)
            self.assertIn("- gaps failed on scan-1k: `Crashed`", page)

    def test_a_runner_that_says_nothing_is_an_error(self):
        with tempfile.TemporaryDirectory() as folder:
            command = f"silent={shlex.quote(sys.executable)} -c pass"
            with contextlib.redirect_stderr(io.StringIO()):
                done = subprocess.run([sys.executable, str(RUN), "--out", folder, "--smoke", "--runner", command], capture_output=True, check=False)
            self.assertEqual(done.returncode, 2)


class Reports(unittest.TestCase):
    def test_losses_come_first_and_wrong_answers_do_not_win(self):
        head = {"date": "2026-01-01", "processor": "P", "system": "S", "pinned": True, "rounds": 2, "starts": 3, "suite": "1", "runners": {n: {"version": "1", "settings": "s"} for n in ("cbvh", "cbvh, quick", "x", "y")}}
        costs = lambda seconds: {"meshes": {"m": {"seconds": seconds, "open_seconds": None, "bytes": 1000}}, "first_nanoseconds": 5000, "triangles": {"m": 10}}
        lines = [head, {"runner": "cbvh", "pair": "p", **costs(0.2)}, {"runner": "cbvh, quick", "pair": "p", **costs(0.05)}, {"runner": "x", "pair": "p", **costs(0.1)}]
        for name, nanoseconds, wrong in (("cbvh", 2000, []), ("x", 1000, []), ("y", 10, [1])):
            # The first round is cold and does not count.
            rounds = [[nanoseconds * factor] * 2 for factor in (100, 1, 1)]
            lines.append({"runner": name, "pair": "p", "ask": "collide", "preset": "1%", "rounds": rounds, "wrong": wrong})
        # In one call, the faster library is wrong; one by one, it is right.
        for name, median, is_batch, wrong in (("cbvh", 300.0, False, []), ("x", 200.0, False, []), ("cbvh", 90.0, True, []), ("x", 180.0, True, []), ("y", 20.0, True, [3, 4])):
            times = {"median": median, "p99": 2 * median, "cold": 3 * median, "wrong": wrong, "count": 600, "checked": 40, "threads": 1}
            lines.append({"runner": name, "mesh": "m", "probe": "ray", "kind": "camera", "batch": is_batch, **times})
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "times.jsonl").write_text("\n".join(map(json.dumps, lines)), encoding="utf-8")
            report.main([folder])
            page, queries, builds, probed = ((Path(folder) / file).read_text(encoding="utf-8") for file in ("SPEED.md", "queries.csv", "builds.csv", "probes.csv"))
        self.assertIn("In 1 of 1 comparisons of queries", page)
        self.assertIn("| collide | p | 1% | 2.00 | x | 1.00 | 2.00 |", page)
        self.assertIn("| pair | 1% |\n|---|---|\n| p | 0.5 |", page)
        self.assertIn("| y | collide | p | 1% | 1 of 2 |", page)
        self.assertIn("| p | 200 | 100, x | 100 | 100, x |", page)
        self.assertIn("Costs are those of the median of 3 builds.", page)
        self.assertIn("| p, quick | 50 | 100, x | 100 | 100, x |", page)
        self.assertIn("|---|---|---|---|---|---|---|---|\n| p | cbvh | 200 | 100, x | 2.00 | 200 | 100, x | 2.00 |\n<!--", page)
        self.assertIn("In 1 of 2 comparisons of rays and points", page)
        self.assertIn("| ray | m | camera | 300 | x | 200 | 1.50 |\n\n", page)
        self.assertIn("One by one:\n\n| mesh | kind | cbvh | x | best other / cbvh |\n|---|---|---|---|---|\n| m | camera | 300 | 200 | 0.67 |\n", page)
        self.assertIn("| mesh | kind | cbvh | x | y | best other / cbvh |\n|---|---|---|---|---|---|\n| m | camera | 90 | 180 | 20 (2 wrong) | 2.00 |\n", page)
        self.assertIn("By the proofs, 3 results are wrong", page)
        self.assertIn("ray,one call,m,camera,y,1,600,40,2,20.0,40.0,60.0\n", probed)
        self.assertIn("collide,p,1%,x,2,0,1.00,1.00,100.00\ncollide,p,1%,y,2,1,0.01,0.01,1.00\n", queries)
        self.assertIn("p,x,100,100,100,\n", builds)
        self.assertLess(page.index("loses"), page.index("Do the two touch?"))


if __name__ == "__main__":
    unittest.main()
