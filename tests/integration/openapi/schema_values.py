"""Values of a JSON Schema, at random: valid ones, often at bounds, and ones with one fault."""
import copy
import json
import math

PLAIN = [None, True, False, 0, -1, 1.5, 1e300, -1e-300, "", "x", [], {}, [[]], "\u00e9\u2028",
         2**63, "NaN"]
WORDS = ["a", "wind", "cloud", "small", "x" * 300, "\u2603", "a b", "..", "%00", "0"]


class Values:
    """`document`: resolves references. `draw`: a random.Random."""

    def __init__(self, document, draw):
        self.document = document
        self.draw = draw

    def resolved(self, schema):
        while "$ref" in schema:
            found = self.document
            for part in schema["$ref"].removeprefix("#/").split("/"):
                found = found[part]
            schema = found
        return schema

    # --- valid values

    def of(self, schema, depth=0):
        schema = self.resolved(schema)
        if "const" in schema:
            return schema["const"]
        if "enum" in schema:
            return self.draw.choice(schema["enum"])
        for key in ("oneOf", "anyOf"):
            if key in schema and "properties" not in schema:
                return self.of(self.draw.choice(schema[key]), depth + 1)
        if "oneOf" in schema:  # which keys go together
            return self.object_of(schema, depth, self.draw.choice(schema["oneOf"]))
        kinds = schema.get("type", "string")
        kind = self.draw.choice(kinds) if isinstance(kinds, list) else kinds
        return {"object": self.object_of, "array": self.array_of, "string": self.text_of,
                "number": self.number_of, "integer": self.number_of,
                "boolean": lambda *_: self.draw.random() < 0.5,
                "null": lambda *_: None}[kind](
                    schema | ({"type": kind} if kind == "integer" else {}), depth)

    def number_of(self, schema, _=0):
        is_integer = schema.get("type") in ("integer", ["integer", "null"])
        least = schema.get("minimum", schema.get("exclusiveMinimum", -1000))
        most = schema.get("maximum", schema.get("exclusiveMaximum", max(1000, least + 1000)))
        way = self.draw.random()
        if way < 0.15 and "minimum" in schema:
            return schema["minimum"]
        if way < 0.3 and "maximum" in schema:
            return schema["maximum"]
        if way < 0.5 and isinstance(schema.get("default"), (int, float)):
            return schema["default"]
        near = (max(least, -20), min(most, 20))  # most limits are far from what is used
        if way < 0.9 and near[0] < near[1]:
            least, most = near
        if is_integer:
            return self.draw.randint(math.ceil(least), math.floor(most))
        value = least + (most - least) * self.draw.random()
        return value if least < value < most else (least + most) / 2

    def text_of(self, schema, _=0):
        pattern = schema.get("pattern", "")
        if pattern.startswith("^#["):
            return f"#{self.draw.getrandbits(24):06x}"
        if "default" in schema and self.draw.random() < 0.3:
            return schema["default"]
        fitting = [word for word in WORDS if len(word) >= schema.get("minLength", 0)
                   and len(word) <= schema.get("maxLength", 1000)]
        return self.draw.choice(fitting or ["x" * schema.get("minLength", 1)])

    def array_of(self, schema, depth):
        first = schema.get("prefixItems", [])
        if first:
            return [self.of(item, depth + 1) for item in first]
        least = schema.get("minItems", 0)
        most = max(least, min(schema.get("maxItems", 3), 3))
        count = self.draw.randint(least, most)
        return [self.of(schema.get("items", {}), depth + 1) for _ in range(count)]

    def object_of(self, schema, depth=0, only=None):
        known = schema.get("properties", {})
        out = {}
        allowed = known if only is None else only.get("properties", known)
        required = set(schema.get("required", [])) | set((only or {}).get("required", []))
        chance = min(1, 4 / max(1, len(allowed))) if depth < 6 else 0
        for key in allowed:
            if key in required or self.draw.random() < chance:
                out[key] = self.of(known[key], depth + 1)
        extra = schema.get("additionalProperties")
        if not known and isinstance(extra, dict):
            for _ in range(max(schema.get("minProperties", 0), self.draw.randint(0, 2))):
                out[self.draw.choice(WORDS)] = self.of(extra, depth + 1)
        if not out and known and schema.get("minProperties", 0) > 0:
            key = self.draw.choice(list(known))
            out[key] = self.of(known[key], depth + 1)
        return out

    # --- faults

    def spoiled(self, value):
        """A copy with one change at a random place."""
        value = copy.deepcopy(value)
        places = list(places_in(value))
        if not places:
            return self.draw.choice(PLAIN)
        holder, key = self.draw.choice(places)
        way = self.draw.random()
        if way < 0.25 and isinstance(holder, dict):
            holder[self.draw.choice(["colour", "", "dataSet", "\u2603", "__proto__"])] = 1
        elif way < 0.4:
            if isinstance(holder, dict):
                del holder[key]
            else:
                holder.append(copy.deepcopy(holder[key]))
        elif isinstance(holder[key], (int, float)) and way < 0.8:
            holder[key] = self.draw.choice(
                [-1, 0, 1e9, -1e9, 1e39, 0.5, 2**31, 2**32, 2**53 + 1, -holder[key], 1e-40])
        else:
            holder[key] = self.draw.choice(PLAIN)
        return value

    def spoiled_text(self, value):
        """JSON that is often none."""
        text = json.dumps(value).encode()
        way = self.draw.randrange(6)
        if way == 0:
            return text[:self.draw.randrange(max(1, len(text)))]
        if way == 1:
            return b""
        if way == 2:
            return b"[" * 40 + b"]" * 40
        if way == 3:
            return b"\xff\xfe" + text
        if way == 4:
            return text.replace(b"1", b"1e999", 1) + b" "
        at = self.draw.randrange(max(1, len(text)))
        return text[:at] + bytes([self.draw.randrange(256)]) + text[at + 1:]


def places_in(value):
    """(holder, key) of every value inside."""
    if isinstance(value, dict):
        items = list(value.items())
    elif isinstance(value, list):
        items = list(enumerate(value))
    else:
        return
    for key, inner in items:
        yield value, key
        yield from places_in(inner)
