#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares what our reference decodes with what the trainers' own code computed.

check_intermediates.py DUMP_PROGRAM CHECKPOINTS: for every MODEL/golden/intermediates.npz in the folder (or in
GSC_CHECKPOINTS, if that is set). Every value must agree to 1e-5 (times the value where that is above 1); sets of
anchors must be equal.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

TOLERANCE = 1e-5
FLOOR = 1 / 255  # Gaussians below it can change no pixel and are not decoded


def golden_view(model: pathlib.Path, view: str, folder: str) -> tuple[pathlib.Path, int]:
    """Camera file that holds `view`, exactly where the golden cameras have it, and its appearance row."""
    for camera in json.loads((model / "golden/cameras.json").read_text()):
        if camera["image_name"] == view:
            frame = {
                "name": view,
                "width": camera["width"],
                "height": camera["height"],
                "fov_x": camera["FoVx"],
                "fov_y": camera["FoVy"],
                "rotation": camera["R_camera_to_world"],
                "translation": camera["T_world_to_camera"],
            }
            path = pathlib.Path(folder) / "trajectory.json"
            path.write_text(json.dumps({"schema": "gsc.trajectory/1", "frames": [frame]}))
            return path, camera["uid"]
    # upstream lists the held-out cameras first, and counts the appearance row within its own list
    cameras = json.loads((model / "cameras.json").read_text())
    return model / "cameras.json", [c["img_name"] for c in cameras].index(view)


class Report:
    def __init__(self) -> None:
        self.failed = False
        self.worst: dict[str, float] = {}

    def values(self, name: str, ours, theirs) -> None:
        ours, theirs = np.asarray(ours, np.float64), np.asarray(theirs, np.float64)
        if ours.shape != theirs.shape or not np.isfinite(ours).all():
            print(f"  {name}: shape {ours.shape} or values are wrong, expected {theirs.shape}")
            self.failed = True
            return
        error = np.abs(ours - theirs) / np.maximum(1, np.abs(theirs))
        self.worst[name] = max(self.worst.get(name, 0.0), float(error.max(initial=0)))

    def sets(self, name: str, ours, theirs) -> None:
        difference = np.setxor1d(ours, theirs)
        print(f"  {name}: {len(theirs)} anchors, {len(difference)} differ")
        self.failed |= len(difference) > 0

    def finish(self) -> None:
        for name, error in self.worst.items():
            print(f"  {name}: worst {error:.2e}{'' if error <= TOLERANCE else '  ABOVE ' + str(TOLERANCE)}")
            self.failed |= error > TOLERANCE


def check_model(program: str, model: pathlib.Path) -> bool:
    truth = np.load(model / "golden/intermediates.npz", allow_pickle=False)
    view = str(truth["view"])
    indices = truth["subset_anchor_indices"]
    with tempfile.TemporaryDirectory() as folder:
        cameras, row = golden_view(model, view, folder)
        run = subprocess.run(
            [program, str(model), str(cameras), view, str(row)],
            input=" ".join(map(str, indices)),
            capture_output=True,
            text=True,
            check=False,
        )
    print(f"{model.name}, view {view}, appearance row {row}:")
    if run.returncode != 0:
        print(f"  the dump failed: {run.stderr.strip()}")
        return False
    ours = json.loads(run.stdout)
    report = Report()
    report.sets("visible", np.array(ours["visible"]), truth["visible_anchor_indices"])
    if "lod_mask_packed" in truth:
        mask = np.flatnonzero(np.unpackbits(truth["lod_mask_packed"]))
        if len(mask) != int(truth["lod_mask_count"]):  # packed least significant bit first
            mask = np.flatnonzero(np.unpackbits(truth["lod_mask_packed"], bitorder="little"))
        report.sets("lod mask", np.array(ours["lod_mask"]), mask)

    anchors = ours["anchors"]
    positions = np.array([a["anchor"] for a in anchors], np.float32)
    if not np.array_equal(positions, truth["anchor"]):
        print("  anchor: positions are not bit-exact")
        report.failed = True
    report.values("ob_view", [a["view"] for a in anchors], truth["ob_view"])
    report.values("ob_dist", [[a["dist"]] for a in anchors], truth["ob_dist"])
    report.values("neural_opacity", [a["neural_opacity"] for a in anchors], truth["neural_opacity"])

    # the dump keeps opacity > 0 in anchor order, offsets within
    kept = np.argwhere(truth["selection_mask"])
    drawn = truth["gauss_opacity"][:, 0] >= FLOOR
    mine = {(i, g["k"]): g for i, a in enumerate(anchors) for g in a["gaussians"]}
    expected = [tuple(pair) for pair in kept[drawn]]
    if set(mine) != set(expected):
        print(f"  gaussians: {len(mine)} decoded, {len(expected)} expected, other ones")
        report.failed = True
    else:
        for name in ("xyz", "color", "opacity", "scaling", "rot"):
            report.values(name, [mine[pair][name] for pair in expected], truth["gauss_" + name][drawn])
        radii = np.array([mine[pair]["radius"] for pair in expected])
        off = np.abs(radii - truth["gauss_radii"][drawn])
        print(f"  radii: {len(radii)} compared, {np.count_nonzero(off)} differ, worst {off.max(initial=0)}")
        # a radius is a ceil(): one step where the value lies on an integer
        report.failed |= bool(np.count_nonzero(off) > 2 or off.max(initial=0) > 1)
    report.finish()
    return not report.failed


def main() -> int:
    program, root = sys.argv[1], pathlib.Path(os.environ.get("GSC_CHECKPOINTS", sys.argv[2]))
    models = sorted(path.parent.parent for path in root.glob("*/golden/intermediates.npz"))
    if not models:
        print(f"skipped: no trained models in {root}")
        return 0
    results = [check_model(program, model) for model in models]
    print(f"{sum(results)} of {len(results)} models agree to {TOLERANCE}")
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
