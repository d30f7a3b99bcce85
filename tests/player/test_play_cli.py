#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""gsc-play as a user meets it: cameras, options, reports, exit codes.

test_play_cli.py SOURCE_FOLDER GSC_PLAY WRITE_TINY_GSC WRITE_BENCH_REPORT
"""

import json
import math
import subprocess
import sys
import unittest

from play_case import PLAY, TRAJECTORY, PlayTest, check_schema, jsonschema, pfm


class PlayCliTest(PlayTest):
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
            stages = [line["ms"][stage] for stage in ("select", "decode", "project", "bin", "sort", "blend")]
            self.assertGreaterEqual(min(stages), 0)
            parts = sum(stages)
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
        check_schema("run", report)
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
        # the size asked for scales the pixel; another aspect adds columns at both sides; --fov zooms about the axis
        twice = transforms(96, 64, {"cx": 64, "cy": 0, "fl_x": 80, "fl_y": 80}, {})
        self.assertTrue(alike(draw("twice.pfm", twice, "--size", "48x32")[2], part))
        tall = transforms(32, 64, {"cx": 16, "cy": 0}, {})
        flat = draw("flat.pfm", tall, "--size", "64x64")
        self.assertTrue(alike(flat[2], draw("same.pfm", transforms(64, 64, {"cx": 32, "cy": 0}, {}))[2]))
        self.assertTrue(alike(cut(flat, 16, 0, 32, 64), draw("own.pfm", tall)[2]))
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

    def test_applied_transform(self) -> None:
        """Poses that nerfstudio moved: kept with a warning, or undone, against the picture of the poses before."""
        lens = {"fl_x": 40, "w": 48, "h": 32}
        pose = [[1, 0, 0, -2], [0, -1, 0, -2], [0, 0, -1, -16], [0, 0, 0, 1]]
        turn = [[0, 1, 0, 3], [0, 0, 1, -1], [1, 0, 0, 2]]  # of axes, and a shift
        # pose[3] is 0 0 0 1, so the product of a row of four and a column is turned, and shifted where it is a place
        moved = [[sum(row[k] * pose[k][c] for k in range(4)) for c in range(4)] for row in turn]
        moved = [[*row[:3], 2.5 * row[3]] for row in moved] + [[0, 0, 0, 1]]

        def draw(name: str, matrix: list, keys: dict, *arguments: str) -> tuple:
            frames = [{"file_path": "a.png", "transform_matrix": matrix}]
            self.path.write_text(json.dumps(lens | keys | {"frames": frames}))
            run = self.play(self.model, "--cameras", self.path, "--out", name, "--progress", "none", *arguments)
            return pfm(self.folder / name)[2], run.stderr

        def alike(a, b) -> bool:
            return max(abs(x - y) for x, y in zip(a, b, strict=True)) < 1e-3

        keys = {"applied_transform": turn, "applied_scale": 2.5}
        original, said = draw("original.pfm", pose, {})
        self.assertEqual(said, "")
        self.assertGreater(max(original) - min(original), 0.1)  # there is something to see
        as_moved, said = draw("moved.pfm", moved, {})
        self.assertEqual(said, "")
        kept, said = draw("kept.pfm", moved, keys)
        self.assertEqual(kept, as_moved)
        self.assertIn('path.json: "applied_transform", "applied_scale": the poses were moved', said)
        self.assertIn("--cameras-transform undo", said)
        self.assertEqual(draw("asked.pfm", moved, keys, "--cameras-transform", "keep"), (as_moved, ""))
        undone, said = draw("undone.pfm", moved, keys, "--cameras-transform", "undo")
        self.assertEqual(said, "")
        self.assertTrue(alike(undone, original))
        self.assertFalse(alike(kept, original))
        _, said = draw("nothing.pfm", pose, {}, "--cameras-transform", "undo")
        self.assertIn('neither "applied_transform" nor "applied_scale" to undo', said)
        mirror = {"applied_transform": [[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0]]}
        self.path.write_text(json.dumps(lens | mirror | {"frames": [{"file_path": "a", "transform_matrix": pose}]}))
        self.refused(self.model, "--cameras", self.path, "--cameras-transform", "undo", code=5, says='key "applied_transform"')

    def test_pixels_that_are_not_square(self) -> None:
        frames = [{"file_path": "a.png", "transform_matrix": [[1, 0, 0, -2], [0, -1, 0, -2], [0, 0, -1, -16], [0, 0, 0, 1]]}]

        def draw(name: str, keys: dict, *arguments: str) -> tuple:
            self.path.write_text(json.dumps(keys | {"w": 48, "h": 32, "frames": frames}))
            run = self.play(self.model, "--cameras", self.path, "--out", name, "--progress", "none", *arguments)
            return pfm(self.folder / name)[2], run.stderr

        focal, said = draw("focal.pfm", {"fl_x": 40, "fl_y": 32})
        self.assertEqual(said, "")
        angles, said = draw("angles.pfm", {"camera_angle_x": 2 * math.atan(24 / 40), "camera_angle_y": 2 * math.atan(16 / 32)})
        self.assertEqual(said, "")
        self.assertLess(max(abs(a - b) for a, b in zip(focal, angles, strict=True)), 1e-4)
        square, _ = draw("square.pfm", {"fl_x": 40})
        self.assertGreater(max(abs(a - b) for a, b in zip(focal, square, strict=True)), 0.01)
        _, said = draw("fov.pfm", {"fl_x": 40, "fl_y": 32}, "--fov", "60")
        self.assertIn("--fov: pixels of 1 of 1 camera are not square in ", said)
        self.assertEqual(draw("fov2.pfm", {"fl_x": 40}, "--fov", "60")[1], "")

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
        self.assertEqual(self.play(metric, *base, "-q", "--stats", "s.jsonl").stderr, "")
        stored = (metric, "--size", "48x32", "--eyes", "2")
        self.assertIn("0.032 world units", self.play(*stored, "--stats", "t.jsonl").stderr)
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
            for command in (("--stats", "-"), ("bench",)):
                self.refused(*command, *base, option, value, "--tier", "exact", code=1, says=f"{option} {value}: has no effect on")
        self.refused(*base, "--lod-bias", "-1", code=1, says="one level of detail")
        self.play(*base, "--lod-bias", "0", "--stats", "-")

    def test_target_that_is_refused_makes_nothing(self) -> None:
        base = (self.model, "--size", "48x32", "--progress", "none", "--target-ms", "5")
        outputs = ("--out", "o/{frame}.pfm", "--stats", "s/s.jsonl")
        for options in (("--tier", "exact"), ("--reuse", "depth"), ("--backend", "cpu-reference")):
            for out in (outputs, ("--out", "-"), ("--stats", "-")):
                self.refused(*base, "--cameras", self.path, *options, *out, code=1, says="--target-ms 5: has no effect on")
        for cameras in ((), ("--cameras", self.path, "--frames", "1:2")):  # the stored ones are none
            self.refused(*base, *cameras, *outputs, code=1, says="backend, tier and cameras, expected something to give up; pass "
                         "--tier fast without --reuse and two cameras or more of a trajectory, or leave it out")

    def test_help_of_detail(self) -> None:
        for command, plays in (((), True), (("bench",), True), (("live",), True), (("window",), False), (("xr",), False)):
            text = " ".join(self.play(*command, "--help-all").stdout.split())
            self.assertIn("--detail PIXELS", text)
            self.assertEqual("in no order" in text, plays, command)

    def test_detail_is_for_paths(self) -> None:
        """Cameras in no order, and one alone, are drawn as without it, byte by byte."""
        cameras = {"camera_angle_x": 1.2, "frames": [
            {"file_path": f"{i}", "transform_matrix": [[1, 0, 0, -2], [0, -1, 0, -2], [0, 0, -1, -60 - i], [0, 0, 0, 1]]}
            for i in range(4)]}
        (self.folder / "photos.json").write_text(json.dumps(cameras))
        far = [frame | {"position": [-2, -2, -60 - i]} for i, frame in enumerate(TRAJECTORY["frames"])]
        self.path.write_text(json.dumps(TRAJECTORY | {"frames": far}))
        base = (self.model, "--size", "48x32", "--progress", "none", "-w", "--stats", "s.jsonl")
        copies = 0
        for given, why in (((), f"the cameras of {self.model} are in no order"),
                           (("--cameras", "photos.json"), "the cameras of photos.json are in no order"),
                           (("--cameras", self.path, "--frames", "1:2"), f"one camera of {self.path} is played"),
                           (("--cameras", self.path), None)):
            self.play(*base, *given, "--out", "plain_{frame}.pfm")
            run = self.play(*base, *given, "--tier", "turbo", "--out", "turbo_{frame}.pfm", "--format", "json")
            report = json.loads(run.stdout)
            check_schema("play-report", report)
            detail = 0 if why else 2
            warned = [f"detail 2: {why}, expected two frames or more of a trajectory, which draw what those before them "
                      "made; drawn as without detail"] if why else []
            self.assertEqual((report["detail"], report["warnings"]), (detail, warned))
            self.assertEqual(run.stderr, "".join(f"warning: {text}\n" for text in warned))
            self.assertEqual(self.play(*base, *given, "--detail", "2", "-q").stderr, "")
            for line in (self.folder / "s.jsonl").read_text().splitlines():
                line = json.loads(line)
                groups = sum(line[f"groups_{name}"] for name in ("near", "kept", "stale", "made"))
                self.assertEqual((line["detail"], groups > 0), (detail, detail > 0))
                copies += line["groups_kept"] + line["groups_made"]
            for plain in self.folder.glob("plain_*.pfm") if why else ():
                self.assertEqual(plain.read_bytes(), (self.folder / plain.name.replace("plain", "turbo")).read_bytes())
        self.assertGreater(copies, 0)  # so there is something that the others went without

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

    def test_refusals_before_rendering(self) -> None:
        base = (self.model, "--cameras", self.path, "--size", "48x32")
        self.refused(*base, "--out", "same.pfm", code=1, says="{frame}")
        self.refused(*base, "--out", "{frame}.pfm", "--eyes", "2", "--ipd", "1", code=1, says="{eye}")
        self.refused(*base, "--out", "{what}.pfm", code=1, says="{what}")
        self.refused(*base, "--out", "{frame}.gif", code=5, says=".pfm")
        self.refused(*base, "--backend", "quantum", code=1, says="cpu")
        self.refused(*base, "--frames", "9:", code=1, says="--frames")
        self.refused(*base, "--appearance", "3", code=1, says="appearance")
        self.refused(self.model, "--cameras", self.path, code=1, says="--size")
        self.refused("none.gsc", code=2, says="none.gsc")
        self.refused(self.model, "--cameras", "none.json", code=2, says="none.json")
        self.refused(self.path, code=3, says="1001")
        self.refused(self.model, "--cameras", self.model, "--size", "8x8", code=3, says="is a model and no JSON")
        self.refused(self.model, "--size", "40000x8", code=1, says="--size")

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
        frames = [frame | {"appearance": 77 if i == 1 else 3} for i, frame in enumerate(TRAJECTORY["frames"])]
        self.path.write_text(json.dumps(TRAJECTORY | {"frames": frames}))
        warnings = json.loads(self.play(*base).stdout)["warnings"]
        self.assertEqual(len(warnings), 1)
        self.assertIn(f"the appearance row of 1 of {len(frames)} cameras is not in the file", warnings[0])

    def test_progress_and_verbose(self) -> None:
        base = (self.model, "--cameras", self.path, "--size", "16x16", "--format", "json")
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
        self.assertEqual(report["backend"].split(":")[0], listed[0])  # cuda:0, as --devices takes it
        # a better backend that this machine cannot run is named, with the reason
        self.assertEqual([f"warning: {text}" for text in report["warnings"]], run.stderr.splitlines())
        if "cuda" in listed:
            self.play(*base, "--backend", "cuda")
            return
        if report["warnings"]:  # there is a graphics card
            self.assertIn("cuda", report["warnings"][0])
        cuda = subprocess.run([PLAY, self.model, "--size", "8x8", "--backend", "cuda", "--stats", "-"], capture_output=True,
                              text=True, check=False)
        self.assertEqual(cuda.stdout, "")
        if cuda.returncode == 1:
            self.assertIn("not part of this build", cuda.stderr)
            return
        self.assertIn(cuda.returncode, (5, 7))
        self.assertRegex(cuda.stderr, r"^error: backend cuda:0: .*expected .*--backend cpu")
        sweep = self.folder / "sweep.json" # a sweep names it too
        sweep.write_text(json.dumps({"schema": "gsc.sweep/1", "trajectories": ["stored"], "size": [8, 8],
                                     "axes": {"backend": ["cpu", "cuda"]}}))
        run = subprocess.run([PLAY, "bench", self.model, "--sweep", sweep, "--out", self.folder / "runs.jsonl"],
                             capture_output=True, text=True, check=False)
        self.assertEqual((run.returncode, run.stderr), (cuda.returncode, cuda.stderr))
        self.assertFalse((self.folder / "runs.jsonl").exists())

    def test_nothing_to_keep(self) -> None:
        base = (self.model, "--cameras", self.path, "--size", "16x16")
        for more in ((), ("-q",), ("--target-ms", "100"), ("--progress", "json")):
            self.refused(*base, *more, code=1, says="model.gsc: nothing would be kept of 4 cameras, expected an output; add --out ")
        self.refused("nothing.gsc", code=2, says="nothing.gsc")  # a wrong file and a wrong option come first
        self.refused(*base, "--frames", "4:", code=1, says="--frames 4:")
        for more in (("-v",), ("--format", "json"), ("--stats", "s.jsonl"), ("--out", "{frame}.pfm")):
            self.play(*base, *more)

    def test_help_and_version(self) -> None:
        text = self.play("--help-all").stdout
        for word in ("--cameras", "--tier", "examples:", "exit codes:"):
            self.assertIn(word, text)
        version = self.play("--version").stdout
        for word in ("gsc-play ", "file format 1.", "CUDA "):
            self.assertIn(word, version)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
