"""Speaks the protocol for a runner: reads a line, calls a function, writes a line.

A runner gives a function that makes a mesh of an array of corners and one of triangles, and a function for each question that it
answers. Everything that libraries print goes to standard error, so that it cannot end up among the answers.
"""

import json
import os
import sys

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


def serve(name, version, settings, make_mesh, questions, **claims):
    """Answers lines until there are no more."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    known = {}
    for line in sys.stdin:
        message = json.loads(line)
        if "hello" in message:
            answer = {"hello": HELLO, "name": name, "version": version, "settings": settings, "questions": list(questions), **claims}
        elif "mesh" in message:
            answer = {"mesh": message["mesh"]}
            try:
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
                answer |= questions[message["ask"]](*meshes, message)
            except Refused as reason:
                answer |= {"refused": True, "reason": str(reason)}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()
