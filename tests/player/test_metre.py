#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""One metre: what `gsc sample` makes states it in metre.json; file, paths, --ipd 64mm, window and headset hold to it, and so
does what is made of the model or repeats it. Window and headset are left out, and said to be, where this machine has none.

test_metre.py SOURCE_FOLDER GSC_PLAY GSC [RUNTIME_MANIFEST_OF_THE_FAKE_HEADSET]
"""
import json
import math
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path += [str(pathlib.Path(__file__).parents[1] / folder) for folder in ("player", "xr", "support")]
import window_case  # noqa: E402
import xr_case  # noqa: E402
from cases import check_schema  # noqa: E402

SOURCE, PLAY, GSC = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
MANIFEST = pathlib.Path(sys.argv[4]).resolve() if len(sys.argv) > 4 else None
PATHS = ["aerial", "orbit", "head_turn", "teleport", "zoom_out", "walk_through", "level_swing", "jitter", "wide_eyes", "flight", "stroll",
         "look_around"]


class MetreTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls._files = tempfile.TemporaryDirectory(prefix="gsc_metre_")
        cls.folder = pathlib.Path(cls._files.name)
        cls.gsc("sample", "city", "--anchors", 6000, "-o", "city")
        cls.gsc("sample", "city", "--anchors", 6000, "--model", "octree", "--everything-on", "--seed", 3, "-o", "octree")
        for scene in ("street", "room"):
            cls.gsc("sample", scene, "--anchors", 3000, "-o", scene)
        shutil.copytree(cls.folder / "city", cls.folder / "trained")  # a trainer states no metre
        (cls.folder / "trained/metre.json").unlink()
        shutil.copytree(cls.folder / "trained", cls.folder / "surveyed")  # one that somebody has measured
        (cls.folder / "surveyed/metre.json").write_text('{"schema": "gsc.metre/1", "units": 0.33}')
        for name in ("city", "octree", "trained", "surveyed"):
            cls.gsc("sample", "replicate", name, "--anchors", 15000, "-o", f"{name}_tiles")
        cls.gsc("sample", "replicate", "trained_tiles", "--anchors", 30000, "-o", "tiles_of_tiles")

    @classmethod
    def tearDownClass(cls) -> None:
        cls._files.cleanup()

    @classmethod
    def gsc(cls, *arguments: object, code: int = 0, program: pathlib.Path = GSC) -> subprocess.CompletedProcess:
        run = subprocess.run([str(program), *map(str, arguments)], cwd=cls.folder, capture_output=True, text=True, check=False)
        assert run.returncode == code, f"{arguments}: {run.returncode}\n{run.stdout}\n{run.stderr}"
        return run

    def metre_of(self, file: str) -> dict:
        return json.loads(self.gsc("info", file, "--format", "json").stdout)["metre"]

    def converted(self, model: str) -> str:
        if not (self.folder / f"{model}.gsc").exists():
            self.gsc("convert", model, "-o", f"{model}.gsc", "-q")
        return f"{model}.gsc"

    def check_model(self, model: str, units: float, rule: str) -> None:
        """File, metre.json, the paths beside the model, those of `gsc sample paths`, and eyes 64 mm apart."""
        file = self.converted(model)
        stated = json.loads((self.folder / model / "metre.json").read_text())
        if "rule" in stated:
            check_schema("metre", stated)
            self.assertEqual(self.metre_of(file), {key: stated[key] for key in ("units", "rule")})
        self.assertEqual(self.metre_of(file)["units"], units)
        self.assertIn(rule, self.metre_of(file)["rule"])
        for name in PATHS:
            path = json.loads((self.folder / model / f"paths/{name}.json").read_text())
            check_schema("trajectory", path)
            if rule.startswith("stated"):
                continue  # those of the model that was copied
            self.assertEqual(path["metre"], units, name)
            self.assertAlmostEqual(path["ipd"] / (20 if name == "wide_eyes" else 1), 0.064 * units, delta=1e-12 * units)
        made = json.loads(self.gsc("sample", "paths", file, "-o", f"{model}_paths", "-w", "--format", "json").stdout)
        self.assertEqual((made["metre"], made["metre_rule"]), (units, self.metre_of(file)["rule"]))
        for path in (self.folder / f"{model}_paths").iterdir():
            self.assertEqual(json.loads(path.read_text())["metre"], units, path.name)
        # the pictures of both eyes, by either unit, by default and as the path says
        one = {"frames": json.loads((self.folder / model / "paths/aerial.json").read_text())["frames"][:1],
               "schema": "gsc.trajectory/1"}
        pictures = set()
        for ipd, options in ((None, ("--ipd", "64mm")), (None, ("--ipd", f"{0.064 * units!r}")), (None, ()),
                             (0.064 * units, ())):
            (self.folder / "one.json").write_text(json.dumps({**one, **({"ipd": ipd} if ipd else {})}))
            run = subprocess.run([PLAY, file, "--cameras", "one.json", "--eyes", "2", "--size", "96x64", "--backend", "cpu",
                                  "--out", "-", "--stream", "rgb48", "-q", *options], cwd=self.folder, capture_output=True,
                                 check=True)
            pictures.add(run.stdout)
        self.assertEqual(len(pictures), 1, model)
        left_and_right = next(iter(pictures))
        rows = [left_and_right[i:i + 1152] for i in range(0, len(left_and_right), 1152)]
        self.assertNotEqual([row[:576] for row in rows], [row[576:] for row in rows])

    def test_samples_are_made_in_metres(self) -> None:
        for model in ("city", "octree", "street", "room"):
            with self.subTest(model):
                self.check_model(model, 1, "the scene was made in metres")

    def test_a_city_of_tiles_has_its_sources_metre(self) -> None:
        derived = self.metre_of(self.converted("trained"))
        self.assertIn("seen from the air", derived["rule"])
        self.assertGreater(abs(derived["units"] - 1), 0.1)  # or nothing below is told apart
        for model, units, rule in (("city_tiles", 1, "the scene was made in metres"),
                                   ("octree_tiles", 1, "the scene was made in metres"),
                                   ("trained_tiles", derived["units"], derived["rule"]),
                                   ("tiles_of_tiles", derived["units"], derived["rule"]),
                                   ("surveyed_tiles", 0.33, "metre.json")):
            with self.subTest(model):
                self.check_model(model, units, rule)
                self.assertEqual(self.metre_of(f"{model}.gsc")["rule"].count("of the model that is repeated"), 1)

    def test_somebody_states_it(self) -> None:
        self.check_model("surveyed", 0.33, "stated in metre.json")
        shutil.copytree(self.folder / "trained", self.folder / "data_set")
        (self.folder / "scene").mkdir()
        (self.folder / "scene/metre.json").write_text('{"schema": "gsc.metre/1", "units": 2.5, "rule": "a door is 2 m"}')
        self.gsc("convert", "data_set", "--scene-dir", "scene", "-o", "data_set.gsc", "-q")
        self.assertEqual(self.metre_of("data_set.gsc"), {"units": 2.5, "rule": "a door is 2 m"})
        for text, found in (("", "no file of a metre"), ("{}", "no file of a metre"), ("[1]", "no file of a metre"),
                            ('{"schema": "gsc.metre/2", "units": 1}', "no file of a metre"),
                            ('{"schema": 1, "units": 1}', "no file of a metre"),
                            ('{"schema": "gsc.metre/1"}', "no length"), ('{"schema": "gsc.metre/1", "units": 0}', "no length"),
                            ('{"schema": "gsc.metre/1", "units": -2}', "no length"),
                            ('{"schema": "gsc.metre/1", "units": 1e300}', "no length"),
                            ('{"schema": "gsc.metre/1", "units": "1"}', "no length"),
                            ('{"schema": "gsc.metre/1", "units": 1, "rule": 3}', "no text"), ("\xff", "no file of a metre"),
                            ('{"schema": "gsc.metre/1", "units": 1, "units": 2}', '"units"'),
                            ('{"schema": "gsc.metre/1", "units": 1, "rule": "a\\nb"}', "control character"),
                            ('{"schema": "gsc.metre/1", "units": 1, "rule": "a\\u001b[2J"}', "control character"),
                            ('{"schema": "gsc.metre/1", "units": 1, "rule": "\\u0085"}', "control character"),
                            ('{"schema": "gsc.metre/1", "units": 1, "rule": "\\u007f"}', "control character")):
            with self.subTest(text):
                (self.folder / "data_set/metre.json").write_bytes(text.encode("latin1"))
                run = self.gsc("convert", "data_set", "-o", "refused.gsc", "-q", code=3)
                self.assertRegex(run.stderr, f"error: .*metre.json: .*{found}.*, expected .*; ")

    def test_what_is_made_of_a_file_keeps_it(self) -> None:
        for model in ("city", "trained"):
            with self.subTest(model):
                wanted = self.metre_of(self.converted(model))
                for end, box in (("a", "-1000,-1000,-1000,3,1000,1000"), ("b", "3,-1000,-1000,1000,1000,1000")):
                    self.gsc("bake", f"{model}.gsc", "--crop", box, "-o", f"{model}_{end}.gsc", "-q")  # anchors of one side
                    self.assertEqual(self.metre_of(f"{model}_{end}.gsc"), wanted)
                self.gsc("bake", f"{model}_a.gsc", f"{model}_b.gsc", "-o", f"{model}_joined.gsc", "-q")
                self.assertEqual(self.metre_of(f"{model}_joined.gsc"), wanted)
                self.gsc("bake", f"{model}.gsc", "--target-psnr", 30, "--most-pixels", 1000, "--backend", "cpu", "-o",
                         f"{model}_baked.gsc", "-q")
                self.assertEqual(self.metre_of(f"{model}_baked.gsc"), wanted)
                self.gsc("bake", model, "-o", f"{model}_direct.gsc", "--most-pixels", 1000, "--backend", "cpu", "-q")
                self.assertEqual(self.metre_of(f"{model}_direct.gsc"), wanted)
                self.gsc("archive", f"{model}_baked.gsc", "-o", f"{model}_packed.gsc", "-q")
                self.assertEqual(self.metre_of(f"{model}_packed.gsc"), wanted)
                self.gsc("archive", "-x", f"{model}_packed.gsc", "-o", f"{model}_back.gsc", "-q")
                self.assertEqual(self.metre_of(f"{model}_back.gsc"), wanted)

    @unittest.skipIf(window_case.missing(), window_case.missing())
    def test_window(self) -> None:
        display = window_case.Display(self.folder / "display")
        self.addCleanup(display.close)
        for model in ("room", "trained_tiles"):
            with self.subTest(model):
                units = self.metre_of(self.converted(model))["units"]
                folder = self.folder / f"window_{model}"
                folder.mkdir()
                window = window_case.Window(display, folder, [PLAY, "window", f"../{model}.gsc", "--size", "64x48", "--eyes", 2,
                                                              "--backend", "cpu"])
                self.addCleanup(window.kill)
                window.key("r")
                window.hold("w", poses=4)
                start = len(window.lines())
                window.display.xdo("key", "r")
                window.line(lambda line: line["wrote"], start)
                self.assertEqual(window.close(), 0, window.said())
                path = json.loads((folder / "path-0001.json").read_text())
                self.assertEqual(path["metre"], units)
                self.assertAlmostEqual(path["ipd"], 0.064 * units, delta=1e-6 * units)

    @unittest.skipIf(MANIFEST is None or xr_case.missing(), "no fake headset here")
    def test_headset(self) -> None:
        for model in ("room", "trained_tiles"):
            with self.subTest(model):
                units = self.metre_of(self.converted(model))["units"]
                folder = self.folder / f"headset_{model}"
                folder.mkdir()
                settings = folder / "settings.json"
                settings.write_text(json.dumps({"views": xr_case.canted(96, 88), "head": xr_case.moving_head(1),
                                                "log": str(folder / "fake.jsonl"), "events": [{"frame": 5, "do": "exit"}]}))
                run = subprocess.run([PLAY, "xr", f"../{model}.gsc", "--backend", xr_case.BACKEND, "--xr-sync", "--start",
                                      "camera", "--log", "log.jsonl", "-w"], cwd=folder, capture_output=True, text=True, check=False, timeout=600,
                                     env=xr_case.environment(MANIFEST, settings))
                self.assertEqual(run.returncode, 0, run.stderr)
                log = [json.loads(line) for line in (folder / "log.jsonl").read_text().splitlines()]
                [place] = [line["place"] for line in log if line["place"]]
                self.assertTrue(math.isclose(place["scale"], units, rel_tol=1e-12), (place, units))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[5:]])
