#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A path that looks at the horizon, where the longest lists of a city are.

level_path.py PATHS OUT.json: the path `aerial` of the folder PATHS that `gsc sample` writes, at a fifth of its height above
where `walk_through` walks, looking level instead of 25 degrees down.
"""
import json
import math
import pathlib
import sys

LOWER, DOWN = 0.2, math.radians(25)


def turned(rotation):
    """About the camera's own x axis, until it looks level; columns are right, down and forward."""
    rows = []
    for right, down, forward in rotation:
        rows.append([right, math.sin(DOWN) * forward + math.cos(DOWN) * down, math.cos(DOWN) * forward - math.sin(DOWN) * down])
    return rows


def main():
    folder = pathlib.Path(sys.argv[1])
    path, walk = (json.loads((folder / f"{name}.json").read_text()) for name in ("aerial", "walk_through"))
    feet = walk["frames"][0]["position"]
    for frame in path["frames"]:
        frame["rotation"] = turned(frame["rotation"])
        down = [row[1] for row in frame["rotation"]]
        height = sum((f - p) * d for f, p, d in zip(feet, frame["position"], down))
        frame["position"] = [p + (1 - LOWER) * height * d for p, d in zip(frame["position"], down)]
        frame["name"] = frame["name"].replace("aerial", "level")
    path["name"] = "level"
    pathlib.Path(sys.argv[2]).write_text(json.dumps(path))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main()
