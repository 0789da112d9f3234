"""A host of data files on loopback: files with validators, faults, and an S3 service."""

import hashlib
import hmac
import http.server
import ssl
import threading
import urllib.parse
import xml.sax.saxutils
from email.utils import parsedate_to_datetime

KEY_ID, SECRET, TOKEN, REGION = "AKIDTEST", "secret/of+the.test", "token/of+the.test", "test-1"


def digest(text):
    return hashlib.sha256(text).hexdigest()


def sign(key, text):
    return hmac.new(key, text.encode(), hashlib.sha256).digest()


def signature(method, path, query, headers, signed):
    """AWS Signature Version 4 of a request to s3 without a body."""
    date = headers["x-amz-date"]
    lines = "".join(f"{name}:{' '.join(headers[name].split())}\n" for name in signed)
    sorted_query = "&".join(sorted(query.split("&"))) if query else ""
    request = "\n".join([method, path, sorted_query, lines, ";".join(signed),
                         headers.get("x-amz-content-sha256", digest(b""))])
    scope = f"{date[:8]}/{REGION}/s3/aws4_request"
    text = "\n".join(["AWS4-HMAC-SHA256", date, scope, digest(request.encode())])
    key = f"AWS4{SECRET}".encode()
    for part in scope.split("/"):
        key = sign(key, part)
    return sign(key, text).hex()


DAP_TYPES = {"f4": "Float32", "f8": "Float64", "i2": "Int16"}


def dap_declaration(dataset, variable, shape):
    array, dims, _ = dataset[variable]
    sizes = "".join(f"[{dim} = {size}]" for dim, size in zip(dims, shape))
    return f"    {DAP_TYPES[array.dtype.str[1:]]} {variable}{sizes};\n"


def dap_attributes(dataset):
    out = "Attributes {\n"
    for name, (_, _, attributes) in dataset.items():
        lines = "".join(f'        String {key} "{value}";\n' if isinstance(value, str) else
                        f"        Float64 {key} {value!r};\n" for key, value in attributes.items())
        out += f"    {name} {{\n{lines}    }}\n"
    return out + "}\n"


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True

    def log_message(self, *_):
        pass

    def answer(self, status, body=b"", **headers):
        self.send_response(status)
        headers.setdefault("Content_Length", str(len(body)))
        for name, value in headers.items():
            if value is not None:
                self.send_header(name.replace("_", "-"), value)
        self.end_headers()
        self.wfile.write(body)

    def do_GET(self):
        host = self.server.host
        path, _, query = self.path.partition("?")
        with host.lock:
            host.requests.append(self.path)
        name = urllib.parse.unquote(path).lstrip("/")
        if name in host.stalled:
            self.fault_stalled(name)
            return
        if name.startswith("dodsC/"):
            self.service(name.removeprefix("dodsC/"), urllib.parse.unquote(query))
            return
        fault = getattr(self, "fault_" + name.partition("/")[0].replace("-", "_"), None)
        if fault:
            fault(name.partition("/")[2])
        elif name.partition("/")[0] in host.buckets:
            self.object(path, name, query)
        else:
            self.file(host.files.get(name))

    def file(self, body):
        if body is None:
            self.answer(404, b"no such file" * 10)
            return
        host = self.server.host
        etag = f'{host.etag_mark}"{digest(body)[:16]}"'
        dated = {}
        if host.date:
            etag, dated = None, {"Last_Modified": host.date}
            since = self.headers.get("If-Modified-Since")
            if since and parsedate_to_datetime(host.date) <= parsedate_to_datetime(since):
                self.answer(304, Content_Length=None)
                return
        if etag and self.headers.get("If-None-Match") == etag:
            self.answer(304, ETag=etag, Content_Length=None)
            return
        wanted = self.headers.get("Range") if host.ranges else None
        if host.if_range and self.headers.get("If-Range", etag) != etag:
            wanted = None
        if not wanted:
            self.answer(200, body, ETag=etag, **dated)
            return
        first, last = (int(number or len(body)) for number in
                       wanted.removeprefix("bytes=").split("-"))
        last = min(last, len(body) - 1)
        part = body[first:last + 1]
        with host.lock:
            host.parts.append((self.path, first, len(part)))
        sent = {"ETag": etag, "Content_Range": f"bytes {first}-{last}/{len(body)}"}
        status, part = 206, host.altered(first, part, sent) if host.altered else part
        if part is None:
            status, part, sent = 500, b"", {}
        self.answer(status, part, **sent)

    # --- OPeNDAP ------------------------------------------------------------------------------

    def service(self, name, constraint):
        """DAP 2.0: one variable at a time, by hyperslabs."""
        served = self.server.host.served
        name, _, ending = name.rpartition(".")
        if name not in served:
            self.answer(404, b'Error { code = 404; message = "no such dataset"; };')
        elif ending == "das":
            self.answer(200, dap_attributes(served[name]).encode())
        elif ending == "dds":
            names = "".join(dap_declaration(served[name], variable, array.shape)
                            for variable, (array, _, _) in served[name].items())
            self.answer(200, f"Dataset {{\n{names}}} {name};\n".encode())
        else:
            variable, *slabs = constraint.replace("]", "").split("[")
            array, _, _ = served[name][variable]
            cuts = [slice(int(first), int(last) + 1) for first, _, last in
                    (slab.split(":") for slab in slabs)]
            part = array[tuple(cuts)]
            declaration = dap_declaration(served[name], variable, part.shape)
            count = part.size.to_bytes(4, "big") * 2
            stored = part.astype({"f4": ">f4", "f8": ">f8", "i2": ">i4"}[array.dtype.str[1:]])
            self.answer(200, f"Dataset {{\n{declaration}}} {name};\n\nData:\n".encode() + count +
                        stored.tobytes())

    # --- S3 -----------------------------------------------------------------------------------

    def object(self, path, name, query):
        host = self.server.host
        if host.signed and not self.is_signed(path, query):
            self.answer(403, b"<Error><Code>AccessDenied</Code></Error>")
        elif "list-type=2" in query.split("&"):
            self.listing(host.buckets[name], dict(urllib.parse.parse_qsl(query)))
        else:
            bucket, _, key = name.partition("/")
            self.file(host.buckets[bucket].get(key))

    def is_signed(self, path, query):
        given = self.headers.get("Authorization", "")
        headers = {name.lower(): value for name, value in self.headers.items()}
        signed = given.partition("SignedHeaders=")[2].partition(",")[0].split(";")
        if not {"host", "x-amz-date", "x-amz-security-token"} <= set(signed):
            return False
        expected = signature("GET", path, query, headers, signed)
        return f"Credential={KEY_ID}/" in given and given.endswith(f"Signature={expected}") and \
            headers["x-amz-security-token"] == TOKEN

    def listing(self, bucket, query):
        """Two entries a page, so that every list has several."""
        prefix = query.get("prefix", "")
        below = sorted({prefix + key[len(prefix):].partition("/")[0] +
                        key[len(prefix):].partition("/")[1]
                        for key in bucket if key.startswith(prefix)})
        first = int(query.get("continuation-token", "0").strip("&/+"))
        page = below[first:first + 2]
        out = "<ListBucketResult>"
        for key in page:
            text = xml.sax.saxutils.escape(urllib.parse.quote(key))
            out += f"<CommonPrefixes><Prefix>{text}</Prefix></CommonPrefixes>" \
                if key.endswith("/") else f"<Contents><Key>{text}</Key></Contents>"
        more = first + 2 < len(below)
        out += f"<IsTruncated>{str(more).lower()}</IsTruncated>"
        if more:
            token = xml.sax.saxutils.escape(f"{first + 2}&/+")
            out += f"<NextContinuationToken>{token}</NextContinuationToken>"
        self.answer(200, (out + "</ListBucketResult>").encode())

    # --- faults -------------------------------------------------------------------------------

    def fault_to_other_host(self, rest):
        self.answer(302, Location=f"http://localhost:{self.server.server_port}/{rest}")

    def fault_to_same_host(self, rest):
        self.answer(307, Location=f"/{rest}")

    def fault_to_plain_http(self, rest):
        self.answer(301, Location=f"http://127.0.0.1:{self.server.host.plain_port}/{rest}")

    def fault_round(self, rest):
        self.answer(302, Location=f"/round/{rest}")

    def fault_announced(self, _):
        self.answer(200, b"CDF\1", Content_Length="100000000000")

    def fault_endless(self, _):
        self.answer(200, Content_Length=None, Transfer_Encoding="chunked")
        try:
            while True:
                self.wfile.write(b"10000\r\n" + bytes(65536) + b"\r\n")
        except OSError:
            pass

    def fault_stalled(self, _):
        host = self.server.host
        self.answer(200, b"CDF\1", Content_Length="1000")
        host.waits.set()
        self.connection.settimeout(20)
        try:
            self.connection.recv(1)  # until the client leaves
        except OSError:
            pass
        host.left.set()
        self.close_connection = True

    def fault_truncated(self, name):
        body = self.server.host.files[name]
        self.answer(200, body[:len(body) // 2], Content_Length=str(len(body)))
        self.close_connection = True

    def fault_flaky(self, name):
        """Ends the connection after a third of what is left, and sends ranges."""
        host = self.server.host
        body = host.files[name]
        etag = f'"{digest(body)[:16]}"'
        begin = 0
        if self.headers.get("If-Range") == etag:
            begin = int(self.headers["Range"].removeprefix("bytes=").rstrip("-"))
        ranges = {"Content_Range": f"bytes {begin}-{len(body) - 1}/{len(body)}"} if begin else {}
        end = len(body) if begin > len(body) // 2 else begin + (len(body) - begin) // 3
        self.answer(206 if begin else 200, body[begin:end], ETag=etag,
                    Content_Length=str(len(body) - begin), **ranges)
        self.close_connection = True

    def fault_mutated(self, name):
        """The same, but the file changes after each part."""
        host = self.server.host
        host.files[name + "-now"] = host.files.get(name + "-now", host.files[name]) + b"0"
        self.fault_flaky(name + "-now")

    def resumed(self, name, etag, left_out):
        """Half of the file, then the rest with this ETag and without its last bytes."""
        body = self.server.host.files[name]
        wanted = self.headers.get("Range", "bytes=0-").removeprefix("bytes=")
        begin = int(wanted.partition("-")[0])
        if not begin:
            self.answer(200, body[:len(body) // 2], ETag='"1"', Content_Length=str(len(body)))
        else:
            part = body[begin:len(body) - left_out]
            self.answer(206, part, ETag=etag, Content_Length=str(len(part)),
                        Content_Range=f"bytes {begin}-{begin + len(part) - 1}/{len(body)}")
        self.close_connection = True

    def fault_spliced(self, name):
        self.resumed(name, '"2"', 0)

    def fault_short(self, name):
        self.resumed(name, '"1"', 100)

    def fault_identity(self, name):
        body = self.server.host.files[name]
        self.answer(200, body[:len(body) // 2], Content_Length=None, Connection="close",
                    Transfer_Encoding="identity")
        self.close_connection = True

    def fault_unbounded(self, name):
        self.answer(200, self.server.host.files[name], Content_Length=None, Connection="close")
        self.close_connection = True

    def fault_coded(self, name):
        self.answer(200, self.server.host.files[name], Content_Encoding="gzip")

    def fault_headers(self, name):
        self.send_response(200)
        for i in range(40):
            self.send_header(f"X-{i}", "x" * 4000)
        self.end_headers()

    def fault_denied(self, _):
        self.answer(403, b"denied")


class Server(http.server.ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request, client_address):
        pass  # clients leave in the middle of faulty answers


class DataHost:
    """files: path -> bytes; buckets: name -> {key: bytes}; both may be changed while it runs."""

    def __init__(self, certificate=None, plain_port=0):
        self.files = {}
        self.buckets = {}
        self.signed = False
        self.requests = []
        self.lock = threading.Lock()
        self.served = {}  # OPeNDAP: dataset -> variable -> array, dimensions, attributes
        self.ranges, self.if_range = True, True  # whether it heeds these headers
        self.etag_mark = ""  # "W/": weak
        self.date = ""  # Last-Modified of every file, which then have no ETag
        self.parts = []  # path, first byte and number of bytes of each part that was sent
        # First byte, bytes and headers (to change) of a part -> its bytes; None: status 500.
        self.altered = None
        self.stalled = set()  # names of files that are never sent to their end
        self.waits, self.left = threading.Event(), threading.Event()  # a client for one of these
        self.plain_port = plain_port
        self.server = Server(("127.0.0.1", 0), Handler)
        self.server.host = self
        if certificate:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(*certificate)
            self.server.socket = context.wrap_socket(self.server.socket, server_side=True,
                                                     do_handshake_on_connect=False)
        self.port = self.server.server_port
        self.origin = f"{'https' if certificate else 'http'}://127.0.0.1:{self.port}"
        threading.Thread(target=self.server.serve_forever, args=(0.02,), daemon=True).start()

    def asked(self):
        """The paths requested since the last call."""
        with self.lock:
            out, self.requests = self.requests, []
        return out

    def end(self):
        self.server.shutdown()
        self.server.server_close()
