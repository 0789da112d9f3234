"""Times of steps: which step a time names."""
from __future__ import annotations

import datetime
import re
from typing import TYPE_CHECKING, Any, Sequence

from .errors import InvalidView

if TYPE_CHECKING:
    from numpy.typing import NDArray

# As the parameter `datetime` of the REST interface; all of the time of day may be left out.
TEXT = re.compile(r"(\d{4}-\d\d-\d\d)(?:(?:T| )(\d\d:\d\d(?::\d\d(?:\.\d{1,6})?)?)"
                  r"(?:Z|([+-])(\d\d):(\d\d))?)?")
SAME = 1e-9  # relative difference of equal coordinates without dates


def milliseconds_of(time: Any) -> Any:
    """A text, datetime or datetime64 as datetime64[ms] in UTC. Raises ValueError."""
    import numpy as np

    if isinstance(time, datetime.datetime) and time.tzinfo is not None:
        time = time.astimezone(datetime.timezone.utc).replace(tzinfo=None)
    if isinstance(time, (np.datetime64, datetime.date)):  # datetime is a date
        return np.datetime64(time, "ms")
    parts = TEXT.fullmatch(time) if isinstance(time, str) else None
    if parts is None:
        raise ValueError(f"{time!r} is no time: give a text such as 2001-01-01T06:00, a datetime "
                         "or a datetime64")
    day, clock, sign, hours, minutes = parts.groups()
    out = np.datetime64(f"{day}T{clock or '00:00'}", "ms")
    if sign:
        offset = np.timedelta64(60 * int(hours) + int(minutes), "m")
        out = out - offset if sign == "+" else out + offset
    return out


def step_of(times: NDArray[Any], time: Any, nearest: bool, texts: Sequence[str]) -> int:
    """The step at a time, of equal ones the first; `nearest`: the nearest, of two the earlier.
    Raises InvalidView with the steps before and after it."""
    import numpy as np

    if times.dtype.kind == "M":
        wanted = milliseconds_of(time)
        same = times == wanted
    else:
        try:
            wanted = float(time)
        except (TypeError, ValueError):
            raise ValueError(f"{time!r} is no time: the steps have no dates, give a number from "
                             f"{times.min():g} to {times.max():g}") from None
        same = np.abs(times - wanted) <= SAME * np.abs(times)
    if same.any():
        return int(np.argmax(same))
    if nearest:
        distance = np.abs(times - wanted)
        near = np.flatnonzero(distance == distance.min())
        return int(near[np.argmin(times[near])])
    order = np.argsort(times, kind="stable")
    after = int(np.searchsorted(times[order], wanted))
    said = [f"the one {word} is {texts[order[at]]} (step {order[at]})"
            for word, at in (("before", after - 1), ("after", after)) if 0 <= at < len(order)]
    raise InvalidView(0, "Invalid time", f"time: no step is at {time}; {', '.join(said)}; "
                      "nearest=True takes the nearest")
