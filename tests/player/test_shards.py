#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Picture sets, sweeps and stability split over processes: every shard is killed once at a random point and started
again, and what gsc merge-runs makes of them is what one run in one piece writes.

test_shards.py SOURCE_FOLDER GSC_PLAY WRITE_TINY_GSC GSC [parallel]

With "parallel", 1,000 tasks under GNU parallel, which starts what was killed again.
"""

import json
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import time
import unittest

from play_case import PLAY, PlayTest, check_schema

GSC = pathlib.Path(sys.argv[4])
LONG = sys.argv[5:] == ["parallel"]
SEED = int(os.environ.get("GSC_SEED", random.randrange(1 << 30)))
TIMES = ("ms", "repeats", "repeat_ms", "bytes_resident", "peak_bytes", "wall_ms", "device", "cache_bytes")
TIME = re.compile(rf'"(?:{"|".join(TIMES)})": ?')


def timeless(text: str) -> str:
    """The bytes of JSON, but for the values that a clock or the memory of a process says."""
    parts, at = [], 0
    while match := TIME.search(text, at):
        _, end = json.JSONDecoder().raw_decode(text, match.end())
        parts += [text[at:match.end()], "TIME"]
        at = end
    return "".join(parts) + text[at:]


class ShardTest(PlayTest):
    def setUp(self) -> None:
        super().setUp()
        self.random = random.Random(SEED)

    def path_of(self, frames: int, name: str = "path.json") -> pathlib.Path:
        path = self.folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(json.dumps({
            "schema": "gsc.trajectory/1",
            "frames": [{"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "fov_x": 1.2,
                        "position": [-2 - 0.001 * i, -2, -16 - 0.01 * i]} for i in range(frames)]}))
        return path

    def merge(self, *arguments, code: int = 0) -> subprocess.CompletedProcess:
        run = subprocess.run([str(a) for a in (GSC, "merge-runs", *arguments)], capture_output=True, text=True,
                             cwd=self.folder, check=False)
        self.assertEqual(run.returncode, code, f"{arguments}\n{run.stdout}\n{run.stderr}")
        return run

    def killed_once(self, rows: pathlib.Path, tasks: int, *arguments) -> bool:
        """Killed when some of its rows are there, fewer than `tasks`, or a little after its start; then started again.
        False: it was faster."""
        command = [str(a) for a in (PLAY, *arguments, "--backend", "cpu", "-q")]
        after = self.random.randrange(tasks)
        run = subprocess.Popen(command, cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + 60
        while run.poll() is None and time.monotonic() < deadline:
            if rows.exists() and rows.read_bytes().count(b"\n") >= after:
                time.sleep(self.random.random() * 0.002)
                break
        run.send_signal(signal.SIGKILL)
        run.wait()
        left = rows.read_bytes().count(b"\n") if rows.exists() else 0
        self.play(*arguments)
        return run.returncode == -signal.SIGKILL and left < rows.read_bytes().count(b"\n")

    def same_but_times(self, one: str, other: str) -> None:
        self.assertEqual(*(timeless((self.folder / name).read_text()) for name in (one, other)))

    def pictures(self, folder: str) -> dict:
        return {path.name: path.read_bytes() for path in (self.folder / folder).iterdir()}

    def test_pictures(self) -> None:
        self.path = self.path_of(40)
        base = (self.model, "--cameras", self.path, "--size", "96x64", "--eyes", "2", "--ipd", "0.1")
        self.play(*base, "--out", "one/{frame:03}_{eye}.png", "--stats", "one.jsonl")
        rows = [self.folder / f"s{i}.jsonl" for i in range(1, 5)]
        killed = [self.killed_once(row, 10, *base, "--out", "split/{frame:03}_{eye}.png", "--stats", row, "--shard",
                                   f"{i}/4") for i, row in enumerate(rows, 1)]
        self.assertTrue(any(killed))
        self.assertEqual(self.pictures("split"), self.pictures("one"))
        for line in rows[1].read_text().splitlines():
            check_schema("frame-stats", json.loads(line))
            self.assertEqual(json.loads(line)["frame"] % 4, 1)
        report = json.loads(self.merge(*reversed(rows), "-o", "merged.jsonl", "--format", "json").stdout)
        check_schema("merge-report", report)
        self.assertEqual((report["rows"], report["shards"], report["tasks"]), (40, 4, 40))
        self.same_but_times("merged.jsonl", "one.jsonl")
        # nothing is left to do, and what is there is kept
        before = {path: path.stat().st_mtime_ns for path in (self.folder / "split").iterdir()}
        run = self.play(*base, "--out", "split/{frame:03}_{eye}.png", "--stats", rows[2], "--shard", "3/4", "--format",
                        "json")
        report = json.loads(run.stdout)
        check_schema("play-report", report)
        self.assertEqual(report["shard"], {"index": 3, "count": 4, "tasks": 40, "own": 10, "done_before": 10})
        self.assertEqual({path: path.stat().st_mtime_ns for path in (self.folder / "split").iterdir()}, before)
        # a picture that went is drawn again, its line is not written twice
        (self.folder / "split/002_right.png").unlink()
        self.assertIn("1 frame,", self.play(*base, "--out", "split/{frame:03}_{eye}.png", "--stats", rows[2], "--shard",
                                            "3/4").stdout)
        self.assertEqual(self.pictures("split"), self.pictures("one"))
        self.assertEqual(len(rows[2].read_text().splitlines()), 10)

    def test_more_shards_than_frames(self) -> None:
        self.path = self.path_of(3)
        base = (self.model, "--cameras", self.path, "--size", "16x16", "--out", "o/{frame}.pfm")
        rows = [self.folder / f"s{i}.jsonl" for i in range(5)]
        for i, row in enumerate(rows):
            environment = {"SLURM_ARRAY_TASK_ID": str(7 + i), "SLURM_ARRAY_TASK_COUNT": "5", "SLURM_ARRAY_TASK_MIN": "7"}
            run = subprocess.run([PLAY, *base, "--stats", row, "--shard", "auto", "--backend", "cpu"], cwd=self.folder,
                                 env={**os.environ, **environment}, capture_output=True, text=True, check=True)
            self.assertIn(f"shard {i + 1}/5: {int(i < 3)} of 3 frames", run.stdout)
        self.merge(*rows, "-o", "all.jsonl")
        self.assertEqual([json.loads(line)["frame"] for line in (self.folder / "all.jsonl").read_text().splitlines()], [0, 1, 2])

    def test_new_folders(self) -> None:
        base = (self.model, "--cameras", self.path, "--size", "16x16", "--shard", "1/2")
        self.play(*base, "--stats", "s/s.jsonl", "--out", "o/{frame}.pfm")
        self.assertEqual(len((self.folder / "s/s.jsonl").read_text().splitlines()), 2)
        self.assertEqual(len(list((self.folder / "o").iterdir())), 2)
        for stats in ("t.jsonl", "t/t.jsonl"):
            self.refused(*base, "--stats", stats, "--out", "/proc/gsc/{frame}.pfm", code=2, says="/proc/gsc: cannot be created")
        self.refused(*base, "--stats", "s/s.jsonl", "--out", "p/{frame}.pfm", "--fov", "50", code=1, says="has rows of other options")

    def test_refusals(self) -> None:
        base = (self.model, "--cameras", self.path, "--size", "16x16")
        split = (*base, "--shard", "1/2", "--stats", "s.jsonl")
        for option, value in (("--reuse", "depth"), ("--reuse", "error"), ("--lod-hysteresis", "0.1"),
                              ("--target-ms", "5")):
            self.refused(*split, option, value, code=1, says="depends on those before it")
        self.refused(*base, "--shard", "1/2", code=1, says="pass --stats FILE.jsonl")
        self.refused(*base, "--shard", "1/2", "--stats", "-", code=1, says="pass --stats FILE.jsonl")
        for word in ("0/4", "5/4", "1/0", "1", "a/b", "1/4/2", "-1/4", "1/", "/4", "auto/", "auto/x", "1/1000001"):
            self.refused(*base, "--stats", "s.jsonl", f"--shard={word}", code=1, says="no part of a whole")
        self.refused(*base, "--stats", "s.jsonl", "--shard", "auto", code=1, says="none of SLURM_ARRAY_TASK_ID")
        self.refused("bench", *base, "--shard", "1/2", code=1, says="--sweep")
        self.refused("stability", self.model, "--trajectories", self.path, "--shard", "1/2", code=1, says="--out")
        self.refused("stability", self.model, "--trajectories", self.path, "--out", "x", code=1, says="--shard")
        self.play(*split, "--out", "{frame}.pfm")
        self.refused(*base, "--shard", "2/2", "--stats", "s.jsonl", code=1, says="has rows of shard 1/2")
        self.refused(*split, "--fov", "50", code=1, says="has rows of other options")
        self.refused(*base, "--shard", "1/2", "--stats", "t.jsonl", "--out", "{frame}.pfm", code=2, says="0.pfm: already")
        (self.folder / "t.jsonl").write_text("precious\n")
        self.refused(*base, "--shard", "1/2", "--stats", "t.jsonl", code=3, says="choose another --stats")
        subprocess.run([PLAY.parent / PLAY.name, *split, "--out", "{frame}.pfm", "--backend", "cpu"], cwd=self.folder,
                       capture_output=True, check=True)
        # merging
        self.play(*base, "--stats", "plain.jsonl")
        self.play(*base, "--shard", "2/2", "--stats", "s2.jsonl", "--out", "{frame}.pfm")
        self.play(*base, "--shard", "2/2", "--stats", "other.jsonl", "--fov", "50", "--out", "fov{frame}.pfm")
        self.play(self.tiny("b.gsc", "0", "4"), *base[1:], "--shard", "2/2", "--stats", "model.jsonl")
        whole = (self.folder / "s2.jsonl").read_text()
        (self.folder / "cut.jsonl").write_text(whole[:-40])
        (self.folder / "empty.jsonl").write_text("")
        (self.folder / "words.txt").write_text("no row\n")
        for files, says in ((("s.jsonl",), r"2 of 4 tasks have no row: 1, 3 (no row of shard 2), expected all"),
                            (("s.jsonl", "s.jsonl"), "task 0 was in s.jsonl:1 already"),
                            (("s.jsonl", "other.jsonl"), "other.jsonl:1: is of another configuration"),
                            (("s.jsonl", "model.jsonl"), "model.jsonl:1: is of another model"),
                            (("plain.jsonl",), "plain.jsonl:1: has no shard"),
                            (("s.jsonl", "cut.jsonl"), "cut.jsonl:2: is half-written"),
                            (("path.json",), "path.json:1: schema is gsc.trajectory/1"),
                            (("words.txt",), "words.txt:1: is no JSON object"),
                            (("empty.jsonl",), "no row of a shard in any file")):
            code = 5 if "schema is" in says else 3
            self.assertIn(says, self.merge(*files, "-o", "m.jsonl", code=code).stderr)
            self.assertFalse((self.folder / "m.jsonl").exists())
        run = self.merge("s.jsonl", "-o", "m.jsonl", "--allow-missing", "--format", "json")
        self.assertEqual(json.loads(run.stdout)["missing"], [1, 3])
        self.assertIn("2 of 4 tasks have no row", run.stderr)
        self.merge("s.jsonl", "s2.jsonl", "-o", "m.jsonl", code=2)
        self.merge("s.jsonl", "s2.jsonl", "-o", "m.jsonl", "-w")
        self.same_but_times("m.jsonl", "plain.jsonl")

    def test_sweep(self) -> None:
        self.path_of(6, "c/a.json"), self.path_of(9, "c/b.json")
        (self.folder / "c/sweep.json").write_text(json.dumps({
            "schema": "gsc.sweep/1", "trajectories": ["a.json", "b.json", "a.json"], "size": [48, 32], "warmup": 2,
            "axes": {"policy": ["none", "depth", "error"], "bound": [i / 10 for i in range(1, 9)],
                     "max_depth": [3, 5], "decode_budget": [None, "match"]}}))
        base = ("bench", self.model, "--sweep", "c/sweep.json")
        self.play(*base, "--out", "one.jsonl", "-q")
        tasks = len((self.folder / "one.jsonl").read_text().splitlines())
        self.assertGreater(tasks, 40)
        rows = [self.folder / f"s{i}.jsonl" for i in range(1, 5)]
        counts, killed = [], []
        for i, row in enumerate(rows, 1):
            killed.append(self.killed_once(row, tasks // 8, *base, "--out", row, "--shard", f"{i}/4"))
            counts.append(len(row.read_text().splitlines()))
            for line in row.read_text().splitlines():
                check_schema("run", json.loads(line))
        self.assertTrue(any(killed))
        self.assertEqual(sum(counts), tasks)
        self.assertLessEqual(max(counts), tasks / 4 * 1.7, counts)
        self.merge(*rows, "-o", "merged.jsonl")
        self.same_but_times("merged.jsonl", "one.jsonl")
        # merged rows are those of a sweep that was not split: it finds them
        run = self.play(*base, "--out", "merged.jsonl", "--progress", "none")
        self.assertIn(f"in the file already: {tasks} of {tasks} runs", run.stderr)
        run = self.play(*base, "--out", "merged.jsonl", "--shard", "1/4", code=1)
        self.assertIn("of a sweep that was not split", run.stderr)
        run = self.play(*base, "--out", rows[0], "--shard", "1/4", "--label", "x", code=1)
        self.assertIn("has rows of other options", run.stderr)

    def test_matched_budget(self) -> None:
        """A budget of "match" that comes out as one that the sweep states is one run, whichever shards do the two."""
        self.path_of(12, "c/a.json")

        def sweep(*budgets) -> tuple:
            (self.folder / "c/sweep.json").write_text(json.dumps({
                "schema": "gsc.sweep/1", "trajectories": ["a.json"], "size": [48, 32],
                "axes": {"policy": ["depth", "error"], "bound": [0.5], "max_depth": [3], "decode_budget": budgets}}))
            return "bench", self.model, "--sweep", "c/sweep.json"

        self.play(*sweep("match"), "--out", "first.jsonl")
        found = [json.loads(line)["config"]["decode_budget"] for line in (self.folder / "first.jsonl").read_text().splitlines()]
        base = sweep("match", max(filter(None, found)))
        self.play(*base, "--out", "one.jsonl")
        self.assertEqual(len((self.folder / "one.jsonl").read_text().splitlines()), 3)  # depth without a budget, both with
        for count in (1, 2):
            rows = [f"{count}_{i}.jsonl" for i in range(1, count + 1)]
            for _ in range(2):  # the second finds all done
                for i, row in enumerate(rows, 1):
                    self.play(*base, "--out", row, "--shard", f"{i}/{count}")
            self.assertEqual(sum(len((self.folder / row).read_text().splitlines()) for row in rows), 5)
            self.merge(*rows, "-o", f"merged{count}.jsonl")
            self.same_but_times(f"merged{count}.jsonl", "one.jsonl")

    def test_another_device(self) -> None:
        """A shard that goes on on another machine keeps what it has done."""
        self.path_of(6, "c/a.json")
        (self.folder / "c/sweep.json").write_text(json.dumps({
            "schema": "gsc.sweep/1", "trajectories": ["a.json"], "size": [48, 32], "axes": {"policy": ["none", "depth"]}}))
        command = ("bench", self.model, "--sweep", "c/sweep.json", "--out", "s.jsonl", "--shard", "1/1")
        self.play(*command)
        rows = (self.folder / "s.jsonl").read_text()
        moved = re.sub(r'("device":\{"name":")[^"]*"', r'\1another"', rows)
        self.assertNotEqual(moved, rows)
        (self.folder / "s.jsonl").write_text(moved)
        self.play(*command)
        self.assertEqual((self.folder / "s.jsonl").read_text(), moved)
        self.merge("s.jsonl", "-o", "merged.jsonl")

    def test_stability(self) -> None:
        for i in range(12):
            self.path_of(20 + i, f"paths/p{i:02}.json")
        base = ("stability", self.model, "--trajectories", "paths", "--size", "48x32", "--reuse", "error")
        whole = self.play(*base, "--format", "json").stdout
        rows = [self.folder / f"s{i}.jsonl" for i in range(1, 4)]
        killed = []
        for i, row in enumerate(rows, 1):
            killed.append(self.killed_once(row, 2, *base, "--out", row, "--shard", f"{i}/3"))
            for line in row.read_text().splitlines():
                check_schema("run", json.loads(line))
            again = self.play(*base, "--out", row, "--shard", f"{i}/3").stdout
            own = len(row.read_text().splitlines())
            self.assertIn(f"shard {i}/3: {own} of 12 trajectories, {own} of them done before\n", again)
        self.assertTrue(any(killed))
        self.merge(*rows, "-o", "merged.jsonl")
        self.assertEqual(timeless((self.folder / "merged.jsonl").read_text()), timeless(whole))

    def test_stability_that_fails(self) -> None:
        self.path_of(5, "paths/a.json"), self.path_of(6, "paths/b.json")
        base = ("stability", self.model, "--trajectories", "paths", "--size", "48x32", "--bound-p99", "1e-6")
        self.play(*base, code=8)
        for i in (1, 2):  # what all of them come to is known where they are merged
            self.play(*base, "--out", f"s{i}.jsonl", "--shard", f"{i}/2")
        run = self.merge("s1.jsonl", "s2.jsonl", "-o", "merged.jsonl", "--format", "json", code=8)
        self.assertIn("2 of 2 trajectories exceed a bound", run.stderr)
        report = json.loads(run.stdout)
        check_schema("merge-report", report)
        self.assertEqual(report["warnings"], ["2 of 2 trajectories exceed a bound"])
        # without its verdict a row would pass, and be none to go on from
        rows = [json.loads(line) for line in (self.folder / "s1.jsonl").read_text().splitlines()]
        bare = "".join(json.dumps({key: value for key, value in row.items() if key != "stability"}, separators=(",", ":")) + "\n"
                       for row in rows)
        (self.folder / "bare.jsonl").write_text(bare)
        self.assertIn("is of another form than", self.merge("s2.jsonl", "bare.jsonl", "-o", "m.jsonl", code=3).stderr)
        self.assertIn("bare.jsonl:1: has no stability", self.play(*base, "--out", "bare.jsonl", "--shard", "1/2", code=3).stderr)
        self.assertEqual((self.folder / "bare.jsonl").read_text(), bare)
        # nor do rows of other commands join those of a shard
        bench = ("bench", self.model, "--cameras", "paths/a.json", "--size", "16x16", "--measure", "1", "--warmup", "0", "--out")
        self.refused(*bench, "s1.jsonl", code=1, says="s1.jsonl:1: is a row of a shard, expected rows of gsc-play bench")
        run = self.play(*base, "--out", "s1.jsonl", "--shard", "1/2", "--format", "json")
        printed = [json.loads(line) for line in run.stdout.splitlines()]
        self.assertEqual(printed, [json.loads(line) for line in (self.folder / "s1.jsonl").read_text().splitlines()])
        merged = [json.loads(line) for line in (self.folder / "merged.jsonl").read_text().splitlines()]
        check_schema("run", *merged)
        self.assertEqual([row["stability"]["passed"] for row in merged], [False, False])

    def hostile(self, line: str, kind: str) -> list:
        """Variants of a good row: (line, words of gsc merge-runs, whether a shard that goes on there refuses it too)."""
        row = json.loads(line)
        shard, form = row["shard"], row["schema"]
        start, rest = line[:line.index(",") + 1], line[line.index(",") + 1:]  # a row is known by its start
        text = lambda fields: json.dumps(fields, separators=(",", ":"))
        changed = lambda **fields: text(row | fields)
        without = lambda key: text({name: value for name, value in row.items() if name != key})
        rows = [(f'{start}"x":{"[" * 300000}{"]" * 300000},{rest}', "nests deeper than 16 levels", True),
                (start + '"x":' + '{"a":' * 300000 + "1" + "}" * 300000 + "," + rest, "nests deeper than", True),
                (start + "".join(f'"k{i}":1,' for i in range(60000)) + rest, "more than 100 keys", True),
                (changed(shard=5), "shard is 5, expected an object", True),
                (changed(shard=[]), "shard is [], expected an object", True),
                (changed(shard=shard | {"task": -1}), "shard.task is -1, expected", True),
                (changed(shard=shard | {"tasks": 1 << 63}), f"shard.tasks is {1 << 63}, expected at most", False),
                (changed(shard=shard | {"count": 1 << 63}), f"shard.count is {1 << 63}, expected at most", False),
                (changed(shard={key: shard[key] for key in ("index", "count", "task", "tasks", "set")}),
                 "has no shard.model, expected a whole line of ", True)]
        if kind == "frames":
            return rows + [(changed(backend=5), "backend is 5, expected", False),
                           (without("backend"), "has no backend, expected a whole line of gsc.frame-stats/1", False)]
        rows += [(changed(device=[]), "device is [], expected an object", True),
                 (without("device"), "has no device", True), (changed(device={"name": 5}), "device.name is 5", True)]
        if kind == "runs":
            return rows + [(changed(config=5), "config is 5, expected", True),
                           (without("per_frame"), "has no per_frame", True)]
        stability = row["stability"]
        return rows + [(changed(stability=5), "stability is 5, expected an object", True),
                       (changed(stability=stability | {"passed": "yes"}), 'stability.passed is "yes", expected true or false', True),
                       (changed(stability=stability | {"passed": False}), "stability.passed is false, expected what the", True),
                       (changed(stability=stability | {"psnr": 5}), "stability.psnr is 5, expected", True),
                       (changed(warnings={}), "warnings is {}, expected", True)]

    def test_hostile_rows(self) -> None:
        (self.folder / "sweep.json").write_text(json.dumps({
            "schema": "gsc.sweep/1", "trajectories": ["path.json"], "size": [16, 16], "warmup": 1,
            "axes": {"policy": ["none", "error"]}}))
        bad = self.folder / "bad.jsonl"
        for kind, option, *base in (("frames", "--stats", self.model, "--cameras", self.path, "--size", "16x16"),
                                    ("runs", "--out", "bench", self.model, "--sweep", "sweep.json"),
                                    ("stability", "--out", "stability", self.model, "--trajectories", self.path,
                                     "--size", "16x16")):
            split = (*base, "--shard", "1/1", option)
            self.play(*split, f"{kind}.jsonl")
            good = (self.folder / f"{kind}.jsonl").read_text().splitlines()[0]
            for line, says, is_refused in self.hostile(good, kind):
                with self.subTest(kind=kind, says=says):
                    began = time.monotonic()
                    bad.write_text(line + "\n")
                    self.assertIn(f"bad.jsonl:1: {says}" if "keys" not in says else says,
                                  self.merge(bad, "-o", "m.jsonl", "--allow-missing", code=3).stderr)
                    self.assertFalse((self.folder / "m.jsonl").exists())
                    for end in ("\n", "") if "deeper" in says or "keys" in says else ("\n",) if is_refused else ():
                        bad.write_text(line + end)
                        run = self.play(*split, bad, code=3)
                        self.assertTrue(says in run.stderr or "line 1 is no row of" in run.stderr, run.stderr)
                        self.assertEqual(bad.read_text(), line + end)
                    self.assertLess(time.monotonic() - began, 10)
            # what nests too deep is not cut off as half-written
            bad.write_text(good[:good.index(",") + 1] + '"x":' + "[" * 300000)
            self.play(*split, bad, code=3)
            self.assertIn("nests deeper than", self.merge(bad, "-o", "m.jsonl", code=3).stderr)
        # the key that a line starts with, twice
        bad.write_text('{"schema":"gsc.run/2","schema":"x"}\n')
        self.refused("bench", self.model, "--cameras", self.path, "--size", "16x16", "--out", bad, code=3, says="expected")


class ParallelTest(ShardTest):
    """1,000 pictures in 4 shards under GNU parallel, each killed once; what is killed is started again by it."""

    def test_parallel(self) -> None:
        if shutil.which("parallel") is None:
            self.skipTest("no GNU parallel")
        self.path = self.path_of(1000)
        base = f"{PLAY} {self.model} --cameras {self.path} --size 96x64 --backend cpu -q"
        subprocess.run(f"{base} --out 'one/{{frame:04}}.png' --stats one.jsonl", shell=True, check=True, cwd=self.folder)
        script = self.folder / "shard.sh"
        script.write_text(f"""#!/bin/sh
# the first start of each shard kills itself when $2 lines are there
if mkdir started.$1 2>/dev/null; then
    {base} --out 'split/{{frame:04}}.png' --stats s$1.jsonl --shard $1/4 &
    pid=$!
    until [ "$(cat s$1.jsonl 2>/dev/null | wc -l)" -ge $2 ]; do :; done
    kill -9 $pid
    wc -l <s$1.jsonl >killed.$1
    exit 137
else
    exec {base} --out 'split/{{frame:04}}.png' --stats s$1.jsonl --shard $1/4
fi
""")
        jobs = "".join(f"{i} {self.random.randrange(1, 200)}\n" for i in range(1, 5))
        subprocess.run(["parallel", "--jobs", "4", "--retries", "3", "--colsep", " ", "sh", str(script), "{1}", "{2}"],
                       input=jobs, text=True, check=True, cwd=self.folder)
        killed = [int((self.folder / f"killed.{i}").read_text()) for i in range(1, 5)]
        self.assertTrue(all(0 < rows < 250 for rows in killed), killed)
        self.assertEqual(self.pictures("split"), self.pictures("one"))
        self.merge(*(f"s{i}.jsonl" for i in range(1, 5)), "-o", "merged.jsonl")
        self.same_but_times("merged.jsonl", "one.jsonl")


def load_tests(loader, _tests, _pattern):
    if LONG:
        return unittest.TestSuite([ParallelTest("test_parallel")])
    return loader.loadTestsFromTestCase(ShardTest)


if __name__ == "__main__":
    print(f"GSC_SEED={SEED}", file=sys.stderr)
    unittest.main(argv=sys.argv[:1])
