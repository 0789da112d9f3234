"""Shared by the fault scripts: a daemon with its log, requests, a stream at the byte level, and
/proc entries of a process. Standard library only. Linux only."""
import collections
import http.client
import json
import os
import pathlib
import signal
import socket
import ssl
import struct
import subprocess
import sys
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests" / "edge"))
from wire_client import NO_MASK, frame, new_key, upgrade_request  # noqa: E402

FINAL = 1  # bit of the frame header's flags
KIB, MIB = 1024, 1024 * 1024
SAMPLE = "tornado:24x24x24"  # a dataset, and its id
START_S = 60  # sanitizers and a loaded machine start slowly
PATIENCE_S = 60


class Failed(Exception):
    """A violated requirement."""


class Untried(Exception):
    """A tool or permission is missing: nothing was tested."""


Answer = collections.namedtuple("Answer", "status headers body")
# The location of a daemon: its address, a TLS context or None, a token or None.
Door = collections.namedtuple("Door", "host port tls token", defaults=(None, None))


def door_of(port):
    """The Door of a `port` argument, which is a Door or a port number on 127.0.0.1."""
    return port if isinstance(port, Door) else Door("127.0.0.1", port)


def need(condition, words):
    if not condition:
        raise Failed(words)


def wait_for(condition, seconds, words):
    """Polls the condition; returns its first true value."""
    end = time.monotonic() + seconds
    while True:
        got = condition()
        if got:
            return got
        need(time.monotonic() < end, f"{words}: not within {seconds:g} s")
        time.sleep(0.02)


class Daemon:
    """A daemon on a free port. A thread reads its log line by line."""

    def __init__(self, program, *arguments, env=None, prepare=None, must_start=True,
                 listen="127.0.0.1:0"):
        self.lines = []
        self.child = subprocess.Popen(
            [program, "serve", "--listen", listen, *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=env, preexec_fn=prepare)
        self.reader = threading.Thread(target=self.read_log, daemon=True)
        self.reader.start()
        self.port = self.read_port()
        if must_start and self.port is None:
            self.stop(signal.SIGKILL)
            raise Failed(f"the daemon did not start: {' / '.join(self.lines[-3:])}")

    def read_log(self):
        for line in self.child.stderr:
            self.lines.append(line.decode(errors="surrogateescape").rstrip("\n"))

    def read_port(self):
        watch = threading.Timer(START_S, self.child.kill)
        watch.start()
        line = self.child.stdout.readline().decode()
        watch.cancel()
        return int(line.rstrip().rstrip("/").rsplit(":", 1)[1]) if line else None

    @property
    def pid(self):
        return self.child.pid

    def alive(self):
        return self.child.poll() is None

    def log(self):
        return "\n".join(self.lines)

    def stop(self, how=signal.SIGTERM, patience=PATIENCE_S):
        """Stops the daemon; returns the exit code."""
        if self.alive():
            self.child.send_signal(how)
        try:
            code = self.child.wait(patience)
        except subprocess.TimeoutExpired as slow:
            self.child.kill()
            self.child.wait()
            raise Failed(f"the daemon did not end within {patience} s") from slow
        self.reader.join(5)
        self.child.stdout.close()
        self.child.stderr.close()
        return code


# --- /proc ---------------------------------------------------------------------------------------

def status_number(pid, key):
    for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith(key + ":"):
            return int(line.split()[1])
    raise KeyError(key)


def rss(pid):
    return KIB * status_number(pid, "VmRSS")


def threads(pid):
    return status_number(pid, "Threads")


def open_files(pid):
    return len(os.listdir(f"/proc/{pid}/fd"))


def cpu_s(pid):
    """Processor seconds of all its running threads."""
    total = 0
    for task in os.listdir(f"/proc/{pid}/task"):
        try:
            total += int(pathlib.Path(f"/proc/{pid}/task/{task}/schedstat").read_text().split()[0])
        except (FileNotFoundError, ProcessLookupError):
            continue  # a thread that has just ended
    return total * 1e-9


# --- HTTP ----------------------------------------------------------------------------------------

def ask(port, method, target, body=None, headers=None, timeout=PATIENCE_S):
    door = door_of(port)
    connection = (
        http.client.HTTPSConnection(door.host, door.port, timeout=timeout, context=door.tls)
        if door.tls else http.client.HTTPConnection(door.host, door.port, timeout=timeout))
    try:
        if isinstance(body, (dict, list)):
            body = json.dumps(body)
        given = dict(headers or {})
        if body is not None and "Content-Type" not in given:
            given["Content-Type"] = "application/json"
        if door.token:
            given.setdefault("Authorization", f"Bearer {door.token}")
        connection.request(method, target, body, given)
        answer = connection.getresponse()
        return Answer(answer.status, dict((k.lower(), v) for k, v in answer.getheaders()),
                      answer.read())
    finally:
        connection.close()


def talk(port, request, timeout=PATIENCE_S, pieces=1 << 30):
    """The response to these bytes until the daemon closes, and its time in seconds."""
    since = time.monotonic()
    got = b""
    with socket.create_connection(("127.0.0.1", port), timeout=timeout) as one:
        try:
            for at in range(0, len(request), pieces):
                one.sendall(request[at:at + pieces])
        except OSError:
            pass  # it may already be closed
        try:
            while piece := one.recv(65536):
                got += piece
        except ConnectionResetError:
            pass
        except socket.timeout as slow:
            raise Failed(f"the connection stays open after {timeout} s: {got[:80]!r}") from slow
    return got, time.monotonic() - since


def status_of(got):
    words = got.split(b" ", 2)
    need(len(words) > 2 and words[0].startswith(b"HTTP/1."), f"not an HTTP answer: {got[:80]!r}")
    return int(words[1])


def metric(port, name):
    """The sum of a family's series."""
    text = ask(port, "GET", "/metrics").body.decode()
    values = [float(line.rsplit(" ", 1)[1]) for line in text.splitlines()
              if line.split(" ")[0].split("{")[0] == name]
    need(values, f"no metric {name}")
    return sum(values)


def picture(port, dataset=SAMPLE, size=(64, 48), azimuth=0.0, timeout=PATIENCE_S):
    return ask(port, "GET", f"/v1/datasets/{dataset}/frame.jpg?width={size[0]}&height={size[1]}"
               f"&azimuth={azimuth:.5f}", timeout=timeout)


def check_good(port, dataset=SAMPLE):
    """A valid request must get a picture, possibly after those still rendering for others."""
    end = time.monotonic() + PATIENCE_S
    while True:
        got = picture(port, dataset, azimuth=time.monotonic() % 360)
        if got.status != 429 or time.monotonic() > end:
            break
        time.sleep(0.2)
    need(got.status == 200 and got.body[:2] == b"\xff\xd8",
         f"a valid request is answered by {got.status}: {got.body[:200]!r}")


# --- the stream ----------------------------------------------------------------------------------

class Closed(Exception):
    """The daemon ended the stream, with this code, or 0 without one."""

    def __init__(self, code, reason=""):
        super().__init__(f"{code} {reason}")
        self.code, self.reason = code, reason


class Stream:
    """A WebSocket at the byte level, so that any byte may be invalid."""

    def __init__(self, port, headers=(), receive_buffer=0, timeout=PATIENCE_S, target="/v1/stream",
                 protocols="windsplat.v1"):
        door = door_of(port)
        self.socket = socket.socket(socket.AF_INET6 if ":" in door.host else socket.AF_INET)
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.settimeout(timeout)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket.connect((door.host, door.port))
        if door.tls:
            self.socket = door.tls.wrap_socket(self.socket, server_hostname=door.host)
        self.buffer, self.rev = b"", 0
        if door.token:
            headers = [("Authorization", f"Bearer {door.token}"), *headers]
        more = "".join(f"{name}: {value}\r\n" for name, value in headers)
        host = f"[{door.host}]" if ":" in door.host else door.host
        self.socket.sendall(
            upgrade_request(f"{host}:{door.port}", new_key(), target, protocols, more))
        head = b""
        while b"\r\n\r\n" not in self.buffer:
            self.receive()
        head, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
        self.status, self.head = status_of(head), head

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def close(self):
        self.socket.close()

    def receive(self):
        try:
            got = self.socket.recv(1 << 16)
        except (ConnectionResetError, ssl.SSLError):
            got = b""
        except socket.timeout as slow:
            raise Failed("the stream is silent and stays open") from slow
        if not got:
            raise Closed(0)
        self.buffer += got

    def take(self, count):
        while len(self.buffer) < count:
            self.receive()
        out, self.buffer = self.buffer[:count], self.buffer[count:]
        return out

    def send(self, opcode, payload=b"", fin=True, reserved=0, length=None):
        """`length`: the declared length, if it differs from the payload's."""
        self.socket.sendall(frame(opcode, payload, fin, reserved, NO_MASK, length))

    def say(self, message):
        self.send(1, json.dumps(message).encode())

    def frame(self):
        """First byte and payload of the next frame; pings are answered; an end raises Closed."""
        first, second = self.take(2)
        size = second & 0x7F
        if size == 126:
            size = struct.unpack(">H", self.take(2))[0]
        elif size == 127:
            size = struct.unpack(">Q", self.take(8))[0]
        part = self.take(size)
        kind = first & 0x0F
        if kind == 8:
            code = struct.unpack(">H", part[:2])[0] if part else 0
            raise Closed(code, part[2:].decode())
        if kind == 9:
            self.send(10, part)
        return first, part

    def message(self):
        """Opcode and payload of the next complete message; an end raises Closed."""
        opcode, payload = None, b""
        while True:
            first, part = self.frame()
            kind = first & 0x0F
            if kind >= 8:
                continue
            opcode = kind or opcode
            payload += part
            if first & 0x80:
                return opcode, payload

    def round_trip(self):
        """A ping and its pong: the daemon has processed everything sent before."""
        self.send(9, b"settled")
        while self.frame() != (0x8A, b"settled"):
            pass

    def request_id(self):
        """The name of this stream in the daemon's log."""
        for line in self.head.split(b"\r\n"):
            name, _, value = line.partition(b":")
            if name.lower() == b"x-request-id":
                return value.strip().decode()
        raise Failed(f"the answer to the upgrade has no X-Request-Id: {self.head!r}")

    def until_closed(self):
        """The close code of the daemon; earlier messages are discarded."""
        try:
            while True:
                self.message()
        except Closed as end:
            return end.code

    def patch(self, view):
        self.rev += 1
        self.say({"type": "patch", "rev": self.rev, "t": self.rev, "patch": view})

    def answer_to_patch(self, acknowledge=True):
        """The final frame of the newest patch, "unchanged", or its error."""
        while True:
            opcode, payload = self.message()
            if opcode == 1:
                message = json.loads(payload)
                if message["type"] == "error":
                    return message
                if message["type"] == "unchanged" and message["rev"] == self.rev:
                    return message
                continue
            seq, rev, _, flags = struct.unpack_from("<4I", payload, 8)
            if acknowledge:
                self.say({"type": "ack", "seq": seq, "decodeMs": 1})
            if flags & FINAL and rev == self.rev:
                return payload

    def final_frame(self, view):
        self.patch(view)
        got = self.answer_to_patch()
        need(isinstance(got, bytes), f"no frame but {got}")
        return got


def small_view(dataset=SAMPLE, turn=0.0, size=(96, 64)):
    return {"dataset": dataset, "image": {"width": size[0], "height": size[1]},
            "camera": {"eye": [0.4 + turn, -2.2, 1.4]}}


def check_good_stream(port, dataset=SAMPLE):
    with Stream(port) as one:
        need(one.status == 101, f"a stream is answered by {one.status}")
        one.final_frame(small_view(dataset, turn=time.monotonic() % 1))


# --- cases ---------------------------------------------------------------------------------------

Case = collections.namedtuple("Case", "name call count quick")
CASES = []


def case(name, count, quick):
    """Registers a fault with its number of tries, and that of a quick round."""
    def keep(call):
        CASES.append(Case(name, call, count, quick))
        return call
    return keep


def is_sanitized(program):
    """Sanitizers retain freed memory, and must precede all preloaded libraries."""
    code = pathlib.Path(program).read_bytes()
    return b"__asan_init" in code or b"__tsan_init" in code


class World:
    """The environment of the cases: the program, a folder for each, and a shared daemon."""

    def __init__(self, program, folder, quick, slack):
        self.program, self.folder, self.quick, self.slack = program, folder, quick, slack
        self.shared = None
        self.number = 0
        self.started = []
        help_ = subprocess.run([program, "serve", "--help"], capture_output=True, text=True,
                               check=True)
        self.help = help_.stdout

    def has(self, option):
        return option in self.help

    def need_option(self, option):
        if not self.has(option):
            raise Untried(f"this windsplat has no {option}")

    def new_folder(self):
        self.number += 1
        out = self.folder / f"case-{self.number}"
        out.mkdir()
        return out

    def daemon(self):
        """The shared daemon; no case may harm it."""
        if self.shared is None or not self.shared.alive():
            self.shared = Daemon(self.program, "--max-sessions", "64", SAMPLE)
        return self.shared

    def start(self, *arguments, **how):
        """A daemon for this case alone, stopped after it in any case."""
        self.started.append(Daemon(self.program, *arguments, **how))
        return self.started[-1]

    def end_case(self):
        for one in self.started:
            if one.alive():
                one.stop(signal.SIGKILL)
        self.started = []

    def end(self):
        return self.shared.stop() if self.shared and self.shared.alive() else 0


def told_ok(code, daemon, words="the daemon"):
    need(code == 0, f"{words} ended with {code}: {' / '.join(daemon.lines[-3:])}")
