#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How long a start of gsc-play takes, from a page cache without the file and from one that holds it.

bench_start.py GSC_PLAY FILE.gsc PATHS [RUNTIME_MANIFEST]

Lines: the disk (dd, 16 MiB, iflag=direct, which reads past the cache); gsc-play until it writes the first picture of
aerial.json of the folder PATHS, two eyes of 2048x2048, to a pipe; with the manifest of the fake OpenXR runtime also `gsc-play xr
--first-picture`, until the first picture and until one of the whole model. The cache loses the file by posix_fadvise(DONTNEED);
what mincore() still finds of it is printed.
"""
import ctypes
import json
import mmap
import os
import pathlib
import subprocess
import sys
import tempfile
import time

ROUNDS = 3


def cached(path: pathlib.Path) -> float:
    """Share of the file in the page cache."""
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, prot=mmap.PROT_READ | mmap.PROT_WRITE, flags=mmap.MAP_PRIVATE) as mapped:
        pages = (ctypes.c_ubyte * (-(-len(mapped) // mmap.PAGESIZE)))()
        start = ctypes.c_char.from_buffer(mapped)
        ctypes.CDLL(None).mincore(ctypes.c_void_p(ctypes.addressof(start)), ctypes.c_size_t(len(mapped)), pages)
        del start
        return sum(page & 1 for page in bytes(pages)) / len(pages)


def drop(path: pathlib.Path) -> None:
    with path.open("rb") as file:
        os.fsync(file.fileno())
        os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def disk(path: pathlib.Path) -> float:
    start = time.monotonic()
    subprocess.run(["dd", f"if={path}", "of=/dev/null", "bs=16M", "iflag=direct"], check=True, stderr=subprocess.DEVNULL)
    return time.monotonic() - start


def command(program: str, path: pathlib.Path, paths: pathlib.Path, *more: str) -> list:
    return [program, path, "--cameras", paths / "aerial.json", "--frames", "0:1", "--eyes", "2", "--size", "2048x2048", "--fov", "90",
            "--backend", "cuda", "-q", *more]


def load(*start) -> str:
    ms = json.loads(subprocess.run(command(*start, "--format", "json"), check=True, capture_output=True).stdout)["ms"]
    return f"open {ms['open'] / 1e3:.2f} s, load {ms['load'] / 1e3:.2f} s, {start[1].stat().st_size / ms['load'] / 1e6:.2f} GB/s"


def picture(*start) -> str:
    begin = time.monotonic()
    process = subprocess.Popen(command(*start, "--out", "-", "--stream", "rgb24"), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    process.stdout.read(1)
    first = time.monotonic() - begin
    process.stdout.read()
    if process.wait() != 0:
        sys.exit(f"gsc-play ended with {process.returncode}")
    return f"first picture after {first:.2f} s, ended after {time.monotonic() - begin:.2f} s"


def first_picture(program: str, path: pathlib.Path, paths: pathlib.Path, manifest: str, folder: pathlib.Path) -> str:
    view = {"fov": [-45, 45, 45, -45], "rotation": [0, 0, 0, 1], "width": 2048, "height": 2048}
    (folder / "settings.json").write_text(json.dumps({"clock": "real", "hz": 90, "hash": False, "head": [{"t": 0}], "views": [
        view | {"position": [-0.032, 0, 0]}, view | {"position": [0.032, 0, 0]}]}))
    start = time.monotonic_ns()
    subprocess.run([program, "xr", path, "--cameras", paths / "aerial.json", "--frames", "0:1", "--seconds", "6", "--first-picture",
                    "--log", folder / "log.jsonl", "-w", "-q"], check=True, stdout=subprocess.DEVNULL,
                   env=os.environ | {"XR_RUNTIME_JSON": manifest, "GSC_FAKE_XR": str(folder / "settings.json")})
    fresh = [line for line in map(json.loads, (folder / "log.jsonl").read_text().splitlines()) if line["fresh"]]
    whole = next(line for line in fresh if line["anchors_absent"] == 0)
    after = lambda line: (line["display_time"] - start) / 1e9  # noqa: E731
    return (f"xr: first picture seen after {after(fresh[0]):.2f} s, without {fresh[0]['anchors_absent']} anchors; whole after {after(whole):.2f} s, "
            f"{fresh.index(whole)} pictures later")


def main() -> None:
    program, path, paths = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    measured = [load, picture]
    with tempfile.TemporaryDirectory(prefix="gsc_bench_start_") as name:
        if len(sys.argv) > 4:
            manifest = str(pathlib.Path(sys.argv[4]).resolve())
            measured.append(lambda *start: first_picture(*start, manifest, pathlib.Path(name)))
        for cold in (True, False):
            for _ in range(ROUNDS):
                if cold:
                    print(f"disk: {path.stat().st_size / disk(path) / 1e9:.2f} GB/s")
                for measure in measured:
                    if cold:
                        drop(path)
                        print(f"cold ({100 * cached(path):.1f} % cached): ", end="")
                    else:
                        print("warm: ", end="")
                    print(measure(program, path, paths), flush=True)


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main()
