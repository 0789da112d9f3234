#!/usr/bin/env python3
"""Measures the cost of unauthenticated clients: the daemon's processor time for each kind of
request before authentication, one connection each, relative to the bytes sent.

    tests/bench/preauth_cost.py                       # a certificate of P-256, one of RSA 2048
    tests/bench/preauth_cost.py --key=rsa:4096        # another one; may be repeated
    tests/bench/preauth_cost.py --count=20            # quick

Daemons run without limits on handshakes, connections and requests. Times include all threads of
the daemon and its system calls; the last column is relative to a GET answered with 401."""
import argparse
import contextlib
import os
import pathlib
import secrets
import socket
import ssl
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "edge"))
import tls_peer  # noqa: E402
from wire_client import Daemon  # noqa: E402

UNLIMITED = ["--max-arrivals", "--max-arrivals-per-address", "--max-handshakes",
             "--max-handshakes-per-address", "--max-requests-per-address",
             "--max-failed-logins-per-address"]
HOST = "Host: 127.0.0.1\r\n"
FORM = "Origin: http://127.0.0.1\r\nContent-Type: application/x-www-form-urlencoded\r\n"
GROUPS = ["X25519", "P-256", "P-384", "ffdhe2048", "ffdhe8192"]


def cpu_s(pid):
    """CPU time of all running threads. A tick of /proc/PID/stat is longer than most measured
    intervals."""
    total = 0
    for task in os.listdir(f"/proc/{pid}/task"):
        with contextlib.suppress(FileNotFoundError):
            total += int(pathlib.Path(f"/proc/{pid}/task/{task}/schedstat").read_text().split()[0])
    return total * 1e-9


def plain(*parts, pause_s=0.0):
    """Sends parts and discards responses; returns the number of bytes sent."""
    def once(port):
        with tls_peer.connect_from(tls_peer.ATTACKER, port) as one:
            for part in parts:
                one.sendall(part)
                time.sleep(pause_s)
            while one.recv(65536):
                pass
        return sum(map(len, parts))
    return once


def request(line, fields="", body=b""):
    return f"{line} HTTP/1.1\r\n{HOST}{fields}Connection: close\r\n\r\n".encode() + body


def http_cases():
    login = b"token=" + b"x" * 40
    upgrade = ("Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
               "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n")
    cookies = "".join(f"Cookie: windsplat={10 ** 9 + n}.{'0' * 64}\r\n" for n in range(80))
    many = "".join(f"X-{n}: y\r\n" for n in range(700))
    get = request("GET /v1/datasets")
    return {
        "GET, 401": plain(get),
        "GET of the page, 401": plain(request("GET /", "Accept: text/html\r\n")),
        "GET /livez": plain(request("GET /livez")),
        "wrong token": plain(request("GET /v1", f"Authorization: Bearer {'x' * 500}\r\n")),
        "login, wrong": plain(request(
            "POST /login", f"{FORM}Content-Length: {len(login)}\r\n", login)),
        "login, wrong, 60 kB": plain(request(
            "POST /login", f"{FORM}Content-Length: 60000\r\n", b"token=" + b"%41" * 19998)),
        "upgrade, 401": plain(f"GET /v1/stream HTTP/1.1\r\n{HOST}{upgrade}\r\n".encode()),
        "80 wrong cookies, 7 kB": plain(request("GET /v1", cookies)),
        "700 fields, 7 kB": plain(request("GET /v1", many)),
        "header too large, 64 kB": plain(b"GET / HTTP/1.1\r\nX: " + b"y" * 65536),
        "byte by byte": plain(*[get[n:n + 1] for n in range(len(get))], pause_s=0.001),
    }


def hello_of(groups):
    hello = tls_peer.client_hello(groups)

    def once(port):
        with contextlib.suppress(ConnectionError):
            tls_peer.replay(port, hello)
        return len(hello)
    return once


def shake_by_memory(port, context, session=None, keep=None):
    """Performs a handshake and counts its bytes; a GET follows if its session ticket is to be
    kept."""
    incoming, outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
    tls = context.wrap_bio(incoming, outgoing, session=session)
    sent = 0

    def flush(one):
        data = outgoing.read()
        one.sendall(data)
        return len(data)

    with tls_peer.connect_from(tls_peer.ATTACKER, port) as one:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, tls_peer.NO_TIME_WAIT)

        def until_done(call):
            nonlocal sent
            while True:
                try:
                    got = call()
                    sent += flush(one)
                    return got
                except ssl.SSLWantReadError:
                    sent += flush(one)
                    incoming.write(one.recv(65536))
        until_done(tls.do_handshake)
        if keep is not None:
            until_done(lambda: tls.write(request("GET /livez")))
            until_done(lambda: tls.read(65536))
            keep.append(tls.session)
        elif tls.version() == "TLSv1.3":
            incoming.write(one.recv(65536))  # session tickets: the handshake is complete
    return sent


def tls_cases(port):
    contexts = {
        "handshake, X25519": tls_peer.trusting_context(),
        "handshake, TLS 1.2": tls_peer.trusting_context(ssl.TLSVersion.TLSv1_2),
    }
    cases = {f"ClientHello, {groups}": hello_of(groups) for groups in GROUPS}
    for name, context in contexts.items():
        cases[name] = lambda port, context=context: shake_by_memory(port, context)
    context, tickets = tls_peer.trusting_context(), []
    shake_by_memory(port, context, keep=tickets)
    cases["resumption, X25519"] = lambda port: shake_by_memory(port, context, tickets[0])
    cases["plain HTTP, 400"] = plain(request("GET /livez"))
    return cases


def measure(daemon, call, count):
    """Bytes sent and seconds of processor time of one request."""
    call(daemon.port)
    before, sent = cpu_s(daemon.child.pid), 0
    for _ in range(count):
        sent += call(daemon.port)
    time.sleep(0.05)  # for work that follows the answer
    return sent / count, (cpu_s(daemon.child.pid) - before) / count


def main():
    default = pathlib.Path(__file__).resolve().parents[2] / "build/release/windsplat"
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(default))
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--key", action="append", metavar="rsa:BITS|CURVE")
    options = parser.parse_args()
    keys = options.key or ["P-256", "rsa:2048"]
    if not tls_peer.has_openssl():
        print("nothing measured: openssl, which creates the certificates, is not installed")
        return
    base = None
    print("| request | bytes sent | CPU, us | CPU per byte, ns | relative to a GET |\n"
          "|---|---|---|---|---|")
    with tempfile.TemporaryDirectory(prefix="windsplat-preauth-") as text:
        folder = pathlib.Path(text)
        token = folder / "token"
        token.touch(0o600)
        token.write_text(secrets.token_hex(32))
        for key in [None, *keys]:
            more, target = [], None
            if key:
                cert, secret = tls_peer.make_certificate(folder, key)
                more = [f"--tls-cert={cert}", f"--tls-key={secret}"]
                target = lambda url, cert=cert: tls_peer.TargetFrom(  # noqa: E731
                    tls_peer.ATTACKER, int(url.rstrip("/").rsplit(":", 1)[1]), cert)
            daemon = Daemon(options.program, "tornado:24x24x24", f"--token-file={token}",
                            *[f"{option}=0" for option in UNLIMITED], *more, target=target)
            cases = tls_cases(daemon.port) if key else http_cases()
            for name, call in cases.items():
                sent, seconds = measure(daemon, call, options.count)
                base = base or seconds / sent
                print(f"| {name}{', ' + key if key else ''} | {sent:.0f} | {1e6 * seconds:.0f} | "
                      f"{1e9 * seconds / sent:.0f} | {seconds / sent / base:.1f} |", flush=True)
            daemon.stop()


if __name__ == "__main__":
    main()
