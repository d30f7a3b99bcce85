#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""png_to_pfm.py PNG...: writes NAME.pfm beside each NAME.png, for tests in a build that reads no PNG. For the trainers'
pictures: 16-bit RGB, not interlaced; value = integer / 65535. Needs nothing but Python itself, and a few seconds a megapixel."""
import struct
import sys
import zlib
from array import array
from multiprocessing import Pool
from pathlib import Path

PIXEL = 6  # bytes


def chunks(data):
    at = 8
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        yield kind, data[at + 8 : at + 8 + length]
        at += 12 + length


def paeth(left, up, corner):
    to_left, to_up, to_corner = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
    if to_left <= to_up and to_left <= to_corner:
        return left
    return up if to_up <= to_corner else corner


def unfilter(kind, line, above):
    """Both rows have a pixel of zeros before them."""
    if kind == 2:
        for i in range(PIXEL, len(line)):
            line[i] = (line[i] + above[i]) & 255
    elif kind == 1:
        for i in range(PIXEL, len(line)):
            line[i] = (line[i] + line[i - PIXEL]) & 255
    elif kind == 3:
        for i in range(PIXEL, len(line)):
            line[i] = (line[i] + (line[i - PIXEL] + above[i]) // 2) & 255
    elif kind == 4:
        for i in range(PIXEL, len(line)):
            line[i] = (line[i] + paeth(line[i - PIXEL], above[i], above[i - PIXEL])) & 255


def convert(path):
    data = path.read_bytes()
    parts = list(chunks(data))
    width, height, *form = struct.unpack(">IIBBBBB", parts[0][1])
    if data[:8] != b"\x89PNG\r\n\x1a\n" or form != [16, 2, 0, 0, 0]:
        raise ValueError(f"{path}: no PNG of 16-bit RGB without interlacing")
    raw = zlib.decompress(b"".join(body for kind, body in parts if kind == b"IDAT"))
    stride = 1 + PIXEL * width
    value = [i / 65535 for i in range(65536)]
    above, rows = bytearray(PIXEL + stride - 1), []
    for y in range(height):
        line = bytearray(PIXEL) + raw[y * stride + 1 : (y + 1) * stride]
        unfilter(raw[y * stride], line, above)
        rows.append(array("f", map(value.__getitem__, struct.unpack(f">{3 * width}H", line[PIXEL:]))))
        above = line
    if sys.byteorder != "little":
        for row in rows:
            row.byteswap()
    with path.with_suffix(".pfm").open("wb") as file:
        file.write(f"PF\n{width} {height}\n-1.0\n".encode())
        for row in reversed(rows):  # the format's rows go up
            row.tofile(file)


if __name__ == "__main__":
    with Pool() as pool:
        pool.map(convert, [Path(name) for name in sys.argv[1:]])
