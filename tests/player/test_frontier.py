#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""samples/frontier.sh on a small sample and the CPU: a row for each way to draw and each baked file, all in one chart, and
a second run measures nothing again.

test_frontier.py SOURCE_FOLDER GSC GSC_PLAY
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

SOURCE, GSC, PLAY = (pathlib.Path(a) for a in sys.argv[1:4])
sys.path.insert(0, str(SOURCE / "tests/cli"))
from run_cli_case import validate_schema  # noqa: E402

SCRIPT = SOURCE / "samples/frontier.sh"
ENVIRONMENT = {**os.environ, "PATH": f"{GSC.parent}:{PLAY.parent}:{os.environ['PATH']}", "BACKEND": "cpu",
               "SIZE": "48x32", "FRAMES": "9", "WARMUP": "2", "EVERY": "2", "FLIP": "2"}


class FrontierTest(unittest.TestCase):
    def run_script(self, folder: pathlib.Path, *words: str, **environment: str) -> str:
        run = subprocess.run([SCRIPT, *words], cwd=folder, env=ENVIRONMENT | environment, capture_output=True, text=True,
                             check=False)
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        return run.stdout

    def check_baked(self, folder: pathlib.Path, row: dict, city: dict) -> None:
        """Its accuracy is of pictures that this draws and scores by itself."""
        self.assertEqual(row["reference_file"], city["file"])
        self.assertEqual(row["accuracy"]["scored"], {"first": 0, "every": 4})
        self.assertEqual(len(row["per_frame"]["psnr"]), 3)
        self.assertEqual(len(row["per_frame"]["wall_ms"]), 9)
        for name, tier in (("city", "exact"), ("baked", "fast")):
            subprocess.run([PLAY, f"{name}.gsc", "--cameras", "out/flight.json", "--frames", "4:5", "--backend", "cpu",
                            "--eyes", "2", "--size", "48x32", "--tier", tier, "--out", name + "/{eye}.pfm", "-q"],
                           cwd=folder, check=True, capture_output=True)
        told = subprocess.run([GSC, "compare-pictures", "city", "baked", "--format", "json"], cwd=folder, check=True,
                              capture_output=True, text=True)
        views = json.loads(told.stdout)["scores"]["views"]
        self.assertAlmostEqual(row["per_frame"]["psnr"][1], min(view["psnr"] for view in views))
        self.assertEqual(row["accuracy"]["psnr"]["min"], min(row["per_frame"]["psnr"]))
        self.assertGreater(row["accuracy"]["flip"]["mean"], 0)
        self.assertEqual(row["accuracy"]["flip"]["frames"], 3)

    def test_rows_and_chart(self) -> None:
        with tempfile.TemporaryDirectory(prefix="gsc_frontier_") as name:
            folder = pathlib.Path(name)
            for words in ("sample city --anchors 5k -o city", "convert city -o city.gsc",
                          "bake city.gsc -o baked.gsc --target-psnr 40 --most-pixels 10000 --backend cpu"):
                subprocess.run([GSC, *words.split()], cwd=folder, check=True, capture_output=True)
            (folder / "same.gsc").write_bytes((folder / "city.gsc").read_bytes())
            self.run_script(folder, "city.gsc", "baked.gsc", "same.gsc", OUT="out")
            text = (folder / "out/rows.jsonl").read_text()
            rows = [json.loads(line) for line in text.splitlines()]
            for row in rows:
                validate_schema(SOURCE, "run", row)
                self.assertEqual(row["config"]["trajectory"], "flight")
            self.assertEqual([(row["file"]["path"], row["config"]["tier"], row["config"]["detail"]) for row in rows],
                             [("city.gsc", "exact", 0), ("city.gsc", "fast", 1), ("city.gsc", "fast", 2), ("city.gsc", "fast", 4),
                              ("baked.gsc", "exact", 0), ("same.gsc", "exact", 0)])
            self.assertEqual([row["accuracy"]["flip"]["frames"] for row in rows], [3] * 6)
            self.check_baked(folder, rows[4], rows[0])
            self.assertEqual((rows[5]["accuracy"]["max_error"], rows[5]["accuracy"]["psnr"]["pooled"]), (0, None))
            page = (folder / "out/frontier.html").read_text()
            self.assertIn("of baked.gsc", page)
            self.assertIn("detail 2", page)

            self.run_script(folder, "city.gsc", "baked.gsc", "same.gsc", OUT="out")
            self.assertEqual((folder / "out/rows.jsonl").read_text(), text)
            said = self.run_script(folder, "--draw", "out/rows.jsonl", OUT="drawn")
            self.assertEqual((folder / "drawn/frontier.html").read_text(), page)
            picture = folder / "drawn/figures/flight-accuracy.svg"
            if "for its pictures, elsewhere" not in said:
                self.assertIn(">FLIP, mean<", picture.read_text())
            for words in ((), ("--draw",)):
                self.assertEqual(subprocess.run([SCRIPT, *words], cwd=folder, capture_output=True, check=False).returncode, 1)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
