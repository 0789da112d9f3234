"""A server: one that runs somewhere, or one that this process starts."""
from __future__ import annotations

import base64
import contextlib
import hashlib
import os
import pathlib
import re
import secrets
import ssl
import time
from typing import TYPE_CHECKING, Any, Callable, Iterable, Mapping, Sequence

from ._documents import suggestion
from ._http import Http
from ._process import Process, find_program, is_below
from ._zarr import packed
from .dataset import Dataset
from .errors import (
    ConnectionFailed,
    JobTimeout,
    NotFound,
    WindsplatError,
    problem_of,
)
from .view import View

if TYPE_CHECKING:
    from .stream import Stream

POLL_FIRST, POLL_MOST = 0.02, 0.5  # seconds between two questions about a job
# Pages that may show the live view in a frame: Jupyter on this machine, on its usual ports.
NOTEBOOKS = tuple(f"http://{host}:{port}" for host in ("localhost", "127.0.0.1")
                  for port in (8888, 8889, 8890))


class Server:
    """A windsplat server. Made by connect() or Server.start()."""

    def __init__(self, url: str, token: str | None = None, *, timeout: float = 180,
                 patience: float = 60, verify: bool | str | ssl.SSLContext = True) -> None:
        """timeout: seconds to wait for an answer. patience: seconds in all for which a request
        that the server is too busy for is repeated, as it asks for (Retry-After). verify: of
        https, a file of certificates to trust instead of those of the system."""
        self.http = Http(url, token, timeout, patience, verify)
        self._process: Process | None = None
        self._root: pathlib.Path | None = None
        self._schema: dict[str, Any] | None = None

    @classmethod
    def start(
        cls, *files: str | os.PathLike[str], program: str | os.PathLike[str] | None = None,
        data_root: str | os.PathLike[str] | None = None,
        allow_embed: Sequence[str] = NOTEBOOKS, start_timeout: float = 120,
        **options: Any,
    ) -> Server:
        """Starts `windsplat serve` on a free port of this machine and connects to it. It ends
        with close(), at the end of a `with` block or of this process.

        files: files, patterns or samples to serve; without any the built-in samples.
        program: the program; otherwise $WINDSPLAT, otherwise windsplat in PATH.
        data_root: a folder whose files may be opened later, see open().
        allow_embed: web origins of pages that may show view.widget().
        options: further options of `windsplat serve`: threads=2, memory_limit="4G". The token of
            token_file is used, and the certificate tls_cert trusted.

        Raises StartFailed with what the program said.
        """
        root = None if data_root is None else pathlib.Path(data_root).resolve()
        given = {"data_root": root, "allow_embed": list(allow_embed), "log_level": "warn",
                 **options}
        process = Process(find_program(program), [os.fspath(one) for one in files], given,
                          start_timeout)
        try:
            token = options.get("token_file")
            server = cls(
                process.url,
                None if token is None else pathlib.Path(token).read_text("utf-8").strip(),
                verify=os.fspath(options.get("tls_cert", "")) or True,
            )
        except BaseException:
            process.close()
            raise
        server._process = process
        server.http.ended = process.ended
        server._root = root
        return server

    def close(self) -> None:
        """Closes the connection, and ends the server if it was started here."""
        self.http.close()
        if self._process is not None:
            self._process.close()

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def url(self) -> str:
        """The address, ending in a slash; of a UNIX socket unix: and its path."""
        return self.http.base if self.http.socket is None else self.http.name

    @property
    def page(self) -> str:
        """The address of the page in a browser. Raises ValueError for a UNIX socket, which no
        browser opens."""
        if self.http.socket is not None:
            raise ValueError(f"a browser does not reach {self.url}: use view.live() in Jupyter, or "
                             "connect to an address of http")
        return self.http.base

    @property
    def log(self) -> str:
        """The last lines of the log of a server that was started here."""
        return "" if self._process is None else self._process.log

    @property
    def version(self) -> str:
        return str(self.http.get("v1")["version"])

    @property
    def limits(self) -> Mapping[str, Any]:
        """The limits of the server (GET /v1)."""
        limits = self.http.get("v1")["limits"]
        assert isinstance(limits, dict)
        return limits

    @property
    def view_schema(self) -> dict[str, Any]:
        """The schema of the views of this server."""
        if self._schema is None:
            self._schema = self.http.get("view.schema.json")
        assert self._schema is not None
        return self._schema

    @property
    def colormaps(self) -> list[str]:
        """Names of the colour maps."""
        return [str(one["name"]) for one in self.http.get("v1/colormaps")["colormaps"]]

    @property
    def datasets(self) -> dict[str, Dataset]:
        """The datasets that the server lists, by id."""
        listed = self.http.get("v1/datasets")["datasets"]
        return {one["id"]: Dataset(self, one["id"]) for one in listed}

    def __getitem__(self, id: str) -> Dataset:
        """The dataset with this id. Raises NotFound with a suggestion."""
        known = self.datasets
        if id not in known:
            what = suggestion(id, list(known)) if known else "the server lists none"
            raise NotFound(404, "Not Found", f"there is no dataset '{id}': {what}")
        return known[id]

    def open(
        self, path: str | os.PathLike[str] | Iterable[str | os.PathLike[str]], *,
        selection: Mapping[str, Any] | None = None, title: str | None = None,
        timeout: float = 300,
    ) -> Dataset:
        """Opens a file, a pattern, a list of files, or a URL of a permitted host, and waits for
        it.

        path: below the folder `data_root` of the server; of a server started here also absolute.
        selection: chosen entries of other dimensions: {"number": 3}.
        title: of a list.

        Raises the Problem that the server reports, JobTimeout after `timeout` seconds.
        """
        body: dict[str, Any]
        if isinstance(path, (str, os.PathLike)):
            name = self._name_of(path)
            if selection:
                name += "?" + "&".join(f"{key}={value}" for key, value in selection.items())
            body = {"path": name}
        else:
            body = {"files": [self._name_of(one) for one in path]}
            if selection:
                body["selection"] = dict(selection)
            if title is not None:
                body["title"] = title
        return self._opened(body, timeout)

    def upload(self, path: str | os.PathLike[str], *, keep: float = 3600, timeout: float = 300,
               progress: Callable[[int, int], object] | None = None) -> Dataset:
        """Sends a file to the server and opens it there; for servers that were started with
        --upload-limit and --state-dir. It is removed after `keep` seconds, or by
        dataset.close(forget=True).

        path: a file, or the folder of a Zarr store, which is packed before, as a temporary file of
            the same size (folder: TMPDIR).
        progress: called as progress(bytes sent, all bytes), from 0.

        Raises Unauthorized if the server takes no uploads, ValueError for another folder, and what
        open() raises.
        """
        whole = pathlib.Path(path)
        with packed(whole) if whole.is_dir() else contextlib.nullcontext(whole) as file:
            name = self._send(file, keep, progress)
        try:
            dataset = self._opened({"upload": name}, timeout)
        except BaseException:
            with contextlib.suppress(WindsplatError):
                self.http.request("DELETE", f"v1/uploads/{name}")
            raise
        dataset.upload_id = name
        return dataset

    def _send(self, whole: pathlib.Path, keep: float,
              progress: Callable[[int, int], object] | None) -> str:
        """Uploads a file. Returns its name at the server."""
        digest = hashlib.sha256()
        with whole.open("rb") as file:
            while block := file.read(1 << 20):
                digest.update(block)
        # Whoever knows the name may read the file: it is not to be guessed.
        stem = re.sub(r"[^A-Za-z0-9_]+", "-", whole.stem)[:40].strip("-") or "upload"
        suffix = whole.suffix if re.fullmatch(r"\.[A-Za-z0-9]{1,12}", whole.suffix) else ""
        name = f"{stem}-{secrets.token_hex(8)}{suffix}"
        value = base64.b64encode(digest.digest()).decode()
        self.http.request("PUT", f"v1/uploads/{name}", file=whole, params={"keep": int(keep)},
                          progress=progress, headers={"Content-Digest": f"sha-256=:{value}:"})
        return name

    def entry(self, dataset: Dataset, timeout: float = 300, **selection: Any) -> Dataset:
        """Another entry of a dataset with choices: server.entry(ds, number=3)."""
        return self._opened({"from": dataset.id, "selection": selection}, timeout)

    def _name_of(self, path: str | os.PathLike[str]) -> str:
        name = os.fspath(path)
        if self._root is None or "://" in name or not os.path.isabs(name):
            return name
        whole = pathlib.Path(name)
        whole = whole.parent.resolve() / whole.name
        if not is_below(whole, self._root):
            raise ValueError(f"'{name}' is not below the folder '{self._root}' of the server")
        return whole.relative_to(self._root).as_posix()

    def _opened(self, body: Mapping[str, Any], timeout: float) -> Dataset:
        job = self.http.request("POST", "v1/datasets", json=dict(body)).json()
        return Dataset(self, str(self.finished(job, timeout)))

    def finished(self, job: Mapping[str, Any], timeout: float,
                 progress: Callable[[float], object] | None = None) -> Any:
        """The result of a job. `progress` is called with the fraction that is done. Raises its
        Problem or JobTimeout."""
        end = time.monotonic() + timeout
        pause = POLL_FIRST
        while job["state"] not in ("done", "failed", "cancelled"):
            if time.monotonic() + pause > end:
                raise JobTimeout(f"job {job['id']} ({job['kind']}) was not ready after "
                                 f"{timeout:g} s")
            time.sleep(pause)
            pause = min(POLL_MOST, pause * 1.5)
            job = self.http.get(f"v1/jobs/{job['id']}")
            if progress is not None:
                progress(float(job["progress"]))
        if job["state"] == "failed":
            raise problem_of(job["problem"])
        if job["state"] == "cancelled":
            raise WindsplatError(f"job {job['id']} was cancelled")
        return job["result"]

    def stream(self, view: View) -> Stream:
        """A live stream of frames of a view: `async with server.stream(view) as stream`."""
        from .stream import Stream

        return Stream(self, view)

    def __repr__(self) -> str:
        return f"<Server {self.url}{' (started here)' if self._process else ''}>"


def connect(url: str, token: str | None = None, *, timeout: float = 180, patience: float = 60,
            verify: bool | str | ssl.SSLContext = True) -> Server:
    """Connects to a server. Raises ConnectionFailed or Unauthorized at once.

    url: http://HOST:PORT/BASE/, https://..., or unix:/PATH of a socket, as `serve --listen` has it.
    The other options are those of Server.
    """
    server = Server(url, token, timeout=timeout, patience=patience, verify=verify)
    try:
        about = server.http.get("v1")
        if not isinstance(about, dict) or "version" not in about:
            raise ConnectionFailed(f"{server.url} is no windsplat server: v1 names no version")
    except BaseException:
        server.close()
        raise
    return server


def open(*files: str | os.PathLike[str], **options: Any) -> Dataset:
    """Starts a server for one dataset and returns it: windsplat.open("winds.nc").view(). Several
    files are several datasets: use Server.start. The server ends with this process, or with
    dataset.server.close()."""
    if len(files) != 1:
        raise ValueError("windsplat.open takes one file, pattern or sample; "
                         "several are opened by Server.start")
    server = Server.start(*files, strict=True, **options)
    return next(iter(server.datasets.values()))
