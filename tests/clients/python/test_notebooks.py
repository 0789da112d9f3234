"""Runs the notebooks of the Python client from nothing, and looks at what they show.

The names of notebooks in the variable NOTEBOOKS, separated by commas, are those that are run.
"""
import base64
import io
import os
import pathlib
import tempfile
import unittest
import unittest.mock

import nbconvert.preprocessors
import nbformat
import numpy as np
import PIL.Image
from support import CLIENT, PROGRAM

FOLDER = CLIENT / "notebooks"
ALL = sorted(path.stem for path in FOLDER.glob("*.ipynb"))
# The movies that a notebook leaves: name, number of frames.
MOVIES = {
    "era5": {"weather.apng": 8},
    "wrf": {"run.apng": 3},
    "cfd": {"rise.apng": 4, "turn.apng": 8},
}


def pictures(notebook):
    """The images that the cells of a notebook show."""
    for cell in notebook.cells:
        for output in cell.get("outputs", ()):
            for kind in ("image/png", "image/jpeg"):
                if kind in output.get("data", {}):
                    data = base64.b64decode(output["data"][kind])
                    yield PIL.Image.open(io.BytesIO(data))


class Notebooks(unittest.TestCase):
    def run_notebook(self, name):
        notebook = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
        kept = os.environ.get("NOTEBOOK_FOLDER")
        with tempfile.TemporaryDirectory() as folder:
            variables = {"PYTHONPATH": str(CLIENT), "WINDSPLAT": PROGRAM,
                         "PYTHONWARNINGS": "ignore", "IPYTHONDIR": folder,
                         "PYDEVD_DISABLE_FILE_VALIDATION": "1"}
            with unittest.mock.patch.dict(os.environ, variables):
                runner = nbconvert.preprocessors.ExecutePreprocessor(timeout=240)
                runner.preprocess(notebook, {"metadata": {"path": folder}})
            for movie, frames in MOVIES[name].items():
                with PIL.Image.open(pathlib.Path(folder) / movie) as image:
                    self.assertEqual(image.n_frames, frames, movie)
                    first = np.asarray(image.convert("RGB"), dtype=float)
                    image.seek(frames // 3)
                    later = np.asarray(image.convert("RGB"), dtype=float)
                    self.assertGreater(np.abs(later - first).mean(), 0.3, movie)
        if kept:
            nbformat.write(notebook, pathlib.Path(kept) / f"{name}.ipynb")
        shown = list(pictures(notebook))
        self.assertGreaterEqual(len(shown), 3)
        for image in shown:
            self.assertGreater(np.asarray(image.convert("L"), dtype=float).std(), 8)

    def test_notebooks_run_from_nothing_to_a_movie(self):
        for name in os.environ.get("NOTEBOOKS", ",".join(ALL)).split(","):
            with self.subTest(name):
                self.run_notebook(name)

    def test_outputs_are_not_kept_in_the_repository(self):
        self.assertEqual(set(ALL), set(MOVIES))
        for name in ALL:
            notebook = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
            for cell in notebook.cells:
                self.assertFalse(cell.get("outputs"), name)
                self.assertIsNone(cell.get("execution_count"), name)


if __name__ == "__main__":
    unittest.main()
