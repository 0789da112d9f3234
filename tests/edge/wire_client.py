"""Client of the Python tests: address of a daemon, raw bytes, HTTP responses, WebSocket frames.
Uses the standard library only and enforces no protocol rules, so that tests can send invalid
data."""
import base64
import hashlib
import json
import os
import pathlib
import socket
import ssl
import struct
import subprocess
import sys
import threading
import time
import urllib.parse

TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10
FIN, MASKED = 0x80, 0x80
NO_MASK = bytes(4)  # a mask of zeros, which is permitted
ACCEPT_SALT = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"  # RFC 6455, 1.3
STREAM_PROTOCOL = "windsplat.v1"


class Closed(RuntimeError):
    """The peer ended the connection; `code` is its WebSocket close code, None without a frame."""

    def __init__(self, what, code=None):
        super().__init__(what)
        self.code = code


class Target:
    """Address of a daemon, and the credentials and headers that it requires."""

    def __init__(self, host, port, tls=None, token=None, base="/"):
        self.host, self.port, self.tls, self.token, self.base = host, port, tls, token, base

    @staticmethod
    def of_url(url, ca=None, token_file=None):
        parts = urllib.parse.urlsplit(url)
        tls = ssl.create_default_context(cafile=ca) if parts.scheme == "https" else None
        port = parts.port or (443 if tls else 80)
        token = pathlib.Path(token_file).read_text().strip() if token_file else None
        return Target(parts.hostname, port, tls, token, parts.path or "/")

    def authority(self):
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"

    def authorization(self):
        return f"Authorization: Bearer {self.token}\r\n" if self.token else ""

    def connect(self, timeout=20, receive_buffer=0):
        """A connected socket. The receive buffer must be set before connecting, else the window
        is large."""
        family = socket.AF_INET6 if ":" in self.host else socket.AF_INET
        plain = socket.socket(family)
        if receive_buffer:
            plain.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        plain.settimeout(timeout)
        # As in browsers; otherwise an ack and a patch wait for each other's delayed
        # acknowledgement.
        plain.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        plain.connect((self.host, self.port))
        return self.tls.wrap_socket(plain, server_hostname=self.host) if self.tls else plain


class Answer:
    def __init__(self, status, headers, body, head):
        self.status, self.headers, self.body, self.head = status, headers, body, head

    def header(self, name):
        """The values of a field in order, joined by ", "; "" if it is absent."""
        return ", ".join(value for key, value in self.headers if key.lower() == name.lower())

    def json(self):
        return json.loads(self.body)


class Connection:
    """Sends and receives bytes without interpretation."""

    def __init__(self, target, timeout=20, receive_buffer=0):
        self.target = target
        self.socket = target.connect(timeout, receive_buffer)
        self.buffer = bytearray()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self.socket.close()

    def raw(self, data):
        self.socket.sendall(data)

    def raw_or_lost(self, data):
        """Sends data; returns False if the peer stopped reading before all was sent."""
        try:
            self.socket.sendall(data)
        except OSError:
            return False
        return True

    def half_close(self):
        """Closes the sending direction. Over TLS, later data of the peer cannot be read."""
        self.socket.shutdown(socket.SHUT_WR)

    def receive(self):
        try:
            got = self.socket.recv(1 << 18)
        except (ConnectionError, ssl.SSLError) as fault:
            raise Closed(f"connection failed: {fault!r}") from fault
        if not got:
            raise Closed("the daemon closed the connection")
        self.buffer += got

    def take(self, count):
        while len(self.buffer) < count:
            self.receive()
        out = bytes(self.buffer[:count])
        del self.buffer[:count]
        return out

    def until(self, end):
        """Everything up to and including those bytes."""
        while end not in self.buffer:
            self.receive()
        return self.take(self.buffer.find(end) + len(end))

    def answer(self, method="GET"):
        """The next final HTTP answer; interim ones (1xx except 101) are skipped."""
        while True:
            head = self.until(b"\r\n\r\n").decode("latin-1")
            line, *rest = head[:-4].split("\r\n")
            version, status, *_ = line.split(" ", 2)
            if version != "HTTP/1.1" or len(status) != 3:
                raise ValueError(f"no status line: {line!r}")
            headers = [tuple(part.strip() for part in field.split(":", 1)) for field in rest]
            answer = Answer(int(status), headers, b"", head)
            if answer.status >= 200 or answer.status == 101:
                break
        if method != "HEAD" and answer.status not in (101, 204, 304):
            answer.body = (self.chunks() if answer.header("Transfer-Encoding") == "chunked" else
                           self.take(int(answer.header("Content-Length"))))
        return answer

    def chunks(self):
        """A body in chunks (RFC 9112, 7.1), as proxies send it; without trailers."""
        body = b""
        while size := int(self.until(b"\r\n").split(b";")[0], 16):
            body += self.take(size)
            self.until(b"\r\n")
        self.until(b"\r\n")
        return body

    def ended(self, seconds=5):
        """Whether the peer closes the connection within that time; data received meanwhile are
        in buffer."""
        end = time.monotonic() + seconds
        try:
            while (left := end - time.monotonic()) > 0:
                self.socket.settimeout(left)
                self.receive()
        except Closed:
            return True
        except TimeoutError:
            pass
        return False


def request(target, method, path, headers=None, body=b""):
    """The answer to a valid request on a separate connection."""
    fields = "".join(f"{name}: {value}\r\n" for name, value in (headers or {}).items())
    if body or method in ("POST", "PUT", "PATCH"):
        fields += f"Content-Length: {len(body)}\r\n"
    with Connection(target, timeout=60) as connection:
        connection.raw(f"{method} {target.base}{path.lstrip('/')} HTTP/1.1\r\n"
                       f"Host: {target.authority()}\r\nConnection: close\r\n"
                       f"{target.authorization()}{fields}\r\n".encode() + body)
        return connection.answer(method)


def masked(payload, mask):
    if not any(mask) or not payload:
        return bytes(payload)
    key = (mask * (len(payload) // 4 + 1))[:len(payload)]
    size = len(payload)
    return (int.from_bytes(payload, "big") ^ int.from_bytes(key, "big")).to_bytes(size, "big")


def frame(opcode, payload=b"", fin=True, rsv=0, mask=None, length=None, width=None):
    """The bytes of a frame. `mask`: 4 bytes; None: random; b"": unmasked. `length` is the declared
    length, encoded in `width` bits: 7, 16 or 64 (None: the fewest possible)."""
    length = len(payload) if length is None else length
    width = width or (7 if length < 126 else 16 if length < 65536 else 64)
    mask = os.urandom(4) if mask is None else mask
    first = (FIN if fin else 0) | rsv << 4 | opcode
    bit = MASKED if mask else 0
    size = {7: bytes([bit | length & 0x7F]), 16: struct.pack(">BH", bit | 126, length & 0xFFFF),
            64: struct.pack(">BQ", bit | 127, length)}[width]
    return bytes([first]) + size + mask + (masked(payload, mask) if mask else payload)


def upgrade_request(authority, key, target="/v1/stream", protocols=STREAM_PROTOCOL, fields=""):
    """The bytes of an upgrade request to the stream; `fields` are whole lines."""
    return (f"GET {target} HTTP/1.1\r\nHost: {authority}\r\nUpgrade: websocket\r\n"
            f"Connection: Upgrade\r\nSec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
            f"Sec-WebSocket-Protocol: {protocols}\r\n{fields}\r\n").encode()


def new_key():
    return base64.b64encode(os.urandom(16)).decode()


def accept_of(key):
    return base64.b64encode(hashlib.sha1((key + ACCEPT_SALT).encode()).digest()).decode()


class WebSocket(Connection):
    """A session of the stream: handshake, frames, text messages as JSON."""

    def __init__(self, target, timeout=20, receive_buffer=0):
        super().__init__(target, timeout, receive_buffer)
        # One thread may read while another sends; not over TLS, which Python 3.11 does not lock.
        self.lock = threading.Lock()
        key = new_key()
        self.raw(upgrade_request(target.authority(), key, f"{target.base}v1/stream",
                                 fields=target.authorization()))
        answer = self.answer()
        if answer.status != 101:
            self.close()
            raise RuntimeError(f"the stream was refused: {answer.head}{answer.body.decode()}")
        if answer.header("Sec-WebSocket-Accept") != accept_of(key):
            raise RuntimeError("the stream was accepted for another key")

    def send(self, opcode, payload=b"", **how):
        with self.lock:
            self.raw(frame(opcode, payload, **how))

    def say(self, message, **how):
        self.send(TEXT, json.dumps(message).encode(), **how)

    def frame(self):
        """First byte and payload of the next frame, of any kind."""
        first, second = self.take(2)
        size = second & 0x7F
        if size == 126:
            size = struct.unpack(">H", self.take(2))[0]
        elif size == 127:
            size = struct.unpack(">Q", self.take(8))[0]
        if second & MASKED:
            raise ValueError("the daemon masked a frame")
        return first, self.take(size)

    def message(self):
        """Opcode and payload of the next complete message; pings are answered. Raises Closed."""
        kind, whole = None, b""
        while True:
            first, part = self.frame()
            opcode = first & 0x0F
            if opcode == CLOSE:
                code = struct.unpack(">H", part[:2])[0] if part else 1005
                raise Closed(f"the daemon closed the stream: {code} {part[2:].decode()}", code)
            if opcode == PING:
                self.send(PONG, part)
            if opcode >= CLOSE:
                continue
            kind = opcode or kind
            whole += part
            if first & FIN:
                return kind, whole

    def text(self, kind):
        """The next text message of that type; frames and other messages are skipped."""
        while True:
            opcode, payload = self.message()
            if opcode == TEXT:
                message = json.loads(payload)
                if message["type"] == kind:
                    return message


def status_bytes(pid, key):
    for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith(key + ":"):
            return 1024 * int(line.split()[1])
    raise KeyError(key)


class Daemon:
    """A daemon on a free port, until stop(). `errors` is the file of its log."""

    def __init__(self, program, dataset, *options, errors=subprocess.DEVNULL, target=None):
        self.child = subprocess.Popen(
            [str(program), "serve", "--listen", "127.0.0.1:0", *options, dataset],
            stdout=subprocess.PIPE, stderr=errors, text=True)
        url = self.child.stdout.readline().strip()
        if not url:
            sys.exit("the daemon did not start")
        self.target = target(url) if target else Target.of_url(url)
        self.port = self.target.port

    def memory(self):
        return {key: status_bytes(self.child.pid, key) for key in ("VmRSS", "VmHWM")}

    def stop(self):
        self.child.terminate()
        return self.child.wait()
