"""Access: origins, hosts, tokens, TLS."""
import os
import re
import secrets
import shutil
import socket
import ssl
import subprocess
import time

from support import (PATIENCE_S, SAMPLE, Closed, Stream, Untried, ask, case, check_good, need,
                     status_of, talk)

SILENT_S = 10  # deadline of a connection without a first byte
SLACK_S = 4  # tolerance for a loaded machine

EVIL = ["https://evil.example", "null", "http://127.0.0.1.evil.example", "http://evil.example:80",
        "file://", "https://127.0.0.1@evil.example", "http://localhost.evil.example"]


@case("wrong origins", 70, 7)
def origins(world, count):
    daemon = world.daemon()
    for n in range(count):
        with Stream(daemon.port, [("Origin", EVIL[n % len(EVIL)])]) as one:
            code = one.until_closed() if one.status == 101 else None
            need(one.status == 403 or code == 1008, f"{EVIL[n % len(EVIL)]}: {one.status} {code}")
    with Stream(daemon.port, [("Origin", f"http://127.0.0.1:{daemon.port}")]) as one:
        need(one.status == 101, "the page's own origin is refused")
    with Stream(daemon.port) as one:
        need(one.status == 101, "a program without an origin is refused")
    return "403; the page's own origin and requests of programs are accepted"


@case("foreign host names that resolve to this machine", 60, 6)
def hosts(world, count):
    daemon = world.daemon()
    names = ["evil.example", "127.0.0.1.evil.example", "169.254.1.1", "localhost.evil.example:80",
             "[::2]", "evil.example:8080"]
    for n in range(count):
        host = names[n % len(names)]
        got = ask(daemon.port, "GET", "/v1", headers={"Host": host})
        need(got.status == 421, f"host {host} is answered by {got.status}")
    return "421"


def with_token(world, *more):
    world.need_option("--token-file")
    token = secrets.token_hex(24)
    folder = world.new_folder()
    file = folder / "token"
    file.write_text(token + "\n")
    file.chmod(0o600)
    return token, world.start("--token-file", str(file), *more, SAMPLE)


@case("wrong, absent and misplaced tokens", 100, 10)
def tokens(world, count):
    token, daemon = with_token(world, "--max-failed-logins-per-address", "0")
    wrong = ["", token[:-1], token + "0", token.upper() + "x", "x" * 5000, "0" * len(token)]
    for n in range(count):
        bad = wrong[n % len(wrong)]
        given = {"Authorization": f"Bearer {bad}"} if bad else {}
        got = ask(daemon.port, "GET", "/v1/datasets", headers=given)
        need(got.status in (401, 403, 431), f"a wrong token is answered by {got.status}")
        need(token.encode() not in got.body, "the answer contains the token")
        for target in (f"/v1/datasets?token={token}", f"/v1/datasets?access_token={token}"):
            got = ask(daemon.port, "GET", target)
            need(got.status in (400, 401, 403), f"a token in a URL is answered by {got.status}")
    got = ask(daemon.port, "GET", "/v1/datasets", headers={"Authorization": f"Bearer {token}"})
    need(got.status == 200, f"the right token is answered by {got.status}")
    for more in ((), [("Authorization", "Bearer nothing")]):
        with Stream(daemon.port, more, timeout=PATIENCE_S) as one:
            if one.status == 101:
                one.say({"type": "open", "id": 1, "dataset": SAMPLE})
                try:
                    code = one.until_closed()
                except Closed as end:
                    code = end.code
                need(code in (1008, 4401), f"a stream without a token ends by {code}")
            else:
                need(one.status in (401, 403), f"a stream without a token: {one.status}")
    daemon.stop()
    need(token not in daemon.log(), "the token is in the log")
    need(token[:-1] not in daemon.log(), "a wrong token is in the log")
    return "401, a stream 401 or 1008; in no answer and no line of the log"


@case("remote addresses without a token", 3, 1)
def remote(world, count):
    for _ in range(count):
        done = subprocess.run([world.program, "serve", "--listen", "0.0.0.0:0", SAMPLE],
                              capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        need(done.returncode not in (0, None) and "--allow-remote" in done.stderr,
             f"it ended with {done.returncode}: {done.stderr[-200:]}")
    return "refuses to start, with the reason"


@case("running as root on a remote address", 3, 1)
def remote_root(world, count):
    if os.geteuid() != 0:
        raise Untried("not root")
    for _ in range(count):
        done = subprocess.run([world.program, "serve", "--listen", "0.0.0.0:0", "--allow-remote",
                               SAMPLE],
                              capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        need(done.returncode == 2 and "--allow-root" in done.stderr,
             f"it ended with {done.returncode}: {done.stderr[-200:]}")
    return "refuses to start, with the reason"


# --- TLS -----------------------------------------------------------------------------------------

def with_tls(world):
    world.need_option("--tls-cert")
    if not shutil.which("openssl"):
        raise Untried("openssl is not installed: no certificate, so no TLS was tried")
    folder = world.new_folder()
    subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2",
                    "-subj", "/CN=localhost", "-keyout", folder / "key", "-out", folder / "cert"],
                   check=True, capture_output=True)
    return world.start("--tls-cert", str(folder / "cert"), "--tls-key", str(folder / "key"),
                       SAMPLE)


def over_tls(port, request, cut=False):
    """The bytes received; `cut`: the connection ends without close_notify."""
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    plain = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S)
    with context.wrap_socket(plain) as one:
        one.sendall(request)
        if cut:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            return b""
        return one.recv(65536)


GET = b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"


@case("TLS handshakes that are cut off, malformed or absent", 60, 10)
def tls_faults(world, count):
    daemon = with_tls(world)
    hello = bytes.fromhex("1603010200010001fc0303") + bytes(32)
    for n in range(count):
        over_tls(daemon.port, GET, cut=True)
        with socket.create_connection(("127.0.0.1", daemon.port), timeout=PATIENCE_S) as one:
            one.sendall((hello, hello[:7], b"\x16\x03\x01\xff\xff" + bytes(70000), GET)[n % 4])
    need(status_of(over_tls(daemon.port, GET)) == 200, "no answer over TLS")
    got, _ = talk(daemon.port, GET)
    need(b" 200 " not in got[:20], "it answers without TLS")
    return "closed; a valid connection works"


@case("silent connections", 100, 20)
def silent(world, count):
    """Connections that send nothing, over plain TCP and over TLS before the handshake."""
    plain, over_tls = world.daemon(), with_tls(world)
    since = time.monotonic()
    held = [socket.create_connection(("127.0.0.1", (plain, over_tls)[n % 2].port),
                                     timeout=PATIENCE_S) for n in range(count)]
    took = []
    for one in held:
        with one:
            try:
                need(one.recv(1) in (b"", b"H"), "data was sent to a silent peer")
            except ConnectionResetError:
                pass
        took.append(time.monotonic() - since)
    need(max(took) < SILENT_S + SLACK_S, f"one was held for {max(took):.1f} s")
    check_good(plain.port)
    return f"closed after {max(took):.1f} s at most, over TCP and over TLS"


@case("old versions and weak ciphers of TLS, by sslscan", 1, 1)
def tls_versions(world, _count):
    if not shutil.which("sslscan"):
        raise Untried("sslscan is not installed: versions and ciphers of TLS were not tried")
    daemon = with_tls(world)
    done = subprocess.run(["sslscan", "--no-colour", f"127.0.0.1:{daemon.port}"],
                          capture_output=True, text=True, timeout=2 * PATIENCE_S, check=False)
    said = dict(re.findall(r"^(SSLv\d|TLSv1\.\d)\s+(enabled|disabled)", done.stdout, re.MULTILINE))
    need(said.get("TLSv1.2") == "enabled" and said.get("TLSv1.3") == "enabled", f"offers {said}")
    for old in ("SSLv2", "SSLv3", "TLSv1.0", "TLSv1.1"):
        need(said.get(old) == "disabled", f"{old} is {said.get(old)}")
    weak = re.findall(r"^(?:Accepted|Preferred).*(?:RC4|3DES|DES-CBC|NULL|EXP|MD5).*$", done.stdout,
                      re.MULTILINE)
    need(not weak, f"weak ciphers: {weak[:2]}")
    expensive = re.findall(r"^TLSv1\.\d .*(?:ffdhe|secp384r1|secp521r1|x448).*$", done.stdout,
                      re.MULTILINE)
    need(not expensive, f"groups whose key exchange is expensive: {expensive[:2]}")
    need("vulnerable" not in re.sub(r"not vulnerable", "", done.stdout), "heartbleed")
    return "TLS 1.2 and 1.3 alone, no weak cipher"


@case("the whole of TLS, by testssl.sh", 1, 1)
def tls_all(world, _count):
    tool = shutil.which("testssl") or shutil.which("testssl.sh")
    if not tool:
        raise Untried("testssl.sh is not installed: its checks were not run")
    if world.quick:
        raise Untried("testssl.sh takes minutes: not in a quick round")
    daemon = with_tls(world)
    done = subprocess.run(
        [tool, "--quiet", "--color", "0", "--warnings", "off", "-p", "-s", "-U", "--fast",
         f"127.0.0.1:{daemon.port}"], capture_output=True, text=True, timeout=900, check=False)
    found = [line.strip() for line in done.stdout.splitlines()
             if re.search(r"\bVULNERABLE\b|\bNOT ok\b", line) and "not vulnerable" not in line
             # BREACH needs secrets and attacker-chosen text in one compressed answer: only files of
             # the page are compressed, which contain neither.
             and "BREACH" not in line]
    need("TLS 1.3" in done.stdout, f"cannot parse the output of testssl.sh: {done.stdout[-200:]}")
    need(not found, f"{found[:3]}")
    check_alive = over_tls(daemon.port, GET)
    need(status_of(check_alive) == 200, "no answer after the test")
    return "no vulnerability; only files of the page are compressed"
