# SPDX-License-Identifier: Apache-2.0
"""Models, a display, and a test case that opens windows on it, for the tests of gsc-play window. The tests are run as
TEST.py SOURCE_FOLDER GSC_PLAY GSC, and exit with 77 where Xvfb, xdotool or Mesa's lavapipe is missing."""

import json
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

import window_case  # puts tests/support into the path
from cases import check_schema
from window_case import Display, Window, environment

SOURCE, PLAY, GSC = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
CPU = ("--backend", "cpu")
SIZE = (320, 240)
SEES = {"position": [-1.857, -1.073, 1.362],  # from a corner of the room
        "rotation": [[0.58331447, -0.11141780, 0.80456840], [-0.81224641, -0.08001465, 0.57780051], [0, -0.99054719, -0.13717241]]}
MODELS = {"room": (), "street": ("--model", "octree")}  # without and with levels


def cameras(path: pathlib.Path) -> list[dict]:
    """The frames of a trajectory, with their positions."""
    trajectory = json.loads(path.read_text())
    check_schema("trajectory", trajectory)
    for frame in trajectory["frames"]:
        rotation, moved = frame["rotation"], frame["translation"]
        frame["position"] = [-sum(rotation[i][j] * moved[j] for j in range(3)) for i in range(3)]
    return trajectory["frames"]


class WindowTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls._files = tempfile.TemporaryDirectory(prefix="gsc_window_")
        cls.models = pathlib.Path(cls._files.name)
        for name, more in MODELS.items():
            made = cls.models / name
            subprocess.run([GSC, "sample", name, "-o", made, "--anchors", "3k", "-q", *more], check=True,
                           stdout=subprocess.DEVNULL)
            subprocess.run([GSC, "convert", made, "-o", made.with_suffix(".gsc"), "-q"], check=True,
                           stdout=subprocess.DEVNULL)
        cls.display = Display(cls.models / "display")

    @classmethod
    def tearDownClass(cls) -> None:
        cls.display.close()
        cls._files.cleanup()

    def setUp(self) -> None:
        self.folder = self.models / self.id().rsplit(".", 1)[-1]
        self.folder.mkdir()

    def open(self, model: str, *arguments: object, display: Display | None = None, device: tuple = CPU,
             most_bytes: int | None = None, first: str = "") -> Window:
        window = Window(display or self.display, self.folder,
                        [PLAY, "window", f"../{model}.gsc", "--size", "{}x{}".format(*SIZE), *device, *arguments], most_bytes, first)
        self.addCleanup(window.kill)
        return window

    def closed(self, window: Window, code: int = 0) -> None:
        """By Ctrl+Q."""
        self.assertEqual(window.close(), code, window.said())
        self.check_log(window)

    def check_log(self, window: Window) -> None:
        lines = window.lines()
        check_schema("window-log", *lines)
        self.assertEqual([line["frame"] for line in lines], list(range(1, len(lines) + 1)))
        for before, after in zip(lines, lines[1:]):
            self.assertLessEqual(before["seconds"], after["seconds"])
            self.assertLessEqual(before["pose"], after["pose"])

    def play(self, *arguments: object, code: int = 0, on_display: bool = False) -> subprocess.CompletedProcess:
        run = subprocess.run([str(PLAY), *map(str, arguments), *CPU], cwd=self.folder, capture_output=True, text=True,
                             env=environment(self.display.name) if on_display else None, check=False)
        self.assertEqual(run.returncode, code, f"{arguments}\n{run.stdout}\n{run.stderr}")
        return run

    def headless(self, model: str, camera: pathlib.Path, *arguments: object, ending: str = ".png") -> pathlib.Path:
        out = self.folder / f"headless{ending}"
        self.play(f"../{model}.gsc", "--cameras", camera, "--out", out, "-w", "-q", *arguments)
        return out

    def check_screenshot(self, window: Window, *arguments: object) -> dict:
        """Byte by byte the picture of the camera file beside it. Returns its camera."""
        picture = window.screenshot()
        camera = picture.with_suffix(".json")
        self.assertEqual(picture.read_bytes(), self.headless("room", camera, *arguments, ending=picture.suffix).read_bytes(),
                         f"{picture.name}: not what gsc-play draws of its camera, {arguments}")
        [frame] = cameras(camera)
        # of a frame that was shown; a slow window has shown later ones by now
        shown = [line for line in window.lines() if math.dist(line["position"], frame["position"]) < 1e-9]
        self.assertIn([frame["width"], frame["height"]], [line["size"] for line in shown])
        return frame


def main() -> None:
    if why := window_case.missing():
        print(f"skipped: {why}")
        sys.exit(77)
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]])
