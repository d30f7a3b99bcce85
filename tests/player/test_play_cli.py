#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""gsc-play as a user meets it: exit codes, streams, files, schemas, Ctrl-C.

test_play_cli.py SOURCE_FOLDER GSC_PLAY WRITE_TINY_GSC WRITE_BENCH_REPORT
"""

import json
import math
import os
import pathlib
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest

try:
    import jsonschema
except ImportError:  # the schema checks are then left out, and the run says so
    jsonschema = None
    print("note: no jsonschema, schemas are not checked", file=sys.stderr)

SOURCE, PLAY, WRITE_TINY, WRITE_REPORT = (pathlib.Path(a) for a in sys.argv[1:5])


def check_schema(name: str, value) -> None:
    if jsonschema is not None:
        schema = json.loads((SOURCE / "schemas" / f"{name}.schema.json").read_text())
        jsonschema.Draft202012Validator(schema).validate(value)


def pfm(path: pathlib.Path) -> tuple[int, int, tuple[float, ...]]:
    magic, size, scale, data = path.read_bytes().split(b"\n", 3)
    assert magic == b"PF" and scale == b"-1.0"
    width, height = map(int, size.split())
    return width, height, struct.unpack(f"<{width * height * 3}f", data)


TRAJECTORY = {
    "schema": "gsc.trajectory/1",
    "frames": [
        {"name": f"view {i}", "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "position": [-2, -2, -16 - i], "fov_x": 1.2}
        for i in range(4)
    ],
}


class PlayTest(unittest.TestCase):
    def setUp(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="gsc_play_")
        self.folder = pathlib.Path(self._folder.name)
        self.model = self.tiny("model.gsc")
        self.path = self.folder / "path.json"
        self.path.write_text(json.dumps(TRAJECTORY))

    def tearDown(self) -> None:
        self._folder.cleanup()

    def tiny(self, name: str, *arguments: str) -> pathlib.Path:
        path = self.folder / name
        subprocess.run([WRITE_TINY, path, *arguments], check=True)
        return path

    def play(self, *arguments, code: int = 0) -> subprocess.CompletedProcess:
        # the CPU, so that a build for a GPU says the same on any machine
        if not {"--backend", "--help", "--version", "backends"} & set(arguments):
            arguments += ("--backend", "cpu")
        run = subprocess.run(
            [str(a) for a in (PLAY, *arguments)], capture_output=True, text=True, cwd=self.folder, check=False
        )
        self.assertEqual(run.returncode, code, f"{arguments}\n{run.stdout}\n{run.stderr}")
        if code != 0:
            self.assertNotEqual(run.stderr, "")
        return run

    def refused(self, *arguments, code: int, says: str) -> None:
        """Refused before any file appears."""
        before = sorted(self.folder.rglob("*"))
        run = self.play(*arguments, code=code)
        self.assertIn(says, run.stderr)
        self.assertEqual(run.stdout, "")
        self.assertEqual(sorted(self.folder.rglob("*")), before)

    def small(self, *arguments, **keywords):
        return self.play(
            self.model, "--cameras", self.path, "--size", "48x32", "--progress", "none", *arguments, **keywords
        )

    def test_stored_cameras_and_summary(self) -> None:
        run = self.play(self.model, "--size", "40x30", "--out", "o/{frame:03}.pfm", "-q")
        self.assertIn("3 frames, one eye, exact, cpu", run.stdout)  # the CPU has no half precision
        self.assertEqual(run.stderr, "")
        self.assertEqual([p.name for p in sorted((self.folder / "o").iterdir())], ["000.pfm", "001.pfm", "002.pfm"])
        self.assertEqual(pfm(self.folder / "o/000.pfm")[:2], (40, 30))

    def test_json_report_and_stats(self) -> None:
        run = self.small("--out", "{name}_{eye}.pfm", "--eyes", "2", "--ipd", "0.1", "--stats", "s/s.jsonl",
                         "--format", "json", "--tier", "fast", "--frames", "1:3", "--threads", "1", "--verify")
        report = json.loads(run.stdout)
        check_schema("play-report", report)
        self.assertEqual(report["frames"], 2)
        self.assertEqual(report["tier"], "exact")  # what ran
        self.assertEqual(report["pixels"], 2 * 2 * 48 * 32)
        self.assertEqual(report["images"], ["view 1_left.pfm", "view 1_right.pfm", "view 2_left.pfm", "view 2_right.pfm"])
        lines = [json.loads(line) for line in (self.folder / "s/s.jsonl").read_text().splitlines()]
        self.assertEqual([line["frame"] for line in lines], [1, 2])
        for line in lines:
            check_schema("frame-stats", line)
            self.assertEqual(len(line["eyes"]), 2)
            self.assertEqual(line["tier"], "exact")
            parts = sum(line["ms"][stage] for stage in ("select", "decode", "project", "bin", "sort", "blend"))
            self.assertLessEqual(parts, line["ms"]["total"] * 1.05 + 0.5)
        for image in report["images"]:
            self.assertEqual(pfm(self.folder / image)[:2], (48, 32))

    def test_trajectory_fits_its_schema(self) -> None:
        check_schema("trajectory", TRAJECTORY)
        shifted = TRAJECTORY | {"frames": [TRAJECTORY["frames"][0] | {"cx": 5}]}
        if jsonschema is not None:
            with self.assertRaises(jsonschema.ValidationError):
                check_schema("trajectory", shifted)
        self.path.write_text(json.dumps(shifted))
        self.refused(self.model, "--cameras", self.path, "--size", "48x32", code=3, says='state lenses that do not with "views"')

    def test_eyes_of_a_headset(self) -> None:
        tall = math.atan(math.tan(0.6) * 32 / 48)
        fov = {"left": -0.6, "right": 0.6, "up": tall, "down": -tall}
        straight = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]

        def eye(x: float, lens=fov, rotation=straight) -> dict:
            return {"fov": lens, "pose": {"position": [x, 0, 0], "rotation": rotation}}

        trajectory = TRAJECTORY | {"views": [eye(-0.5), eye(0.5)]}
        check_schema("trajectory", trajectory)
        if jsonschema is not None:
            for wrong in (trajectory | {"ipd": 0.06}, trajectory | {"views": [{"fov": fov}]}, trajectory | {"views": []}):
                with self.assertRaises(jsonschema.ValidationError):
                    check_schema("trajectory", wrong)

        # views that say what --ipd and the frames' lens say draw the same
        self.small("--out", "a{frame}_{eye}.pfm", "--eyes", "2", "--ipd", "1")
        self.path.write_text(json.dumps(trajectory))
        self.small("--out", "b{frame}_{eye}.pfm", "--eyes", "2")
        self.small("--out", "c{frame}.pfm")  # the left one
        for i in range(4):
            for side in ("left", "right"):
                a, b = (pfm(self.folder / f"{f}{i}_{side}.pfm")[2] for f in "ab")
                self.assertLess(max(abs(x - y) for x, y in zip(a, b, strict=True)), 1e-3)
            left = (self.folder / f"b{i}_left.pfm").read_bytes()
            self.assertEqual((self.folder / f"c{i}.pfm").read_bytes(), left)
            self.assertNotEqual((self.folder / f"b{i}_right.pfm").read_bytes(), left)

        # the left third of the same view is the same picture, cut
        third = fov | {"right": math.atan(math.tan(0.6) / -3)}
        self.path.write_text(json.dumps(trajectory | {"views": [eye(-0.5, third)]}))
        self.play(self.model, "--cameras", self.path, "--size", "16x32", "--out", "d{frame}.pfm")
        for i in range(4):
            whole, part = pfm(self.folder / f"c{i}.pfm")[2], pfm(self.folder / f"d{i}.pfm")[2]
            cut = [v for y in range(32) for v in whole[y * 144 : y * 144 + 48]]
            self.assertLess(max(abs(x - y) for x, y in zip(part, cut, strict=True)), 0.02)

        self.refused(self.model, "--cameras", self.path, "--size", "16x32", "--eyes", "2", code=1, says="one eye")
        self.refused(self.model, "--cameras", self.path, "--size", "16x32", "--eyes", "2", "--ipd", "1", code=1,
                     says='"views"')
        self.refused(self.model, "--cameras", self.path, "--size", "16x32", "--fov", "90", code=1, says='"views"')
        self.refused(self.model, "--cameras", self.path, code=1, says="--size")

        # canted outwards, a quarter turn each: neither eye shows what a straight one does
        canted = [eye(-0.5, rotation=[[0, 0, -1], [0, 1, 0], [1, 0, 0]]), eye(0.5)]
        self.path.write_text(json.dumps(trajectory | {"views": canted}))
        self.small("--out", "e{frame}_{eye}.pfm", "--eyes", "2")
        for i in range(4):
            self.assertEqual((self.folder / f"e{i}_right.pfm").read_bytes(), (self.folder / f"b{i}_right.pfm").read_bytes())
            self.assertNotEqual(
                (self.folder / f"e{i}_left.pfm").read_bytes(), (self.folder / f"b{i}_left.pfm").read_bytes()
            )

        # reports state no distance between such eyes
        report = json.loads(
            self.play("bench", self.model, "--cameras", self.path, "--size", "48x32", "--eyes", "2", "--measure", "2",
                      "--warmup", "0", "--format", "json").stdout
        )
        check_schema("bench-report", report)
        self.assertIsNone(report["config"]["ipd"])

    def test_principal_point(self) -> None:
        def transforms(width: int, height: int, file: dict, frame: dict) -> dict:
            keys = {"fl_x": 40, "fl_y": 40, "w": width, "h": height}
            matrix = [[1, 0, 0, -2], [0, -1, 0, -2], [0, 0, -1, -16], [0, 0, 0, 1]]  # looks along +z
            return keys | file | {"frames": [{"file_path": "a.png", "transform_matrix": matrix} | frame]}

        def draw(name: str, cameras: dict, *arguments: str) -> tuple:
            self.path.write_text(json.dumps(cameras))
            self.play(self.model, "--cameras", self.path, "--out", name, "-q", *arguments)
            return pfm(self.folder / name)

        def cut(whole: tuple, left: int, top: int, width: int, height: int) -> list:
            # a PFM starts with its lowest row
            rows = [whole[2][3 * whole[0] * y : 3 * whole[0] * (y + 1)] for y in reversed(range(whole[1]))]
            return [v for y in reversed(range(top, top + height)) for v in rows[y][3 * left : 3 * (left + width)]]

        def alike(a, b) -> bool:
            return max(abs(x - y) for x, y in zip(a, b, strict=True)) < 0.02

        # offsets of whole tiles, so that the same splats reach the same pixels
        whole = draw("whole.pfm", transforms(96, 64, {}, {}))
        part = cut(whole, 16, 32, 48, 32)
        self.assertGreater(max(part) - min(part), 0.1)  # there is something to see
        centre = {"cx": 32, "cy": 0}
        for name, file, frame in (("file", centre, {}), ("frame", {"cx": 3, "cy": 3}, centre)):
            self.assertTrue(alike(draw(f"{name}.pfm", transforms(48, 32, file, frame))[2], part), name)
        self.assertFalse(alike(draw("centred.pfm", transforms(48, 32, {}, {}))[2], part))
        # the size asked for scales the pixel; another aspect cuts rows at top and bottom; --fov zooms about the axis
        twice = transforms(96, 64, {"cx": 64, "cy": 0, "fl_x": 80, "fl_y": 80}, {})
        self.assertTrue(alike(draw("twice.pfm", twice, "--size", "48x32")[2], part))
        wide = transforms(48, 64, {"cx": 32, "cy": 16}, {})
        self.assertTrue(alike(draw("flat.pfm", wide, "--size", "48x32")[2], part))
        fov = str(2 * math.degrees(math.atan(24 / 40)))
        self.assertTrue(alike(draw("fov.pfm", transforms(48, 32, centre | {"fl_x": 90, "fl_y": 90}, {}), "--fov", fov)[2], part))
        # the middle changes no byte
        middle = draw("middle.pfm", transforms(96, 64, {"cx": 48, "cy": 32.0}, {}))
        self.assertEqual(middle, whole)
        self.path.write_text(json.dumps({k: v for k, v in transforms(48, 32, centre, {}).items() if k not in "wh"}))
        self.refused(self.model, "--cameras", self.path, "--size", "48x32", code=3, says='key "cx" is 32 and the image has no size')

    def test_lens_distortion(self) -> None:
        frames = [{"file_path": f"{i}.png", "transform_matrix": [[1, 0, 0, -2], [0, -1, 0, -2], [0, 0, -1, -16], [0, 0, 0, 1]]}
                  for i in range(2)]
        plain = {"fl_x": 40, "w": 48, "h": 32, "camera_model": "OPENCV", "k1": 0, "p1": 0.0, "frames": frames}
        self.path.write_text(json.dumps(plain))
        base = (self.model, "--cameras", self.path, "--progress", "none")
        self.assertEqual(self.play(*base, "--out", "a{frame}.pfm").stderr, "")
        self.path.write_text(json.dumps(plain | {"k1": -0.05}))
        self.refused(*base, code=5, says='path.json: key "k1" is -0.05, expected a pinhole')
        self.refused(*base, code=5, says="undistort the images")
        self.refused("bench", *base, code=5, says="--ignore-distortion")
        self.path.write_text(json.dumps(plain | {"camera_model": "OPENCV_FISHEYE"}))
        self.refused(*base, code=5, says='key "camera_model" is "OPENCV_FISHEYE", expected a pinhole')
        run = self.play(*base, "--ignore-distortion", "--out", "b{frame}.pfm", "--format", "json")
        self.assertIn("path.json: lens distortion of 2 of 2 cameras is ignored", run.stderr)
        report = json.loads(run.stdout)
        check_schema("play-report", report)
        self.assertEqual(len(report["warnings"]), 1)
        for i in range(2):
            self.assertEqual((self.folder / f"a{i}.pfm").read_bytes(), (self.folder / f"b{i}.pfm").read_bytes())
        self.path.write_text(json.dumps(plain | {"frames": [frames[0], frames[1] | {"p2": 0.25}]}))
        self.refused(*base, code=5, says='path.json: frame 1: key "p2" is 0.25')
        run = self.play("bench", *base, "--ignore-distortion", "--measure", "2", "--warmup", "0")
        self.assertIn("lens distortion of 1 of 2 cameras is ignored", run.stderr)

    def test_distance_of_the_eyes(self) -> None:
        metric = self.tiny("metric.gsc", "0", "3", "1", "0.5")
        base = ("--cameras", self.path, "--size", "48x32", "--progress", "none", "--eyes", "2")
        text = self.play(metric, *base, "--ipd", "0.032", "--out", "a{frame}_{eye}.pfm")
        self.assertEqual(text.stderr, "")
        for name, length in (("b", "0.064m"), ("c", "64mm"), ("d", "6.4cm"), ("e", "")):
            ipd = ("--ipd", length) if length else ()
            run = self.play(metric, *base, *ipd, "--out", name + "{frame}_{eye}.pfm")
            self.assertEqual("eyes 0.064 m apart: 0.032 world units" in run.stderr, not length)
            for eye in ("left", "right"):
                a, b = (self.folder / f"{n}2_{eye}.pfm" for n in ("a", name))
                self.assertEqual(a.read_bytes(), b.read_bytes())
        self.assertEqual(self.play(metric, *base, "-q").stderr, "")
        stored = (metric, "--size", "48x32", "--eyes", "2")
        self.assertIn("0.032 world units", self.play(*stored).stderr)
        # what the trajectory states comes first
        self.path.write_text(json.dumps(TRAJECTORY | {"ipd": 0.25}))
        bench = ("bench", metric, *base, "--measure", "2", "--warmup", "0", "--format", "json")
        self.assertEqual(json.loads(self.play(*bench).stdout)["config"]["ipd"], 0.25)
        self.assertEqual(json.loads(self.play(*bench, "--ipd", "1m").stdout)["config"]["ipd"], 0.5)

        self.path.write_text(json.dumps(TRAJECTORY))
        self.refused(self.model, *base, code=1, says='expected "ipd" in a trajectory or a metre in')
        self.refused(self.model, *base, "--ipd", "64mm", code=1, says="does not say how long a metre is")
        self.refused(self.model, "--eyes", "2", code=1, says="pass --ipd LENGTH, or convert the model again")
        self.refused(metric, *base, "--ipd", "64ft", code=1, says="--ipd 64ft: no length")
        one = (metric, "--cameras", self.path, "--size", "48x32")
        self.refused(*one, "--ipd", "0.1", code=1, says="has no effect")
        self.refused("bench", *one, "--ipd", "64mm", code=1, says="has no effect")

    def test_ranges_behind_the_end(self) -> None:
        base = (self.model, "--cameras", self.path, "--size", "48x32", "--progress", "none")
        self.refused(*base, "--frames", "0:1000", code=1,
                     says="--frames 0:1000: ends behind the last camera, expected at most 4; pass --frames 0:4 or 0:")
        self.refused(*base, "--frames", "2:5", code=1, says="pass --frames 2:4 or 2:")
        self.refused(*base, "--frames", "4:5", code=1, says="--frames 4:5: camera 4 is not there, expected at most 3")
        self.refused("bench", *base, "--frames", "1:9", code=1, says="--frames 1:9: ends behind the last camera")
        for frames, count in (("0:4", 4), ("1:", 3), ("3:4", 1), (":2", 2)):
            self.assertEqual(json.loads(self.play(*base, "--frames", frames, "--format", "json").stdout)["frames"], count)

    def test_levels_of_a_model_that_has_one(self) -> None:
        base = (self.model, "--cameras", self.path, "--size", "48x32", "--progress", "none")
        for option, value in (("--lod-bias", "-1"), ("--lod-fade", "0.5"), ("--lod-hysteresis", "0.1"), ("--target-ms", "5")):
            for command in ((), ("bench",)):
                self.refused(*command, *base, option, value, code=1, says=f"{option} {value}: has no effect on")
        self.refused(*base, "--lod-bias", "-1", code=1, says="one level of detail")
        self.play(*base, "--lod-bias", "0")

    def test_one_decode_for_both_eyes(self) -> None:
        both = ("--eyes", "2", "--ipd", "0.5")
        run = self.small("--out", "a{frame}_{eye}.pfm", "--stereo", "merged", "--format", "json", *both)
        report = json.loads(run.stdout)
        check_schema("play-report", report)
        self.assertEqual(report["stereo"], "merged")
        self.small("--out", "b{frame}_{eye}.pfm", "--stereo", "merged", "--backend", "cpu-reference", *both)
        for i in range(4):
            for side in ("left", "right"):
                a, b = (pfm(self.folder / f"{f}{i}_{side}.pfm")[2] for f in "ab")
                self.assertLess(max(abs(x - y) for x, y in zip(a, b, strict=True)), 1e-3)
        self.refused(self.model, "--cameras", self.path, "--size", "48x32", "--stereo", "merged", code=1, says="--eyes 2")
        self.refused(self.model, "--cameras", self.path, "--size", "48x32", "--stereo", "merged", *both, "--reuse",
                     "error", code=1, says="--stereo exact")

    def test_same_bytes_again_on_any_thread_count_and_eye(self) -> None:
        self.small("--out", "a/{frame}.pfm", "--tier", "exact", "--threads", "1")
        self.small("--out", "b/{frame}.pfm", "--tier", "exact", "--threads", "2")
        for i in range(4):
            first, second = ((self.folder / f / f"{i}.pfm").read_bytes() for f in "ab")
            self.assertEqual(first, second)

    def test_reference_backend_agrees(self) -> None:
        self.small("--out", "a{frame}.pfm", "--tier", "exact", "--background", "0.25,0.5,1")
        self.small("--out", "b{frame}.pfm", "--tier", "exact", "--background", "0.25,0.5,1", "--backend",
                   "cpu-reference")
        different = 0
        for i in range(4):
            a, b = (pfm(self.folder / f"{f}{i}.pfm")[2] for f in "ab")
            worst = max(abs(x - y) for x, y in zip(a, b, strict=True))
            self.assertLess(worst, 1e-3)
            different += len(set(a)) > 3
        self.assertGreater(different, 0, "every picture is flat; the test shows nothing")

    def test_existing_files(self) -> None:
        self.small("--out", "a{frame}.pfm")
        keep = (self.folder / "a2.pfm").read_bytes()
        self.refused(self.model, "--cameras", self.path, "--size", "48x32", "--out", "a{frame}.pfm", code=2, says="-w")
        self.assertEqual((self.folder / "a2.pfm").read_bytes(), keep)
        self.small("--out", "a{frame}.pfm", "-w")
        (self.folder / "old.jsonl").write_text("precious")
        self.refused(self.model, "--cameras", self.path, "--size", "48x32", "--stats", "old.jsonl", code=2, says="-w")

    def test_refusals_before_rendering(self) -> None:
        base = (self.model, "--cameras", self.path, "--size", "48x32")
        self.refused(*base, "--out", "same.pfm", code=1, says="{frame}")
        self.refused(*base, "--out", "{frame}.pfm", "--eyes", "2", "--ipd", "1", code=1, says="{eye}")
        self.refused(*base, "--out", "{what}.pfm", code=1, says="{what}")
        self.refused(*base, "--out", "{frame}.jpeg", code=5, says=".pfm")
        self.refused(*base, "--backend", "quantum", code=1, says="cpu")
        self.refused(*base, "--frames", "9:", code=1, says="--frames")
        self.refused(*base, "--appearance", "3", code=1, says="appearance")
        self.refused(self.model, "--cameras", self.path, code=1, says="--size")
        self.refused("none.gsc", code=2, says="none.gsc")
        self.refused(self.model, "--cameras", "none.json", code=2, says="none.json")
        self.refused(self.path, code=3, says="1001")
        self.refused(self.model, "--cameras", self.model, "--size", "8x8", code=3, says="is a model and no JSON")
        self.refused(self.model, "--size", "40000x8", code=1, says="--size")

    def test_outputs_fall_on_nothing(self) -> None:
        keep = self.model.read_bytes()
        base = (self.model, "--cameras", self.path, "--size", "16x16", "-w")
        self.refused(*base, "--stats", "./model.gsc", code=1, says="--stats would overwrite the model")
        self.refused(*base, "--stats", self.path, code=1, says="--stats would overwrite the camera file")
        self.refused(*base, "--frames", "0:1", "--out", "x.pfm", "--stats", "a/../x.pfm", code=1,
                     says="--stats would overwrite an image of --out")
        (self.folder / "link.pfm").symlink_to(self.model)
        self.refused(*base, "--frames", "0:1", "--out", "link.pfm", code=1, says="overwrite the model")
        os.link(self.model, self.folder / "hard.pfm")
        self.refused(*base, "--frames", "0:1", "--out", "hard.pfm", code=1, says="overwrite the model")
        os.mkfifo(self.folder / "pipe")
        self.refused(*base, "--stats", "pipe", code=2, says="no regular file")
        self.assertEqual(self.model.read_bytes(), keep)

    def test_bench_out_falls_on_nothing(self) -> None:
        """What is read, and what holds something else than rows, keeps every byte."""
        keep = {path: path.read_bytes() for path in (self.model, self.path)}
        (self.folder / "link").symlink_to("model.gsc")
        os.link(self.path, self.folder / "hard.json")
        base = ("bench", self.model, "--cameras", self.path, "--size", "16x16", "--measure", "1", "--warmup", "0", "--out")
        for name, says in (("model.gsc", "overwrite the model"), ("./link", "overwrite the model"),
                           ("path.json", "overwrite the camera file"), ("hard.json", "overwrite the camera file")):
            self.refused(*base, name, code=1, says=says)
        other = self.tiny("other.gsc")
        keep[other] = other.read_bytes()
        self.refused(*base, other, code=3, says="line 1 is no row of a bench")
        for text in ("precious", "{", "{}", '{"schema":"gsc.bench/x"}', "precious\n", "\n", "[1]\n", '{"schema":"gsc.run/1","x":1}\n', '{"schema":"gsc.bench/"}\n',
                     '{"schema":"gsc.bench/x"}\n', '{"schema":"gsc.bench/1"\n', '{"schema":"gsc.bench/1"}\nprecious'):
            (self.folder / "notes").write_text(text)
            self.refused(*base, "notes", code=3, says="is no row of a bench, expected \"gsc.bench/1\"")
            self.assertEqual((self.folder / "notes").read_text(), text)
        self.refused("bench", "none.gsc", "--out", "notes", code=3, says="is no row of a bench")  # before any work
        self.refused(*base, "/dev/stdout", code=2, says="- for standard output")
        self.refused(*base, "none/b.jsonl", code=2, says="folder does not exist")
        self.assertEqual(keep, {path: path.read_bytes() for path in keep})

    def test_bench_adds_whole_rows(self) -> None:
        (self.folder / "data").mkdir()
        (self.folder / "b.jsonl").symlink_to("data/rows")  # written through
        rows = self.folder / "data/rows"
        rows.write_text("")
        self.bench("--measure", "1", "--out", "b.jsonl")
        self.assertTrue((self.folder / "b.jsonl").is_symlink())
        first = rows.read_text()
        for tail in ('{"', '{"schema":"gsc.ben', first[:100], first[:-2]):
            rows.write_text(first + tail)
            run = self.bench("--measure", "1", "--out", "b.jsonl")
            self.assertIn("line 2 is half-written", run.stderr)
            lines = rows.read_text().splitlines()
            self.assertEqual((lines[0] + "\n", len(lines)), (first, 2))
            check_schema("bench-report", json.loads(lines[1]))
        for before in ("", first):  # the last row lacks its end alone
            rows.write_text(before + first[:-1])
            run = self.bench("--measure", "1", "--out", "b.jsonl")
            self.assertNotIn("half-written", run.stderr)
            self.assertTrue(rows.read_text().startswith(before + first))
            check_schema("bench-report", json.loads(rows.read_text()[len(before + first):]))
        rows.write_text(first + rows.read_text().splitlines(keepends=True)[-1])
        runs = [subprocess.Popen([PLAY, "bench", self.model, "--size", "8x8", "--measure", "5", "--warmup", "0", "--backend",
                                  "cpu", "--out", rows, "-q"], stdout=subprocess.DEVNULL) for _ in range(4)]
        self.assertEqual([run.wait(timeout=60) for run in runs], [0] * 4)
        self.assertEqual(len([json.loads(line) for line in rows.read_text().splitlines()]), 6)

    def test_standard_output(self) -> None:
        base = (self.model, "--cameras", self.path, "--size", "16x16", "--progress", "none")
        run = self.play(*base, "--stats", "-")
        self.assertEqual([json.loads(line)["frame"] for line in run.stdout.splitlines()], [0, 1, 2, 3])
        self.assertIn("4 frames, one eye", run.stderr)
        self.assertEqual(self.play(*base, "--stats", "-", "-q").stderr, "")
        run = self.bench("--measure", "1", "--out", "-")
        check_schema("bench-report", json.loads(run.stdout))
        self.assertIn("frame, wall", run.stderr)
        self.assertFalse((self.folder / "-").exists())
        for arguments in ((*base, "--stats", "-"), ("bench", *base, "--out", "-")):
            error = json.loads(self.play(*arguments, "--format", "json", code=1).stdout)
            check_schema("error", error)
            self.assertIn("--format json puts its own", error["message"])
        self.refused(*base, "--out", "-", code=1, says="./-")
        self.play(*base, "--stats", "./-")
        self.assertTrue((self.folder / "-").is_file())
        with open("/dev/full", "wb") as full:
            run = subprocess.run([PLAY, *base, "--stats", "-", "--backend", "cpu"], stdout=full, stderr=subprocess.PIPE,
                                 check=False)
        self.assertEqual(run.returncode, 2, run.stderr)

    def test_links_and_modes(self) -> None:
        (self.folder / "data").mkdir()
        (self.folder / "s.jsonl").symlink_to("data/s.jsonl")
        (self.folder / "a0.pfm").symlink_to("data/a.pfm")
        self.small("--frames", "0:1", "--stats", "s.jsonl", "--out", "a{frame}.pfm")
        for name, target in (("s.jsonl", "data/s.jsonl"), ("a0.pfm", "data/a.pfm")):
            self.assertEqual(os.readlink(self.folder / name), target)
            (self.folder / target).chmod(0o600)
        self.small("--frames", "0:1", "--stats", "s.jsonl", "--out", "a{frame}.pfm", "-w")
        self.assertEqual([(path.name, path.stat().st_mode & 0o777) for path in sorted((self.folder / "data").iterdir())],
                         [("a.pfm", 0o600), ("s.jsonl", 0o600)])

    def test_names_that_are_not_utf8(self) -> None:
        model = os.fsencode(self.folder) + b"/\xff\x80.gsc"
        run = subprocess.run([PLAY, model, "--format", "json", "--backend", "cpu"], capture_output=True, check=False)
        self.assertEqual(run.returncode, 2)
        check_schema("error", json.loads(run.stdout.decode()))
        self.assertIn("\ufffd\ufffd.gsc", run.stderr.decode())
        os.rename(self.model, model)
        run = subprocess.run([PLAY, model, "--size", "8x8", "--format", "json", "--backend", "cpu", "-q", "--stats",
                              model + b".jsonl"], capture_output=True, check=False)
        self.assertEqual(run.returncode, 0, run.stderr)
        check_schema("play-report", json.loads(run.stdout.decode()))
        self.assertTrue(os.path.exists(model + b".jsonl"))

    def test_file_size_limit(self) -> None:
        def limit() -> None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))

        for name in ("a.pfm", "a.png"):
            run = subprocess.run([PLAY, self.model, "--size", "200x200", "--frames", "0:1", "--out", name, "-q"],
                                 cwd=self.folder, capture_output=True, preexec_fn=limit, check=False)
            if run.returncode != 5:  # a build without PNG
                self.assertEqual(run.returncode, 2, run.stderr)
        self.assertEqual([p.name for p in self.folder.iterdir() if "tmp" in p.name], [])

    def test_error_as_json(self) -> None:
        run = self.play("none.gsc", "--format", "json", code=2)
        error = json.loads(run.stdout)
        check_schema("error", error)
        self.assertEqual(error["code"], "Io")
        self.assertEqual(error["exit_code"], 2)

    def test_damaged_payload_needs_verify(self) -> None:
        data = bytearray(self.model.read_bytes())
        data[4096 + 200] ^= 1  # inside ANCH, the first section
        self.model.write_bytes(data)
        self.refused(self.model, "--size", "8x8", "--verify", code=3, says="8001")

    def test_no_stored_cameras(self) -> None:
        self.refused(self.tiny("bare.gsc", "0", "0"), code=1, says="--cameras")

    def test_appearance(self) -> None:
        model = self.tiny("rows.gsc", "3")
        base = (model, "--cameras", self.path, "--size", "16x16", "--progress", "none", "--format", "json")
        run = self.play(*base)
        self.assertIn("--appearance", run.stderr)
        self.assertIn("--appearance", json.loads(run.stdout)["warnings"][0])
        run = self.play(*base, "--appearance", "3")
        self.assertEqual(run.stderr, "")
        self.play(*base, "--appearance", "77", code=1)

    def test_names_stay_in_the_folder(self) -> None:
        trajectory = json.loads(self.path.read_text())
        trajectory["frames"] = trajectory["frames"][:1]
        trajectory["frames"][0]["name"] = "../../escape/x"
        self.path.write_text(json.dumps(trajectory))
        self.small("--out", "o/{name}.pfm")
        self.assertEqual([p.name for p in (self.folder / "o").iterdir()], ["_._.._escape_x.pfm"])

    def test_unwritable_places(self) -> None:
        (self.folder / "file").write_text("")
        self.small("--out", "file/{frame}.pfm", code=2)
        self.small("--stats", self.folder, "-w", code=2)

    def test_progress_and_verbose(self) -> None:
        base = (self.model, "--cameras", self.path, "--size", "16x16")
        lines = self.play(*base, "--progress", "json").stderr.splitlines()
        self.assertEqual(json.loads(lines[-1])["done"], 4)
        for line in lines:
            check_schema("progress-event", json.loads(line))
        self.assertIn("render: done", self.play(*base, "--progress", "plain").stderr)
        self.assertIn("render [####################] 100 %", self.play(*base, "--progress", "bar").stderr)
        self.assertEqual(self.play(*base, "--progress", "none").stderr, "")
        self.assertIn("frame 3 view 3:", self.play(*base, "-v").stderr)

    def test_backends(self) -> None:
        listed = [line.split(":")[0] for line in self.play("backends").stdout.splitlines()]
        self.assertEqual(listed[-2:], ["cpu", "cpu-reference"])
        base = (self.model, "--size", "16x16", "--progress", "none", "--format", "json")
        run = self.play(*base, "--backend", "auto")
        report = json.loads(run.stdout)
        self.assertEqual(report["backend"], listed[0])
        # a better backend that this machine cannot run is named, with the reason
        self.assertEqual([f"warning: {text}" for text in report["warnings"]], run.stderr.splitlines())
        if "cuda" in listed:
            self.play(*base, "--backend", "cuda")
        elif report["warnings"]:
            self.assertIn("cuda", report["warnings"][0])
            cuda = subprocess.run([PLAY, self.model, "--size", "8x8", "--backend", "cuda"], capture_output=True,
                                  text=True, check=False)
            self.assertIn(cuda.returncode, (5, 7))
            self.assertRegex(cuda.stderr, r"^error: backend cuda: .*expected .*--backend cpu")
            self.assertEqual(cuda.stdout, "")
        else:
            self.refused(*base[:3], "--backend", "cuda", code=1, says="not part of this build")

    def bench(self, *arguments, **keywords):
        return self.play("bench", self.model, "--cameras", self.path, "--size", "48x32", "--progress", "none",
                         "--warmup", "2", *arguments, **keywords)

    def test_bench_report(self) -> None:
        for frames in (1, 9):
            run = self.bench("--eyes", "2", "--ipd", "0.1", "--measure", frames, "--quality", "3", "--label", "a b",
                             "--out", "b.jsonl", "--format", "json", "--fov", "60")
            report = json.loads(run.stdout)
            check_schema("bench-report", report)
            self.assertEqual(report["config"]["frames"], frames)
        lines = [json.loads(line) for line in (self.folder / "b.jsonl").read_text().splitlines()]
        self.assertEqual([line["config"]["frames"] for line in lines], [1, 9])
        self.assertEqual(lines[1], report)
        self.assertEqual(report["label"], "a b")
        self.assertIsNone(report["roofline"])  # a CPU's ceilings are not measured
        version = self.play("--version").stdout.splitlines()[0]
        commit = report["tool"]["commit"]
        self.assertEqual(version, f"gsc-play {report['tool']['version']}" + (f", commit {commit}" if commit else ""))
        self.assertEqual(report["config"]["shots"], 4)
        self.assertEqual(report["config"]["size"], [48, 32])
        self.assertAlmostEqual(report["config"]["fov_degrees"], 60)
        self.assertEqual(report["pixels_per_frame"], 2 * 48 * 32)
        self.assertEqual(report["quality"]["images"], 6)
        self.assertEqual(report["quality"]["reference"], "cpu")
        self.assertGreater(report["per_eye"]["gaussians_visible"]["max"], 0)
        for spread in (report["ms"]["wall"], report["ms"]["device"], report["ns_per_gaussian"]):
            self.assertGreater(spread["median"], 0)
            self.assertLessEqual(spread["median"], spread["p95"])
            self.assertLessEqual(spread["p95"], spread["p99"])
            self.assertLessEqual(spread["p99"], spread["max"])
        self.assertLessEqual(report["ms"]["device"]["mean"], report["ms"]["wall"]["mean"])
        stages = sum(stage["mean"] for stage in report["ms"]["stages"].values())
        self.assertLessEqual(stages, report["ms"]["device"]["mean"] * 1.05 + 0.5)

    def test_reuse_options(self) -> None:
        self.model = self.tiny("levels.gsc", "0", "3", "3")
        options = ("--reuse", "error", "--reuse-bound", "0.5", "--decode-budget", "100", "--lod-bias", "-1")
        said = {"policy": "error", "max_depth": None, "guidance": None, "bound": 0.5, "decode_budget": 100,
                "cache_budget": None}
        report = json.loads(self.small(*options, "--stats", "s.jsonl", "--format", "json").stdout)
        check_schema("play-report", report)
        self.assertEqual((report["reuse"], report["lod_bias"]), (said, -1))
        for line in (self.folder / "s.jsonl").read_text().splitlines():
            check_schema("frame-stats", json.loads(line))
        report = json.loads(self.bench("--measure", "3", *options, "--format", "json").stdout)
        check_schema("bench-report", report)
        self.assertEqual((report["config"]["reuse"], report["config"]["lod_bias"]), (said, -1))
        self.assertIn("reuse error: ", self.small(*options).stdout)
        self.assertIn("cache_evictions", self.bench("--measure", "3", *options).stdout)
        self.assertNotIn("cache_evictions", self.bench("--measure", "3").stdout)
        self.refused("bench", self.model, "--quality", "1", "--reuse", "depth", code=1, says="--sweep")
        self.refused(self.model, "--reuse-bound", "1", code=1, says="expected --reuse error")

    def test_levels(self) -> None:
        model = self.tiny("levels.gsc", "0", "3", "3")
        base = (model, "--cameras", self.path, "--size", "48x32", "--progress", "none")
        plain = self.play(*base, "--out", "plain/{frame}.pfm", "--stats", "plain.jsonl").stdout
        self.assertNotIn("target", plain)
        run = self.play(*base, "--out", "soft/{frame}.pfm", "--lod-fade", "1", "--lod-hysteresis", "0.2", "--format", "json")
        report = json.loads(run.stdout)
        check_schema("play-report", report)
        self.assertEqual([report[key] for key in ("lod_bias", "lod_fade", "lod_hysteresis", "target_ms", "lod_bias_used")],
                         [0, 1, 0.2, None, None])
        images = [[path.read_bytes() for path in sorted((self.folder / name).iterdir())] for name in ("plain", "soft")]
        self.assertNotEqual(images[0], images[1])

        # no frame takes so little: the bias falls from frame to frame once three are known
        target = ("--target-ms", "0.0001", "--lod-bias", "0.5")
        report = json.loads(self.play(*base, *target, "--stats", "s.jsonl", "--format", "json").stdout)
        check_schema("play-report", report)
        lines = [json.loads(line) for line in (self.folder / "s.jsonl").read_text().splitlines()]
        for line in lines:
            check_schema("frame-stats", line)
        used = [line["lod_bias"] for line in lines]
        self.assertEqual(used[:3], [0.5, 0.5, 0.5])
        self.assertTrue(all(a > b for a, b in zip(used[2:], used[3:])), used)
        self.assertLess(used[-1], 0.5)
        self.assertEqual(report["lod_bias_used"]["max"], 0.5)
        self.assertAlmostEqual(report["lod_bias_used"]["min"], used[-1])
        self.assertEqual((report["target_ms"], report["lod_bias"]), (0.0001, 0.5))
        self.assertIn("target 0.0001 ms: LOD bias", self.play(*base, *target).stdout)

        bench = ("bench", *base, "--warmup", "2", "--measure", "6", *target)
        report = json.loads(self.play(*bench, "--format", "json").stdout)
        check_schema("bench-report", report)
        self.assertLess(report["config"]["lod_bias_used"]["min"], report["config"]["lod_bias_used"]["max"])
        self.assertIn("target 0.0001 ms: LOD bias", self.play(*bench).stdout)
        self.refused(*bench, "--quality", "1", code=1, says="--target-ms")
        self.refused("bench", model, "--lod-hysteresis", "0.1", "--quality", "1", code=1, says="--lod-hysteresis")
        self.refused("bench", model, "--sweep", "x.json", "--target-ms", "5", code=1, says="--target-ms")
        self.refused(*base, "--lod-fade", "2", code=1, says="--lod-fade")
        self.refused(*base, "--lod-hysteresis", "0.1", "--backend", "cpu-reference", code=5, says="hysteresis")

    def test_bench_defaults(self) -> None:
        report = json.loads(self.play("bench", self.model, "--size", "8x8", "-q", "--format", "json").stdout)
        check_schema("bench-report", report)
        self.assertGreaterEqual(report["config"]["frames"], 300)
        self.assertGreater(report["config"]["warmup"], 0)

    def test_bench_floors(self) -> None:
        report = json.loads(subprocess.run([WRITE_REPORT], capture_output=True, text=True, check=True).stdout)
        check_schema("bench-report", report)
        stages = report["roofline"]["stages"]
        blend = stages["blend"]
        self.assertEqual((blend["bytes_read"], blend["bytes_written"]), (40e6, 12e6))
        self.assertEqual((blend["lane_operations"], blend["exponentials"]), (1.4e9, 1e8))
        self.assertEqual((blend["bound"], blend["measured_ms"]), ("lanes", 3))
        self.assertAlmostEqual(blend["floor_ms"], 1.4 / 30)
        self.assertAlmostEqual(blend["percent_of_ceiling"], 100 * 1.4 / 30 / 3)
        self.assertEqual((stages["decode"]["bound"], stages["decode"]["matrix_flop"]), ("memory", 2 * 6880e6))
        self.assertEqual((stages["sort"]["floor_ms"], stages["sort"]["percent_of_ceiling"]), (0, None))
        parts = [stages[name]["floor_ms"] for name in ("select", "decode", "bin", "sort", "blend")]
        self.assertAlmostEqual(stages["frame"]["floor_ms"], sum(parts))
        self.assertEqual(stages["frame"]["measured_ms"], 12)
        text = subprocess.run([WRITE_REPORT, "text"], capture_output=True, text=True, check=True).stdout
        self.assertRegex(text, r"blend +52\.00 +1\.400 +0\.000 +0\.0467 +3\.0000 +1\.6  lanes\n")
        self.assertNotRegex(text.split("ceilings of the device")[1], r"(?m)^  sort")

    def test_bench_repeats(self) -> None:
        report = json.loads(subprocess.run([WRITE_REPORT], capture_output=True, text=True, check=True).stdout)
        check_schema("bench-report", report)
        self.assertEqual(report["repeats"], {"frames": 2, "count": 3, "sum_ms": 7.5, "max_ms": 5})
        self.assertEqual(report["frames_that_grew"], 1)
        text = subprocess.run([WRITE_REPORT, "text"], capture_output=True, text=True, check=True).stdout
        self.assertIn("drawn again because a buffer was too small: 2 measured frames, 3 repeats; they took 7.500 of the "
                      "device's milliseconds above, 5.000 at most in a frame\n", text)
        self.assertIn("; 1 measured frames enlarged a buffer, more --warmup avoids that\n", text)

    def test_bench_table_and_refusals(self) -> None:
        text = self.bench("--measure", "5", "--frames", "1:3").stdout
        self.assertIn("5 frames after 2 of warm-up, round 2 cameras", text)
        for word in ("frame, wall", "frame, device", "blend", "ns per Gaussian", "pairs", "peak memory"):
            self.assertIn(word, text)
        self.assertNotIn("drawn again", text)  # a CPU never does
        self.assertNotIn("against exact", text)
        self.assertNotIn("ceilings", text)
        self.assertIn("against exact of cpu-reference, 4 images: PSNR",
                      self.bench("--measure", "1", "--quality", "99", "--reference", "cpu-reference").stdout)
        self.assertIn("--quality", self.play("bench", "--help").stdout)
        self.refused("bench", "none.gsc", code=2, says="none.gsc")
        self.refused("bench", self.model, "--measure", "0", code=1, says="--measure")
        self.refused("bench", self.model, "--tier", "best", code=1, says="--tier")
        self.bench("--measure", "1", "--out", self.folder, code=2)

    def test_full_disk(self) -> None:
        if not os.path.exists("/dev/full"):
            self.skipTest("no /dev/full")
        with open("/dev/full", "wb") as full:
            run = subprocess.run([PLAY, self.model, "--size", "8x8", "-q"], stdout=full, stderr=subprocess.PIPE,
                                 check=False)
        self.assertEqual(run.returncode, 2)

    def test_interrupt_leaves_whole_files(self) -> None:
        for number in (signal.SIGINT, signal.SIGHUP):
            with self.subTest(number):
                self.interrupt(number)
                shutil.rmtree(self.folder / "o")

    def interrupt(self, number: int) -> None:
        frames = TRAJECTORY["frames"][:1] * 2000
        self.path.write_text(json.dumps({"schema": "gsc.trajectory/1", "frames": frames}))
        run = subprocess.Popen(
            [PLAY, self.model, "--cameras", self.path, "--size", "320x200", "--out", "o/{frame}.pfm", "--stats",
             "s.jsonl", "-q"], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        out = self.folder / "o"
        deadline = time.monotonic() + 60
        while not (out / "3.pfm").exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        run.send_signal(number)
        stdout, stderr = run.communicate(timeout=60)
        self.assertEqual(run.returncode, 130, stderr)
        self.assertEqual(stdout, b"")
        self.assertFalse((self.folder / "s.jsonl").exists())
        self.assertEqual([p.name for p in self.folder.iterdir() if "tmp" in p.name], [])
        images = list(out.iterdir())
        self.assertGreater(len(images), 3)
        self.assertIn(f"{len(images)} images were written, all complete".encode(), stderr)
        for image in images:
            self.assertEqual(image.suffix, ".pfm")
            self.assertEqual(pfm(image)[:2], (320, 200))

    def test_image_that_appears_meanwhile_is_kept(self) -> None:
        frames = TRAJECTORY["frames"][:1] * 200
        self.path.write_text(json.dumps({"schema": "gsc.trajectory/1", "frames": frames}))
        run = subprocess.Popen([PLAY, self.model, "--cameras", self.path, "--size", "160x100", "--out", "o/{frame}.pfm",
                                "--backend", "cpu", "-q"], cwd=self.folder, stderr=subprocess.PIPE, text=True)
        out = self.folder / "o"
        deadline = time.monotonic() + 60
        while not (out / "0.pfm").exists() and time.monotonic() < deadline:
            time.sleep(0.001)
        run.send_signal(signal.SIGSTOP)
        self.assertFalse((out / "199.pfm").exists())
        (out / "199.pfm").write_text("precious")
        run.send_signal(signal.SIGCONT)
        stderr = run.communicate(timeout=60)[1]
        self.assertEqual(run.returncode, 2, stderr)
        self.assertIn("199.pfm: already exists", stderr)
        self.assertEqual((out / "199.pfm").read_text(), "precious")

    def test_help_and_version(self) -> None:
        text = self.play("--help").stdout
        for word in ("--cameras", "--tier", "examples:", "exit codes:"):
            self.assertIn(word, text)
        version = self.play("--version").stdout
        for word in ("gsc-play ", "file format 1.", "CUDA "):
            self.assertIn(word, version)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
