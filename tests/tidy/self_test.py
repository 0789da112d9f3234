#!/usr/bin/env python3
"""Creates one violation at a time in a small tree; the checkers must report exactly that one."""
import pathlib
import tempfile
import unittest

import check_includes
import check_links
import check_local_names
import check_routes
import check_spelling
import check_style
import check_web_imports

CLEAN = {
    "server/base/error.hpp": "#pragma once\n#include <string>\n",
    "server/data/model/volume.hpp": '#pragma once\n#include "server/base/error.hpp"\n',
    "server/data/formats/file.cpp":
        '#include <netcdf.h>\n\n#include "server/data/model/volume.hpp"\n',
    "server/scene/scene.hpp": '#pragma once\n#include "server/data/model/volume.hpp"\n',
    "server/scene/camera.hpp": "#pragma once\n",
    "server/engine/bin.cpp": '#include "server/scene/scene.hpp"\n',
    "server/transport/server.hpp": "#pragma once\n",
    "server/transport/listener.cpp": "#include <boost/asio.hpp>\n",
    "protocol/codec_view.cpp": "#include <nlohmann/json.hpp>\n",
    "tests/CMakeLists.txt": "windsplat_test(unit_base unit/base unit windsplat_base)\n",
    "tests/unit/base/error_test.cpp": "TEST(Error, NamesTheCause) {\n}\n",
    "web/src/base/text.ts": "export const text = 1;\n",
    "web/src/view/link.ts": 'import type { View } from "@windsplat/client";\n',
    "web/src/app/app.ts": 'import {\n  link,\n} from "../view/link";\nimport "../base/text";\n',
    "clients/js/src/wire/api.ts": 'import type { View } from "../generated/view";\n',
    "clients/js/src/index.ts": 'export * from "./wire/api";\n',
    "web/src/styles/base.css": "p {}\n",
    "web/report/text.ts": 'import type { Study } from "../generated/study";\n',
    "web/report/main.ts": 'import { short } from "./text";\n',
    "README.md": "Reads /usr/share and /tmp; see https://example.org/home/here.\n",
}


class Planted(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        for path, content in CLEAN.items():
            self.plant(path, content)

    def plant(self, path, content):
        file = self.root / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(content)

    def expect(self, checker, *said):
        complaints = checker.check(self.root)
        self.assertEqual(len(complaints), len(said), complaints)
        for complaint, part in zip(complaints, said):
            self.assertIn(part, complaint)

    def test_tests_that_run_nowhere(self):
        self.plant("tests/unit/net/a_test.cpp", "TEST(A, IsTrue) {\n}\n")
        self.expect(check_style, "tests/unit/net/a_test.cpp: not in a folder")
        self.plant("tests/CMakeLists.txt", "windsplat_test(unit_base unit/base LABEL unit)\n"
                   "windsplat_test(unit_net unit/net LABEL unit ASAN *\n  LINK a)\n")
        self.expect(check_style)
        self.plant("tests/unit/net/a_test.cpp",
                   "TEST(A, IsTrue) {\n#ifndef WINDSPLAT_SANITIZED\n#endif\n}\n")
        self.expect(check_style, "unit_net runs under sanitizers only")
        for suite, said in (("B.*:A.*", ()), ("B.*", ("unit_net runs under sanitizers only",))):
            self.plant("tests/CMakeLists.txt",
                       "windsplat_test(unit_base unit/base LABEL unit)\nwindsplat_test(unit_net"
                       f" unit/net LABEL unit RELEASE {suite} ASAN -C.*\n  LINK a)\n")
            self.expect(check_style, *said)

    def test_clean_tree_passes(self):
        self.expect(check_includes)
        self.expect(check_style)
        self.expect(check_spelling)
        self.expect(check_web_imports)

    def test_import_against_the_order_of_web_folders(self):
        self.plant("web/src/base/dom.ts", '\nexport { link } from "../view/link";\n')
        self.plant("clients/js/src/base/a.ts", 'import { api } from "../wire/api";\n')
        self.expect(check_web_imports, "base/a.ts:1: base may not import clients/js/src/wire/api",
                    "base/dom.ts:2: base may not import web/src/view/link")

    def test_imports_around_the_modules_of_the_client(self):
        self.plant("web/src/app/a.ts", 'import { api } from "@windsplat/client/wire/api";\n')
        self.plant("web/src/app/b.ts", 'import { api } from "../../../clients/js/src/wire/api";\n')
        self.plant("clients/js/src/view/a.ts", 'import { api } from "@windsplat/client";\n')
        self.plant("clients/js/src/view/b.ts", 'import "../../../../web/src/view/link";\n')
        self.expect(check_web_imports, "clients/js/src/index is no file of clients/js/src",
                    "view/b.ts:1: web/src/view/link is no file of clients/js/src",
                    "app/a.ts:1: clients/js/src/wire/api is no file of web/src",
                    "app/b.ts:1: clients/js/src/wire/api is no file of web/src")

    def test_cyclic_imports(self):
        self.plant("web/src/view/a.ts", 'import type { B } from "./b";\n')
        self.plant("web/src/view/b.ts", 'import { c } from "./c";\n')
        self.plant("web/src/view/c.ts", 'const a = await import("./a");\n')
        self.expect(check_web_imports, "view/a -> web/src/view/b -> web/src/view/c -> web/src/view")

    def test_web_file_outside_its_folder(self):
        self.plant("web/src/main.ts", "\n")
        self.plant("web/src/extra/a.ts", "\n")
        self.plant("web/src/save/a.ts", 'import { run } from "../../scripts/build";\n')
        self.expect(check_web_imports, "main.ts: belongs in a folder", "extra/a.ts: no rule",
                    "web/scripts/build is no file of web/src")

    def test_imports_of_the_report(self):
        self.plant("web/report/a.ts", 'import { text } from "../src/base/text";\n')
        self.plant("web/report/b.ts", 'import { c } from "./c";\n')
        self.plant("web/report/c.ts", 'import { b } from "./b";\n')
        self.expect(check_web_imports, "web/report/a.ts:1: the report may not import web/src/base",
                    "web/report/b -> web/report/c -> web/report/b")

    def test_web_folder_with_too_many_files(self):
        for n in range(check_web_imports.MAX_FILES):
            self.plant(f"web/src/base/f{n}.ts", "\n")
        self.expect(check_web_imports, "web/src/base: 31 files")

    def test_local_functions_that_a_call_could_confuse(self):
        local = "namespace {{\nint f({}) {{\n}}\n}}  // namespace\n"
        self.plant("server/data/cf/a.cpp", local.format("const std::string& text, double x"))
        for other in ("Box box, double x", "std::string text"):
            self.plant("server/data/cf/b.cpp", local.format(other))
            self.expect(check_local_names)
        self.plant("server/scene/b.cpp", local.format("const char* text, int n"))
        self.expect(check_local_names)
        self.plant("server/data/open/b.cpp", local.format("const char* text, int n"))
        self.expect(check_local_names, "server/data/open/b.cpp:2: f is also a function of server/d")

    def test_misspelled_word(self):
        wrong = "rec" + "ieved"
        self.plant("server/base/queue.hpp", f"// What was {wrong}.\n")
        self.expect(check_spelling, f"server/base/queue.hpp:1: {wrong} ==> received")

    def test_include_against_the_direction(self):
        self.plant("server/base/pool.hpp", '#include "server/scene/scene.hpp"\n')
        self.expect(check_includes, "server/base may not include server/scene/scene.hpp")

    def test_engine_includes_scene_types_only(self):
        self.plant("server/engine/tile.cpp", '\n#include "server/scene/camera.hpp"\n')
        self.expect(check_includes, "server/engine/tile.cpp:2: server/engine may not include")

    def test_subfolder_obeys_its_parent(self):
        self.plant("server/engine/kernels/k.cpp", '#include "server/transport/server.hpp"\n')
        self.expect(check_includes, "server/engine may not include server/transport/server.hpp")

    def test_library_header_outside_its_folder(self):
        for path, header in [("protocol/view.cpp", "nlohmann/json.hpp"),
                             ("server/scene/s.cpp", "netcdf.h"),
                             ("server/data/d.cpp", "seccomp.h"),
                             ("server/frame/f.cpp", "turbojpeg.h"),
                             ("server/frame/f.cpp", "png.h"),
                             ("server/session/s.cpp", "boost/beast/core.hpp"),
                             ("server/cli/c.cpp", "boost/asio.hpp"),
                             ("server/api/n.cpp", "CLI/CLI.hpp")]:
            with self.subTest(header):
                self.plant(path, f"#include <{header}>\n")
                self.expect(check_includes, f"{path}:1: {header} may not be named here")
                (self.root / path).unlink()

    def test_library_header_through_a_project_header(self):
        self.plant("protocol/codec_json.hpp", "#include <nlohmann/json.hpp>\n")
        self.plant("protocol/codec_read.cpp", '#include "protocol/codec_json.hpp"\n')
        self.expect(check_includes)
        self.plant("protocol/codec_deep.hpp", '#include "protocol/codec_json.hpp"\n')
        self.plant("server/scene/s.cpp", '#include "protocol/codec_deep.hpp"\n')
        self.expect(check_includes, "s.cpp:1: protocol/codec_deep.hpp brings nlohmann/")

    def test_tests_may_include_a_neighbour(self):
        self.plant("tests/protocol/support.hpp", "#pragma once\n")
        self.plant("tests/protocol/a_test.cpp", '#include "support.hpp"\n')
        self.expect(check_includes)

    def test_own_header_in_angle_brackets_or_by_a_short_name(self):
        self.plant("server/data/a.cpp", "#include <server/data/model/volume.hpp>\n")
        self.plant("server/data/b.cpp", '#include "volume.hpp"\n')
        self.expect(check_includes, "is our own", "is no file of the project")

    def test_table_of_dependencies(self):
        rows = "|---|---|\n| `a` | |\n| `b` | `a`, `c/d.hpp` |\n\n| `e` | `a` |\n"
        self.assertEqual(check_includes.dependencies(check_includes.TABLE_HEAD + "\n" + rows),
                         {"a": [], "b": ["a", "c/d.hpp"]})
        self.assertEqual(check_includes.dependencies(rows), {})

    def test_new_folder_needs_a_rule(self):
        self.plant("server/extra/e.cpp", '#include "server/base/error.hpp"\n')
        self.expect(check_includes, "has no row for this folder")

    def test_long_line_function_and_file(self):
        self.plant("server/base/a.cpp", "//" + "x" * 99 + "\n")
        body = "  g();\n" * 90
        self.plant("server/base/b.cpp", "void f(int a,\n       int b) {\n" + body + "}\n")
        self.plant("server/base/c.cpp", "class C {\n  void f() {\n" + body + "  }\n};\n")
        self.plant("server/base/d.cpp", "int x;\n" * 700)
        self.expect(check_style, "a.cpp:1: 101 columns", "b.cpp:1: a function of 93 lines",
                    "c.cpp:2: a function of 92 lines", "d.cpp: 700 lines")

    def test_file_of_many_bytes(self):
        self.plant("pictures/a.bin", "x" * check_style.MAX_FILE_BYTES)
        self.expect(check_style)
        self.plant("pictures/a.bin", "x" * (check_style.MAX_FILE_BYTES + 1))
        self.expect(check_style, "pictures/a.bin: 1048577 bytes")

    def test_folder_of_many_files(self):
        for n in range(check_style.MAX_FOLDER_FILES):
            self.plant(f"server/extra/f{n}.hpp", "#pragma once\n")
        self.expect(check_style)
        self.plant("server/extra/more.hpp", "#pragma once\n")
        self.expect(check_style, "server/extra: 31 files")

    def test_class_of_many_members(self):
        # Not counted: constructors, deleted functions, constants, nested types, bodies.
        begin = ("template <class T>\nclass C final : public B {\n public:\n  explicit C(int a)"
                 " : a_{a}, b_(a) {}\n  ~C() override = default;\n  C(const C&) = delete;\n"
                 "  using X = int;\n  static constexpr int most = 3;\n  enum class K { a, b };\n"
                 "  struct Plain {\n    int x = 0;\n  };\n"
                 "  int get() const {\n    return '}' + a_;  // };\n  }\n private:\n")
        data = "  std::function<void(int, K)> f{};\n" * (check_style.MAX_CLASS_MEMBERS - 2)
        operator = "  bool operator==(const C&) const = default;\n"
        self.plant("server/base/a.hpp", begin + data + operator + "};\n")
        self.plant("server/base/b.hpp", "struct Document {\n" + data * 2 + "};\n")
        self.expect(check_style)
        self.plant("server/base/a.hpp", begin + data + operator + "  int a_ = g({1});\n};\n")
        self.expect(check_style, "a.hpp:2: C has 26 members")

    def test_exception_for_a_class_that_is_no_longer_large(self):
        path, name = next(iter(check_style.LARGE_CLASSES))
        self.plant(path, f"class {name} {{\n  void f();\n}};\n")
        self.expect(check_style, f"{name} is no longer an exception")

    def test_short_functions_in_a_long_namespace_pass(self):
        body = "void f() {\n" + "  g();\n" * 40 + "}\n"
        self.plant("server/base/a.cpp", "namespace a {\n" + body * 10 + "}  // namespace a\n")
        self.expect(check_style)
        self.expect(check_spelling)

    def test_wording(self):
        self.plant("server/base/a.cpp", "// TO" + "DO: later\n")
        self.plant("docs/b.md", "Look into /ho" + "me/me/notes.\n")
        self.expect(check_style, "docs/b.md:1: a path", "server/base/a.cpp:1: a note")

    def test_links_and_anchors(self):
        self.plant("docs/a.md", "# One `b` (c)\n## Two\n## Two\n[b](b.md#x-y) [c](#one-b-c)\n"
                   "[d](#two-1) [e](https://example.org/none.md) ![f](../README.md)\n"
                   "```\n[none](in-code.md)\n# no-heading\n```\n")
        self.plant("docs/b.md", "# X, y\n")
        self.plant("server/base/a.cpp", "// docs/b.md, \"X, y\"\n")
        self.expect(check_links)
        self.plant("docs/c.md", "[a](gone.md)\n\n[b](b.md#z) [c](a.md#no-heading)\n")
        self.plant("server/base/a.cpp", "// see docs/d.md\n// ARCHITECTURE.md\n")
        self.expect(check_links, "docs/c.md:1: gone.md", "docs/c.md:3: b.md#z", "#no-heading",
                    "a.cpp:1: docs/d.md", "a.cpp:2: ARCHITECTURE.md")

    def test_route_without_documentation(self):
        self.plant("docs/user/api.md",
                   "| `GET /v1/a`, `POST /v1/a` | x |\n| `GET /v1/{b}/c?d=` | y |\n")
        self.plant("server/api/routes.cpp",
                   'Route{"GET", "/v1/a", f}, Route{"GET", "/v1/{b}/c", f}\n')
        self.expect(check_routes)
        self.plant("server/api/routes.cpp", 'Route{"PUT", "/v1/a", f}, Route{"GET", "/v1", f}\n'
                   'Route{method, "/v1/a", f}\n')
        self.expect(check_routes, "a route is not in the form", "PUT /v1/a", "GET /v1")

    def test_name_of_a_test_in_snake_case(self):
        self.plant("tests/unit/base/a_test.cpp",
                   "TEST_F(Pool, runs_once) {\n}\nTEST(Pool,\n     endsLate) {\n}\n")
        self.expect(check_style, "a_test.cpp:1: test name Pool.runs_once",
                    "a_test.cpp:3: test name Pool.endsLate")

    def test_folder_of_tests_without_a_test(self):
        self.plant("tests/unit/base/error_test.cpp", "// nothing yet\n")
        (self.root / "tests" / "numerics").mkdir()
        self.expect(check_style, "tests/unit/base: no test in it",
                    "tests/numerics: an empty folder")


if __name__ == "__main__":
    unittest.main()
