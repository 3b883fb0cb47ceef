"""Checks that programs which were built with an older header run with the library of a newer one: the newer header declares all that
the older one does, with the same types, layouts and numbers, and the library exports its functions. Functions, types and numbers may
be added, and fields at the end of structures that start with their size. The C compiler compares types and layouts.

    older_header.py OLDER NEWER [LIBRARY]
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile


class Header:
    """What a header declares: functions as name and type, structures as name and fields, other types, and numbers."""

    def __init__(self, path):
        self.path = path.resolve()
        text = re.sub(r"/\*.*?\*/", " ", path.read_text(encoding="utf-8"), flags=re.S)
        text = re.sub(r"^#ifdef __cplusplus.*?^#endif", " ", text, flags=re.S | re.M)
        self.macros = {name: value.strip() for name, value in re.findall(r"^#define (\w+)\b(.*)$", text, flags=re.M)}
        text = re.sub(r"^#.*$", " ", text, flags=re.M)
        self.functions, self.structures, self.types, self.numbers = {}, {}, {}, {}
        for part in re.split(r";(?![^{]*\})", text):
            part = " ".join(part.split())
            if structure := re.fullmatch(r"typedef struct (\w+) \{(.*)\} \1", part):
                self.structures[structure[1]] = structure[2]
            elif numbers := re.fullmatch(r"enum \{(.*)\}", part):
                for number in filter(None, map(str.strip, numbers[1].split(","))):
                    name, value = re.fullmatch(r"(\w+) = (-?\d+)", number).groups()
                    self.numbers[name] = value
            elif name := re.fullmatch(r"typedef [^{}]*?(?:\(\*(\w+)\)\(.*\)|(\w+))", part):
                self.types[name[1] or name[2]] = part
            elif function := re.fullmatch(r"([^{}()]*?)(\w+)(\(.*\))", part):
                self.functions[function[2]] = f"{function[1]}{function[3]}"
            elif part:
                sys.exit(f"{path}: expected a function, a structure, a type or numbers, found {part}")
        if not self.functions or not self.structures or not self.numbers:
            sys.exit(f"{path}: expected functions, structures and numbers, found none of a kind")

    def fields(self, structure):
        """The names of a structure's fields, in order."""
        body = self.structures[structure]
        if re.search(r"[(){}:]", body):
            sys.exit(f"{structure}: expected fields that are numbers, pointers, structures or arrays of them, found {body}")
        return [re.fullmatch(r".*?(\w+)\s*(?:\[\w+\])*", part.strip(), flags=re.S)[1] for part in re.split("[,;]", body) if part.strip()]


def missing(older, newer):
    """What the older header has and the newer one has not, as messages."""
    for kind in ("functions", "structures", "types", "numbers", "macros"):
        for name in getattr(older, kind):
            if name not in getattr(newer, kind):
                yield f"{name}: expected it among the {kind} of the newer header, found none"
    for name in older.structures.keys() & newer.structures.keys():
        for field in older.fields(name):
            if field not in newer.fields(name):
                yield f"{name}.{field}: expected this field in the newer header, found none"


def comparison(older, newer):
    """A program that compiles if all that both headers declare is the same."""

    def expect(condition, message):
        return f'_Static_assert({condition}, "{message}");'

    def same(one, other):
        return f"__builtin_types_compatible_p({one}, {other})"

    yield "#include <stddef.h>"
    yield f'#include "{newer.path}"'
    for name, number in older.numbers.items():
        yield expect(f"{name} == {number}", f"{name}: expected {number} as in the older header, found another number")
    for name, value in older.macros.items():
        if re.fullmatch(r"-?\d+", value) and not name.startswith("CBVH_VERSION_"):
            yield expect(f"{name} == {value}", f"{name}: expected {value} as in the older header, found another number")
    for name, declaration in older.types.items():
        yield re.sub(rf"\b{name}\b", f"older_{name}", declaration) + ";"
        yield expect(same(f"older_{name}", name), f"{name}: expected the type of the older header, found another one")
    for name, body in older.structures.items():
        yield f"typedef struct {{{body}}} older_{name};"
        fields = older.fields(name)
        for field in fields:
            types = (f"__typeof__((({structure} *)0)->{field})" for structure in (f"older_{name}", name))
            yield expect(same(*types), f"{name}.{field}: expected the type of the older header, found another one")
            yield expect(
                f"offsetof(older_{name}, {field}) == offsetof({name}, {field})",
                f"{name}.{field}: expected the place of the older header, found another one",
            )
        if fields[0] != "size":
            yield expect(f"sizeof(older_{name}) == sizeof({name})", f"{name}: expected the size of the older header, found another one")
        # What the older header has as padding may have any bytes.
        for field in newer.fields(name):
            if field not in fields:
                yield expect(
                    f"offsetof({name}, {field}) >= sizeof(older_{name})",
                    f"{name}.{field}: expected a new field behind the structure of the older header, found it within",
                )
    for name, kind in older.functions.items():
        yield expect(same(f"__typeof__({name})", kind), f"{name}: expected the type of the older header, found another one")


def compiled(program):
    """What the compiler says about the program, as messages."""
    with tempfile.TemporaryDirectory() as folder:
        source = pathlib.Path(folder, "comparison.c")
        source.write_text("\n".join(program), encoding="utf-8")
        command = [os.environ.get("CC", "cc"), "-std=gnu11", "-fsyntax-only", "-Werror", str(source)]
        run = subprocess.run(command, stderr=subprocess.PIPE, text=True, env={**os.environ, "LC_ALL": "C"})
    errors = re.findall(r"error: (.*)", run.stderr)
    # As the compilers of GNU and LLVM begin what a failed assertion says.
    wrong = [re.sub(r'^static assertion failed[^"]*"(.*)"$', r"\1", error) for error in errors]
    return wrong or ([run.stderr] if run.returncode else [])


def differences(older, newer):
    """What programs built with the older header do not find in the newer one, as messages."""
    return list(missing(older, newer)) or compiled(comparison(older, newer))


def exported(older, library):
    """The older header's functions that the library has not, as messages."""
    listed = subprocess.run(["nm", "-D", "--defined-only", str(library)], check=True, stdout=subprocess.PIPE, text=True)
    found = {line.split()[-1] for line in listed.stdout.splitlines()}
    return [f"{name}: expected it among the symbols of {library.name}, found none" for name in older.functions if name not in found]


def main(older, newer, library=None):
    before, after = Header(pathlib.Path(older)), Header(pathlib.Path(newer))
    wrong = differences(before, after) + (exported(before, pathlib.Path(library)) if library else [])
    if wrong:
        sys.exit("\n".join(["what programs built with the older header rely on:", *(f"    {line}" for line in wrong)]))
    print(f"older header: its {len(before.functions)} functions, {len(before.structures)} structures and "
          f"{len(before.numbers)} numbers are in the newer one")


if __name__ == "__main__":
    main(*sys.argv[1:])
