"""Writes an OpenAPI 3 document as a page of Markdown."""
import json

METHODS = ["get", "head", "post", "put", "patch", "delete", "options"]


def cell(text):
    """Text for a cell of a table: one line, without bars."""
    return " ".join(str(text or "").split()).replace("|", "\\|")


def name_of(pointer):
    """The last part of a pointer, as a link where the page has a heading for it."""
    name = pointer.rsplit("/", 1)[-1]
    return f"[{name}](#schema-{name})" if pointer == f"#/components/schemas/{name}" else name


def resolved(document, value):
    """What a reference within the document means."""
    while isinstance(value, dict) and str(value.get("$ref", "")).startswith("#/"):
        found = document
        for part in value["$ref"][2:].split("/"):
            found = found[part.replace("~1", "/").replace("~0", "~")]
        value = found
    return value


def type_of(schema):
    """A short description of a schema."""
    if not isinstance(schema, dict):
        return "any" if schema or schema is None else "none"
    if "$ref" in schema:
        return name_of(schema["$ref"])
    for key in ("oneOf", "anyOf"):
        if key in schema:
            return " or ".join(type_of(one) for one in schema[key])
    if "const" in schema:
        return f"`{json.dumps(schema['const'])}`"
    if "enum" in schema:
        return ", ".join(f"`{one}`" for one in schema["enum"])
    kind = schema.get("type", "any")
    kind = " or ".join(kind) if isinstance(kind, list) else kind
    if kind == "array" and "items" in schema:
        return f"array of {type_of(schema['items'])}"
    low, high = schema.get("minimum"), schema.get("maximum")
    if low is not None and high is not None:
        return f"{kind}, {low} to {high}"
    if low is not None or high is not None:
        return f"{kind}, {f'at least {low}' if high is None else f'at most {high}'}"
    return kind


def parameters(document, given):
    rows = []
    for one in (resolved(document, value) for value in given):
        needed = ", required" if one.get("required") else ""
        rows.append(f"| `{one['name']}` | {one['in']}{needed} | {cell(type_of(one.get('schema')))} "
                    f"| {cell(one.get('description'))} |")
    if not rows:
        return []
    return ["| parameter | in | type | meaning |", "|---|---|---|---|", *rows, ""]


def contents(value):
    """The media types of a body with their schemas."""
    return "; ".join(f"`{kind}`" + (f" ({type_of(media['schema'])})" if "schema" in media else "")
                     for kind, media in value.get("content", {}).items())


def answers(document, one):
    """The rows of the table of an operation's answers."""
    rows = []
    for status, value in one.get("responses", {}).items():
        answer = resolved(document, value)
        rows.append(f"| {status} | {cell(answer.get('description'))} | {cell(contents(answer))} |")
    return rows


def table(rows):
    return ["| status | meaning | content |", "|---|---|---|", *rows, ""] if rows else []


def operation(document, method, path, shared, one, common):
    """`common`: the rows of answers that stand elsewhere."""
    out = [f"### {method.upper()} {path}".replace("{", "&#123;").replace("}", "&#125;"), ""]
    summary, description = (one.get(key, "").strip() for key in ("summary", "description"))
    out += [summary, ""] if summary and summary != description.rstrip(".") else []
    out += [description, ""] if description else []
    if one.get("deprecated"):
        out += ["**Deprecated.**", ""]
    out += parameters(document, [*shared, *one.get("parameters", [])])
    if body := resolved(document, one.get("requestBody")):
        out += [f"Body: {contents(body)}. {body.get('description', '')}".rstrip(), ""]
    return out + table([row for row in answers(document, one) if row not in common])


def schema_section(schemas):
    out = ["## Schemas", ""] if schemas else []
    for name, schema in schemas.items():
        out += [f"### {name} {{#schema-{name}}}", "", "```json", json.dumps(schema, indent=1),
                "```", ""]
    return out


def joined(lines):
    return "\n".join(lines).rstrip() + "\n"


def page(document):
    """The whole page: the operations by tag, in the document's order."""
    info = document.get("info", {})
    out = ["# REST reference", "", f"Version {info.get('version', '')} of the "
           "[OpenAPI document](openapi.json) that the daemon serves at `/v1/openapi.json`.", ""]
    out += [info["description"].strip(), ""] if info.get("description") else []
    found = [(method, path, item.get("parameters", []), item[method])
             for path, value in document.get("paths", {}).items()
             for item in [resolved(document, value)] for method in METHODS if method in item]
    rows = [answers(document, one) for *_, one in found]
    common = [row for row in rows[0] if all(row in other for other in rows)] if rows[1:] else []
    if common:
        out += ["These answers may come from every resource:", "", *table(common)]
    groups = {}
    for method, path, shared, one in found:
        tag = (one.get("tags") or ["resources"])[0]
        groups.setdefault(tag, []).extend(operation(document, method, path, shared, one, common))
    for tag, lines in groups.items():
        out += [f"## {tag[:1].upper()}{tag[1:]}", "", *lines]
    return joined([*out, *schema_section(document.get("components", {}).get("schemas", {}))])
