#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""gsc-play xr from the headset's side: a fake OpenXR runtime says where eyes, hands and gaze are, ends sessions in every way
there is, and keeps what it was given. Exits with 77 where Mesa's lavapipe is missing. With GSC_XR_BACKEND=cuda a GPU draws, and
its own Vulkan shows.

test_xr.py SOURCE_FOLDER GSC_PLAY GSC RUNTIME_MANIFEST [TEST]...
"""

import contextlib
import json
import math
import os
import pathlib
import resource
import signal
import subprocess
import sys
import time
import unittest

sys.path.append(str(pathlib.Path(__file__).parents[1] / "player"))
import window_case  # noqa: E402
import xr_case  # noqa: E402
from xr_case import Run, environment  # noqa: E402
from xr_pictures import PictureTest  # noqa: E402
from xr_start import XrStartTest  # noqa: E402, F401
from xr_player import BACKEND, DEVICES, FAR_AWAY, HZ, MANIFEST, PLAY, SECONDS, XrCase, check_schema  # noqa: E402


class XrTest(PictureTest):
    # --- the viewer

    def hand(self, path: str, value: float, begin: float = 0.1, end: float = 0.3) -> list[dict]:
        return [{"t": begin, "path": path, "value": value}, {"t": end, "path": path, "value": 0}]

    def places(self, run: Run) -> list[dict]:
        return [line["place"] for line in run.log if line["place"]]

    def test_controllers(self) -> None:
        still = [{"t": 0, "position": [0, 0, 0], "rotation": [0, 0, 0, 1]}]
        left = [{"t": 0, "position": [-0.2, -0.3, -0.4], "rotation": [0, 0, 0, 1]},
                {"t": 1, "position": [-0.2, -0.3, -0.1], "rotation": [0, 0, 0, 1]}]
        down = [{"t": 0, "position": [0.2, -0.3, -0.3], "rotation": [-math.sin(math.pi / 8), 0, 0, math.cos(math.pi / 8)]}]

        def run(inputs: list[dict], **more) -> list[dict]:
            settings = self.settings(60, head=still, hands={"left": left, "right": down}, inputs=inputs, dump=None, **more)
            if more.get("dump") is None:
                made = json.loads(settings.read_text())
                del made["dump"]
                settings.write_text(json.dumps(made))
            return self.places(self.xr("room", "--xr-sync", "--xr-scale", "0.2", settings=settings))

        [start] = run([])
        moved = lambda place: [a - b for a, b in zip(place["position"], start["position"])]  # noqa: E731
        along = lambda place, axis: sum(a * b for a, b in zip(moved(place), start[axis])) / start["scale"]  # noqa: E731
        walked = run(self.hand("/user/hand/left/input/thumbstick/y", 1))[-1]  # 2.5 metres a second
        self.assertAlmostEqual(along(walked, "backward"), -0.5, delta=0.06)
        self.assertAlmostEqual(along(walked, "right"), 0, places=6)
        risen = run(self.hand("/user/hand/right/input/thumbstick/y", 1))[-1]
        self.assertAlmostEqual(along(risen, "up"), 0.5, delta=0.06)
        turned = run(self.hand("/user/hand/right/input/thumbstick/x", 1))
        self.assertEqual(len(turned), 2)  # the start, and one turn
        self.assertAlmostEqual(sum(a * b for a, b in zip(turned[1]["right"], start["right"])), math.cos(math.pi / 6), places=9)
        self.assertAlmostEqual(sum(a * b for a, b in zip(turned[1]["backward"], start["right"])), -0.5, places=9)  # to the right
        pulled = run(self.hand("/user/hand/left/input/squeeze/value", 1))[-1]  # by 0.06 m towards the viewer
        self.assertAlmostEqual(along(pulled, "backward"), -0.06, delta=0.012)
        gone = run(self.hand("/user/hand/right/input/trigger/value", 1))[-1]
        self.assertAlmostEqual(along(gone, "backward"), -1.61, places=5)  # 1.3 m down at 45 degrees, 0.31 m before the eyes
        self.assertAlmostEqual(along(gone, "right"), 0.2, places=5)
        back = run(self.hand("/user/hand/left/input/thumbstick/y", 1) + self.hand("/user/hand/right/input/b/click", 1, 0.4, 0.5))[-1]
        self.assertEqual(back, start)
        other = run(self.hand("/user/hand/left/input/select/click", 1), profile="/interaction_profiles/khr/simple_controller")[-1]
        self.assertAlmostEqual(along(other, "backward"), -0.06, delta=0.012)

    def test_keep_place(self) -> None:
        inputs = self.hand("/user/hand/left/input/thumbstick/y", 1)
        run = self.xr("room", "--xr-sync", "--keep-place", settings=self.settings(40, hands={}, inputs=inputs))
        path = self.models / "room.gsc.place.json"
        self.addCleanup(path.unlink)
        kept = json.loads(path.read_text())
        check_schema("place", kept)
        self.assertEqual({key: kept[key] for key in kept if key != "schema"}, self.places(run)[-1])
        self.assertIn("room.gsc.place.json", run.out)
        again = self.xr("room", "--xr-sync", "--keep-place", settings=self.settings(5))
        self.assertEqual(self.places(again), [self.places(run)[-1]])
        elsewhere = self.xr("room", "--xr-sync", settings=self.settings(5))
        self.assertEqual(self.places(elsewhere), [self.places(run)[0]])
        # the eyes start there whatever the space, and with another metre too
        for options, scale in ((("--xr-space", "stage"), kept["scale"]), (("--xr-space", "stage", "--metre", "0.5"), 0.5)):
            path.write_text(json.dumps(kept))
            place = self.places(self.xr("room", "--xr-sync", "--keep-place", *options, settings=self.settings(5)))[0]
            self.assertEqual(place["scale"], scale)
            for i in range(3):
                self.assertAlmostEqual(place["position"][i] + 1.6 * scale * place["up"][i], kept["position"][i], places=9)
        for broken, says in (("{}", "schema"), (json.dumps({**kept, "up": [1, 2, 3]}), "no rotation"),
                             (json.dumps({**kept, "scale": 0}), "scale"), ("[", "place of a headset")):
            path.write_text(broken)
            refused = self.xr("room", "--keep-place", settings=self.settings(5), code=3)
            self.assertRegex(refused.err, f"error: .*room.gsc.place.json: .*{says}")
            self.assertEqual(path.read_text(), broken)

    def test_ride(self) -> None:
        paths = self.folder / "paths.json"
        straight = {"schema": "gsc.trajectory/1", "frames": [
            {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "position": [0.01 * i, -1, 0.02 * i], "fov_x": 1, "width": 64, "height": 64}
            for i in range(20)]}
        paths.write_text(json.dumps(straight))
        run = self.xr("room", "--xr-sync", "--ride", "--ride-fps", "45", "--cameras", paths, settings=self.settings(30))
        for line in run.log:
            if line["place"]:
                at = min((line["display_time"] - run.log[0]["display_time"]) / 1e9 * 45, 19)
                for got, wanted in zip(line["place"]["position"], (0.01 * at, -1, 0.02 * at)):
                    self.assertAlmostEqual(got, wanted, places=6)
        self.assertGreater(self.check_pictures(run, "room"), 40)

    def test_levels_hold_the_time(self) -> None:
        run = self.xr("street", "--xr-sync", "--target-ms", "0.001", settings=self.settings(30))
        biases = [line["lod_bias"] for line in run.log if line["fresh"]]
        self.assertEqual(biases[0], 0)
        self.assertLess(biases[-1], -1)
        details = [line["detail"] for line in run.log if line["fresh"]]  # before levels
        self.assertEqual((details[0], details[-1], details), (0, 4, sorted(details)))
        self.assertTrue(all(line["detail"] > 0 for line in run.log if line["fresh"] and line["lod_bias"] < 0))
        refused = self.xr("room", "--target-ms", "5", "--tier", "exact", settings=self.settings(5), code=1)  # it has one level
        self.assertRegex(refused.err, "error: --target-ms 5: .*one level of detail.*--foveation fixed")
        thinned = self.xr("room", "--xr-sync", "--target-ms", "0.001", "--foveation", "fixed", "--fovea-pixels", "1.5",
                          settings=self.settings(30))
        pixels = [line["fovea_pixels"] for line in thinned.log if line["fresh"]]
        self.assertEqual((pixels[0], pixels[-1], pixels), (1.5, 6, sorted(pixels)))
        both = self.xr("street", "--xr-sync", "--target-ms", "0.001", "--foveation", "fixed", settings=self.settings(40))
        lines = [line for line in both.log if line["fresh"]]
        self.assertEqual((lines[0]["lod_bias"], lines[0]["fovea_pixels"]), (0, 2))
        begun = next(line for line in lines if line["fovea_pixels"] > 2)  # levels first
        self.assertEqual(begun["lod_bias"], -2)

    def test_detail_is_told(self) -> None:
        for options, detail in (((), 0), (("--tier", "turbo"), 2), (("--detail", "1.5"), 1.5)):
            run = self.xr("room", "--xr-sync", *options, settings=self.settings(4))
            told = [line["detail"] for line in run.log if line["fresh"]]
            self.assertGreater(len(told), 1)
            self.assertEqual(set(told), {detail})

    def test_gaze(self) -> None:
        info = subprocess.run([PLAY, "xr", "--info"], cwd=self.folder, capture_output=True, text=True, check=True,
                              env=environment(MANIFEST, self.settings(gaze=[{"t": 0, "rotation": [0, 0, 0, 1]}])))
        self.assertRegex(info.stdout, r"gaze +tracked")
        self.assertIn("XR_EXT_eye_gaze_interaction", info.stdout)
        told = subprocess.run([PLAY, "xr", "--info", "--format", "json"], cwd=self.folder, capture_output=True, text=True, check=True,
                              env=environment(MANIFEST, self.settings()))
        check_schema("xr-info", json.loads(told.stdout))
        yaw = math.radians(20)  # to the left, of the head; the eyes look outwards by five degrees
        run = self.xr("room", "--xr-sync", "--foveation", "gaze", settings=self.settings(
            6, gaze=[{"t": 0, "rotation": [0, math.sin(yaw / 2), 0, math.cos(yaw / 2)]}]))
        looks = [line["gaze"] for line in run.log if line["fresh"]]
        self.assertGreater(len(looks), 2)
        for left, right in looks:
            self.assertAlmostEqual(left[0], -math.tan(math.radians(15)), places=4)
            self.assertAlmostEqual(right[0], -math.tan(math.radians(25)), places=4)
            self.assertAlmostEqual(left[1], 0, places=4)
        plain = self.xr("room", "--xr-sync", "--foveation", "fixed", settings=self.settings(6))
        self.assertEqual({str(line["gaze"]) for line in plain.log}, {"None"})

    # --- sessions

    def test_states(self) -> None:
        events = [{"frame": 10, "do": "hide"}, {"frame": 20, "do": "show"}, {"frame": 25, "do": "unfocus"}, {"frame": 30, "do": "focus"},
                  {"frame": 35, "do": "stop"}, {"frame": 35, "do": "restart", "polls": 5}]
        run = self.xr("room", "--xr-sync", settings=self.settings(50, events=events))
        for line, given in zip(run.log, run.frames):
            self.assertEqual(line["visible"], given["should_render"])
            self.assertEqual(given["layers"], 1 if line["visible"] else 0)
        self.assertFalse(any(line["visible"] for line in run.log[11:20]))
        self.assertTrue(all(line["visible"] for line in run.log[21:35]))
        self.assertEqual(run.events.count("STOPPING"), 2)  # once to come back, once at the end
        self.assertEqual(run.events[-2:], ["EXITING", "instance_destroyed"])
        self.assertGreater(self.check_pictures(run, "room"), 40)

    def test_losses(self) -> None:
        for event in ("loss_pending", "session_lost", "instance_lost"):
            with self.subTest(event):
                settings = self.settings(events=[{"frame": 10, "do": event}])
                (self.folder / "fake.jsonl").unlink(missing_ok=True)
                done = subprocess.run([PLAY, "xr", "../room.gsc", *BACKEND], cwd=self.folder, capture_output=True, text=True,
                                      env=environment(MANIFEST, settings), timeout=xr_case.SECONDS, check=False)
                self.assertEqual(done.returncode, 7, done.stderr)
                self.assertRegex(done.stderr, r"error: headset: .*gone.*, expected .*; ")
                self.assertNotIn("VUID", done.stderr)

    def test_refusals(self) -> None:
        old = self.folder / "old.jsonl"
        old.write_text("as it was\n")
        done = self.ended("../room.gsc", "--log", old, "-w", settings=self.settings(formats=[37, 44]))
        self.assertEqual((done.returncode, old.read_text()), (5, "as it was\n"), done.stderr)
        place = self.models / "room.gsc.place.json"
        done = self.ended("../room.gsc", "--keep-place", "--log", place, "-w", settings=self.settings())
        self.assertEqual((done.returncode, place.exists()), (1, False), done.stderr)
        old.unlink()
        for more, says in (({"system": False}, "finds none"), ({"extensions_withheld": ["XR_KHR_vulkan_enable2"]}, "XR_KHR_vulkan_enable2"),
                           ({"formats": [37, 44]}, "R8G8B8A8_UNORM, B8G8R8A8_UNORM, expected R8G8B8A8_SRGB or B8G8R8A8_SRGB among them")):
            done = self.ended("../room.gsc", settings=self.settings(**more))
            self.assertEqual(done.returncode, 5, done.stderr)
            self.assertRegex(done.stderr, f"error: headset: .*{says}")
        done = self.ended("../room.gsc", "--xr-space", "stage", settings=self.settings(stage=False))
        self.assertEqual(done.returncode, 5)
        self.assertIn("--xr-space local", done.stderr)
        done = self.ended("../room.gsc", settings=None)
        self.assertEqual(done.returncode, 5)
        self.assertRegex(done.stderr, r"error: headset: no OpenXR runtime answers .*, expected .*; .*XR_RUNTIME_JSON")
        self.assertEqual(len(done.stderr.splitlines()), 1)  # the loader says nothing of its own
        self.assertEqual({path.name for path in self.folder.iterdir()} - {"dump"}, {"fake.jsonl", "settings.json"})

    def test_fallback(self) -> None:
        done = self.ended("../room.gsc", "--fallback", "window", settings=None)  # and there is no display either
        self.assertEqual(done.returncode, 5)
        self.assertRegex(done.stderr, r"warning: headset: .*; a window is opened instead.*\n(.*\n)*error: display: ")

    @unittest.skipIf(window_case.missing(), window_case.missing())
    def test_fallback_holds_the_seconds(self) -> None:
        display = window_case.Display(self.folder / "display")
        self.addCleanup(display.close)
        done = subprocess.run([str(PLAY), "xr", "../room.gsc", "--fallback", "window", "--seconds", "1", *BACKEND, "--format", "json"],
                              cwd=self.folder, capture_output=True, text=True, timeout=xr_case.SECONDS, check=False,
                              env={**window_case.environment(display.name), "XR_RUNTIME_JSON": "/nonexistent.json"})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertGreaterEqual(json.loads(done.stdout)["seconds"], 1)

    def test_info_without_a_headset(self) -> None:
        for settings, runtime, why in ((None, "none", "no OpenXR runtime answers"),
                                       (self.settings(system=False), "gsc fake runtime.*", "the OpenXR runtime finds none")):
            done = self.ended("--info", settings=settings)
            self.assertEqual(done.returncode, 5, done.stderr)
            self.assertRegex(done.stdout, rf"loader +libopenxr_loader\S+\nvulkan +\d+\.\d+\.\d+, libvulkan\S+\ngpu +llvmpipe.*\n"
                                          rf"runtime +{runtime}\nheadset +none: {why}")
            self.assertRegex(done.stderr, f"error: headset: {why}")

    def test_interrupted(self) -> None:
        settings = self.settings(clock="real", hz=HZ)
        process = subprocess.Popen([str(PLAY), "xr", "../room.gsc", *BACKEND, "--log", "log.jsonl"], cwd=self.folder,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment(MANIFEST, settings))
        log = self.folder / "log.jsonl"
        end = time.monotonic() + xr_case.SECONDS
        while not (log.exists() and '"fresh":true' in log.read_text()) and time.monotonic() < end:
            time.sleep(0.05)
        scheduled = policies(process.pid)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=xr_case.SECONDS)
        self.assertEqual((process.returncode, out), (130, ""), err)
        # the session's thread has real-time priority where it may, and no other
        self.assertEqual(scheduled.pop(process.pid), os.SCHED_FIFO if may_have_priority() else os.SCHED_OTHER)
        self.assertNotIn(os.SCHED_FIFO, scheduled.values())  # Mesa has some of SCHED_BATCH
        run = Run(self.folder, subprocess.CompletedProcess([], 130, out, err))
        self.assertIn("exit_requested", run.events)
        self.assertEqual(run.events[-2:], ["EXITING", "instance_destroyed"])  # it ended as sessions do
        self.check(run)

    def test_interrupted_while_it_waits(self) -> None:
        settings = self.settings(clock="real", hz=HZ)
        process = subprocess.Popen([str(PLAY), "xr", "../room.gsc", *DEVICES, "--inject", "slow-ms:400", "--xr-sync", "--log", "log.jsonl"],
                                   cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                   env=environment(MANIFEST, settings))
        log, end = self.folder / "log.jsonl", time.monotonic() + xr_case.SECONDS
        while not (log.exists() and '"fresh":true' in log.read_text()) and time.monotonic() < end:
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=xr_case.SECONDS)
        self.assertEqual(process.returncode, 130, err)
        run = Run(self.folder, subprocess.CompletedProcess([], 130, out, err))
        self.assertEqual(run.events[-2:], ["EXITING", "instance_destroyed"])
        self.assertNotIn("nothing was written", err)

    def test_log_is_full(self) -> None:
        def limit() -> None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (8_000, 8_000))

        settings = self.settings(60, log=None)
        made = json.loads(settings.read_text())
        settings.write_text(json.dumps({key: value for key, value in made.items() if key not in ("log", "dump")}))
        done = subprocess.run([str(PLAY), "xr", "../room.gsc", *BACKEND, "--xr-sync", "--log", "log.jsonl"], cwd=self.folder, text=True,
                              capture_output=True, env=environment(MANIFEST, settings), preexec_fn=limit, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, "warning: log.jsonl")
        self.assertIn("61 frames", done.stdout)

    def test_seconds_of_a_headset_at_rest(self) -> None:
        self.xr("room", "--seconds", "0.5", settings=self.settings(events=[{"frame": 3, "do": "stop"}]))

    def test_seconds(self) -> None:
        run = self.xr("room", "--xr-sync", "--seconds", "0.2", settings=self.settings())
        self.assertAlmostEqual(len(run.log), 0.2 * HZ, delta=6)

    # --- a renderer that is stuck or lost

    def test_stuck_renderer(self) -> None:
        run = self.slow(2, "--inject", FAR_AWAY, backend=DEVICES)
        self.assertEqual(sum(line["fresh"] for line in run.log), 0)
        self.assertIn("starts at the first camera; not all starts were drawn", run.err)
        self.assertEqual(run.events[-2:], ["EXITING", "instance_destroyed"])

    def test_lost_renderer(self) -> None:
        run = self.slow(8, "--inject", "lost:0.7,seed:3", "--format", "json", backend=DEVICES)
        report = json.loads(run.out)
        check_schema("xr-report", report)
        self.assertGreater(report["renewals"], 0)  # every device was lost four times, and the session went on
        first_renewal = run.err.index("it is made anew")
        self.assertGreaterEqual(first_renewal, 0)
        last = max(i for i, line in enumerate(run.log) if line["fresh"])
        self.assertGreater(last, len(run.log) // 2)

    def test_renderer_lost_for_good(self) -> None:
        run = self.xr("room", "--inject", "lost:1", settings=self.settings(clock="real", hz=HZ, hash=False), code=7, backend=DEVICES)
        self.assertRegex(run.err, r"error: .*no worker is left")
        self.assertGreater(len(run.log), 100)


def policies(process: int) -> dict[int, int]:
    """Scheduling policy of each thread that still lives when it is asked."""
    found = {}
    for task in pathlib.Path(f"/proc/{process}/task").iterdir():
        with contextlib.suppress(ProcessLookupError):
            found[int(task.name)] = os.sched_getscheduler(int(task.name)) & ~os.SCHED_RESET_ON_FORK
    return found


def may_have_priority() -> bool:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except PermissionError:
        return False
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    return True


class XrPaceTest(XrCase):
    def test_slow_renderer(self) -> None:
        seconds = SECONDS
        with xr_case.LateTicks(HZ) as ticks:
            run = self.slow(seconds, "--inject", "slow-ms:33", backend=DEVICES)
        missed = sum(line["missed"] for line in run.frames)
        pictures = sum(line["fresh"] for line in run.log)
        busy = sorted(line["busy_ms"] for line in run.log)
        print(f"{len(run.log)} frames at {HZ} Hz, {pictures} pictures in {seconds:g} s: {missed} frames missed; of the thread: "
              f"median {busy[len(busy) // 2]:.3f} ms, p99 {busy[len(busy) * 99 // 100]:.3f}, most {busy[-1]:.3f}; this machine "
              f"let {ticks.late} refreshes pass by itself")
        self.assertLess(pictures, 31 * seconds)
        self.assertGreater(pictures, 10 * seconds)
        self.assertLessEqual(missed, ticks.late)


if __name__ == "__main__":
    if why := xr_case.missing():
        print(f"skipped: {why}")
        sys.exit(77)
    unittest.main(argv=[sys.argv[0], *sys.argv[5:]])
