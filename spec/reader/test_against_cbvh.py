"""Tests that the reader and the command `cbvh` agree on baked files and their contents, and on damage.

    CBVH=target/release/cbvh python3 -m unittest discover -s spec/reader

Without the variable CBVH, all tests are skipped. CBVH_MUTANTS sets how many damaged files to compare (1000 by default).
Larger meshes come from a folder `shared` beside the repository. If it is missing, tests that need it are skipped.
"""

import itertools
import json
import os
import random
import subprocess
import tempfile
import unittest
from unittest import mock

import numpy as np

import cbvh
import musts
import mutate
import rules
from check import load
from test_reader import Tree, file_of, instances, sections_of, with_section

COMMAND = os.environ.get("CBVH")
ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
TESTDATA = os.path.join(ROOT, "testdata")
SHARED = os.path.join(ROOT, "..", "shared")
ROBOT, ROOM = (os.path.join(TESTDATA, name) for name in ("fclrob.obj", "fclenv.obj"))
GOLDEN = "everything", "plain", "profiles", "scene", "topology", "exact", "exact-f32"
ORDERS = list(itertools.permutations(range(3)))


def read_obj(path):
    """Reads the corners of the triangles, [triangle, corner, axis] in f64. Faces must be triangles."""
    vertices, faces = [], []
    with open(path, encoding="utf-8") as stream:
        for words in map(str.split, stream):
            if words[:1] == ["v"]:
                vertices.append([float(word) for word in words[1:4]])
            if words[:1] == ["f"]:
                faces.append([int(word.split("/")[0]) - 1 for word in words[1:]])
    return np.array(vertices)[np.array(faces)]


def write_obj(path, parts):
    """Writes `parts`, pairs of a name and triangles as `read_obj` returns them."""
    with open(path, "w", encoding="utf-8") as stream:
        count = 0
        for name, triangles in parts:
            print("o", name, file=stream)
            for vertex in triangles.reshape(-1, 3).tolist():
                print("v", *map(repr, vertex), file=stream)
            for first in range(count + 1, count + 3 * len(triangles), 3):
                print("f", first, first + 1, first + 2, file=stream)
            count += 3 * len(triangles)


def with_pages(data, pages, profile):
    """Returns a file of one object with these pages, of a profile, in place of those that it has."""
    file = rules.open_file(data)
    one, file.data = file.objects[0], bytearray(data)
    at = one.place("pages")
    file.data[at : at + 4] = len(pages).to_bytes(4, "little")
    file.data[one.place("profile")] = profile
    nodes = b"".join(pages)
    return file_of(
        (kind, required, nodes if kind == cbvh.NODES else content) for kind, required, content in sections_of(file)
    )


def random_kinds(chance, layout, roots):
    """The kinds of the treelets of a page, and how many of them are short. They need not fit in a page."""
    full, counts = [[] for _ in range(roots)], {cbvh.TREELET: 0, cbvh.SHORT: 0, cbvh.REMOTE: 0}
    most = {
        cbvh.TREELET: chance.randint(0, 4000 // layout.treelet_bytes),
        cbvh.SHORT: chance.choice((0, 3, 30, 100)) if layout.short else 0,
        cbvh.REMOTE: chance.choice((0, 3, 30)),
    }
    for row in full:  # which grows
        for _ in range(chance.randint(1, layout.width)):
            kind = chance.choice((1, 1, 2, 3, 3, 3, 4, 5, 6, 7))
            if kind in most:
                kind = kind if counts[kind] < most[kind] else 7
            if kind in most:
                counts[kind] += 1
            if kind == cbvh.TREELET:
                full.append([])
            row.append(kind)
    short = counts[cbvh.SHORT]
    leaves = [[chance.randint(4, 7) for _ in range(chance.randint(1, layout.width))] for _ in range(short)]
    return full + leaves, short


def run(*arguments):
    found = subprocess.run([COMMAND, *map(str, arguments)], capture_output=True, text=True)
    if found.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, arguments))}: exit code {found.returncode}: {found.stderr}")
    return found.stdout


def distances(points, others):
    return np.sqrt(((points - others) ** 2).sum(-1))


def same_f32(numbers, expected):
    """True if the decimal numbers round to exactly these f32."""
    return np.array(numbers, np.float64).astype(np.float32).tobytes() == np.ascontiguousarray(expected).tobytes()


@unittest.skipUnless(COMMAND, "CBVH does not name the command")
class AgainstCbvh(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.chance = random.Random(7)

    def bake(self, mesh, profile="auto", triangles="auto", *options):
        name = f"{os.path.basename(mesh)}-{profile}-{triangles}{''.join(options)}.cbvh"
        path = os.path.join(self.folder, name)
        run("bake", mesh, "-o", path, "--profile", profile, "--triangles", triangles, "--jobs", 1, "-q", *options)
        return path

    def written(self, name, data):
        path = os.path.join(self.folder, name)
        with open(path, "wb") as stream:
            stream.write(data)
        return path

    def agreed(self, data, *meshes):
        """The rule that both readers find broken in these bytes, or 0. With meshes, *verify* compares them, too."""
        ours = mutate.verdict(data, bounds=bool(meshes))
        self.assertEqual(ours, mutate.verdict_of_command(COMMAND, self.written("agreed.cbvh", data), *meshes))
        return ours

    def agreed_bounds(self, file, changes):
        """The rules found broken after changes of a file baked from ROOM, each given as bytes by their places."""
        found = set()
        for change in changes:
            data = bytearray(file.data)
            for at, values in change.items():
                data[at : at + len(values)] = values
            mutate.seal(data)
            with self.subTest(change=change):
                found.add(self.agreed(data, ROOM))
        return found

    def check_bake(self, path, mesh):
        """Checks rules, requirements on writers, triangles, and the output of `dump` and `validate`."""
        file = load(path)
        self.assertEqual(list(musts.violations(file)), [], path)
        self.check_triangles(file, read_obj(mesh))
        self.check_facts(file, path)
        self.check_decoding(file, path)
        self.check_short_treelets(file)

    def check_triangles(self, file, expected):
        """Checks triangles by id: corners keep their order, and moved no further than the record states."""
        ids = np.concatenate([one.ids() for one in file.objects])
        kept, dropped = file.duplicates().T
        self.assertEqual(sorted([*ids, *dropped]), list(range(len(expected))))
        self.assertEqual(file.weights().sum(), len(expected))
        for one in file.objects:
            stored, given = one.vertices(), expected[one.ids()]
            self.assertEqual(one.input_triangles, len(expected))
            limit = one.max_vertex_rounding + one.max_quantization_error
            moved = distances(stored, given).max()
            # Differences are exact here. The stated bounds exceed the distances by more than the rounding below.
            self.assertLessEqual(moved, limit)
            # After moving, duplicates have the corners of the triangle that is kept, in some order.
            places = {triangle: place for place, triangle in enumerate(one.ids().tolist())}
            here = np.isin(kept, one.ids())
            originals = stored[[places[triangle] for triangle in kept[here].tolist()]]
            left_out = expected[dropped[here]]
            orders = [distances(originals, left_out[:, order]).max(1) for order in ORDERS]
            self.assertLessEqual(np.min(orders, axis=0).max(initial=0), limit)
            self.check_topology(file, one, [places[triangle] for triangle in kept[here].tolist()], orders)
            if cbvh.ENCODINGS[one.triangle_encoding] == "quantized":
                continue
            # Coordinates are multiples of 2^-180; others are rounded to these, ties to even.
            on_unit = np.where(np.abs(given) < 2.0**-128, np.rint(given * 2.0**180) * 2.0**-180, given) + 0.0
            self.assertEqual(one.max_vertex_rounding > 0, (on_unit != given).any())
            self.assertEqual(on_unit.tobytes(), stored.tobytes())

    def check_topology(self, file, one, of_duplicates, orders):
        """Recomputes nets and the boundary from the duplicates in the input, of which `orders` has the distance to each
        order of the corners of the stored triangle."""
        even = [sum(a > b for a, b in itertools.combinations(order, 2)) % 2 == 0 for order in ORDERS]
        same, turned = (np.min([o for o, e in zip(orders, even) if e == way], axis=0) for way in (True, False))
        nets = np.ones(len(one.places()), np.int64)
        np.add.at(nets, of_duplicates, np.where(same <= turned, 1, -1))
        triangle, edge, way = one.traversals()
        boundary = np.zeros(edge.max(initial=-1) + 1, np.int64)
        np.add.at(boundary, edge, way * nets[triangle])
        topology = file.topology[one.number]
        self.assertEqual(bool(topology.closed), not boundary.any())
        self.assertEqual(topology.nets_of(one.places()).tolist(), nets.tolist())
        self.assertEqual(topology.nets, np.count_nonzero(nets != 1))

    def check_facts(self, file, path):
        validated, dumped = (json.loads(run(verb, path, "--json")) for verb in ("validate", "dump"))
        self.assertEqual(validated["valid"], True)
        self.assertEqual(validated["content_xxh3"], f"{file.content_checksum():016x}")
        for field in ("pages", "treelets", "triangles"):
            self.assertEqual(validated[field], sum(getattr(one, field) for one in file.objects))
        self.assertEqual(dumped["provenance"], file.provenance())
        for entry, section in zip(file.entries, dumped["sections"], strict=True):
            self.assertEqual((section["offset"], section["bytes"]), (entry.offset, entry.length))
            self.assertEqual(section["xxh3"], f"{entry.checksum:016x}")
        for one, facts in zip(file.objects, dumped["objects"], strict=True):
            self.assertEqual(facts["name"], one.name)
            self.assertEqual(facts["profile"], one.layout.name)
            self.assertEqual(facts["triangle_encoding"], cbvh.ENCODINGS[one.triangle_encoding])
            self.assertEqual(facts["origin"], one.origin.tolist())
            for field in ("box_lo", "box_hi", "sphere_centre", "sphere_radius"):
                self.assertTrue(same_f32(facts[field], np.float32(getattr(one, field))), field)
            topology = file.topology[one.number] if file.topology else None
            for field in ("components", "nets"):
                self.assertEqual(facts[field], getattr(topology, field, None), field)
            self.assertEqual(facts["closed"], bool(topology.closed) if topology else None)
            for field in (
                *("input_triangles", "triangles", "degenerate", "duplicates", "treelets", "packets", "first_page"),
                *("pages", "max_vertex_rounding", "max_quantization_error", "radius", "solid"),
            ):
                self.assertEqual(facts[field], getattr(one, field), field)
        instances = [
            {field: getattr(one, field) for field in ("number", "name", "object", "member", "meets", "margin")}
            | {"solid": bool(one.solid), "rotation": one.rows(), "translation": one.translation.tolist()}
            for one in file.instances
        ]
        self.assertEqual(dumped["instances"], instances)

    def check_decoding(self, file, path):
        """Compares the bits of decoded slabs, and links, of a few treelets drawn at random, short ones and others."""
        places = [(page, slot) for one in file.objects for page in one.pages_read for slot in range(page.treelets)]
        short = [number for number, (page, slot) in enumerate(places) if page.is_short(slot)]
        full = [number for number, (page, slot) in enumerate(places) if not page.is_short(slot)]
        for number in (self.chance.choice(sort) for sort in (full, full, short, short) if sort):
            page, slot = places[number]
            dumped = json.loads(run("dump", path, "--treelet", number, "--json"))
            self.assertEqual(
                (dumped["page"], dumped["slot"], dumped["offset"]), (page.number, slot, page.treelet_at(slot))
            )
            own_lo, own_hi, lo, hi = page.decode()
            slabs = [(own_lo[slot], own_hi[slot], dumped["slabs"])]
            for child, found in enumerate(dumped["children"]):
                slabs.append((lo[slot, child], hi[slot, child], found["slabs"]))
                kind, target = page.targets(slot)[child]
                if kind in (cbvh.TREELET, cbvh.SHORT):
                    self.assertEqual((found["kind"], found["slot"]), ("treelet", target))
                elif kind == cbvh.REMOTE:
                    self.assertEqual((found["kind"], found["page"], found["root"]), ("remote", *page.remote(target)))
                else:
                    self.assertEqual((found["packet"], found["triangles"]), (target, kind - 3))
            self.assertEqual(len(dumped["children"]), page.children(slot))
            for low, high, found in slabs:
                ends = list(zip(*found))
                self.assertTrue(same_f32(ends[0], low) and same_f32(ends[1], high), (path, number))

    def check_short_treelets(self, file):
        """Checks what 7.5 states about bvh-bake: which treelets are short."""
        for one in file.objects:
            for page in one.pages_read:
                for slot in range(page.treelets):
                    only_leaves = all(kind >= cbvh.LEAF for kind, _ in page.targets(slot))
                    may_be_short = one.layout.short and page.is_packed() and slot >= page.roots
                    self.assertEqual(page.is_short(slot), bool(may_be_short and only_leaves), (page.number, slot))

    def test_every_profile_and_encoding(self):
        profiles = [profile.name for profile in cbvh.PROFILES]
        for mesh, profile, triangles in itertools.product((ROBOT, ROOM), profiles, cbvh.ENCODINGS):
            with self.subTest(mesh=os.path.basename(mesh), profile=profile, triangles=triangles):
                self.check_bake(self.bake(mesh, profile, triangles), mesh)

    def test_objects_origins_duplicates_and_degenerates(self):
        robot = read_obj(ROBOT)
        near, far = robot * 1e-3 + [1e6 + 0.1, -2e6 + 0.3, 0], robot * 1e-2 + [5e7 + 1 / 3, 0, 0]
        flat = np.array([[[0, 0, 0], [1, 2, 3], [0, 0, 0]], [[4, 4, 4]] * 3, [[-1, -1, -1], [0, 0, 0], [3, 3, 3]]])
        mesh = os.path.join(self.folder, "parts.obj")
        parts = [("über", near), ("", np.concatenate([robot, robot[5:60, ::-1], flat, robot[:9]])), ("far", far[:40])]
        write_obj(mesh, parts)
        for profile, triangles in itertools.product(("dop14-u8", "dop6-f16", "dop14-f32"), cbvh.ENCODINGS):
            path = self.bake(mesh, profile, triangles, "--split-objects")
            self.check_bake(path, mesh)
            objects = load(path).objects
            self.assertEqual(len(objects), 3)
            self.assertEqual(sum(one.duplicates for one in objects), 55 + 9)
            self.assertGreaterEqual(sum(one.degenerate for one in objects), len(flat))
            self.assertTrue(objects[0].origin[:2].all())
            self.check_bake(self.bake(mesh, profile, triangles), mesh)

    def test_closed_and_open_surfaces(self):
        robot = read_obj(ROBOT)
        turned, mesh = robot[:, [1, 0, 2]], os.path.join(self.folder, "surfaces.obj")
        around = np.array([[-99, -99, -99], [200, 0, 0], [0, 200, 0], [0, 0, 200]])
        shell = around[[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]].astype(float)
        for parts, triangles in itertools.product(
            (
                [("closed", shell)],
                [("turned", shell[:, ::-1]), ("open", shell[1:])],
                [("all", np.concatenate([robot, turned, robot, shell])), ("most", np.concatenate([robot, turned[1:]]))],
                [("both", np.concatenate([shell, shell[:, [1, 2, 0]], shell[:2, ::-1], shell[:2]]))],
            ),
            cbvh.ENCODINGS,
        ):
            write_obj(mesh, parts)
            self.check_bake(self.bake(mesh, "auto", triangles, "--split-objects"), mesh)
            self.check_bake(self.bake(mesh, "auto", triangles), mesh)

    def test_without_ids(self):
        path = self.bake(ROBOT, "dop26-u8-wide", "packed", "--no-ids")
        file = load(path)
        self.assertEqual(list(musts.violations(file)), [])
        self.assertNotIn(cbvh.IDS, file.sections)
        self.check_facts(file, path)

    def test_instances(self):
        scene = os.path.join(TESTDATA, "ok-scene.cbvh")
        self.check_facts(load(scene), scene)
        data = load(os.path.join(TESTDATA, "ok-profiles.cbvh")).data
        changes = [
            {
                "text": self.chance.choice(("", f"Tür {number}", f"{number}\n\"")).encode(),
                "object": self.chance.randrange(len(cbvh.PROFILES)),
                "member": self.chance.getrandbits(32),
                "meets": self.chance.getrandbits(32),
                "rotation": random_rotation(self.chance),
                "translation": [self.chance.uniform(-1, 1) * 2.0 ** self.chance.choice((118, 0, -99)) for _ in "xyz"],
            }
            for number in range(50)
        ]
        path = self.written("scene.cbvh", with_section(data, instances(*changes)))
        file = load(path)
        self.assertEqual(list(musts.violations(file)), [])
        self.check_facts(file, path)

    def test_rotations_near_the_limit(self):
        """Rotations of instances that are scaled and sheared, so that rounding decides about some of them."""
        data, verdicts = load(os.path.join(TESTDATA, "ok-plain.cbvh")).data, set()
        for _ in range(60):
            # Squares of 1 + these are about 1 + 2^-23 and 1 - 2^-23, as far as f64 can tell.
            scales = [self.chance.choice((2.0**-24, -(2.0**-24), 0)) - 2.0**-49 for _ in range(3)]
            change = np.diag(scales) + self.chance.choice((0, 0, 1e-12, 2.0**-25)) * random_rotation(self.chance)
            rotation = (np.eye(3) + change) @ random_rotation(self.chance)
            verdicts.add(self.agreed(with_section(data, instances({"rotation": rotation}))))
        self.assertEqual(verdicts, {0, 42})

    def test_bounds_of_coordinates_that_cancel(self):
        """The sum is 1 + 2^-60 - 1, so the upper end along (1, 1, 1) must not be 0."""
        mesh = os.path.join(self.folder, "cancel.obj")
        write_obj(mesh, [("cancel", np.array([[[1, 2.0**-60, -1], [-1, 0, -1], [0, -1, -1]]]))])
        self.check_bake(self.bake(mesh, "dop14-u8", "f32"), mesh)

    def test_vertices_of_all_predictors(self):
        """Bakes coordinates that are no f32 numbers, of each sort, and changes what their objects state about them."""
        robot = read_obj(ROBOT)
        small = robot.astype(np.float32).astype(float)
        noise = small + np.random.default_rng(4).uniform(-1, 1, robot.shape) * 1e-9

        # Of all magnitudes, so that no number of digits after the point suits them
        wide = (small * 10.0 ** (np.arange(len(small)) % 5)[:, None, None]).astype(np.float32)

        def parsed(form):
            return np.array([float(form(value)) for value in wide.ravel().tolist()]).reshape(wide.shape)

        parts = [
            ("decimals", np.round(small, 3) + 0.0),
            ("far", np.round(small, 1) + [1e7 + 0.1, 0.3, -2e8]),
            ("six", parsed(lambda value: f"{value / 7:.5e}")),
            ("nine", parsed(lambda value: f"{value / 7000:.8e}")),
            ("shortest", parsed(lambda value: str(np.float32(value * 1.1)))),
            ("metres", small * 0.001),
            ("inches", small[:, ::-1] * 0.0254),
            ("noise", noise),
            ("some noise", np.where(np.arange(len(small))[:, None, None] % 9 == 0, noise, np.round(small, 2))),
            ("tiny", np.round(small, 2) * 2.0**-150),
        ]
        parts = [(name, part[:120]) for name, part in parts]
        mesh = os.path.join(self.folder, "exact.obj")
        write_obj(mesh, parts)
        seen, found = set(), set()
        layouts = ("dop26-u8-wide", "packed"), ("dop14-u8", "f32"), ("dop6-f16", "packed"), ("dop14-f32", "f32")
        for profile, triangles in layouts:
            path = self.bake(mesh, profile, triangles, "--split-objects")
            self.check_bake(path, mesh)
            self.check_bake(self.bake(mesh, profile, triangles), mesh)
            file = load(path)
            for one in file.objects:
                seen |= set(one.predictors.tolist()) | {f"corrected {int(one.corrected > 0)}"}
            for _ in range(40):
                one = self.chance.choice(file.objects)
                data, at = bytearray(file.data), one.place("left_out") + 4 * self.chance.randrange(3)
                value = np.frombuffer(data, "<f4", 1, at)[0]
                near = np.nextafter(value, np.float32(self.chance.choice((0, 1))))
                data[at : at + 4] = self.chance.choice((near, value * np.float32(3))).tobytes()
                mutate.seal(data)
                found.add(self.agreed(data, mesh))
        self.assertLessEqual({12, 35, 37}, found)
        self.assertEqual(seen, {*range(len(cbvh.PREDICTORS)), "corrected 0", "corrected 1"})

    def test_turning_slabs(self):
        """Changes turning slabs of one child each: `cbvh verify` and this reader find the same rule broken."""
        path = self.bake(ROOM, "dop26-u8-wide", "f32")
        file = load(path)
        there, absent = [], []
        for page in file.objects[0].pages_read:
            codes = page.turning_codes()
            for slot in range(page.treelets):
                for child in range(page.children(slot)):
                    places = [page.treelet_at(slot) + first + child for first in page.layout.turning]
                    (there if codes[slot, child].any() else absent).append(places)
        self.assertGreater(len(there), 100)
        changes = []
        for number in range(60):
            # The first children without one are near the root, so that R39 is reached.
            places = self.chance.choice(there) if number % 2 else absent[number // 2 % len(absent)]
            if number % 4 == 1:
                at = self.chance.choice(places)
                changes.append({at: bytes([(file.data[at] + self.chance.choice((-1, 1, 1, 2, 5))) % 256])})
            else:
                codes = [self.chance.choice((0, 1, 127, self.chance.randrange(256))) for _ in places]
                changes.append({at: bytes([code]) for at, code in zip(places, codes)})
        self.assertEqual(self.agreed_bounds(file, changes), {0, 35, 39})

    def test_codes_of_short_treelets(self):
        """Changes codes of one short treelet each: `cbvh verify` and this reader find the same rule broken."""
        for profile in ("dop14-u8", "dop6-u8"):
            path = self.bake(ROOM, profile, "packed")
            file = load(path)
            pages = [page for page in file.objects[0].pages_read if page.short]
            self.assertGreater(len(pages), 0)
            changes = []
            for _ in range(40):
                page = self.chance.choice(pages)
                slot = self.chance.randrange(page.first_short, page.treelets)
                places = cbvh.places_of_short_codes(page.layout)[: page.children(slot)]
                at = page.treelet_at(slot) + int(self.chance.choice(places.ravel()))
                codes = [file.data[at] & 15, file.data[at] >> 4]
                end = self.chance.randrange(2)
                codes[end] = min(max(codes[end] + self.chance.choice((-1, 1)), 0), 15)
                changes.append({at: bytes([codes[0] | codes[1] << 4])})
            self.assertEqual(self.agreed_bounds(file, changes), {0, 35})

    def test_anchors_and_spheres(self):
        """Changes an end of an anchor or the sphere each: `cbvh verify` and this reader find the same rule broken."""
        for profile in ("dop26-u8-wide", "dop14-f32", "dop6-f16"):
            file = load(self.bake(ROOM, profile, "packed"))
            one = file.objects[0]
            anchors = [(page, root) for page in one.pages_read[1:] for root in range(page.roots)]
            changes = []
            for _ in range(20):
                if self.chance.random() < 0.25:
                    at = one.place("sphere_radius")
                    factor = self.chance.choice((0.99, 1.0, 1.5))
                else:
                    page, root = self.chance.choice(anchors)
                    at = page.anchor_at(root) + 4 * self.chance.randrange(2 * page.layout.slabs)
                    factor = self.chance.choice((0.9, 1.1, 1e9))
                changes.append({at: (np.frombuffer(file.data, "<f4", 1, at)[0] * np.float32(factor)).tobytes()})
            self.assertLessEqual({35, 49}, self.agreed_bounds(file, changes))

    def test_limit_of_turning_slabs(self):
        """R39 depends on the greatest number of triangles that occurs, and comes after R35 in a later page."""
        file = load(self.bake(ROOM, "dop26-u8-wide", "f32"))
        pages, below, counts = file.objects[0].pages_read, {}, {}
        for page in reversed(pages):
            own, children = rules.subtrees_of(page, below)
            below.update({(page.number, root): own[root] for root in range(page.roots)})
            for slot, child in np.ndindex(page.treelets, page.layout.width):
                if child < page.children(slot):
                    place = page.treelet_at(slot) + page.layout.turning[0] + child
                    has_slab = page.turning_codes()[slot, child].any()
                    counts[place] = children[slot][child].triangles, has_slab
        most = max(count for count, has_slab in counts.values() if has_slab)
        self.assertTrue(256 < most <= cbvh.TURNING_TRIANGLES)
        for limit, rule in ((most, 0), (most - 1, 39)):
            with mock.patch("cbvh.TURNING_TRIANGLES", limit):
                self.assertEqual(mutate.verdict(file.data, bounds=True), rule)

        data, at = bytearray(file.data), pages[-1].anchor_at(0)
        data[at : at + 4] = data[at + 4 * 13 : at + 4 * 14]  # slab 0 has no width
        mutate.seal(data)
        self.assertEqual(mutate.verdict(data, bounds=True), 35)
        place = next(place for place, (count, _) in counts.items() if count > cbvh.TURNING_TRIANGLES)
        self.assertLess(place, pages[1].at)
        data[place] = 1
        mutate.seal(data)
        self.assertEqual(mutate.verdict(data, bounds=True), 35)
        data = bytearray(file.data)
        data[place] = 1
        mutate.seal(data)
        self.assertEqual(mutate.verdict(data, bounds=True), 39)

    def test_bounds_ignore_lanes_without_triangles(self):
        file = load(self.bake(ROOM, "dop26-u8-wide", "f32"))
        data = bytearray(file.data)
        for page in file.objects[0].pages_read:
            for packet, lane in np.argwhere(~page.lanes_used()):
                at = page.leaf_block_at() + cbvh.F32_PACKET_BYTES * int(packet) + 4 * int(lane)
                data[at : at + 4] = np.float32(1e6).tobytes()  # which predictors leave as it is
        mutate.seal(data)
        self.assertNotEqual(data, file.data)
        self.assertEqual(self.agreed(data, ROOM), 0)

    @unittest.skipUnless(os.path.exists(SHARED), "there is no folder shared beside the repository, with larger meshes")
    def test_larger_meshes(self):
        for name in ("piano", "apartment"):
            mesh = os.path.join(SHARED, "meshes", name + ".obj")
            for profile, triangles in (("dop26-u8-wide", "packed"), ("dop14-u8", "quantized")):
                self.check_bake(self.bake(mesh, profile, triangles), mesh)

    def test_damaged_files(self):
        """Compares verdicts on mutants: of each group of files, the part to damage, how many of CBVH_MUTANTS to make, the
        seed, and the rules that they must break if CBVH_MUTANTS is at least 1000.
        """
        count = int(os.environ.get("CBVH_MUTANTS", "1000"))
        golden = {name: os.path.join(TESTDATA, f"ok-{name}.cbvh") for name in GOLDEN}
        heads = [path for name, path in golden.items() if name != "profiles"]
        layouts = [("dop14-u8", "f32"), ("dop6-f16", "packed"), ("dop14-f32", "quantized"), ("dop26-u4", "f32")]
        layouts += [("dop26-u8-wide", "packed"), ("dop14-u8", "packed"), ("dop6-u8", "quantized")]
        whole = [self.bake(mesh, *layout) for layout in layouts for mesh in (ROBOT, ROOM)]
        short = [
            self.bake(mesh, profile, "packed", *options)
            for mesh, profile in itertools.product((ROBOT, ROOM), ("dop14-u8", "dop6-u8"))
            for options in ((), ("--no-ids",))
        ]
        layouts = ("dop14-u8", "f32"), ("dop6-u8", "f32"), ("dop6-f16", "packed"), ("dop26-u4", "f32")
        full = [self.bake(ROOM, *layout) for layout in layouts]
        exact = [golden["exact"], golden["exact-f32"]]
        ids = [golden["everything"], self.bake(ROBOT, "dop14-u8", "packed")]
        for files, only, part, seed, expected in (
            ([*golden.values(), *whole], "", 1, 3, set()),
            (heads, "head", 2, 11, {2, 4, 5, 6, 7, 8, 9}),
            (heads, "offsets", 2, 12, {4, 5, 7, 8, 9}),
            (ids, "id", 2, 5, {0, 31, 32, 33}),
            (exact, "corrections", 2, 13, {0, 26, 37, 52}),
            (exact, "predictors", 2, 14, {0, 12, 37, 52}),
            (short, "short", 1, 9, {0, 17, 21, 22, 24, 25}),
            # Files in which no treelet is short, or can be.
            (full, "short counts", 4, 10, {17, 18, 25}),
            (full, "links", 4, 10, {0, 21, 22, 24}),
        ):
            with self.subTest(only=only):
                broken, different = mutate.compare(COMMAND, count // part, seed, files, self.folder, only=only)
                self.assertEqual(different, [])
                if count >= 1000:
                    self.assertLessEqual(expected, set(broken))
                if not only:
                    self.assertGreater(len(broken), min(count // 20, 20))

    def test_short_files(self):
        for name in ("ok-plain", "ok-everything", "bad-R02-major-5"):
            with open(os.path.join(TESTDATA, f"{name}.cbvh"), "rb") as stream:
                data = stream.read()
            for length in (*range(0, 64 + 32 * 8, 7), 63, 64, 159, 160, 255, 256):
                with self.subTest(name=name, length=length):
                    self.agreed(data[:length])

    def test_random_pages(self):
        """Trees of all profiles drawn at random. A number in the page's header or in a treelet is changed in most."""
        base, broken = load(self.bake(ROBOT, "auto", "packed", "--no-topology")).data, set()
        count = int(os.environ.get("CBVH_MUTANTS", "1000")) // 4
        for number in range(count):
            profile = self.chance.choice((0, 1, self.chance.randrange(len(cbvh.PROFILES))))
            roots = self.chance.choice((1, 1, 2, 3, 8))
            kinds, short = random_kinds(self.chance, cbvh.PROFILES[profile], roots)
            tree = Tree(profile, kinds, short, roots, number=1)
            if tree.verdict() == 0 and number % 4:
                page = tree.touch()
                slot = self.chance.randrange(page.treelets)
                places = page.place("roots"), page.kinds_at(slot), page.links_at(slot)
                at = self.chance.choice(places) - page.at
                size = 6 if at + page.at == places[0] else 4
                word = int.from_bytes(tree.data[at : at + size], "little")
                word += self.chance.choice((-1, 1, 2)) << self.chance.choice((*range(0, 8 * size, 4), *mutate.FIELDS))
                tree.data[at : at + size] = (word % (1 << 8 * size)).to_bytes(size, "little")
            # The page above has a link to the first root.
            data = with_pages(base, [Tree(profile, [[2]]).data, tree.data, bytes(cbvh.PAGE)], profile)
            with self.subTest(profile=profile, kinds=kinds, short=short, roots=roots, number=number):
                broken.add(self.agreed(data))
        if count >= 250:
            self.assertLessEqual({17, 21, 22, 23, 24, 25, 28}, broken)


def random_rotation(chance):
    w, x, y, z = np.random.default_rng(chance.randrange(1 << 32)).standard_normal(4)
    w, x, y, z = np.array([w, x, y, z]) / np.sqrt(w * w + x * x + y * y + z * z)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


if __name__ == "__main__":
    unittest.main()
