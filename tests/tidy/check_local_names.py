#!/usr/bin/env python3
"""Checks functions of anonymous namespaces: several sources of a library are compiled as one, where
calls would choose between equal names by overload resolution. Two such functions in different
sources of one library may have one name only if a call cannot fit both.
Usage: check_local_names.py [ROOT]"""
import collections
import itertools
import pathlib
import re
import sys

import tree

NAMESPACE = re.compile(r"^namespace \{\n(.*?)^\}  // namespace$", re.S | re.M)
FUNCTION = re.compile(r"^(?!return|using|struct|class|enum|namespace|[ /}#])[\w:<>,&*\[\] ]+[ &*>]"
                      r"([a-z_]\w*)\(((?:[^()]|\([^()]*\))*)\)[^;{}]*\{", re.M)
# Types that convert to each other in a call.
KINDS = {"number": re.compile(r"(?:std::)?(?:bool|char|short|int|long|unsigned|float|double|size_t|"
                              r"ssize_t|u?int\d+_t)(?: \w+)*"),
         "text": re.compile(r"char ?\*|(?:std::)?(?:string|string_view|filesystem::path)")}


def library_of(path):
    """The library that compiles a source: the folder below server, or the top folder."""
    parts = path.split("/")
    return parts[1] if parts[0] == "server" else parts[0]


def parameters_of(text):
    """The types of a parameter list; types that convert to each other have one name."""
    depth, parameters = 0, [""]
    for character in " ".join(text.split()):
        depth += {"<": 1, "(": 1, ">": -1, ")": -1}.get(character, 0)
        if character == "," and depth == 0:
            parameters.append("")
        else:
            parameters[-1] += character
    return tuple(type_of(parameter) for parameter in parameters if parameter.strip())


def type_of(parameter):
    plain = re.sub(r"\bconst\b|&", " ", parameter.split("=")[0]).strip()
    plain = " ".join(re.sub(r"^(.*[\s*>])\w+$", r"\1", plain).split())
    for kind, pattern in KINDS.items():
        if pattern.fullmatch(plain):
            return kind
    return plain.split("::")[-1] if "<" not in plain else plain


def functions_of(content):
    """(line, name, types of the parameters) of every function in an anonymous namespace."""
    for space in NAMESPACE.finditer(content):
        for function in FUNCTION.finditer(space[1]):
            at = space.start(1) + function.start()
            yield content.count("\n", 0, at) + 1, function[1], parameters_of(function[2])


def check(root):
    found = collections.defaultdict(list)
    for path, file in tree.files(root):
        if path.startswith(("server/", "protocol/")) and path.endswith(".cpp"):
            for line, name, types in functions_of(tree.text(file) or ""):
                found[library_of(path), name, types].append((path, line))
    complaints = []
    for (_, name, _), places in sorted(found.items()):
        for (first, _), (second, line) in itertools.pairwise(sorted(places)):
            if first != second:
                complaints.append(f"{second}:{line}: {name} is also a function of {first}, which "
                                  "may be compiled with it; a call could choose either")
    return complaints


if __name__ == "__main__":
    default = pathlib.Path(__file__).resolve().parents[2]
    sys.exit(tree.report("local names",
                         check(pathlib.Path(sys.argv[1] if sys.argv[1:] else default))))
