#!/usr/bin/env python3
"""The daemon under a service manager: a socket passed as descriptor 3 (sd_listen_fds(3)) and
datagrams about its state (sd_notify(3)). Stands in for systemd.

Usage: service_manager.py --program=PATH [unittest arguments]
"""
import argparse
import fcntl
import os
import pathlib
import signal
import socket
import subprocess
import tempfile
import time
import unittest
import urllib.request

PROGRAM = None
PATIENCE_S = 20


class Manager:
    """Starts the daemon with the variables of a service manager."""

    def __init__(self, folder, sockets=(), options="--listen 127.0.0.1:0", pid="$$",
                 **variables):
        self.told = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        path = str(pathlib.Path(folder) / "notify")
        self.told.bind(path)
        self.told.settimeout(PATIENCE_S)
        env = {**os.environ, "NOTIFY_SOCKET": path, "LISTEN_FDS": str(len(sockets)), **variables}
        numbers = [one.fileno() for one in sockets]
        # The shell puts the sockets at 3, 4, ... and becomes the daemon, so that its process is $$.
        moves = "".join(f" {3 + i}<&{number}" for i, number in enumerate(numbers))
        line = f'LISTEN_PID={pid} exec "$0" serve climate {options}{moves}'
        self.daemon = subprocess.Popen(["/bin/bash", "-c", line, PROGRAM], env=env, text=True,
                                       pass_fds=numbers, stdout=subprocess.PIPE,
                                       stderr=subprocess.PIPE)

    def message(self):
        return self.told.recv(4096).decode()

    def ended(self):
        """Exit code and log."""
        log = self.daemon.communicate(timeout=PATIENCE_S)[1]
        return self.daemon.returncode, log

    def close(self):
        if self.daemon.poll() is None:
            self.daemon.kill()
        self.daemon.communicate()
        self.told.close()


def high(made):
    """The same socket with a descriptor from 20 on, which moving others to 3 does not overwrite."""
    copy = socket.socket(fileno=fcntl.fcntl(made.fileno(), fcntl.F_DUPFD_CLOEXEC, 20))
    made.close()
    return copy


def listening(address="127.0.0.1", family=socket.AF_INET):
    made = socket.socket(family, socket.SOCK_STREAM)
    made.bind((address, 0))
    made.listen()
    return high(made)


def listening_at(path, kind=socket.SOCK_STREAM):
    made = socket.socket(socket.AF_UNIX, kind)
    made.bind(path)
    made.listen()
    return high(made)


class UnderAManager(unittest.TestCase):
    def folder(self):
        made = tempfile.TemporaryDirectory()
        self.addCleanup(made.cleanup)
        return made.name

    def start(self, *sockets, **given):
        manager = Manager(self.folder(), sockets, **given)
        self.addCleanup(manager.close)
        for one in sockets:
            self.addCleanup(one.close)
        return manager

    def test_serves_on_the_passed_socket_and_tells_its_states(self):
        passed = listening()
        port = passed.getsockname()[1]
        manager = self.start(passed, WATCHDOG_USEC="400000")
        self.assertEqual(manager.message(),
                         f"READY=1\nSTATUS=serving http://127.0.0.1:{port}/")
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/livez") as answer:
            self.assertEqual(answer.status, 200)
        for _ in range(3):
            self.assertEqual(manager.message(), "WATCHDOG=1")
        manager.daemon.send_signal(signal.SIGTERM)
        rest = manager.message()
        while rest == "WATCHDOG=1":
            rest = manager.message()
        self.assertEqual(rest, "STOPPING=1")
        self.assertEqual(manager.ended()[0], 0)

    def test_connections_made_before_the_start_are_answered(self):
        passed = listening()
        early = socket.create_connection(passed.getsockname())
        self.addCleanup(early.close)
        early.sendall(b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n")
        early.settimeout(PATIENCE_S)
        self.start(passed)
        self.assertTrue(early.recv(4096).startswith(b"HTTP/1.1 200 "))

    def test_ipv6_sockets_are_taken(self):
        try:
            passed = listening("::1", socket.AF_INET6)
        except OSError:
            self.skipTest("this machine has no IPv6")
        port = passed.getsockname()[1]
        manager = self.start(passed)
        self.assertIn(f"serving http://[::1]:{port}/", manager.message())

    def test_unix_sockets_are_taken_and_their_file_stays(self):
        path = self.folder() + "/w.sock"
        manager = self.start(listening_at(path))
        self.assertEqual(manager.message(), "READY=1\nSTATUS=serving http+unix://"
                                            + path.replace("/", "%2F") + "/")
        with socket.socket(socket.AF_UNIX) as client:
            client.settimeout(PATIENCE_S)
            client.connect(path)
            client.sendall(b"GET /livez HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
            self.assertTrue(client.recv(4096).startswith(b"HTTP/1.1 200 "))
        manager.daemon.send_signal(signal.SIGTERM)
        self.assertEqual(manager.ended()[0], 0)
        self.assertTrue(pathlib.Path(path).is_socket())

    def test_reloads_are_told_whether_or_not_they_change_anything(self):
        token = pathlib.Path(self.folder(), "token")
        token.touch(0o600)
        token.write_text("0123456789abcdef\n")
        manager = self.start(options=f"--listen 127.0.0.1:0 --token-file {token}")
        serving = manager.message()
        refused = "; the last reload was refused: see the log"
        for text, end in (("fedcba9876543210", ""), ("", refused), ("0123456789abcdef", "")):
            token.write_text(text)
            before_us = time.monotonic_ns() // 1000
            manager.daemon.send_signal(signal.SIGHUP)
            state, _, told_us = manager.message().partition("\nMONOTONIC_USEC=")
            self.assertEqual(state, "RELOADING=1")
            self.assertTrue(before_us <= int(told_us) <= time.monotonic_ns() // 1000)
            self.assertEqual(manager.message(), serving + end)

    def test_a_manager_that_does_not_read_delays_neither_reload_nor_end(self):
        manager = self.start()
        self.assertIn("READY=1", manager.message())
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as other:
            other.setblocking(False)
            with self.assertRaises(BlockingIOError):
                while True:
                    other.sendto(b"x", manager.told.getsockname())
        manager.daemon.send_signal(signal.SIGHUP)
        time.sleep(3)
        begun = time.monotonic()
        manager.daemon.send_signal(signal.SIGTERM)
        code, log = manager.ended()
        self.assertEqual(code, 0)
        self.assertLess(time.monotonic() - begun, 4)
        self.assertLess(log.index("configuration reloaded"), log.index("draining"))

    def test_no_watchdog_unless_asked_by_the_manager_of_this_process(self):
        manager = self.start(WATCHDOG_USEC="2000", WATCHDOG_PID="1")
        self.assertIn("READY=1", manager.message())
        manager.daemon.send_signal(signal.SIGTERM)
        self.assertEqual(manager.message(), "STOPPING=1")

    def test_a_socket_of_another_process_is_left_alone(self):
        passed = listening()
        manager = self.start(passed, pid="1")
        self.assertNotIn(f":{passed.getsockname()[1]}/", manager.message())

    def test_a_passed_socket_reachable_by_others_needs_a_token(self):
        manager = self.start(listening("0.0.0.0"))
        code, log = manager.ended()
        self.assertEqual(code, 2)
        self.assertIn("0.0.0.0:", log)
        self.assertIn("--token-file", log)

    def test_other_than_one_listening_socket_of_tcp_or_a_path_is_refused(self):
        code, log = self.start(listening(), listening()).ended()
        self.assertEqual(code, 2)
        self.assertIn("passed 2 sockets", log)
        idle = socket.socket()
        datagrams = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        for one in (idle, datagrams):
            one.bind(("127.0.0.1", 0))
        abstract = listening_at(f"\0windsplat-{os.getpid()}")
        packets = listening_at(self.folder() + "/p.sock", socket.SOCK_SEQPACKET)
        for one in (idle, datagrams, abstract, packets):
            code, log = self.start(high(one)).ended()
            self.assertEqual(code, 2)
            self.assertIn("not a listening TCP socket", log)

    def test_a_manager_that_is_gone_does_not_keep_the_daemon_from_serving(self):
        manager = self.start(NOTIFY_SOCKET="/nonexistent/notify")
        self.assertTrue(manager.daemon.stdout.readline().startswith("http://127.0.0.1:"))


def main():
    global PROGRAM
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", required=True)
    given, rest = parser.parse_known_args()
    PROGRAM = given.program
    unittest.main(argv=["service_manager", *rest])


if __name__ == "__main__":
    main()
