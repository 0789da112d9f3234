"""Members of C++ classes as clang-format lays them out: functions and data, without constructors,
destructors, deleted functions, constants and nested types."""
import re

NOT_CODE = re.compile(r"""//[^\n]*|/\*.*?\*/|^[ ]*\#[^\n]*|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\])*"
                      |(?<!\w)'(?:\\.|[^'\\])+'""", re.S | re.M | re.X)
CLASS = re.compile(r"(?<!enum )\b(?:class|struct)\s+((?:\w+::)*\w+)(?:\s+final)?\s*"
                   r"(?::[^;{}()]*)?\{")
ACCESS = re.compile(r"\b(public|private|protected)\s*:")
NO_MEMBER = re.compile(r"(using|friend|typedef|static_assert|enum|class|struct|union)\b|$")


def declarations(text):
    """The declarations of the class body at the start of `text`, without the contents of their
    braces."""
    braces = parentheses = 0
    declared = ""
    for at, char in enumerate(text):
        if braces == 0 and char not in ";}":
            declared += char
        braces += (char == "{") - (char == "}")
        if braces == 0:
            parentheses += (char == "(") - (char == ")")
        if braces < 0:
            return
        is_end = char == ";"
        if char == "}":  # of a body, not of an initializer
            is_end = not text[at + 1:].lstrip().startswith((";", ",", ")", "{"))
        if is_end and braces == parentheses == 0:
            yield declared.strip()
            declared = ""


def members(name, body):
    """How many functions, and how many data members."""
    constructor = re.compile(rf"(explicit\s*(\(\w+\))?\s*|constexpr\s+|virtual\s+)*~?{name}\s*\(")
    functions = data = 0
    for declared in declarations(body):
        declared = re.sub(r"\[\[.*?\]\]", "", ACCESS.sub("", declared).replace("->", ""))
        count = 1
        while count:
            declared, count = re.subn(r"<[^<>]*>", "", declared)
        declared = declared.strip().removeprefix("template").strip()
        if (NO_MEMBER.match(declared) or constructor.match(declared)
                or re.search(r"=\s*delete$", declared)):
            continue
        if "operator" in declared or "(" in re.split(r"[={]", declared)[0]:
            functions += 1
        elif not declared.startswith("static constexpr"):
            data += 1
    return functions, data


def sizes(content):
    """(line, name, members) of each class with functions; plain structs are left out."""
    code = NOT_CODE.sub(lambda match: "\n" * match.group().count("\n"), content)
    for match in CLASS.finditer(code):
        functions, data = members(match.group(1).rpartition("::")[2], code[match.end():])
        if functions:
            yield code.count("\n", 0, match.start()) + 1, match.group(1), functions + data
