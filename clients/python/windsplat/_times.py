"""Times of steps in the calendars of CF: which step a time names, and arrays of them."""
from __future__ import annotations

import datetime
import re
from typing import TYPE_CHECKING, Any, Mapping, Sequence

from .errors import InvalidView

if TYPE_CHECKING:
    from numpy.typing import NDArray

# As the parameter `datetime` of the REST interface, besides years of more digits.
TEXT = re.compile(r"(-?\d{4,8})-(\d\d)-(\d\d)"
                  r"(?:[T ](\d\d):(\d\d)(?::(\d\d)(\.\d{1,9})?)?(?:Z|([+-])(\d\d):(\d\d))?)?")
SAME = 1e-9  # relative difference of equal coordinates without dates
DAY = 86_400_000  # milliseconds
# Other names of calendars, which are those of CF.
CALENDARS: Mapping[str, str] = {
    "": "standard", "gregorian": "standard", "365_day": "noleap", "366_day": "all_leap",
    **{name: name for name in ("standard", "proleptic_gregorian", "julian", "noleap", "all_leap",
                               "360_day")}}
REFORM = (1582, 10, 15)  # the first Gregorian day of `standard`, after 4 October
MONTHS = (31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31)


def _is_leap(year: int, calendar: str) -> bool:
    if calendar in ("noleap", "all_leap"):
        return calendar == "all_leap"
    return year % 4 == 0 and (calendar == "julian" or year % 100 != 0 or year % 400 == 0)


def _days_before(year: int, calendar: str) -> int:
    """Days of the years from 0 to the one before."""
    def leaps(every: int) -> int:
        return -(-year // every)

    if calendar in ("noleap", "all_leap"):
        return year * (365 + (calendar == "all_leap"))
    return 365 * year + leaps(4) - (0 if calendar == "julian" else leaps(100) - leaps(400))


def day_number(year: int, month: int, day: int, calendar: str) -> int:
    """Days since the calendar's own day zero. Raises ValueError for a date that it has not."""
    if calendar == "360_day":
        if not (1 <= month <= 12 and 1 <= day <= 30):
            raise ValueError
        return 360 * year + 30 * (month - 1) + day - 1
    if calendar == "standard":
        if (year, month, day) >= REFORM:
            return day_number(year, month, day, "proleptic_gregorian")
        if (year, month, day) > (1582, 10, 4):
            raise ValueError
        shift = day_number(*REFORM, "proleptic_gregorian") - day_number(*REFORM, "julian") + 10
        return day_number(year, month, day, "julian") + shift
    lengths = list(MONTHS)
    lengths[1] += _is_leap(year, calendar)
    if not (1 <= month <= 12 and 1 <= day <= lengths[month - 1]):
        raise ValueError
    return _days_before(year, calendar) + sum(lengths[: month - 1]) + day - 1


def is_date(text: str) -> bool:
    """Whether the text of a step is a date."""
    return TEXT.fullmatch(text) is not None


def _text_of(time: Any, calendar: str) -> Any:
    """A time as text. Raises ValueError for one of another calendar."""
    import numpy as np

    if getattr(time, "shape", None) == ():  # arrays without dimensions, as times of xarray
        time = np.asarray(time)[()]
    if isinstance(time, np.datetime64):
        return str(time.astype("datetime64[us]"))
    if isinstance(time, datetime.date):  # datetime is a date
        return time.isoformat()
    own = getattr(time, "calendar", None)
    if not isinstance(own, str) or not hasattr(time, "isoformat"):
        return time
    own = CALENDARS.get(own.lower(), own)  # a time of cftime
    alike = {own, calendar} == {"standard", "proleptic_gregorian"} and (
        time.year, time.month, time.day) >= REFORM
    if own != calendar and not alike:
        raise ValueError(f"{time.isoformat()} is a time of the calendar '{own}', the steps are of "
                         f"'{calendar}': give one of theirs, or a text")
    return time.isoformat()


def moment_of(time: Any, calendar: str) -> int:
    """A text, datetime, datetime64 or time of cftime in milliseconds of a calendar. datetime and
    datetime64 are read by their year, month and day. Raises ValueError."""
    text = _text_of(time, calendar)
    parts = TEXT.fullmatch(text) if isinstance(text, str) else None
    if parts is None:
        raise ValueError(f"{time!r} is no time: give a text such as 2001-01-01T06:00, a datetime, "
                         "a datetime64 or a time of cftime")
    year, month, day, hour, minute, second = (int(one or 0) for one in parts.groups()[:6])
    fraction, sign, hours, minutes = parts.groups()[6:]
    try:
        days = day_number(year, month, day, calendar)
        if hour > 23 or minute > 59 or second > 59:
            raise ValueError
    except ValueError:
        raise ValueError(f"'{text}' is no time of the calendar '{calendar}'") from None
    out = days * DAY + 1000 * (60 * (60 * hour + minute) + second)
    out += round(1000 * float(fraction or 0))
    if sign:
        offset = 60_000 * (60 * int(hours) + int(minutes))
        out += -offset if sign == "+" else offset
    return out


def dates_of(texts: Sequence[str], calendar: str) -> NDArray[Any]:
    """Dates as datetime64[ms], where it has all of them in the same order at the same distances;
    of other calendars as times of cftime, or as the texts without the package cftime."""
    import numpy as np

    plain = [text.removesuffix("Z") for text in texts]
    first = day_number(*REFORM, "standard") * DAY
    if calendar == "proleptic_gregorian" or (
            calendar == "standard" and all(moment_of(one, calendar) >= first for one in plain)):
        return np.array(plain, dtype="datetime64[ms]")
    try:
        import cftime
    except ImportError:
        return np.array(texts)
    out = np.empty(len(plain), dtype=object)
    for index, one in enumerate(plain):
        parts = TEXT.fullmatch(one)
        assert parts is not None
        year, *rest = (int(part or 0) for part in parts.groups()[:6])
        micro = round(1e6 * float(parts.group(7) or 0))
        more = {"has_year_zero": True} if year < 1 else {}
        out[index] = cftime.datetime(year, *rest, micro, calendar=calendar, **more)
    return out


def step_of(times: Sequence[float], time: float, nearest: bool, texts: Sequence[str],
            said: Any, tolerance: float = 0) -> int:
    """The step at a time, of equal ones the first; `nearest`: the nearest, of two the earlier.
    Raises InvalidView with the steps before and after it. said: the time as it was given."""
    for index, one in enumerate(times):
        if abs(one - time) <= tolerance * abs(one):
            return index
    if nearest:
        return min(range(len(times)), key=lambda at: (abs(times[at] - time), times[at]))
    before = [at for at in range(len(times)) if times[at] < time]
    after = [at for at in range(len(times)) if times[at] > time]
    around = [("before", max(before, key=lambda at: times[at]))] if before else []
    around += [("after", min(after, key=lambda at: times[at]))] if after else []
    words = [f"the one {word} is {texts[at]} (step {at})" for word, at in around]
    raise InvalidView(0, "Invalid time", f"time: no step is at {said}; {', '.join(words)}; "
                      "nearest=True takes the nearest")
