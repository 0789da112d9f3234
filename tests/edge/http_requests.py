"""Cases of HTTP/1.1 (RFC 9110, RFC 9112): request line, fields, Host, framing of bodies."""
import functools

from suite import Case, require
from wire_client import Connection

BODY = b'{"dataset":"tornado","image":{"width":16,"height":12}}'
ATTACK_BYTES = 66 * 1024  # a trailer of this size crashed a plain server of the library in use


def fill(target, text):
    """HOST is the daemon's authority, BASE its path, AUTH its token's field; the rest is sent
    unchanged."""
    data = text if isinstance(text, bytes) else text.encode("latin-1")
    for name, value in (
            (b"HOST", target.authority()), (b"BASE", target.base),
            (b"AUTH", target.authorization())):
        data = data.replace(name, value.encode())
    return data


def one(target, data, statuses, closed, method):
    """Expects one answer with one of those statuses. `closed`: the connection ends after it
    without further data; False: it serves another request."""
    with Connection(target) as connection:
        connection.raw_or_lost(fill(target, data))
        answer = connection.answer(method)
        require(answer.status in statuses, f"{answer.status} {answer.body[:200]!r}")
        if answer.status >= 400 and method != "HEAD":
            require(answer.header("Content-Type") == "application/problem+json",
                    f"type {answer.header('Content-Type')}")
            require(answer.json()["detail"], "a problem without a reason")
        if closed:
            require(answer.header("Connection") == "close", "does not say close")
            require(connection.ended(), "stays open")
            require(not connection.buffer, f"unexpected data: {bytes(connection.buffer[:200])!r}")
        elif closed is False:
            connection.raw(fill(target, "GET BASElivez HTTP/1.1\r\nHost: HOST\r\nAUTH\r\n"))
            again = connection.answer()
            require(again.status == 200, f"the next request: {again.status}")


def row(name, section, what, data, *statuses, closed=True, method="GET"):
    outcome = " or ".join(map(str, statuses))
    outcome += {True: ", closed", False: ", open", None: ""}[closed]
    return Case("http." + name, section, what, outcome, functools.partial(
        one, data=data, statuses=statuses, closed=closed, method=method))


def line(text, rest="Host: HOST\r\nAUTH\r\n"):
    return f"{text}\r\n{rest}"


def get(fields="", path="BASElivez", version="HTTP/1.1"):
    return f"GET {path} {version}\r\nHost: HOST\r\nAUTH{fields}\r\n"


def post(fields, body=BODY, version="HTTP/1.1"):
    head = (f"POST BASEv1/frames {version}\r\nHost: HOST\r\nAUTHContent-Type: application/json\r\n"
            f"{fields}\r\n")
    return head.encode("latin-1") + body


def line_cases():
    where = "RFC 9112 3"
    for name, text in (
            ("empty", ""), ("method", "GET"), ("http09", "GET BASElivez"),
            ("two-spaces", "GET  BASElivez HTTP/1.1"), ("space-end", "GET BASElivez HTTP/1.1 "),
            ("space-first", " GET BASElivez HTTP/1.1"), ("tab", "GET\tBASElivez\tHTTP/1.1"),
            ("four-words", "GET BASElivez x HTTP/1.1"), ("no-target", "GET HTTP/1.1"),
            ("no-target2", "GET  HTTP/1.1"), ("relative", "GET livez HTTP/1.1"),
            ("fragment", "GET BASElivez#x HTTP/1.1"), ("quote", 'GET BASE"livez" HTTP/1.1'),
            ("brackets", "GET BASE<livez> HTTP/1.1"), ("backslash", "GET \\livez HTTP/1.1"),
            ("caret", "GET BASE^ HTTP/1.1"), ("high", "GET BASE\xff HTTP/1.1"),
            ("nul", "GET BASE\0livez HTTP/1.1"), ("bell", "GET BASE\x07 HTTP/1.1"),
            ("delete", "GET BASE\x7f HTTP/1.1"), ("method-nul", "GE\0T BASElivez HTTP/1.1"),
            ("method-colon", "GET: BASElivez HTTP/1.1"), ("method-at", "G@T BASElivez HTTP/1.1"),
            ("method-utf8", "GÉT BASElivez HTTP/1.1"), ("no-slash", "GET BASElivez HTTP 1.1"),
            ("lower", "GET BASElivez http/1.1"), ("htp", "GET BASElivez HTP/1.1"),
            ("tls", "\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03")):
        yield row(f"line.{name}", where, f"{text!r:.60}", line(text), 400)
    for version in (
            "HTTP/1", "HTTP/1.", "HTTP/.1", "HTTP/11", "HTTP/1.1.1", "HTTP/1,1", "HTTP/-1.1",
            "HTTP/1.x", "HTTP/x.1", "HTTP/1.10", "HTTP/01.1", "HTTP/"):
        yield row(f"version.{version[5:]}", "RFC 9112 2.3", version,
                  line(f"GET BASElivez {version}"), 400, 505)
    for version in ("HTTP/0.9", "HTTP/2.0", "HTTP/3.0", "HTTP/9.9"):
        yield row(f"version.{version[5:]}", "RFC 9110 15.6.6", version,
                  line(f"GET BASElivez {version}"), 505)
    yield row("version.1.2", "RFC 9110 2.5", "HTTP/1.2", line("GET BASElivez HTTP/1.2"), 200, 505,
              closed=None)
    yield row("version.1.0", "RFC 9112 9.3", "HTTP/1.0", get(version="HTTP/1.0"), 200)
    yield row("version.1.0.alive", "RFC 9112 9.3", "HTTP/1.0 with keep-alive",
              get("Connection: keep-alive\r\n", version="HTTP/1.0"), 200, closed=None)
    yield row("preface", "RFC 9113 3.4", "the preface of HTTP/2",
              "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 400, 505)
    yield row("empty-line", "RFC 9112 2.2", "an empty line before the request", "\r\n" + get(), 200,
              400, closed=None)
    for name, data in (
            ("bare-lf", get().replace("\r\n", "\n") + "\r\n\r\n"),
            ("bare-lf-one", get("X: 1\nY: 2\r\n")), ("bare-cr", get("X: 1\rY: 2\r\n")),
            ("bare-cr-end", get("X: 1\r\r\n")),
            ("bare-cr-line", "GET BASElivez HTTP/1.1\rHost: HOST\r\n\r\n"),
            ("cr-before", "\rGET BASElivez HTTP/1.1\r\nHost: HOST\r\n\r\n"),
            ("lf-before", "\nGET BASElivez HTTP/1.1\r\nHost: HOST\r\n\r\n"),
            ("lf-last", get()[:-2] + "\n\r\n\r\n")):
        yield row(f"ends.{name}", "RFC 9112 2.2", f"line ends: {name}", data, 400)


def method_cases():
    where = "RFC 9110 9"
    for method, statuses in (
            ("get", (501,)), ("Get", (501,)), ("BREW", (501,)), ("TRACE", (405, 501)),
            ("CONNECT", (400, 405, 501)), ("PROPFIND", (405, 501)), ("M" * 300, (501,)),
            ("GET,", (400, 501)), ("!#$%&'*+-.^_`|~", (501,)), ("PRI", (501,)),
            ("LINK", (405, 501))):
        yield row(f"method.{method[:20]}", where, f"the method {method:.20}",
                  line(f"{method} BASElivez HTTP/1.1"), *statuses, closed=None)
    for target, statuses in (
            ("HOST", (400, 405, 501)), ("example.com:443", (400, 405, 501)),
            ("127.0.0.1:22", (400, 405, 501))):
        yield row(f"connect.{target}", "RFC 9110 9.3.6", f"CONNECT {target}",
                  line(f"CONNECT {target} HTTP/1.1"), *statuses, closed=None)
    yield row("options.star", "RFC 9110 9.3.7", "OPTIONS *", line("OPTIONS * HTTP/1.1"), 200, 204,
              closed=False)
    yield row("options.path", "RFC 9110 9.3.7", "OPTIONS of a path",
              line("OPTIONS BASEv1 HTTP/1.1"), 200, 204, closed=False)
    yield row("get.star", "RFC 9112 3.2.4", "GET *", line("GET * HTTP/1.1"), 400, 404, closed=None)
    for method in ("POST", "PUT", "PATCH", "DELETE"):
        yield row(f"not-allowed.{method}", "RFC 9110 15.5.6", f"{method} of what can only be got",
                  line(f"{method} BASElivez HTTP/1.1",
                       "Host: HOST\r\nAUTHContent-Length: 0\r\n\r\n"), 405, closed=False)
    yield row("head", "RFC 9110 9.3.2", "HEAD: no body, the connection stays open",
              get().replace("GET", "HEAD"), 200, closed=False, method="HEAD")
    yield row("head.404", "RFC 9110 9.3.2", "HEAD of nothing: no body",
              line("HEAD BASEnothing HTTP/1.1"), 404, closed=False, method="HEAD")


def target_cases():
    where = "RFC 9112 3.2.2"
    for name, text, statuses in (
            ("own", "http://HOSTBASElivez", (200,)),
            ("scheme-case", "HTTP://HOSTBASElivez", (200,)),
            ("no-path", "http://HOST", (200, 308, 404)),
            ("query", "http://HOST?a=/livez", (200, 308, 400, 404))):
        yield row(f"absolute.{name}", where, f"{text}", line(f"GET {text} HTTP/1.1"), *statuses,
                  closed=None)
    for name, text in (
            ("other", "http://evil.example/livez"), ("userinfo", "http://u:p@HOST/livez"),
            ("empty", "http:///livez"), ("ftp", "ftp://HOST/livez"),
            ("relative", "//HOST/livez/.."), ("file", "file:///etc/passwd"),
            ("port", "http://127.0.0.1:1/livez"), ("spaces", "http://HOST /livez")):
        yield row(f"absolute.{name}", where, f"{text}", line(f"GET {text} HTTP/1.1"), 400, 404, 421,
                  closed=None)
    where = "RFC 3986 2.1, 3.3"
    for name, path, statuses in (
            ("percent", "%", (400,)), ("percent1", "%4", (400,)),
            ("percent-letters", "%zz", (400,)), ("percent-end", "livez%", (400,)),
            ("encoded", "%6Civez", (200,)), ("encoded-slash", "v1%2Fdatasets", (404,)),
            ("encoded-slash2", "v1/datasets%2ftornado", (404,)), ("nul", "livez%00", (400, 404)),
            ("nul-in-id", "v1/datasets/tor%00nado", (400, 404)),
            ("overlong", "%c0%afetc", (400, 404)),
            ("overlong-dot", "%c0%ae%c0%ae/etc/passwd", (400, 404)),
            ("bad-utf8", "v1/datasets/%ff", (400, 404)),
            ("line-end", "v1/datasets/%0d%0aSet-Cookie:x", (400, 404)),
            ("twice", "%256Civez", (404,)), ("dots", "../livez", (200, 400, 404)),
            ("dots-deep", "../../../../etc/passwd", (400, 404)),
            ("dots-encoded", "%2e%2e/%2e%2e/etc/passwd", (400, 404)),
            ("dots-mixed", "..%2f..%2fetc%2fpasswd", (400, 404)),
            ("dots-inside", "v1/../../etc/passwd", (400, 404)),
            ("backslashes", "..%5c..%5cetc", (400, 404)), ("slashes", "/livez", (200, 400, 404)),
            ("slash-end", "livez/", (200, 404)), ("semicolon", "livez;x=1", (400, 404)),
            ("page-dots", "assets/../../../etc/passwd", (400, 404))):
        yield row(f"path.{name}", where, path, get(path="BASE" + path), *statuses, closed=None)
    for name, query, statuses in (
            ("unknown", "a=1", (400,)), ("percent", "width=%zz", (400,)),
            ("nul", "width=%00", (400,)), ("letters", "width=abc", (400,)),
            ("huge", "width=99999999999999999999", (400, 422)),
            ("negative", "width=-1", (400, 422)), ("zero", "width=0", (400, 413, 422)),
            ("float", "width=1.5", (400, 422)), ("nan", "azimuth=nan", (400, 422)),
            ("infinite", "azimuth=inf", (400, 422)), ("overflow", "azimuth=1e999", (400, 422)),
            ("twice", "width=16&width=16", (400,)), ("hex", "width=0x10", (400,)),
            ("plus", "width=+16", (400,)), ("no-value", "width", (400,)), ("no-name", "=5", (400,)),
            ("only-signs", "&&&width=16&height=12&", (200,)), ("question", "?", (400,)),
            ("wrapped", "width=4294967312", (400, 413, 422)),
            ("long", "width=" + "1" * 7000, (400,)), ("many", "&".join(["a=1"] * 1500), (400,))):
        yield row(f"query.{name}", "the query's parameters", f"?{query:.40}", get(
            path="BASEv1/datasets/tornado/frame.jpg?" + query), *statuses, closed=None)
    yield row("query.empty", where, "a question mark alone", get(path="BASElivez?"), 200,
              closed=None)


def field_cases():
    where = "RFC 9112 5"
    for name, field in (
            ("space-colon", "X : 1"), ("tab-colon", "X\t: 1"), ("space-first", " X: 1"),
            ("no-colon", "Xyz"), ("colon-only", ": 1"), ("nul-name", "X\0: 1"),
            ("control-name", "X\x01: 1"), ("delete-name", "X\x7f: 1"), ("space-name", "X Y: 1"),
            ("quote-name", '"X": 1'), ("brackets-name", "[X]: 1"), ("high-name", "X\xe9: 1"),
            ("nul-value", "X: a\0b"), ("control-value", "X: a\x01b"),
            ("escape-value", "X: \x1b[2J"), ("vt-value", "X: a\x0bb"),
            ("delete-value", "X: a\x7fb"), ("fold", "X: 1\r\n more"),
            ("fold-tab", "X: 1\r\n\tmore"), ("fold-empty", "X: 1\r\n \r\nY: 2")):
        yield row(f"field.{name}", where, f"{field!r}", get(field + "\r\n"), 400)
    for name, field in (
            ("empty", "X:"), ("tight", "X:1"), ("wide", "X:  \t 1 \t "), ("tab", "X: a\tb"),
            ("high", "X: \xff\xfe"), ("token", "!#$%&'*+-.^_`|~: 1"), ("colons", "X: a:b:c"),
            ("twice", "X: 1\r\nX: 2")):
        yield row(f"field.good.{name}", "RFC 9110 5.5", f"{field!r}", get(field + "\r\n"), 200,
                  closed=False)
    where = "RFC 9112 3.2"
    for name, host in (
            ("none", None), ("twice", "HOST\r\nHost: HOST"),
            ("other-twice", "HOST\r\nhost: evil.example"), ("userinfo", "u@HOST"),
            ("userinfo-late", "localhost:80@evil.example"), ("path", "HOST/evil"),
            ("query", "HOST?x"), ("list", "HOST, evil.example"),
            ("space", "127.0.0.1 evil.example"), ("port-letters", "127.0.0.1:abc"),
            ("port-large", "127.0.0.1:99999999"), ("ports", "127.0.0.1:1:2"), ("bracket", "[::1"),
            ("bracket-after", "[::1]x"), ("empty", ""), ("scheme", "http://127.0.0.1"),
            ("quote", '"127.0.0.1"'), ("backslash", "127.0.0.1\\evil"), ("hash", "127.0.0.1#evil")):
        data = "GET BASElivez HTTP/1.1\r\n" + ("" if host is None else f"Host: {host}\r\n")
        yield row(f"host.{name}", where, f"Host: {host}", data + "AUTH\r\n", 400, 421)
    yield row("host.http10", where, "HTTP/1.0 without a Host",
              "GET BASElivez HTTP/1.0\r\nAUTH\r\n", 200, 400)


def length_cases():
    where = "RFC 9112 6.2, 6.3"
    size = len(BODY)
    for name, value in (
            ("negative", "-1"), ("negative-zero", "-0"), ("plus", f"+{size}"), ("spaces", "5 4"),
            ("other-list", "5, 6"), ("empty", ""), ("hex", "0x36"), ("letters", "abc"),
            ("float", "54.0"), ("exponent", "5e1"), ("comma", f"{size},"),
            ("semicolon", f"{size};"), ("quoted", f'"{size}"'), ("underscore", "5_4"),
            ("vt", f"\x0b{size}"), ("nbsp", f"\xa0{size}"), ("nul", f"{size}\0"),
            ("other-lines", f"{size}\r\nContent-Length: 5"),
            ("same-lines", f"{size}\r\nContent-Length: {size}"),
            ("zero-first", f"0\r\nContent-Length: {size}")):
        yield row(f"length.{name}", where, f"Content-Length: {value!r}",
                  post(f"Content-Length: {value}\r\n"), 400)
    yield row("length.same-list", where, "Content-Length: 54, 54",
              post(f"Content-Length: {size}, {size}\r\n"), 200, 400, closed=None)
    for name, value in (
            ("2^16+1", 65537), ("2^31", 1 << 31), ("2^32", 1 << 32), ("2^32+54", (1 << 32) + size),
            ("2^63-1", (1 << 63) - 1), ("2^63", 1 << 63), ("2^64-1", (1 << 64) - 1),
            ("2^64", 1 << 64), ("2^64+54", (1 << 64) + size), ("10^30", 10 ** 30),
            ("10^4000", "9" * 4000)):
        yield row(f"length.{name}", where, f"a Content-Length of {name}",
                  post(f"Content-Length: {value}\r\n"), 400, 413)
    for name, value in (("exact", size), ("zeros", f"000{size}"), ("spaced", f" \t{size} ")):
        yield row(f"length.good.{name}", where, f"Content-Length: {value!r}",
                  post(f"Content-Length: {value}\r\n"), 200, closed=False)
    yield row("length.none", "RFC 9110 15.5.12", "POST without a length", post("", b""), 411)
    yield row("length.get", "RFC 9110 9.3.1", "GET with a body",
              get("Content-Length: 5\r\n") + "hello", 200, 400, closed=None)
    yield row("length.short", where, "a body shorter than declared, then a valid request",
              post("Content-Length: 10\r\n", b"{}") + b"12345678", 400, closed=None)


def coding_cases():
    where = "RFC 9112 6.1, 7"
    chunks = b"%x\r\n%s\r\n0\r\n\r\n" % (len(BODY), BODY)
    smuggled = b"GET /v1 HTTP/1.1\r\nHost: HOST\r\nX-Request-Id: smuggled\r\n\r\n"
    for name, value in (
            ("chunked", "chunked"), ("case", "Chunked"), ("identity", "identity"),
            ("both", "chunked, identity"), ("other-way", "identity, chunked"),
            ("gzip", "gzip, chunked"), ("twice", "chunked, chunked"),
            ("lines", "chunked\r\nTransfer-Encoding: chunked"), ("unknown", "xchunked"),
            ("parameter", "chunked;q=0.5"), ("empty", ""), ("quoted", '"chunked"'),
            ("vt", "\x0bchunked"), ("nul", "chunked\0"), ("cow", "cow"), ("trailers", "trailers")):
        coding = f"Transfer-Encoding: {value}\r\n"
        for how, fields in (
                ("alone", coding), ("before", coding + "Content-Length: 4\r\n"),
                ("behind", "Content-Length: 4\r\n" + coding)):
            yield row(f"coding.{name}.{how}", where, f"Transfer-Encoding: {value!r}, {how}",
                      post(fields, chunks + smuggled), 400, 501)
    for name, field in (
            ("space-colon", "Transfer-Encoding : chunked"),
            ("fold", "Transfer-Encoding:\r\n chunked"),
            ("tab-name", "Transfer-Encoding\t: chunked"),
            ("lf", "X: 1\nTransfer-Encoding: chunked")):
        yield row(f"coding.hidden.{name}", where, f"{field!r} and a length",
                  post(f"{field}\r\nContent-Length: 4\r\n", chunks + smuggled), 400, 501)
    yield row("coding.http10", where, "chunked in HTTP/1.0",
              post("Transfer-Encoding: chunked\r\n", chunks, "HTTP/1.0"), 400, 501)
    yield row("coding.get", where, "chunked in a GET",
              get("Transfer-Encoding: chunked\r\n") + "0\r\n\r\n", 400, 501)
    chunked = "Transfer-Encoding: chunked\r\n"
    for name, body in (
            ("trailer", b"0\r\nX: " + b"a" * ATTACK_BYTES + b"\r\n\r\n"),
            ("trailers", b"0\r\n" + b"X: y\r\n" * (ATTACK_BYTES // 6) + b"\r\n"),
            ("trailer-open", b"0\r\nX: " + b"a" * (1 << 20)),
            ("extension", b"1;" + b"a" * ATTACK_BYTES + b"\r\nx\r\n0\r\n\r\n"),
            ("extensions", b"1;a=b\r\nx\r\n" * 10000 + b"0\r\n\r\n"),
            ("extension-open", b"1;" + b"a" * (1 << 20)),
            ("size-long", b"0" * ATTACK_BYTES + b"1\r\nx\r\n0\r\n\r\n"),
            ("size-huge", b"ffffffffffffffff\r\nx"), ("size-negative", b"-1\r\nx"),
            ("size-none", b"\r\n\r\n"), ("bytes", b"1\r\nx\r\n" * 20000 + b"0\r\n\r\n")):
        yield row(f"chunks.{name}", "RFC 9112 7.1", f"a chunked body: {name}", post(chunked, body),
                  501)


def groups():
    return [("request line", list(line_cases())), ("methods", list(method_cases())),
            ("targets and queries", list(target_cases())), ("fields and Host", list(field_cases())),
            ("Content-Length", list(length_cases())),
            ("Transfer-Encoding and chunks", list(coding_cases()))]
