#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""gsc-play bench --sweep and gsc-play stability as a user meets them: rows, resuming, refusals, Ctrl-C, exit codes.

test_sweep_cli.py SOURCE_FOLDER GSC_PLAY WRITE_TINY_GSC
"""

import json
import math
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from play_case import PLAY, WRITE_TINY, check_schema


def trajectory(frames: int, **more) -> str:
    return json.dumps({
        "schema": "gsc.trajectory/1", **more,
        "frames": [{"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "position": [-2, -2, -16 - 0.1 * i], "fov_x": 1.2}
                   for i in range(frames)]})


class SweepTest(unittest.TestCase):
    def setUp(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="gsc_sweep_")
        self.folder = pathlib.Path(self._folder.name)
        self.model = self.folder / "model.gsc"
        subprocess.run([WRITE_TINY, self.model], check=True)
        (self.folder / "c/paths").mkdir(parents=True)
        (self.folder / "c/paths/first.json").write_text(trajectory(6, name="walk", ipd=0.1))
        (self.folder / "c/paths/second.json").write_text(trajectory(8))
        self.config = self.folder / "c/sweep.json"
        self.out = self.folder / "runs.jsonl"

    def tearDown(self) -> None:
        self._folder.cleanup()

    def play(self, *arguments, code: int = 0) -> subprocess.CompletedProcess:
        run = subprocess.run([str(a) for a in (PLAY, *arguments)], capture_output=True, text=True, cwd=self.folder,
                             check=False)
        self.assertEqual(run.returncode, code, f"{arguments}\n{run.stdout}\n{run.stderr}")
        return run

    def write(self, **config) -> None:
        config = {"schema": "gsc.sweep/1", "trajectories": ["paths/first.json", "paths/second.json"], "size": [48, 32],
                  "warmup": 2, **config}
        self.config.write_text(json.dumps(config))

    def sweep(self, *arguments, **keywords) -> subprocess.CompletedProcess:
        base = ("bench", self.model, "--sweep", self.config, "--out", self.out, "--progress", "none")
        return self.play(*base, *(() if "--backend" in arguments else ("--backend", "cpu")), *arguments, **keywords)

    def rows(self) -> list:
        text = self.out.read_text()
        self.assertTrue(text.endswith("\n"))
        return [json.loads(line) for line in text.splitlines()]

    def refused(self, *arguments, code: int, says: str) -> None:
        before = sorted(self.folder.rglob("*"))
        run = self.sweep(*arguments, code=code)
        self.assertIn(says, run.stderr)
        self.assertEqual(run.stdout, "")
        self.assertEqual(sorted(self.folder.rglob("*")), before)

    def test_one_decode_for_both_eyes(self) -> None:
        self.write(axes={"policy": ["none", "depth", "error"], "stereo": ["exact", "merged"]}, eyes=2)
        check_schema("sweep", json.loads(self.config.read_text()))
        run = self.sweep("--ipd", "0.2")
        self.assertIn("none merged", run.stdout)
        rows = [json.loads(line) for line in self.out.read_text().splitlines()]
        for row in rows:
            check_schema("run", row)
        self.assertEqual({(row["config"]["policy"], row["config"]["stereo"]) for row in rows},
                         {("none", "exact"), ("depth", "exact"), ("error", "exact"), ("none", "merged"), ("depth", "merged")})
        self.out.unlink()
        self.write(axes={"stereo": ["merged"]}, eyes=1)
        self.refused(code=1, says="two eyes")

    def test_rows(self) -> None:
        self.write(trajectories=["paths/first.json", "paths/second.json", "stored"], eyes=2, frames=7,
                   quality={"ssim": 3, "flip": 4},
                   axes={"policy": ["none", "error"], "bound": [0.5, 2], "tier": ["fast", "exact"]})
        check_schema("sweep", json.loads(self.config.read_text()))
        run = self.sweep("--ipd", "0.2", "--label", "a b", "--format", "json")
        rows = self.rows()
        self.assertEqual([json.loads(line) for line in run.stdout.splitlines()], rows)
        self.assertEqual(len(rows), 3 * 3 * 2)
        self.assertEqual(len({row["config"]["id"] for row in rows}), len(rows))
        for row in rows:
            check_schema("run", row)
            config, frames = row["config"], row["config"]["frames"]
            self.assertEqual((row["label"], config["eyes"], config["ipd"], config["size"]), ("a b", 2, 0.2, [48, 32]))
            for values in row["per_frame"].values():
                self.assertEqual(len(values), frames)
            self.assertEqual(row["accuracy"]["ssim"]["frames"], (frames + 2) // 3)
            self.assertEqual(row["accuracy"]["flip"]["frames"], (frames + 3) // 4)
            self.assertEqual((config["bound"] is None), config["policy"] == "none")
            times = sorted(row["per_frame"]["wall_ms"][min(2, frames - 1):])
            self.assertAlmostEqual(row["ms"]["wall"]["max"], times[-1])
            self.assertAlmostEqual(row["ms"]["wall"]["median"], times[math.ceil(len(times) / 2) - 1])
        self.assertEqual([(r["config"]["trajectory"], r["config"]["cameras"], r["config"]["frames"]) for r in rows[::6]],
                         [("walk", "paths/first.json", 6), ("second", "paths/second.json", 7), ("stored", "stored", 3)])

    def test_accuracy_is_measured(self) -> None:
        """The scalar reference differs from the fast renderer by rounding: little, but not by nothing."""
        self.write(axes={"policy": ["none"]})
        self.sweep("--reference", "cpu-reference")
        for row in self.rows():
            self.assertEqual(row["reference"], "cpu-reference")
            psnr = row["accuracy"]["psnr"]
            self.assertLess(80, psnr["min"])
            self.assertLessEqual(psnr["min"], psnr["p1"])
            self.assertLessEqual(psnr["p1"], psnr["pooled"] + 10)
            self.assertEqual(psnr["min"], row["per_frame"]["psnr"][psnr["min_frame"]])
            temporal = [v for v in row["per_frame"]["temporal"] if v is not None]
            self.assertEqual(len(temporal), row["config"]["frames"] - 1)
            self.assertEqual(row["accuracy"]["temporal"]["max"], max(temporal))
            self.assertGreater(row["accuracy"]["temporal"]["rms"], 0)
            self.assertGreater(row["accuracy"]["max_error"], 0)
        self.out.unlink()
        self.sweep()
        self.assertIsNone(self.rows()[0]["accuracy"]["psnr"]["pooled"])  # equal

    def test_levels_of_a_model_that_has_one(self) -> None:
        for axis in ("lod_bias", "lod_fade", "lod_hysteresis"):
            self.write(axes={axis: [0, 0.5]})
            self.refused(code=1, says=f"sweep.json: a run has {axis} 0.5: has no effect on")
            self.write(axes={axis: [0]})
            self.sweep()
            self.out.unlink()
        self.write(runs=[{"lod_bias": -1}])
        self.refused(code=1, says="one level of detail")
        self.write(axes={})
        self.refused("--lod-bias", "-1", code=1, says="--lod-bias -1: has no effect on")
        run = self.stability("--trajectories", "c/paths", "--lod-fade", "0.5", code=1)
        self.assertIn("--lod-fade 0.5: has no effect on", run.stderr)

    def test_distance_of_the_eyes(self) -> None:
        self.write(axes={})
        self.refused("--ipd", "0.1", code=1, says="--ipd: has no effect")
        self.write(axes={}, eyes=2, trajectories=["paths/second.json"])
        self.refused(code=1, says="a metre in")
        self.refused("--ipd", "64mm", code=1, says="does not say how long a metre is")
        subprocess.run([WRITE_TINY, self.model, "0", "3", "1", "0.5"], check=True)
        run = self.sweep()
        self.assertIn("eyes 0.064 m apart: 0.032 world units", run.stderr)
        self.assertEqual(self.rows()[0]["config"]["ipd"], 0.032)
        run = self.stability("--trajectories", "c/paths/first.json", "--ipd", "64mm", code=1)
        self.assertIn("--ipd: has no effect", run.stderr)

    def test_lens_distortion(self) -> None:
        (self.folder / "c/paths/first.json").write_text(trajectory(3, k1=0.5))
        self.write(axes={}, trajectories=["paths/first.json"])
        self.refused(code=5, says='c/paths/first.json: key "k1" is 0.5, expected a pinhole')
        self.assertIn("is ignored", self.sweep("--ignore-distortion").stderr)
        paths = ("--trajectories", "c/paths/first.json")
        self.assertIn("--ignore-distortion", self.stability(*paths, code=5).stderr)
        self.assertIn("is ignored", self.stability(*paths, "--ignore-distortion").stderr)

    def test_applied_transform(self) -> None:
        matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
        frames = [{"file_path": f"{i}.png", "transform_matrix": matrix} for i in range(3)]
        (self.folder / "c/paths/first.json").write_text(
            json.dumps({"fl_x": 40, "w": 48, "h": 32, "applied_transform": matrix[:3], "applied_scale": 2, "frames": frames})
        )
        self.write(axes={}, trajectories=["paths/first.json"])
        self.assertIn('"applied_scale": the poses were moved', self.sweep().stderr)
        paths = ("--trajectories", "c/paths/first.json")
        self.assertIn("applied_scale", self.stability(*paths).stderr)
        self.assertNotIn("applied_scale", self.stability(*paths, "--cameras-transform", "undo").stderr)

    def test_levels_pop(self) -> None:
        subprocess.run([WRITE_TINY, self.model, "0", "3", "3"], check=True)
        self.write(axes={"lod_fade": [0, 0.5], "lod_hysteresis": [0, 0.25]})
        check_schema("sweep", json.loads(self.config.read_text()))
        self.sweep()
        self.assertEqual([(r["config"]["lod_fade"], r["config"]["lod_hysteresis"]) for r in self.rows()[:4]],
                         [(0, 0), (0, 0.25), (0.5, 0), (0.5, 0.25)])
        for row in self.rows():
            check_schema("run", row)
            motion, pop = row["accuracy"]["motion"], row["accuracy"]["pop"]
            self.assertGreater(motion["p50"], 0)
            self.assertLessEqual(motion["p99"], motion["max"])
            self.assertLess(motion["max_frame"], row["config"]["frames"])
            self.assertLessEqual(pop["p50"], pop["max"])

    def test_detail(self) -> None:
        self.write(axes={"tier": ["exact", "fast", "turbo"], "policy": ["none", "depth"]}, runs=[{"detail": 4}],
                   trajectories=["paths/first.json"])
        check_schema("sweep", json.loads(self.config.read_text()))
        run = self.sweep()
        self.assertNotIn("in the file already", run.stderr)
        rows = self.rows()
        for row in rows:
            check_schema("run", row)
            self.assertEqual(row["rendered_tier"], "exact")  # of a CPU
        told = [(row["config"]["policy"], row["config"]["tier"], row["config"]["detail"]) for row in rows]
        self.assertEqual(told, [("none", "exact", 0), ("depth", "exact", 0), ("none", "fast", 0), ("depth", "fast", 0),
                                ("none", "fast", 2), ("none", "fast", 4)])
        self.assertIn("none detail 2", run.stdout)
        self.assertIn("in the file already: 6 of 6 runs", self.sweep().stderr)
        self.write(runs=[{}, {"detail": 0}, {"tier": "exact"}], trajectories=["paths/first.json"])
        self.out.unlink()
        self.sweep("--tier", "turbo")  # which is the command line's for what the file leaves out
        self.assertEqual([(row["config"]["tier"], row["config"]["detail"]) for row in self.rows()],
                         [("fast", 2), ("fast", 0), ("exact", 0)])
        self.write(runs=[{"tier": "exact", "detail": 2}])
        self.refused(code=3, says='runs[0]: key "detail" is 2 with tier exact')
        self.write(runs=[{"tier": "turbo", "policy": "error"}])
        self.refused(code=3, says='runs[0]: key "policy" is "error" with a detail of 2 pixels')
        row = json.loads(self.stability("--trajectories", "c/paths/first.json", "--detail", "3", "--format", "json").stdout)
        check_schema("run", row)
        self.assertEqual((row["config"]["detail"], row["warnings"]), (3, []))

    def test_detail_is_for_paths(self) -> None:
        """On the stored cameras a run with detail is the one without, and each is drawn once."""
        self.write(axes={"tier": ["turbo", "fast"], "detail": [0, 2, 4]}, trajectories=["stored", "paths/first.json"])
        said = self.sweep().stderr
        self.assertEqual(said.count("are in no order"), 1, said)
        self.assertIn("detail 4: ", said)
        told = [(row["config"]["trajectory"], row["config"]["detail"]) for row in self.rows()]
        self.assertEqual(told, [("stored", 0), ("walk", 0), ("walk", 2), ("walk", 4)])
        self.assertIn("in the file already: 4 of 4 runs", self.sweep().stderr)
        self.write(axes={"detail": [0, 2]}, trajectories=["stored", "stored", "paths/first.json", "paths/second.json"])
        shards = []
        for i in (1, 2, 3):  # which warn of what they draw, once, and again where it is done
            for _ in range(2):
                self.out = self.folder / f"s{i}.jsonl"
                said = self.sweep("--shard", f"{i}/3").stderr
                cameras = {row["config"]["cameras"] for row in self.rows()}
                self.assertEqual(said.count("are in no order"), int("stored" in cameras), (cameras, said))
            shards.append("stored" in cameras)
        self.assertEqual(sum(shards), 1)
        run = self.stability("--trajectories", "c/paths/first.json", "--frames", "0:1", "--detail", "3", "--bound-temporal", "0",
                             "--format", "json")  # a view at rest
        self.assertEqual((run.stderr, json.loads(run.stdout)["warnings"]), ("", []))

    def test_stability_says_what_is_no_path(self) -> None:
        """Once for each camera file that a shard draws, and also where its rows are there already."""
        photos = {"camera_angle_x": 1.2, "frames": [
            {"file_path": f"{i}", "transform_matrix": [[1, 0, 0, -2], [0, -1, 0, -2], [0, 0, -1, -16 - i], [0, 0, 0, 1]]}
            for i in range(4)]}
        (self.folder / "photos.json").write_text(json.dumps(photos))
        files = ("--trajectories", "photos.json", "photos.json", "c/paths/second.json", "--detail", "2", "--format", "json")
        warned = ["detail 2: the cameras of photos.json are in no order, expected two frames or more of a trajectory, which draw "
                  "what those before them made; drawn as without detail"]
        for shard, texts in (((), warned), (("--shard", "1/2", "--out", "s1.jsonl"), warned),
                             (("--shard", "2/2", "--out", "s2.jsonl"), [])):
            for _ in range(2):
                run = self.stability(*files, *shard)
                rows = [json.loads(line) for line in run.stdout.splitlines()]
                self.assertEqual([row["warnings"] for row in rows],
                                 [texts if row["config"]["cameras"] == "photos.json" else [] for row in rows], shard)
                self.assertEqual(run.stderr.count("in no order"), len(texts), run.stderr)

    def test_foveation(self) -> None:
        """A CPU draws everything: the same pictures, told apart by their configuration."""
        axes = {"tier": ["fast", "exact"], "fovea_pixels": [0, 1.5, 3]}
        swept = {"axes": axes, "trajectories": ["paths/first.json"], "eyes": 2, "quality": {"flip": 3}}
        self.write(**swept)
        check_schema("sweep", json.loads(self.config.read_text()))
        run = self.sweep("--ipd", "0.2", "--reference", "cpu-reference")
        rows = self.rows()
        self.assertEqual([(r["config"]["tier"], r["config"]["fovea_pixels"]) for r in rows],
                         [("fast", None), ("fast", 1.5), ("fast", 3), ("exact", None)])
        for row in rows:
            check_schema("run", row)
            self.assertEqual("fovea" in row["accuracy"], row["config"]["fovea_pixels"] is not None)
            self.assertEqual(row["per_frame"]["psnr"], rows[0]["per_frame"]["psnr"])
        fovea = rows[1]["accuracy"]["fovea"]
        inside, outside = fovea["inside"], fovea["outside"]
        self.assertEqual(fovea, rows[2]["accuracy"]["fovea"])
        self.assertAlmostEqual(inside["share"] + outside["share"], 1)
        self.assertLess(inside["share"], 0.2)
        # the parts pool to the whole
        error = sum(part["share"] * 10 ** (-part["psnr"]["pooled"] / 10) for part in (inside, outside))
        self.assertAlmostEqual(-10 * math.log10(error), rows[1]["accuracy"]["psnr"]["pooled"], 6)
        flip = sum(part["share"] * part["flip_mean"] for part in (inside, outside))
        self.assertAlmostEqual(flip, rows[1]["accuracy"]["flip"]["mean"], 6)
        self.assertIn("none fovea 1.5", run.stdout)
        self.assertEqual(run.stdout.count("within 12 degrees of the gaze: PSNR "), 2)
        # gone on with: nothing is done again, a new value is
        self.write(**{**swept, "axes": {**axes, "fovea_pixels": [0, 1.5, 3, 5]}})
        again = self.sweep("--ipd", "0.2", "--reference", "cpu-reference")
        self.assertIn("in the file already: 4 of 5 runs", again.stderr)
        self.assertEqual([r["config"]["fovea_pixels"] for r in self.rows()], [None, 1.5, 3, None, 5])
        # the command line says what the file does not
        self.out.unlink()
        self.write(runs=[{}, {"fovea_pixels": 0}, {"tier": "exact"}], trajectories=["paths/first.json"])
        self.sweep("--foveation", "fixed", "--fovea-pixels", "2.5")
        self.assertEqual([r["config"]["fovea_pixels"] for r in self.rows()], [2.5, None, None])
        self.out.unlink()
        self.write(runs=[{"tier": "exact", "fovea_pixels": 2}])
        self.refused(code=3, says='runs[0]: key "fovea_pixels" is 2 with tier exact')

    def test_resume(self) -> None:
        self.write(axes={"policy": ["none", "error"], "bound": [0.5, 1]})
        first = self.sweep().stdout
        whole = self.out.read_bytes()
        lines = whole.splitlines(keepends=True)
        self.assertEqual(len(lines), 6)
        again = self.sweep()
        self.assertEqual(self.out.read_bytes(), whole)
        self.assertEqual(again.stdout, first)
        self.assertIn("in the file already: 6 of 6 runs", again.stderr)
        # killed in the middle of the fifth line
        self.out.write_bytes(b"".join(lines[:4]) + lines[4][:200])
        run = self.sweep()
        self.assertIn("line 5 is half-written", run.stderr)
        self.assertIn("in the file already: 4 of 6 runs", run.stderr)
        rows = self.rows()
        self.assertEqual(self.out.read_bytes().splitlines(keepends=True)[:4], lines[:4])
        self.assertEqual([r["config"]["id"] for r in rows], [json.loads(line)["config"]["id"] for line in lines])
        # a longer sweep adds what is new, other poses and another model are other runs
        self.write(axes={"policy": ["none", "error"], "bound": [0.5, 1, 2]})
        self.sweep()
        self.assertEqual(len(self.rows()), 8)
        self.write(axes={"policy": ["none"]}, size=[40, 32])
        self.sweep()
        self.assertEqual(len(self.rows()), 10)
        subprocess.run([WRITE_TINY, self.model, "0", "4"], check=True)
        self.sweep()
        self.assertEqual(len(self.rows()), 12)

    def test_match(self) -> None:
        self.write(trajectories=["paths/first.json"], eyes=2, axes={"policy": ["error"], "max_depth": [6, 9], "decode_budget": ["match"]})
        self.sweep()
        depth, error = self.rows()
        self.assertEqual((depth["config"]["policy"], depth["config"]["max_depth"]), ("depth", 6))
        self.assertIsNone(depth["config"]["decode_budget"])
        mean = sum(depth["per_frame"]["decoded"][1:]) / 5 / 2
        self.assertEqual(error["config"]["decode_budget"], max(1, round(mean)))
        # the number comes from the file where the run is there
        doctored = dict(depth)
        doctored["per_frame"] = {**depth["per_frame"], "decoded": [14] * 6}
        self.out.write_text(json.dumps(doctored, separators=(",", ":")) + "\n")
        self.sweep()
        self.assertEqual(self.rows()[1]["config"]["decode_budget"], 7)

    def test_table(self) -> None:
        self.write(trajectories=["paths/first.json"], axes={"policy": ["none", "depth"], "max_depth": [4]})
        run = self.play("bench", self.model, "--sweep", self.config, "--backend", "cpu", "--progress", "plain")
        header, none, depth = run.stdout.splitlines()
        for word in ("trajectory", "PSNR dB", "p99 ms", "flicker 1/255"):
            self.assertIn(word, header)
        self.assertRegex(none, r"^walk +cpu +none .* identical +identical +identical")
        self.assertIn("depth 4 lin", depth)
        self.assertEqual(run.stderr.count("done in"), 1, run.stderr)  # one clock for all runs
        self.assertFalse(self.out.exists())

    def test_progress(self) -> None:
        """One stage over all runs: exact images once a path, then each frame drawn and scored. Runs in the file are none."""
        self.write(axes={"policy": ["none", "error"]})
        command = ("bench", self.model, "--sweep", self.config, "--out", self.out, "--backend", "cpu", "--progress", "json")

        def steps(*arguments) -> int:
            events = [json.loads(line) for line in self.play(*arguments).stderr.splitlines()]
            check_schema("progress-event", *events)
            stages = [event for event in events if "stage" in event]
            self.assertEqual([e["event"] for e in stages if e["event"] != "progress"], ["start", "done"] if stages else [])
            if not stages:
                return 0
            self.assertEqual((stages[0]["done"], stages[-1]["done"]), (0, stages[-1]["total"]))
            return stages[-1]["total"]

        self.assertEqual(steps(*command), 5 * 6 + 5 * 8)
        lines = self.out.read_text().splitlines(keepends=True)
        self.assertEqual(steps(*command), 0)
        self.out.write_text(lines[0])
        self.assertEqual(steps(*command), 3 * 6 + 5 * 8)
        self.out.unlink()
        self.write(axes={"policy": ["none"]})
        self.assertEqual(steps(*command), 3 * 6 + 3 * 8)
        self.write(axes={"policy": ["depth", "none"]})  # what is in the file comes last
        self.assertEqual(steps(*command), 3 * 6 + 3 * 8)
        files = ("--trajectories", "c/paths/first.json", "c/paths/second.json")
        base = ("stability", self.model, "--backend", "cpu", "--size", "48x32", "--progress", "json", *files)
        self.assertEqual(steps(*base), 3 * 6 + 3 * 8)

    def test_refusals(self) -> None:
        self.write(axes={"policy": ["none", "some"]})
        self.refused(code=3, says='sweep.json: axes: key "policy[1]" is "some", expected one of')
        self.write(axes={"bound": []})
        self.refused(code=3, says='key "bound" is an array of 0, expected an array of at least one value')
        self.write(trajectories=["paths/none.json"], axes={})
        self.refused(code=2, says="c/paths/none.json: cannot be opened")
        self.write(axes={}, eyes=2, trajectories=["paths/second.json"])
        self.refused(code=1, says="--ipd")
        self.write(axes={}, size=None)
        self.refused(code=1, says="--size")
        self.write(axes={}, size=[40000, 10])
        self.refused(code=3, says="1 to 32768")
        self.config.write_text("no JSON")
        self.refused(code=3, says="expected a sweep")
        self.config.unlink()
        self.refused(code=2, says="sweep.json: cannot be opened")
        self.write(axes={})
        (self.folder / "c/paths/first.json").write_text('{"schema":"gsc.trajectory/1","frames":[]}')
        self.refused(code=3, says="holds no camera")
        for option in ("--frames", "--warmup", "--quality", "--measure", "--cameras"):
            self.refused(option, "3", code=1, says="--sweep")

    def test_outputs_fall_on_nothing(self) -> None:
        self.write(axes={})
        for target, code, says in ((self.model, 1, "overwrite the model"), (self.config, 1, "the file of --sweep"),
                                   (self.folder / "c/paths/second.json", 1, "overwrite a camera file"),
                                   (self.folder, 2, "is a folder")):
            self.out = target
            self.refused(code=code, says=says)
        self.out = self.folder / "notes.txt"
        for text, code, says in (("precious", 3, "line 1 is no row of a measurement"), ("precious\n", 3, "line 1 is no row of a measurement"),
                                 ('{"schema":"gsc.run/1"}\n', 5, "make new rows with gsc-play bench MODEL.gsc --sweep")):
            self.out.write_text(text)
            self.refused(code=code, says=says)
            self.assertEqual(self.out.read_text(), text)
        self.out = self.folder / "none/runs.jsonl"
        self.refused(code=2, says="none/runs.jsonl: its folder does not exist")

    def test_rows_on_standard_output(self) -> None:
        self.write(trajectories=["paths/first.json"], axes={})
        self.out = "-"
        run = self.sweep()
        check_schema("run", json.loads(run.stdout))
        self.assertIn("walk", run.stderr)
        self.assertFalse((self.folder / "-").exists())
        self.assertIn("(--format)", self.sweep("--format", "json", code=1).stderr)

    def test_interrupt_leaves_whole_rows(self) -> None:
        (self.folder / "c/paths/second.json").write_text(trajectory(20))
        self.write(trajectories=["paths/second.json"], size=[320, 200],
                   axes={"policy": ["error"], "bound": [i / 100 for i in range(500)]})
        run = subprocess.Popen([PLAY, "bench", self.model, "--sweep", self.config, "--out", self.out, "--backend", "cpu",
                                "-q"], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 60
        while not (self.out.exists() and self.out.stat().st_size > 8000) and time.monotonic() < deadline:
            time.sleep(0.01)
        run.send_signal(signal.SIGINT)
        _, stderr = run.communicate(timeout=60)
        self.assertEqual(run.returncode, 130, stderr)
        rows = self.rows()
        self.assertGreater(len(rows), 1)
        for row in rows:
            check_schema("run", row)
        self.assertIn(f"{len(rows)} of 500 runs are done", stderr)
        self.assertEqual([p.name for p in self.folder.iterdir() if "tmp" in p.name], [])

    def stability(self, *arguments, **keywords) -> subprocess.CompletedProcess:
        return self.play("stability", self.model, "--backend", "cpu", "--size", "48x32", "--progress", "none", *arguments,
                         **keywords)

    def test_stability(self) -> None:
        run = self.stability("--trajectories", "c/paths", "--eyes", "2", "--ipd", "0.1", "--reuse", "error", "--frames",
                             "0:7", "--warmup", "3", "--bound-p99", "1e9", "--format", "json")
        rows = [json.loads(line) for line in run.stdout.splitlines()]
        check_schema("run", *rows)
        self.assertTrue(all(row["stability"]["passed"] for row in rows))
        self.assertEqual([(row["config"]["trajectory"], row["config"]["frames"]) for row in rows], [("walk", 6), ("second", 7)])
        self.assertEqual(rows[0]["config"]["policy"], "error")
        self.assertEqual(set(rows[0]["stability"]), {"passed", "psnr", "temporal", "p99"})
        # the two CPU renderers agree to rounding and no further
        base = ("--trajectories", "c/paths/first.json", "c/paths/second.json", "--reference", "cpu-reference")
        self.assertIn("ok", self.stability(*base, "--bound-psnr", "60", "--bound-temporal", "0").stdout)
        run = self.stability(*base, "--bound-psnr", "400", code=8)
        self.assertEqual(run.stdout.count("EXCEEDED"), 2)
        self.assertRegex(run.stdout, r"psnr: \d+\.\d+ dB in frame \d, bound 400")
        lines = self.stability(*base, "--bound-psnr", "400", "--format", "json", code=8).stdout.splitlines()
        rows = [json.loads(line) for line in lines]
        check_schema("run", *rows)
        self.assertEqual([(row["stability"]["passed"], row["stability"]["psnr"]["passed"]) for row in rows], [(False, False)] * 2)
        self.assertNotIn("p99", rows[0]["stability"])

    def test_stability_of_foveation(self) -> None:
        base = ("--trajectories", "c/paths", "--reference", "cpu-reference", "--bound-temporal", "0", "--format", "json")
        fixed = ("--foveation", "fixed", "--fovea-pixels", "3")
        plain, thin = ([json.loads(line) for line in self.stability(*base, *more).stdout.splitlines()] for more in ((), fixed))
        check_schema("run", *thin)
        self.assertEqual((plain[0]["config"]["fovea_pixels"], thin[0]["config"]["fovea_pixels"]), (None, 3))
        self.assertEqual((len(plain), len(thin)), (2, 2))
        for before, after in zip(plain, thin):  # a CPU draws everything
            self.assertEqual(before["stability"], after["stability"])
            fovea = after["accuracy"].pop("fovea")
            self.assertEqual(before["accuracy"], after["accuracy"])
            self.assertLessEqual(min(part["psnr"]["min"] for part in fovea.values()), before["accuracy"]["psnr"]["min"])
            self.assertIsNone(fovea["inside"]["flip_mean"])
        text = self.stability(*base[:-2], "--foveation", "fixed", "--bound-psnr", "400", code=8).stdout
        self.assertEqual([text.count(words) for words in ("    within 12 degrees of the gaze: PSNR ", "EXCEEDED")], [2, 2])

    def test_stability_refusals(self) -> None:
        (self.folder / "empty").mkdir()
        for arguments, code, says in (((), 1, "gsc sample paths"), (("--trajectories", "empty"), 2, "*.json"),
                                      (("--trajectories", "none.json"), 2, "none.json"),
                                      (("--trajectories", "c/sweep"), 2, "c/sweep"),
                                      (("--trajectories", "c/paths", "--bound-psnr", "-1"), 1, "--bound-psnr"),
                                      (("--trajectories", "c/paths", "--bound-temporal", "nan"), 1, "--bound-temporal"),
                                      (("--trajectories", "c/paths/second.json", "--eyes", "2"), 1, "--ipd"),
                                      (("--trajectories", "c/paths", "--frames", "0:0"), 1, "--frames")):
            run = self.stability(*arguments, code=code)
            self.assertIn(says, run.stderr)
            self.assertEqual(run.stdout, "")
        error = json.loads(self.stability("--format", "json", code=1).stdout)
        check_schema("error", error)
        self.assertIn("--bound-p99", self.play("stability", "--help-all").stdout)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
