"""Runs trimesh's own tests of collisions on `cbvh.CollisionManager`.

The test file comes from the source distribution of trimesh, whose path is the argument: it holds the tests, but not their
models. The cube is made here, and so is a scene of parts that touch. They run twice: as they are, where one of them asks in
which of six equal directions a cube leaves another one in the same place, and for the one point of contact that FCL chooses;
and without these two assertions, where all have to pass.
"""

import sys
import tarfile
import types
import unittest

import numpy as np
import trimesh

import cbvh

# What the assertions are about that depends on choices of FCL.
CHOICES = ("c.point,", "c.normal,")


def model(name):
    """What stands for a model of trimesh's tests."""
    if name == "unit_cube.STL":
        return trimesh.creation.box()
    parts = [trimesh.creation.icosphere(radius=1.0 + 0.1 * number) for number in range(4)]
    return trimesh.Scene([part.apply_translation([number * 1.5, 0, 0]) for number, part in enumerate(parts)])


def main(path):
    with tarfile.open(path) as archive:
        (name,) = [name for name in archive.getnames() if name.endswith("/tests/test_collision.py")]
        source = archive.extractfile(name).read().decode()
    trimesh.collision.CollisionManager = cbvh.CollisionManager
    random_numbers = np.random.default_rng(0)
    generic = types.ModuleType("generic")
    vars(generic).update(unittest=unittest, np=np, trimesh=trimesh, get_mesh=model, random=random_numbers.random)
    generic.log = types.SimpleNamespace(warning=print, debug=print)
    sys.modules["generic"] = generic
    # The tests run if there is FCL; what they call is the manager above.
    sys.modules["fcl"] = types.ModuleType("fcl")
    asks = [line for line in source.splitlines() if any(text in line for text in CHOICES)]
    kept = "\n".join(line.split("assert")[0] + "pass" if line in asks else line for line in source.splitlines())
    failed, count = run(source, "as it is")
    failed_without, _ = run(kept, f"without {len(asks)} assertions about choices")
    for trace in failed_without.values():
        print(trace)
    return 0 if failed.keys() == {"test_collision"} and not failed_without and count > 4 else 1


def run(source, how):
    """Runs the tests of a file. Returns what failed, by name, and how many tests there are."""
    module = types.ModuleType("test_collision")
    exec(compile(source, "test_collision.py", "exec"), vars(module))
    tests = [test for group in unittest.defaultTestLoader.loadTestsFromModule(module) for test in group]
    names = [test.id().split(".")[-1] for test in tests]
    result = unittest.TestResult()
    for test in tests:
        test.run(result)
    failed = {test.id().split(".")[-1]: trace for test, trace in result.errors + result.failures}
    for name in names:
        print(f"{how}: {name} {'failed' if name in failed else 'passed'}")
    return failed, result.testsRun


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
