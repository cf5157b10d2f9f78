# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""A page without a browser: starts the program, says what a page says, and takes what it gets. Standard library only."""
import base64
import json
import os
import pathlib
import select
import signal
import socket
import struct
import subprocess
import time
import zlib


def grey_pixels(png):
    """The rows of a PNG of one byte a pixel, as the program writes them: filtered by the pixel on the left, or not."""
    at, data, width = 8, b"", 0
    while at < len(png):
        size, kind = struct.unpack(">I4s", png[at:at + 8])
        if kind == b"IHDR":
            width, height, depth, colours = struct.unpack(">IIBB", png[at + 8:at + 18])
            assert (depth, colours) == (8, 0), "the picture is not grey"
        if kind == b"IDAT":
            data += png[at + 8:at + 8 + size]
        at += size + 12
    data, rows = zlib.decompress(data), []
    for y in range(len(data) // (width + 1)):
        row = bytearray(data[y * (width + 1) + 1:(y + 1) * (width + 1)])
        kind = data[y * (width + 1)]
        assert kind in (0, 1), "another filter"
        for x in range(1, width if kind == 1 else 0):
            row[x] = (row[x] + row[x - 1]) & 255
        rows.append(bytes(row))
    return rows


# Conditions for a browser with the page (a function of JavaScript): the program has done all that was asked, and nothing
# moves; and all panes that are seen show exact pictures of it.
DONE = """() => {
  const {state, connection} = window.tetwarp;
  return state && !state.moving && state.request >= connection.seen;
}"""
AT_REST = f"""() => ({DONE})() && window.tetwarp.state.quality && window.tetwarp.panes.every((p) => p.width === 0 ||
  (p.element.dataset.exact === 'true' && p.about.number === window.tetwarp.state.pictures[p.name]))"""


class Refused(Exception):
    """The server did not take the connection; the text is the first line of its answer."""


class Program:
    """A running `tetwarp view`. Ends with the block."""

    def __init__(self, program, *arguments, cwd=None, environment=None):
        self.process = subprocess.Popen([program, "view", "--no-open", *map(str, arguments)], cwd=cwd,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                        env=dict(os.environ, **(environment or {})))
        self.address = self.process.stdout.readline().strip()
        if not self.address.startswith("http://127.0.0.1:"):
            raise RuntimeError(f"no address, but {self.address!r} and {self.process.stderr.read()!r}")
        base, self.token = self.address.split("/#")
        self.port = int(base.rsplit(":", 1)[1])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            try:
                self.process.wait(30)
            except subprocess.TimeoutExpired:
                self.process.kill()
        self.process.stdout.close()
        self.process.stderr.close()

    def memory_bytes(self):
        """Resident memory."""
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(status.split("VmRSS:")[1].split()[0]) * 1024


def request(port, text, host="127.0.0.1"):
    """Sends the bytes of an HTTP request. @return the answer, up to its end"""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as line:
        line.settimeout(15)
        line.connect((host, port))
        line.sendall(text if isinstance(text, bytes) else text.encode())
        answer = b""
        try:
            while True:
                part = line.recv(65536)
                if not part:
                    break
                answer += part
        except (TimeoutError, ConnectionResetError):
            pass
        return answer.decode("latin-1")


class Page:
    """A WebSocket to the program that speaks as the page does."""

    def __init__(self, program, token=None, take=False, origin=None, host=None, hello=True, acknowledges=True):
        self.number = 0
        self.seen = 0  # number of the last request that may change what is seen
        self.sent = {}       # time at which each request was sent
        self.state = None
        self.about = None
        self.pictures = []   # (time, what it says of itself, file)
        self.messages = []
        self.bytes = 0
        self.closed = None   # the code, once the server closes
        self.acknowledges = acknowledges
        self.buffer = b""
        self.begun = None    # a message of which parts have come: its kind and bytes
        self.line = socket.create_connection(("127.0.0.1", program.port), timeout=30)
        self.line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        own = f"127.0.0.1:{program.port}"
        key = base64.b64encode(os.urandom(16)).decode()
        head = [f"GET /talk HTTP/1.1", f"Host: {own if host is None else host}", "Upgrade: websocket",
                "Connection: Upgrade", f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13"]
        if origin != "":
            head.append(f"Origin: {'http://' + own if origin is None else origin}")
        self.line.sendall(("\r\n".join(head) + "\r\n\r\n").encode())
        while b"\r\n\r\n" not in self.buffer:
            part = self.line.recv(65536)
            if not part:
                break
            self.buffer += part
        head, _, self.buffer = self.buffer.partition(b"\r\n\r\n")
        if b" 101 " not in head.split(b"\r\n")[0]:
            raise Refused(head.split(b"\r\n")[0].decode())
        if hello:
            self.send(json.dumps({"do": "hello", "token": program.token if token is None else token, "take": take}))

    def close(self):
        self.line.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def send(self, text, opcode=1):
        data = text.encode() if isinstance(text, str) else text
        size = len(data)
        head = bytes([0x80 | opcode])
        if size < 126:
            head += bytes([0x80 | size])
        elif size < 65536:
            head += bytes([0x80 | 126]) + struct.pack(">H", size)
        else:
            head += bytes([0x80 | 127]) + struct.pack(">Q", size)
        mask = os.urandom(4)
        body = (int.from_bytes(data, "big") ^ int.from_bytes((mask * (size // 4 + 1))[:size], "big")).to_bytes(size, "big")
        self.line.sendall(head + mask + body)

    def ask(self, what, **keys):
        self.number += 1
        self.sent[self.number] = time.perf_counter()
        if what not in ("probe", "save", "shown"):
            self.seen = self.number
        self.send(json.dumps({"do": what, "n": self.number, **keys}))
        return self.number

    def sizes(self, width=512, height=512, volume=512):
        for pane in ("axial", "coronal", "sagittal"):
            self.ask("size", pane=pane, width=width, height=height)
        self.ask("size", pane="volume", width=volume, height=volume)

    def _frame(self):
        """The next frame that has come as a whole: (whether it is a message's last, opcode, bytes), or None."""
        if len(self.buffer) < 2:
            return None
        size, at = self.buffer[1] & 127, 2
        if size == 126:
            if len(self.buffer) < 4:
                return None
            size, at = struct.unpack(">H", self.buffer[2:4])[0], 4
        elif size == 127:
            if len(self.buffer) < 10:
                return None
            size, at = struct.unpack(">Q", self.buffer[2:10])[0], 10
        if len(self.buffer) < at + size:
            return None
        first, data = self.buffer[0], self.buffer[at:at + size]
        self.buffer = self.buffer[at + size:]
        return first & 128 != 0, first & 15, data

    def listen(self, seconds, until=None):
        """Takes what comes for so long, or until `until(self)` holds. @return whether it does"""
        end = time.perf_counter() + seconds
        if until and until(self):
            return True
        while True:
            while (frame := self._frame()) is not None:
                self._take(*frame)
                if until and until(self):
                    return True
            left = end - time.perf_counter()
            if self.closed is not None or left <= 0:
                return bool(until and until(self))
            if not select.select([self.line], [], [], left)[0]:
                continue
            try:
                part = self.line.recv(1 << 20)
            except ConnectionResetError:
                part = b""
            if not part:
                self.closed = self.closed or 1006
            self.buffer += part

    def _take(self, is_last, opcode, data):
        if opcode < 8:  # a part of a message
            kind, before = self.begun or (opcode, b"")
            self.begun = None if is_last else (kind, before + data)
            if not is_last:
                return
            opcode, data = kind, before + data
        if opcode == 8:
            self.closed = struct.unpack(">H", data[:2])[0] if len(data) >= 2 else 1005
        elif opcode == 9:
            self.send(data, opcode=10)
        elif opcode == 2:
            self.bytes += len(data)
            size = struct.unpack("<I", data[:4])[0]
            about = json.loads(data[4:4 + size])
            self.pictures.append((time.perf_counter(), about, data[4 + size:]))
            if self.acknowledges:
                self.send(json.dumps({"do": "shown", "pane": about["pane"], "number": about["number"]}))
        elif opcode == 1:
            message = json.loads(data)
            self.messages.append(message)
            if message["say"] == "state":
                self.state = message
            elif message["say"] == "about":
                self.about = message

    def answer(self, number, seconds=30):
        """The answer to a request; None where there is none in time."""
        self.listen(seconds, lambda page: any(m.get("n") == number for m in page.messages))
        return next((m for m in self.messages if m.get("n") == number), None)

    def exact(self, pane):
        """Rows of the last picture of a pane, which is exact."""
        about, png = [(about, png) for _, about, png in self.pictures if about["pane"] == pane][-1]
        assert about["exact"], "the last picture is not exact"
        return about, grey_pixels(png)

    def save(self, name, volume, seconds=300, **more):
        """Saves. @return the answer"""
        number = self.ask("save", name=name, volume=volume, **more)
        ends = lambda page: [m for m in page.messages if m.get("n") == number and m["say"] in ("saved", "problem")]
        self.listen(seconds, ends)
        return ends(self)[-1]

    def is_at_rest(self):
        """Whether the program has done all that was asked, and what it made last is here, exact."""
        state = self.state
        if not state or state["request"] < self.seen or state["moving"] or state["quality"] is None:
            return False
        last = {about["pane"]: about for _, about, _ in self.pictures}
        return len(last) == 4 and all(one["exact"] and one["number"] == state["pictures"][pane] for pane, one in last.items())

    def rest(self, seconds=60):
        if not self.listen(seconds, Page.is_at_rest):
            raise RuntimeError("no exact pictures in time")
