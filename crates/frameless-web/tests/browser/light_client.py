"""A client of the stream that draws nothing: it acknowledges what comes, and counts. RFC 6455 on a plain socket, so that what
is measured is the server's work and not a browser's.

    light_client.py URL SECS [--drive]

Prints one JSON object: bytes, messages, samples per second before it came and since, seconds between messages of tiles, and
with --drive the milliseconds from inputs to the first tiles that show them.
"""

import base64
import http.client
import json
import os
import select
import socket
import struct
import sys
import time
from urllib.parse import urlsplit

TILES, STATUS = 1, 2
TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10
INPUT_EVERY_SECS = 0.05


class LightClient:
    """Connects with the secret in `url`."""

    def __init__(self, url: str):
        at = urlsplit(url)
        host = at.netloc
        connection = http.client.HTTPConnection(at.hostname, at.port, timeout=10)
        connection.request("GET", f"{at.path}?{at.query}")
        answer = connection.getresponse()
        cookie = answer.getheader("set-cookie")
        assert cookie, f"{url} sets no cookie: {answer.status}"
        self.socket = socket.create_connection((at.hostname, at.port), timeout=10)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        key = base64.b64encode(os.urandom(16)).decode()
        lines = [
            "GET /stream HTTP/1.1",
            f"Host: {host}",
            "Upgrade: websocket",
            "Connection: Upgrade",
            f"Sec-WebSocket-Key: {key}",
            "Sec-WebSocket-Version: 13",
            f"Origin: http://{host}",
            f"Cookie: {cookie.split(';')[0]}",
        ]
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        self.buffer = b""
        while b"\r\n\r\n" not in self.buffer:
            self._more()
        head, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
        assert b" 101 " in head.splitlines()[0], head.decode()
        self.bytes = 0

    def _more(self) -> None:
        data = self.socket.recv(1 << 20)
        if not data:
            raise ConnectionError("the server has closed the connection")
        self.buffer += data

    def wait(self, secs: float) -> bool:
        """Whether something came within so many seconds."""
        return bool(self.buffer) or bool(select.select([self.socket], [], [], max(0.0, secs))[0])

    def receive(self) -> tuple[int, bytes]:
        """The next message: its opcode and its bytes."""
        while True:
            first, length, header = self._header()
            while len(self.buffer) < header + length:
                self._more()
            payload = self.buffer[header : header + length]
            self.buffer = self.buffer[header + length :]
            self.bytes += header + length
            opcode = first & 15
            assert first & 0x80, "a message in parts"
            if opcode == PING:
                self._send(PONG, payload)
            elif opcode != PONG:
                return opcode, payload

    def _header(self) -> tuple[int, int, int]:
        while len(self.buffer) < 10 and not self._has_header():
            self._more()
        first, length = self.buffer[0], self.buffer[1] & 127
        if length == 126:
            return first, struct.unpack(">H", self.buffer[2:4])[0], 4
        if length == 127:
            return first, struct.unpack(">Q", self.buffer[2:10])[0], 10
        return first, length, 2

    def _has_header(self) -> bool:
        if len(self.buffer) < 2:
            return False
        return len(self.buffer) >= {126: 4, 127: 10}.get(self.buffer[1] & 127, 2)

    def _send(self, opcode: int, payload: bytes) -> None:
        # All masks are equal to the server; zero costs nothing here.
        size = len(payload)
        length = struct.pack(">B", 0x80 | size) if size < 126 else struct.pack(">BH", 0x80 | 126, size)
        self.socket.sendall(bytes([0x80 | opcode]) + length + b"\0\0\0\0" + payload)

    def say(self, message: dict) -> None:
        self._send(TEXT, json.dumps(message).encode())

    def acknowledge(self, sequence: int) -> None:
        self._send(BINARY, struct.pack("<BBHI", 16, 1, 0, sequence))


class Tally:
    """What came, and when."""

    def __init__(self):
        self.statuses: list[tuple[float, float]] = []
        self.arrivals: list[float] = []
        self.latencies_ms: list[float] = []
        self.waiting: list[tuple[int, float]] = []

    def take(self, client: LightClient, opcode: int, payload: bytes) -> None:
        if opcode == CLOSE:
            raise ConnectionError(f"closed: {payload[2:].decode(errors='replace')}")
        if opcode != BINARY:
            return
        if payload[0] == STATUS:
            self.statuses.append(struct.unpack_from("<2f", payload, 4))
            return
        now = time.monotonic()
        sequence, shown = struct.unpack_from("<I", payload, 4)[0], struct.unpack_from("<I", payload, 24)[0]
        client.acknowledge(sequence)
        self.arrivals.append(now)
        while self.waiting and self.waiting[0][0] <= shown:
            self.latencies_ms.append(1000 * (now - self.waiting.pop(0)[1]))

    def _before(self) -> float | None:
        """Samples per second while nobody looked. No pictures were made then: the first one that is ends a long interval without
        any, and the rates that come with it are those of the interval."""
        pictures, samples = min(((pictures, samples) for samples, pictures in self.statuses[:12]), default=(1.0, None))
        return samples if pictures < 1.0 else None

    def summary(self, client: LightClient, secs: float) -> dict:
        gaps = [later - earlier for earlier, later in zip(self.arrivals, self.arrivals[1:])]
        later = [samples for samples, _ in self.statuses[len(self.statuses) // 2 :]]
        return {
            "bytes_per_sec": client.bytes / secs,
            "messages": len(self.arrivals),
            "samples_per_sec_before": self._before(),
            "samples_per_sec": sum(later) / len(later) if later else None,
            "gaps_secs": gaps,
            "latencies_ms": self.latencies_ms,
        }


def run(url: str, secs: float, drive: bool) -> dict:
    client, tally = LightClient(url), Tally()
    if drive:
        client.say({"type": "drive", "on": True})
    begin = time.monotonic()
    next_input, number = begin, 0
    while (now := time.monotonic()) < begin + secs:
        if drive and now >= next_input:
            number += 1
            way = 0.01 if number % 40 < 20 else -0.01
            client.say({"type": "camera", "input": number, "orbit": [way, 0.0]})
            tally.waiting.append((number, now))
            next_input = now + INPUT_EVERY_SECS
        if client.wait((next_input if drive else begin + secs) - now):
            tally.take(client, *client.receive())
    return tally.summary(client, secs)


if __name__ == "__main__":
    print(json.dumps(run(sys.argv[1], float(sys.argv[2]), "--drive" in sys.argv)))
