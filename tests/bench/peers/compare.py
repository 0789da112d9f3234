#!/usr/bin/env python3
"""Compares windsplat with VTK: the same file, camera path and picture sizes in one run. Prints a
Markdown table. Without VTK it prints a message and exits 0.

Usage: compare.py [--build=build/release] [--frames=9] [--sizes=640x480,1280x720] [--dims=XxYxZ]
                  [--sample=climate|tornado] [--pictures=DIR] [--slow] [--only=TEXT]

--slow adds translucent lines with depth peeling, which takes minutes."""
import argparse
import json
import math
import os
import pathlib
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
MB = 1e6
FOV_Y = 35  # degrees
STEP = 1    # camera movement, degrees per frame

# The rendered data in world units (windsplat's: the longest edge of the box is 2).
SAMPLES = {
    "climate": {"dimensions": "(level, lat, lon)", "half_box": [1, 0.5, 0.15],
                "components": ["u", "v", "w"], "top_magnitude": 100, "line_length": 0.04,
                "extinction": [[0.2, 0], [1, 25]], "distance": 2.9},
    "tornado": {"dimensions": "(z, y, x)", "half_box": [1, 1, 1],
                "components": ["u", "v", "w"], "top_magnitude": 80, "line_length": 0.1,
                "extinction": [[0.2, 0], [1, 12]], "distance": 5.5},
}


class Skip(Exception):
    pass


def vtk_python():
    """A Python interpreter with VTK: this one, or the system's, for which Debian packages VTK."""
    for python in (sys.executable, "/usr/bin/python3"):
        probe = subprocess.run([python, "-c", "import vtkmodules"], capture_output=True)
        if probe.returncode == 0:
            return python
    raise Skip("VTK is not installed (apt-get install python3-vtk9)")


class Display:
    """The X server that Debian's VTK needs: the existing one, or a virtual one that ends with
    this object."""

    def __enter__(self):
        self.server = None
        self.environment = dict(os.environ)
        if "DISPLAY" in os.environ:
            return self.environment
        if shutil.which("Xvfb") is None:
            raise Skip("VTK has no display and Xvfb is not installed (apt-get install xvfb)")
        told, tell = os.pipe()
        self.server = subprocess.Popen(["Xvfb", "-displayfd", str(tell), "-screen", "0",
                                        "1920x1080x24", "-nolisten", "tcp"], pass_fds=[tell],
                                       stderr=subprocess.DEVNULL)
        os.close(tell)
        with os.fdopen(told) as pipe:
            number = pipe.readline().strip()
        if not number:
            raise Skip("the virtual display did not start")
        self.environment["DISPLAY"] = ":" + number
        return self.environment

    def __exit__(self, *_):
        if self.server is not None:
            self.server.terminate()
            self.server.wait()


def eyes(sample, frames):
    elevation = math.radians(35)
    out = []
    for n in range(frames):
        azimuth = math.radians(20 + STEP * n)
        out.append([sample["distance"] * math.cos(elevation) * math.sin(azimuth),
                    -sample["distance"] * math.cos(elevation) * math.cos(azimuth),
                    sample["distance"] * math.sin(elevation)])
    return out


class Bench:
    def __init__(self, options, folder, python, display):
        self.options = options
        self.sample = SAMPLES[options.sample]
        self.build = pathlib.Path(options.build)
        self.folder = folder
        self.python = python
        self.display = display
        self.file = f"{folder}/{options.sample}.nc"
        self.pictures = pathlib.Path(options.pictures or folder)
        self.pictures.mkdir(parents=True, exist_ok=True)
        self.threads = os.cpu_count() or 1
        command = [self.build / "windsplat", "synth", options.sample, "--steps", "1", "-o",
                   self.file]
        if options.dims:
            command += ["--dims", options.dims]
        subprocess.run(command, check=True)

    def picture(self, *words):
        name = "-".join(words).replace(" ", "-").replace("+", "and").replace(",", "")
        return str(self.pictures / f"{self.options.sample}-{name}.png")

    def view(self, eye, size, scene, method):
        vector = {"field": None}
        if "lines" in scene:
            top = self.sample["top_magnitude"]
            vector = {"magnitudeRange": [0, top], "minMagnitude": 1e-3 * top,
                      "length": self.sample["line_length"], "color": {"by": "worldZ"}}
        scalars = []
        if "clouds" in scene:
            scalars = [{"field": "cloud", "color": {"map": "grays", "range": [0, 0.2]},
                        "extinction": self.sample["extinction"]}]
        return {"camera": {"eye": eye, "target": [0, 0, 0], "fovY": FOV_Y},
                "image": {"width": size[0], "height": size[1]},
                "geometry": {"vertical": "index"}, "vector": vector, "scalars": scalars,
                "depthCue": {"strength": 0}, "method": {"name": method, "detail": "full"}}

    def windsplat(self, size, scene, method):
        path = f"{self.folder}/views.jsonl"
        with open(path, "w", encoding="utf-8") as views:
            for eye in eyes(self.sample, self.options.frames):
                views.write(json.dumps(self.view(eye, size, scene, method)) + "\n")
        picture = self.picture("windsplat", method, scene, f"{size[0]}x{size[1]}")
        done = subprocess.run([self.build / "tests/bench_path", self.file, path, picture],
                              check=True, capture_output=True, text=True)
        return json.loads(done.stdout)

    def vtk(self, name, size, config):
        job = dict(self.sample, file=self.file, scalar="cloud", size=size, fov_y=FOV_Y,
                   eyes=eyes(self.sample, config.pop("frames", self.options.frames)),
                   threads=self.threads, opacity=1, peels=0,
                   picture=self.picture("vtk", name, f"{size[0]}x{size[1]}"))
        job.update(config)
        done = subprocess.run([self.python, HERE / "vtk_frames.py"], input=json.dumps(job),
                              env=self.display, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"VTK, {name}: {done.stderr.strip()[-2000:]}")
        return json.loads(done.stdout)


# Name, the windsplat scene to compare with, and the parts that VTK draws.
VTK_CONFIGS = [
    ("fixed-point ray cast", "clouds", {"volume": "fixed-point", "lines": False}),
    ("GPU ray cast on llvmpipe", "clouds", {"volume": "gpu", "lines": False}),
    ("opaque 1 px lines", "lines", {"volume": None, "lines": True}),
    ("opaque 1 px lines + fixed-point", "lines+clouds", {"volume": "fixed-point", "lines": True}),
    ("opaque 1 px lines + GPU ray cast", "lines+clouds", {"volume": "gpu", "lines": True}),
]
SLOW_CONFIGS = [
    ("translucent lines, 8 peels", "lines",
     {"volume": None, "lines": True, "opacity": 0.8, "peels": 8, "frames": 3}),
    ("translucent lines + GPU ray cast, 8 peels", "lines+clouds",
     {"volume": "gpu", "lines": True, "opacity": 0.8, "peels": 8, "frames": 3}),
]


def median(result, key):
    return statistics.median(frame[key] for frame in result["frames"])


def row(size, scene, name, result, reference):
    cells = [f"{size[0]}x{size[1]}", scene, name, f"{median(result, 'wall_ms'):.1f}",
             f"{median(result, 'cpu_ms'):.1f}", f"{result['peak_bytes'] / MB:.0f}"]
    for key in ("wall_ms", "cpu_ms"):
        cells.append(f"{median(result, key) / median(reference, key):.2f}x")
    print("| " + " | ".join(cells) + " |", flush=True)


def table(bench, configs):
    """Runs both programs once and returns the results, to print their versions."""
    print("| size | scene | renderer | wall, ms | CPU, ms | peak, MB | wall / kernel | "
          "CPU / kernel |\n|---|---|---|---|---|---|---|---|")
    ours = peer = None
    for text in bench.options.sizes.split(","):
        size = [int(part) for part in text.split("x")]
        for scene in dict.fromkeys(config[1] for config in configs):
            ours = bench.windsplat(size, scene, "kernel")
            row(size, scene, "windsplat kernel, to JPEG", ours, ours)
            slab = bench.windsplat(size, scene, "slab")
            row(size, scene, "windsplat slab, to JPEG", slab, ours)
            for name, of, config in configs:
                if of != scene:
                    continue
                peer = bench.vtk(name, size, dict(config))
                row(size, scene, f"VTK {name}", peer, ours)
    return ours, peer


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", default=str(HERE.parents[2] / "build/release"))
    parser.add_argument("--frames", type=int, default=9)
    parser.add_argument("--sizes", default="640x480,1280x720")
    parser.add_argument("--sample", choices=sorted(SAMPLES), default="climate")
    parser.add_argument("--dims")
    parser.add_argument("--pictures", help="folder for the first frames")
    parser.add_argument("--slow", action="store_true")
    parser.add_argument("--only", default="", help="VTK configurations whose name has this text")
    options = parser.parse_args()
    configs = VTK_CONFIGS + (SLOW_CONFIGS if options.slow else [])
    names = ", ".join(config[0] for config in configs)
    configs = [config for config in configs if options.only in config[0]]
    missing = [name for name in ("windsplat", "tests/bench_path")
               if not (pathlib.Path(options.build) / name).exists()]
    if missing:
        parser.error(f"{options.build} has no {' and no '.join(missing)}: "
                     "./scripts/build release windsplat bench_path")
    if not configs:
        parser.error(f"no VTK configuration is named '{options.only}'; known names: {names}")
    try:
        python = vtk_python()
        with Display() as display, tempfile.TemporaryDirectory() as folder:
            bench = Bench(options, folder, python, display)
            ours, peer = table(bench, configs)
    except Skip as reason:
        print(f"skipped: {reason}")
        return
    print(f"\n{ours['processor']}, {ours['hardware_threads']} hardware threads, "
          f"{platform.system()}; windsplat {ours['windsplat']} by "
          f"{ours['compiler']}, target {ours['target']}; VTK {peer['version']} on {peer['gl']}. "
          f"Sample {options.sample} {options.dims or 'at its own size'}, {peer['lines']} lines in "
          f"the last row. Medians of {options.frames} warm frames, the camera moving {STEP} degree "
          "each; CPU time is of all threads.")


main()
