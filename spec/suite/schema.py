"""Checks JSON against the part of JSON Schema that `SCHEMA.json` uses, so that no package is needed."""

import re

TYPES = {"object": dict, "array": list, "string": str, "boolean": bool, "integer": int, "null": type(None)}


def problems(value, schema, root, where="line"):
    """Returns what is wrong with a value, as lines of text."""
    if "$ref" in schema:
        return problems(value, root["$defs"][schema["$ref"].rsplit("/", 1)[-1]], root, where)
    if "oneOf" in schema:
        fitting = sum(not problems(value, one, root, where) for one in schema["oneOf"])
        return [] if fitting == 1 else [f"{where}: expected one of {len(schema['oneOf'])} forms, found {fitting} that fit"]
    if "const" in schema and value != schema["const"]:
        return [f"{where}: expected {schema['const']!r}, found {value!r}"]
    if "enum" in schema and value not in schema["enum"]:
        return [f"{where}: expected one of {schema['enum']}, found {value!r}"]
    kind = schema.get("type")
    if kind and (not isinstance(value, TYPES[kind]) or kind == "integer" and isinstance(value, bool)):
        return [f"{where}: expected the type {kind}, found {value!r:.80}"]
    found = []
    if "pattern" in schema and not re.search(schema["pattern"], value):
        found.append(f"{where}: expected the form {schema['pattern']}, found {value!r:.80}")
    if isinstance(value, dict):
        known = schema.get("properties", {})
        found += [f"{where}: expected the field {name}, found none" for name in schema.get("required", ()) if name not in value]
        if schema.get("additionalProperties") is False:
            found += [f"{where}: expected no field {name}" for name in value if name not in known]
        found += [f for name, one in value.items() if name in known for f in problems(one, known[name], root, f"{where}.{name}")]
    if isinstance(value, list):
        if not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)):
            found.append(f"{where}: expected {schema.get('minItems', 0)} items or more, found {len(value)}")
        if "items" in schema:
            found += [f for i, one in enumerate(value) for f in problems(one, schema["items"], root, f"{where}[{i}]")]
    return found
