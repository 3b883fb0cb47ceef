"""Pages hold what they show: the bytes of the meshes, and the numbers of poses, motions and scenes."""

import base64
import gzip
import html.parser
import json
import os
import pathlib
import sys
import tempfile
import unittest
import unittest.mock

import cbvh
import numpy as np
from common import check_errors, cube, random_poses, shifts


def content(page):
    """What a page says, and the bytes of its files."""
    said, _, rest = page.partition('<script type="application/json" id="cbvh-content">')[2].partition("</script>")
    opening = '\n<script type="text/plain" class="cbvh-file">'
    files = []
    while rest.startswith(opening):
        packed, _, rest = rest[len(opening) :].partition("</script>")
        files.append(gzip.decompress(base64.b64decode(packed)))
    said = json.loads(said)
    assert said["version"] == 1 and [file["bytes"] for file in said["files"]] == [len(file) for file in files]
    return said, files


def rows(pose):
    """The twelve numbers of a pose."""
    return pose[:3].ravel().tolist()


class View(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.small, cls.large = cbvh.bake(*cube()), cbvh.bake(*cube(3))

    def test_one_mesh(self):
        said, files = content(self.small.view().html())
        self.assertEqual(files, [self.small.tobytes()])
        self.assertEqual(said["files"], [{"name": "mesh", "path": "", "bytes": self.small.nbytes}])
        self.assertEqual(said["show"], {"kind": "file"})

    def test_pairs(self):
        (pose,) = random_poses(1, 1, 5)
        said, files = content(self.small.view(self.large, pose, within=0.5).html())
        self.assertEqual(files, [self.small.tobytes(), self.large.tobytes()])
        self.assertEqual(said["show"], {"kind": "pair", "pose": rows(pose), "within": 0.5})
        said, _ = content(self.small.view(self.large).html())
        self.assertEqual(said["show"], {"kind": "pair", "pose": rows(np.eye(4))})
        said, files = content(self.small.view(pose=pose).html())
        self.assertEqual((said["show"]["same"], len(files)), (True, 1))

    def test_shapes(self):
        # The file of a ball, or of a mesh with a radius, states the radius.
        ball = self.small.rounded(0.25)
        _, files = content(ball.view(self.small.solid()).html())
        opened = [cbvh.Mesh.from_bytes(file) for file in files]
        self.assertEqual([(mesh.radius, mesh.is_solid) for mesh in opened], [(0.25, False), (0, True)])

    def test_motions(self):
        start, end = random_poses(2, 2, 5)
        motion = cbvh.Motion.between(start, end)
        expected = {"kind": "motion", "motion": rows(start) + rows(end), "clearance": 0.5, "tolerance": None}
        for given in motion, (start, end), np.stack([start, end]):
            said, _ = content(self.small.view(self.large, motion=given, clearance=0.5).html())
            self.assertEqual(said["show"], expected)
        said, _ = content(self.small.view(motion=motion, tolerance=1e-3).html())
        self.assertEqual((said["show"]["tolerance"], said["show"]["same"]), (1e-3, True))

    def test_scenes(self):
        scene = cbvh.Scene()
        first = scene.add(self.small, name="first")
        removed = scene.add(self.small)
        second = scene.add(self.large, shifts([0, 0, 9])[0], name="</script>", member=1, meets=2)
        scene.remove(removed)
        third = scene.add(self.small)
        self.assertEqual([second, third], [2, 3])
        scene.set_allowed(first, second)
        scene.set_margin(second, 0.25)
        scene.set_pair_margin(first, third, 0.5)
        said, files = content(scene.view().html())
        self.assertEqual(sorted(files), sorted([self.small.tobytes(), self.large.tobytes()]))
        show = said["show"]
        by_name = {instance["name"]: number for number, instance in enumerate(show["instances"])}
        one, two = by_name.pop("first"), by_name.pop("</script>")
        # Without a name, an instance has the number that Python knows, wherever the library keeps it.
        other = by_name.pop("#3")
        self.assertEqual(by_name, {})
        instance = show["instances"][two]
        self.assertEqual(files[instance["file"]], self.large.tobytes())
        self.assertEqual((instance["margin"], instance["member"], instance["meets"]), (0.25, 1, 2))
        self.assertEqual([show["instances"][one][field] for field in ("member", "meets")], [2**32 - 1] * 2)
        self.assertEqual((instance["pose"], instance["moving"]), (rows(shifts([0, 0, 9])[0]), False))
        self.assertEqual([sorted(pair) for pair in show["allowed"]], [sorted([one, two])])
        self.assertEqual([(sorted(pair), margin) for *pair, margin in show["pair_margins"]], [(sorted([one, other]), 0.5)])

    def test_files(self):
        with tempfile.TemporaryDirectory() as folder:
            place = pathlib.Path(folder)
            self.small.save(place / "small.cbvh")
            mesh = cbvh.open(place / "small.cbvh")
            view = mesh.view(path=place / "page.html")
            self.assertEqual((place / "page.html").read_text(encoding="utf-8"), view.html())
            said, files = content(view.html())
            self.assertEqual(said["files"][0]["name"], "small.cbvh")
            self.assertEqual(pathlib.Path(said["files"][0]["path"]), place / "small.cbvh")
            self.assertEqual(files, [(place / "small.cbvh").read_bytes()])
            view.save(str(place / "again.html"))
            scene = cbvh.Scene()
            scene.add(mesh)
            said, _ = content(scene.view(place / "scene.html").html())
            self.assertEqual(said["files"][0]["name"], "small.cbvh")
            self.assertRaises(FileNotFoundError, view.save, place / "none" / "page.html")
            pages = ["again.html", "page.html", "scene.html", "small.cbvh"]
            self.assertEqual(sorted(os.listdir(place)), pages)

    @unittest.skipUnless(sys.platform == "linux", "other systems have no such names")
    def test_names_that_are_no_utf_8(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.fsdecode(os.fsencode(folder) + b"/small\xff.cbvh")
            self.small.save(path)
            mesh, scene = cbvh.open(path), cbvh.Scene()
            scene.add(mesh)
            for view in mesh.view(), scene.view():
                said, files = content(view.html())
                self.assertEqual((said["files"][0]["name"], files), ("small\ufffd.cbvh", [self.small.tobytes()]))
            mesh.view(path=os.fsdecode(os.fsencode(folder) + b"/page\xff.html"))
            self.assertEqual(sorted(os.listdir(os.fsencode(folder))), [b"page\xff.html", b"small\xff.cbvh"])

    def test_notebook(self):
        class Frames(html.parser.HTMLParser):
            found = []

            def handle_starttag(self, tag, attributes):
                self.found.append((tag, dict(attributes)))

        view = self.small.view()
        view.height = 300
        parser = Frames()
        parser.feed(view._repr_html_())
        ((tag, attributes),) = parser.found
        self.assertEqual((tag, attributes["srcdoc"]), ("iframe", view.html()))
        self.assertIn("300px", attributes["style"])
        # Scripts of the same origin as the notebook could take the frame's limits away.
        self.assertEqual(attributes["sandbox"], "allow-scripts allow-downloads")
        self.assertEqual(sorted(attributes), ["sandbox", "srcdoc", "style"])
        with unittest.mock.patch("cbvh._view.MAX_CELL", 10):
            self.assertIn("save", view._repr_html_())

    def test_browser(self):
        with tempfile.TemporaryDirectory() as folder, unittest.mock.patch("tempfile.tempdir", folder):
            with unittest.mock.patch("webbrowser.open") as opened:
                path = self.small.view().open()
            self.assertEqual(opened.call_args.args, (pathlib.Path(path).as_uri(),))
            self.assertEqual(content(pathlib.Path(path).read_text(encoding="utf-8"))[1], [self.small.tobytes()])

    def test_misuse(self):
        view, pose = self.small.view, np.eye(4)
        screw = cbvh.Motion.screw(pose, [0, 0, 0], [0, 0, 1], 1.0)
        many = cbvh.Motion.between(shifts([0, 0, 0], [1, 0, 0]), pose)
        far = 2 * pose
        check_errors(
            self,
            [
                (TypeError, "other: expected a cbvh.Mesh", view, 1),
                (ValueError, "pose", view, self.large, far),
                (ValueError, "pose: expected shape (4, 4)", view, self.large, np.eye(3)),
                (ValueError, "motion: expected shape (2, 4, 4)", lambda: view(motion=pose)),
                (ValueError, "expected one of Motion.between", lambda: view(motion=screw)),
                (ValueError, "found 2; take one", lambda: view(motion=many)),
                (ValueError, "half a circle", lambda: view(motion=(pose, np.diag([-1.0, -1, 1, 1])))),
                (ValueError, "expected no pose", lambda: view(pose=pose, motion=(pose, pose))),
                (ValueError, "within", lambda: view(within=-1.0)),
                (ValueError, "clearance", lambda: view(motion=(pose, pose), clearance=np.nan)),
                (ValueError, "expected a motion", lambda: view(self.large, clearance=0.5)),
                (ValueError, "expected a motion", lambda: view(tolerance=1e-3)),
                (ValueError, "max_bytes", lambda: view(max_bytes=10)),
                (ValueError, "max_bytes", lambda: view(max_bytes=-1)),
                (TypeError, "max_bytes", lambda: view(max_bytes="many")),
                (TypeError, "Mesh.view or Scene.view", cbvh.View, None),
            ],
        )


if __name__ == "__main__":
    unittest.main()
