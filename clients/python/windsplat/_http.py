"""Requests to a server: base address, token, waiting as asked for, errors as Problems."""
from __future__ import annotations

import contextlib
import ipaddress
import pathlib
import random
import ssl
import time
from typing import Any, Mapping

import httpx

from .errors import ConnectionFailed, Problem, problem_of

WAIT_WITHOUT_WORD = 1.0  # seconds, of a refusal without Retry-After


def base_of(url: str) -> str:
    """The address of a server, with its base path, ending in a slash."""
    if "://" not in url:
        url = "http://" + url
    parsed = httpx.URL(url)
    if parsed.scheme not in ("http", "https") or not parsed.host:
        raise ValueError(f"'{url}' is not an address such as http://127.0.0.1:8080")
    return str(parsed.copy_with(query=None, fragment=None)).rstrip("/") + "/"


def is_loopback(host: str) -> bool:
    """Whether a host is this machine, which no proxy of the environment should stand before."""
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost"


def seconds_of(header: str | None) -> float | None:
    """The seconds of a Retry-After header; dates are not sent by windsplat."""
    try:
        return max(0.0, float(header)) if header is not None else None
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


class Http:
    """Requests below one address. Safe to use from several threads."""

    def __init__(self, url: str, token: str | None, timeout: float, patience: float,
                 verify: bool | str | ssl.SSLContext = True) -> None:
        self.base = base_of(url)
        self.loopback = is_loopback(httpx.URL(self.base).host)
        self.tls: ssl.SSLContext | None = None
        if self.base.startswith("https:"):
            self.tls = _tls_of(verify)
        self.token = token
        self.patience = patience
        headers = {"User-Agent": "windsplat-python"}
        if token:
            headers["Authorization"] = f"Bearer {token}"
        # Pictures are rendered before the first byte is sent, hence the long time to read.
        self._client = httpx.Client(
            headers=headers, timeout=httpx.Timeout(timeout, connect=min(timeout, 10.0)),
            verify=True if self.tls is None else self.tls, trust_env=not self.loopback,
        )

    def close(self) -> None:
        self._client.close()

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
            if self._client.is_closed:
                raise ConnectionFailed(f"{self.base}: this server was closed by close(): start or "
                                       "connect to one again")
            try:
                with contextlib.ExitStack() as stack:
                    content = None if file is None else stack.enter_context(file.open("rb"))
                    answer = self._client.request(method, url, json=json, params=given or None,
                                                  headers=sent, content=content)
            except httpx.TransportError as error:
                raise ConnectionFailed(f"{self.base}: {error or type(error).__name__}") from error
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

    def get(self, path: str, **params: Any) -> Any:
        """The JSON document of a GET request."""
        answer = self.request("GET", path, params=params)
        return answer.json() if answer.content else None


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
