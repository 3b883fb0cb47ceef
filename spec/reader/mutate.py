"""Damages files and compares the verdict of this reader with that of `cbvh validate`.

    python3 mutate.py CBVH COUNT SEED FILE...

CBVH is the path of the command, and the files must be valid. Most mutants are sealed: their checksums are corrected,
so that the rules checked after the checksums are reached. Some mutants are sealed only in part, and some not at all.

Prints how often each rule was broken. Prints and keeps every mutant on which the two readers differ; the exit code is 1
if there is one.
"""

import collections
import json
import os
import random
import subprocess
import sys

import numpy as np

import cbvh
import rules
from xxh3 import xxh3_64

LEAF_SUMS, ID_SUMS, PAGE_SUMS, ALL = 1, 2, 4, 7  # what `seal` corrects besides sections and header
FIELDS = [first for first, _ in cbvh.LINKS.values()]  # bits at which the fields of links start
EXTREMES = (0, 1, 0x7F800000, 0x7FC00000, 0x80000000, (1 << 64) - 1)


def places(data, only=""):
    """Offsets of bytes worth damaging in a valid file, by what they hold; each group is drawn equally often. `only` is
    the start of the names of the groups to damage.
    """
    file = rules.validate(data)
    sorts = collections.defaultdict(list)
    head = file.head_bytes()
    sorts["table"] += range(head + cbvh.SECTION_ENTRY.itemsize)
    sorts["head"] += [*range(8, 24), *range(cbvh.HEADER.itemsize, head)]  # without magic and checksums
    for entry in file.entries:
        sorts["offsets"] += range(entry.place("offset"), entry.place("checksum"))
        sorts["offsets"] += range(entry.place("kind"), entry.place("required"))
    sorts["bytes in use"] += np.flatnonzero(np.frombuffer(data, "u1")).tolist()
    sorts["anywhere"] += range(len(data))
    for kind, entry in file.sections.items():
        if kind in (cbvh.OBJECTS, cbvh.DUPLICATES, cbvh.INSTANCES, cbvh.TOPOLOGY):
            sorts[kind] += range(entry.offset, entry.offset + entry.length)
    for one in file.objects:
        sorts["predictors"] += range(one.place("predictors"), one.place("reserved_end"))
        for page in one.pages_read:
            sorts["page header"] += range(page.at, page.at + cbvh.LINE)
            sorts["short counts"] += (page.place("treelets"), page.place("short"))
            sorts["anchors"] += range(page.anchor_at(0), page.anchor_at(page.roots))
            sorts["remotes"] += range(page.remote_at(0), page.remote_at(page.remotes))
            for root in range(page.roots):
                sorts["parents"] += range(page.parent_at(root), page.parent_at(root) + 5)
            for slot in range(page.treelets):
                at = page.treelet_at(slot)
                name = "short " if page.is_short(slot) else ""
                sorts[name + "treelets"] += range(at, page.treelet_at(slot + 1))
                for at in (page.kinds_at(slot), page.links_at(slot)):
                    sorts[name + "links"] += range(at, at + 4)
                if cbvh.SHORT in page.kinds(slot):
                    sorts["short parents"] += range(page.kinds_at(slot), page.kinds_at(slot) + 4)
                    sorts["short parents"] += range(page.links_at(slot), page.links_at(slot) + 4)
            if page.packets:
                at = page.leaf_block_at()
                sorts["leaf heads"] += range(at, at + 40)
                if page.is_corrected():
                    start = page.corrections_at()
                    values = start + page.correction_places(page.corrections_head())[3]
                    sorts["corrections: head and lists"] += range(start, values)
                    sorts["corrections: values"] += range(values, at + cbvh.LINE * page.leaf_lines)
                if page.is_packed():
                    sorts["records"] += range(at + cbvh.PACKED_HEAD_BYTES, at + page.packed_head().pool_at)
            if page.id_words:
                at, length = page.id_block_at(), cbvh.WORD * page.id_words
                sorts["id tables"] += range(at, at + page.id_table_bytes())
                for group, start in enumerate(page.id_groups()[0]["start"].tolist()):
                    sorts["id groups"] += range(at + start, at + start + 7)
                    entry = at + cbvh.ID_ENTRY_BYTES * group
                    sorts["id starts"] += range(entry + 4, entry + 6)
                sorts["ids"] += range(at + page.id_table_bytes(), at + length)
    return [sort for name, sort in sorts.items() if sort and str(name).startswith(only)]


def mutant(chance, data, sorts):
    """Returns a copy with one to three changes, and rarely with a different length."""
    data = bytearray(data)
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        at = chance.choice(chance.choice(sorts))
        size = chance.choice((1, 2, 4, 8))
        at -= at % size
        old = int.from_bytes(data[at : at + size], "little")
        nibble = 4 * chance.randrange(2 * size)
        new = chance.choice(
            (
                old ^ 1 << chance.randrange(8 * size),
                old ^ 1 << chance.randrange(8 * size),
                old + chance.choice((-64, -1, 1, 2, 64, 4096)),
                old + chance.choice((-1, 1)) * (1 << chance.choice(FIELDS)),
                old & ~(15 << nibble) | chance.randrange(8) << nibble,  # another kind of child
                chance.choice(EXTREMES),
                chance.getrandbits(8 * size),
            )
        )
        data[at : at + size] = (new % (1 << 8 * size)).to_bytes(8, "little")[: len(data[at : at + size])]
    length = len(data)
    if chance.random() < 0.02:
        del data[chance.choice((chance.randrange(length), chance.randrange(cbvh.head_bytes(8)))) :]
    if chance.random() < 0.02:
        data += bytes(chance.choice((1, 64, 4096)))
    if len(data) not in (length, *range(24)) and chance.random() < 0.5:
        data[16:24] = len(data).to_bytes(8, "little")
    return data


def seal(data, sums=ALL):
    """Corrects checksums, as far as the damaged numbers still lead to bytes of the file."""

    def number(at, size=8):
        return int.from_bytes(data[at : at + size], "little")

    def store(at, checksum):
        data[at : at + 8] = checksum.to_bytes(8, "little")

    def part(section, first, count, unit):
        start, length = section
        return data[start + unit * first :][: unit * count] if unit * (first + count) <= length else b""

    if len(data) < cbvh.HEADER.itemsize:
        return
    count = number(12, 4)
    head = cbvh.head_bytes(count)
    if count > cbvh.MAX_SECTIONS or len(data) < head:
        return
    entries = []
    for at in map(cbvh.head_bytes, range(count)):
        if number(at + 8) + number(at + 16) <= len(data):
            entries.append((at, number(at, 4), (number(at + 8), number(at + 16))))
    found = {kind: section for _, kind, section in reversed(entries)}
    start, length = found.get(cbvh.NODES, (0, 0))
    for at in range(start, start + length - cbvh.PAGE + 1, cbvh.PAGE):
        if sums & LEAF_SUMS and cbvh.LEAVES in found:
            store(at + 8, xxh3_64(part(found[cbvh.LEAVES], number(at + 24), number(at + 48, 4), cbvh.LINE)))
        if sums & ID_SUMS and cbvh.IDS in found and number(at + 52, 4):
            store(at + 16, xxh3_64(part(found[cbvh.IDS], number(at + 32), number(at + 52, 4), cbvh.WORD)))
        if sums & PAGE_SUMS:
            store(at, xxh3_64(data[at + 8 : at + cbvh.PAGE]))
    content = b""
    for at, kind, (start, length) in entries:
        store(at + 24, xxh3_64(data[start : start + length]))
        if kind in cbvh.CONTENT:
            content += kind.to_bytes(4, "little") + length.to_bytes(8, "little") + data[start : start + length]
    store(24, xxh3_64(content))
    store(32, 0)
    store(32, xxh3_64(data[:head]))


def broken_by(check, *arguments):
    """Returns the number of the rule that a check finds broken, or 0."""
    try:
        check(*arguments)
    except rules.Broken as broken:
        return broken.rule
    return 0


def verdict(data, bounds=False):
    """Returns the number of the rule that a file breaks, or 0. `bounds` adds the rules of *verify*."""

    def check():
        file = rules.validate(bytes(data))
        if bounds:
            rules.verify(file)

    return broken_by(check)


def verdict_of_command(command, path, *meshes):
    """The verdict of *validate*, or of *verify* if the meshes are given from which the file was baked."""
    verb = "verify" if meshes else "validate"
    run = subprocess.run([command, verb, path, *meshes, "--json"], capture_output=True, text=True)
    if run.returncode not in (0, 3):
        return f"exit code {run.returncode}: {run.stderr}"
    found = json.loads(run.stdout)
    return 0 if found["valid"] else found["rule"]


def compare(command, count, seed, paths, folder, only=""):
    """Counts how often each rule was broken, and lists (file, mutant, this verdict, that verdict) where they differ."""
    chance = random.Random(seed)
    originals = []
    for path in paths:
        with open(path, "rb") as stream:
            data = stream.read()
        originals.append((path, data, places(data, only)))
    broken, different = collections.Counter(), []
    for number in range(count):
        path, data, sorts = chance.choice(originals)
        data = mutant(chance, data, sorts)
        sealing = chance.random()
        if sealing < 0.9:
            seal(data, ALL if sealing < 0.75 else chance.randrange(ALL))
        mutant_path = os.path.join(folder, f"mutant-{seed}-{number}.cbvh")
        with open(mutant_path, "wb") as stream:
            stream.write(data)
        ours, theirs = verdict(data), verdict_of_command(command, mutant_path)
        broken[theirs] += 1
        if ours == theirs:
            os.remove(mutant_path)
        else:
            different.append((path, mutant_path, ours, theirs))
    return broken, different


if __name__ == "__main__":
    if len(sys.argv) < 5:
        sys.exit(__doc__)
    counts, found = compare(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4:], ".")
    verdicts = {f"R{rule:>02}" if rule else "none": count for rule, count in counts.items()}
    print(", ".join(f"{rule}: {verdicts[rule]}" for rule in sorted(verdicts)))
    for original, kept, ours, theirs in found:
        print(f"{kept}, of {original}: this reader says {ours}, cbvh {theirs}")
    sys.exit(1 if found else 0)
