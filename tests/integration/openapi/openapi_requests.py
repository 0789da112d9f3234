#!/usr/bin/env python3
"""Random requests, valid and invalid ones, made from /v1/openapi.json of a daemon, whose answers
must be those that the document states: status, Content-Type, headers, and JSON by its schema; no
5xx; and no success for what the document forbids.

    openapi_requests.py --program=PATH [--count=N] [--seed=N]

Needs python3-jsonschema. Prints the seed and the number of answers by status.
"""
import argparse
import collections
import http.client
import json
import pathlib
import random
import subprocess
import sys
import tempfile
import time
import urllib.parse

import jsonschema

import schema_values

NO_LIMITS = ["connections-per-address", "arrivals", "arrivals-per-address", "requests-per-address",
             "bytes-per-address", "render-per-address", "received-per-address", "wait"]
METHODS = ["GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"]
PROBLEM = "application/problem+json"
EDGE = 48  # pixels; larger pictures would only take longer
KEPT = 40  # ids of each kind that are used again


class Daemon:
    def __init__(self, program):
        self.folder = tempfile.TemporaryDirectory(prefix="windsplat-openapi-")
        self.state = tempfile.TemporaryDirectory(prefix="windsplat-openapi-state-")
        root = pathlib.Path(self.folder.name)
        for name, sample in (("small", "climate"), ("gusts", "tornado")):
            subprocess.run([program, "synth", sample, "--dims", "16x12x6", "--steps", "3", "-o",
                            root / f"{name}.nc"], check=True, stdout=subprocess.DEVNULL)
        (root / "notes.txt").write_text("not a field")
        words = [program, "serve", root / "small.nc", root / "gusts.nc", "--data-root", root,
                 "--listen", "127.0.0.1:0", "--threads", "1", "--log-level", "warn",
                 "--upload-limit", "1M", "--state-dir", self.state.name]
        for name in NO_LIMITS:
            words += [f"--max-{name}", "0"]
        self.child = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
        self.address = urllib.parse.urlsplit(self.child.stdout.readline().strip()).netloc
        self.client = None

    def ask(self, method, target, headers, body):
        """(status, headers with small names, body)."""
        for is_last in (False, True):
            try:
                if self.client is None:
                    self.client = http.client.HTTPConnection(self.address, timeout=240)
                self.client.putrequest(method, target, skip_accept_encoding=True)
                for name, value in headers.items():
                    self.client.putheader(name, value)
                self.client.endheaders(body)
                answer = self.client.getresponse()
                found = answer.status, {k.lower(): v for k, v in answer.getheaders()}, answer.read()
                if answer.will_close:
                    self.client.close()
                    self.client = None
                return found
            except (http.client.HTTPException, ConnectionError):
                self.client.close()
                self.client = None
                if is_last:
                    raise
        return None

    def close(self):
        if self.client:
            self.client.close()
        self.child.terminate()
        self.child.communicate()
        self.folder.cleanup()
        self.state.cleanup()
        return self.child.returncode


class Document:
    """The document, with the operations and what they answer."""

    def __init__(self, document):
        self.document = document
        self.resolver = jsonschema.RefResolver("", document)
        self.validators = {}
        self.operations = [(method.upper(), path, operation)
                           for path, methods in document["paths"].items()
                           for method, operation in methods.items()]

    def resolved(self, node):
        return self.resolver.resolve(node["$ref"])[1] if "$ref" in node else node

    def complaints(self, schema, value):
        key = json.dumps(schema)
        if key not in self.validators:
            self.validators[key] = jsonschema.Draft202012Validator(schema, resolver=self.resolver)
        return [error.message[:300] for error in self.validators[key].iter_errors(value)]


class Requests:
    """Makes requests, each with whether the document permits it."""

    def __init__(self, document, draw):
        self.of = document
        self.draw = draw
        self.values = schema_values.Values(document.document, draw)
        self.fields = ["none"]
        self.ids = {"datasets": ["small", "gusts"], "views": [], "jobs": [], "references": [],
                    "animations": [],
                    "uploads": ["a.nc", "b.raw"], "problems": ["not-found", "invalid-view"]}
        self.tags = []

    def learn(self, path, status, headers, body):
        tag = headers.get("etag")
        if tag and len(self.tags) < KEPT:
            self.tags.append(tag)
        if status not in (201, 202) and "/jobs/" not in path or "/uploads/" in path:
            return
        if not body or not headers.get("content-type", "").startswith("application/json"):
            return
        told = json.loads(body)
        kind = "views" if status == 201 else "jobs"
        result = told.get("result")
        if isinstance(result, dict) and "movie" in result:
            self.keep("animations", result["movie"].split("/")[-1])
        elif isinstance(result, dict):
            self.keep("references", result["id"] + ".png")
        elif isinstance(result, str):
            self.keep("datasets", result)
        self.keep(kind, told["id"])

    def keep(self, kind, one):
        if one not in self.ids[kind]:
            self.ids[kind] = self.ids[kind][-KEPT:] + [one]

    def path_value(self, name, path):
        if self.draw.random() < 0.06:
            return self.draw.choice(schema_values.WORDS + ["%2e%2e", "\u0000", "a/b"])
        if name == "field":
            return self.draw.choice(self.fields)
        kind = next(part for part in path.split("/")[1:] if part in self.ids)
        if kind == "datasets":
            return self.draw.choice(self.ids[kind][:2] + self.ids[kind][-2:])
        return self.draw.choice(self.ids[kind] or ["none"])

    def target(self, path):
        parts = []
        for part in path.split("/"):
            if part.startswith("{"):
                part = urllib.parse.quote(self.path_value(part[1:-1], path), safe="%")
            parts.append(part)
        return "/".join(parts)

    def parameter(self, parameter):
        """(text, whether the document permits it)."""
        schema = parameter["schema"]
        if schema["type"] == "string" and "enum" not in schema:
            known = {"preset": ["default", "top", "clouds", "winds", "none"],
                     "minus": ["small", "gusts", "none"], "folder": ["", ".", "..", "x", "/etc"],
                     "heightField": self.fields, "after": ["a", "small.nc"],
                     "datetime": ["2001-01-01", "2001-01-01T06:00Z", "now"],
                     "colormap": ["viridis", "magma", "none"],
                     "bbox": ["-20,-30,40,70", "350,0,10,9", "0,0,0", "5,1,a,2"],
                     "level": ["500", "1000,300", "x"],
                     "stride": ["2", "1,2,3", "0", "1.5", "9,9,9,9"]}
            return self.draw.choice(known.get(parameter["name"], schema_values.WORDS)), True
        value = self.values.of(schema)
        if parameter["name"] in ("fields", "field"):
            value = [self.draw.choice(self.fields)]
        if parameter["name"] == "annotate":
            value = [self.draw.choice(["true", "false", "0", "legend", "axes", "all"])]
        if parameter["name"] in ("width", "height"):
            value = self.draw.randint(1, EDGE)
        if parameter["name"] in ("step", "minusStep") and self.draw.random() < 0.8:
            value = self.draw.randint(0, 2)
        if parameter["name"] == "index" and self.draw.random() < 0.8:
            value = [self.draw.randint(0, 5) for _ in range(3)]
        if self.draw.random() < 0.07:
            value = self.draw.choice(["", "x", "NaN", "1e999", "-", "1,2", "1,2,3,4", -1e38, 0.5,
                                      schema.get("maximum", 1) + 1, 2**40, [1, "a"], "\u2603"])
        ok = not self.of.complaints(schema, value)
        if isinstance(value, list):
            return ",".join(map(str, value)), ok
        return json.dumps(value) if isinstance(value, bool) else str(value), ok

    def query(self, operation):
        """(text, whether the document permits it)."""
        pairs, ok = [], True
        for parameter in operation.get("parameters", []):
            if parameter["in"] != "query":
                continue
            size = parameter["name"] in ("width", "height")
            needed = size or parameter.get("required") or parameter["name"] in ("x", "y", "z")
            if self.draw.random() > (0.97 if needed else 0.2):
                ok = ok and not parameter.get("required")
                continue
            text, fits = self.parameter(parameter)
            ok = ok and fits
            pairs.append((parameter["name"], text))
        if self.draw.random() < 0.04:
            pairs.append((self.draw.choice(["colour", "Step", "\u2603", ""]), "1"))
            ok = ok and not pairs[-1][0]  # an empty one with a value is unknown, too
            ok = False
        if pairs and self.draw.random() < 0.02:
            pairs.append(pairs[0])
            ok = False
        return urllib.parse.urlencode(pairs), ok

    def view(self, view):
        """The same as a small picture of a dataset that exists, for the most part."""
        if self.draw.random() < 0.95:
            view["dataset"] = self.draw.choice(["small", "gusts"])
        view["image"] = view.get("image") or {}
        view["image"] |= {"width": self.draw.randint(1, EDGE),
                          "height": self.draw.randint(1, EDGE)}
        if self.draw.random() < 0.8:
            view["step"] = self.draw.randint(0, 2)
            view.pop("difference", None)
        for holder in (view.get("vector"), *(view.get("scalars") or []),
                       *(view.get("surfaces") or [])):
            if isinstance(holder, dict) and "field" in holder and holder["field"] is not None:
                if self.draw.random() < 0.9:
                    holder["field"] = self.draw.choice(self.fields)
        return view

    def body(self, operation, headers):
        """(bytes, whether the document permits it)."""
        given = operation.get("requestBody")
        if given is None:
            return None, True
        media = self.draw.choice(list(given["content"]))
        headers["Content-Type"] = media
        if media == "application/octet-stream":
            headers["Content-Digest"] = self.draw.choice(["", "sha-256=:eA==:", "md5=:eA==:", "x"])
            return self.draw.randbytes(self.draw.choice([0, 1, 100, 10000])), None
        schema = given["content"][media]["schema"]
        value = self.values.of(schema)
        if schema.get("$ref", "").endswith("/View"):
            value = self.view(value)
        elif schema.get("type") == "object":
            value = self.view({})
        elif isinstance(value, dict) and "upload" in value:
            value["upload"] = self.draw.choice(self.ids["uploads"])
        elif isinstance(value, dict) and "path" in value:
            value["path"] = self.draw.choice(["small.nc", "*.nc", "notes.txt", "../x", "none.nc"])
        way = self.draw.random()
        if way < 0.2:
            value = self.values.spoiled(value)
        ok = not self.of.complaints(schema, value)
        data = json.dumps(value).encode()
        if 0.2 <= way < 0.26:
            data, ok = self.values.spoiled_text(value), None
        if 0.26 <= way < 0.29:
            headers["Content-Type"] = self.draw.choice(["text/plain", "image/png", "json", "a/b"])
            ok = False
        elif 0.29 <= way < 0.3:
            del headers["Content-Type"]
            ok = False
        return data, ok

    def make(self):
        """(method, target, headers, body, path, operation, whether the document permits it)."""
        method, path, operation = self.draw.choice(self.of.operations)
        if method == "DELETE" and self.draw.random() < 0.5:  # most of what exists shall remain
            method, path, operation = self.draw.choice(self.of.operations)
        headers = {}
        query, fits = self.query(operation)
        body, permitted = self.body(operation, headers)
        permitted = permitted if fits else False
        if self.draw.random() < 0.3:
            headers["Accept"] = self.draw.choice(
                ["*/*", "image/png", "image/*;q=0.5, application/x-npy", "application/pdf",
                 "image/svg+xml", "text/html", "application/json", ";;q=x"])
        for name in ("If-None-Match", "If-Match"):
            if self.draw.random() < 0.05:
                headers[name] = self.draw.choice([*self.tags, "*", '"none"', "none"])
        if self.draw.random() < 0.03:
            method = self.draw.choice(METHODS)
            permitted = None
        elif method == "GET" and self.draw.random() < 0.05:
            method = "HEAD"
        if body is not None or method in ("POST", "PUT", "PATCH"):
            headers["Content-Length"] = str(len(body or b""))
        target = self.target(path) + ("?" + query if query else "")
        return method, target, headers, body, path, operation, permitted


class Checker:
    def __init__(self, document):
        self.of = document

    def check(self, request, answer):
        """What is wrong, as a list of texts."""
        method, target, _, _, path, operation, permitted = request
        status, headers, body = answer
        methods = {m for m, p, _ in self.of.operations if p == path}
        if "GET" in methods:
            methods.add("HEAD")
        wrong = []
        if status >= 500:
            wrong.append("an error of the server")
        if "x-request-id" not in headers:
            wrong.append("no X-Request-Id")
        if method == "OPTIONS" and status == 204:
            return wrong + self.allow(methods, headers)
        if method not in methods:
            if status == 404 and "//" in target or status in (400, 404):
                return wrong  # the path is another one, or none
            if status != 405:
                wrong.append("not 405")
            return wrong + self.allow(methods, headers)
        own = self.of.document["paths"][path].get("get" if method == "HEAD" else method.lower())
        if own is not operation:
            operation, permitted = own, None
        responses = operation["responses"]
        if str(status) not in responses:
            return wrong + ["the status is not documented"]
        if status < 400 and permitted is False:
            wrong.append("success for what the document forbids")
        response = self.of.resolved(responses[str(status)])
        for name, header in response.get("headers", {}).items():
            if self.of.resolved(header).get("required") and name.lower() not in headers:
                wrong.append(f"no header {name}")
        return wrong + self.content(method, response, headers, body)

    @staticmethod
    def allow(methods, headers):
        allowed = set(headers.get("allow", "").split(", "))
        return [] if allowed == methods | {"OPTIONS"} else [f"Allow is not {sorted(methods)}"]

    def content(self, method, response, headers, body):
        media = headers.get("content-type", "").partition(";")[0]
        content = response.get("content", {})
        if not content:
            return [] if not body else ["a body that is not documented"]
        if media not in content:
            return [f"Content-Type {media} is not documented"]
        if method == "HEAD":
            return [] if not body else ["HEAD has a body"]
        if not media.endswith("json"):
            return [] if body else ["no body"]
        try:
            value = json.loads(body)
        except ValueError:
            return ["the body is not JSON"]
        schema = content[media].get("schema", {})
        return [f"body: {text}" for text in self.of.complaints(schema, value)]


def told(request, answer):
    method, target, headers, body, *_ = request
    return (f"{method} {target} {headers} {(body or b'')[:600]!r}\n"
            f"    -> {answer[0]} {answer[1].get('content-type')} {answer[2][:300]!r}")


def run(arguments):
    daemon = Daemon(arguments.program)
    counts = collections.Counter()
    recent = collections.deque(maxlen=5)
    faults = 0
    try:
        _, _, text = daemon.ask("GET", "/v1/openapi.json", {}, None)
        document = Document(json.loads(text))
        requests = Requests(document, random.Random(arguments.seed))
        for name in ("small", "gusts"):
            fields = json.loads(daemon.ask("GET", f"/v1/datasets/{name}", {}, None)[2])["fields"]
            requests.fields += [field["name"] for field in fields]
        checker = Checker(document)
        for _ in range(arguments.count):
            request = requests.make()
            try:
                answer = daemon.ask(*request[:4])
            except (OSError, http.client.HTTPException) as fault:
                answer = 0, {}, repr(fault).encode()
                print("no answer\n    " + told(request, answer), flush=True)
                for earlier, its in recent:
                    print("  after " + told(earlier, its), flush=True)
                faults += 1
                break
            counts[answer[0]] += 1
            recent.append((request, answer))
            requests.learn(request[1], *answer)
            wrong = checker.check(request, answer)
            if wrong:
                faults += 1
                if faults <= arguments.shown:
                    print("; ".join(wrong) + "\n    " + told(request, answer), flush=True)
    finally:
        code = daemon.close()
    if code != 0:
        print(f"the daemon ended with {code}")
        faults += 1
    return counts, faults


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("--program", required=True)
    parser.add_argument("--count", type=int, default=1000, help="number of requests")
    parser.add_argument("--seed", type=int, default=23, help="of the requests")
    parser.add_argument("--shown", type=int, default=20, help="faults that are printed")
    arguments = parser.parse_args()
    print(f"seed {arguments.seed}, {arguments.count} requests", flush=True)
    begin = time.monotonic()
    counts, faults = run(arguments)
    print(" ".join(f"{status}:{count}" for status, count in sorted(counts.items())))
    print(f"{faults} faults in {time.monotonic() - begin:.1f} s")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
