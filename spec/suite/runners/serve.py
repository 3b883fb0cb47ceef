"""Speaks the protocol for a runner: reads a line, calls a function, writes a line.

A runner gives a function that makes a mesh of an array of corners and one of triangles, and a function for each question that it
answers. Everything that libraries print goes to standard error, so that it cannot end up among the answers.
"""

import ctypes
import json
import os
import sys
import time

import numpy as np

HELLO = 1


class Refused(Exception):
    """The library has no answer, for the reason given."""


def rows(question):
    """Returns the pose of a question as a rotation matrix and a translation."""
    m = np.array(question["pose"], float).reshape(3, 4)
    return np.ascontiguousarray(m[:, :3]), np.ascontiguousarray(m[:, 3])


def finite(values, shape):
    """Returns an array of numbers that must all be finite."""
    array = np.array(values, float).reshape(shape)
    if not np.isfinite(array).all():
        raise Refused("expected finite numbers")
    return array


def resident():
    """Returns the bytes of resident memory, or None where that is unknown."""
    try:
        ctypes.CDLL(None).malloc_trim(0)
        with open("/proc/self/statm", encoding="ascii") as pages:
            return int(pages.read().split()[1]) * os.sysconf("SC_PAGESIZE")
    except (OSError, AttributeError, TypeError):
        return None


def mesh_of_file(message, make_mesh, prepare):
    """Returns the mesh of a file, prepared for questions, and how long it took and how much memory."""
    data = np.fromfile(message["file"], "<u4")
    corners, triangles = np.split(data, [3 * message["corners"]])
    corners, triangles = corners.view("<f4").astype(float).reshape(-1, 3), triangles.astype(int).reshape(-1, 3)
    before, start = resident(), time.perf_counter()
    mesh = make_mesh(corners, triangles)
    prepare(mesh)
    seconds, after = time.perf_counter() - start, resident()
    return mesh, {"seconds": seconds} | ({} if before is None else {"bytes": after - before})


def timed(question, meshes, timers):
    """Returns the answers at all poses, and the nanoseconds of each call, which has what the timer has made of the pose."""
    pose_of, ask, number = timers[question["ask"]]
    poses = [pose_of(*rows({"pose": pose})) for pose in question["poses"]]
    answers, nanoseconds, began = [], [], time.perf_counter()
    for pose in poses:
        start = time.perf_counter_ns()
        answer = ask(*meshes, pose)
        nanoseconds.append(time.perf_counter_ns() - start)
        answers.append(float(number(answer)))
        if time.perf_counter() - began > question["budget"]:
            break
    return {"answers": answers, "nanoseconds": nanoseconds}


def probes_of_file(message):
    """Returns the rays or points of a file, one per row."""
    return np.fromfile(message["file"], "<f4").reshape(message["count"], message["numbers"])


def in_one_call(question, mesh, sets, batches):
    """Returns the answers about all rays or points of a set, and the seconds of the call, which has what the batch has made of the set."""
    if not question.get("batch") or question["ask"] not in batches:
        raise Refused("not a question of this runner")
    made_of, ask, numbers = batches[question["ask"]]
    probes = made_of(sets[question["probes"]])
    start = time.perf_counter()
    found = ask(mesh, probes)
    seconds = time.perf_counter() - start
    return {"answers": np.asarray(numbers(found), float).tolist(), "seconds": seconds}


def cores():
    """Returns how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


def serve(name, version, settings, make_mesh, questions, timers=None, batches=None, threads=1, prepare=lambda mesh: None, **claims):
    """Answers lines until there are no more. A timer is three functions: to a pose of the library, to its answer, to a number. So is a
    batch, about a whole set of rays or points and all answers, with as many threads as are stated. `prepare` builds for timed questions what the
    library would build when it is first asked."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    known, sets, batches = {}, {}, batches or {}
    for line in sys.stdin:
        message = json.loads(line)
        if "hello" in message:
            answer = {"hello": HELLO, "name": name, "version": version, "settings": settings, "questions": list(questions), "timed": list(timers or ()), "batch": list(batches), **claims}
        elif "mesh" in message:
            answer = {"mesh": message["mesh"]}
            try:
                if "file" in message:
                    known[message["mesh"]], cost = mesh_of_file(message, make_mesh, prepare)
                    answer |= cost
                else:
                    corners, triangles = finite(message["vertices"], (-1, 3)), np.array(message["triangles"], int).reshape(-1, 3)
                    known[message["mesh"]] = make_mesh(corners, triangles)
            except Exception as reason:
                known[message["mesh"]] = None
                answer |= {"refused": True, "reason": str(reason)}
        elif "file" in message:
            sets[message["probes"]] = probes_of_file(message)
            answer = {"probes": message["probes"]}
        else:
            answer = {"id": message["id"]}
            meshes = [known.get(message[key]) for key in ("a", "b") if key in message]
            try:
                if any(mesh is None for mesh in meshes):
                    raise Refused("a mesh was refused")
                if "probes" in message:
                    answer |= in_one_call(message, *meshes, sets, batches) | {"threads": threads}
                else:
                    answer |= timed(message, meshes, timers) if "poses" in message else questions[message["ask"]](*meshes, message)
            except Refused as reason:
                answer |= {"refused": True, "reason": str(reason)}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()
