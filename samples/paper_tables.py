#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints what samples/paper.sh measured beside the figures of the GS-Cache paper: paper_tables.py OUT.

The paper: one or two RTX 4090, two eyes of 2K, frames per second for both eyes; what it does not say, or what was not
read there, is a dash. Its PSNR is the mean of the frames', which one bad frame hardly moves: pooled and worst stand beside
ours."""

import json
import math
import pathlib
import sys

# scene and kind of model: method, frames per second, 99 % of them, ms of decode and raster, GiB
PAPER = {
    ("city", "scaffold-gs"): [("trainers' code", 27.24, None, 28.89, 10.63, None), ("GS-Cache", 55.81, None, 11.34, 5.42, 8.10)],
    ("city", "octree-gs"): [("trainers' code", 18.04, None, 18.49, 14.10, None), ("GS-Cache", 44.55, None, 6.39, 4.35, 8.59)],
    ("street", "scaffold-gs"): [("trainers' code", 43.91, None, 8.67, 13.38, None), ("GS-Cache", 80.24, 14.8, 1.61, 9.88, 2.12)],
    ("street", "octree-gs"): [("trainers' code", 54.26, None, 8.62, 6.63, None), ("GS-Cache", 113.97, None, 2.25, 4.37, 2.07)],
}
PAPER_ELASTIC = {  # on two GPUs
    ("city", "scaffold-gs"): (109.8, 5.57, 3.01),
    ("city", "octree-gs"): (96.5, 2.82, 2.29),
}
PAPER_GAIN = {("street", "scaffold-gs"): 1.85, ("street", "octree-gs"): 1.78}  # of the second GPU
PAPER_PSNR = (38.36, 35.38, 32.68, 35.53)  # of its four scenes
PAPER_MSE = 0.00116  # beside the first


def rows_of(path: pathlib.Path) -> list:
    return [json.loads(line) for line in path.read_text().splitlines()]


def name_of(row: dict) -> str:
    config = row["config"]
    return ("merged + " if config["stereo"] == "merged" else "") + config["policy"]


def number(value, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def line(*cells) -> None:
    print("  " + f"{cells[0]:<26}" + "".join(f"{cell:>16}" for cell in cells[1:]))


def performance(scene: str, kind: str, rows: list) -> None:
    line("", "FPS", "99 % FPS", "decode ms", "raster ms", "GiB")
    for method, fps, slow, decode, raster, memory in PAPER.get((scene, kind), []):
        line(f"paper, {method}", number(fps, 2), number(slow, 1), number(decode, 2), number(raster, 2), number(memory, 2))
    for row in rows:
        wall, stages = row["ms"]["wall"], row["ms"]["stages"]
        raster = sum(stages[stage]["mean"] for stage in ("project", "bin", "sort", "blend"))
        line(name_of(row), number(1000 / wall["mean"], 2), number(1000 / wall["p99"], 1),
             number(stages["decode"]["mean"], 2), number(raster, 2), number(row["peak_bytes"] / 2**30, 2))


def elastic(scene: str, kind: str, out: pathlib.Path) -> None:
    line("", "FPS", "99 % FPS", "decode ms", "raster ms")
    if (scene, kind) in PAPER_ELASTIC:
        fps, decode, raster = PAPER_ELASTIC[scene, kind]
        line("paper, GS-Cache, 2 GPUs", number(fps, 2), "-", number(decode, 2), number(raster, 2))
    if (scene, kind) in PAPER_GAIN:
        line("paper, GS-Cache, 2 GPUs", f"{PAPER_GAIN[scene, kind]} times one", "-", "-", "-")
    found = out / f"{scene}.elastic.json"
    if not found.exists():
        line("merged + depth, elastic", "not here")
        return
    wall = json.loads(found.read_text())["ms"]["wall"]
    line("merged + depth, elastic", number(1000 / wall["mean"], 2), number(1000 / wall["p99"], 1), "-", "-")


def lpips_of(row: dict, scene: str, out: pathlib.Path):
    """LPIPS of the pictures that samples/paper.sh has drawn; None where it was not given the weights."""
    file = out / f"{scene}.lpips.{name_of(row).replace(' + ', '_')}.json"
    return json.loads(file.read_text())["scores"]["lpips"] if file.exists() else None


def quality(scene: str, rows: list, out: pathlib.Path) -> None:
    line("against tier exact", "MSE", "PSNR mean", "pooled", "worst", "SSIM", "LPIPS")
    for row in rows:
        accuracy = row["accuracy"]
        frames = [value for value in row["per_frame"]["psnr"] if value is not None]
        psnr = accuracy["psnr"]
        decibels = [sum(frames) / len(frames) if frames else None, psnr["pooled"], psnr["min"]]
        mse = 0.0 if psnr["pooled"] is None else math.pow(10, -psnr["pooled"] / 10)
        ssim = accuracy["ssim"] and accuracy["ssim"]["mean"]
        line(name_of(row), f"{mse:.3g}", *("equal" if value is None else number(value, 2) for value in decibels),
             number(ssim, 5), number(lpips_of(row, scene, out), 5))


def shown(trace: dict, first: int, end: int) -> float:
    """Pictures a second that a viewer was shown of poses first to end - 1, which were fed in real time."""
    poses = {pose["id"]: pose for pose in trace["poses"]}
    part = [poses[number] for number in range(first + 1, end + 1) if number in poses]
    if not part:
        return 0.0
    return sum(pose["end"] == "shown" for pose in part) * trace["options"]["rate"] / len(part)


def zoom_out(rows: list, path: pathlib.Path, elastic_trace: pathlib.Path) -> None:
    """Frames per second in tenths of the path, and how far the camera has gone."""
    trajectory = json.loads(path.read_text())
    metre = trajectory.get("metre", 1)
    places = [frame["position"] for frame in trajectory["frames"]]
    count = len(rows[0]["per_frame"]["wall_ms"])
    parts = min(10, count)
    trace = json.loads(elastic_trace.read_text()) if elastic_trace.exists() else None
    line("metres away", *(name_of(row) for row in rows), *(["elastic, shown"] if trace else []))
    for part in range(parts):
        first, end = part * count // parts, (part + 1) * count // parts
        away = math.dist(places[end - 1], places[0]) / metre
        fps = [1000 * (end - first) / sum(row["per_frame"]["wall_ms"][first:end]) for row in rows]
        if trace:
            fps.append(shown(trace, first, end))
        line(f"{away:.1f}", *(number(value, 1) for value in fps))
    if trace:
        options = trace["options"]
        print(f"  elastic: {name_of(rows[-1])} on {len(options['devices'])} devices, poses at {options['rate']:g} a second, which "
              f"is the most that can be shown, at least {options['min_fps']:g} wanted; most devices at once: "
              f"{max(sample['workers'] for sample in trace['rate'])}")


def main() -> None:
    out = pathlib.Path(sys.argv[1])
    scenes = []
    for scene in ("city", "street"):
        info = json.loads((out / f"{scene}.info.json").read_text())["model"]
        rows = rows_of(out / f"{scene}.jsonl")
        main_path = rows[0]["config"]["trajectory"]
        scenes.append((scene, info["family"], rows, [row for row in rows if row["config"]["trajectory"] == main_path]))
        config, device = rows[0]["config"], rows[0]["device"]["name"]
        print(f"{scene}: {info['family']}, {info['anchors']:,} anchors, path {main_path}, {config['frames']} frames, two eyes "
              f"of {config['size'][0]}x{config['size'][1]}, {rows[0]['backend']} ({device}), tier {rows[0]['rendered_tier']}")
    print("paper: one RTX 4090 unless it says otherwise; raster: project, bin, sort and blend together")
    for title, show in (("one GPU", lambda scene, kind, rows: performance(scene, kind, rows)),
                        ("several GPUs", lambda scene, kind, rows: elastic(scene, kind, out)),
                        ("quality", lambda scene, kind, rows: quality(scene, rows, out))):
        for scene, kind, _, rows in scenes:
            print(f"\n{title}: {scene}")
            show(scene, kind, rows)
    if not any(out.glob("*.lpips.*.json")):
        print("  LPIPS is empty: set LPIPS_BACKBONE to torchvision's VGG16 (vgg16-397923af.pth) and LPIPS_HEADS to "
              "PerceptualSimilarity's weights/v0.1/vgg.pth")
    print("  paper, its four scenes: PSNR " + ", ".join(map(str, PAPER_PSNR)) + f" (means of frames), MSE {PAPER_MSE} beside "
          "the first, SSIM 0.98 to 0.99; LPIPS not at hand")
    city = [row for row in scenes[0][2] if row["config"]["trajectory"] == "zoom_out"]
    if city:
        print("\nzoom-out: city, frames per second")
        zoom_out(city, out / "city/zoom_out.json", out / "zoom_out.elastic.json")
        print("  paper: GS-Cache has twice the frames per second of CityGaussian at 500 m")


if __name__ == "__main__":
    main()
