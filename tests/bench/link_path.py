"""A simulated link of given rate and delay between a daemon and its clients on one machine.

`Tunnel`: two network namespaces joined by TUN devices. A process moves the packets between them
and delays each: real TCP over a link with its own queue. Needs root, /dev/net/tun and iproute2.
`Proxy`: a process forwards TCP connections at the link's rate after its delay, which TCP itself
cannot observe. Both have queues of the same size in each direction. Linux only."""
import collections
import ctypes
import fcntl
import os
import select
import shutil
import socket
import struct
import subprocess
import sys
import time

TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 1, 0x1000
CLONE_NEWNET = 0x40000000
QUEUE_S = 0.2  # capacity of the bottleneck queue, as time at the link's rate


def can_tunnel():
    if os.geteuid() != 0 or not shutil.which("ip"):
        return False
    try:
        os.close(os.open("/dev/net/tun", os.O_RDWR))
    except OSError:
        return False
    return subprocess.run(["unshare", "--net", "true"], stderr=subprocess.DEVNULL).returncode == 0


class Pipe:
    """One direction: packets leave at `rate` bytes/s and arrive `delay` seconds later; a full
    queue drops them."""

    def __init__(self, rate, delay):
        self.rate, self.delay = rate, delay
        self.free = 0.0
        self.packets = collections.deque()
        self.room = max(QUEUE_S, 2 * 65536 / rate)

    def put(self, packet, now):
        if self.free - now > self.room:
            return False
        self.free = max(self.free, now) + len(packet) / self.rate
        self.packets.append((self.free + self.delay, packet))
        return True

    def due(self):
        return self.packets[0][0] if self.packets else None

    def full(self, now):
        return self.free - now > self.room


def packet_bytes(rate):
    """The packet size: larger on faster links, because Python forwards only a few thousand a
    second."""
    return 1400 if rate <= 2e6 else 9000 if rate <= 2e7 else 60000


def network(*words):
    subprocess.run(["ip", *words], check=True)


def move(ends, pipes):
    """Forwards packets between the two ends for ever, one pipe per direction."""
    for end in ends:
        os.set_blocking(end, False)
    while True:
        now = time.monotonic()
        dues = [pipe.due() for pipe in pipes if pipe.packets]
        select.select(ends, [], [], max(0, min(dues) - now) if dues else None)
        for n, end in enumerate(ends):
            try:
                while True:
                    pipes[n].put(os.read(end, 1 << 16), time.monotonic())
            except BlockingIOError:
                pass
        now = time.monotonic()
        for n, pipe in enumerate(pipes):
            while pipe.packets and pipe.due() <= now:
                try:
                    os.write(ends[1 - n], pipe.packets.popleft()[1])
                except (BlockingIOError, OSError):
                    pass


class Tunnel:
    """Runs in a separate network namespace (see `enter`): the client side is here, the daemon's
    side in another namespace."""

    name = "network namespaces"
    host = "10.77.0.1"  # the daemon

    def __init__(self, rate, trip):
        self.libc = ctypes.CDLL(None, use_errno=True)
        self.here = os.open("/proc/self/ns/net", os.O_RDONLY)
        viewer = self.device("viewer", "10.77.0.2", rate)
        self.unshare()
        network("link", "set", "lo", "up")
        daemon = self.device("daemon", "10.77.0.1", rate)
        self.there = os.open("/proc/self/ns/net", os.O_RDONLY)
        self.enter_net(self.here)
        self.mover = os.fork()
        if self.mover == 0:
            try:
                move([daemon, viewer], [Pipe(rate, trip / 2), Pipe(rate, trip / 2)])
            finally:
                os._exit(1)
        os.close(viewer)
        os.close(daemon)

    @staticmethod
    def enter():
        """Runs this program again in a namespace where it may create devices."""
        if os.environ.get("WINDSPLAT_LINKS_INSIDE") != "1":
            os.environ["WINDSPLAT_LINKS_INSIDE"] = "1"
            os.execvp("unshare", ["unshare", "--net", sys.executable, *sys.argv])
        network("link", "set", "lo", "up")

    def unshare(self):
        if self.libc.unshare(CLONE_NEWNET) != 0:
            raise OSError(ctypes.get_errno(), "unshare")

    def enter_net(self, namespace):
        if self.libc.setns(namespace, CLONE_NEWNET) != 0:
            raise OSError(ctypes.get_errno(), "setns")

    @staticmethod
    def device(name, address, rate):
        handle = os.open("/dev/net/tun", os.O_RDWR)
        fcntl.ioctl(handle, TUNSETIFF, struct.pack("16sH", name.encode(), IFF_TUN | IFF_NO_PI))
        network("address", "add", f"{address}/24", "dev", name)
        network("link", "set", name, "mtu", str(packet_bytes(rate)), "up")
        return handle

    def start(self, command):
        """Starts a daemon on the far side; it listens on `host`."""
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                                text=True, preexec_fn=lambda: self.enter_net(self.there))

    def port_of(self, port):
        return port

    def close(self):
        os.kill(self.mover, 9)
        os.waitpid(self.mover, 0)
        os.close(self.here)
        os.close(self.there)


def hand_on(viewer, daemon, rate, delay):
    """Forwards the bytes of one connection in both directions until either side closes."""
    sides = [daemon, viewer]
    pipes = [Pipe(rate, delay), Pipe(rate, delay)]
    piece = min(1 << 16, max(1400, int(rate * 0.002)))
    for side in sides:
        side.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    while True:
        now = time.monotonic()
        readable = [side for n, side in enumerate(sides) if not pipes[n].full(now)]
        dues = [pipe.due() for pipe in pipes if pipe.packets]
        wait = min(dues) - now if dues else None
        if len(readable) < 2:
            wait = min(0.005, wait if wait is not None else 1)
        ready = select.select(readable, [], [], None if wait is None else max(0, wait))[0]
        for side in ready:
            got = side.recv(piece)
            if not got:
                return
            pipes[sides.index(side)].put(got, time.monotonic())
        now = time.monotonic()
        for n, pipe in enumerate(pipes):
            while pipe.packets and pipe.due() <= now:
                sides[1 - n].sendall(pipe.packets.popleft()[1])


class Proxy:
    name = "a throttling proxy"
    host = "127.0.0.1"

    def __init__(self, rate, trip):
        self.rate, self.trip = rate, trip
        self.child = None

    @staticmethod
    def enter():
        pass

    def start(self, command):
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                                text=True)

    def port_of(self, port):
        """Address and port by which the daemon is reached over the link, for one connection."""
        listener = socket.socket()
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 16384)
        listener.bind((self.host, 0))
        listener.listen(1)
        out = listener.getsockname()[1]
        self.child = os.fork()
        if self.child == 0:
            try:
                viewer = listener.accept()[0]
                daemon = socket.socket()
                daemon.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 16384)
                daemon.connect((self.host, port))
                hand_on(viewer, daemon, self.rate, self.trip / 2)
            finally:
                os._exit(0)
        listener.close()
        return out

    def close(self):
        if self.child:
            os.kill(self.child, 9)
            os.waitpid(self.child, 0)
