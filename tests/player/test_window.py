#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""gsc-play window as a person uses it, on an X server of the test's own: keys, mouse, screenshots, comparisons, paths,
sizes, and displays and workers that go away (window_test.py).
"""

import json
import math
import re
import signal
import subprocess
import time

import window_case  # puts tests/support into the path
from cases import check_schema
from window_case import Display, Picture, Window, environment, read_pfm, read_png
from window_test import CPU, PLAY, SIZE, SOURCE, WindowTest, cameras, main

MOST_FRAMES = 2  # from a key to its picture
FEWER = "-5.5"  # levels of the street, so that its pictures have about half of the anchors
SAYS = {"1": "^fly$", "2": "^orbit$", "3": "^walk$", "PageDown": "^camera ", "PageUp": "^camera ", "Home": "^camera ",
        "T": "^exact, ", "U": "reuse depth", "G": "^detail 1: together with reuse depth", "V": "colours: level", "O": "^exact, ", ",": "level bias -0.25", ".": "colours: level",
        "R": "^records", "F12": "^wrote .*gsc-0001"}  # at the first press, in the order of the help


def psnr(a: Picture, b: Picture) -> float:
    squares = sum((x - y) ** 2 for left, right in zip(a.rows, b.rows) for x, y in zip(left, right))
    return -10 * math.log10(squares / (3 * a.width * a.height))


class UseTest(WindowTest):
    # --- a person at the window

    def test_keys_and_mouse(self) -> None:
        window = self.open("room")
        position = lambda: window.lines()[-1]["position"]  # noqa: E731
        camera = lambda: cameras(window.screenshot().with_suffix(".json"))[0]  # noqa: E731
        axis = lambda frame, i: [row[i] for row in frame["rotation"]]  # noqa: E731
        along = lambda way, of: sum(a * b for a, b in zip(way, of))  # noqa: E731
        # right, down and forward of the view; up and down are the world's, which the view leans against
        for key, i, sign in (("w", 2, 1), ("s", 2, -1), ("a", 0, -1), ("d", 0, 1), ("q", 1, 1), ("e", 1, -1)):
            before, view = position(), camera()
            way = [b - a for a, b in zip(before, window.hold(key, poses=4)["position"])]
            self.assertGreater(sign * along(way, axis(view, i)), 1e-4, key)
            self.assertGreater(abs(along(way, axis(view, i))), 0.5 * math.hypot(*way), key)
        for key, i, sign in (("Left", 0, -1), ("Right", 0, 1), ("Up", 1, -1), ("Down", 1, 1)):
            before, at = camera(), position()
            window.hold(key, poses=4)
            self.assertEqual(position(), at, key)
            self.assertGreater(sign * along(axis(camera(), 2), axis(before, i)), 1e-3, key)
        before = camera()
        window.drag(1, (100, 100), (130, 110), (160, 120))
        after = camera()
        self.assertLess(math.dist(before["position"], after["position"]), 1e-9)
        # what is under the cursor follows it: to the right, so the view turns left, by the angle of those pixels
        forward = lambda frame: [row[2] for row in frame["rotation"]]  # noqa: E731
        right = [row[0] for row in before["rotation"]]
        turn = sum(a * b for a, b in zip(forward(after), right))
        self.assertLess(turn, -math.sin(0.5 * 60 * before["fov_y"] / SIZE[1]))
        self.assertGreater(turn, -math.sin(2 * 60 * before["fov_y"] / SIZE[1]))
        window.key("2")  # orbit: the wheel goes nearer, the right button moves the picture, the left turns about a point
        for what in (lambda: window.display.xdo("click", 4), lambda: window.drag(3, (200, 100), (220, 120)),
                     lambda: window.drag(1, (200, 100), (220, 105))):
            before = window.settle()["position"]
            what()
            self.assertGreater(math.dist(window.settle()["position"], before), 1e-4)
        self.closed(window)

    def test_every_key(self) -> None:
        window = self.open("street")
        written = (SOURCE / "player/window/controls.cpp").read_text()
        rows = re.findall(r"\{(?:kKey\w+|'.'), Action::\w+, \"([^\"]+)\"", written)
        self.assertGreater(len(rows), 20)
        names = {"PageDown": "Next", "PageUp": "Prior", "Space": "space", ",": "comma", ".": "period", "[": "bracketleft",
                 "]": "bracketright"}
        held = ["w", "a", "s", "d", "q", "e", "Left", "Right", "Up", "Down", "shift", "alt", "minus", "equal"]
        for name in rows:
            if name == "Ctrl+Q":
                continue
            start = len(window.lines())
            window.display.xdo("key", names.get(name, name.lower() if len(name) == 1 else name))
            line = window.line(lambda line: name in line["keys"], start)
            if name in SAYS:
                said = window.line(lambda line: line["said"], line["frame"] - 1)["said"]
                self.assertRegex(said, SAYS[name], name)
            if name == "F2":  # the keyboard is the panel's until this
                window.key("Escape")
            if name in ("Space", "F11"):  # stops the flight through the cameras; a small window again
                window.display.xdo("key", name.replace("Space", "space"))
            window.settle()
        for name in held:
            window.key(name)
        for button in (1, 2, 3, 4, 5):
            window.display.xdo("click", button)
        window.key("F2", "Down", "Down", "space", "Up", "Escape", "F1", "Tab", "Escape", "Home", "1")
        before = window.settle()["position"]
        self.assertNotEqual(window.hold("w", poses=4)["position"], before)  # the keyboard is the flight's again
        for view in ("age", "cost", "detail", None):  # level was before
            start = len(window.lines())
            window.display.xdo("key", "v")
            said = window.line(lambda line: line["said"], start)["said"]
            self.assertEqual(said.partition("colours: ")[2], view or "")
            window.settle()
        self.closed(window)

    def says(self, window: Window, key: str) -> str:
        start = len(window.lines())
        window.display.xdo("key", key)
        pressed = window.line(lambda line: line["keys"], start)
        said = window.line(lambda line: line["said"], pressed["frame"] - 1)["said"]
        window.settle()
        return said

    def test_detail(self) -> None:
        window = self.open("room")
        for pixels in (1, 2, 4):
            before = window.settle()["asked"]
            self.assertIn(f"detail {pixels}", self.says(window, "g"))
            after = window.settle()
            self.assertEqual(after["detail"], pixels)
            self.assertIn(after["asked"] - before, range(2, 10))  # until nothing is to be made anew
            window_case.until(lambda: window.rests() or None, "rest with detail")
            self.assertEqual(window.settle()["asked"], after["asked"])
        self.assertIn("detail 4: together with reuse depth", self.says(window, "u"))
        self.assertEqual(window.settle()["detail"], 4)  # as it was
        self.assertNotIn("detail", self.says(window, "g"))
        self.assertIn("reuse depth", self.says(window, "u"))
        self.assertIn("detail 1: together with reuse depth", self.says(window, "g"))
        self.assertEqual(window.settle()["detail"], 0)
        self.says(window, "u")
        self.says(window, "u")
        self.says(window, "t")
        self.assertIn("in the tier exact", self.says(window, "g"))
        self.closed(window)

    def test_target(self) -> None:
        window = self.open("street", "--target-ms", "0.001", "--tier", "exact")  # which has no detail to give up
        drawn = lambda: [line for line in window.lines() if line["pose"] > 0]  # noqa: E731
        self.assertEqual(drawn()[0]["lod_bias"], 0)
        window.hold("w", poses=8)
        window.line(lambda line: line["lod_bias"] is not None and line["lod_bias"] < -1)
        biases = [line["lod_bias"] for line in drawn()]
        self.assertEqual(biases, sorted(biases, reverse=True))
        self.closed(window)
        self.assertIn("--target-ms 5: has no effect on", self.play("window", "../room.gsc", "--target-ms", "5", "--tier", "exact",
                                                                 code=1, on_display=True).stderr)

    def test_first_key(self) -> None:
        """The first key of all acts: nothing of the overlay has the keyboard before somebody gives it that."""
        window = self.open("room", first="r")
        before = next(line for line in window.lines() if "R" in line["keys"])["frame"] - 1
        self.assertIn("F1", window.lines()[before - 1]["said"] or "")  # the overlay still shows its first message
        window.hold("w", poses=3)
        self.assertEqual(window.signal(), 0, window.said())
        self.assertGreater(len(cameras(self.folder / "path-0001.json")), 1)

    def test_screenshots(self) -> None:
        window = self.open("room")
        first = self.check_screenshot(window)
        window.hold("w")
        self.assertNotEqual(self.check_screenshot(window)["position"], first["position"])
        window.display.xdo("windowsize", window.id, 401, 277)
        window.line(lambda line: line["size"] == [401, 277] and line["pose"] == line["asked"], len(window.lines()))
        self.assertEqual(self.check_screenshot(window)["width"], 401)
        window.key("t")
        self.check_screenshot(window, "--tier", "exact")
        window.key("2")
        window.drag(1, (100, 100), (140, 105), (180, 90))
        self.check_screenshot(window, "--tier", "exact")
        window.key("o")  # two eyes, side by side; of 401 columns the last is left
        picture = window.screenshot()
        out = self.headless("room", picture.with_suffix(".json"), "--eyes", "2", ending="_{eye}" + picture.suffix)
        if picture.suffix == ".png":
            both = read_png(picture)
            self.assertEqual((both.width, both.height), (401, 277))
            for x, eye in ((0, "left"), (200, "right")):
                wanted = read_png(out.with_name(f"headless_{eye}.png"))
                self.assertEqual(both.part(x, 0, x + 200, 277), wanted, eye)
        self.closed(window)
        self.assertIn("wrote ./gsc-0006.json", window.out.read_text())

    def test_frames_from_key_to_picture(self) -> None:
        window = self.open("street", "--lod-bias", FEWER)
        frames, waits = [], []
        for key in ("period", "period", "comma", "comma", "v", "v", "v", "v", "u", "u", "u", "o", "o", "Next", "Home", "period"):
            before = window.settle()
            start = len(window.lines())
            window.display.xdo("keydown", key)
            pressed = window.line(lambda line: line["keys"], start)
            shown = window.line(lambda line: line["pose"] > before["pose"], pressed["frame"] - 1)
            window.display.xdo("keyup", key)  # not before: it has a frame of its own
            frames.append(shown["frame"] - pressed["frame"])
            waits.append(1000 * (shown["seconds"] - pressed["seconds"]) + shown["latency_ms"])
        print("frames from the one that takes a key to the one that shows its picture:", *frames)
        print("milliseconds between the two and from pose to picture:", *(f"{wait:.1f}" for wait in waits))
        self.assertLessEqual(max(frames), MOST_FRAMES)
        self.closed(window)

    def compared(self, window: Window, key: str, shows: str) -> dict:
        start = len(window.lines())
        window.display.xdo("key", key)
        return window.line(lambda line: line["shows"] == shows and line["flip"] is not None, start)

    def test_compare_equal(self) -> None:
        window = self.open("room")  # fast is exact on the CPU
        line = self.compared(window, "x", "split")
        self.assertEqual((line["psnr"], line["flip"]), (None, 0))
        self.assertEqual(window.hold("w")["shows"], "picture")  # and again where it rests
        line = window.line(lambda line: line["shows"] == "split" and line["flip"] is not None, len(window.lines()) - 1)
        self.assertEqual((line["psnr"], line["flip"]), (None, 0))
        self.closed(window)

    def test_compare_with_detail(self) -> None:
        """Begins behind the last picture of a view whose coarse copies are made, so that nothing of it is thrown away."""
        window = self.open("room", "--detail", "1")
        window.display.xdo("windowsize", window.id, 1000, 700)
        window.line(lambda line: line["size"] == [1000, 700] and line["pose"] == line["asked"], len(window.lines()))
        window.settle()
        before = self.compared(window, "x", "split")
        start = len(window.lines())
        with window.slowed():  # pictures take longer than a pose has to rest
            window.display.xdo("key", "g")
            window.line(lambda line: line["asked"] > before["asked"] and line["shows"] == "split", start)
        self.closed(window)
        asked = sorted({line["asked"] for line in window.lines() if line["asked"] > before["asked"]})
        self.assertGreater(len(asked), 1)
        self.assertEqual(asked, list(range(before["asked"] + 3, before["asked"] + 3 + len(asked))))  # 2 were compared

    def check_on_screen(self, wanted: Picture) -> None:
        """In the middle, where no text lies."""
        part = (0, wanted.height // 3, wanted.width, 2 * wanted.height // 3)
        window_case.until(lambda: self.display.picture(*SIZE).part(*part) == wanted.part(*part) or None,
                          "what the screenshot has, on the screen")

    def test_compare(self) -> None:
        window = self.open("street", "--lod-bias", FEWER)
        plain = window.screenshot()
        line = self.compared(window, "x", "split")
        camera = plain.with_suffix(".json")
        less = read_pfm(self.headless("street", camera, "--lod-bias", FEWER, ending=".pfm"))
        full = read_pfm(self.headless("street", camera, "--tier", "exact", ending=".pfm"))
        self.assertAlmostEqual(line["psnr"], psnr(less, full), delta=0.01)
        self.assertGreater(line["flip"], 0)
        if plain.suffix != ".png":
            self.skipTest("skipped: this build writes no PNG")
        split, left = read_png(window.screenshot()), read_png(plain)
        right = read_png(self.headless("street", camera, "--tier", "exact"))
        cut, (width, height) = SIZE[0] // 2, SIZE
        self.assertNotEqual(left.part(cut + 1, 0, width, height), right.part(cut + 1, 0, width, height))
        self.assertEqual(split.part(0, 0, cut, height), left.part(0, 0, cut, height))
        self.assertEqual(split.part(cut + 1, 0, width, height), right.part(cut + 1, 0, width, height))
        self.assertEqual({bytes(row) for row in split.part(cut, 0, cut + 1, height).rows}, {b"\xff\xff\xff"})
        self.check_on_screen(split)
        again = self.compared(window, "x", "difference")
        self.assertEqual((again["psnr"], again["flip"]), (line["psnr"], line["flip"]))
        difference = read_png(window.screenshot())
        worst = max(abs(min(255, int(2550 * abs(a - b) + 0.5)) - shown)
                    for rows in zip(less.rows, full.rows, difference.rows) for a, b, shown in zip(*rows))
        self.assertLessEqual(worst, 1)
        self.check_on_screen(difference)
        self.assertEqual(window.key("x")["shows"], "picture")
        self.assertEqual(read_png(window.screenshot()), left)
        self.closed(window)

    def test_recorded_path(self) -> None:
        window = self.open("room")
        begin = window.key("r")
        window.hold("w", poses=8)
        end = window.hold("w", "d", poses=8)
        start = len(window.lines())
        window.display.xdo("key", "r")
        wrote = window.line(lambda line: line["wrote"], start)
        self.assertEqual(wrote["wrote"], "./path-0001.json")
        [last] = cameras(window.screenshot().with_suffix(".json"))
        self.closed(window)

        path = self.folder / "path-0001.json"
        frames, lines = cameras(path), window.lines()
        self.assertEqual(json.loads(path.read_text())["fps"], 72)
        self.assertLess(math.dist(frames[0]["position"], begin["position"]), 1e-9)
        self.assertLess(math.dist(frames[-1]["position"], end["position"]), 1e-9)
        for key in ("fov_x", "fov_y", "width", "height"):
            self.assertEqual(frames[-1][key], last[key])
        for row, wanted in zip(frames[-1]["rotation"], last["rotation"]):
            self.assertLess(math.dist(row, wanted), 1e-12)
        seconds = wrote["seconds"] - next(line["seconds"] for line in lines if "R" in line["keys"])
        self.assertAlmostEqual(len(frames) / 72, seconds, delta=0.25)
        way = [line["position"] for line in lines if line["frame"] >= begin["frame"]]
        for frame in frames:  # between two positions of the log: straight on, but for the place where a key went down
            at = frame["position"]
            detour = min(math.dist(a, at) + math.dist(at, b) - math.dist(a, b) for a, b in zip(way, way[1:]))
            self.assertLess(detour, 0.02, frame)

        self.play("../room.gsc", "--cameras", path, "--frames", "0:3", "--out", "p{frame}.pfm")
        self.assertEqual(len(list(self.folder.glob("p?.pfm"))), 3)
        self.play("bench", "../room.gsc", "--cameras", path, "--size", "64x48", "--warmup", "1", "--measure", "3")
        self.play("stability", "../room.gsc", "--trajectories", path, "--frames", "0:6", "--size", "64x48", "--reuse", "depth",
                  "--bound-psnr", "20", "--bound-temporal", "0")

    # --- the window and what it stands on

    def test_size_and_close(self) -> None:
        window = self.open("room", "--format", "json")
        for width, height in ((500, 300), (77, 61), (640, 480)):
            start = len(window.lines())
            window.display.xdo("windowsize", window.id, width, height)
            window.line(lambda line: line["size"] == [width, height] and line["pose"] == line["asked"], start)
            before = window.settle()["position"]
            self.assertNotEqual(window.hold("w", poses=3)["position"], before)
        window.display.xdo("key", "space")  # flies from camera to camera
        window.line(lambda line: "Space" in line["keys"], start)
        window.display.xdo("windowunmap", window.id)
        window_case.until(lambda: window.rests() or None, "the end of the log's growth while nothing is to be seen")
        seen = window.lines()[-1]
        window.display.xdo("windowmap", window.id)
        window.line(lambda line: line["pose"] > seen["pose"] and line["size"] == seen["size"], seen["frame"])
        window.display.xdo("windowfocus", window.id, "key", "space")
        window.line(lambda line: "Space" in line["keys"], seen["frame"])
        before = window.settle()["position"]
        self.assertNotEqual(window.hold("s", poses=3)["position"], before)
        picture = window.screenshot()
        window.display.ask_to_close(window.id)
        self.assertEqual(window.ended(), 0, window.said())
        report = json.loads(window.out.read_text())
        check_schema("window-report", report)
        self.check_log(window)
        self.assertEqual(report["frames"], len(window.lines()))
        self.assertEqual(report["written"], [f"./gsc-0001{picture.suffix}", "./gsc-0001.json"])
        poses = report["poses"]
        self.assertEqual(poses["failed"], 0)
        self.assertGreaterEqual(poses["submitted"], window.lines()[-1]["pose"])
        window = self.open("room")
        self.closed(window)
        self.assertRegex(window.out.read_text(), r"^\d+ frames? in [\d.]+ s; \d+ poses?: \d+ shown")

    def test_minimised(self) -> None:
        """Nothing is done for a picture that cannot be shown."""
        window = self.open("room", "--detail", "2")
        window.display.xdo("windowunmap", window.id)
        window_case.until(lambda: window.rests() or None, "the end of the log's growth while nothing is to be seen")
        seen = window.lines()[-1]
        window.display.xdo("key", "--window", window.id, "t")  # wants another picture
        time.sleep(0.5)
        turns = window.turns()
        time.sleep(1)
        self.assertLess(window.turns() - turns, 60)
        window.display.xdo("windowmap", window.id)
        window.focus()
        self.assertRegex(window.line(lambda line: "T" in line["keys"], seen["frame"])["said"], "^exact")
        window.line(lambda line: line["asked"] > seen["asked"] and line["pose"] == line["asked"], seen["frame"])
        self.closed(window)

    def test_display_goes(self) -> None:
        display = Display(self.folder / "display")
        try:
            window = self.open("room", display=display)
            window.key("r")
            window.hold("w", poses=3)
        finally:
            display.close()
        self.assertEqual(window.ended(), 7, window.said())
        self.assertRegex(window.err.read_text(), r"error: display: .*, expected .*; ")
        self.assertGreater(len(cameras(self.folder / "path-0001.json")), 1)  # it is not lost
        for i in range(3):  # while it draws one frame after the other
            display = Display(self.folder / f"display{i}")
            try:
                window = self.open("room", display=display)
                display.xdo("keydown", "w", "keydown", "Left")
                window.line(lambda line: line["pose"] > 3, 0)
            finally:
                display.close()
            self.assertEqual(window.ended(), 7, window.said())

    def test_window_goes(self) -> None:
        window = self.open("room")
        window.key("r")
        window.hold("w", poses=3)
        window.display.xdo("windowclose", window.id)  # destroys it
        self.assertEqual(window.ended(), 7, window.said())
        self.assertRegex(window.err.read_text(), r"error: display: another program destroyed .*, expected .*; ")
        self.assertGreater(len(cameras(self.folder / "path-0001.json")), 1)

    def test_folder_goes(self) -> None:
        (self.folder / "taken").mkdir()
        window = self.open("room", "--folder", "taken")
        window.key("r")
        window.hold("w", poses=3)
        (self.folder / "taken").rmdir()
        start = len(window.lines())
        window.display.xdo("key", "F12")
        window.line(lambda line: re.search("taken/gsc-0001.*, expected", line["said"] or ""), start)
        window.display.ask_to_close(window.id)
        self.assertEqual(window.ended(), 2, window.said())  # the path is lost, and it says so
        self.assertRegex(window.err.read_text(), r"error: taken/path-0001.json: .*, expected .*; ")

    def test_log_is_full(self) -> None:
        window = self.open("room", most_bytes=20_000)
        window.display.xdo("keydown", "w")
        window_case.until(lambda: "warning" in window.err.read_text() or None, "a warning of a log that is full")
        window.display.xdo("keyup", "w")
        self.closed(window)

    def test_refused_with_a_log(self) -> None:
        log = self.folder / "log.jsonl"
        log.write_text("as it was\n")
        view = {"fov": {"left": -0.5, "right": 0.4, "up": 0.3, "down": -0.3},
                "pose": {"position": [0, 0, 0], "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}}
        (self.folder / "views.json").write_text(json.dumps(
            {"schema": "gsc.trajectory/1", "views": [view, view],
             "frames": [{"rotation": view["pose"]["rotation"], "position": [0, 0, 0]}]}))
        run = self.play("window", "../room.gsc", "--log", log, code=2, on_display=True)
        self.assertIn("log.jsonl", run.stderr)
        self.play("window", "../room.gsc", "--log", log, "-w", "--eyes", "2", "--cameras", "views.json", code=1, on_display=True)
        self.assertEqual(log.read_text(), "as it was\n")

    def test_no_display(self) -> None:
        for display in ("", ":59999"):
            run = subprocess.run([PLAY, "window", "../room.gsc", "--log", "log.jsonl", *CPU], cwd=self.folder,
                                 env=environment(display), capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, 5, run.stderr)
            self.assertRegex(run.stderr, r"error: display: .*, expected .*; ")
            self.assertEqual((run.stdout, list(self.folder.iterdir())), ("", []))

    def test_log_is_no_input(self) -> None:
        model, bytes_before = self.folder / "model.gsc", (self.folder / "../room.gsc").read_bytes()
        model.write_bytes(bytes_before)
        self.play("window", model, "--log", model, "-w", code=1)
        self.assertEqual(model.read_bytes(), bytes_before)

    def test_screenshot_in_flight(self) -> None:
        window = self.open("room")
        window.display.xdo("keydown", "w")
        picture = window.screenshot()
        window.display.xdo("keyup", "w")
        written = [line["wrote"] is not None for line in window.lines()].index(True)
        self.assertNotEqual(window.lines()[written]["position"], window.settle()["position"])  # not that of the end
        self.assertEqual(picture.read_bytes(), self.headless("room", picture.with_suffix(".json"), ending=picture.suffix).read_bytes())
        self.closed(window)

    def test_workers_that_fault(self) -> None:
        window = self.open("room", "--inject", "throw:0.1,seed:1", "--format", "json", device=("--devices", "cpu,cpu"))
        for key in ("w", "s", "a", "d"):
            window.hold(key, poses=15)
        self.closed(window)
        report = json.loads(window.out.read_text())
        check_schema("window-report", report)
        self.assertGreater(sum(worker["faults"] for worker in report["workers"]["list"]), 0)

    def test_interrupted(self) -> None:
        window = self.open("room")
        window.key("r")
        window.hold("w", poses=3)
        self.assertEqual(window.signal(), 0, window.said())  # as if it were closed
        self.check_log(window)
        self.assertRegex(window.out.read_text(), r"(?s)^\d+ frames? in [\d.]+ s; .*wrote ./path-0001.json\n$")
        self.assertEqual(window.err.read_text(), "")
        self.assertGreater(len(cameras(self.folder / "path-0001.json")), 1)

    def test_ignored_interrupt(self) -> None:
        # a shell's `command &` ignores SIGINT
        was = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            window = self.open("room")
        finally:
            signal.signal(signal.SIGINT, was)
        window.process.send_signal(signal.SIGINT)
        window.hold("w", poses=3)
        self.closed(window)


if __name__ == "__main__":
    main()
