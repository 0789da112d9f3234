"""JSON documents: plain values, merge patches, and checks against the schema of the view."""
from __future__ import annotations

import difflib
import functools
import importlib.resources
import json
import re
from typing import Any, Iterator, Mapping

from .errors import FieldError, InvalidView

# The key that keeps null in a patch: "draw no lines" (docs/user/api.md, Views).
KEPT_NULL = "/vector/field"

TYPES: Mapping[str, tuple[type, ...]] = {
    "object": (dict,),
    "array": (list,),
    "string": (str,),
    "number": (int, float),
    "integer": (int,),
    "boolean": (bool,),
    "null": (type(None),),
}


def plain(value: Any) -> Any:
    """A copy of a value in types of JSON: tuples and arrays become lists, numpy's numbers
    numbers."""
    if isinstance(value, Mapping):
        return {str(key): plain(one) for key, one in value.items()}
    if isinstance(value, (list, tuple, range)):
        return [plain(one) for one in value]
    if hasattr(value, "tolist"):  # numpy's arrays and numbers
        return value.tolist()
    return value


def merged(target: Any, patch: Any, pointer: str = "") -> Any:
    """The result of a merge patch (RFC 7396); null at KEPT_NULL is a value."""
    if not isinstance(patch, dict):
        return patch
    out = dict(target) if isinstance(target, dict) else {}
    for key, value in patch.items():
        below = f"{pointer}/{key}"
        if value is None and below != KEPT_NULL:
            out.pop(key, None)
        else:
            out[key] = merged(out.get(key), value, below)
    return out


def at_pointer(pointer: str, value: Any) -> dict[str, Any]:
    """The merge patch that sets the value at a JSON pointer to a key of objects."""
    if not pointer.startswith("/"):
        raise ValueError(f"'{pointer}' is not a JSON pointer such as /camera/eye")
    for key in reversed(pointer.split("/")[1:]):
        value = {key.replace("~1", "/").replace("~0", "~"): value}
    assert isinstance(value, dict)
    return value


@functools.lru_cache(maxsize=1)
def own_schema() -> dict[str, Any]:
    """The schema that this package was made with."""
    folder = importlib.resources.files("windsplat.generated")
    document = json.loads((folder / "view.schema.json").read_text(encoding="utf-8"))
    assert isinstance(document, dict)
    return document


def _fold(key: str) -> str:
    return key.replace("_", "").replace("-", "").lower()


def suggestion(key: str, known: list[str]) -> str:
    """What an unknown key or name may have meant, as a clause."""
    folded = {_fold(name): name for name in known}
    close = difflib.get_close_matches(_fold(key), list(folded), 1, 0.6)
    if close:
        return f"did you mean '{folded[close[0]]}'?"
    return "known are " + ", ".join(known)


def _type_errors(value: Any, schema: Mapping[str, Any], pointer: str) -> Iterator[FieldError]:
    kinds = schema.get("type", [])
    kinds = kinds if isinstance(kinds, list) else [kinds]
    if not kinds:
        return
    is_bool = isinstance(value, bool)
    fits = any(isinstance(value, TYPES[kind]) and (not is_bool or kind == "boolean")
               for kind in kinds)
    if "integer" in kinds and isinstance(value, float) and value.is_integer():
        fits = True
    if not fits:
        shown = json.dumps(value, default=lambda one: f"a {type(one).__name__}")[:60]
        yield FieldError(pointer, f"must be {' or '.join(kinds)}, not {shown}")


def _number_errors(value: Any, schema: Mapping[str, Any], pointer: str) -> Iterator[FieldError]:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return
    low, high = schema.get("minimum"), schema.get("maximum")
    if value != value or (low is not None and value < low) or (high is not None and value > high):
        ends = f"{low} to {high}" if high is not None else f"at least {low}"
        yield FieldError(pointer, f"must be {ends}, not {value}")


def _matches(pattern: str, value: str) -> bool:
    # In Python $ also matches before a newline at the end, in a schema it does not.
    return re.search(re.sub(r"\$$", r"\\Z", pattern), value) is not None


def _length_errors(value: Any, schema: Mapping[str, Any], pointer: str) -> Iterator[FieldError]:
    if isinstance(value, list):
        low, high = schema.get("minItems", 0), schema.get("maxItems")
        if len(value) < low or (high is not None and len(value) > high):
            ends = f"{low}" if low == high else f"{low} to {high}"
            yield FieldError(pointer, f"must have {ends} items, not {len(value)}")
    if isinstance(value, str):
        if len(value) > schema.get("maxLength", len(value)) or len(value) < schema.get(
            "minLength", 0
        ):
            yield FieldError(pointer, f"has {len(value)} characters")
        elif "pattern" in schema and not _matches(schema["pattern"], value):
            yield FieldError(pointer, f"must match {schema['pattern']}, not '{value}'")


def _object_errors(
    value: dict[str, Any], schema: Mapping[str, Any], root: Mapping[str, Any], pointer: str
) -> Iterator[FieldError]:
    known = schema.get("properties", {})
    for key, one in value.items():
        below = f"{pointer}/{key.replace('~', '~0').replace('/', '~1')}"
        if key in known:
            yield from errors_of(one, known[key], root, below)
        elif schema.get("additionalProperties") is False:
            yield FieldError(below, f"unknown key: {suggestion(key, list(known))}")
    if len(value) < schema.get("minProperties", 0):
        yield FieldError(pointer, "must have one of the keys " + ", ".join(known))
    for key in schema.get("required", ()):
        if key not in value:
            yield FieldError(f"{pointer}/{key}", "is required")


def _distance(errors: list[FieldError], pointer: str) -> tuple[bool, bool, int]:
    """How far a value is from one of several schemas: of another type, of another `type`."""
    pointers = [one.pointer for one in errors]
    return pointer in pointers, f"{pointer}/type" in pointers, len(errors)


def errors_of(
    value: Any, schema: Mapping[str, Any], root: Mapping[str, Any], pointer: str = ""
) -> Iterator[FieldError]:
    """What of a value violates a schema, for the words that the schema of the view uses."""
    if "$ref" in schema:
        name = str(schema["$ref"]).rsplit("/", 1)[-1]
        yield from errors_of(value, root["$defs"][name], root, pointer)
        return
    if "enum" in schema and value not in schema["enum"]:
        names = [str(one) for one in schema["enum"] if one is not None]
        yield FieldError(pointer, f"'{value}' is unknown: {suggestion(str(value), names)}")
        return
    if "const" in schema and value != schema["const"]:
        yield FieldError(pointer, f"must be {schema['const']}")
    problems = list(_type_errors(value, schema, pointer))
    if problems:
        yield from problems
        return
    if "anyOf" in schema:
        every = [list(errors_of(value, one, root, pointer)) for one in schema["anyOf"]]
        if all(every):
            yield from min(every, key=lambda one: _distance(one, pointer))
        return
    yield from _number_errors(value, schema, pointer)
    yield from _length_errors(value, schema, pointer)
    if isinstance(value, list):
        prefix = schema.get("prefixItems", [])
        for index, one in enumerate(value):
            item = prefix[index] if index < len(prefix) else schema.get("items")
            if isinstance(item, dict):
                yield from errors_of(one, item, root, f"{pointer}/{index}")
    if isinstance(value, dict):
        yield from _object_errors(value, schema, root, pointer)


def check(document: Any, schema: Mapping[str, Any]) -> None:
    """Raises InvalidView with each invalid value of a view."""
    errors = tuple(errors_of(document, schema, schema))
    if errors:
        first = errors[0]
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        raise InvalidView(0, "Invalid view", f"{first.pointer or '/'}: {first.detail}{more}",
                          errors=errors)
