#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""gsc-play bench as a user meets it: reports, rows, tables, refusals.

test_bench_cli.py SOURCE_FOLDER GSC_PLAY WRITE_TINY_GSC WRITE_BENCH_REPORT
"""

import json
import os
import re
import subprocess
import sys
import unittest

from play_case import PLAY, TRAJECTORY, WRITE_REPORT, PlayTest, check_schema, pfm


class BenchCliTest(PlayTest):
    def test_bench_out_falls_on_nothing(self) -> None:
        """Inputs, and files that hold something else than rows, keep every byte."""
        keep = {path: path.read_bytes() for path in (self.model, self.path)}
        (self.folder / "link").symlink_to("model.gsc")
        os.link(self.path, self.folder / "hard.json")
        base = ("bench", self.model, "--cameras", self.path, "--size", "16x16", "--measure", "1", "--warmup", "0", "--out")
        for name, says in (("model.gsc", "overwrite the model"), ("./link", "overwrite the model"),
                           ("path.json", "overwrite the camera file"), ("hard.json", "overwrite the camera file")):
            self.refused(*base, name, code=1, says=says)
        other = self.tiny("other.gsc")
        keep[other] = other.read_bytes()
        self.refused(*base, other, code=3, says="line 1 is no row of a measurement")
        for text in ("precious", "{", "{}", "precious\n", "\n", "[1]\n", '{"schema":"gsc.frame-stats/1","x":1}\n', '{"schema":"gsc.run/2"}\n',
                     '{"schema":"gsc.run/2","x":1}\n', '{"schema":"gsc.run/2"\n', '{"schema":"gsc.run/2","x":1\nprecious'):
            (self.folder / "notes").write_text(text)
            self.refused(*base, "notes", code=3, says="expected")
            self.assertEqual((self.folder / "notes").read_text(), text)
        self.refused("bench", "none.gsc", "--out", "notes", code=3, says="is no row of a measurement")  # before any work
        for kind, maker in (("bench", "gsc-play bench MODEL.gsc --out"), ("run", "--sweep"), ("stability", "gsc-play stability")):
            text = f'{{"schema":"gsc.{kind}/1","x":1}}\n'  # of an earlier version
            (self.folder / "notes").write_text(text)
            said = self.play(*base, "notes", code=5).stderr
            self.assertIn(f"notes:1: schema is gsc.{kind}/1, of an earlier version, expected gsc.run/2; make new rows with ", said)
            self.assertIn(maker, said)
            self.assertEqual((self.folder / "notes").read_text(), text)
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
        for tail in ('{"', '{"schema":"gsc.ru', first[:100], first[:-2]):
            rows.write_text(first + tail)
            run = self.bench("--measure", "1", "--out", "b.jsonl")
            self.assertIn("line 2 is half-written", run.stderr)
            lines = rows.read_text().splitlines()
            self.assertEqual((lines[0] + "\n", len(lines)), (first, 2))
            check_schema("run", json.loads(lines[1]))
        for before in ("", first):  # the last row lacks its end alone
            rows.write_text(before + first[:-1])
            run = self.bench("--measure", "1", "--out", "b.jsonl")
            self.assertNotIn("half-written", run.stderr)
            self.assertTrue(rows.read_text().startswith(before + first))
            check_schema("run", json.loads(rows.read_text()[len(before + first):]))
        rows.write_text(first + rows.read_text().splitlines(keepends=True)[-1])
        runs = [subprocess.Popen([PLAY, "bench", self.model, "--size", "8x8", "--measure", "5", "--warmup", "0", "--backend",
                                  "cpu", "--out", rows, "-q"], stdout=subprocess.DEVNULL) for _ in range(4)]
        self.assertEqual([run.wait(timeout=60) for run in runs], [0] * 4)
        self.assertEqual(len([json.loads(line) for line in rows.read_text().splitlines()]), 6)

    def test_bench_report(self) -> None:
        for frames in (1, 9):
            run = self.bench("--eyes", "2", "--ipd", "0.1", "--measure", frames, "--quality", "3", "--label", "a b",
                             "--out", "b.jsonl", "--format", "json", "--fov", "60")
            report = json.loads(run.stdout)
            check_schema("run", report)
            self.assertEqual(report["config"]["frames"], frames)
        lines = [json.loads(line) for line in (self.folder / "b.jsonl").read_text().splitlines()]
        self.assertEqual([line["config"]["frames"] for line in lines], [1, 9])
        self.assertEqual(lines[1], report)
        self.assertEqual(report["label"], "a b")
        self.assertNotIn("roofline", report["work"])  # a CPU's ceilings are not measured
        version = self.play("--version").stdout.splitlines()[0]
        commit = report["tool"]["commit"]
        self.assertEqual(version, f"gsc-play {report['tool']['version']}" + (f", commit {commit}" if commit else ""))
        self.assertEqual(report["config"]["shots"], 4)
        self.assertEqual(report["config"]["size"], [48, 32])
        self.assertAlmostEqual(report["config"]["fov_degrees"], 60)
        self.assertEqual(report["work"]["pixels_per_frame"], 2 * 48 * 32)
        self.assertEqual(report["accuracy"]["scored"], {"listed": [0, 1, 2]})
        self.assertEqual(len(report["per_frame"]["psnr"]), 3)
        self.assertEqual(report["reference"], "cpu")
        self.assertGreater(report["work"]["per_eye"]["gaussians_visible"]["max"], 0)
        for spread in (report["ms"]["wall"], report["ms"]["device"], report["work"]["ns_per_gaussian"]):
            self.assertGreater(spread["median"], 0)
            self.assertLessEqual(spread["median"], spread["p95"])
            self.assertLessEqual(spread["p95"], spread["p99"])
            self.assertLessEqual(spread["p99"], spread["max"])
        self.assertLessEqual(report["ms"]["device"]["mean"], report["ms"]["wall"]["mean"])
        stages = sum(stage["mean"] for stage in report["ms"]["stages"].values())
        self.assertLessEqual(stages, report["ms"]["device"]["mean"] * 1.05 + 0.5)

    def test_until_steady(self) -> None:
        """Whole rounds of the four cameras until the median is sure, at most --measure frames."""
        run = self.bench("--until-steady", "90", "--out", "b.jsonl", "--format", "json", "--frames-in-flight", "2")
        report = json.loads(run.stdout)
        check_schema("run", report)
        frames = report["config"]["frames"]
        self.assertGreaterEqual(frames, 32)
        self.assertLess(frames, 10000)
        self.assertEqual((len(report["per_frame"]["wall_ms"]), report["warnings"]), (frames, []))
        median, sure = report["ms"]["wall"]["median"], report["work"]["wall_median"]
        self.assertLessEqual(sure["low"], median)
        self.assertLessEqual(median, sure["high"])
        again = json.loads(self.bench("--until-steady", "90", "--format", "json", "--frames-in-flight", "2").stdout)
        self.assertEqual(again["config"]["id"], report["config"]["id"])  # however many frames each took
        run = self.bench("--until-steady", "0.01", "--measure", "33")
        known = re.search(r"--until-steady 0.01: the median is known to (\S+) % after 33 frames", run.stderr)
        self.assertIn("33 frames after", run.stdout)
        within = re.search(r"median wall time of a frame: [\d.]+ to [\d.]+, within (\S+) %, 95 % sure", run.stdout)
        self.assertEqual(known[1], within[1])  # of all 33, though 32 are whole rounds
        self.assertIn("--until-steady 1: 3 frames do not tell", self.bench("--until-steady", "1", "--measure", "3").stderr)
        self.assertNotIn("95 % sure", self.bench("--measure", "5").stdout)
        frames = [TRAJECTORY["frames"][i % 4] for i in range(48)]  # no whole round is measured
        self.path.write_text(json.dumps(TRAJECTORY | {"frames": frames}))
        run = self.bench("--until-steady", "100", "--measure", "40")
        self.assertNotIn("do not tell", run.stderr)
        within = float(re.search(r"within (\S+) %, 95 % sure", run.stdout)[1])
        self.assertEqual("--until-steady" in run.stderr, within > 100, run.stderr)

    def test_progress_counts_the_scores_too(self) -> None:
        for options, steps in ((("--quality", "2"), 2), (("--quality", "2", "--reuse", "error"), 4 + 2)):
            run = self.play("bench", self.model, "--cameras", self.path, "--size", "48x32", "--backend", "cpu", "--warmup", "1",
                            "--measure", "3", "--progress", "json", *options)
            events = [json.loads(line) for line in run.stderr.splitlines()]
            check_schema("progress-event", *events)
            self.assertEqual([e["event"] for e in events if e["event"] != "progress"], ["start", "done"])
            self.assertEqual((events[-1]["done"], events[-1]["total"]), (4 + steps, 4 + steps), events)

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
        check_schema("run", report)
        self.assertEqual({key: report["config"][key] for key in said}, said)
        self.assertEqual(report["config"]["lod_bias"], -1)
        self.assertIn("reuse error: ", self.small("-v", *options).stdout)
        self.assertIn("cache_evictions", self.bench("--measure", "3", *options).stdout)
        self.assertNotIn("cache_evictions", self.bench("--measure", "3").stdout)
        self.refused(self.model, "--reuse-bound", "1", code=1, says="expected --reuse error")

    def test_levels(self) -> None:
        model = self.tiny("levels.gsc", "0", "3", "3")
        base = (model, "--cameras", self.path, "--size", "48x32", "--progress", "none")
        plain = self.play(*base, "--out", "plain/{frame}.pfm", "--stats", "plain.jsonl").stdout
        self.assertNotIn("target", plain)
        run = self.play(*base, "--out", "soft/{frame}.pfm", "--lod-fade", "1", "--lod-hysteresis", "0.2", "--format", "json")
        report = json.loads(run.stdout)
        check_schema("play-report", report)
        self.assertEqual([report[key] for key in ("lod_bias", "lod_fade", "lod_hysteresis", "detail", "fovea_pixels", "target_ms",
                                                  "lod_bias_used", "detail_used")], [0, 1, 0.2, 0, None, None, None, None])
        images = [[path.read_bytes() for path in sorted((self.folder / name).iterdir())] for name in ("plain", "soft")]
        self.assertNotEqual(images[0], images[1])

        # no frame takes so little: the bias falls from frame to frame once three are known
        target = ("--target-ms", "0.0001", "--lod-bias", "0.5", "--tier", "exact")  # which has no detail to give up
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
        self.assertEqual(report["detail_used"], {"mean": 0, "min": 0, "max": 0})
        self.assertIn("target 0.0001 ms: LOD bias", self.play(*base, "-v", *target).stdout)

        bench = ("bench", *base, "--warmup", "2", "--measure", "6", *target)
        report = json.loads(self.play(*bench, "--format", "json").stdout)
        check_schema("run", report)
        self.assertLess(report["work"]["target"]["lod_bias_used"]["min"], report["work"]["target"]["lod_bias_used"]["max"])
        self.assertIn("target 0.0001 ms: LOD bias", self.play(*bench).stdout)
        report = json.loads(self.play(*bench[:-1], "fast", "--format", "json").stdout)  # detail first
        check_schema("run", report)
        self.assertGreaterEqual(report["work"]["target"]["detail_used"]["max"], 1)
        self.refused("bench", model, "--sweep", "x.json", "--target-ms", "5", code=1, says="--target-ms")
        self.refused(*base, "--lod-fade", "2", code=1, says="--lod-fade")
        self.refused(*base, "-v", "--lod-hysteresis", "0.1", "--backend", "cpu-reference", code=5, says="hysteresis")

    def test_detail_is_reported(self) -> None:
        groups = ["groups_near", "groups_kept", "groups_stale", "groups_made"]
        for options, detail in (((), 0), (("--detail", "1.5"), 1.5), (("--tier", "turbo"), 2)):
            report = json.loads(self.small(*options, "--stats", "s.jsonl", "-w", "--format", "json").stdout)
            check_schema("play-report", report)
            self.assertEqual((report["tier"], report["detail"]), ("exact", detail))  # a CPU draws exact
            for line in (self.folder / "s.jsonl").read_text().splitlines():
                check_schema("frame-stats", json.loads(line))
                self.assertEqual(json.loads(line)["detail"], detail)
                if detail == 0:
                    self.assertEqual([json.loads(line)[name] for name in groups], [0] * 4)
            self.assertEqual(f"detail {detail}: groups per frame" in self.small("-v", *options).stdout, detail > 0)
            report = json.loads(self.bench("--measure", "3", *options, "--format", "json").stdout)
            check_schema("run", report)
            self.assertEqual((report["config"]["detail"], list(report["work"]["coarse"])), (detail, groups))
            self.assertEqual("groups_stale" in self.bench("--measure", "3", *options).stdout, detail > 0)
        run = self.play("bench", self.model, "--size", "48x32", "--measure", "3", "--detail", "2", "--quality", "3", "--format", "json")
        self.assertIn("in no order", run.stderr)  # the stored cameras, though they are gone round in turn
        report = json.loads(run.stdout)
        self.assertEqual((report["config"]["detail"], sum(report["work"]["coarse"][name]["max"] for name in groups)), (0, 0))
        self.assertEqual(report["accuracy"]["scored"], {"listed": [0, 1, 2]})  # nothing depends on those before
        live = ("live", self.model, "--size", "48x32", "--rate", "1000", "--detail", "2")
        self.assertIn("in no order", self.play(*live).stderr)
        self.assertNotIn("order", self.play(*live, "--cameras", self.path).stderr)
        one = ("--frames", "1:2")  # a view at rest
        self.assertNotIn("warning", self.play(*live, "--cameras", self.path, *one).stderr)
        run = self.bench("--measure", "4", "--detail", "2", *one, "--format", "json")
        self.assertEqual((run.stderr, json.loads(run.stdout)["config"]["detail"]), ("", 2))
        self.refused(self.model, "--tier", "exact", "--detail", "2", code=1, says="expected --tier fast or turbo")
        self.refused("bench", self.model, "--detail", "2", "--reuse", "depth", code=1, says="--detail: together with --reuse depth")

    def quality(self, *options: str) -> dict:
        report = json.loads(self.bench("--measure", "1", *options, "--format", "json").stdout)
        check_schema("run", report)
        return report["accuracy"]

    def test_quality_is_against_exact_without_a_bias(self) -> None:
        self.model = self.tiny("levels.gsc", "0", "3", "3")
        plain = self.quality("--quality", "4")
        self.assertIsNone(plain["psnr"]["pooled"])  # a CPU draws exact
        biased = self.quality("--quality", "4", "--lod-bias", "-1")
        self.assertIsNotNone(biased["psnr"]["pooled"])
        self.assertGreater(biased["max_error"], 0)

    def test_quality_of_frames_that_depend_on_those_before(self) -> None:
        """They are played in order: what a sweep says of the same frames."""
        self.model = self.tiny("levels.gsc", "0", "3", "3")
        for options, run in (
            (("--reuse", "depth", "--reuse-depth", "2"), {"policy": "depth", "max_depth": 2}),
            (("--lod-hysteresis", "0.2"), {"lod_hysteresis": 0.2}),
            (("--detail", "4", "--lod-bias", "-1"), {"detail": 4, "lod_bias": -1}),
        ):
            sweep = self.folder / "sweep.json"
            out = self.folder / "rows.jsonl"
            out.unlink(missing_ok=True)
            sweep.write_text(json.dumps({"schema": "gsc.sweep/1", "trajectories": [self.path.name], "size": [48, 32], "eyes": 1,
                                         "score_every": 2, "score_first": 1, "runs": [run]}))
            self.play("bench", self.model, "--sweep", sweep, "--out", out, "--backend", "cpu", "-q")
            row = json.loads(out.read_text())
            check_schema("run", row)
            self.assertEqual(row["accuracy"]["scored"], {"first": 1, "every": 2})
            self.assertEqual(len(row["per_frame"]["psnr"]), len(row["per_frame"]["wall_ms"]) // 2)
            self.assertIsNone(row["accuracy"]["temporal"])
            quality = self.quality("--score-every", "2", "--score-first", "1", *options)
            self.assertEqual(quality, row["accuracy"])
            self.assertIsNotNone(quality["psnr"]["pooled"])
        self.assertEqual(self.quality("--quality", "2", "--target-ms", "0.0001")["scored"], {"listed": [1, 3]})
        self.refused("bench", self.model, "--quality", "1", "--score-every", "2", code=1, says="together with")
        self.refused("bench", self.model, "--score-first", "4", "--cameras", self.path, "--size", "8x8", code=1,
                     says="--score-first 4")

    def test_bench_foveation(self) -> None:
        base = ("--eyes", "2", "--ipd", "0.1", "--measure", "2", "--quality", "3", "--reference", "cpu-reference")
        plain = json.loads(self.bench(*base, "--format", "json").stdout)
        self.assertNotIn("fovea", plain["accuracy"])
        thin = ("--foveation", "fixed", "--fovea-pixels", "1.5")
        report = json.loads(self.bench(*base, *thin, "--format", "json").stdout)
        check_schema("run", report)
        self.assertEqual(report["config"]["fovea_pixels"], 1.5)
        fovea = report["accuracy"].pop("fovea")
        self.assertGreater(report["accuracy"].pop("flip")["mean"], 0)
        self.assertIsNone(plain["accuracy"].pop("flip"))
        self.assertEqual(report["accuracy"], plain["accuracy"])  # a CPU draws everything
        for part in fovea.values():
            self.assertLessEqual(part["psnr"]["min"], part["psnr"]["pooled"])
            self.assertLess(part["psnr"]["min_frame"], 3)
            self.assertGreaterEqual(part["flip_mean"], 0)
        self.assertRegex(self.bench(*base, *thin).stdout,
                         r"\nwithin 12 degrees of the gaze: PSNR .* dB pooled, .* dB worst, FLIP .*; around it: PSNR ")
        self.assertNotIn("12 degrees", self.bench(*base).stdout)
        self.assertNotIn("accuracy", json.loads(self.bench("--measure", "2", *thin, "--format", "json").stdout))

    def test_bench_defaults(self) -> None:
        report = json.loads(self.play("bench", self.model, "--size", "8x8", "-q", "--format", "json").stdout)
        check_schema("run", report)
        self.assertGreaterEqual(report["config"]["frames"], 300)
        self.assertGreater(report["config"]["warmup"], 0)

    def test_bench_floors(self) -> None:
        report = json.loads(subprocess.run([WRITE_REPORT], capture_output=True, text=True, check=True).stdout)
        check_schema("run", report)
        stages = {stage["name"]: stage for stage in report["work"]["roofline"]["stages"]}
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
        self.assertRegex(text, r"blend +52\.00 +1\.400 +0\.0000 +0\.0467 +3\.000 +1\.6  lanes\n")
        self.assertNotRegex(text.split("ceilings of the device")[1], r"(?m)^  sort")

    def test_bench_repeats(self) -> None:
        report = json.loads(subprocess.run([WRITE_REPORT], capture_output=True, text=True, check=True).stdout)
        check_schema("run", report)
        work = report["work"]
        self.assertEqual(report["repeats"], 3)
        self.assertEqual((work["frames_repeated"], work["repeat_ms"], work["most_repeat_ms"]), (2, 7.5, 5))
        self.assertEqual(work["frames_that_grew"], 1)
        text = subprocess.run([WRITE_REPORT, "text"], capture_output=True, text=True, check=True).stdout
        self.assertIn("drawn again because a buffer was too small: 2 measured frames, 3 repeats; they took 7.500 of the "
                      "device's milliseconds above, 5.000 at most in a frame\n", text)
        self.assertIn("; 1 measured frame enlarged a buffer, more --warmup avoids that\n", text)

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


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
