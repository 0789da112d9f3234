#!/usr/bin/env python3
"""Writes windsplat/generated from protocol/view.schema.json: the schema without white space, types
of the parts of a view (TypedDicts) and the methods of windsplat.View that set them.

Usage: generate_view_types.py [--check]      --check: exit with 1 if a file is not current
"""
import json
import pathlib
import sys
import textwrap

HERE = pathlib.Path(__file__).resolve().parent
SCHEMA = HERE.parent.parent / "protocol" / "view.schema.json"
FOLDER = HERE / "windsplat" / "generated"
WIDTH = 100

HEAD = '''"""Types of the parts of a view, and the methods that set them.

Written by generate_view_types.py from protocol/view.schema.json.
"""
from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, Mapping, Sequence, TypedDict

if TYPE_CHECKING:
    from typing_extensions import Self

UNSET: Any = ...  # a keyword that was not given; None is a value: the default of the dataset
'''


def wrapped(text, indent, first=None):
    return textwrap.fill(text, WIDTH - 2, initial_indent=first or indent,
                         subsequent_indent=indent, break_long_words=False)


def kinds(node):
    kind = node.get("type", [])
    return kind if isinstance(kind, list) else [kind]


class Writer:
    def __init__(self):
        self.types = {}  # name: text of its definition, in the order of definition

    def literal(self, node):
        values = [value for value in node["enum"] if value is not None]
        text = "Literal[" + ", ".join(json.dumps(value) for value in values) + "]"
        return text + " | None" if None in node["enum"] else text

    def type_of(self, node):
        """The Python type of the values of a schema node."""
        if "enum" in node:
            return self.literal(node)
        if "anyOf" in node:  # a GeoJSON geometry
            return "Mapping[str, Any] | None"
        names = []
        for kind in kinds(node):
            if kind == "object":
                self.define(node)
                names.append(node["title"])
            elif kind == "array":
                items = node["items"]
                names.append(f"Sequence[{self.type_of(items)}]")
            else:
                names.append({"string": "str", "number": "float", "integer": "int",
                              "boolean": "bool", "null": "None"}[kind])
        return " | ".join(names)

    def define(self, node):
        name = node["title"]
        keys = {key: self.type_of(value) for key, value in node["properties"].items()}
        body = []
        if "from" in keys:  # a keyword of Python
            body.append(f'{name} = TypedDict(\n    "{name}",\n    {{')
            for key, kind in keys.items():
                body.append(wrapped(node["properties"][key]["description"], "        # "))
                body.append(f'        "{key}": "{kind}",')
            body.append("    },\n    total=False,\n)")
        else:
            body.append(f"class {name}(TypedDict, total=False):")
            body.append(wrapped(node["description"], "    ", '    """') + '"""\n')
            for key, kind in keys.items():
                body.append(f"    {key}: {kind}")
                body.append(wrapped(node["properties"][key]["description"], "    ", '    """')
                            + '"""')
        text = "\n".join(body)
        known = self.types.get(name)
        if known is not None and keys != known[1]:
            raise SystemExit(f"{name} has two meanings in the schema")
        self.types.setdefault(name, (text, keys))

    def method(self, key, node):
        """The method of windsplat.View that merges keywords into an object of the view."""
        lines = [f"    def {key}(", "        self,", "        *,"]
        for name, part in node["properties"].items():
            lines.append(f"        {name}: {self.type_of(part)} = UNSET,")
        lines.append("    ) -> Self:")
        lines.append(wrapped(node["description"], "        ", '        """') + "\n")
        for name, part in node["properties"].items():
            lines.append(wrapped(f"{name}: {part['description']}", "            ", "        "))
        lines.append('        """')
        given = ", ".join(f'"{name}": {name}' for name in node["properties"])
        lines.append(wrapped(f'return self._merged("{key}", {{{given}}})', "            ",
                             "        "))
        return "\n".join(lines)

    def list_method(self, key, node):
        item = node["items"]["title"]
        self.type_of(node)
        text = wrapped(node["description"] + " Replaces all; without arguments: none.",
                       "        ", '        """')
        return (f"    def {key}(self, *items: {item} | str) -> Self:\n{text}\n\n"
                f"        A text is the name of a field: \"a\" stands for {{\"field\": \"a\"}}.\n"
                f'        """\n        return self._listed("{key}", items)')


def module(schema):
    writer = Writer()
    methods = []
    for key, node in schema["properties"].items():
        if "object" in kinds(node):
            methods.append(writer.method(key, node))
        elif "array" in kinds(node):
            methods.append(writer.list_method(key, node))
        writer.type_of(node)
    writer.define({**schema, "title": "ViewDocument"})
    parts = [HEAD, *(text + "\n" for text, _ in writer.types.values()), '''class ViewParts:
    """One method for each part of the view; each returns a new view."""

    def _merged(self, key: str, given: Mapping[str, Any]) -> Self:
        raise NotImplementedError

    def _listed(self, key: str, items: Sequence[Any]) -> Self:
        raise NotImplementedError
''']
    text = "\n\n".join(parts) + "\n" + "\n\n".join(methods) + "\n"
    return text


def outputs():
    schema = json.loads(SCHEMA.read_text())
    short = json.dumps(schema, separators=(",", ":"), ensure_ascii=False) + "\n"
    return {FOLDER / "view.schema.json": short, FOLDER / "view_types.py": module(schema),
            FOLDER / "__init__.py": '"""Written by generate_view_types.py."""\n'}


def main():
    stale = [path for path, text in outputs().items()
             if not path.exists() or path.read_text() != text]
    if sys.argv[1:] == ["--check"]:
        for path in stale:
            print(f"{path.relative_to(HERE)} is not current: run generate_view_types.py")
        return 1 if stale else 0
    FOLDER.mkdir(exist_ok=True)
    for path, text in outputs().items():
        path.write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
