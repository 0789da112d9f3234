"""Shared by the TLS scripts: certificates, ClientHellos by groups, connections from an address."""
import contextlib
import shutil
import socket
import ssl
import struct
import subprocess

from wire_client import Target

ATTACKER, BYSTANDER = "127.0.0.1", "127.0.0.2"
NO_TIME_WAIT = struct.pack("ii", 1, 0)  # otherwise an attacker runs out of ports


def make_certificate(folder, kind="rsa:2048"):
    """Files of a certificate and its key: `kind` is rsa:BITS or an elliptic curve."""
    cert, key = folder / "cert.pem", folder / "key.pem"
    new = (["-newkey", kind] if kind.startswith("rsa:") else
           ["-newkey", "ec", "-pkeyopt", f"ec_paramgen_curve:{kind}"])
    subprocess.run(["openssl", "req", "-x509", *new, "-nodes", "-days", "2", "-subj",
                    "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", key,
                    "-out", cert], check=True, capture_output=True)
    return cert, key


def client_hello(groups, *options):
    """The ClientHello of openssl's client when it offers those groups."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        client = subprocess.Popen(
            ["openssl", "s_client", "-connect", f"127.0.0.1:{listener.getsockname()[1]}",
             "-groups", groups, *options],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        peer, _ = listener.accept()
        with peer:
            head = peer.recv(5, socket.MSG_WAITALL)
            body = peer.recv(struct.unpack(">H", head[3:])[0], socket.MSG_WAITALL)
    client.wait()
    return head + body


def has_openssl():
    return shutil.which("openssl") is not None


def connect_from(address, port, timeout=60):
    one = socket.create_connection(("127.0.0.1", port), timeout, (address, 0))
    one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return one


class TargetFrom(Target):
    """A daemon over TLS, as seen from one loopback address."""

    def __init__(self, address, port, cert):
        super().__init__("127.0.0.1", port, ssl.create_default_context(cafile=cert))
        self.address = address

    def connect(self, timeout=60, receive_buffer=0):
        return self.tls.wrap_socket(connect_from(self.address, self.port, timeout),
                                    server_hostname=self.host)


def replay(port, hello):
    """Sends a recorded ClientHello; returns whether the daemon computed an answer. OSError:
    refused."""
    with connect_from(ATTACKER, port) as one:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, NO_TIME_WAIT)
        one.sendall(hello)
        return one.recv(1) == b"\x16"  # a handshake record; 21 is an alert


def shake(port, context, session=None):
    """Performs a complete handshake."""
    plain = connect_from(ATTACKER, port)
    with contextlib.closing(plain), context.wrap_socket(plain, session=session) as one:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, NO_TIME_WAIT)
        return one.version()


def trusting_context(version=None):
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    if version:
        context.minimum_version = context.maximum_version = version
    return context
