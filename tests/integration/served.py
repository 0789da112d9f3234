"""A daemon on a free port of this machine, and requests to it."""
import http.client
import json
import subprocess
import sys
import time
import urllib.parse

import netCDF4
import numpy as np


def taken_program():
    """The program named by --program=PATH, an argument that is removed for unittest."""
    given = [one for one in sys.argv[1:] if one.startswith("--program=")]
    sys.argv[1:] = [one for one in sys.argv[1:] if one not in given]
    return given[0].partition("=")[2] if given else "build/release/windsplat"


def write_columns(path):
    """A map whose columns have longitudes and latitudes of their own."""
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("y", 9)
        file.createDimension("x", 12)
        rows, columns = np.meshgrid(np.arange(9), np.arange(12), indexing="ij")
        for name, units, values in (("lat", "degrees_north", 48 + 0.5 * rows + 0.1 * columns),
                                    ("lon", "degrees_east", 10 + 0.5 * columns - 0.1 * rows)):
            axis = file.createVariable(name, "f8", ("y", "x"))
            axis.units = units
            axis[:] = values
        variable = file.createVariable("t", "f4", ("y", "x"))
        variable.units, variable.coordinates = "K", "lon lat"
        variable[:] = rows * 100 + columns


class Answer:
    def __init__(self, response):
        self.status = response.status
        self.headers = response.headers
        self.body = response.read()

    def json(self):
        return json.loads(self.body)

    def detail(self):
        """Status and detail of a problem; the invalid values follow."""
        problem = self.json()
        return self.status, problem.get("detail", "") + "".join(
            f' {one["pointer"]} {one["detail"]}' for one in problem.get("errors", []))


class Daemon:
    def __init__(self, program, *arguments, log=subprocess.DEVNULL):
        self.process = subprocess.Popen(
            [program, "serve", *map(str, arguments), "--listen", "127.0.0.1:0"],
            stdout=subprocess.PIPE, stderr=log, text=True)
        self.root = self.process.stdout.readline().strip()
        self.host = urllib.parse.urlsplit(self.root).netloc

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.end()

    def end(self):
        self.process.terminate()
        try:
            self.process.communicate(timeout=30)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.communicate()

    def kill(self):
        self.process.kill()
        self.process.communicate()

    def ask(self, method, path, body=None, headers=None):
        client = http.client.HTTPConnection(self.host, timeout=60)
        try:
            client.request(method, path, body, headers or {})
            return Answer(client.getresponse())
        finally:
            client.close()

    def get(self, path, **headers):
        return self.ask("GET", path, headers={name.replace("_", "-"): value
                                              for name, value in headers.items()})

    def post(self, path, document):
        return self.ask("POST", path, json.dumps(document), {"Content-Type": "application/json"})

    def metric(self, series):
        """The value of a series, by its name with labels."""
        lines = self.get("/metrics").body.decode().splitlines()
        found, = (line for line in lines if line.startswith(f"{series} "))
        return int(float(found.rpartition(" ")[2]))

    def finished(self, job, seconds=30):
        """The state of a job, by its location, once it has ended."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            state = self.get(job).json()
            if state["state"] not in ("queued", "running"):
                return state
            time.sleep(0.02)
        raise AssertionError(state)
