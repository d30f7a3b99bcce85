# SPDX-License-Identifier: Apache-2.0
"""Pictures that gsc-play xr gives a headset to show, their depths, and the parts that lenses hide."""

import array
import json
import math
import subprocess
import unittest

import xr_case
from xr_case import Run, canted
from xr_player import BACKEND, DEVICES, MANIFEST, PLAY, SIZE, XrCase, check_schema


class PictureTest(XrCase):
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
        self.assertLessEqual(off["--xr-late",], off[()])
        if b"__asan_init" not in PLAY.read_bytes():  # which is too slow for a refresh
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
               "expected one of 48 corners": {**good, "indices": good["indices"][:-1] + [48]},
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
