"""Compares the header with the library: layouts and numbers as C sees them with those of Rust, and the functions that
it declares with those that are exported, both ways.

    header.py HEADER LAYOUT LIBRARY CC

LAYOUT is what `src/layout.rs` writes, LIBRARY the shared library, and CC a C compiler.
"""

import pathlib
import re
import subprocess
import sys
import tempfile


def declared(header):
    """The structures of a header with their fields, its named numbers, and its functions."""
    text = re.sub(r"/\*.*?\*/", " ", header.read_text(), flags=re.S)
    structures = {}
    for fields, name in re.findall(r"typedef struct \w+ \{(.*?)\} (\w+);", text, flags=re.S):
        structures[name] = re.findall(r"(\w+)(?:\[\d+\])?;", fields)
    numbers = ["CBVH_ABI"]
    for body in re.findall(r"enum \{(.*?)\};", text, flags=re.S):
        numbers += re.findall(r"(\w+) = ", body)
    functions = re.findall(r"^(?:cbvh_status|const char \*) ?(cbvh_\w+)\(", text, flags=re.M)
    # What the patterns above do not understand must not go unseen.
    called = set(re.findall(r"\b(cbvh_\w+)\(", text))
    if called != set(functions) or text.count("struct cbvh_") != len(structures):
        sys.exit(f"{header}: expected declarations in the usual form, found others: {called ^ set(functions)}")
    return structures, numbers, functions


def as_c_sees(header, compiler, structures, numbers):
    """The lines that `src/layout.rs` writes, by a program in C."""
    lines = []
    for name, fields in structures.items():
        alignment = f"offsetof(struct {{ char c; {name} x; }}, x)"
        lines.append(f'printf("{name} %zu %zu\\n", sizeof({name}), {alignment});')
        for field in fields:
            size = f"sizeof((({name} *)0)->{field})"
            lines.append(f'printf("{name}.{field} %zu %zu\\n", offsetof({name}, {field}), {size});')
    lines += [f'printf("{number} %d\\n", (int){number});' for number in numbers]
    program = "\n".join(["#include <cbvh.h>", "#include <stdio.h>", "int main(void) {", *lines, "return 0;", "}", ""])
    with tempfile.TemporaryDirectory() as folder:
        source, binary = pathlib.Path(folder, "layout.c"), pathlib.Path(folder, "layout")
        source.write_text(program)
        subprocess.run([compiler, "-std=c99", f"-I{header.parent}", str(source), "-o", str(binary)], check=True)
        return subprocess.run([str(binary)], check=True, capture_output=True, text=True).stdout.splitlines()


def exported(library):
    """The functions that a shared library exports."""
    listed = subprocess.run(["nm", "-D", "--defined-only", str(library)], check=True, capture_output=True, text=True)
    return [line.split()[-1] for line in listed.stdout.splitlines()]


def compare(what, in_header, in_library):
    """Ends the program unless both lists have the same elements."""
    differences = sorted(set(in_header) ^ set(in_library))
    if differences or not in_header:
        places = {line: "the header" if line in set(in_header) else "the library" for line in differences}
        sys.exit("\n".join([f"{what} differ:", *(f"    {line}: in {place} only" for line, place in places.items())]))


def main():
    header, layout, library = map(pathlib.Path, sys.argv[1:4])
    structures, numbers, functions = declared(header)
    compare("layouts and numbers", as_c_sees(header, sys.argv[4], structures, numbers), layout.read_text().splitlines())
    compare("functions", functions, exported(library))
    print(f"header: {len(structures)} structures, {len(numbers)} numbers, {len(functions)} functions as in the library")


if __name__ == "__main__":
    main()
