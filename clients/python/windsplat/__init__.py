"""Pictures and movies of 3-D vector and scalar fields from a windsplat server.

    import windsplat

    with windsplat.Server.start("winds.nc") as server:
        view = server["winds"].view(size=(800, 450)).look(azimuth=30, elevation=40)
        view.save("winds.png")
"""
from .dataset import Dataset, Field, Histogram, Position, Probe, Series, Step, Values
from .errors import (
    Busy,
    ConnectionFailed,
    FieldError,
    InvalidView,
    JobTimeout,
    MissingPackage,
    MovieFailed,
    NotFound,
    Problem,
    StartFailed,
    Unauthorized,
    WindsplatError,
)
from .frame import Error, Frame, Report
from .movie import Movie, movie
from .server import Server, connect, open
from .stream import Stream, StreamFrame
from .view import View

__version__ = "0.1.0"

__all__ = [
    "Busy", "ConnectionFailed", "Dataset", "Error", "Field", "FieldError", "Frame", "Histogram",
    "InvalidView", "JobTimeout", "MissingPackage", "Movie", "MovieFailed", "NotFound", "Position",
    "Probe", "Problem", "Report", "Series", "Server", "StartFailed", "Step", "Stream",
    "StreamFrame", "Unauthorized", "Values", "View", "WindsplatError", "connect", "movie", "open",
]
