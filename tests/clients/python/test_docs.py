"""Runs the examples of the documents, in their order, in a folder with the file that they name."""
import contextlib
import io
import os
import pathlib
import re
import subprocess
import tempfile
import unittest
import unittest.mock

from support import CLIENT, PROGRAM, ROOT

TUTORIAL = ROOT / "docs" / "user" / "python.md"
README = CLIENT / "README.md"


def examples(path, language):
    """(line, text) of the blocks of code of a document."""
    text = path.read_text()
    for match in re.finditer(rf"^```{language}\n(.*?)^```$", text, re.M | re.S):
        yield text.count("\n", 0, match.start()) + 2, match.group(1)


class Documents(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(self.folder)
        # The command with which the tutorial makes its file.
        shell = "\n".join(text for _, text in examples(TUTORIAL, "sh"))
        (command,) = re.findall(r"^windsplat (synth .*? -o winds\.nc)", shell, re.M)
        subprocess.run([PROGRAM, *command.split()], check=True, capture_output=True)

    def run_examples(self, path):
        said = io.StringIO()
        names = {"__name__": "__main__"}
        with unittest.mock.patch.dict(os.environ, {"WINDSPLAT": PROGRAM}):
            with contextlib.redirect_stdout(said):
                for line, text in examples(path, "python"):
                    # Line numbers of errors are those of the document.
                    exec(compile("\n" * (line - 1) + text, str(path), "exec"), names)
        return said.getvalue()

    def test_the_tutorial_does_what_it_says(self):
        said = self.run_examples(TUTORIAL)
        for text in ("wind vector m s-1", "404", "/camera/fov_y: unknown key: did you mean 'fovY'?",
                     "magnitude {'dataset': 'winds'", "(450, 800, 4) float32", "final, rev 1",
                     "('z', 'y', 'x') (4, 11, 16)", "winds-", "403 uploads are disabled"):
            self.assertIn(text, said)
        for name, start in (("winds.png", b"\x89PNG"), ("figure.pdf", b"%PDF"),
                            ("section.png", b"\x89PNG"),
                            ("around.zip", b"PK"), ("turn.apng", b"\x89PNG"),
                            ("arrays.png", b"\x89PNG"), ("cloud.png", b"\x89PNG")):
            self.assertTrue((self.folder / name).read_bytes().startswith(start), name)

    def test_the_examples_of_the_readmes_run(self):
        self.run_examples(README)
        self.assertTrue((self.folder / "winds.apng").is_file())
        self.run_examples(ROOT / "README.md")
        self.assertGreater((self.folder / "winds.png").stat().st_size, 10_000)


if __name__ == "__main__":
    unittest.main()
