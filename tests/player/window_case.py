# SPDX-License-Identifier: Apache-2.0
"""A display of the test's own, and gsc-play window on it: keys and mouse in, lines of the log and pictures out."""

import array
import contextlib
import ctypes
import json
import os
import pathlib
import resource
import select
import shutil
import signal
import struct
import subprocess
import sys
import threading
import time
import zlib

sys.path.append(str(pathlib.Path(__file__).parents[1] / "support"))
from cases import lavapipe  # noqa: E402

SECONDS = 60  # for what takes a fraction of one where nothing else runs
MARK = "n"  # a key that does nothing
LAYERS = [folder / "vulkan/explicit_layer.d/VkLayer_khronos_validation.json" for folder in
          map(pathlib.Path, ("/usr/share", "/usr/local/share", "/etc"))]


def missing() -> str:
    """Names what the test needs and is not here; empty = all is here."""
    for program, package in (("Xvfb", "xvfb"), ("xdotool", "xdotool")):
        if shutil.which(program) is None:
            return f"no {program} here; install {package}"
    if not any(layer.exists() for layer in LAYERS):
        print("note: no validation layer here, Vulkan's use is not checked; install vulkan-validationlayers")
    return "" if lavapipe() else "no Vulkan driver without a GPU here; install mesa-vulkan-drivers"


def environment(display: str) -> dict[str, str]:
    made = {name: value for name, value in os.environ.items() if name not in ("WAYLAND_DISPLAY", "DISPLAY")}
    if display:
        made["DISPLAY"] = display
    made["VK_DRIVER_FILES"] = made["VK_ICD_FILENAMES"] = lavapipe()
    if any(layer.exists() for layer in LAYERS):
        made["VK_INSTANCE_LAYERS"] = "VK_LAYER_KHRONOS_validation"
    # driver and layer keep memory until the process ends, which a sanitizer cannot name
    made["ASAN_OPTIONS"] = ":".join(filter(None, [os.environ.get("ASAN_OPTIONS"), "detect_leaks=0"]))
    return made


def until(found, what: str, process: subprocess.Popen | None = None):
    """The first value of found() that is not None."""
    end = time.monotonic() + SECONDS
    while time.monotonic() < end:
        ended = process is not None and process.poll() is not None
        value = found()
        if value is not None:
            return value
        if ended:
            raise AssertionError(f"{what}: the window has closed with {process.returncode}")
        time.sleep(0.005)
    raise AssertionError(f"{what}: has not come in {SECONDS} s")


class Picture:
    """Rows from the top, three values a pixel: bytes, or the floats of a PFM."""

    def __init__(self, width: int, height: int, rows: list) -> None:
        self.width, self.height, self.rows = width, height, rows

    def __eq__(self, other) -> bool:
        return (self.width, self.height, self.rows) == (other.width, other.height, other.rows)

    def part(self, left: int, top: int, right: int, bottom: int) -> "Picture":
        return Picture(right - left, bottom - top, [row[3 * left:3 * right] for row in self.rows[top:bottom]])


def predicted(left: int, up: int, corner: int) -> int:
    to_left, to_up, to_corner = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
    return left if to_left <= to_up and to_left <= to_corner else up if to_up <= to_corner else corner


def read_png(path: pathlib.Path) -> Picture:
    data, at, parts = path.read_bytes(), 8, []
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        parts.append((kind, data[at + 8:at + 8 + length]))
        at += 12 + length
    width, height, *form = struct.unpack(">IIBBBBB", parts[0][1])
    assert form == [8, 2, 0, 0, 0], f"{path}: {form}, expected RGB of 8 bits"
    raw = zlib.decompress(b"".join(body for kind, body in parts if kind == b"IDAT"))
    above, rows = bytearray(3 * width), []
    for y in range(height):
        start = y * (1 + 3 * width)
        kind, row = raw[start], bytearray(raw[start + 1:start + 1 + 3 * width])
        for i in range(3 * width) if kind else ():
            left, corner = (row[i - 3], above[i - 3]) if i >= 3 else (0, 0)
            guess = (0, left, above[i], (left + above[i]) // 2, predicted(left, above[i], corner) if kind == 4 else 0)
            row[i] = (row[i] + guess[kind]) & 255
        rows.append(row)
        above = row
    return Picture(width, height, rows)


def read_pfm(path: pathlib.Path) -> Picture:
    magic, size, scale, data = path.read_bytes().split(b"\n", 3)
    assert magic == b"PF" and scale == b"-1.0", path
    width, height = map(int, size.split())
    values = array.array("f", data)
    if sys.byteorder != "little":
        values.byteswap()
    return Picture(width, height, [values[3 * width * y:3 * width * (y + 1)] for y in reversed(range(height))])


class Display:
    """An X server without a window manager. Its picture is in a file."""

    def __init__(self, folder: pathlib.Path) -> None:
        folder.mkdir()
        self.frame = folder / "Xvfb_screen0"
        ours, theirs = os.pipe()
        self.process = subprocess.Popen(
            ["Xvfb", "-displayfd", str(theirs), "-screen", "0", "1280x900x24", "-fbdir", str(folder), "-nolisten", "tcp"],
            pass_fds=[theirs], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(theirs)
        number = b""
        while not number.endswith(b"\n"):
            assert select.select([ours], [], [], SECONDS)[0], "Xvfb names no display"
            piece = os.read(ours, 16)
            assert piece, "Xvfb has ended"
            number += piece
        os.close(ours)
        self.name = ":" + number.decode().strip()

    def close(self) -> None:
        self.process.kill()
        self.process.wait()

    def xdo(self, *arguments: object, check: bool = True) -> str:
        run = subprocess.run(["xdotool", *map(str, arguments)], env=environment(self.name), capture_output=True, text=True,
                             timeout=SECONDS, check=False)
        assert run.returncode == 0 or not check, f"xdotool {arguments}: {run.stderr}"
        return run.stdout

    def picture(self, width: int, height: int) -> Picture:
        """The server's picture at its upper left corner."""
        data = self.frame.read_bytes()  # an XWD: numbers, big endian, then colours of 12 bytes, then pixels
        header = struct.unpack(">25I", data[:100])
        assert header[11] == 32 and header[7] == 0, header  # bits of a pixel, blue first
        start, stride = header[0] + 12 * header[19], header[12]
        rows = []
        for y in range(height):
            line, row = data[start + y * stride:start + y * stride + 4 * width], bytearray(3 * width)
            row[0::3], row[1::3], row[2::3] = line[2::4], line[1::4], line[0::4]
            rows.append(row)
        return Picture(width, height, rows)

    def ask_to_close(self, window: int) -> None:
        """As a window manager does: WM_DELETE_WINDOW."""
        class Message(ctypes.Structure):
            _fields_ = [("type", ctypes.c_int), ("serial", ctypes.c_ulong), ("sent", ctypes.c_int),
                        ("display", ctypes.c_void_p), ("window", ctypes.c_ulong), ("kind", ctypes.c_ulong),
                        ("format", ctypes.c_int), ("data", ctypes.c_long * 5), ("rest", ctypes.c_long * 24)]

        x = ctypes.CDLL("libX11.so.6")
        x.XOpenDisplay.restype, x.XInternAtom.restype = ctypes.c_void_p, ctypes.c_ulong
        display = ctypes.c_void_p(x.XOpenDisplay(self.name.encode()))
        assert display.value, self.name
        atom = lambda name: x.XInternAtom(display, name, 0)  # noqa: E731
        message = Message(type=33, window=window, kind=atom(b"WM_PROTOCOLS"), format=32)
        message.data[0] = atom(b"WM_DELETE_WINDOW")
        x.XSendEvent(display, ctypes.c_ulong(window), 0, ctypes.c_long(0), ctypes.byref(message))
        x.XCloseDisplay(display)


    def drop(self, window: int, path: pathlib.Path) -> None:
        """As a file manager does when a file is dropped there: XDND, version 5."""
        x = ctypes.CDLL("libX11.so.6")
        x.XOpenDisplay.restype, x.XInternAtom.restype, x.XDefaultRootWindow.restype = ctypes.c_void_p, ctypes.c_ulong, ctypes.c_ulong
        x.XCreateSimpleWindow.restype = ctypes.c_ulong
        display = ctypes.c_void_p(x.XOpenDisplay(self.name.encode()))
        assert display.value, self.name
        atom = lambda name: x.XInternAtom(display, name, 0)  # noqa: E731
        root = ctypes.c_ulong(x.XDefaultRootWindow(display))
        source = x.XCreateSimpleWindow(display, root, 0, 0, 1, 1, 0, ctypes.c_ulong(0), ctypes.c_ulong(0))
        x.XSetSelectionOwner(display, ctypes.c_ulong(atom(b"XdndSelection")), ctypes.c_ulong(source), ctypes.c_ulong(0))

        def send(kind: bytes, *values: int) -> None:
            event = (ctypes.c_long * 24)(33, 0, 0, 0, window, atom(kind), 32, source, *values)  # a ClientMessage
            x.XSendEvent(display, ctypes.c_ulong(window), 0, ctypes.c_long(0), ctypes.byref(event))

        send(b"XdndEnter", 5 << 24, atom(b"text/uri-list"))
        send(b"XdndPosition", 0, 10 << 16 | 10, 0, atom(b"XdndActionCopy"))
        send(b"XdndDrop", 0, 0)
        uri, event = path.resolve().as_uri().encode() + b"\r\n", (ctypes.c_long * 24)()
        while event[0] & 0xffffffff != 30:  # SelectionRequest; the window asks for the name
            x.XNextEvent(display, ctypes.byref(event))
        asks, selection, target, put, when = event[5:10]
        x.XChangeProperty(display, ctypes.c_ulong(asks), ctypes.c_ulong(put), ctypes.c_ulong(target), 8, 0, uri, len(uri))
        answer = (ctypes.c_long * 24)(31, 0, 0, 0, asks, selection, target, put, when)  # a SelectionNotify
        x.XSendEvent(display, ctypes.c_ulong(asks), 0, ctypes.c_long(0), ctypes.byref(answer))
        while event[0] & 0xffffffff != 33 or event[5] != atom(b"XdndFinished"):
            x.XNextEvent(display, ctypes.byref(event))
        x.XCloseDisplay(display)


class Window:
    """gsc-play window, open in `folder`, with its log in log.jsonl there."""

    def __init__(self, display: Display, folder: pathlib.Path, command: list, most_bytes: int | None = None,
                 first: str = "") -> None:
        """`most_bytes`: of each file that it writes, as on a disk that is full then. `first`: a key pressed once, before any
        other, as soon as there is a picture."""
        def limit() -> None:
            if most_bytes:
                signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
                resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))

        self.display, self.folder, self._lines, self._rest = display, folder, [], ""
        self.log, self.out, self.err = folder / "log.jsonl", folder / "out.txt", folder / "err.txt"
        with self.out.open("wb") as out, self.err.open("wb") as err:
            self.process = subprocess.Popen([*map(str, command), "--log", "log.jsonl", "-w"], cwd=folder, stdout=out,
                                            stderr=err, env=environment(display.name), preexec_fn=limit)
        self._file = None
        try:
            self.line(lambda line: line["pose"] > 0 and line["pose"] == line["asked"])
            names = until(lambda: display.xdo("search", "--onlyvisible", "--name", " - gsc$", check=False).split() or None,
                          "the window", self.process)
            self.id = int(names[0])
            if first:
                until(lambda: self.display.xdo("windowfocus", self.id, "getwindowfocus", check=False).strip() == names[0] or None,
                      "the keyboard", self.process)
                self.display.xdo("key", first)
                self.line(lambda line: first.upper() in line["keys"])
            self.focus()
        except BaseException:
            print(self.said(), file=sys.stderr)
            self.process.kill()
            raise

    def said(self) -> str:
        return self.out.read_text() + self.err.read_text()

    def focus(self) -> None:
        """The keyboard is nobody's without a window manager. Looks until keys arrive."""
        def arrives():
            self.display.xdo("windowfocus", self.id, check=False)  # fails until it is mapped
            self.display.xdo("key", MARK)
            return next((True for line in self.lines()[start:] if line["keys"]), None)

        start = len(self.lines())
        until(arrives, "a key", self.process)
        self.settle()

    # --- the log

    def lines(self) -> list[dict]:
        if self._file is None and self.log.exists():
            self._file = self.log.open()
        if self._file is not None:
            *whole, self._rest = (self._rest + self._file.read()).split("\n")
            self._lines += map(json.loads, whole)
        return self._lines

    def line(self, wanted, start: int = 0) -> dict:
        """The first from index `start` on for which wanted(line) is true."""
        seen = start

        def found():
            nonlocal seen
            lines = self.lines()
            while seen < len(lines):
                seen += 1
                if wanted(lines[seen - 1]):
                    return lines[seen - 1]
            return None

        return until(found, "a line of the log", self.process)

    def settle(self) -> dict:
        """A line in which nothing that was sent is under way any more: the newest pose is shown and no newer one comes."""
        asked = -1
        while True:
            start = len(self.lines())
            self.display.xdo("key", MARK)
            mark = self.line(lambda line: MARK.upper() in line["keys"], start)
            shown = self.line(lambda line: line["pose"] == line["asked"], mark["frame"] - 1)
            if shown["pose"] == asked:
                return shown
            asked = shown["pose"]

    def rests(self) -> bool:
        """Shows nothing for a while in which a window that flies shows many frames."""
        lines = len(self.lines())
        time.sleep(0.5)
        return len(self.lines()) == lines

    def turns(self) -> int:
        """How often its main thread has waited."""
        status = pathlib.Path(f"/proc/{self.process.pid}/task/{self.process.pid}/status").read_text()
        return int(status.rpartition("\nvoluntary_ctxt_switches:")[2].split()[0])

    @contextlib.contextmanager
    def slowed(self):
        """As on a machine that has little time for it: stopped for most of the time."""
        done = threading.Event()

        def stops() -> None:
            while not done.is_set():
                self.process.send_signal(signal.SIGSTOP)
                time.sleep(0.18)
                self.process.send_signal(signal.SIGCONT)
                time.sleep(0.004)

        thread = threading.Thread(target=stops)
        thread.start()
        try:
            yield
        finally:
            done.set()
            thread.join()

    # --- a person

    def key(self, *names: str) -> dict:
        """Presses keys, one after the other, and returns the line after which nothing of it is under way."""
        self.display.xdo("key", *names)
        return self.settle()

    def hold(self, *names: str, poses: int = 12) -> dict:
        """Holds keys until so many new poses were shown."""
        start = len(self.lines())
        pose = self.lines()[-1]["asked"]
        self.display.xdo(*(word for name in names for word in ("keydown", name)))
        try:
            self.line(lambda line: line["pose"] >= pose + poses, start)
        finally:
            self.display.xdo(*(word for name in names for word in ("keyup", name)))
        return self.settle()

    def drag(self, button: int, *way: tuple[int, int]) -> dict:
        moves = [word for x, y in way for word in ("mousemove", "--window", self.id, x, y)]
        self.display.xdo(*moves[:5], "mousedown", button, *moves[5:], "mouseup", button)
        return self.settle()

    def screenshot(self) -> pathlib.Path:
        start = len(self.lines())
        self.display.xdo("key", "F12")
        return self.folder / self.line(lambda line: line["wrote"] is not None, start)["wrote"]

    # --- its end

    def ended(self) -> int:
        """The exit code. No validation layer said a word."""
        try:
            code = self.process.wait(SECONDS)
        finally:
            self.kill()
        said = self.said()
        assert "Validation" not in said and "VUID" not in said, said
        return code

    def close(self) -> int:
        self.display.xdo("key", "ctrl+q")
        return self.ended()

    def signal(self, number: int = signal.SIGINT) -> int:
        self.process.send_signal(number)
        return self.ended()

    def kill(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self.lines()
        if self._file is not None:
            self._file.close()
            self._file = None
            self.log.rename(self.log.with_name("seen.jsonl"))
