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


def mesh_of_file(message, make_mesh):
    """Returns the mesh of a file, and how long it took and how much memory."""
    data = np.fromfile(message["file"], "<u4")
    corners, triangles = np.split(data, [3 * message["corners"]])
    corners, triangles = corners.view("<f4").astype(float).reshape(-1, 3), triangles.astype(int).reshape(-1, 3)
    before, start = resident(), time.perf_counter()
    mesh = make_mesh(corners, triangles)
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


def serve(name, version, settings, make_mesh, questions, timers=None, **claims):
    """Answers lines until there are no more. A timer is three functions: to a pose of the library, to its answer, to a number."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    known = {}
    for line in sys.stdin:
        message = json.loads(line)
        if "hello" in message:
            answer = {"hello": HELLO, "name": name, "version": version, "settings": settings, "questions": list(questions), "timed": list(timers or ()), **claims}
        elif "mesh" in message:
            answer = {"mesh": message["mesh"]}
            try:
                if "file" in message:
                    known[message["mesh"]], cost = mesh_of_file(message, make_mesh)
                    answer |= cost
                else:
                    corners, triangles = finite(message["vertices"], (-1, 3)), np.array(message["triangles"], int).reshape(-1, 3)
                    known[message["mesh"]] = make_mesh(corners, triangles)
            except Exception as reason:
                known[message["mesh"]] = None
                answer |= {"refused": True, "reason": str(reason)}
        else:
            answer = {"id": message["id"]}
            meshes = [known.get(message[key]) for key in ("a", "b") if key in message]
            try:
                if any(mesh is None for mesh in meshes):
                    raise Refused("a mesh was refused")
                answer |= timed(message, meshes, timers) if "poses" in message else questions[message["ask"]](*meshes, message)
            except Refused as reason:
                answer |= {"refused": True, "reason": str(reason)}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()
