"""Compares the header with what cbindgen makes of the library's source: functions with the names and types of their
arguments, structures with their fields in order, and numbers. Then compares its functions with those that the library
exports. Each has what the other one has.

    header.py HEADER GENERATED LIBRARY
"""

import pathlib
import re
import subprocess
import sys


def declared(header):
    """The declarations of a header and its named numbers, as words between single spaces."""
    text = re.sub(r"/\*.*?\*/", " ", header.read_text(), flags=re.S)
    text = re.sub(r"^#ifdef __cplusplus.*?^#endif", " ", text, flags=re.S | re.M)
    # The version of the library does not belong to the interface.
    numbers = re.findall(r"^#define (CBVH_(?!VERSION)\w+) (-?\d+)$", text, flags=re.M)
    text = re.sub(r"^#.*$|\bstruct\b", " ", text, flags=re.M)
    enums = r"\benum\b[^;{]*\{([^}]*)\}"
    for body in re.findall(enums, text):
        numbers += re.findall(r"(\w+) = (-?\d+)", body)
    text = re.sub(enums, " ", text)
    # The header has names for what numbers are about.
    for name in re.findall(r"typedef int32_t (\w+);", text):
        text = re.sub(rf"\b{name}\b", "int32_t", text)
    text = re.sub(r"typedef (int32_t|enum \w+) int32_t;", " ", text)
    declarations = (" ".join(re.findall(r"\w+|[^\w\s]", part)) for part in re.split(r";(?![^{]*\})", text))
    return {part for part in declarations if part} | {f"{name} = {number}" for name, number in numbers}


def compare(in_header, in_library):
    """Ends the program unless both sets are the same."""
    if in_header != in_library or not in_header:
        differences = sorted((line, line in in_header) for line in in_header ^ in_library)
        places = {True: "the header", False: "the library"}
        sys.exit("\n".join(["header: ", *(f"    {line}: in {places[place]} only" for line, place in differences)]))


def main():
    header, generated, library = map(pathlib.Path, sys.argv[1:])
    declarations = declared(header)
    compare(declarations, declared(generated))
    functions = {re.search(r"(\w+) \(", line)[1] for line in declarations if re.match(r"(?!typedef).*\(", line)}
    listed = subprocess.run(["nm", "-D", "--defined-only", str(library)], check=True, capture_output=True, text=True)
    compare(functions, {line.split()[-1] for line in listed.stdout.splitlines()})
    print(f"header: {len(functions)} functions, {len(declarations) - len(functions)} types and numbers as in the library")


if __name__ == "__main__":
    main()
