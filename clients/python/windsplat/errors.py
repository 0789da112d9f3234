"""Errors: all derive from WindsplatError; answers of a server are Problems (RFC 9457)."""
from __future__ import annotations

import dataclasses
from typing import Any, Mapping


class WindsplatError(Exception):
    """Base of the errors of this package."""


class StartFailed(WindsplatError):
    """The program could not be found or ended before it served."""


class ConnectionFailed(WindsplatError, ConnectionError):
    """The server cannot be reached, or the connection was lost."""


class JobTimeout(WindsplatError, TimeoutError):
    """A job did not end in time. It goes on at the server."""


class MovieFailed(WindsplatError):
    """A movie could not be encoded."""


class MissingPackage(WindsplatError, ImportError):
    """A Python package that is only needed for this is not installed."""


@dataclasses.dataclass(frozen=True)
class FieldError:
    """An invalid value of a document."""

    pointer: str
    """JSON pointer (RFC 6901) to the value."""
    detail: str
    """The violated constraint."""


class Problem(WindsplatError):
    """An answer that reports an error: what RFC 9457 calls a problem document."""

    def __init__(
        self,
        status: int,
        title: str,
        detail: str,
        *,
        errors: tuple[FieldError, ...] = (),
        type: str = "about:blank",
        request_id: str | None = None,
        retry_after: float | None = None,
    ) -> None:
        self.status = status
        self.title = title
        self.detail = detail
        self.errors = errors
        self.type = type
        self.request_id = request_id
        self.retry_after = retry_after
        """Seconds after which the server expects to answer, if it said so."""
        lines = [f"{status} {title}: {detail}" if status else detail]
        if len(errors) > 1:
            lines += [f"  {error.pointer or '/'}: {error.detail}" for error in errors]
        super().__init__("\n".join(lines))


class InvalidView(Problem):
    """A view or another value that is invalid (422): `errors` names each by its JSON pointer."""


class NotFound(Problem):
    """There is no such dataset, field, file or job (404)."""


class Unauthorized(Problem):
    """The token is missing or wrong (401), or what was asked for is not permitted (403)."""


class Busy(Problem):
    """The server is too busy, also after waiting as long as it said (429, 503)."""


_CLASSES: Mapping[int, type[Problem]] = {
    401: Unauthorized,
    403: Unauthorized,
    404: NotFound,
    422: InvalidView,
    429: Busy,
    503: Busy,
}


def problem_of(
    document: Mapping[str, Any], status: int | None = None, retry_after: float | None = None
) -> Problem:
    """The error of a problem document."""
    code = int(document.get("status") or status or 0)
    errors = tuple(
        FieldError(str(one.get("pointer", "")), str(one.get("detail", "")))
        for one in document.get("errors", ())
    )
    return _CLASSES.get(code, Problem)(
        code,
        str(document.get("title", "")),
        str(document.get("detail", "")),
        errors=errors,
        type=str(document.get("type", "about:blank")),
        request_id=document.get("requestId"),
        retry_after=retry_after,
    )
