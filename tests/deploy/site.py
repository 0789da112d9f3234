#!/usr/bin/env python3
"""The web site: links and anchors of the documents lead on in it, its own link check finds faults,
the page made from an OpenAPI document tells what that says, and the whole site can be built. Usage:
site.py [--program=FILE]"""
import html
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True
sys.path[:0] = [str(ROOT / "scripts/site_parts"), str(ROOT / "tests/tidy")]
import asyncapi  # noqa: E402
import links  # noqa: E402
import navigation  # noqa: E402
import openapi  # noqa: E402
import sources  # noqa: E402

PROGRAM = str(ROOT / "build/release/windsplat")
DOCS = "docs"
OPENAPI = {
    "openapi": "3.1.0", "info": {"title": "fields", "version": "1.2.3", "description": "All."},
    "paths": {
        "/v1/fields/{id}": {
            "parameters": [{"$ref": "#/components/parameters/id"}],
            "get": {"tags": ["fields"], "summary": "A field", "deprecated": True,
                    "parameters": [{"name": "step", "in": "query", "description": "one | of\nmany",
                                    "schema": {"type": "integer", "minimum": 0, "maximum": 7}}],
                    "responses": {
                        "200": {"description": "it", "content": {"application/json": {
                            "schema": {"$ref": "#/components/schemas/Field"}}}},
                        "404": {"$ref": "#/components/responses/none"}}},
            "put": {"tags": ["fields"], "requestBody": {"content": {"image/png": {}}},
                    "summary": "Said once", "description": "Said once.",
                    "responses": {"404": {"$ref": "#/components/responses/none"}}}}},
    "components": {
        "parameters": {"id": {"name": "id", "in": "path", "required": True,
                              "schema": {"enum": ["a", "b"]}}},
        "responses": {"none": {"description": "there is none"}},
        "schemas": {"Field": {"type": "object"}}}}

ASYNCAPI = {
    "asyncapi": "3.0.0", "info": {"title": "t", "version": "1.2.3", "description": "All of it."},
    "operations": {"send": {"title": "Of the server", "description": "`hello` is first.",
                            "messages": [{"$ref": "#/channels/stream/messages/hello"},
                                         {"$ref": "#/channels/stream/messages/frame"}]}},
    "components": {
        "messages": {
            "hello": {"summary": "The first one.", "contentType": "application/json",
                      "payload": {"$ref": "#/components/schemas/Hello"}},
            "frame": {"summary": "A picture", "contentType": "application/octet-stream",
                      "payload": {"type": "string", "description": "Header, then bytes."}}},
        "schemas": {
            "Hello": {"type": "object"},
            "FrameHeader": {"properties": {
                "width": {"x-offset": 12, "x-encoding": "u16", "description": "pixels | columns"},
                "magic": {"x-offset": 0, "x-encoding": "u32", "description": "WSPL"}}}}}}

SERVER = """import http.server, pathlib
class Handler(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        self.send_response(200)
        self.end_headers()
        self.wfile.write(pathlib.Path("FOLDER" + self.path.removeprefix("/v1")).read_bytes())
server = http.server.HTTPServer(("127.0.0.1", 0), Handler)
print(f"http://127.0.0.1:{server.server_port}/", flush=True)
server.serve_forever()
"""


class Folder(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="windsplat-site-")
        self.addCleanup(temporary.cleanup)
        self.root = pathlib.Path(temporary.name).resolve()

    def write(self, path, text):
        place = self.root / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text)


class Gathering(Folder):
    def gather(self, files):
        for path, text in files.items():
            self.write(f"in/{path}", text)
        titles = sources.gather(self.root / "in", self.root / "out")
        return titles, {path.relative_to(self.root / "out").as_posix(): path.read_text()
                        for path in (self.root / "out").rglob("*") if path.is_file()}

    def test_headings_keep_the_anchors_of_the_repository(self):
        _, out = self.gather({"README.md": "# The `a_b` page\n\n## A -- b\n\n## A -- b\n"})
        self.assertEqual(out["README.md"], "# The `a_b` page {#the-a_b-page}\n\n"
                                           "## A -- b {#a----b}\n\n## A -- b {#a----b-1}\n")

    def test_links_lead_to_documents_folders_and_files(self):
        titles, out = self.gather({
            "README.md": f"# T\n[a]({DOCS}/a.md#x) [b]({DOCS}) [c](https://c.example/) [d](terms)"
                         f"\n![p]({DOCS}/p.svg)\n```\n[no](link)\n```\n",
            f"{DOCS}/a.md": "# The *a* [page](../README.md)\n", f"{DOCS}/README.md": "# Papers\n",
            f"{DOCS}/p.svg": "<svg/>", "terms": "free ```\n", "other/x.md": "# Not reached\n"})
        self.assertIn(f"[a]({DOCS}/a.md#x) [b]({DOCS}/README.md) [c](https://c.example/) "
                      f"[d](terms.md)\n![p]({DOCS}/p.svg)\n```\n[no](link)", out["README.md"])
        self.assertIn("````text\nfree ```\n````", out["terms.md"])
        self.assertEqual(titles, {"README.md": "T", f"{DOCS}/a.md": "The a page",
                                  f"{DOCS}/README.md": "Papers"})
        self.assertEqual(set(out), {"README.md", f"{DOCS}/a.md", f"{DOCS}/README.md",
                                    f"{DOCS}/p.svg", "terms", "terms.md"})

    def test_a_folder_without_a_document_is_listed(self):
        titles, out = self.gather({"README.md": "# T\n[x](books/)\n", "books/a.txt": "text\n",
                                   "books/b.svg": "<svg/>", "books/.hidden": "h"})
        self.assertIn("[x](books/index.md)", out["README.md"])
        self.assertTrue(out["books/index.md"].endswith("\n- [a.txt](a.txt.md)\n- [b.svg](b.svg)\n"))
        self.assertEqual((set(titles), "books/.hidden" in out), ({"README.md"}, False))

    def test_a_link_that_leads_nowhere_is_refused_with_its_place(self):
        for link in ("b.md", "folder/", "../outside"):
            with self.assertRaisesRegex(sources.Broken, r"README\.md:3: "):
                self.gather({"README.md": f"# T\n\n[b]({link})\n"})


class Navigation(unittest.TestCase):
    def test_every_page_has_one_place_and_new_ones_are_last(self):
        last, new = f"{DOCS}/design/a.md", f"{DOCS}/user/a.md"
        titles = {path: path.upper() for path in (
            "README.md", "docs/user/api.md", last, "docs/design/overview.md", new,
            "docs/user/configuration.md", "clients/python/README.md", "other/b.md")}
        tree = navigation.tree(titles)
        places = [path for section in tree for pages in section.values()
                  for page in pages for path in page.values()]
        self.assertEqual(sorted(places), sorted(titles))
        self.assertEqual(places[0], "README.md")
        self.assertLess(places.index("docs/design/overview.md"), places.index(last))
        sections = {name: [path for page in pages for path in page.values()]
                    for section in tree for name, pages in section.items()}
        self.assertEqual(sections["Program"], ["docs/user/api.md", "clients/python/README.md", new])
        self.assertEqual(sections["Operate"], ["docs/user/configuration.md"])
        self.assertEqual(sections["More"], ["other/b.md"])


class Links(Folder):
    def complaints(self, body, **files):
        self.write("index.html", f"<html><body>{body}</body></html>")
        self.write("a/b.html", '<h1 id="here">B</h1><a href="../index.html">home</a>')
        for name, text in files.items():
            self.write(name.replace("_", "."), text)
        return links.check(self.root)

    def test_good_references_pass(self):
        self.assertEqual(self.complaints(
            '<a href="a/b.html#here">b</a><a href="https://else.example/">e</a>'
            '<a href="#top">t</a><p id="top"><img src="data:image/png;base64,AA==">'
            '<link rel="canonical" href="https://else.example/">'), [])

    def test_faults_are_found_with_their_place(self):
        for body, words in (('<a href="a/c.html">', "leads nowhere"),
                            ('<img src="p.png">', "leads nowhere"),
                            ('<a href="a/b.html#gone">', "no such anchor"),
                            ('<a href="#gone">', "no such anchor"),
                            ('<a href="../up.html">', "leads nowhere"),
                            ('<a href="/a/b.html">', "depends on the place"),
                            ('<script src="https://cdn.example/x.js">', "another host"),
                            ('<script src="//cdn.example/x.js">', "another host"),
                            ('<p style="background: url(https://cdn.example/x)">',
                             "another host")):
            found = self.complaints("\n" + body)
            self.assertEqual(len(found), 1, (body, found))
            self.assertIn(words, found[0])
            self.assertTrue(found[0].startswith("index.html:2: "), found[0])
        found = self.complaints("", x_css='@import "https://cdn.example/y.css";')
        self.assertEqual(len(found), 1, found)


class Rest(unittest.TestCase):
    def test_the_page_tells_what_the_document_says(self):
        text = openapi.page(OPENAPI)
        for words in ("# REST reference\n\nVersion 1.2.3", "## Fields\n",
                      "### GET /v1/fields/&#123;id&#125;\n\nA field\n", "**Deprecated.**",
                      "| `id` | path, required | `a`, `b` |  |",
                      "| `step` | query | integer, 0 to 7 | one \\| of many |",
                      "| 200 | it | `application/json` ([Field](#schema-Field)) |",
                      "### PUT /v1/fields/&#123;id&#125;\n\nSaid once.\n\n", "Body: `image/png`.",
                      '## Schemas\n\n### Field {#schema-Field}\n\n```json\n{\n "type"'):
            self.assertIn(words, text)

    def test_answers_that_all_have_are_told_once(self):
        text = openapi.page(OPENAPI)
        self.assertEqual(text.count("| 404 | there is none |  |"), 1)
        self.assertLess(text.index("| 404 |"), text.index("## Fields"))

    def test_types_are_short(self):
        for schema, words in (({"type": ["string", "null"]}, "string or null"),
                              ({"type": "number", "minimum": 2}, "number, at least 2"),
                              ({"oneOf": [{"const": "x"}, {"$ref": "#/a/B"}]}, '`"x"` or B'),
                              ({"type": "array", "items": {"type": "string"}}, "array of string"),
                              (True, "any"), (False, "none")):
            self.assertEqual(openapi.type_of(schema), words)


class Stream(unittest.TestCase):
    def test_the_page_tells_messages_header_and_schemas(self):
        text = asyncapi.page(ASYNCAPI)
        for words in ("# Stream reference\n\nVersion 1.2.3", "All of it.",
                      "## Of the server\n\n`hello` is first.\n",
                      "### hello {#message-hello}\n\nThe first one.\n\n"
                      "`application/json`: [Hello](#schema-Hello).\n",
                      "A picture.\n\n`application/octet-stream`: string.\n\nHeader, then bytes.",
                      "| 0 | u32 | `magic` | WSPL |\n| 12 | u16 | `width` | pixels \\| columns |",
                      '### Hello {#schema-Hello}\n\n```json\n{\n "type"'):
            self.assertIn(words, text)


class Site(Folder):
    def test_documents_of_the_project_can_be_gathered(self):
        titles = sources.gather(ROOT, self.root / "out")
        self.assertEqual(titles["README.md"], "windsplat")
        self.assertGreater(len(titles), 35)

    def build(self, *options, program=None):
        if not shutil.which("mkdocs"):
            self.skipTest("mkdocs is not installed (scripts/setup test)")
        output = self.root / "site"
        run = subprocess.run([ROOT / "scripts/site", f"--program={program or PROGRAM}",
                              f"--output={output}", *options],
                             capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        return output

    def test_is_built_with_all_links_and_a_search_of_its_own(self):
        output = self.build()
        page = (output / DOCS / "user/deploy/proxies.html").read_text()
        self.assertIn('href="nginx.conf.html"', page)
        self.assertEqual((output / "docs/user/deploy/nginx.conf").read_text(),
                         (ROOT / "docs/user/deploy/nginx.conf").read_text())
        for script in ("main", "worker", "lunr"):
            self.assertTrue((output / f"search/{script}.js").exists(), script)
        index = json.loads((output / "search/search_index.json").read_text())["docs"]
        self.assertIn(f"{DOCS}/user/formats.html#staggered-grids",
                      [one["location"] for one in index])

    def test_has_references_of_what_the_program_serves(self):
        self.write("openapi.json", json.dumps(OPENAPI))
        self.write("asyncapi.json", json.dumps(ASYNCAPI))
        self.write("program", f"#!{sys.executable}\n{SERVER}".replace("FOLDER", str(self.root)))
        (self.root / "program").chmod(0o755)
        output = self.build(program=self.root / "program")
        page = html.unescape((output / "reference/rest.html").read_text())
        self.assertIn("GET /v1/fields/{id}</h3>", page)
        self.assertEqual(json.loads((output / "reference/openapi.json").read_text()), OPENAPI)
        page = html.unescape((output / "reference/stream.html").read_text())
        self.assertIn('id="message-hello"', page)
        self.assertIn('href="reference/stream.html"', (output / "index.html").read_text())
        self.assertEqual(json.loads((output / "reference/asyncapi.json").read_text()), ASYNCAPI)

    def test_headers_of_the_library_get_a_reference(self):
        if not shutil.which("doxygen"):
            self.skipTest("doxygen is not installed")
        self.write("headers/a.hpp", "#pragma once\n/// A thing.\nstruct Thing {\n"
                                    "  int size;  ///< Its size.\n};\n")
        output = self.build(f"--cpp-headers={self.root / 'headers'}")
        self.assertIn("Thing", (output / "reference/cpp/annotated.html").read_text())
        self.assertIn('href="reference/cpp.html"', (output / "index.html").read_text())

    def test_a_folder_that_is_no_site_is_left_alone(self):
        self.write("site/precious", "data")
        if not shutil.which("mkdocs"):
            self.skipTest("mkdocs is not installed (scripts/setup test)")
        run = subprocess.run([ROOT / "scripts/site", f"--output={self.root / 'site'}"],
                             capture_output=True, text=True, check=False)
        self.assertEqual((run.returncode, "is not a site" in run.stderr), (1, True), run.stderr)
        self.assertEqual((self.root / "site/precious").read_text(), "data")


if __name__ == "__main__":
    options = [one for one in sys.argv[1:] if one.startswith("--program=")]
    if options:
        PROGRAM = str(pathlib.Path(options[0].partition("=")[2]).resolve())
    unittest.main(argv=[sys.argv[0], *(one for one in sys.argv[1:] if one not in options)])
