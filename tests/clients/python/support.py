"""One server for the tests of the Python client, and a server of prepared answers."""
import atexit
import http.server
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import threading

ROOT = pathlib.Path(__file__).resolve().parents[3]
CLIENT = ROOT / "clients" / "python"
sys.path.insert(0, str(CLIENT))
PROGRAM = os.environ.setdefault("WINDSPLAT", str(ROOT / "build" / "release" / "windsplat"))

import windsplat  # noqa: E402

SAMPLES = ("tornado:24", "climate:48x24x8")
_shared = []


def start(*files, **options):
    return windsplat.Server.start(*files, program=PROGRAM, threads=2, **options)


def takes_uploads():
    """Whether the daemon takes files of clients."""
    words = subprocess.run([PROGRAM, "serve", "--help"], text=True, capture_output=True, check=True)
    return "--upload-limit" in words.stdout


def shared_server():
    """A server of the samples with a data root, which ends with the tests. Returns it and the
    folder."""
    if not _shared:
        folder = tempfile.TemporaryDirectory()
        server = start(*SAMPLES, data_root=folder.name)
        atexit.register(folder.cleanup)
        atexit.register(server.close)
        _shared.extend((server, pathlib.Path(folder.name)))
    return tuple(_shared)


def problem(status, **more):
    return {"type": "about:blank", "title": "Refused", "status": status, "detail": "no", **more}


class Prepared:
    """A server that gives prepared answers (status, headers, document) and then repeats the last
    one; `requests` are the methods and targets that it got, `bodies` and `headers` what came with
    them."""

    def __init__(self, *answers):
        self.requests, self.bodies, self.headers = [], [], []
        outer, left = self, list(answers)

        class Handler(http.server.BaseHTTPRequestHandler):
            def answer(self):
                outer.requests.append(f"{self.command} {self.path}")
                outer.bodies.append(self.rfile.read(int(self.headers.get("Content-Length", 0))))
                outer.headers.append(dict(self.headers))
                status, headers, document = left.pop(0) if len(left) > 1 else left[0]
                body = document if isinstance(document, bytes) else json.dumps(document).encode()
                self.send_response(status)
                for name, value in {**headers, "Content-Length": len(body)}.items():
                    self.send_header(name, str(value))
                self.end_headers()
                self.wfile.write(body)

            do_GET = do_POST = do_PUT = do_DELETE = answer

            def log_message(self, *_):
                pass

        self._server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self._server.server_port}/"
        threading.Thread(target=self._server.serve_forever, args=(0.01,), daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._server.shutdown()
        self._server.server_close()
