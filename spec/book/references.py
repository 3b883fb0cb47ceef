"""Writes the references of Python, C and TypeScript from their sources: docstrings, comments of cbvh.h, and comments of exported types.

A chapter has the line `{{#reference LANGUAGE}}`, which preprocess.py replaces when the book is built. Sources are read as text, so nothing
has to be built first. `names` says what is public in each language, for a test that looks for each name in its page.
"""

import ast
import inspect
import pathlib
import re
from typing import Callable, Iterator, NamedTuple

import pages

PYTHON = pages.ROOT / "bvh-query/python/python/cbvh"
EXCEPTIONS = pages.ROOT / "bvh-query/python/src/errors.rs"
HEADER = pages.ROOT / "bvh-query/capi/include/cbvh.h"
TYPESCRIPT = pages.ROOT / "bvh-query/web/ts"

DIRECTIVE = re.compile(r"^\{\{#reference (\w+)\}\}$", re.MULTILINE)
WIDTH = 110


class Part(NamedTuple):
    """What a page says about one thing: its name, how deep its heading is, its declaration, and its text in Markdown."""

    name: str
    depth: int
    code: str = ""
    text: str = ""


def written(parts: Iterator[Part], language: str) -> str:
    found = []
    for part in parts:
        code = f"```{language},ignore\n{part.code}\n```" if part.code else ""
        found += [f"{'#' * part.depth} {part.name}", code, part.text]
    return "\n\n".join(text for text in found if text) + "\n"


def plain(text: str) -> str:
    """Markdown in which what looks like an element of HTML is text. Code stays as it is."""
    spans = re.split(r"(^```.*?^```$|``[^`]+``|`[^`]+`)", text, flags=re.M | re.S)
    return "".join(span if number % 2 else span.replace("<", "&lt;") for number, span in enumerate(spans))


def folded(head: str, arguments: list[str], tail: str) -> str:
    """A declaration with its arguments: on one line or, if that is too long, on lines of their own."""
    line = f"{head}({', '.join(arguments)}){tail}"
    return line if len(line) <= WIDTH else f"{head}(\n" + "".join(f"    {of},\n" for of in arguments) + f"){tail}"


# ---------------------------------------------------------------------------------------------------------------- Python


def docstring(node: ast.AST) -> str:
    """A docstring as Markdown: examples become blocks."""
    lines, found, is_example = inspect.cleandoc(ast.get_docstring(node) or "").splitlines(), [], False
    for line in [*lines, ""]:
        if line.lstrip().startswith(">>>") and not is_example:
            found += ["```python,ignore"]
            is_example = True
        elif is_example and not line.strip():
            found += ["```"]
            is_example = False
        found.append(re.sub(r"\s+# doctest: .*", "", line) if is_example else line)
    return plain("\n".join(found).strip())


def signature(node: ast.FunctionDef, skip_self: bool) -> tuple[list[str], str]:
    """The arguments of a function, and what it returns."""
    of = node.args
    positional, defaults = [*of.posonlyargs, *of.args], [*of.defaults]
    with_default = dict(zip(reversed(positional), reversed(defaults)))
    with_default.update({argument: value for argument, value in zip(of.kwonlyargs, of.kw_defaults) if value is not None})

    def shown(argument: ast.arg) -> str:
        text = ast.unparse(argument)
        if argument in with_default:
            text += (" = " if argument.annotation else "=") + ast.unparse(with_default[argument])
        return text

    found = [shown(argument) for argument in positional[1 if skip_self else 0 :]]
    if of.vararg or of.kwonlyargs:
        found.append("*" + ast.unparse(of.vararg) if of.vararg else "*")
    found += [shown(argument) for argument in of.kwonlyargs]
    found += ["**" + ast.unparse(of.kwarg)] if of.kwarg else []
    return found, f" -> {ast.unparse(node.returns)}" if node.returns else ""


def python_function(node: ast.FunctionDef, depth: int, of_class: str = "") -> Part:
    kinds = {ast.unparse(decorator) for decorator in node.decorator_list}
    arguments, returns = signature(node, bool(of_class) and "staticmethod" not in kinds)
    name = f"{of_class}.{node.name}" if of_class else node.name
    code = f"{name}{returns.replace(' -> ', ': ')}" if "property" in kinds else folded(name, arguments, returns)
    return Part(name, depth, code, docstring(node))


def python_members(known: dict[str, ast.ClassDef], of: ast.ClassDef) -> list[ast.stmt]:
    """The members of a class, and of the classes of the package from which it inherits."""
    bases = [known[base.id] for base in of.bases if isinstance(base, ast.Name) and base.id in known]
    return [*of.body, *(member for base in bases for member in python_members(known, base))]


def python_class(known: dict[str, ast.ClassDef], node: ast.ClassDef) -> Iterator[Part]:
    fields, methods, made = [], {}, []
    for member in python_members(known, node):
        if isinstance(member, ast.FunctionDef) and member.name == "__init__" and not made:
            made = [folded(node.name, signature(member, True)[0], "")]
            # What takes parts of the compiled module is not for users to call.
            made = [code for code in made if "_cbvh." not in code]
        elif isinstance(member, ast.FunctionDef) and not member.name.startswith("_"):
            # A setter has the words of its property.
            if not any(ast.unparse(decorator).endswith(".setter") for decorator in member.decorator_list):
                methods.setdefault(member.name, member)
        elif isinstance(member, ast.AnnAssign | ast.Assign) and not ast.unparse(member).startswith("_"):
            fields.append(ast.unparse(member))
    yield Part(node.name, 3, "\n".join(made + fields), docstring(node))
    for method in methods.values():
        yield python_function(method, 4, node.name)


def python_exports() -> dict[str, str]:
    """The public names of the module, with the files that they are in."""
    module = ast.parse((PYTHON / "__init__.py").read_text(encoding="utf-8"))
    files = {name.name: of.module for of in module.body if isinstance(of, ast.ImportFrom) for name in of.names}
    (listed,) = (
        ast.literal_eval(of.value) for of in module.body if isinstance(of, ast.Assign) and ast.unparse(of.targets[0]) == "__all__"
    )
    return {name: files[name] for name in listed if not name.startswith("__")}


def python() -> str:
    exports, known, functions = python_exports(), {}, {}
    for file in sorted(set(exports.values()) - {"_cbvh"}):
        for node in ast.parse((PYTHON / f"{file}.py").read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef):
                known[node.name] = node
            elif isinstance(node, ast.FunctionDef):
                functions[node.name] = node
    macro = r'create_exception!\(\s*cbvh,\s*(\w+),\s*Py(\w+),\s*"([^"]+)"\s*\)'
    errors = re.findall(macro, EXCEPTIONS.read_text(encoding="utf-8"))
    exceptions = {name: Part(name, 3, f"class {name}({base})", text) for name, base, text in errors if name in exports}

    def parts() -> Iterator[Part]:
        yield Part("Functions", 2)
        yield from (python_function(functions[name], 3) for name in exports if name in functions)
        yield Part("Classes", 2)
        for name in exports:
            if name in known:
                yield from python_class(known, known[name])
        yield Part("Exceptions", 2)
        yield from exceptions.values()

    module = ast.parse((PYTHON / "__init__.py").read_text(encoding="utf-8"))
    return docstring(module) + "\n\n" + written(parts(), "python")


# --------------------------------------------------------------------------------------------------------------------- C


def comment(text: str) -> str:
    """A comment of the header as Markdown, with names as code."""
    lines = [re.sub(r"^\s*\*? ?", "", line) if number else line for number, line in enumerate(text.strip().splitlines())]
    lines = [re.sub(r"^ ?", "", line) if not line.startswith("    ") else line for line in lines]
    named = re.compile(r"(`[^`]*`)|\b((?:cbvh|CBVH)_\w+)")
    return plain("\n".join(line if line.startswith("    ") else named.sub(lambda of: of[1] or f"`{of[2]}`", line) for line in lines))


def c_names(code: str) -> list[str]:
    """What a declaration declares: functions, types, and the numbers of an enumeration without a name."""
    code = re.sub(r"/\*.*?\*/", "", code, flags=re.S)
    types = re.findall(r"\btypedef [^;{(]*?(\w+);|\btypedef [^;(]*\{[^}]*\} (\w+);|\btypedef [^;]*\(\*(\w+)\)", code)
    found = [name for of in types for name in of if name] + re.findall(r"^#define (\w+)", code, re.M)
    return found + re.findall(r"^(?!typedef)\w[^;{}=#]*?\b(cbvh_\w+)\(", code, re.M)


def c_parts() -> Iterator[Part]:
    text = HEADER.read_text(encoding="utf-8")
    text = re.sub(r"^#(?:ifndef|ifdef|endif|include|define CBVH_H$).*\n|^extern \"C\" \{\n|^\}\n", "", text, flags=re.M)
    # A comment that begins a line, and what it is about, up to the next one.
    for found in re.finditer(r"^/\*(.*?)\*/[ \t]*\n(.*?)(?=^/\*|\Z)", text, re.M | re.S):
        words, code = found[1], found[2].strip()
        if section := re.match(r" -{20,} ([^\n]+)\n?(.*)", words, re.S):
            yield Part(section[1].strip().capitalize(), 2, "", comment(re.sub(r"^\s*\*\s*\n", "", section[2])))
        elif names := c_names(code):
            yield Part(", ".join(f"`{name}`" for name in names), 3, code, comment(words))
        elif not code:
            yield Part("The interface as a whole", 2, "", comment(words))
        else:
            raise ValueError(f"cbvh.h: expected a declaration of something, found {code!r}")


def c_exports() -> list[str]:
    """The functions and types that the header declares."""
    text = re.sub(r"/\*.*?\*/", "", HEADER.read_text(encoding="utf-8"), flags=re.S)
    return sorted(set(re.findall(r"\b(cbvh_\w+)\(", text)) | set(re.findall(r"\b(cbvh_\w+);", text)))


# ------------------------------------------------------------------------------------------------------------ TypeScript


def remark(text: str) -> str:
    """A comment of TypeScript as Markdown: tags become a list."""
    lines = [re.sub(r"^\s*\* ?", "", line).strip() for line in text.strip().splitlines()]
    joined = re.sub(r"^@param (\w+)", r"- `\1`:", "\n".join(lines), flags=re.M)
    joined = re.sub(r"^@(returns|throws)", lambda of: f"- {of[1].capitalize()}:", joined, flags=re.M)
    # A list begins behind an empty line.
    words, item, rest = joined.partition("\n- ")
    return plain(words.rstrip() + ("\n\n- " if item else "") + rest)


def typescript_exports() -> dict[str, str]:
    """The names that the package exports, with the files that they are in."""
    text = (TYPESCRIPT / "index.ts").read_text(encoding="utf-8")
    found = re.findall(r'export (?:type )?\{([^}]*)\} from "\./(\w+)\.js"', text)
    return {name.strip(): file for names, file in found for name in names.split(",") if name.strip()}


def until(text: str, ends: str) -> str:
    """A declaration up to the first of some characters that is in no bracket."""
    depth = 0
    for place, letter in enumerate(text):
        # An arrow is no bracket.
        if letter in ends and depth == 0:
            return text[:place].rstrip()
        depth += (letter in "([{<") - (letter in ")]}" or letter == ">" and text[place - 1] != "=")
    raise ValueError(f"expected the end of a declaration, found {text[:80]!r}")


DECLARED = r"(?:/\*\*((?:(?!\*/).)*)\*/\n)?export (?:declare )?(class|interface|enum|function|const|type) {}\b"
WORDS = r"(?:static |readonly |async |get |set )*"
MEMBER = re.compile(
    rf"(?:^    /\*\*((?:(?!\*/).)*)\*/\n)?^    (?!{WORDS}(?:#|_|private\b|constructor\b))({WORDS}(\w+))", re.M | re.S
)


def typescript_part(name: str, text: str) -> Iterator[Part]:
    found = re.search(DECLARED.format(name), text, re.S)
    if found is None:
        raise ValueError(f"expected a declaration of {name}, found none")
    words, kind, code = remark(found[1] or ""), found[2], text[found.start(2) :]
    if kind == "class":
        body = code[: code.index("\n}\n")]
        yield Part(name, 3, until(code, "{"), words)
        known = set()
        for member in MEMBER.finditer(body):
            if "@internal" not in (member[1] or "") and member[3] not in known:
                known.add(member[3])
                is_field = re.match(r"[?!]?:", body[member.end() :])
                declared = until(body[member.start(2) :], ";" if is_field else "{;")
                yield Part(f"{name}.{member[3]}", 4, re.sub(r"\n    ", "\n", declared), remark(member[1] or ""))
    elif kind in ("interface", "enum"):
        line = code.partition("\n")[0]
        yield Part(name, 3, line if line.endswith("}") else code[: code.index("\n}\n") + 2], words)
    elif kind == "function":
        yield Part(name, 3, until(code, "{"), words)
    else:
        yield Part(name, 3, until(code, "=;" if kind == "const" else ";"), words)


def linked(text: str) -> str:
    """A comment whose links are code."""
    return re.sub(r"\{@link ([\w.]+)\}", r"`\1`", text)


def typescript_parts() -> Iterator[Part]:
    file = ""
    for name, of in typescript_exports().items():
        text = linked((TYPESCRIPT / f"{of}.ts").read_text(encoding="utf-8"))
        if of != file:
            # The first sentence of the file says what is in it.
            about = re.match(r"/\*\*(.*?)\.(?=\s)", text, re.S)
            if about is None:
                raise ValueError(f"{of}.ts: expected a sentence about the file, found none")
            yield Part(" ".join(re.sub(r"^\s*\*", "", about[1], flags=re.M).split()), 2)
            file = of
        yield from typescript_part(name, text)


# What is public, and the page, of each language.
names: dict[str, Callable[[], list[str]]] = {
    "python": lambda: list(python_exports()),
    "c": c_exports,
    "typescript": lambda: list(typescript_exports()),
}
references: dict[str, Callable[[], str]] = {
    "python": python,
    "c": lambda: written(c_parts(), "c"),
    "typescript": lambda: written(typescript_parts(), "ts"),
}


def replaced(text: str) -> str:
    """A chapter with the references that it names."""
    return DIRECTIVE.sub(lambda found: references[found[1]](), text)
