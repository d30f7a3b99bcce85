#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""PNG files of every kind, written here with Python's zlib, are read as they are; those that gsc-play writes are read
alike by other programs that are there.

test_png.py SOURCE_FOLDER GSC_PLAY WRITE_TINY_GSC GSC
"""
import json
import os
import pathlib
import random
import shutil
import struct
import subprocess
import sys
import unittest
import zlib
from array import array

from play_case import PlayTest

GSC = pathlib.Path(sys.argv[4])
PASSES = [(0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)]
RGB, PALETTE, RGBA = 2, 3, 6


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def paeth(left: int, up: int, corner: int) -> int:
    distances = [abs(left + up - corner - value) for value in (left, up, corner)]
    return (left, up, corner)[distances.index(min(distances))]


def filtered(rows: list, pixel: int, choose) -> bytes:
    out, above = bytearray(), bytes(len(rows[0]))
    for row in rows:
        kind = choose()
        out.append(kind)
        for i, value in enumerate(row):
            left, corner = (row[i - pixel], above[i - pixel]) if i >= pixel else (0, 0)
            out.append((value - (0, left, above[i], (left + above[i]) // 2, paeth(left, above[i], corner))[kind]) & 255)
        above = row
    return bytes(out)


def packed(values: list, depth: int) -> bytes:
    """Samples of a row; those of less than a byte begin at its high end."""
    if depth == 16:
        return struct.pack(f">{len(values)}H", *values)
    bits = "".join(format(value, f"0{depth}b") for value in values)
    return bytes(int(bits[i:i + 8].ljust(8, "0"), 2) for i in range(0, len(bits), 8))


def write_png(path: pathlib.Path, pixels: list, kind: int, depth: int, interlaced: bool, palette: bytes, chosen) -> None:
    """pixels[y][x] is the tuple of its samples."""
    height, width = len(pixels), len(pixels[0])
    pixel = max(1, depth * len(pixels[0][0]) // 8)
    data = b""
    for x, y, step_x, step_y in PASSES if interlaced else [(0, 0, 1, 1)]:
        rows = [packed([sample for one in row[x::step_x] for sample in one], depth) for row in pixels[y::step_y]]
        if rows and rows[0]:
            data += filtered(rows, pixel, chosen)
    stream = zlib.compress(data)
    header = struct.pack(">IIBBBBB", width, height, depth, kind, 0, 0, interlaced)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + (chunk(b"PLTE", palette) if palette else b"") +
                     chunk(b"tEXt", b"Comment\0none") + chunk(b"IDAT", stream[:5]) + chunk(b"IDAT", stream[5:]) + chunk(b"IEND", b""))


def write_pfm(path: pathlib.Path, pixels: list) -> None:
    values = array("f", [value for row in reversed(pixels) for one in row for value in one])
    path.write_bytes(f"PF\n{len(pixels[0])} {len(pixels)}\n-1.0\n".encode() + values.tobytes())


class PngTest(PlayTest):
    def test_every_kind_is_read(self) -> None:
        rng = random.Random(7)
        for name in ("png", "pfm"):
            (self.folder / name).mkdir()
        count = 0
        for kind, depth, samples in ((RGB, 8, 3), (RGB, 16, 3), (RGBA, 8, 4), (RGBA, 16, 4), *((PALETTE, d, 1) for d in (1, 2, 4, 8))):
            for interlaced in (False, True):
                for width, height in ((1, 1), (3, 2), (13, 9), (40, 17)):
                    top = (1 << depth) - 1
                    pixels = [[tuple(rng.randint(0, top) for _ in range(samples)) for _ in range(width)] for _ in range(height)]
                    palette = bytes(rng.randrange(256) for _ in range(3 << depth)) if kind == PALETTE else b""
                    name = f"{count:03}"
                    write_png(self.folder / f"png/{name}.png", pixels, kind, depth, interlaced, palette, lambda: rng.randrange(5))
                    colour = (lambda one: [palette[3 * one[0] + c] / 255 for c in range(3)]) if palette else \
                        (lambda one: [value / top for value in one[:3]])
                    write_pfm(self.folder / f"pfm/{name}.pfm", [[colour(one) for one in row] for row in pixels])
                    count += 1
        run = subprocess.run([GSC, "compare-pictures", "png", "pfm", "--format", "json"], cwd=self.folder, capture_output=True,
                             text=True, check=False)
        self.assertEqual(run.returncode, 0, run.stderr)
        views = json.loads(run.stdout)["scores"]["views"]
        self.assertEqual(len(views), count)
        for view in views:
            self.assertLess(view["max_error"], 1e-7, view["name"])

    def test_what_is_wrong_is_said(self) -> None:
        (self.folder / "a").mkdir()
        good = [[(1, 2, 3)] * 4] * 4
        path = self.folder / "a/a.png"

        def refused(code: int, says: str) -> None:
            run = subprocess.run([GSC, "compare-pictures", "a", "a"], cwd=self.folder, capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, code, run.stderr)
            self.assertIn(says, run.stderr)

        write_png(path, good, RGB, 8, False, b"", lambda: 0)
        whole = path.read_bytes()
        path.write_bytes(whole[:-20])
        refused(3, "a.png: cannot be decoded (it ends early), expected a whole image")
        write_png(path, [[(1,)] * 4] * 4, 0, 8, False, b"", lambda: 0)
        refused(5, "a.png: is grey, expected red, green and blue")
        write_png(path, [[(3,)] * 4] * 4, PALETTE, 2, False, bytes(6), lambda: 0)
        refused(3, "a pixel has a colour that the palette lacks")
        write_png(path, [[(3,)] * 4] * 4, PALETTE, 2, False, b"", lambda: 0)
        refused(3, "has no palette")
        write_png(path, [[(1, 2, 3)] * 40000], RGB, 8, False, b"", lambda: 0)
        refused(3, "is 40000 x 1 pixels, expected 1 to 32768 each")
        path.write_text("precious")
        refused(3, "a.png: no ")  # PNG image, or none that OpenImageIO knows

    def test_others_read_what_is_written(self) -> None:
        base = (self.model, "--cameras", self.path, "--size", "61x47", "--progress", "none")
        self.play(*base, "--out", "o/{frame}.png")
        self.play(*base, "--out", "o/{frame}.pfm")
        with open(self.folder / "o/0.pfm", "rb") as file:
            file.readline(), file.readline(), file.readline()
            values = array("f", file.read())
        rows = [values[i:i + 183] for i in range(0, len(values), 183)][::-1]
        wanted = bytes(max(0, min(255, int(255 * value + 0.5))) for row in rows for value in row)
        picture = self.folder / "o/0.png"
        readers = {  # raw RGB on standard output
            "ffmpeg": ["ffmpeg", "-v", "error", "-i", picture, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
            "pngtopnm": ["pngtopnm", picture],
            "gdk-pixbuf": ["python3", "-c", "import sys, gi; from gi.repository import GdkPixbuf as G; "
                           "p = G.Pixbuf.new_from_file(sys.argv[1]); sys.stdout.buffer.write(p.get_pixels())", picture],
            "oiiotool": ["oiiotool", picture, "-o", self.folder / "o/again.ppm"],
        }
        read = []
        for name, command in readers.items():
            if shutil.which(command[0]) is None:
                continue
            run = subprocess.run([str(part) for part in command], capture_output=True, check=False)
            if run.returncode != 0:  # Python without that library
                continue
            data = (self.folder / "o/again.ppm").read_bytes() if name == "oiiotool" else run.stdout
            self.assertEqual(data[-len(wanted):], wanted, name)
            read.append(name)
        print("read by", ", ".join(read))
        self.assertGreaterEqual(len(read), 3 if "GSC_CI" in os.environ else 1)  # .ci/setup.sh ci; tests

    def test_file_is_small(self) -> None:
        """A picture takes about as many bytes as by OpenImageIO; bench_png tells the time."""
        if shutil.which("oiiotool") is None:
            self.skipTest("no oiiotool")
        for command in ((GSC, "sample", "city", "--anchors", "30k", "-o", "city"), (GSC, "convert", "city", "-o", "city.gsc"),
                        ("oiiotool", "o/0.pfm", "-d", "uint8", "-o", "o/theirs.png")):
            if command[0] == "oiiotool":
                for ending in ("png", "pfm"):
                    self.play("city.gsc", "--frames", "0:1", "--size", "1280x720", "--progress", "none", "--out", f"o/{{frame}}.{ending}")
            subprocess.run(command, cwd=self.folder, check=True, capture_output=True)
        ours, theirs = ((self.folder / "o" / name).stat().st_size for name in ("0.png", "theirs.png"))
        print(f"1280x720: {ours} bytes, {ours / theirs:.2f} times those of OpenImageIO")
        self.assertLessEqual(ours, 1.15 * theirs)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
