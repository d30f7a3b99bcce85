#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Helps samples/frontier.sh to score a model that was baked against the model that it was made from.

frontier_rows.py poses FLIGHT.json FRAMES|null EVERY
    the trajectory with every EVERY-th of its first FRAMES frames
frontier_rows.py row CITY.jsonl TIMES.jsonl SCORES.json EVERY
    the run row of the baked model: its times, and the accuracy that gsc compare-pictures found in every EVERY-th frame
"""

import json
import math
import pathlib
import sys


def last_row(path: str) -> dict:
    return json.loads(pathlib.Path(path).read_text().splitlines()[-1])


def poses(flight: str, frames: str, every: str) -> dict:
    path = json.loads(pathlib.Path(flight).read_text())
    first = path["frames"] if frames == "null" else path["frames"][:int(frames)]
    path["frames"] = first[::int(every)]
    return path


def decibels(mse: float):
    return -10 * math.log10(mse) if mse > 0 else None


def mean(values: list) -> float:
    return sum(values) / len(values)


def accuracy_of(views: list, every: int) -> tuple:
    """Accuracy over pictures named FRAME_EYE, and the decibels of the worse eye of each frame."""
    frames: dict = {}
    for view in views:
        frames.setdefault(view["name"].rpartition("_")[0], []).append(view)
    psnr = [decibels(max(eye["mse"] for eye in frames[name])) for name in sorted(frames)]
    order = sorted(range(len(psnr)), key=lambda frame: math.inf if psnr[frame] is None else psnr[frame])
    flips = [mean([eye["flip"] for eye in frames[name]]) for name in sorted(frames)]
    accuracy = {
        "scored": {"first": 0, "every": every},
        "psnr": {"pooled": decibels(mean([view["mse"] for view in views])), "p1": psnr[order[len(psnr) // 100]],
                 "min": psnr[order[0]], "min_frame": order[0] * every},
        "max_error": max(view["max_error"] for view in views),
        "over_1_255": sum(view["pixels_over_1_255"] for view in views),
        "ssim": None, "flip": {"mean": mean(flips), "max": max(flips), "frames": len(flips)}, "temporal": None,
        "motion": None, "pop": None,
    }
    return accuracy, psnr


def row(city: str, times: str, scores: str, every: str) -> dict:
    measured = last_row(times)
    views = json.loads(pathlib.Path(scores).read_text())["scores"]["views"]
    found, psnr = accuracy_of(views, int(every))
    measured["accuracy"] = {**{key: None for key in measured["accuracy"]}, **found}
    measured["per_frame"] |= {"psnr": psnr, "temporal": [None] * len(psnr)}
    held_against = {"reference_file": last_row(city)["file"]}
    return {key: value for name, part in measured.items()
            for key, value in ({name: part} | (held_against if name == "file" else {})).items()}


def main() -> int:
    tasks = {("poses", 5): poses, ("row", 6): row}
    task = tasks.get((sys.argv[1] if len(sys.argv) > 1 else "", len(sys.argv)))
    if task is None:
        print(__doc__, file=sys.stderr)
        return 1
    print(json.dumps(task(*sys.argv[2:]), separators=(",", ":")))
    return 0


if __name__ == "__main__":
    sys.exit(main())
