"""Requests to a server: base address, token, waiting as asked for, errors as Problems."""
from __future__ import annotations

import contextlib
import email.utils
import ipaddress
import os
import pathlib
import random
import re
import socket
import ssl
import time
import urllib.parse
from typing import Any, BinaryIO, Callable, Iterator, Mapping

import httpx

from .errors import ConnectionFailed, Problem, problem_of

WAIT_WITHOUT_WORD = 1.0  # seconds, of a refusal without Retry-After


def base_of(url: str) -> str:
    """The address of a server, with its base path, ending in a slash."""
    if "://" not in url:
        url = "http://" + url
    try:
        parsed = httpx.URL(url)
    except httpx.InvalidURL:
        parsed = httpx.URL("")
    if parsed.scheme not in ("http", "https") or not parsed.host:
        raise ValueError(f"'{url}' is no address such as http://127.0.0.1:8080 or unix:/run/w.sock")
    return str(parsed.copy_with(query=None, fragment=None)).rstrip("/") + "/"


def socket_of(url: str) -> tuple[str, str] | None:
    """Path of the UNIX socket and address of requests of unix:/run/w.sock, or of what `serve`
    prints, http+unix://%2Frun%2Fw.sock/base/. None: another address."""
    if url.startswith("unix:"):
        path, rest = url.removeprefix("unix:"), ""
    elif url.startswith("http+unix://"):
        host, _, rest = url.removeprefix("http+unix://").partition("/")
        path = urllib.parse.unquote(host)
    else:
        return None
    if not path.startswith("/") or path.startswith("//"):
        raise ValueError(f"'{url}' is not unix: and an absolute path, such as unix:/run/w.sock")
    if not hasattr(socket, "AF_UNIX"):
        raise ValueError(f"'{url}': Python has no UNIX sockets on this system")
    return path, base_of("http://localhost/" + rest)


def is_loopback(host: str) -> bool:
    """Whether a host is this machine, which no proxy of the environment should stand before."""
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost"


def seconds_of(header: str | None) -> float | None:
    """The seconds of a Retry-After header, which proxies may give as a date."""
    if header is None:
        return None
    try:
        return max(0.0, float(header))
    except ValueError:
        pass
    try:
        return max(0.0, email.utils.parsedate_to_datetime(header).timestamp() - time.time())
    except ValueError:
        return None


def _tls_of(verify: bool | str | ssl.SSLContext) -> ssl.SSLContext:
    """How certificates are checked: by those of the system (True), of a file, or not (False)."""
    if isinstance(verify, ssl.SSLContext):
        return verify
    tls = ssl.create_default_context(cafile=verify if isinstance(verify, str) else None)
    if verify is False:
        tls.check_hostname = False
        tls.verify_mode = ssl.CERT_NONE
    return tls


class _Body:
    """A file as a body, whose length httpx asks of fileno()."""

    def __init__(self, file: BinaryIO, progress: Callable[[int, int], object] | None) -> None:
        self.fileno = file.fileno
        self._file = file
        self._progress = progress or (lambda sent, whole: None)

    def __iter__(self) -> Iterator[bytes]:
        sent, whole = 0, os.fstat(self.fileno()).st_size
        self._progress(sent, whole)
        while block := self._file.read(1 << 16):
            yield block
            sent += len(block)
            self._progress(sent, whole)


class Http:
    """Requests below one address. Safe to use from several threads and, after a fork, processes."""

    def __init__(self, url: str, token: str | None, timeout: float, patience: float,
                 verify: bool | str | ssl.SSLContext = True) -> None:
        place = socket_of(url)
        self.socket: str | None = None if place is None else place[0]
        """Path of the UNIX socket that requests go through."""
        self.base = base_of(url) if place is None else place[1]
        self.loopback = place is not None or is_loopback(httpx.URL(self.base).host)
        self.name = self.base if place is None else f"unix:{place[0]}"
        self.tls: ssl.SSLContext | None = None
        if self.base.startswith("https:"):
            self.tls = _tls_of(verify)
        self.token = token
        self.patience = patience
        self.ended: Callable[[], str] = str
        """Says how a server that was started here has ended; empty: it runs."""
        self._timeout = timeout
        self._closed = False
        self._clients: dict[int, httpx.Client] = {}  # by process

    @property
    def _client(self) -> httpx.Client:
        """The client of this process. A fork inherits those of its ancestors, whose connections
        carry the answers to them, and whose locks a thread that it lacks may hold: it makes one of
        its own, and keeps the others, so that nothing closes them."""
        own = self._clients.get(os.getpid())
        # Of two threads that come here at once, both take the client of the first.
        return own or self._clients.setdefault(os.getpid(), self._new_client())

    def _new_client(self) -> httpx.Client:
        headers = {"User-Agent": "windsplat-python"}
        if self.token:
            headers["Authorization"] = f"Bearer {self.token}"
        # Without https no certificates are read, which takes longer than most requests.
        check: bool | ssl.SSLContext = False if self.tls is None else self.tls
        # Pictures are rendered before the first byte is sent, hence the long time to read.
        timeout = httpx.Timeout(self._timeout, connect=min(self._timeout, 10.0))
        return httpx.Client(
            headers=headers, timeout=timeout,
            verify=check, trust_env=not self.loopback,
            transport=None if self.socket is None else httpx.HTTPTransport(verify=check,
                                                                           uds=self.socket))

    def close(self) -> None:
        """Closes the connections of this process."""
        self._closed = True
        if own := self._clients.get(os.getpid()):
            own.close()

    def request(
        self,
        method: str,
        path: str,
        *,
        json: Any = None,
        params: Mapping[str, Any] | None = None,
        accept: str | None = None,
        file: pathlib.Path | None = None,
        headers: Mapping[str, str] | None = None,
        progress: Callable[[int, int], object] | None = None,
    ) -> httpx.Response:
        """The answer to a request. `path` is relative to the base, or begins with a slash as in
        links of the server; `file` is sent as the body. A refusal (429, 503) is repeated after
        the time that it names, as long as all of them together stay within `patience` seconds.

        Raises Problem, ConnectionFailed.
        """
        sent = {"Accept": accept or "application/json", **(headers or {})}
        given = {key: value for key, value in (params or {}).items() if value is not None}
        url = self.base + path.lstrip("/")
        end = time.monotonic() + self.patience
        while True:
            if self._closed:
                raise ConnectionFailed(f"{self.name}: this server was closed by close(): start or "
                                       "connect to one again")
            try:
                with contextlib.ExitStack() as stack:
                    content = None
                    if file is not None:
                        content = _Body(stack.enter_context(file.open("rb")), progress)
                    answer = self._client.request(method, url, json=json, params=given or None,
                                                  headers=sent, content=content)
            except httpx.TransportError as error:
                raise ConnectionFailed(self._reason(error)) from error
            if 300 <= answer.status_code < 400:
                raise ConnectionFailed(f"{self.name} sends requests on to "
                                       f"{answer.headers.get('Location', 'nowhere')}: connect to "
                                       "the address of the server itself")
            if answer.status_code < 400:
                return answer
            problem = _problem(answer)
            if answer.status_code not in (429, 503):
                raise problem
            wait = problem.retry_after if problem.retry_after is not None else WAIT_WITHOUT_WORD
            wait *= random.uniform(1.0, 1.2)  # clients that were refused together come apart
            if time.monotonic() + wait > end:
                raise problem
            time.sleep(wait)

    def _reason(self, error: Exception) -> str:
        """Why there was no answer, as a sentence."""
        if ended := self.ended():
            return f"{self.name}: {ended}"
        if isinstance(error, httpx.ReadTimeout):
            return f"{self.name}: no answer within {self._timeout:g} s (timeout=...)"
        said = re.sub(r"^\[Errno -?\d+\] ", "", str(error)) or type(error).__name__
        return f"{self.name}: {said}"

    def get(self, path: str, **params: Any) -> Any:
        """The JSON document of a GET request."""
        answer = self.request("GET", path, params=params)
        try:
            return answer.json() if answer.content else None
        except ValueError:
            raise ConnectionFailed(f"{answer.url} is no address of a windsplat server: the answer "
                                   "is no JSON") from None


def _problem(answer: httpx.Response) -> Problem:
    try:
        document = answer.json()
    except ValueError:  # the answer of a proxy
        document = None
    if not isinstance(document, dict):
        text = answer.text.strip()[:200] or "without a text"
        document = {"title": answer.reason_phrase, "detail": text, "status": answer.status_code}
    after = seconds_of(answer.headers.get("Retry-After"))
    return problem_of(document, answer.status_code, after)
