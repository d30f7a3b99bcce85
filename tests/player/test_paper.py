#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""samples/paper.sh on two small samples and the CPU: every table has a line for each configuration, and a second run
measures nothing again.

test_paper.py SOURCE_FOLDER GSC GSC_PLAY
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

SOURCE, GSC, PLAY = (pathlib.Path(a) for a in sys.argv[1:4])
sys.path.insert(0, str(SOURCE / "tests/cli"))
import fixtures  # noqa: E402


class PaperTest(unittest.TestCase):
    def test_tables(self) -> None:
        with tempfile.TemporaryDirectory(prefix="gsc_paper_") as name:
            folder = pathlib.Path(name)
            for scene, more in (("city", ()), ("street", ("--model", "octree"))):
                subprocess.run([GSC, "sample", scene, "--anchors", "5k", "-o", folder / scene, "-q", *more], check=True)
                # a viewer large enough to tell pictures of so few anchors and pixels apart
                (folder / scene / "metre.json").write_text('{"schema": "gsc.metre/1", "units": 8}')
                subprocess.run([GSC, "convert", folder / scene, "-o", folder / f"{scene}.gsc", "-q"], check=True)
            environment = {**os.environ, "PATH": f"{GSC.parent}:{PLAY.parent}:{os.environ['PATH']}", "BACKEND": "cpu",
                           "SIZE": "48x48", "FRAMES": "6", "SSIM": "3"}
            command = [SOURCE / "samples/paper.sh", "city.gsc", "street.gsc", "out"]
            texts = []
            for _ in range(2):
                run = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
                self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
                texts.append(run.stdout)
            self.assertEqual(texts[0], texts[1])
            text = texts[0]
            self.assertIn("city: scaffold-gs", text)
            self.assertIn("street: octree-gs", text)
            self.assertNotIn("not here", text)
            for title in ("one GPU: city", "one GPU: street", "several GPUs: city", "quality: city", "quality: street"):
                self.assertIn(f"\n{title}\n", text)
            for configuration in ("none", "depth", r"merged \+ depth"):  # two tables of two scenes each
                self.assertEqual(len(re.findall(rf"^  {configuration} +[\d.e-]+ ", text, re.M)), 4, configuration)
            self.assertRegex(text, r"paper, GS-Cache +55.81 +- +11.34 +5.42 +8.10")
            self.assertRegex(text, r"paper, GS-Cache +113.97 ")
            figure = text[text.index("zoom-out: city"):]
            self.assertEqual(len(re.findall(r"^  [\d.]+( +[\d.]+){4}$", figure, re.M)), 6)
            self.assertIn("elastic: merged + depth on 2 devices", figure)
            self.assertIn("LPIPS is empty: set LPIPS_BACKBONE", text)
            # with weights, made up: one number of each run and scene
            fixtures.compared_pictures(None, folder)
            weights = {"LPIPS_BACKBONE": str(folder / "vgg16.pth"), "LPIPS_HEADS": str(folder / "heads.pth")}
            run = subprocess.run(command, cwd=folder, env=environment | weights, capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
            self.assertNotIn("LPIPS is empty", run.stdout)
            quality = run.stdout[run.stdout.index("quality: city"):run.stdout.index("paper, its four scenes")]
            rows = re.findall(r"^  (none|depth|merged \+ depth) .* ([\d.]+)$", quality, re.M)
            self.assertEqual(len(rows), 6, quality)
            self.assertTrue(all(float(value) == 0 for name, value in rows if name == "none"), rows)
            self.assertTrue(any(float(value) > 0 for name, value in rows if name == "merged + depth"), rows)
            self.assertFalse(list((folder / "out").glob("*.pictures")))
            half = subprocess.run(command, cwd=folder, env=environment | {"LPIPS_HEADS": "x"}, capture_output=True, check=False)
            self.assertEqual(half.returncode, 1)
            self.assertTrue((folder / "out/paper.html").stat().st_size > 100000)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
