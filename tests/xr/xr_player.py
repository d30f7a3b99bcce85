# SPDX-License-Identifier: Apache-2.0
"""Base of the tests of gsc-play xr: the programs that test_xr.py is given, sessions on the fake runtime, and checks of
every session."""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import typing
import unittest

import xr_case  # puts tests/support into the path
from cases import check_schema
from xr_case import Run, canted, environment, moving_head

SOURCE, PLAY, GSC, MANIFEST = (pathlib.Path(a).resolve() for a in sys.argv[1:5])
SIZE = (96, 88)
BACKEND = ("--backend", xr_case.BACKEND)
DEVICES = ("--devices", xr_case.BACKEND)
HZ = 90
SECONDS = float(os.environ.get("GSC_XR_SECONDS", "60"))  # of the test of pace
FAR_AWAY = "hang:1,hang-ms:10000"  # no frame is drawn, and none ends for longer than the session lasts


class XrCase(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls._files = tempfile.TemporaryDirectory(prefix="gsc_xr_")
        cls.models = pathlib.Path(cls._files.name)
        for name, more in {"room": (), "street": ("--model", "octree")}.items():
            made = cls.models / name
            subprocess.run([GSC, "sample", name, "-o", made, "--anchors", "3k", "-q", *more], check=True,
                           stdout=subprocess.DEVNULL)
            subprocess.run([GSC, "convert", made, "-o", made.with_suffix(".gsc"), "-q"], check=True,
                           stdout=subprocess.DEVNULL)

    @classmethod
    def tearDownClass(cls) -> None:
        cls._files.cleanup()

    def setUp(self) -> None:
        self.folder = self.models / self.id().rsplit(".", 1)[-1]
        self.folder.mkdir()

    def settings(self, frames: int | None = None, **more) -> pathlib.Path:
        """Settings of the fake runtime, which ends the session at frame `frames`."""
        made = {"views": canted(*SIZE), "head": moving_head(1), "log": str(self.folder / "fake.jsonl"),
                "dump": str(self.folder / "dump"), **more}
        if frames is not None:
            made["events"] = made.get("events", []) + [{"frame": frames, "do": "exit"}]
        path = self.folder / "settings.json"
        path.write_text(json.dumps(made))
        return path

    def xr(self, model: str, *arguments: object, settings: pathlib.Path | None, code: int = 0, backend: tuple = BACKEND,
           log: bool = True) -> Run:
        words = [PLAY, "xr", f"../{model}.gsc", *backend, *arguments] + (["--log", "log.jsonl", "-w"] if log else [])
        done = subprocess.run([str(word) for word in words], cwd=self.folder, capture_output=True, text=True, check=False,
                              env=environment(MANIFEST if settings else None, settings), timeout=600 + SECONDS)
        run = Run(self.folder, done)
        self.assertEqual(run.code, code, run.said())
        self.check(run)
        return run

    def check(self, run: Run) -> None:
        """Checks what holds for every session."""
        self.assertNotIn("VUID", run.said())
        self.assertNotIn("Validation", run.said())
        self.assertEqual(run.errors, [], run.said())  # nothing that OpenXR forbids
        check_schema("xr-log", *run.log)
        self.assertEqual([line["frame"] for line in run.log], list(range(1, len(run.log) + 1)))
        for line in run.frames:
            for view in line["views"]:
                self.assertIsNotNone(view["located"], line)  # each pose was handed out in this session
                self.assertLessEqual(view["located"], line["frame"])

    def cameras(self, run: Run) -> list[tuple[list, tuple, pathlib.Path]]:
        """For each view: place and frame of every picture, their size, and a camera file of their poses."""
        place, places, made = None, [], []
        wanted: list[tuple[dict, int, int]] = []
        frames = {line["frame"]: line for line in run.frames}
        for line in run.log:
            place = line["place"] or place
            places.append(place)
        for number, line in frames.items():
            for index, view in enumerate(line["views"]):
                wanted.append((places[view["located"]], number, index))
        for index in range(max((len(line["views"]) for line in frames.values()), default=0)):
            mine = [(place, number) for place, number, i in wanted if i == index]
            views = [frames[number]["views"][index] for _, number in mine]
            size = tuple(views[0]["rect"][2:])
            trajectory = None
            for (place, _), view in zip(mine, views):
                self.assertEqual(view["fov"], views[0]["fov"])
                one = xr_case.trajectory(place, [view], size)
                if trajectory is None:
                    trajectory = one
                else:
                    trajectory["frames"] += one["frames"]
            path = self.folder / f"view{index}.json"
            path.write_text(json.dumps(trajectory))
            made.append((mine, size, path))
        return made

    def check_pictures(self, run: Run, model: str, *arguments: object, shown: typing.Callable | None = None) -> int:
        """Every picture is the headless player's for its pose, byte by byte; with `shown`, which has shown_squares() of a
        frame and a view, in the squares that are not hidden. Returns their number."""
        compared = 0
        for index, (mine, size, path) in enumerate(self.cameras(run)):
            stream = subprocess.run([PLAY, f"../{model}.gsc", "--cameras", path, "--out", "-", "--stream", "rgb24", "-q",
                                     *BACKEND, *map(str, arguments)], cwd=self.folder, check=True, capture_output=True).stdout
            bytes_each = 3 * size[0] * size[1]
            self.assertEqual(len(stream), bytes_each * len(mine))
            for i, (_, number) in enumerate(mine):
                headless, given = stream[i * bytes_each:(i + 1) * bytes_each], run.picture(number, index)
                if shown is not None:
                    headless, given = self.seen_part(headless, given, size, shown(number, index))
                if headless != given:
                    off = [abs(a - b) for a, b in zip(headless, given)]
                    self.fail(f"frame {number}, view {index}: not what gsc-play draws of its pose; {sum(map(bool, off))} of "
                              f"{len(off)} bytes differ, by at most {max(off)}")
                compared += 1
        return compared

    def seen_part(self, headless: bytes, given: bytes, size: tuple, ranges: list) -> tuple[bytes, bytes]:
        """Rows of both pictures in the squares that are not hidden. The others are black in the one that was given."""
        cut = [[], []]
        for y in range(size[1]):
            first, end = (3 * 32 * square for square in ranges[y // 32])
            for rows, picture in zip(cut, (headless, given)):
                rows.append(picture[3 * size[0] * y:][:3 * size[0]][first:end])
            row = given[3 * size[0] * y:][:3 * size[0]]
            self.assertFalse(any(row[:first] + row[max(first, end):]), f"row {y}: something is drawn where the lens hides it")
        return b"".join(cut[0]), b"".join(cut[1])

    def slow(self, seconds: float, *arguments: object, backend: tuple) -> Run:
        settings = self.settings(clock="real", hz=HZ, hash=False)
        made = json.loads(settings.read_text())
        del made["dump"]
        settings.write_text(json.dumps(made))
        run = self.xr("room", "--seconds", seconds, *arguments, settings=settings, backend=backend)
        self.assertGreater(len(run.log), 0.9 * seconds * HZ)
        return run

    def info(self, *arguments: object, settings: pathlib.Path) -> str:
        return subprocess.run([PLAY, "xr", "--info", *arguments], cwd=self.folder, capture_output=True, text=True, check=True,
                              env=environment(MANIFEST, settings)).stdout

    def ended(self, *arguments: object, settings: pathlib.Path | None) -> subprocess.CompletedProcess:
        return subprocess.run([str(word) for word in (PLAY, "xr", *arguments, *BACKEND)], cwd=self.folder, capture_output=True,
                              text=True, env=environment(MANIFEST if settings else None, settings), timeout=xr_case.SECONDS, check=False)
