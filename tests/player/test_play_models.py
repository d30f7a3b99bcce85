#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""gsc-play and gsc export take a trained model in place of a .gsc, and leave nothing of what they convert it to.

test_play_models.py SOURCE_FOLDER GSC_PLAY GSC
"""

import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.append(str(pathlib.Path(__file__).parents[1] / "support"))
from cases import check_schema  # noqa: E402

SOURCE, PLAY, GSC = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
DRAWN = ("--backend", "cpu", "--frames", "0:2", "--size", "32x24")


class TrainedModelTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls._files = tempfile.TemporaryDirectory(prefix="gsc_trained_")
        cls.models = pathlib.Path(cls._files.name)
        subprocess.run([GSC, "sample", "street", "--model", "octree", "--anchors", "3k", "-o", cls.models / "street", "-q"],
                       check=True, stdout=subprocess.DEVNULL)
        subprocess.run([GSC, "convert", cls.models / "street", "-q"], check=True, stdout=subprocess.DEVNULL)
        cls.file = cls.models / "street.gsc"
        [cls.ply] = (cls.models / "street").rglob("point_cloud.ply")

    @classmethod
    def tearDownClass(cls) -> None:
        cls._files.cleanup()

    def setUp(self) -> None:
        self.folder = self.models / self.id().rsplit(".", 1)[-1]
        self.temporary = self.folder / "tmp"
        self.temporary.mkdir(parents=True)
        self.environment = os.environ | {"TMPDIR": str(self.temporary)}

    def run_it(self, program: pathlib.Path, *arguments: object, code: int = 0) -> subprocess.CompletedProcess:
        run = subprocess.run([str(program), *map(str, arguments)], cwd=self.folder, capture_output=True, text=True,
                             env=self.environment, check=False)
        self.assertEqual(run.returncode, code, f"{arguments}\n{run.stdout}\n{run.stderr}")
        self.assertEqual(list(self.temporary.iterdir()), [])
        return run

    def test_plays(self) -> None:
        self.run_it(PLAY, self.file, *DRAWN, "--out", "file_{frame}.png")
        for i, model in enumerate((self.models / "street", str(self.models / "street") + "/", self.ply.parent, self.ply)):
            run = self.run_it(PLAY, model, *DRAWN, "--out", f"{i}_{{frame}}.png", "--format", "json")
            report = json.loads(run.stdout)
            self.assertEqual(report["file"]["path"], str(model))
            self.assertRegex(run.stderr, r"converted in [\d.]+ s for this run; gsc convert ")
            for frame in (0, 1):
                self.assertEqual((self.folder / f"{i}_{frame}.png").read_bytes(), (self.folder / f"file_{frame}.png").read_bytes())

    def test_measures(self) -> None:
        rows = []
        for model in (self.file, self.models / "street"):
            run = self.run_it(PLAY, "bench", model, *DRAWN, "--warmup", 1, "--measure", 2, "--format", "json", "--progress", "json")
            row = json.loads(run.stdout)
            rows.append((row["file"]["bytes"], row["config"]["id"] if "id" in row["config"] else row["id"]))
            for line in run.stderr.splitlines():
                check_schema("progress-event", json.loads(line))
        self.assertEqual(rows[0], rows[1])

    def test_exports(self) -> None:
        for form in ("ply", "nvdb"):
            self.run_it(GSC, "export", self.file, "-o", f"file.{form}")
            for i, model in enumerate((self.models / "street", self.ply.parent)):
                run = self.run_it(GSC, "export", model, "-o", f"{i}.{form}", "--format", "json")
                self.assertEqual(json.loads(run.stdout)["path"], str(model))
                self.assertEqual((self.folder / f"{i}.{form}").read_bytes(), (self.folder / f"file.{form}").read_bytes())

    def test_says_whose_options_it_means(self) -> None:
        shutil.copytree(self.models / "street/point_cloud", self.folder / "a b/point_cloud")
        run = self.run_it(PLAY, "a b", *DRAWN, "--position", "0,0,0", "--look-at", "0,0,1", "--out", "{frame}.png")
        self.assertRegex(run.stderr, r"(?m)^warning: .* --scene-dir \(to gsc convert\)$")
        self.assertRegex(run.stderr, r"(?m)^warning: .* pass --fork .* \(to gsc convert\)$")
        self.assertIn("gsc convert 'a b' keeps the file", run.stderr)
        run = self.run_it(PLAY, "a b", *DRAWN, code=1)
        self.assertIn("gsc-play bench 'a b'", run.stderr)

    def test_refuses(self) -> None:
        plain = self.folder / "plain/point_cloud/iteration_7/point_cloud.ply"
        plain.parent.mkdir(parents=True)
        names = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"]
        plain.write_bytes(("ply\nformat binary_little_endian 1.0\nelement vertex 1\n" +
                           "".join(f"property float {name}\n" for name in names) + "end_header\n").encode() + bytes(4 * len(names)))
        (self.folder / "empty").mkdir()
        for model, code, says in ((plain, 5, "is a plain 3D Gaussian PLY"), (self.folder / "plain", 5, "is a plain 3D Gaussian PLY"),
                                  (self.folder / "empty", 3, "no anchors")):
            for program, words in ((PLAY, (model, *DRAWN, "--out", "{frame}.png")), (PLAY, ("bench", model, *DRAWN)),
                                   (GSC, ("export", model, "-o", "a.ply"))):
                run = self.run_it(program, *words, code=code)
                self.assertIn(says, run.stderr)
                self.assertEqual(run.stderr.count("error:"), 1, run.stderr)
                run = self.run_it(program, *words, "--format", "json", code=code)
                error = json.loads(run.stdout)
                check_schema("error", error)
                self.assertEqual(error["exit_code"], code)

    def test_refused_before_it_converts(self) -> None:
        (self.folder / "0.png").write_text("")
        run = self.run_it(PLAY, self.models / "street", *DRAWN, code=1)  # nothing would be kept
        self.assertIn("street: nothing would be kept of its cameras, expected an output; add --out", run.stderr)
        self.assertNotIn("converted", run.stderr)

    def test_without_converter(self) -> None:
        alone = self.folder / "alone/gsc-play"
        alone.parent.mkdir()
        shutil.copy(PLAY, alone)
        self.environment["PATH"] = str(alone.parent)
        run = self.run_it(alone, self.models / "street", *DRAWN, "--stats", "-", code=5)
        self.assertIn("convert it where gsc is", run.stderr)
        (alone.parent / "gsc").write_text("#!/bin/sh\necho it broke >&2\nexit 3\n")
        (alone.parent / "gsc").chmod(0o755)
        run = self.run_it(alone, self.models / "street", *DRAWN, "--stats", "-", code=5)
        self.assertIn("alone/gsc convert ended with exit code 3 (it broke)", run.stderr)

    def test_another_program_called_gsc(self) -> None:
        alone = self.folder / "alone/gsc-play"
        alone.parent.mkdir()
        shutil.copy(PLAY, alone)
        self.environment["PATH"] = str(alone.parent)
        write = "for a; do last=$out; out=$a; [ \"$last\" = -o ] && echo no model > \"$a\"; done; :\n"
        odd = ({"event": 1}, {"event": "warning", "message": 2}, {"event": "progress", "stage": [], "done": "a"}, [1], {})
        lines = "".join(f"echo '{json.dumps(line)}' >&2\n" for line in odd)
        error = json.dumps({"schema": "gsc.error/1", "exit_code": "a", "found": 1})
        for script, says in ((":\n", "exit code 0 and has written no .gsc"), (write, "exit code 0 and has written no .gsc"),
                             (lines, "exit code 0 and has written no .gsc ({})"),
                             (f"echo '{error}'\nexit 4\n", "exit code 4 (it said nothing)"),
                             (f"echo '{{\"schema\": 1}}'\nexit 4\n", "exit code 4 (it said nothing)")):
            (alone.parent / "gsc").write_text("#!/bin/sh\n" + script)
            (alone.parent / "gsc").chmod(0o755)
            run = self.run_it(alone, self.models / "street", *DRAWN, "--stats", "-", code=5)
            self.assertIn(f"{alone.parent}/gsc convert ended with {says}", run.stderr)
            self.assertNotIn("for this run", run.stderr)

    def test_interrupted(self) -> None:
        """While it converts, and while it draws."""
        alone = self.folder / "alone/gsc-play"
        alone.parent.mkdir()
        shutil.copy(PLAY, alone)
        (alone.parent / "gsc").write_text("#!/bin/sh\nfor a; do last=$out; out=$a; [ \"$last\" = -o ] && : > \"$a\"; done\nexec sleep 60\n")
        (alone.parent / "gsc").chmod(0o755)
        self.environment["PATH"] += ":/usr/bin:/bin"
        drawn = (self.models / "street", "--backend", "cpu", "--size", "1920x1080", "--stats", "s.jsonl")
        for command in ((alone, *drawn), (PLAY, *drawn), (GSC, "export", self.models / "street", "-o", "s.ply", "-j", "1")):
            run = subprocess.Popen([str(word) for word in command], cwd=self.folder, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.PIPE, text=True, env=self.environment)
            end = time.monotonic() + 60
            while not list(self.temporary.rglob("*.gsc")) and time.monotonic() < end:
                time.sleep(0.01)
            run.send_signal(signal.SIGINT)
            said = run.communicate(timeout=60)[1]
            self.assertEqual(run.returncode, 130, said)
            self.assertEqual(list(self.temporary.iterdir()), [], said)
            self.assertEqual(sorted(p.name for p in self.folder.iterdir()), ["alone", "tmp"])


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]])
