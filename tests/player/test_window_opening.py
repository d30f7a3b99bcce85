#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""gsc-play window as it opens and what it then shows: whole pictures of cameras, speed that fits the scene, full screen,
models that are dropped, sizes, and gsc-play FILE without a command (window_test.py).
"""

import json
import math
import os
import pathlib
import re
import shutil
import signal
import subprocess
import time

import window_case  # puts tests/support into the path
from cases import check_schema
from window_case import Window, environment, read_png
from window_test import CPU, PLAY, SEES, SIZE, WindowTest, cameras, main


def correlation(a: list, b: list) -> float:
    a, b = ([value for row in rows for value in row] for rows in (a, b))
    mean_a, mean_b = sum(a) / len(a), sum(b) / len(b)
    both = sum((x - mean_a) * (y - mean_b) for x, y in zip(a, b))
    return both / math.sqrt(sum((x - mean_a) ** 2 for x in a) * sum((y - mean_b) ** 2 for y in b))


class OpeningTest(WindowTest):
    # --- whole pictures

    def camera_file(self, width: int, height: int) -> pathlib.Path:
        """One camera in the middle of the room, whose pixels are as wide as those of the window that its picture fits in."""
        path = self.folder / f"camera_{width}x{height}.json"
        path.write_text(json.dumps({"schema": "gsc.trajectory/1", "frames": [
            {"name": "own", **SEES, "fov_y": 2 * math.atan(height / 300), "width": width, "height": height}]}))
        return path

    def test_whole_picture(self) -> None:
        """All of a portrait and of a wide camera's picture is in a window, and in a picture of another aspect."""
        for width, height in ((128, SIZE[1]), (SIZE[0], 112)):
            camera = self.camera_file(width, height)
            left, top = (SIZE[0] - width) // 2, (SIZE[1] - height) // 2
            own = read_png(self.headless("room", camera))
            self.assertEqual((own.width, own.height), (width, height))
            self.assertGreater(len({bytes(row) for row in own.rows}), height // 2)  # it shows something
            sized = read_png(self.headless("room", camera, "--size", "{}x{}".format(*SIZE)))
            window = self.open("room", "--cameras", camera)
            shown = read_png(window.screenshot())
            self.closed(window)
            for wide in (sized, shown):
                self.assertEqual((wide.width, wide.height), SIZE)
                part = wide.part(left, top, left + width, top + height)
                off = [abs(a - b) for rows in zip(part.rows, own.rows) for a, b in zip(*rows)]
                self.assertLessEqual(max(off), 2, (width, height))
                self.assertLess(sum(off) / len(off), 0.01, (width, height))

    def test_whole_picture_reduced(self) -> None:
        """Nor is anything cut of a picture twice as large as the place that it fits in."""
        for width, height in ((256, 2 * SIZE[1]), (2 * SIZE[0], 224)):
            camera = self.camera_file(width, height)
            own = read_png(self.headless("room", camera))
            half = [[sum(own.rows[2 * y + dy][6 * x + 3 * dx + c] for dy in (0, 1) for dx in (0, 1)) / 4
                     for x in range(width // 2) for c in range(3)] for y in range(height // 2)]
            left, top = (SIZE[0] - width // 2) // 2, (SIZE[1] - height // 2) // 2
            window = self.open("room", "--cameras", camera)
            for wide in (read_png(self.headless("room", camera, "--size", "{}x{}".format(*SIZE))), read_png(window.screenshot())):
                part = wide.part(left, top, left + width // 2, top + height // 2)
                self.assertGreater(correlation(part.rows, half), 0.98, (width, height))
                cut = wide.part(left // 2, top // 2, SIZE[0] - left // 2, SIZE[1] - top // 2)  # as if it were larger
                again = [[row[3 * (x * (width // 2) // cut.width) + c] for x in range(cut.width) for c in range(3)]
                         for row in (half[y * (height // 2) // cut.height] for y in range(cut.height))]
                self.assertLess(correlation(cut.rows, again), 0.9, (width, height))
            self.closed(window)

    # --- speed, screen, other models

    def test_speed_follows_what_is_ahead(self) -> None:
        """Half of the distance to it in a second, wherever the viewer stands."""
        near, far = dict(SEES), dict(SEES)
        near["position"] = [a + row[2] for a, row in zip(SEES["position"], SEES["rotation"])]
        path = self.folder / "two.json"
        path.write_text(json.dumps({"schema": "gsc.trajectory/1", "frames": [
            {"name": name, **view, "fov_y": 1, "width": 64, "height": 48} for name, view in (("near", near), ("far", far))]}))
        window = self.open("room", "--cameras", path)
        rests = lambda: window_case.until(lambda: window.rests() or None, "rest") and window.settle()["speed"]  # noqa: E731
        speeds = [rests()]
        window.key("Next")
        speeds.append(rests())
        self.assertGreater(speeds[0], 0.2)
        self.assertAlmostEqual(speeds[1] - speeds[0], 0.5, delta=0.05)
        start = len(window.lines())
        window.display.xdo("keydown", "w")  # in flight too
        window.line(lambda line: line["speed"] < 0.8 * speeds[1], start)
        window.display.xdo("keyup", "w")
        window.key("equal")  # a notch faster, and still so behind another jump
        window.key("Prior")
        self.assertAlmostEqual(rests(), 1.25 * speeds[0], delta=0.05)
        self.closed(window)

    def test_full_screen(self) -> None:
        window = self.open("room")
        for size in ([1280, 900], list(SIZE)):
            start = len(window.lines())
            window.display.xdo("key", "F11")
            window.line(lambda line: line["size"] == size and line["pose"] == line["asked"], start)
            window.settle()
        self.closed(window)

    def test_dropped_model(self) -> None:
        window = self.open("room", "--format", "json")
        window.key("w")
        wrong = self.folder / "notes.txt"
        wrong.write_text("not a model\n")
        before = window.settle()
        window.display.drop(window.id, wrong)
        said = window.line(lambda line: "notes.txt" in (line["said"] or ""), before["frame"] - 1)
        self.assertIn("expected", said["said"])
        self.assertNotEqual(window.hold("w", poses=3)["position"], before["position"])  # goes on
        for model in (self.models / "street.gsc", self.models / "room"):  # the second is a trained model
            start = len(window.lines())
            window.display.drop(window.id, model)
            window.line(lambda line: line["pose"] == 0, start)
            window.line(lambda line: 0 < line["pose"] == line["asked"], start)
            self.assertIn(f"{model.name} - gsc", window.display.xdo("getwindowname", window.id))
            window.hold("w", poses=3)
        self.assertEqual(window.close(), 0, window.said())
        report, lines = json.loads(window.out.read_text()), window.lines()
        check_schema("window-report", report)
        check_schema("window-log", *lines)
        self.assertEqual(report["file"], str(self.models / "room"))
        self.assertEqual((report["frames"], len(lines)), (lines[-1]["frame"], lines[-1]["frame"]))

    def test_dropped_model_that_cannot_be_shown(self) -> None:
        """The settings of the window may not go with it."""
        window = self.open("street", "--target-ms", "200", "--tier", "exact")
        before = window.settle()
        window.display.drop(window.id, self.models / "room.gsc")
        said = window.line(lambda line: "--target-ms 200: has no effect" in (line["said"] or ""), before["frame"] - 1)
        self.assertIn("room.gsc, which has one level", said["said"])
        self.assertNotEqual(window.hold("w", poses=3)["position"], before["position"])  # goes on
        self.closed(window)

    def test_interrupted_while_it_converts(self) -> None:
        """Ends as at any other time."""
        alone, slow = self.folder / "alone", self.folder / "alone/gsc"
        alone.mkdir()
        for file in (PLAY, PLAY.parent.parent / "lib/gsc/gsc_present.so"):
            shutil.copy(file, alone)
        slow.write_text("#!/bin/sh\n: > started\nexec sleep 60\n")
        slow.chmod(0o755)
        window = Window(self.display, self.folder, [alone / "gsc-play", "window", "../room.gsc", *CPU])
        self.addCleanup(window.kill)
        window.display.drop(window.id, self.models / "room")
        window_case.until(lambda: (self.folder / "started").exists() or None, "a start of gsc")
        self.assertEqual(window.signal(), 0, window.said())
        self.assertIn(" shown, ", window.out.read_text())

    def test_sizes(self) -> None:
        """Cameras without a size have the window's; a side that is not given follows from the other."""
        (self.folder / "path.json").write_text(json.dumps({"schema": "gsc.trajectory/1", "frames": [SEES | {"fov_x": 1.0}]}))
        for size, wanted in (("1", [1, 1]), ("400", [400, 225]), ("180p", [320, 180]), ("90x300", [90, 300])):
            window = Window(self.display, self.folder, [PLAY, "window", "../room.gsc", "--size", size, "--cameras", "path.json", *CPU])
            self.addCleanup(window.kill)
            self.assertEqual(window.settle()["size"], wanted)
            if size != "1":
                [frame] = cameras(window.screenshot().with_suffix(".json"))
                across = wanted[0] / wanted[1] * math.tan(frame["fov_y"] / 2)
                self.assertAlmostEqual(2 * math.atan(across), 1.0, places=6, msg=size)
            self.closed(window)

    def test_folder_is_made(self) -> None:
        window = self.open("room", "--folder", "new/pictures")
        self.assertTrue((self.folder / "new/pictures").is_dir())
        self.assertEqual(window.screenshot().parent.resolve(), (self.folder / "new/pictures").resolve())
        self.closed(window)
        (self.folder / "file").write_text("")
        self.play("window", "../room.gsc", "--folder", "file", code=2, on_display=True)

    # --- gsc-play FILE

    def typed(self, *arguments: object, display: str) -> tuple[subprocess.Popen, int]:
        """Started from a terminal; its number is returned."""
        ours, theirs = os.openpty()
        run = subprocess.Popen([PLAY, *map(str, arguments), *CPU], cwd=self.folder, stdin=theirs, stdout=theirs, stderr=theirs,
                               env=environment(display))
        os.close(theirs)
        self.addCleanup(lambda: (run.poll() is None and run.kill(), run.wait(), os.close(ours)))
        return run, ours

    def heard(self, terminal: int) -> str:
        text = b""
        try:
            while piece := os.read(terminal, 4096):
                text += piece
        except OSError:  # so ends a terminal
            pass
        return text.decode()

    def test_window_by_default(self) -> None:
        for model in ("../room.gsc", "../street"):  # the second is a trained model
            run, terminal = self.typed(model, "--size", "{}x{}".format(*SIZE), display=self.display.name)
            name = f"^{re.escape(model)} - gsc$"
            window_case.until(lambda: self.display.xdo("search", "--onlyvisible", "--name", name, check=False).split() or None,
                              "the window", run)
            run.send_signal(signal.SIGINT)
            self.assertEqual(run.wait(window_case.SECONDS), 0)
            said = self.heard(terminal)
            self.assertIn("opens a window; --out", said)
            self.assertRegex(said, r"\d+ poses?: ")
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_no_window_by_default(self) -> None:
        """Without a display it says what to add; with an output it draws."""
        for arguments, code, says in ((("../room.gsc",), 1, "room.gsc: nothing would be kept"), (("../room",), 1, "room: nothing would be kept"),
                                      (("../room.gsc", "--frames", "0:1", "--size", "16x16", "--stats", "s.jsonl"), 0, "1 frame")):
            for display in ("", self.display.name)[:1 + (code == 0)]:
                run, terminal = self.typed(*arguments, *(("-w",) if display else ()), display=display)
                said = self.heard(terminal)
                self.assertEqual(run.wait(window_case.SECONDS), code, said)
                self.assertIn(says, said)


if __name__ == "__main__":
    main()
