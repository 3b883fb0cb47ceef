"""Compares the functions of the header with those of `src/`: the type of each argument and result, and their order.

`header.py` compares their names with those that the library exports.
"""

import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parents[1]

# What a type of Rust is in C.
PLAIN = {
    "i32": {"int32_t", "cbvh_status", "cbvh_open_mode", "cbvh_backend", "cbvh_relation", "cbvh_side"},
    "u8": {"void", "uint8_t"},
    "u32": {"uint32_t"},
    "u64": {"uint64_t"},
    "usize": {"size_t"},
    "f64": {"double"},
    "bool": {"bool"},
    "c_char": {"char"},
    "c_void": {"void"},
    "MeshHandle": {"cbvh_mesh"},
    "QuerierHandle": {"cbvh_querier"},
    "TrackerHandle": {"cbvh_tracker"},
    "PathHandle": {"cbvh_path"},
    "SceneHandle": {"cbvh_scene"},
    "Instance": {"cbvh_instance"},
    "PoseRows": {"cbvh_pose"},
    "ContactRow": {"cbvh_contact"},
    "DistanceRow": {"cbvh_distance_answer"},
    "DistanceChoices": {"cbvh_distance_options"},
    "MotionChoices": {"cbvh_motion_options"},
    "MotionRow": {"cbvh_motion_answer"},
    "BakeChoices": {"cbvh_bake_options"},
    "ClosestRow": {"cbvh_closest_point"},
    "RayRow": {"cbvh_ray"},
    "HitRow": {"cbvh_ray_hit"},
    "SegmentRow": {"cbvh_segment"},
    "StatsRow": {"cbvh_stats"},
    "PairRow": {"cbvh_scene_pair"},
    "SceneRelationRow": {"cbvh_scene_relation"},
    "SceneContactRow": {"cbvh_scene_contact"},
    "SceneDistanceRow": {"cbvh_scene_distance_answer"},
    "Release": {"void (*)(void *)"},
    "Option<PoseFunction>": {"cbvh_pose_function"},
    "Option<SagittaFunction>": {"cbvh_sagitta_function"},
}


def spellings(rust):
    """All ways to write a type of Rust in C."""
    for pointer, const in (("*const ", True), ("*mut ", False)):
        if rust.startswith(pointer):
            inner = spellings(rust.removeprefix(pointer))
            # A pointer to const pointers has its const behind the inner star.
            return {(f"{c}const*" if c.endswith("*") else f"const {c}*") if const else f"{c}*" for c in inner}
    return PLAIN[rust]


def split(arguments):
    """Divides a list at the commas outside brackets."""
    parts, depth = [""], 0
    for character in arguments:
        depth += character in "(<"
        depth -= character in ")>"
        if character == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    return [" ".join(part.split()) for part in parts if part.strip()]


def c_type(argument):
    """The type of an argument in C, without its name."""
    if "(*" in argument:
        return "void (*)(void *)" if re.fullmatch(r"void \(\*\w+\)\(void \*\w+\)", argument) else argument
    return re.sub(r"\s*\*", "*", re.sub(r"\w+$", "", argument).strip())


def header():
    text = re.sub(r"/\*.*?\*/", "", (HERE / "include/cbvh.h").read_text(), flags=re.S)
    functions = {}
    for result, name, arguments in re.findall(r"^([\w ]+[ *])(cbvh_\w+)\(([^;]*)\);", text, re.M):
        arguments = [] if arguments == "void" else split(arguments)
        functions[name] = (re.sub(r"\s*\*", "*", result.strip()), [c_type(argument) for argument in arguments])
    return functions


def source():
    functions = {}
    for file in sorted((HERE / "src").rglob("*.rs")):
        pattern = r"#\[unsafe\(no_mangle\)\]\s*pub (?:unsafe )?extern \"C\" fn (\w+)\((.*?)\) -> ([^{]+) \{"
        for name, arguments, result in re.findall(pattern, file.read_text(), re.S):
            functions[name] = (result, [argument.split(": ", 1)[1] for argument in split(arguments)])
    return functions


def main():
    stated, defined = header(), source()
    wrong = [f"{name}: in one of header and source only" for name in stated.keys() ^ defined.keys()]
    for name in stated.keys() & defined.keys():
        (c_result, c_arguments), (result, arguments) = stated[name], defined[name]
        if c_result not in spellings(result):
            wrong.append(f"{name}: expected a result {result}, found {c_result}")
        if len(arguments) != len(c_arguments):
            wrong.append(f"{name}: expected {len(arguments)} arguments, found {len(c_arguments)}")
        for number, (rust, c) in enumerate(zip(arguments, c_arguments)):
            if c not in spellings(rust):
                wrong.append(f"{name}, argument {number}: expected {rust}, one of {spellings(rust)}, found {c}")
    if wrong or not stated:
        sys.exit("include/cbvh.h:\n" + "\n".join(sorted(wrong)))
    print(f"signatures: {len(stated)} functions as they are defined")


if __name__ == "__main__":
    main()
