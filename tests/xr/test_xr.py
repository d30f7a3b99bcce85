#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""gsc-play xr from the headset's side: a fake OpenXR runtime says where eyes, hands and gaze are, ends sessions in every way
there is, and keeps what it was given. Exits with 77 where Mesa's lavapipe is missing. With GSC_XR_BACKEND=cuda a GPU draws, and
its own Vulkan shows.

test_xr.py SOURCE_FOLDER GSC_PLAY GSC RUNTIME_MANIFEST [TEST]...
"""

import array
import json
import math
import os
import pathlib
import resource
import signal
import subprocess
import sys
import tempfile
import time
import typing
import unittest

import xr_case
from xr_case import Run, canted, environment, moving_head

try:
    import jsonschema
except ImportError:  # the schema checks are then left out, and the run says so
    jsonschema = None
    print("note: no jsonschema, schemas are not checked", file=sys.stderr)

SOURCE, PLAY, GSC, MANIFEST = (pathlib.Path(a).resolve() for a in sys.argv[1:5])
SIZE = (96, 88)
BACKEND = ("--backend", xr_case.BACKEND)
DEVICES = ("--devices", xr_case.BACKEND)
HZ = 90
FAR_AWAY = "hang:1,hang-ms:10000"  # no frame is drawn, and none ends for longer than the session lasts


def check_schema(name: str, *values) -> None:
    if jsonschema is not None:
        validator = jsonschema.Draft202012Validator(json.loads((SOURCE / f"schemas/{name}.schema.json").read_text()))
        for value in values:
            validator.validate(value)


class XrCase(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls._files = tempfile.TemporaryDirectory(prefix="gsc_xr_")
        cls.models = pathlib.Path(cls._files.name)
        for name, more in {"room": (), "street": ("--model", "octree")}.items():
            made = cls.models / name
            subprocess.run([GSC, "sample", name, "-o", made, "--anchors", "3k", "-q", *more], check=True,
                           stdout=subprocess.DEVNULL)
            subprocess.run([GSC, "convert", made, "-o", made.with_suffix(".gsc"), "-q"], check=True,
                           stdout=subprocess.DEVNULL)

    @classmethod
    def tearDownClass(cls) -> None:
        cls._files.cleanup()

    def setUp(self) -> None:
        self.folder = self.models / self.id().rsplit(".", 1)[-1]
        self.folder.mkdir()

    def settings(self, frames: int | None = None, **more) -> pathlib.Path:
        """Of the fake runtime, which ends the session at that frame."""
        made = {"views": canted(*SIZE), "head": moving_head(1), "log": str(self.folder / "fake.jsonl"),
                "dump": str(self.folder / "dump"), **more}
        if frames is not None:
            made["events"] = made.get("events", []) + [{"frame": frames, "do": "exit"}]
        path = self.folder / "settings.json"
        path.write_text(json.dumps(made))
        return path

    def xr(self, model: str, *arguments: object, settings: pathlib.Path | None, code: int = 0, backend: tuple = BACKEND,
           log: bool = True) -> Run:
        words = [PLAY, "xr", f"../{model}.gsc", *backend, *arguments] + (["--log", "log.jsonl", "-w"] if log else [])
        done = subprocess.run([str(word) for word in words], cwd=self.folder, capture_output=True, text=True, check=False,
                              env=environment(MANIFEST if settings else None, settings), timeout=600)
        run = Run(self.folder, done)
        self.assertEqual(run.code, code, run.said())
        self.check(run)
        return run

    def check(self, run: Run) -> None:
        """What holds for every session."""
        self.assertNotIn("VUID", run.said())
        self.assertNotIn("Validation", run.said())
        self.assertEqual(run.errors, [], run.said())  # nothing that OpenXR forbids
        check_schema("xr-log", *run.log)
        self.assertEqual([line["frame"] for line in run.log], list(range(1, len(run.log) + 1)))
        for line in run.frames:
            for view in line["views"]:
                self.assertIsNotNone(view["located"], line)  # each pose was handed out in this session
                self.assertLessEqual(view["located"], line["frame"])

    def cameras(self, run: Run) -> list[tuple[list, tuple, pathlib.Path]]:
        """Of each view: place and frame of every picture, their size, and a camera file of their poses."""
        place, places, made = None, [], []
        wanted: list[tuple[dict, int, int]] = []
        frames = {line["frame"]: line for line in run.frames}
        for line in run.log:
            place = line["place"] or place
            places.append(place)
        for number, line in frames.items():
            for index, view in enumerate(line["views"]):
                wanted.append((places[view["located"]], number, index))
        for index in range(max((len(line["views"]) for line in frames.values()), default=0)):
            mine = [(place, number) for place, number, i in wanted if i == index]
            views = [frames[number]["views"][index] for _, number in mine]
            size = tuple(views[0]["rect"][2:])
            trajectory = None
            for (place, _), view in zip(mine, views):
                self.assertEqual(view["fov"], views[0]["fov"])
                one = xr_case.trajectory(place, [view], size)
                if trajectory is None:
                    trajectory = one
                else:
                    trajectory["frames"] += one["frames"]
            path = self.folder / f"view{index}.json"
            path.write_text(json.dumps(trajectory))
            made.append((mine, size, path))
        return made

    def check_pictures(self, run: Run, model: str, *arguments: object, shown: typing.Callable | None = None) -> int:
        """Every picture is the headless player's for its pose, byte by byte; with `shown`, which has shown_squares() of a
        frame and a view, in the squares that are not hidden. Returns their number."""
        compared = 0
        for index, (mine, size, path) in enumerate(self.cameras(run)):
            stream = subprocess.run([PLAY, f"../{model}.gsc", "--cameras", path, "--out", "-", "--stream", "rgb24", "-q",
                                     *BACKEND, *map(str, arguments)], cwd=self.folder, check=True, capture_output=True).stdout
            bytes_each = 3 * size[0] * size[1]
            self.assertEqual(len(stream), bytes_each * len(mine))
            for i, (_, number) in enumerate(mine):
                headless, given = stream[i * bytes_each:(i + 1) * bytes_each], run.picture(number, index)
                if shown is not None:
                    headless, given = self.seen_part(headless, given, size, shown(number, index))
                if headless != given:
                    off = [abs(a - b) for a, b in zip(headless, given)]
                    self.fail(f"frame {number}, view {index}: not what gsc-play draws of its pose; {sum(map(bool, off))} of "
                              f"{len(off)} bytes differ, by at most {max(off)}")
                compared += 1
        return compared

    def seen_part(self, headless: bytes, given: bytes, size: tuple, ranges: list) -> tuple[bytes, bytes]:
        """Of both pictures what is in squares that are not hidden."""
        cut = [[], []]
        for y in range(size[1]):
            first, end = ranges[y // 32]
            for rows, picture in zip(cut, (headless, given)):
                row = picture[3 * size[0] * y:3 * size[0] * (y + 1)]
                rows.append(row[3 * 32 * first:3 * 32 * end])
            # LENS: once kernels leave hidden squares black, assert here that what is left of `given`'s row,
            # row[:3 * 32 * first] + row[3 * 32 * end:], is all 0
        return b"".join(cut[0]), b"".join(cut[1])

    def slow(self, seconds: float, *arguments: object, backend: tuple) -> Run:
        settings = self.settings(clock="real", hz=HZ, hash=False)
        made = json.loads(settings.read_text())
        del made["dump"]
        settings.write_text(json.dumps(made))
        run = self.xr("room", "--seconds", seconds, *arguments, settings=settings, backend=backend)
        self.assertGreater(len(run.log), 0.9 * seconds * HZ)
        return run


class XrTest(XrCase):
    # --- pictures

    def test_pictures(self) -> None:
        run = self.xr("street", "--xr-sync", "--format", "json", settings=self.settings(62))
        self.assertEqual(len(run.log), 63)
        shown = [line for line in run.log if line["shows"]]
        self.assertGreaterEqual(len(shown), 60)
        self.assertTrue(all(line["shows"] == line["frame"] and line["age"] == 0 and line["off_ms"] == 0 for line in shown))
        self.assertEqual(self.check_pictures(run, "street"), 2 * len(shown))
        first, last = run.picture(run.frames[1]["frame"], 0), run.picture(run.frames[-2]["frame"], 0)
        self.assertNotEqual(first, last)
        self.assertGreater(len(set(first)), 50)  # it is a picture
        report = json.loads(run.out)
        check_schema("xr-report", report)
        self.assertEqual(report["frames"]["ended"], len(run.log))
        self.assertEqual((report["frames"]["missed"], report["pictures"], report["ages"][0]), (0, len(shown), len(shown)))

    def test_tiers_and_scale(self) -> None:
        run = self.xr("room", "--xr-sync", "--xr-scale", "0.5", "--tier", "exact", "--xr-space", "stage", "--metre", "0.5",
                      settings=self.settings(8))
        [size] = {tuple(view["rect"][2:]) for line in run.frames for view in line["views"]}
        self.assertEqual(size, (SIZE[0] // 2, SIZE[1] // 2))
        self.assertGreater(self.check_pictures(run, "room", "--tier", "exact"), 10)
        self.assertEqual(next(line["place"]["scale"] for line in run.log if line["place"]), 0.5)

    def test_four_views(self) -> None:
        inner = [{**view, "fov": [angle / 3 for angle in view["fov"]], "width": 64, "height": 60} for view in canted(*SIZE)]
        settings = self.settings(12, configuration="quad", views=canted(*SIZE) + inner)
        run = self.xr("room", "--xr-sync", settings=settings)
        self.assertEqual({len(line["views"]) for line in run.frames if line["layers"]}, {4})
        self.assertGreaterEqual(self.check_pictures(run, "room"), 40)

    def test_one_view(self) -> None:
        run = self.xr("room", "--xr-sync", settings=self.settings(6, configuration="mono", views=canted(*SIZE)[:1]))
        self.assertGreaterEqual(self.check_pictures(run, "room"), 4)

    def test_blue_first(self) -> None:
        for formats, taken in (([44, 50], 50), ([50, 37, 43], 43)):  # red first, wherever it stands
            with self.subTest(formats):
                (self.folder / "fake.jsonl").unlink(missing_ok=True)
                run = self.xr("room", "--xr-sync", settings=self.settings(8, formats=formats))
                self.assertEqual({view["format"] for line in run.frames for view in line["views"]}, {taken})
                self.assertGreaterEqual(self.check_pictures(run, "room"), 12)  # the fake's dumps have red first
        told = json.loads(self.info("--format", "json", settings=self.settings(formats=[37, 50])))
        self.assertEqual(told["format"], "B8G8R8A8_SRGB")

    def test_without_waiting(self) -> None:
        run = self.xr("room", settings=self.settings(40, clock="real", hz=30))
        fresh = [line for line in run.log if line["fresh"]]
        self.assertGreater(len(fresh), 5)
        self.assertLess(len({line["shows"] for line in run.log if line["shows"]}), len(run.log))
        self.assertGreater(self.check_pictures(run, "room"), 10)
        again = [line for line in run.log if line["shows"] and not line["fresh"]]
        for line in again:  # the pose of the picture, not that of the frame
            self.assertLess(line["shows"], line["frame"])

    def test_late(self) -> None:
        """--xr-late: pictures are of the eyes as they were when drawing began, for when they are seen."""
        sync = self.xr("room", "--xr-sync", "--xr-late", settings=self.settings(12))
        self.assertTrue(all(line["off_ms"] == 0 for line in sync.log if line["shows"]))
        self.assertGreaterEqual(self.check_pictures(sync, "room"), 20)
        self.assertGreater(self.check_pictures(self.xr("room", "--xr-late", settings=self.settings(40, clock="real", hz=30)), "room"), 10)
        off = {}
        for late in ((), ("--xr-late",)):
            run = self.slow(3, "--inject", "slow-ms:25", *late, backend=DEVICES)
            fresh = sorted(abs(line["off_ms"]) for line in run.log if line["fresh"])
            off[late] = fresh[len(fresh) // 2]
        print(f"pictures of a renderer that takes 25 ms are seen {off[()]:.1f} ms from the time their eyes were located for "
              f"(median), {off['--xr-late',]:.1f} with --xr-late")
        self.assertLess(off["--xr-late",], 12)  # a refresh: the machine may be busy

    def test_lost_tracking(self) -> None:
        run = self.xr("room", "--xr-sync", settings=self.settings(40, tracking_lost=[[0.1, 0.2]]))
        untracked = [line for line in run.log if line["visible"] and not line["tracked"]]
        self.assertGreater(len(untracked), 5)
        [kept] = {line["shows"] for line in untracked}  # what was drawn last stays where it was
        self.assertEqual(kept, untracked[0]["frame"] - 1)
        self.assertTrue(all(not line["fresh"] for line in untracked))
        self.check_pictures(run, "room")

    # --- depths

    def check_depths(self, run: Run, model: str) -> int:
        """Depths that were submitted are those of the renderer on the host. Returns how many pixels have one."""
        tool, there = MANIFEST.parent / "write_depths", 0
        for index, (mine, size, path) in enumerate(self.cameras(run)):
            out = self.folder / f"view{index}.raw"
            subprocess.run([tool, f"../{model}.gsc", path, out], cwd=self.folder, check=True)
            wanted = array.array("f", out.read_bytes())
            count = size[0] * size[1]
            self.assertEqual(len(wanted), count * len(mine))
            for i, (place, number) in enumerate(mine):
                layer = next(line for line in run.frames if line["frame"] == number)["views"][index]["depth"]
                near, far, metre = layer["near"], layer["far"], place["scale"]
                given = array.array("f", (self.folder / f"dump/frame-{number:05}-view-{index}.depth").read_bytes())
                self.assertEqual(len(given), count)
                for depth, z in zip(given, wanted[i * count:(i + 1) * count]):
                    if math.isinf(z):
                        self.assertEqual(depth, 0)
                        continue
                    metres = near * far / (far + depth * (near - far))  # OpenXR's, of minDepth 0 and maxDepth 1
                    self.assertLess(abs(metres * metre - z), 1e-5 * z)
                    there += 1
        return there

    @unittest.skipUnless((MANIFEST.parent / "write_depths").exists() and xr_case.BACKEND == "cpu", "no write_depths, or a GPU draws")
    def test_depth(self) -> None:
        for name, more in {"moving": {}, "metre": {"metre": 0.5}}.items():
            with self.subTest(name):
                (self.folder / "fake.jsonl").unlink(missing_ok=True)
                words = [word for key, value in more.items() for word in (f"--{key}", value)]
                run = self.xr("room", "--xr-sync", "--xr-depth", "--format", "json", *words, settings=self.settings(12))
                self.assertNotIn("warning", run.err)
                report = json.loads(run.out)
                check_schema("xr-report", report)
                self.assertTrue(report["headset"]["takes_depth"])
                shown = [line for line in run.frames if line["layers"]]
                self.assertGreaterEqual(len(shown), 10)
                self.assertGreater(self.check_depths(run, "room"), len(shown) * SIZE[0] * SIZE[1] // 2)
                self.check_pictures(run, "room")
        inner = [{**view, "fov": [angle / 3 for angle in view["fov"]], "width": 64, "height": 60} for view in canted(*SIZE)]
        (self.folder / "fake.jsonl").unlink()
        run = self.xr("street", "--xr-sync", "--xr-depth", settings=self.settings(5, configuration="quad", views=canted(*SIZE) + inner))
        self.assertGreater(self.check_depths(run, "street"), 1000)

    def test_no_depth(self) -> None:
        for more in ({"extensions_withheld": ["XR_KHR_composition_layer_depth"]}, {"formats": [43]}):
            with self.subTest(more):
                (self.folder / "fake.jsonl").unlink(missing_ok=True)
                run = self.xr("room", "--xr-sync", "--xr-depth", settings=self.settings(5, **more))
                self.assertRegex(run.err, "warning: headset: .* takes no depths, expected .*XR_KHR_composition_layer_depth.*D32_SFLOAT")
                self.assertEqual({str(view["depth"]) for line in run.frames for view in line["views"]}, {"None"})
                self.check_pictures(run, "room")
        (self.folder / "fake.jsonl").unlink()
        plain = self.xr("room", "--xr-sync", settings=self.settings(5))
        self.assertEqual({str(view["depth"]) for line in plain.frames for view in line["views"]}, {"None"})

    # --- lenses

    def test_lens_mask(self) -> None:
        size = (320, 280)
        views = canted(*size)
        outlines = [xr_case.lens(view["fov"], 0.92) for view in views]
        wide = [xr_case.lens(view["fov"], 1.0) for view in views]
        masks = {str(i): xr_case.hidden_mesh(outline) for i, outline in enumerate(outlines)}
        events = [{"frame": 8, "do": "mask", "masks": {str(i): xr_case.hidden_mesh(outline) for i, outline in enumerate(wide)}}]
        run = self.xr("room", "--xr-sync", "--format", "json", settings=self.settings(14, views=views, visibility_mask=masks, events=events))
        fovs = [view["fov"] for view in next(line["views"] for line in run.frames if line["layers"])]

        def share(ranges: list) -> float:
            hidden = sum((size[0] - min(32 * end, size[0]) + 32 * first) * min(32, size[1] - 32 * row) for row, (first, end) in enumerate(ranges))
            return hidden / (size[0] * size[1])

        before, after = ([xr_case.shown_squares(outline, fov, size) for outline, fov in zip(each, fovs)] for each in (outlines, wide))
        self.assertGreater(min(map(share, before)), min(map(share, after)))
        self.assertGreater(min(map(share, after)), 0.02)
        # the runtime changes the mask in its frame 8, which the player hears of before the next
        shown = lambda frame, view: (before if frame <= 8 else after)[view]  # noqa: E731
        self.assertGreaterEqual(self.check_pictures(run, "room", shown=shown), 20)
        report = json.loads(run.out)
        check_schema("xr-report", report)
        self.assertTrue(report["headset"]["tells_mask"])
        for view in (0, 1):  # as it was at the end
            self.assertAlmostEqual(report["headset"]["views"][view]["hidden"], share(after[view]), places=9)
        self.assertEqual(len(run.masks), 4)  # of two views at the start, and again of each that changed
        self.assertTrue(all(mask["hidden"] for mask in run.masks))

        settings = self.settings(views=views, visibility_mask=masks)
        told = self.info("--format", "json", settings=settings)
        check_schema("xr-info", json.loads(told))
        for view in (0, 1):
            self.assertAlmostEqual(json.loads(told)["views"][view]["hidden"], share(before[view]), places=9)
        self.assertRegex(self.info(settings=settings), r"lens mask +hides \d+\.\d %, \d+\.\d % of the pixels")
        self.assertRegex(self.info(settings=self.settings()), r"lens mask +none .*XR_KHR_visibility_mask")

    def test_lens_masks_that_make_no_sense(self) -> None:
        good = xr_case.hidden_mesh(xr_case.lens([-45, 45, 45, -45], 0.8))
        bad = {"three of each triangle": {**good, "indices": good["indices"][:-1]},
               "expected one of its 48 corners": {**good, "indices": good["indices"][:-1] + [48]},
               "expected finite numbers": {**good, "vertices": good["vertices"][:-1] + [[None, 0]]},
               "expected at most 65536": {**good, "indices": [0, 1, 2] * 30000}}
        for says, mesh in bad.items():
            with self.subTest(says):
                (self.folder / "fake.jsonl").unlink(missing_ok=True)
                run = self.xr("room", "--xr-sync", "--format", "json", settings=self.settings(4, visibility_mask={"0": mesh, "1": {"vertices": [], "indices": []}}))
                self.assertRegex(run.err, f"warning: headset: the mask of view 0 .*{says}.*; its pictures are drawn whole")
                self.assertEqual(run.err.count("the mask of view"), 1)
                self.assertEqual([view["hidden"] for view in json.loads(run.out)["headset"]["views"]], [0, 0])
                self.check_pictures(run, "room")

    def info(self, *arguments: object, settings: pathlib.Path) -> str:
        return subprocess.run([PLAY, "xr", "--info", *arguments], cwd=self.folder, capture_output=True, text=True, check=True,
                              env=environment(MANIFEST, settings)).stdout

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
        self.xr("room", "--target-ms", "5", settings=self.settings(5), code=1)  # it has one level
        thinned = self.xr("room", "--xr-sync", "--target-ms", "0.001", "--foveation", "fixed", "--fovea-pixels", "1.5",
                          settings=self.settings(30))
        pixels = [line["fovea_pixels"] for line in thinned.log if line["fresh"]]
        self.assertEqual((pixels[0], pixels[-1], pixels), (1.5, 6, sorted(pixels)))
        both = self.xr("street", "--xr-sync", "--target-ms", "0.001", "--foveation", "fixed", settings=self.settings(40))
        lines = [line for line in both.log if line["fresh"]]
        self.assertEqual((lines[0]["lod_bias"], lines[0]["fovea_pixels"]), (0, 2))
        begun = next(line for line in lines if line["fovea_pixels"] > 2)  # levels first
        self.assertEqual(begun["lod_bias"], -2)

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

    def ended(self, *arguments: object, settings: pathlib.Path | None) -> subprocess.CompletedProcess:
        return subprocess.run([str(word) for word in (PLAY, "xr", *arguments, *BACKEND)], cwd=self.folder, capture_output=True,
                              text=True, env=environment(MANIFEST if settings else None, settings), timeout=xr_case.SECONDS, check=False)

    def test_fallback(self) -> None:
        done = self.ended("../room.gsc", "--fallback", "window", settings=None)  # and there is no display either
        self.assertEqual(done.returncode, 5)
        self.assertRegex(done.stderr, r"warning: headset: .*; a window is opened instead.*\n(.*\n)*error: display: ")

    def test_interrupted(self) -> None:
        settings = self.settings(clock="real", hz=HZ)
        process = subprocess.Popen([str(PLAY), "xr", "../room.gsc", *BACKEND, "--log", "log.jsonl"], cwd=self.folder,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment(MANIFEST, settings))
        log = self.folder / "log.jsonl"
        end = time.monotonic() + xr_case.SECONDS
        while not (log.exists() and '"fresh":true' in log.read_text()) and time.monotonic() < end:
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=xr_case.SECONDS)
        self.assertEqual((process.returncode, out), (130, ""), err)
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


class XrPaceTest(XrCase):
    def test_slow_renderer(self) -> None:
        seconds = float(os.environ.get("GSC_XR_SECONDS", "60"))
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
