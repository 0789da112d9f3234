"""The clients of soak.py: behaviour of each kind, and replacement of disconnected ones."""
import asyncio
import json
import math
import pathlib
import random
import socket
import struct
import sys
import time

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "edge"))
from wire_client import NO_MASK, frame, new_key, upgrade_request  # noqa: E402

DEAF_SIZE, SLOW_SIZE = (1280, 720), (640, 360)
SLOW_BYTES, SLOW_PAUSE_S = 1024, 0.05
GONE = (OSError, EOFError, asyncio.IncompleteReadError, asyncio.TimeoutError, ConnectionError)


class Client:
    def __init__(self, options, port, chance, number):
        self.options, self.port, self.chance = options, port, chance
        # Limits apply to addresses, so each client has its own, different from that of the health
        # checks.
        self.address = f"127.0.{1 + number // 250}.{2 + number % 250}"
        self.reader = self.writer = None
        self.rev = 0
        self.slow = False

    async def connect(self, limit=1 << 16, plain=False):
        context = None if plain else self.options.context
        self.reader, self.writer = await asyncio.wait_for(
            asyncio.open_connection("127.0.0.1", self.port, limit=limit, ssl=context,
                                    local_addr=(self.address, 0)), 20)

    async def upgrade(self):
        self.writer.write(upgrade_request(f"127.0.0.1:{self.port}", new_key()))
        head = await asyncio.wait_for(self.reader.readuntil(b"\r\n\r\n"), 20)
        if b" 101 " not in head.split(b"\r\n")[0]:
            raise EOFError("refused")

    def send(self, opcode, payload, fin=True, length=None):
        self.writer.write(frame(opcode, payload, fin, mask=NO_MASK, length=length))

    def patch(self, size):
        self.rev += 1
        angle = self.chance.uniform(0, 6.28)
        view = {"dataset": self.options.dataset, "image": {"width": size[0], "height": size[1]},
                "camera": {"eye": [2.4 * math.sin(angle), -2.4 * math.cos(angle), 1.2]}}
        self.send(1, json.dumps({"type": "patch", "rev": self.rev, "t": self.rev,
                                 "patch": view}).encode())

    async def take(self, size):
        if not self.slow:
            return await self.reader.readexactly(size)
        out = b""
        while len(out) < size:
            out += await self.reader.readexactly(min(SLOW_BYTES, size - len(out)))
            await asyncio.sleep(SLOW_PAUSE_S)
        return out

    async def message(self):
        first, second = await self.reader.readexactly(2)
        size = second & 0x7F
        if size == 126:
            size = struct.unpack(">H", await self.reader.readexactly(2))[0]
        elif size == 127:
            size = struct.unpack(">Q", await self.reader.readexactly(8))[0]
        payload = await self.take(size)
        if first & 0x0F == 8:
            raise EOFError("closed")
        if first & 0x0F == 9:
            self.send(10, payload)
        return first & 0x0F, payload

    def close(self, reset=False):
        if self.writer is None:
            return
        if reset:
            self.writer.transport.abort()
        else:
            self.writer.close()


class Counts:
    def __init__(self):
        self.came = dict.fromkeys(WAYS, 0)
        self.refused = self.frames = self.requests = 0
        self.kinds = {}


async def normal(client, counts, until):
    await client.connect(1 << 20)
    await client.upgrade()
    client.patch(client.options.size)
    while time.monotonic() < until:
        opcode, payload = await asyncio.wait_for(client.message(), 60)
        if opcode != 2:
            if b'"unchanged"' in payload or b'"error"' in payload:
                client.patch(client.options.size)
            continue
        counts.frames += 1
        seq = struct.unpack_from("<I", payload, 8)[0]
        client.send(1, json.dumps({"type": "ack", "seq": seq, "decodeMs": 2}).encode())
        await asyncio.sleep(client.chance.uniform(0.2, 2))  # time to view the still
        turn = client.chance.random()
        if turn < 0.05:
            client.send(1, json.dumps({"type": "still", "id": client.rev + 1, "width": 64,
                                       "height": 48, "format": "png", "scale": 1}).encode())
        elif turn < 0.15:
            await request(client, counts)
        client.patch(client.options.size)
        await client.writer.drain()
    if client.chance.random() < 0.5:
        client.send(8, struct.pack(">H", 1000))
        await client.writer.drain()


async def request(client, counts):
    """Requests a picture or a saved view over HTTP."""
    reader, writer = await asyncio.open_connection("127.0.0.1", client.port,
                                                   ssl=client.options.context,
                                                   local_addr=(client.address, 0))
    try:
        body = json.dumps({"dataset": client.options.dataset}).encode()
        target, more = client.chance.choice([
            (f"GET /v1/datasets/{client.options.dataset}/frame.jpg?width=64&height=48"
             f"&azimuth={client.chance.uniform(0, 360):.3f}", b""),
            ("GET /metrics", b""), ("GET /v1/datasets", b""), ("POST /v1/views", body)])
        writer.write((f"{target} HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n"
                      "Content-Type: application/json\r\n"
                      f"Content-Length: {len(more)}\r\n\r\n").encode() + more)
        answer = await asyncio.wait_for(reader.read(), 30)
        counts.requests += 1
        if b" 201 " in answer[:20]:
            name = json.loads(answer.split(b"\r\n\r\n", 1)[1])["id"]
            await delete(client, name)
    finally:
        writer.close()


async def delete(client, name):
    reader, writer = await asyncio.open_connection("127.0.0.1", client.port,
                                                   ssl=client.options.context,
                                                   local_addr=(client.address, 0))
    writer.write((f"DELETE /v1/views/{name} HTTP/1.1\r\nHost: 127.0.0.1\r\n"
                  "Connection: close\r\n\r\n").encode())
    await asyncio.wait_for(reader.read(), 30)
    writer.close()


async def deaf(client, _counts, until):
    await client.connect(1024)
    await client.upgrade()
    client.writer.transport.pause_reading()  # over TLS Python still takes 256 KiB
    while time.monotonic() < until and not client.writer.is_closing():
        client.patch(DEAF_SIZE)
        await asyncio.wait_for(client.writer.drain(), 5)
        await asyncio.sleep(1)


async def drag(client, counts, until):
    """Changes the view every 50 ms; frames are acknowledged as they arrive."""
    await client.connect(1 << 20)
    await client.upgrade()

    async def move():
        while time.monotonic() < until:
            client.patch(client.options.size)
            await client.writer.drain()
            await asyncio.sleep(0.05)

    await both(move(), acknowledge(client, counts, until))


async def slow(client, counts, until):
    client.slow = True
    await client.connect(SLOW_BYTES)
    await client.upgrade()

    async def move():
        while time.monotonic() < until:
            client.patch(SLOW_SIZE)
            await client.writer.drain()
            await asyncio.sleep(2)

    await both(move(), acknowledge(client, counts, until))


async def cut(client, counts, until):
    """Resets the connection at a random moment."""
    await drag(client, counts, min(until, time.monotonic() + client.chance.uniform(0.2, 5)))


async def acknowledge(client, counts, until):
    while time.monotonic() < until:
        opcode, payload = await asyncio.wait_for(client.message(), 60)
        if opcode == 2:
            counts.frames += 1
            seq = struct.unpack_from("<I", payload, 8)[0]
            client.send(1, json.dumps({"type": "ack", "seq": seq, "decodeMs": 2}).encode())


async def both(moving, reading):
    """Waits until the first of the two ends."""
    tasks = [asyncio.ensure_future(moving), asyncio.ensure_future(reading)]
    done, left = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    for task in left:
        task.cancel()
    results = await asyncio.gather(*tasks, return_exceptions=True)
    for task, result in zip(tasks, results):
        if task in done and isinstance(result, Exception):
            raise result


# --- behaviour of hostile clients ----------------------------------------------------------------

async def bad_frames(client):
    await client.upgrade()
    spoil = client.chance.choice([(3, b"", True, None), (2, b"xx", True, None),
                                  (1, b"\xff", True, None), (1, b"{}", True, 1 << 63),
                                  (0, b"", True, None), (9, bytes(126), True, None)])
    client.send(*spoil)
    while True:
        await asyncio.wait_for(client.message(), 20)


async def bad_json(client):
    await client.upgrade()
    for _ in range(50):
        client.send(1, client.chance.choice([b"{", b"[" * 4000, b'{"type": "ack", "seq": 1e9}',
                                             b'{"type": "patch", "rev": 1, "patch": {"a": 1}}']))
        await asyncio.wait_for(client.message(), 20)


async def flood(client):
    await client.upgrade()
    for n in range(400):
        client.patch((32, 24))
        if n % 50 == 0:
            await asyncio.wait_for(client.writer.drain(), 20)
            await asyncio.sleep(0.01)


async def half_message(client):
    await client.upgrade()
    client.send(1, b'{"type": "pa', length=4000)
    await client.writer.drain()
    await asyncio.sleep(client.chance.uniform(0, 3))


async def slow_header(client):
    for letter in b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: " + b"a" * 100:
        client.writer.write(bytes([letter]))
        await client.writer.drain()
        await asyncio.sleep(0.25)


async def half_open(client):
    client.writer.write(b"POST /v1/frames HTTP/1.1\r\nHost: 127.0.0.1\r\n"
                        b"Content-Length: 100\r\n\r\n{")
    await client.writer.drain()
    client.writer.get_extra_info("socket").shutdown(socket.SHUT_WR)  # over TLS without close_notify
    await asyncio.wait_for(client.reader.read(), 20)


async def fragments(client):
    await client.upgrade()
    client.send(1, b"", fin=False)
    for _ in range(2000):
        client.send(0, b"", fin=False)
        await client.writer.drain()
        await asyncio.sleep(0.005)


async def half_handshake(client):
    hello = bytes.fromhex("1603010200010001fc0303") + bytes(32)
    client.writer.write(hello[:client.chance.randrange(1, len(hello))])
    await client.writer.drain()
    await asyncio.sleep(client.chance.uniform(0, 8))


async def no_tls(client):
    client.writer.write(client.chance.choice([b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
                                              b"\x16\x03\x01\xff\xff" + bytes(70000), b"\0"]))
    await asyncio.wait_for(client.reader.read(), 20)


BEFORE_TLS = [half_handshake, no_tls]
HOSTILE = [bad_frames, bad_json, flood, half_message, slow_header, half_open, fragments]


async def hostile(client, counts, until):
    way = client.chance.choice(HOSTILE + (BEFORE_TLS if client.options.context else []))
    counts.kinds[way.__name__] = counts.kinds.get(way.__name__, 0) + 1
    await client.connect(plain=way in BEFORE_TLS)
    await asyncio.wait_for(way(client), max(1, until - time.monotonic()))


WAYS = {"normal": normal, "hostile": hostile, "deaf": deaf, "drag": drag, "slow": slow, "cut": cut}


def kinds_of(mix):
    """The kinds of consecutive clients, by their shares."""
    out = []
    for word in mix.split(","):
        kind, _, share = word.partition(":")
        if kind not in WAYS or not share.isdigit():
            raise ValueError(f"--mix: {word!r} is not KIND:SHARE; kinds are {', '.join(WAYS)}")
        out += [kind] * int(share)
    return out


async def seat(number, options, port, counts, end):
    """One place, occupied by successive clients of its kind."""
    chance = random.Random(number + options.seed)
    kind = options.kinds[number % len(options.kinds)]
    await asyncio.sleep(chance.uniform(0, min(5, options.stay)))
    while time.monotonic() < end:
        client = Client(options, port, chance, number)
        until = min(end, time.monotonic() + chance.uniform(0.2, 1.8) * options.stay)
        counts.came[kind] += 1
        try:
            await WAYS[kind](client, counts, until)
        except GONE as fault:
            if isinstance(fault, EOFError) and "refused" in str(fault):
                counts.refused += 1
                await asyncio.sleep(1)  # at least the delay of its Retry-After
        finally:
            client.close(reset=kind not in ("normal", "drag") or chance.random() < 0.3)
        await asyncio.sleep(chance.uniform(0, 0.5))
