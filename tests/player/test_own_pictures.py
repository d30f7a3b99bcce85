#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Pictures of one's own: a camera by place, cameras by name, a turn, a way, and where they go.

test_own_pictures.py SOURCE_FOLDER GSC_PLAY WRITE_TINY_GSC
"""

import json
import math
import shutil
import subprocess
import sys
import unittest

from play_case import PLAY, SOURCE, TRAJECTORY, PlayTest, check_schema

NEEDS_FFMPEG = unittest.skipUnless(shutil.which("ffmpeg") and shutil.which("ffprobe"), "no ffmpeg")


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(v):
    length = math.sqrt(sum(x * x for x in v))
    return [x / length for x in v]


def level(position, target, up=(0, -1, 0)):
    """Frame of a trajectory that looks from one place at another."""
    forward = unit([t - p for t, p in zip(target, position)])
    right = unit(cross(forward, up))
    down = cross(forward, right)
    return {"rotation": [list(row) for row in zip(right, down, forward)], "position": list(position), "fov_x": 1.2}


class OwnPicturesTest(PlayTest):
    def picture(self, name: str) -> bytes:
        return (self.folder / name).read_bytes()

    def draw(self, *arguments: str, **keywords) -> subprocess.CompletedProcess:
        return self.play(self.model, "--size", "48x32", "--progress", "none", "-w", *arguments, **keywords)

    def test_own_camera_is_that_of_a_file(self) -> None:
        views = {"straight": ((-2, -2, -16), (-2, -2, 3)), "slanted": ((3.5, -6, -9.25), (-2, -1.5, 2))}
        for name, (position, target) in views.items():
            path = {"schema": "gsc.trajectory/1", "frames": [level(position, target)]}
            (self.folder / "one.json").write_text(json.dumps(path))
            self.draw("--cameras", "one.json", "--out", "file.png")
            self.draw("--cameras", self.path, "--position", ",".join(map(str, position)), "--look-at",
                      ",".join(map(str, target)), "--out", "own_{name}_{frame}.png")
            self.assertEqual(self.picture("own_view_0.png"), self.picture("file.png"), name)
        # axes of whole numbers: the same bits, not only the same pixels
        self.draw("--cameras", self.path, "--frames", "0:1", "--out", "file.pfm")
        self.draw("--cameras", self.path, "--position", "-2,-2,-16", "--look-at", "-2,-2,0", "--out", "own.pfm")
        self.assertEqual(self.picture("own.pfm"), self.picture("file.pfm"))
        self.assertGreater(len(set(self.picture("own.pfm"))), 100)

    def test_own_camera_without_cameras(self) -> None:
        self.model = self.tiny("bare.gsc", "0", "0")
        own = ("--position", "-2,-2,-16", "--look-at", "-2,-2,0")
        run = self.play(self.model, "--progress", "none", *own, "--out", "own.pfm", "--stats", "s.jsonl")
        self.assertEqual(self.picture("own.pfm")[:14], b"PF\n1280 720\n-1")
        self.refused(self.model, code=1, says="--position to gsc-play")
        frame = TRAJECTORY["frames"][0] | {"width": 1280, "height": 720, "fov_x": math.pi / 3}
        self.path.write_text(json.dumps(TRAJECTORY | {"frames": [frame]}))
        self.play(self.model, "--cameras", self.path, "--out", "file.pfm")
        self.assertEqual(self.picture("own.pfm"), self.picture("file.pfm"))
        self.assertEqual(run.stderr, "")

    def test_own_camera_is_measured(self) -> None:
        run = self.bench("--measure", "1", "--position", "-2,-2,-16", "--look-at", "-2,-2,0", "--format", "json")
        row = json.loads(run.stdout)
        check_schema("run", row)
        self.assertIn("view from -2,-2,-16 to -2,-2,0", run.stdout)

    def test_cameras_by_name(self) -> None:
        self.draw("--out", "all_{frame}.png", "--stats", "a.jsonl")
        names = [json.loads(line)["camera"] for line in (self.folder / "a.jsonl").read_text().splitlines()]
        self.draw("--cameras", f"stored:{names[2]},{names[0]}", "--out", "some_{frame}.png", "--stats", "s.jsonl")
        for i in (0, 2):  # a camera keeps its number
            self.assertEqual(self.picture(f"some_{i}.png"), self.picture(f"all_{i}.png"))
        order = [json.loads(line)["camera"] for line in (self.folder / "s.jsonl").read_text().splitlines()]
        self.assertEqual(order, [names[2], names[0]])
        self.refused(self.model, "--cameras", f"stored:{names[1]}x", code=1, says=f"expected one such as {names[1]}")

    def test_folder(self) -> None:
        names = [frame["name"] for frame in TRAJECTORY["frames"]]
        wanted = [f"{i:04}_{name}.png" for i, name in enumerate(names)]
        (self.folder / "there").mkdir()
        for out in ("there", "there/", "made/of/two/", "new", "new/er", "a{b}/", "{{c}", "d}/{name}/"):
            if out == "{{c}":
                (self.folder / out).mkdir()
            self.draw("--cameras", self.path, "--out", out)
            self.assertEqual(sorted(p.name for p in (self.folder / out).iterdir()), wanted)
        self.draw("--cameras", self.path, "--out", "eyes/", "--eyes", "2", "--ipd", "0.1")
        self.assertEqual(len(list((self.folder / "eyes").iterdir())), 8)

    def test_kinds_of_pictures(self) -> None:
        kinds = {"jpg": b"\xff\xd8\xff", "jpeg": b"\xff\xd8\xff", "webp": b"RIFF"}
        can = ".jpg" in self.play("--version").stdout
        for kind, magic in kinds.items():
            if not can:
                self.refused(self.model, "--out", f"{{frame}}.{kind}", code=5, says="this build cannot write")
                continue
            self.draw("--cameras", self.path, "--frames", "0:1", "--out", f"a.{kind}")
            self.draw("--cameras", self.path, "--frames", "0:1", "--out", f"b.{kind}")
            self.assertEqual(self.picture(f"a.{kind}")[:len(magic)], magic)
            self.assertEqual(self.picture(f"a.{kind}"), self.picture(f"b.{kind}"))
        if can:
            self.play(self.model, "--cameras", self.path, "--frames", "0:1", "--size", "16384x1", "--out", "w.webp", code=5)
            self.assertFalse((self.folder / "w.webp").exists())

    def rate(self, name: str) -> tuple[str, int]:
        run = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-show_entries",
                              "stream=r_frame_rate,nb_read_frames", "-of", "csv=p=0", name], cwd=self.folder,
                             capture_output=True, text=True, check=True)
        rate, frames = run.stdout.strip().split(",")
        return rate, int(frames)

    @NEEDS_FFMPEG
    def test_turntable(self) -> None:
        own = ("--position", "-2,-5,-16", "--look-at", "-2,-2,0")
        run = self.draw("--cameras", self.path, *own, "--turntable", "t.mp4", "--seconds", "0.5", "--fps", "16", "--out",
                        "t{frame}.png", "--format", "json")
        report = json.loads(run.stdout)
        check_schema("play-report", report)
        self.assertEqual((report["video"], report["frames"]), ("t.mp4", 8))
        self.assertEqual(self.rate("t.mp4"), ("16/1", 8))
        self.assertIn("no camera stands", report["warnings"][0])
        # begins where it would end
        self.draw("--cameras", self.path, *own, "--out", "own.png")
        self.assertEqual(self.picture("t0.png"), self.picture("own.png"))
        self.draw("--cameras", self.path, "--position", "-2,-5,16", "--look-at", "-2,-2,0", "--out", "back.png")
        self.assertEqual(self.picture("t4.png"), self.picture("back.png"))
        self.draw("--turntable", "default.mp4")
        self.assertEqual(self.rate("default.mp4"), ("30/1", 300))

    @NEEDS_FFMPEG
    def test_way_through_stored_cameras(self) -> None:
        self.draw("--out", "stored_{frame}.png")
        self.draw("--interpolate", "i.mp4", "--seconds", "2", "--fps", "10", "--out", "i{frame}.png")
        self.assertEqual(self.rate("i.mp4"), ("10/1", 20))
        self.assertEqual(self.picture("i0.png"), self.picture("stored_0.png"))
        self.assertEqual(self.picture("i19.png"), self.picture("stored_2.png"))
        # along a path of even steps there is a frame at each of its cameras
        self.draw("--cameras", self.path, "--out", "path_{frame}.png")
        self.draw("--cameras", self.path, "--interpolate", "p.mp4", "--seconds", "3.1", "--fps", "10", "--out",
                  "p{frame}.png")
        for i in range(4):
            self.assertEqual(self.picture(f"p{10 * i}.png"), self.picture(f"path_{i}.png"))
        self.assertNotEqual(self.picture("p5.png"), self.picture("p10.png"))

    def test_headset_trajectory(self) -> None:
        """Its frames have no lens of their own: a camera by place has 60 degrees, a way has none."""
        headset = SOURCE / "samples/paths/street_headset.json"
        self.assertIn('"views"', headset.read_text())
        self.refused(self.model, "--cameras", headset, "--interpolate", "i.mp4", code=1, says='"views"')
        own = ("--position", "-2,-2,-16", "--look-at", "-2,-2,0", "--size", "49x48")
        self.play(self.model, "--cameras", headset, *own, "--out", "a.pfm")
        self.play(self.model, "--cameras", headset, *own, "--fov", "60", "--out", "b.pfm")
        self.assertEqual(self.picture("a.pfm"), self.picture("b.pfm"))

    def test_rate_of_a_trajectory(self) -> None:
        def header(trajectory: dict, *arguments: str) -> bytes:
            self.path.write_text(json.dumps(trajectory))
            run = subprocess.run([PLAY, self.model, "--cameras", self.path, "--size", "8x8", "--backend", "cpu", "-q",
                                  "--out", "-", *arguments], capture_output=True, check=True)
            return run.stdout.split(b" ")[3]

        timed = [frame | {"time": i / 72} for i, frame in enumerate(TRAJECTORY["frames"])]
        half = [frame | ({"time": 0} if i < 2 else {}) for i, frame in enumerate(TRAJECTORY["frames"])]
        self.assertEqual(header(TRAJECTORY), b"F30000:1000")
        self.assertEqual(header(TRAJECTORY | {"fps": 72}), b"F72000:1000")
        self.assertEqual(header(TRAJECTORY | {"fps": 29.97}), b"F30000:1001")
        self.assertEqual(header(TRAJECTORY | {"frames": timed}), b"F72000:1000")
        self.assertEqual(header(TRAJECTORY | {"frames": timed, "fps": 24}), b"F24000:1000")
        self.assertEqual(header(TRAJECTORY | {"frames": timed}, "--fps", "25"), b"F25000:1000")
        for odd in ({"frames": half}, {"fps": 1e9}, {"frames": [frame | {"time": 1} for frame in half]}):
            self.assertEqual(header(TRAJECTORY | odd), b"F30000:1000")
        entry = {"camera_to_world": [1, 0, 0, -2, 0, -1, 0, -2, 0, 0, -1, -16, 0, 0, 0, 1], "fov": 60}
        studio = {"camera_path": [entry, entry], "render_width": 8, "render_height": 8}
        self.assertEqual(header(studio | {"fps": 24}), b"F24000:1000")
        self.assertEqual(header(studio | {"fps": None}), b"F30000:1000")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
