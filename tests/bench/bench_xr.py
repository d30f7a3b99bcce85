#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How fresh a headset's pictures are, and what they cost: gsc-play xr on the fake OpenXR runtime, on the real clock at 90 Hz, two
asymmetric eyes of 2064x2208. A line for each path: share of refreshes whose picture is at most 2 refreshes old, ages, milliseconds
of the device, of the way from pose to picture, between the time that eyes were located for and the one they are seen at, and of the
thread.

bench_xr.py GSC_PLAY CITY.gsc PATHS RUNTIME_MANIFEST [--paths aerial,turn] [--lens] [--from 60] [options of gsc-play xr]

--from: counts from the refresh on that shows the 60th picture.
--lens: the runtime says that lenses show an ellipse which touches the sides of the picture, and hide what lies outside of it.

PATHS: the folder `paths` that `gsc sample replicate` makes beside a city. `turn` is its aerial.json's first camera while the head turns
60 degrees either way, at up to 72 degrees a second; `dive` goes from there straight on, in 400 poses, to a height of eyes below the
ground of walk_through.json and so through it. flight, stroll and look_around move as people do and are played at their own pace;
the poses of the other paths are farther apart, and are spread over the SECONDS below.
"""

import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

SIZE = (2064, 2208)
SECONDS = {"aerial": 9.7, "turn": 10, "dive": 9, "walk_through": 7.5, "zoom_out": 8}


def about_y(degrees: float) -> list[float]:
    return [0, math.sin(math.radians(degrees) / 2), 0, math.cos(math.radians(degrees) / 2)]


def position(frame: dict) -> list[float]:
    if "position" in frame:
        return frame["position"]
    rotation, moved = frame["rotation"], frame["translation"]
    return [-sum(rotation[i][j] * moved[j] for j in range(3)) for i in range(3)]


def dive(start: dict, walker: dict) -> dict:
    down, forward = [row[1] for row in walker["rotation"]], [row[2] for row in start["rotation"]]
    along = lambda a, b: sum(x * y for x, y in zip(a, b))  # noqa: E731
    begin = position(start)
    length = 1.15 * (along(position(walker), down) - along(begin, down)) / along(forward, down)
    frame = {key: value for key, value in start.items() if key not in ("position", "translation", "name", "time")}
    return {"schema": "gsc.trajectory/1", "frames": [
        {**frame, "position": [begin[k] + forward[k] * length * i / 399 for k in range(3)]} for i in range(400)]}


def outside_of_ellipse(fov: list[float]) -> dict:
    """Triangles of XR_KHR_visibility_mask, at depth 1: a ring from the ellipse out beyond the picture."""
    left, right, up, down = (math.tan(math.radians(angle)) for angle in fov)
    around = [(math.cos(math.tau * i / 96), math.sin(math.tau * i / 96)) for i in range(96)]
    at = lambda size, c, s: [(left + right + size * c * (right - left)) / 2, (up + down + size * s * (up - down)) / 2]  # noqa: E731
    indices = []
    for i in range(96):
        a, b = 2 * i, 2 * ((i + 1) % 96)
        indices += [a, a + 1, b + 1, a, b + 1, b]
    return {"vertices": [at(size, c, s) for c, s in around for size in (1, 2)], "indices": indices}


def percentile(values: list[float], share: float) -> float:
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def run(play: str, city: str, manifest: str, folder: pathlib.Path, name: str, paths: pathlib.Path, lens: bool, begin: int,
        options: list[str]) -> None:
    settings = {"clock": "real", "hz": 90, "hash": False, "head": [{"t": 0}], "views": [
        {"fov": [-54, 40, 44, -55], "position": [-0.032, 0, 0], "rotation": about_y(2), "width": SIZE[0], "height": SIZE[1]},
        {"fov": [-40, 54, 44, -55], "position": [0.032, 0, 0], "rotation": about_y(-2), "width": SIZE[0], "height": SIZE[1]}]}
    if lens:
        settings["visibility_mask"] = {str(i): outside_of_ellipse(view["fov"]) for i, view in enumerate(settings["views"])}
    cameras = paths / f"{name}.json"
    if name == "turn":
        cameras = paths / "aerial.json"
        settings["head"] = [{"t": 0.05 * i, "rotation": about_y(60 * math.sin(0.06 * i))} for i in range(400)]
    elif name == "dive":
        cameras = folder / "dive.json"
        first = lambda file: json.loads((paths / file).read_text())["frames"][0]  # noqa: E731
        cameras.write_text(json.dumps(dive(first("aerial.json"), first("walk_through.json"))))
    path = json.loads(cameras.read_text())
    frames = len(path["frames"])
    seconds = SECONDS[name] if name in SECONDS else frames / path["fps"]
    way = ["--frames", "0:1", "--start", "camera"] if name == "turn" else ["--ride", "--ride-fps", f"{frames / seconds:.3f}"]
    (folder / "settings.json").write_text(json.dumps(settings))
    log = folder / f"{name}.jsonl"
    subprocess.run([play, "xr", city, "--cameras", str(cameras), *way, "--seconds", str(seconds), "--log", str(log), "-w", "-q", *options],
                   check=True, stdout=subprocess.DEVNULL,
                   env={**os.environ, "XR_RUNTIME_JSON": manifest, "GSC_FAKE_XR": str(folder / "settings.json")})
    lines = [json.loads(line) for line in log.read_text().splitlines()]
    counted = lines[[i for i, line in enumerate(lines) if line["fresh"]][begin - 1]:] if begin else lines
    shown = [line for line in counted if line["age"] is not None]
    fresh = [line for line in shown if line["fresh"]]
    of = lambda key: [line[key] for line in fresh]  # noqa: E731
    median, late = percentile(of("draw_ms"), 0.5), percentile(of("draw_ms"), 0.99)
    ages = [sum(line["age"] == age for line in shown) for age in range(max(line["age"] for line in shown) + 1)]
    off = [abs(line["off_ms"]) for line in shown]
    pixels = [value for value in of("fovea_pixels") if value]
    print(f"{name}: {100 * sum(ages[:3]) / len(shown):.1f} % of {len(shown)} refreshes at most 2 old, ages from 0 {ages}, "
          f"{sum(line['missed'] for line in counted)} missed; device {median:.2f} ms, p99 {late:.2f}, {late / median:.2f} times; pose to "
          f"picture {percentile(of('latency_ms'), 0.5):.1f}, p99 {percentile(of('latency_ms'), 0.99):.1f}; seen "
          f"{percentile(off, 0.5):.1f}, mean {sum(off) / len(off):.1f}, p99 {percentile(off, 0.99):.1f} ms off the time of their eyes; thread "
          f"{percentile([line['busy_ms'] for line in shown], 0.5):.2f}, p99 {percentile([line['busy_ms'] for line in shown], 0.99):.2f}; "
          f"copy {percentile(of('copy_ms'), 0.5):.3f}" + (f"; fovea pixels {min(pixels):.2f} to {max(pixels):.2f}" if pixels else ""), flush=True)


def main() -> None:
    play, city, paths, manifest, *options = sys.argv[1:]
    names = ["aerial", "turn"]
    if options[:1] == ["--paths"]:
        names, options = options[1].split(","), options[2:]
    lens = options[:1] == ["--lens"]
    options = options[lens:]
    begin = 0
    if options[:1] == ["--from"]:
        begin, options = int(options[1]), options[2:]
    with tempfile.TemporaryDirectory(prefix="gsc_bench_xr_") as folder:
        for name in names:
            run(play, city, str(pathlib.Path(manifest).resolve()), pathlib.Path(folder), name, pathlib.Path(paths), lens, begin, options)


if __name__ == "__main__":
    if len(sys.argv) < 5:
        sys.exit(__doc__)
    main()
