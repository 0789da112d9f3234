#!/usr/bin/env python3
"""Runs the recipes of docs/user/deploy for nginx and Caddy: the server with the file of the
documents, in which only the port, the addresses of the daemon and the places of files are replaced,
in front of a daemon. Usage: proxies.py --server=nginx|caddy [--program=FILE]. Exit code 77: that
server, or openssl, is not installed."""
import argparse
import base64
import http.server
import json
import os
import pathlib
import re
import shutil
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests" / "edge"))
from wire_client import Connection, Daemon, Target, WebSocket, request  # noqa: E402
from wire_client import new_key, upgrade_request  # noqa: E402

RECIPES = ROOT / "docs/user/deploy"
NAME, USER, PASSWORD = "winds.example", "reader", "a password"
# As of `caddy hash-password`, but of 2^4 rounds instead of 2^14, which take a second.
BCRYPT_HASH = "$2b$04$twk/NG8tqHONfXzCQN0mf.IK.qJ8SGHK5db1APhEAthUe5cnEagNK"
ORIGIN = f"https://{NAME}"
SKIPPED = 77
NOBODY = 65534
REQUESTS_A_SECOND, BURST_S = 4, 10  # of an address
START_S = 30
PASSWORD_REMOVED = {"nginx": 'proxy_set_header   Authorization   "";',
                    "caddy": "header_up -Authorization"}
OAUTH_RECIPE = "nginx-oauth2.conf"
# What precedes the address of oauth2-proxy in it, for its pages and for its check of requests.
LOGIN_PAGE, LOGIN_CHECK = "        proxy_pass       ", "        proxy_pass              "
OPTIONS = argparse.Namespace()

NGINX_MAIN = """daemon off;
pid {folder}/nginx.pid;
error_log stderr warn;
events {{}}
http {{
    access_log off;
    client_body_temp_path {folder}/body;
    proxy_temp_path {folder}/proxy;
    fastcgi_temp_path {folder}/fastcgi;
    uwsgi_temp_path {folder}/uwsgi;
    scgi_temp_path {folder}/scgi;
    include {folder}/site.conf;
}}
"""
CADDY_MAIN = """{{
	admin off
	auto_https disable_redirects
	storage file_system {folder}/storage
}}
"""


def program_of(server):
    return shutil.which(server, path=os.environ.get("PATH", "") + ":/usr/sbin:/usr/local/sbin")


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def adapted(recipe, replacements):
    """The recipe with parts replaced, each of which it must contain once."""
    text = (RECIPES / recipe).read_text()
    for old, new in replacements.items():
        lines = [line for line in text.splitlines() if not line.strip().startswith("#")]
        if sum(line.count(old) for line in lines) != 1:
            raise AssertionError(f"{recipe} does not contain {old!r} once")
        text = "\n".join(line if line.strip().startswith("#") else line.replace(old, new)
                         for line in text.splitlines()) + "\n"
    return text


def password_hash(server):
    if server == "caddy":
        return BCRYPT_HASH
    return subprocess.run(["openssl", "passwd", "-apr1", "-stdin"], input=PASSWORD + "\n",
                          capture_output=True, text=True, check=True).stdout.strip()


class Proxy:
    """The server with its recipe, unprivileged, in front of the daemon at `upstream`: a port, or
    the words that the page has for a UNIX socket; `logins`: the port of what stands in for
    oauth2-proxy; `more`: a line beside that for Authorization."""

    def __init__(self, server, folder, upstream, recipe, logins=None, more=""):
        self.port = free_port()
        chain, key = folder / "chain.pem", folder / "key.pem"
        if not chain.exists():
            subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-nodes",
                            "-pkeyopt", "ec_paramgen_curve:prime256v1",
                            "-days", "2", "-subj", f"/CN={NAME}",
                            "-addext", f"subjectAltName=DNS:{NAME}",
                            "-keyout", key, "-out", chain], check=True, capture_output=True)
        daemon = upstream if isinstance(upstream, str) else f"127.0.0.1:{upstream}"
        if server == "nginx":
            replacements = {
                "server 127.0.0.1:8080;": f"server {daemon};",
                "    listen 443 ssl http2;": f"    listen 127.0.0.1:{self.port} ssl http2;",
                "    listen [::]:443 ssl http2;": "",
                "/etc/nginx/tls/chain.pem": str(chain), "/etc/nginx/tls/key.pem": str(key)}
            if logins:
                for before in (LOGIN_PAGE, LOGIN_CHECK):
                    replacements[f"{before}http://127.0.0.1:4180;"] = \
                        f"{before}http://127.0.0.1:{logins};"
            else:
                (folder / "users").write_text(f"{USER}:{password_hash(server)}\n")
                replacements["/etc/nginx/windsplat.htpasswd"] = str(folder / "users")
                replacements[PASSWORD_REMOVED["nginx"]] = PASSWORD_REMOVED["nginx"] + "\n" + more
            (folder / "site.conf").write_text(adapted(recipe, replacements))
            (folder / "nginx.conf").write_text(NGINX_MAIN.format(folder=folder))
            command = ["-c", folder / "nginx.conf", "-p", folder, "-e", "stderr"]
        else:
            site = adapted(recipe, {
                f"{NAME} {{": f"{ORIGIN}:{self.port} {{\n\tbind 127.0.0.1",
                "{$WINDSPLAT_UPSTREAM:127.0.0.1:8080}": daemon,
                "/etc/caddy/tls/chain.pem": str(chain), "/etc/caddy/tls/key.pem": str(key),
                PASSWORD_REMOVED["caddy"]: PASSWORD_REMOVED["caddy"] + "\n" + more,
                "$2a$14$HASH": password_hash(server)})
            (folder / "Caddyfile").write_text(CADDY_MAIN.format(folder=folder) + site)
            command = ["run", "--config", folder / "Caddyfile", "--adapter", "caddyfile"]
        user = {}
        if os.geteuid() == 0:
            user = {"user": NOBODY, "group": NOBODY, "extra_groups": []}
            for path in (folder, *folder.rglob("*")):
                os.chown(path, NOBODY, NOBODY)
        with open(folder / "log", "w", encoding="utf-8") as log:
            self.child = subprocess.Popen([program_of(server), *command], stderr=log, stdout=log,
                                          env={**os.environ, "HOME": str(folder)}, **user)
        self.log = folder / "log"
        self.tls = ssl.create_default_context(cafile=chain)
        self.await_start()

    def await_start(self):
        end = time.monotonic() + START_S
        while True:
            try:
                socket.create_connection(("127.0.0.1", self.port), 1).close()
                return
            except OSError:
                if self.child.poll() is not None or time.monotonic() > end:
                    self.stop()
                    raise AssertionError("the proxy did not start: " +
                                         self.log.read_text()[-2000:]) from None
                time.sleep(0.02)

    def stop(self):
        self.child.terminate()
        self.child.wait()


class Visitor(Target):
    """A client of the proxy by its public name, from an address of this machine."""

    def __init__(self, proxy, password=PASSWORD, source="127.0.0.1"):
        super().__init__("127.0.0.1", proxy.port, proxy.tls, base="/winds/")
        self.password, self.source, self.name = password, source, NAME

    def authority(self):
        return self.name

    def authorization(self):
        if self.password is None:
            return ""
        pair = base64.b64encode(f"{USER}:{self.password}".encode()).decode()
        return f"Authorization: Basic {pair}\r\n"

    def connect(self, timeout=20, receive_buffer=0):
        plain = socket.create_connection((self.host, self.port), timeout, (self.source, 0))
        plain.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return self.tls.wrap_socket(plain, server_hostname=NAME)


class Recorder(http.server.BaseHTTPRequestHandler):
    """In place of the daemon: keeps what arrives there."""
    protocol_version = "HTTP/1.1"
    seen = []

    def log_message(self, *_):
        pass

    def do_GET(self):
        self.seen.append((self.path, self.headers))
        self.send_response(200)
        self.send_header("Content-Length", "0")
        self.end_headers()


def folder_of_test(kind):
    one = tempfile.TemporaryDirectory(prefix="windsplat-proxy-")
    folder = pathlib.Path(one.name) / kind  # the parent belongs to this user, who removes it
    folder.mkdir()
    os.chmod(one.name, 0o711)
    return one, folder


def recipe_of_server():
    return "nginx.conf" if OPTIONS.server == "nginx" else "Caddyfile"


def options_of(recipe):
    """The daemon's options in the comment at the head of the recipe, but for the address."""
    head = (RECIPES / recipe).read_text().replace("\\\n#", " ")
    words = re.search(r"windsplat serve winds\.nc (.*)", head)[1].split()
    assert words[:2] == ["--listen", "127.0.0.1:8080"], words
    return words[2:]


def start_daemon(case, options):
    """The daemon with the options of a recipe, a low limit of requests, and the file of its log."""
    log = tempfile.NamedTemporaryFile("w+", prefix="windsplat-proxy-", suffix=".log")
    case.addClassCleanup(log.close)
    daemon = Daemon(OPTIONS.program, "tornado:32", *options,
                    f"--max-requests-per-address={REQUESTS_A_SECOND}", errors=log)
    case.addClassCleanup(daemon.stop)
    case.addClassCleanup(daemon.child.stdout.close)
    return daemon, pathlib.Path(log.name)


def comes_in(log, words):
    """Whether the log soon has these words: lines may follow the answers."""
    end = time.monotonic() + START_S
    while words not in log.read_text():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


def statuses_until_refused(visitor, fields):
    """The statuses of many requests, until one gets 429; `fields(number)`: more header lines."""
    statuses = []
    with Connection(visitor) as connection:
        for number in range(4 * REQUESTS_A_SECOND * BURST_S):
            connection.raw(f"GET /winds/v1 HTTP/1.1\r\nHost: {NAME}\r\n"
                           f"{visitor.authorization()}{fields(number)}\r\n".encode())
            statuses.append(connection.answer().status)
            if statuses[-1] == 429:
                break
    return statuses


class Recipe(unittest.TestCase):
    """The server in front of a daemon that is started as the recipe says."""

    @classmethod
    def setUpClass(cls):
        temporary, cls.folder = folder_of_test("daemon")
        cls.addClassCleanup(temporary.cleanup)
        cls.daemon, cls.log = start_daemon(cls, cls.options())
        cls.proxy = Proxy(OPTIONS.server, cls.folder, cls.upstream(), recipe_of_server())
        cls.addClassCleanup(cls.proxy.stop)

    @classmethod
    def options(cls):
        return options_of(recipe_of_server())

    @classmethod
    def upstream(cls):
        return cls.daemon.port

    def test_serves_the_page_and_its_files_below_the_path(self):
        visitor = Visitor(self.proxy)
        plain = {"Accept-Encoding": "identity"}  # else Caddy asks for gzip and unpacks it
        page = request(visitor, "GET", "", plain)
        self.assertEqual((page.status, page.header("Content-Type")[:9]), (200, "text/html"))
        files = [name for name in re.findall(r'(?:src|href)="([^"#:]+)"', page.body.decode())
                 if not name.startswith("/")]
        self.assertTrue(files, "the page names its files relative to itself")
        for name in files[:3]:
            answer = request(visitor, "GET", name.removeprefix("./"), plain)
            self.assertEqual(answer.status, 200, name)

    def test_the_path_without_its_slash_leads_to_the_page(self):
        visitor = Visitor(self.proxy, None)
        visitor.base = "/"
        answer = request(visitor, "GET", "winds")
        self.assertEqual(answer.status, 308)
        self.assertTrue(answer.header("Location").endswith("/winds/"), answer.head)

    def test_serves_pictures_by_rest(self):
        picture = request(Visitor(self.proxy), "GET",
                          "v1/datasets/tornado:32/frame.jpg?width=64&height=48")
        self.assertEqual((picture.status, picture.body[:2]), (200, b"\xff\xd8"), picture.body[:300])
        view = {"dataset": "tornado:32", "image": {"width": 64, "height": 48}}
        posted = request(Visitor(self.proxy), "POST", "v1/frames",
                         {"Content-Type": "application/json", "Origin": ORIGIN},
                         json.dumps(view).encode())
        self.assertEqual((posted.status, posted.body[:2]), (200, b"\xff\xd8"), posted.body[:300])

    def test_streams_frames_by_websocket(self):
        with WebSocket(Visitor(self.proxy)) as stream:
            stream.text("hello")
            stream.say({"type": "patch", "rev": 1, "patch": {
                "dataset": "tornado:32", "image": {"width": 64, "height": 48}}})
            while True:
                opcode, message = stream.message()
                if opcode == 2:
                    break
            self.assertEqual(message[:4], b"WSPL")

    def upgrade(self, origin, visitor):
        with Connection(visitor) as connection:
            connection.raw(upgrade_request(visitor.authority(), new_key(), "/winds/v1/stream",
                                           fields=visitor.authorization() +
                                           f"Origin: {origin}\r\n"))
            return connection.answer().status

    def test_accepts_streams_of_its_own_pages_only(self):
        self.assertEqual(self.upgrade(ORIGIN, Visitor(self.proxy)), 101)
        self.assertEqual(self.upgrade("https://other.example", Visitor(self.proxy)), 403)

    def test_pages_on_another_port_than_443_may_post_and_stream(self):
        visitor = Visitor(self.proxy)
        visitor.name = f"{NAME}:{self.proxy.port}"
        view = {"dataset": "tornado:32", "image": {"width": 64, "height": 48}}
        for origin, posted, upgraded in ((f"https://{visitor.name}", 200, 101), (ORIGIN, 403, 403)):
            answer = request(visitor, "POST", "v1/frames",
                             {"Content-Type": "application/json", "Origin": origin},
                             json.dumps(view).encode())
            self.assertEqual(answer.status, posted, answer.body[:300])
            self.assertEqual(self.upgrade(origin, visitor), upgraded, origin)

    def test_refuses_visitors_without_the_password(self):
        for password in (None, "wrong"):
            visitor = Visitor(self.proxy, password)
            for path in ("", "v1/datasets", "v1/datasets/tornado:32/frame.jpg"):
                self.assertEqual(request(visitor, "GET", path).status, 401, path)
            self.assertEqual(self.upgrade(ORIGIN, visitor), 401)

    def test_keeps_metrics_from_visitors(self):
        self.assertEqual(request(Visitor(self.proxy), "GET", "metrics").status, 403)

    def test_limits_count_for_each_client_whatever_it_writes_in_the_header(self):
        greedy = Visitor(self.proxy, source="127.0.0.2")
        statuses = statuses_until_refused(
            greedy, lambda number: f"X-Forwarded-For: 192.0.2.{number}\r\n")
        self.assertEqual(statuses[0], 200)
        self.assertEqual(statuses[-1], 429, f"after {len(statuses)} requests")
        other = Visitor(self.proxy, source="127.0.0.3")
        self.assertEqual(request(other, "GET", "v1").status, 200)
        self.assertTrue(comes_in(self.log, "client=127.0.0.2 "))
        self.assertTrue(comes_in(self.log, "client=127.0.0.3 "))
        self.assertNotIn("192.0.2.", self.log.read_text())


class OnASocket(Recipe):
    """The same over a UNIX socket, as the page tells it."""

    PATH = "/run/windsplat/windsplat.sock"

    @classmethod
    def options(cls):
        page = (RECIPES / "proxies.md").read_text().replace("\\\n", " ")
        words = re.search(rf"windsplat serve winds\.nc (--listen unix:{cls.PATH} .*)", page)[1]
        own = words.replace(cls.PATH, str(cls.folder.parent / "daemon.sock")).split()
        assert "--listen-mode" not in own, "the default is 0660"
        return [*own, "--listen-mode=0666"]  # here the proxy is in no group of the daemon's user

    @classmethod
    def upstream(cls):
        page = (RECIPES / "proxies.md").read_text()
        line, = re.findall(rf"^\| {recipe_of_server()} \| `(.*unix.*)` \|$", page, re.M)
        line = line.replace(cls.PATH, str(cls.folder.parent / "daemon.sock"))
        return re.fullmatch(r"(?:server|reverse_proxy) (.+?)(?:;| \{)", line)[1]


class Forwarded(unittest.TestCase):
    """What arrives behind the proxy."""

    def seen_with(self, more):
        """Path and headers of a request by 127.0.0.2 that tries to pass for another."""
        upstream = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Recorder)
        threading.Thread(target=upstream.serve_forever, daemon=True).start()
        temporary, folder = folder_of_test("recorder")
        proxy = Proxy(OPTIONS.server, folder, upstream.server_port, recipe_of_server(), more=more)
        Recorder.seen.clear()
        try:
            request(Visitor(proxy, source="127.0.0.2"), "GET", "v1?x=%2F",
                    {"X-Forwarded-For": "192.0.2.1", "X-Forwarded-User": "eve"})
        finally:
            proxy.stop()
            upstream.shutdown()
            upstream.server_close()
            temporary.cleanup()
        seen, = Recorder.seen
        return seen

    def test_the_daemon_gets_the_clients_address_and_no_password(self):
        path, headers = self.seen_with("")
        self.assertEqual(path, "/winds/v1?x=%2F")
        self.assertEqual(headers.get_all("Host"), [NAME])
        self.assertEqual(headers.get_all("X-Forwarded-For"), ["127.0.0.2"])
        self.assertIn(headers.get("Authorization", ""), [""])

    def test_the_line_of_the_page_names_the_user_of_the_password(self):
        page = (RECIPES / "proxies.md").read_text()
        line, = re.findall(rf"^\| {recipe_of_server()} \| `(.* X-Forwarded-User .*)` \|$", page,
                           re.M)
        self.assertEqual(self.seen_with(line)[1].get_all("X-Forwarded-User"), [USER])


class Logins(http.server.BaseHTTPRequestHandler):
    """In place of oauth2-proxy: a cookie names the user, whom the answer to a check repeats."""
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def do_GET(self):
        user = (self.headers["Cookie"] or "").partition("_oauth2_proxy=")[2]
        check = self.path == "/oauth2/auth"
        body = b"" if check else b"log in here"
        self.send_response(200 if not check else 202 if user else 401)
        if check and user:
            self.send_header("X-Auth-Request-User", user)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)


class LoggedIn(Visitor):
    """A client with the cookie of a login."""

    def authorization(self):
        return f"Cookie: _oauth2_proxy={self.password}\r\n" if self.password else ""


class Users(unittest.TestCase):
    """nginx with logins of oauth2-proxy: users instead of addresses."""

    @classmethod
    def setUpClass(cls):
        if OPTIONS.server != "nginx":
            raise unittest.SkipTest("the recipe is for nginx")
        logins = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Logins)
        threading.Thread(target=logins.serve_forever, daemon=True).start()
        cls.addClassCleanup(logins.server_close)
        cls.addClassCleanup(logins.shutdown)
        cls.daemon, cls.log = start_daemon(cls, options_of(OAUTH_RECIPE))
        temporary, folder = folder_of_test("users")
        cls.addClassCleanup(temporary.cleanup)
        cls.proxy = Proxy("nginx", folder, cls.daemon.port, OAUTH_RECIPE, logins.server_port)
        cls.addClassCleanup(cls.proxy.stop)

    def test_only_those_who_are_logged_in_are_served(self):
        page = request(LoggedIn(self.proxy, None), "GET", "")
        self.assertEqual((page.status, page.body), (403, b"log in here"))
        self.assertEqual(request(LoggedIn(self.proxy, None), "GET", "v1").status, 401)
        for path in ("", "v1", "v1/datasets/tornado:32/frame.jpg?width=64&height=48"):
            self.assertEqual(request(LoggedIn(self.proxy, "cleo"), "GET", path).status, 200, path)
        WebSocket(LoggedIn(self.proxy, "cleo")).close()
        with self.assertRaises(RuntimeError):
            WebSocket(LoggedIn(self.proxy, None))

    def test_limits_count_for_users_and_the_log_names_them(self):
        ada = LoggedIn(self.proxy, "ada", "127.0.0.2")
        statuses = statuses_until_refused(ada, lambda number: "X-Forwarded-User: eve\r\n")
        self.assertEqual((statuses[0], statuses[-1]), (200, 429))
        elsewhere = LoggedIn(self.proxy, "ada", "127.0.0.3")
        self.assertEqual(request(elsewhere, "GET", "v1").status, 429)
        beside = LoggedIn(self.proxy, "bob", "127.0.0.2")
        self.assertEqual(request(beside, "GET", "v1").status, 200)
        self.assertTrue(comes_in(self.log, "client=user:ada "))
        self.assertTrue(comes_in(self.log, "client=user:bob "))
        self.assertNotIn("eve", self.log.read_text())


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--server", choices=["nginx", "caddy"], required=True)
    parser.add_argument("--program", default=str(ROOT / "build/release/windsplat"))
    parser.parse_known_args(namespace=OPTIONS)
    for needed in (OPTIONS.server, "openssl"):
        if not program_of(needed):
            print(f"skipped: {needed} is not installed (apt-get install {needed})")
            return SKIPPED
    rest = [one for one in sys.argv[1:] if not one.startswith(("--server", "--program"))]
    result = unittest.main(argv=[sys.argv[0], *rest], exit=False).result
    return 0 if result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
