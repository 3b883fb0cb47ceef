"""Times libraries on the same meshes and poses, one query after another, and checks each result against what is proved.

    python run.py --out DIR [--core 1] [--only PATTERN] [--runner NAME=COMMAND ...]
    python run.py --out DIR --smoke --runner NAME=COMMAND           seconds: few poses of two small pairs, few rays and points

Without --runner, all runners that are found are asked, and the others are named with what installs them. Each runner is a process
of its own. Rounds are interleaved: each question is put to one runner after another, and then again. The raw times go to
DIR/times.jsonl, and report.py makes tables and plots of them. Exits with 0 if all answers are right, with 1 if not or if a runner fails on the way, and with 2 if a
runner does not start. Needs numpy.
"""

import argparse
import datetime
import json
import platform
import shlex
import shutil
import sys
import tempfile
import time
from math import ceil
from pathlib import Path

import numpy as np

import forms
import poses
import probes
import report

SUITE = forms.HERE.parent
sys.path.insert(0, str(SUITE))

from judge import is_number
from process import Crashed, Garbage, Hung, Process

PROTOCOL = 1
HELLO_SECONDS = 60
# A build or a round of questions may take so many seconds beyond the budget.
PATIENCE = 300
ASKED = {"collide": (*poses.PRESETS, "touching", "deep"), "distance": (*poses.PRESETS, "touching"), "contacts": ("touching", "deep"), "touched": ("touching", "deep")}
# Questions about rays and points, and the kinds of them. A runner answers singly, in one call, or both.
PROBED = {"ray": probes.RAYS, "hit": probes.RAYS, "closest": probes.POINTS, "side": probes.POINTS}
# What the first question is about, when nothing has been asked yet.
FIRST = ("collide", "1%")
SMOKE = ("scan-1k", "field", "probes/scan-10k")
SMOKE_PROBES = 3 * probes.STEP
NATIVE = "speed/setup (cmake, the libraries)"
# Asked for its builds and first answers only.
QUICK = "cbvh, quick"
# Name, command and what installs it. {suite} is the folder of the suite, {bin} the folder of what has been built, {python} this Python.
RUNNERS = (
    ("cbvh", "cbvh suite", "cargo install cbvh-cli, or a folder with it in PATH"),
    (QUICK, "cbvh suite --effort quick", "cargo install cbvh-cli, or a folder with it in PATH"),
    *((f"Coal {bv}", f"{{bin}}/coal_native {bv}", NATIVE) for bv in ("OBBRSS", "kIOS", "RSS")),
    *((f"FCL {bv}", f"{{bin}}/fcl_native {bv}", NATIVE) for bv in ("OBBRSS", "kIOS", "RSS")),
    ("parry3d", "{bin}/parry-runner", "speed/setup (cargo)"),
    ("CGAL", "{bin}/cgal_native", NATIVE),
    ("PQP", "{bin}/pqp_native", "PQP=FOLDER speed/setup, where FOLDER has a built PQP, if its licence allows you to use it"),
    ("Coal, Python", "{python} {suite}/runners/coal_runner.py", "pip install coal"),
    ("FCL, Python", "{python} {suite}/runners/fcl_runner.py", "pip install python-fcl"),
    *((f"Embree {flag}", f"{{bin}}/embree_native {flag}", NATIVE) for flag in ("robust", "fast")),
    ("embreex, Python", "{python} {suite}/runners/embree_runner.py", "pip install embreex trimesh scipy rtree"),
    ("trimesh, Python", "{python} {suite}/runners/trimesh_runner.py", "pip install embreex trimesh scipy rtree"),
    ("Open3D, Python", "{python} {suite}/runners/open3d_runner.py", "pip install open3d-cpu"),
    ("FCPW, Python", "{python} {suite}/runners/fcpw_runner.py", "pip install fcpw"),
    ("libigl, Python", "{python} {suite}/runners/igl_runner.py", "pip install libigl scipy"),
)


class Runner:
    """One library as a process, for one pair at a time, and what it was found to answer."""

    def __init__(self, name, command, prefix=""):
        self.name, self.command, self.unpinned = name, prefix + command, command
        self.process, self.number, self.profile = None, 0, None

    def start(self):
        self.stop()
        self.process = Process(self.command)
        profile, _ = self.process.exchange({"hello": PROTOCOL}, HELLO_SECONDS)
        if profile.get("hello") != PROTOCOL or not isinstance(profile.get("timed"), list):
            raise Garbage(f"expected a greeting with the field timed, found {profile}")
        self.profile = profile

    def stop(self):
        if self.process is not None:
            self.process.stop()
            self.process = None

    def send(self, key, message):
        """Sends a mesh or a field, and returns what its making cost."""
        answer, _ = self.process.exchange(message, PATIENCE)
        if answer.get(key) != message[key]:
            raise Garbage(answer)
        return answer

    def ask(self, what, a, b, items, budget, **more):
        """Asks about poses, and returns the answers and their times in nanoseconds, or None if the library refuses."""
        return self.put({"ask": what, "a": a, "b": b, "poses": [pose for pose, _ in items], "budget": budget, **more}, len(items))

    def put(self, question, count):
        """Puts a timed question about so many poses, rays or points."""
        self.number += 1
        answer, _ = self.process.exchange({"id": self.number, **question}, PATIENCE + question["budget"])
        if answer.get("refused"):
            return None
        if answer.get("id") != self.number or not is_timed(answer, count, question.get("batch", False)):
            raise Garbage(answer)
        return answer

    def answers(self, what, is_batch):
        """Tells whether a runner answers a question, one by one or in one call."""
        return what in (self.profile.get("batch", ()) if is_batch else self.profile["timed"])


def is_timed(answer, count, is_batch):
    """Tells whether an answer has as many numbers as it must have. A round that its budget ends has fewer, but at least one."""
    answers, times, seconds = (answer.get(key) for key in ("answers", "nanoseconds", "seconds"))
    if not isinstance(answers, list) or not answers or not all(map(is_number, answers)):
        return False
    if is_batch:
        return len(answers) == count and is_number(seconds) and seconds > 0
    return isinstance(times, list) and len(answers) == len(times) <= count and all(is_number(x) and x >= 0 for x in times)


def is_right(what, answer, fact, size, profile):
    """Tells whether an answer is what is proved, to within the error that the runner claims."""
    touches = fact.get("contacts", fact.get("touched", 0)) > 0
    if what == "distance":
        lower, upper = (0.0, 0.0) if touches else (fact["lower"], fact["upper"])
        error = profile["distance_error"] * (upper if profile["error_unit"] == "distance" else size)
        return lower - error <= answer <= upper + error
    return answer == (float(touches) if what == "collide" else fact[what])


class Probed:
    """What one runner has answered about the rays or points of a kind, singly or in one call."""

    def __init__(self):
        self.rounds, self.wrong, self.count, self.checked, self.threads = [], set(), 0, 0, 1

    def record(self):
        """Returns the time per ray or point in nanoseconds: the median over them of the median over the rounds after the first."""
        cold, steady = self.rounds[0], self.rounds[1:] or self.rounds
        count = max(map(len, steady))
        each = [np.median([times[k] for times in steady if k < len(times)]) for k in range(count)]
        every = np.sort(np.concatenate(steady))
        p99 = every[min(len(every), ceil(0.99 * len(every))) - 1]
        return {"median": float(np.median(each)), "p99": float(p99), "cold": float(np.median(cold)), "wrong": sorted(self.wrong)}


class Measurement:
    """The runners of one call, the file of raw times, and how many answers were wrong."""

    def __init__(self, arguments, runners, output):
        self.arguments, self.runners, self.output = arguments, runners, output
        self.wrong, self.asked, self.failed = 0, 0, 0
        self.cells = {}

    def write(self, record):
        self.output.write(json.dumps(record, separators=(",", ":")) + "\n")
        self.output.flush()

    def pair(self, name, folder):
        """Puts all questions about one pair, or one field and a mesh, to all runners."""
        known = forms.catalogue()
        a, b = known["pairs"][name]
        field = known["fields"].get(a)
        asked = ("touched",) if field else ASKED
        able = [runner for runner in self.runners if set(asked) & set(self.profile_of(runner)["timed"])]
        if not able:
            return
        made = {mesh: forms.make(known["meshes"][mesh]) for mesh in sorted({*(field["meshes"] if field else [a]), b})}
        items = {preset: found[:: self.arguments.sample] for preset, found in poses.load(name).items()}
        size = {preset: max(max(abs(x) for x in pose) for pose, _ in found) for preset, found in items.items()}
        largest = max(float(np.abs(corners).max()) for corners, _ in made.values())
        size = {preset: max(largest, of) for preset, of in size.items()}
        ready = [runner for runner in able if self.attempt(runner, name, self.started, runner, self.prepare, name, made, a, field, folder, items)]
        ready = self.asked_more(ready)
        for number in range(1 + self.arguments.rounds):
            for what, presets in ASKED.items():
                for preset in (p for p in presets if what in ("collide", "distance") or what in items[p][0][1]):
                    # Each round begins with another runner.
                    first = number % max(1, len(ready))
                    for runner in ready[first:] + ready[:first]:
                        if what in runner.profile["timed"]:
                            if not self.attempt(runner, name, self.round, runner, name, what, preset, a, b, items[preset], size[preset]):
                                ready.remove(runner)
        for runner in ready:
            runner.stop()
        for cell in self.cells.values():
            self.write(cell)
        self.cells.clear()

    @staticmethod
    def asked_more(runners):
        """Returns the runners that are asked for more than their builds and first answers, and stops the others."""
        for runner in runners:
            if runner.name == QUICK:
                runner.stop()
        return [runner for runner in runners if runner.name != QUICK]

    def attempt(self, runner, name, what, *arguments):
        """Does something with a runner, and returns whether it works. One that fails is out for this pair."""
        try:
            return what(*arguments)
        except (Crashed, Hung, Garbage, OSError) as failure:
            runner.stop()
            self.failed += 1
            self.write({"runner": runner.name, "pair": name, "failed": f"{type(failure).__name__} {failure}".strip()})
            return False

    def started(self, runner, prepare, *arguments):
        """Starts a runner some times, of which the last stays, writes the costs that are the median of builds, and tells whether the runner takes part."""
        records = []
        for _ in range(self.arguments.starts):
            runner.start()
            record = prepare(runner, *arguments)
            if record is None:
                return False
            records.append(record)
        records.sort(key=lambda record: sum(cost["seconds"] for cost in record["meshes"].values()))
        self.write(records[len(records) // 2])
        return True

    def prepare(self, runner, name, made, a, field, folder, items):
        """Sends the meshes and asks the first question. Returns what that cost, or None if the runner does not take part."""
        record = {"runner": runner.name, "pair": name, "triangles": {mesh: len(faces) for mesh, (_, faces) in made.items()}, "meshes": {}}
        for mesh, (corners, faces) in made.items():
            cost = self.send_mesh(runner, mesh, corners, faces, folder)
            if cost is None:
                return None
            record["meshes"][mesh] = cost
        if field:
            numbers, rows = forms.instances(field)
            sent = {"field": a, "meshes": field["meshes"], "instances": [[n, row] for n, row in zip(numbers, rows)]}
            record["field_seconds"] = runner.send("field", sent)["seconds"]
        b = forms.catalogue()["pairs"][name][1]
        found = runner.ask(FIRST[0], a, b, items[FIRST[1]][:1], self.arguments.budget) if FIRST[0] in runner.profile["timed"] else None
        return record | {"first_nanoseconds": found["nanoseconds"][0] if found else None}

    @staticmethod
    def send_mesh(runner, mesh, corners, faces, folder):
        """Sends a mesh, and returns what its build cost, or None if the library refuses it."""
        file = folder / f"{len(list(folder.iterdir()))}.mesh"
        file.write_bytes(forms.content(corners, faces))
        answer = runner.send("mesh", {"mesh": mesh, "file": str(file), "corners": len(corners), "triangles": len(faces)})
        return None if answer.get("refused") else {key: answer.get(key) for key in ("seconds", "open_seconds", "bytes")}

    def profile_of(self, runner):
        if runner.profile is None:
            runner.start()
            runner.stop()
        return runner.profile

    def round(self, runner, name, what, preset, a, b, items, size):
        """Asks one runner one question about all poses of a preset. A cell has the times of all rounds, and the answers of the first."""
        answer = runner.ask(what, a, b, items, self.arguments.budget)
        if answer is None:
            return True
        wrong = [k for k, (found, (_, fact)) in enumerate(zip(answer["answers"], items)) if not is_right(what, found, fact, size, runner.profile)]
        self.wrong, self.asked = self.wrong + len(wrong), self.asked + len(answer["answers"])
        cell = {"runner": runner.name, "pair": name, "ask": what, "preset": preset, "rounds": [], "wrong": [], "answers": answer["answers"]}
        cell = self.cells.setdefault((runner.name, what, preset), cell)
        cell["rounds"].append(answer["nanoseconds"])
        cell["wrong"] = sorted({*cell["wrong"], *wrong})
        return True

    def batches(self, name, folder):
        """Asks runners that answer many poses in one call, on all cores."""
        known = forms.catalogue()
        a, b = known["pairs"][name]
        if a in known["fields"]:
            return
        items = [item for _ in range(20) for item in poses.load(name)["1%"]]
        for runner in self.runners:
            if set(self.profile_of(runner).get("batch", ())) & set(ASKED) and runner.name != QUICK:
                self.attempt(runner, name, self.batch, Runner(runner.name, runner.unpinned), name, a, b, items, folder)

    def batch(self, runner, name, a, b, items, folder):
        """Asks one runner about many poses in one call, without pinning it."""
        runner.start()
        try:
            for mesh in {a, b}:
                corners, faces = forms.make(forms.catalogue()["meshes"][mesh])
                file = folder / f"{mesh}.all"
                file.write_bytes(forms.content(corners, faces))
                runner.send("mesh", {"mesh": mesh, "file": str(file), "corners": len(corners), "triangles": len(faces)})
            for what in (what for what in runner.profile["batch"] if what in ASKED):
                found = [runner.ask(what, a, b, items, self.arguments.budget, batch=True) for _ in range(self.arguments.rounds)]
                best = min(answer["seconds"] for answer in found)
                self.write({"runner": runner.name, "pair": name, "batch": what, "preset": "1%", "queries": len(items), "seconds": best, "threads": found[0]["threads"]})
        finally:
            runner.stop()
        return True

    def probes(self, name, mesh, folder):
        """Puts all questions about rays and points of one mesh to all runners, singly and in one call."""
        corners, faces = forms.make(forms.catalogue()["meshes"][mesh])
        count = SMOKE_PROBES if self.arguments.smoke else probes.COUNT
        sets = {kind: (of[:count], facts[: len(range(0, count, probes.STEP))]) for kind, (of, facts) in probes.load(mesh).items()}
        able = [runner for runner in self.runners if set(PROBED) & {*self.profile_of(runner)["timed"], *runner.profile.get("batch", ())}]
        ready = [runner for runner in able if self.attempt(runner, name, self.started, runner, self.prepare_probes, name, mesh, corners, faces, sets, folder)]
        ready = self.asked_more(ready)
        cells, size = {}, float(np.abs(corners).max())
        for number in range(1 + self.arguments.rounds):
            for what, kind in ((what, kind) for what, kinds in PROBED.items() for kind in kinds):
                # What is inside an open mesh is not proved.
                if what == "side" and len(sets[kind][1][0]) < 3:
                    continue
                first = number % max(1, len(ready))
                for runner in ready[first:] + ready[:first]:
                    for is_batch in (False, True):
                        if runner.answers(what, is_batch) and runner in ready:
                            cell = cells.setdefault((runner.name, what, kind, is_batch), Probed())
                            if not self.attempt(runner, name, self.probe, runner, mesh, what, kind, is_batch, *sets[kind], size, cell):
                                ready.remove(runner)
        for runner in ready:
            runner.stop()
        for (runner, what, kind, is_batch), cell in cells.items():
            if cell.rounds:
                self.write({"runner": runner, "mesh": mesh, "probe": what, "kind": kind, "batch": is_batch, "count": cell.count, "checked": cell.checked, "threads": cell.threads, **cell.record()})

    def prepare_probes(self, runner, name, mesh, corners, faces, sets, folder):
        """Sends the mesh and the rays and points, and asks about one ray. Returns what that cost, or None if the runner does not take part."""
        cost = self.send_mesh(runner, mesh, corners, faces, folder)
        if cost is None:
            return None
        for kind, (of, _) in sets.items():
            file = folder / f"{mesh}-{kind}.probes"
            file.write_bytes(of.astype("<f4").tobytes())
            runner.send("probes", {"probes": kind, "file": str(file), "count": len(of), "numbers": of.shape[1]})
        # A budget of nothing is enough for one ray.
        first = runner.put({"ask": "ray", "a": mesh, "probes": "camera", "budget": 0.0}, len(sets["camera"][0])) if "ray" in runner.profile["timed"] else None
        return {"runner": runner.name, "pair": name, "triangles": {mesh: len(faces)}, "meshes": {mesh: cost}, "first_nanoseconds": first["nanoseconds"][0] if first else None}

    def probe(self, runner, mesh, what, kind, is_batch, of, facts, size, cell):
        """Asks one runner one question about a set. Of a batch that takes longer than the budget, there are two rounds."""
        budget = self.arguments.budget
        if is_batch and len(cell.rounds) > 1 and cell.rounds[-1][0] * len(of) > 1e9 * budget:
            return True
        more = {"batch": True} if is_batch else {}
        answer = runner.put({"ask": what, "a": mesh, "probes": kind, "budget": budget, **more}, len(of))
        if answer is None:
            return True
        found = answer["answers"][:: probes.STEP]
        wrong = [k for k, (one, fact) in enumerate(zip(found, facts)) if not probes.is_right(what, one, of[k * probes.STEP], fact, size, runner.profile)]
        self.wrong, self.asked = self.wrong + len(wrong), self.asked + len(found)
        cell.rounds.append(np.array([1e9 * answer["seconds"] / len(of)] if is_batch else answer["nanoseconds"], float))
        cell.wrong |= {*wrong}
        cell.count, cell.checked, cell.threads = len(answer["answers"]), len(found), answer.get("threads", 1)
        return True


def machine():
    """Returns the name of the processor and its vector units, as well as the system tells them."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        name, flags = (next(line.split(":", 1)[1].strip() for line in lines if line.startswith(key)) for key in ("model name", "flags"))
        units = next((title for flag, title in (("avx512bw", "AVX-512"), ("avx2", "AVX2")) if flag in flags.split()), None)
        return f"{name} with {units}" if units else name
    except (OSError, StopIteration, RuntimeError):
        return platform.processor() or platform.machine()


def chosen_runners(arguments):
    """Returns the runners to ask. Those that are not installed are named."""
    prefix = f"taskset -c {arguments.core} " if arguments.core is not None else ""
    if arguments.runner:
        return [Runner(*one.split("=", 1), prefix) for one in arguments.runner]
    found = []
    for name, command, installs in RUNNERS:
        command = command.format(suite=shlex.quote(str(SUITE)), bin=shlex.quote(arguments.bin), python=shlex.quote(sys.executable))
        runner = Runner(name, command, prefix)
        try:
            if shutil.which(shlex.split(command)[0]) is None:
                raise FileNotFoundError
            runner.start()
            found.append(runner)
        except (Crashed, Hung, Garbage, OSError):
            print(f"{name}: skipped, it needs {installs}", file=sys.stderr)
        runner.stop()
    return found


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="the folder for the raw times, the tables and the plots")
    parser.add_argument("--page", help="the file of the page with the tables; DIR/SPEED.md")
    parser.add_argument("--runner", action="append", metavar="NAME=COMMAND", help="measure this runner only; may be repeated")
    parser.add_argument("--bin", default="target/speed/bin", help="the folder of the runners that setup has built")
    parser.add_argument("--only", default="", help="only pairs with one of these texts in their name, separated by commas; rays and points of a mesh are probes/MESH")
    parser.add_argument("--rounds", type=int, default=5, help="rounds after the first, which counts as cold")
    parser.add_argument("--starts", type=int, default=3, help="starts of each runner for each pair or mesh; the costs of builds are those of the median")
    parser.add_argument("--sample", type=int, default=1, metavar="N", help="every Nth pose")
    parser.add_argument("--budget", type=float, default=1.0, help="seconds after which a round of one query begins no other pose")
    parser.add_argument("--core", type=int, help="the core to which runners are pinned, where there is taskset")
    parser.add_argument("--smoke", action="store_true", help="few poses of small pairs: does everything work?")
    arguments = parser.parse_args(argv)
    if arguments.smoke:
        arguments.rounds, arguments.starts, arguments.sample, arguments.only = 1, 1, 10, ",".join(SMOKE)
    runners = chosen_runners(arguments)
    arguments.out.mkdir(parents=True, exist_ok=True)
    began = time.monotonic()
    with open(arguments.out / "times.jsonl", "w", encoding="utf-8") as output, tempfile.TemporaryDirectory() as folder:
        measurement = Measurement(arguments, runners, output)
        try:
            profiles = {runner.name: {key: measurement.profile_of(runner).get(key) for key in ("name", "version", "settings")} for runner in runners}
            suite = (SUITE / "VERSION").read_text(encoding="utf-8").strip()
            measurement.write({"date": str(datetime.date.today()), "processor": machine(), "system": platform.system(), "pinned": arguments.core is not None, "rounds": arguments.rounds, "starts": arguments.starts, "suite": suite, "runners": profiles})
            asked = {name: [measurement.pair, measurement.batches] for name in forms.catalogue()["pairs"]}
            asked |= {f"probes/{mesh}": [lambda name, folder, mesh=mesh: measurement.probes(name, mesh, folder)] for mesh in probes.MESHES}
            for name, measure in asked.items():
                if any(text in name for text in arguments.only.split(",")):
                    try:
                        for what in measure:
                            what(name, Path(folder))
                        print(f"{name}: done after {time.monotonic() - began:.0f} s", file=sys.stderr)
                    except forms.Missing as missing:
                        print(f"{name}: skipped, {missing}", file=sys.stderr)
        except (Crashed, Hung, Garbage, OSError, ValueError) as failure:
            print(f"expected runners that return results, found {type(failure).__name__} {failure}", file=sys.stderr)
            return 2
        finally:
            for runner in runners:
                runner.stop()
    page = arguments.page or str(arguments.out / "SPEED.md")
    report.main([str(arguments.out), "--page", page])
    print(f"{measurement.asked} results, {measurement.wrong} wrong, {measurement.failed} runners failed; see {page}")
    return 0 if measurement.asked and not measurement.wrong and not measurement.failed else 1


if __name__ == "__main__":
    sys.exit(main())
