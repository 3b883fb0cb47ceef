"""Bakes a manifest of meshes on a local Dask cluster, and asks questions about the files in its workers.

    pip install 'dask[distributed]'
    python examples/bake_with_dask.py [MANIFEST FOLDER]

Each line of MANIFEST is the path of a mesh file, relative to the manifest; FOLDER receives the baked files. Without
arguments, the meshes of testdata are baked, and one that is broken. A mesh that cannot be baked is reported, and the
others are baked all the same. Files that are up to date are left alone, so that an interrupted run continues.

A `cbvh.Mesh` that was opened from a file is pickled as its path: processes send each other paths, map the files, and
share their memory.
"""

import itertools
import logging
import os
import pathlib
import pickle
import shutil
import sys
import tempfile
import time

import distributed
import numpy as np

import cbvh

TESTDATA = pathlib.Path(__file__).resolve().parents[3] / "testdata"
MAX_MEMORY = 1 << 30  # Bytes for one bake. A mesh may need more: the rest goes to scratch files.


def bake_all(client, manifest, folder):
    """Bakes each mesh of a manifest. Returns the meshes, and the errors of those that failed, by line."""
    tasks = {}
    for line in manifest.read_text().splitlines():
        output = folder / f"{line}.cbvh"
        output.parent.mkdir(parents=True, exist_ok=True)
        # Not pure: the answer depends on files, which cbvh looks at, not only on the names that Dask sees.
        task = client.submit(cbvh.bake_files, manifest.parent / line, output, max_memory=MAX_MEMORY, pure=False)
        tasks[task] = line
    meshes, failures = {}, {}
    for task in distributed.as_completed(tasks):
        error = task.exception()
        if error is None:
            meshes[tasks[task]] = task.result()
        else:
            failures[tasks[task]] = error
            print(f"{tasks[task]}: {type(error).__name__}: {error}")
    return meshes, failures


def nearest(a, b, poses):
    """The least distance of two meshes over poses of b in the frame of a, and the process that found it."""
    return a.distance(b, poses).distance.min(), os.getpid()


def main(manifest, folder):
    # A bake uses all cores unless it is told to share them. Failures are reported here, not in the logs of workers.
    cluster = distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        dashboard_address=None,
        silence_logs=logging.CRITICAL,
        env={"RAYON_NUM_THREADS": "2"},
    )
    with cluster, distributed.Client(cluster) as client:
        start = time.perf_counter()
        meshes, failures = bake_all(client, manifest, folder)
        print(f"{len(meshes)} meshes baked, {len(failures)} failed, in {time.perf_counter() - start:.2f} s")
        pairs = list(itertools.combinations(sorted(meshes), 2))
        poses = cbvh.pose(np.random.default_rng(1).uniform(-3000, 3000, (1000, 3)))
        tasks = [client.submit(nearest, meshes[a], meshes[b], poses) for a, b in pairs]
        for (a, b), (distance, process) in zip(pairs, client.gather(tasks)):
            print(f"{a} and {b}: {distance:.6g} apart in the nearest of 1000 poses")
            # Another process found it, and the same bits are found here.
            assert process != os.getpid() and distance == nearest(meshes[a], meshes[b], poses)[0]
    return meshes, failures


def testdata(folder):
    """Bakes meshes of testdata and a broken one, and compares with bakes in this process."""
    names = ["fclenv.obj", "broken.obj", "fclrob.obj", "robot/base.obj", "robot/link.obj", "robot/hand.obj"]
    shutil.copytree(TESTDATA, folder / "in", ignore=shutil.ignore_patterns("*.cbvh"))
    (folder / "in/broken.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n")
    (folder / "in/manifest.txt").write_text("\n".join(names))
    meshes, failures = main(folder / "in/manifest.txt", folder / "baked")
    assert list(failures) == ["broken.obj"] and set(meshes) == set(names) - set(failures)
    assert isinstance(failures["broken.obj"], cbvh.BakeError) and "line 4" in str(failures["broken.obj"])
    for name, mesh in meshes.items():
        assert len(pickle.dumps(mesh)) < 1000 < mesh.nbytes
        assert mesh.tobytes() == cbvh.bake_files(folder / "in" / name, folder / "again.cbvh").tobytes()


if __name__ == "__main__":
    if len(sys.argv) == 3:
        sys.exit(1 if main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))[1] else 0)
    with tempfile.TemporaryDirectory() as place:
        testdata(pathlib.Path(place))
