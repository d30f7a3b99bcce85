# SPDX-License-Identifier: Apache-2.0
"""Base of the tests of gsc-play's command line. They are called with SOURCE_FOLDER GSC_PLAY WRITE_TINY_GSC
[WRITE_BENCH_REPORT].
"""

import json
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest

sys.path.append(str(pathlib.Path(__file__).parents[1] / "support"))
from cases import check_schema, jsonschema  # noqa: E402,F401

SOURCE, PLAY, WRITE_TINY, WRITE_REPORT = (pathlib.Path(a) for a in (*sys.argv[1:5], "")[:4])


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

    def bench(self, *arguments, **keywords):
        return self.play("bench", self.model, "--cameras", self.path, "--size", "48x32", "--progress", "none",
                         "--warmup", "2", *arguments, **keywords)
