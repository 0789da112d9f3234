"""Writes an AsyncAPI 3 document of one WebSocket as a page of Markdown."""
import json

import openapi

HEADER = "FrameHeader"  # the schema whose members stand at fixed places of a frame


def message(document, name):
    one = document["components"]["messages"][name]
    payload = openapi.type_of(one["payload"])
    out = [f"### {name} {{#message-{name}}}", "", one.get("summary", "").rstrip(".") + ".", "",
           f"`{one['contentType']}`: {payload}.", ""]
    if text := one["payload"].get("description"):
        out += [text, ""]
    return out


def header(schema):
    rows = sorted((one["x-offset"], one["x-encoding"], name, one.get("description"))
                  for name, one in schema["properties"].items())
    return ["## Header of a frame", "", "Little-endian values:", "",
            "| offset | type | name | meaning |", "|---|---|---|---|",
            *(f"| {offset} | {kind} | `{name}` | {openapi.cell(text)} |"
              for offset, kind, name, text in rows), ""]


def page(document):
    """The whole page: the messages of each side, the header of frames, the schemas."""
    info = document["info"]
    out = ["# Stream reference", "", f"Version {info['version']} of the "
           "[AsyncAPI document](asyncapi.json) that the daemon serves at `/v1/asyncapi.json`.", "",
           info.get("description", "").strip(), ""]
    for one in document["operations"].values():
        out += [f"## {one['title']}", "", one.get("description", ""), ""]
        for reference in one["messages"]:
            out += message(document, reference["$ref"].rsplit("/", 1)[-1])
    schemas = document["components"]["schemas"]
    return openapi.joined([*out, *(header(schemas[HEADER]) if HEADER in schemas else []),
                           *openapi.schema_section(schemas)])
