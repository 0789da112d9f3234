"""Servers that are started here: how they begin and end, with this process too."""
import asyncio
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import unittest.mock

from support import CLIENT, PROGRAM, shared_server, start, windsplat


def ends(process):
    """Whether a process ends, or waits to be collected by the one that adopted it."""
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        try:
            state = pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2]
        except (FileNotFoundError, ProcessLookupError):
            return True
        if state.split()[0] == "Z":
            return True
        time.sleep(0.05)
    return False


class Start(unittest.TestCase):
    def test_a_server_ends_with_its_block(self):
        with start("tornado:16") as server:
            self.assertEqual(list(server.datasets), ["tornado:16"])
            self.assertRegex(server.version, r"^\d+\.\d+\.\d+")
            url, view = server.url, server["tornado:16"].view(size=(16, 16))
            view.frame()
        with self.assertRaisesRegex(windsplat.ConnectionFailed, f"{url}.*closed by close"):
            view.frame()
        with self.assertRaises(windsplat.ConnectionFailed):
            windsplat.connect(url)

    def test_a_server_ends_with_a_process_that_is_killed(self):
        code = ("import sys, time, windsplat\n"
                "server = windsplat.Server.start('tornado:8', threads=1)\n"
                "print(server._process.pid, flush=True)\n"
                "time.sleep(600)\n")
        with subprocess.Popen([sys.executable, "-W", "ignore", "-c", code], cwd=CLIENT,
                              stdout=subprocess.PIPE, text=True) as process:
            server = int(process.stdout.readline())
            os.kill(server, 0)
            process.kill()
        self.assertTrue(ends(server))

    def test_a_fork_of_the_process_neither_ends_the_server_nor_keeps_it(self):
        code = ("import os, sys, time, windsplat\n"
                "server = windsplat.Server.start('tornado:8', threads=1)\n"
                "child = os.fork()\n"
                "if child == 0: sys.exit()\n"  # runs what is registered for the exit
                "os.waitpid(child, 0)\n"
                "print(len(server.datasets), server._process.pid, flush=True)\n"
                "if os.fork() == 0: time.sleep(600)\n"
                "print(flush=True)\n"
                "time.sleep(600)\n")
        with subprocess.Popen([sys.executable, "-W", "ignore", "-c", code], cwd=CLIENT,
                              start_new_session=True, stdout=subprocess.PIPE, text=True) as process:
            datasets, server = process.stdout.readline().split()
            process.stdout.readline()
            process.kill()
            self.addCleanup(os.killpg, process.pid, signal.SIGKILL)  # the second fork
        self.assertEqual(datasets, "1")
        self.assertTrue(ends(int(server)))

    def test_a_server_that_died_is_named_with_what_it_said(self):
        with start("tornado:8") as server:
            os.kill(server._process.pid, signal.SIGKILL)
            server._process._process.wait()
            with self.assertRaisesRegex(windsplat.ConnectionFailed, "serve ended with signal 9: "):
                server.datasets

    def test_a_server_that_is_not_ready_in_time_is_ended(self):
        with tempfile.TemporaryDirectory() as folder:
            program = pathlib.Path(folder) / "slow"
            program.write_text("#!/bin/sh\necho $$ >" + folder + "/pid\n"
                               "echo windsplat: reads >&2\nexec sleep 600\n")
            program.chmod(0o755)
            with self.assertRaisesRegex(windsplat.StartFailed,
                                        r"after 5 s \(start_timeout\): windsplat: reads"):
                windsplat.Server.start(program=program, start_timeout=5)
            self.assertTrue(ends(int((pathlib.Path(folder) / "pid").read_text())))

    def test_other_systems_only_connect(self):
        with unittest.mock.patch("sys.platform", "darwin"):
            with self.assertRaisesRegex(windsplat.StartFailed, "on Linux only.*connect"):
                start("tornado:8")

    def test_a_server_on_a_unix_socket_is_used_like_another(self):
        with tempfile.TemporaryDirectory() as folder:
            path = f"{folder}/w.sock"
            with start("tornado:8", listen=f"unix:{path}") as own:
                self.assertEqual(own.url, f"unix:{path}")
                quoted = "http+unix://" + path.replace("/", "%2F") + "/"
                for address in (f"unix:{path}", quoted):
                    with windsplat.connect(address) as server:
                        view = server["tornado:8"].view(size=(32, 24))
                        self.assertEqual(view.frame("jpeg").width, 32)

                        async def final():
                            async with server.stream(view) as stream:
                                return await stream.final()

                        self.assertTrue(asyncio.run(final()).final)
                        for call in (view.widget, view.share, lambda: view.url):
                            with self.assertRaisesRegex(ValueError, r"browser.*view\.live\(\)"):
                                call()
            with self.assertRaisesRegex(windsplat.ConnectionFailed, f"unix:{path}: No such file"):
                windsplat.connect(f"unix:{path}")

    def test_notebooks_of_this_machine_may_show_the_embedded_view(self):
        server, _ = shared_server()
        policy = server.http.request("GET", "?embed", accept="text/html").headers[
            "Content-Security-Policy"]
        self.assertIn("http://localhost:8888", policy)

    def test_a_program_that_is_not_there_is_named(self):
        with self.assertRaisesRegex(windsplat.StartFailed, "argument program.*'/nowhere/w'"):
            windsplat.Server.start(program="/nowhere/w")
        with unittest.mock.patch.dict(os.environ, {"PATH": "/nowhere"}):
            os.environ.pop("WINDSPLAT", None)
            with self.assertRaisesRegex(windsplat.StartFailed, "PATH.*WINDSPLAT.*connect"):
                windsplat.Server.start()
        with unittest.mock.patch.dict(os.environ, {"WINDSPLAT": "/nowhere/x"}):
            with self.assertRaisesRegex(windsplat.StartFailed, r"\$WINDSPLAT: '/nowhere/x'"):
                windsplat.Server.start()

    def test_what_the_program_says_is_in_the_error(self):
        with self.assertRaisesRegex(windsplat.StartFailed, "exit code 2.*--max-pixels.*'many'"):
            start("tornado:16", max_pixels="many")
        with self.assertRaises(windsplat.StartFailed) as caught:
            start("nowhere.nc", strict=True)
        self.assertEqual(str(caught.exception).count("'nowhere.nc': no such file"), 1)

    def test_one_dataset_is_opened_by_open(self):
        with unittest.mock.patch.dict(os.environ, {"WINDSPLAT": PROGRAM}):
            dataset = windsplat.open("tornado:16", threads=1)
        with dataset.server:
            self.assertEqual(dataset.shape, (16, 16, 16))

    def test_a_wrong_token_is_refused_and_a_right_one_accepted(self):
        with tempfile.NamedTemporaryFile("w") as file:
            file.write("0123456789abcdefX\n")
            file.flush()
            with start("tornado:16", token_file=file.name) as server:
                self.assertEqual(list(server.datasets), ["tornado:16"])
                with self.assertRaises(windsplat.Unauthorized) as caught:
                    windsplat.connect(server.url)
                self.assertEqual(caught.exception.status, 401)
                with windsplat.connect(server.url, token="0123456789abcdefX") as there:
                    self.assertEqual(list(there.datasets), ["tornado:16"])


if __name__ == "__main__":
    unittest.main()
