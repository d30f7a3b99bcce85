#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Gain of several devices over one: rate, latency, loss of mode auto, and how fast the elastic loop answers.

usage: bench_devices.py GSC_PLAY MODEL.gsc CAMERAS.json [--devices cuda:0,cuda:1] [--zoom-out CAMERAS.json
       [--keep FOLDER]] [--out FILE.json]

Every configuration runs once in each round, one after the other, so that a slow minute touches all; what is told is the
median over the rounds. Two eyes. Latency is with one frame in flight, rate with three for each device. The zoom-out goes
there and back and then stays where it began, so that a device which is not needed any more is given back.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

WINDOW = 0.1  # seconds: how soon after a start the rate has to be there, and what it is taken over
REST = 2.5  # seconds at the first pose after the way back: a device stops when a second has shown that it is not needed


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("play", "model", "cameras"):
        parser.add_argument(name)
    parser.add_argument("--devices", default="cuda:0,cuda:1")
    parser.add_argument("--size", default="2048x2048")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--frames", type=int, default=160)
    parser.add_argument("--tier", default="fast")
    parser.add_argument("--ipd", help="distance of the eyes, where the cameras state none")
    parser.add_argument("--zoom-out")
    parser.add_argument("--min-fps", type=float, default=90)
    parser.add_argument("--rate", type=float, default=120)
    parser.add_argument("--keep", help="folder for the trace of the zoom-out, which gsc chart draws")
    parser.add_argument("--out")
    args = parser.parse_args()
    if args.keep and not args.zoom_out:
        parser.error("--keep: without --zoom-out there is no trace; leave it out")
    return args


def view(args: argparse.Namespace, cameras: str) -> list:
    ipd = ["--ipd", args.ipd] if args.ipd else []
    return ["--cameras", cameras, "--eyes", 2, *ipd, "--size", args.size, "--fov", 90, "--tier", args.tier, "--progress", "none"]


def run(*command: object) -> str:
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: exit code {done.returncode}\n{done.stderr}")
    return done.stdout


def configurations(devices: list[str]) -> dict:
    """Name: options of gsc-play bench, frames in flight, frames before those that count."""
    all_of, many = ["--devices", ",".join(devices)], 3 * len(devices)
    return {
        "one, latency": (["--devices", devices[0]], 1, 40),
        "one, rate": (["--devices", devices[0]], 3, 40),
        "frame, rate": ([*all_of, "--mode", "frame"], many, 40),
        "eye, latency": ([*all_of, "--mode", "eye"], 1, 40),
        "split, latency": ([*all_of, "--mode", "split"], 1, 80),  # bands are learned
        "frame, latency": ([*all_of, "--mode", "frame"], 1, 40),
        "auto, latency": ([*all_of, "--mode", "auto"], 1, 300),  # so many it tries at most
        "auto, rate": ([*all_of, "--mode", "auto"], many, 300),
        "eye, rate": ([*all_of, "--mode", "eye"], many, 40),
        "split, rate": ([*all_of, "--mode", "split"], many, 80),
    }


def measure(args: argparse.Namespace, options: list, in_flight: int, warmup: int) -> dict:
    report = json.loads(run(args.play, "bench", args.model, *view(args, args.cameras), *options, "--frames-in-flight", in_flight,
                            "--warmup", warmup, "--measure", args.frames, "--format", "json"))
    wall, workers = report["ms"]["wall"], report.get("service", {})
    return {"mean": wall["mean"], "median": wall["median"], "p99": wall["p99"], "device": report["device"]["name"],
            "cause": workers.get("cause")}


def bench(args: argparse.Namespace, devices: list[str]) -> dict:
    rounds = {name: [] for name in configurations(devices)}
    for _ in range(args.rounds):
        for name, (options, in_flight, warmup) in configurations(devices).items():
            rounds[name].append(measure(args, options, in_flight, warmup))
    found = {}
    for name, runs in rounds.items():
        found[name] = {key: statistics.median(r[key] for r in runs) for key in ("mean", "median", "p99")}
        found[name]["cause"] = runs[-1]["cause"]
    print(f"{args.model}, {args.cameras}, {args.tier}, two eyes of {args.size}, {len(devices)} x {rounds['one, rate'][0]['device']}")
    print(f"{'':<16}{'mean ms':>10}{'median':>10}{'p99':>10}{'of one':>10}{'p99 of one':>12}")
    for name, ms in found.items():
        one = found["one, " + name.split(", ")[1]]
        print(f"{name:<16}{ms['mean']:>10.3f}{ms['median']:>10.3f}{ms['p99']:>10.3f}{ms['mean'] / one['mean']:>10.3f}"
              f"{ms['p99'] / one['p99']:>12.3f}")
    for what in ("latency", "rate"):
        best = min((found[n]["mean"], n) for n in found if n.endswith(what) and not n.startswith("auto"))
        auto = found[f"auto, {what}"]
        print(f"auto, {what}: {auto['mean'] - best[0]:+.3f} ms ({100 * (auto['mean'] / best[0] - 1):+.1f} %) beside {best[1]}: "
              f"{auto['cause']}")
    return found


def there_and_back(cameras: str, rate: float, path: pathlib.Path) -> pathlib.Path:
    way = json.loads(pathlib.Path(cameras).read_text())
    frames = way["frames"]
    way["frames"] = frames + frames[::-1] + [frames[0]] * round(REST * rate)
    path.write_text(json.dumps(way))
    return path


def zoom_out(args: argparse.Namespace, devices: list[str], folder: pathlib.Path) -> dict:
    """Wherever all devices together can draw 5 % more than --min-fps, for WINDOW seconds: are so many poses shown there?
    Poses sooner than WINDOW after a worker's start do not count."""
    seen = view(args, str(there_and_back(args.zoom_out, args.rate, folder / "there_and_back.json")))
    run(args.play, args.model, *seen, "--devices", devices[0], "--stats", folder / "one.jsonl", "-w")
    one = [json.loads(line)["ms"]["total"] for line in (folder / "one.jsonl").read_text().splitlines()]
    run(args.play, "live", args.model, *seen, "--devices", ",".join(devices), "--mode", "frame", "--rate", args.rate, "--min-fps",
        args.min_fps, "--max-fps", args.rate, "--trace", folder / "trace.json", "-w")
    trace = json.loads((folder / "trace.json").read_text())
    poses = sorted(trace["poses"], key=lambda pose: pose["id"])  # they are listed as they end
    many = max(1, round(WINDOW * args.rate))
    starts = [event["time"] for event in trace["events"] if event["kind"] == "start"]
    able = held = 0
    for i in range(len(poses) - many + 1):
        window = poses[i:i + many]
        slowest = max(one[(pose["id"] - 1) % len(one)] for pose in window)
        if len(devices) * 1000 / slowest <= 1.05 * args.min_fps:
            continue
        if any(at - WINDOW <= window[0]["submitted"] < at + WINDOW for at in starts):
            continue
        able += 1
        held += sum(pose["end"] == "shown" for pose in window) * args.rate / many >= args.min_fps
    steps = [(event["time"], event["kind"], event.get("cause")) for event in trace["events"] if event["kind"] in ("start", "stop")]
    print(f"zoom-out at {args.rate:g} poses a second: {held} of {able} stretches of {WINDOW:g} s where {len(devices)} devices can "
          f"draw more than {1.05 * args.min_fps:g} fps had {args.min_fps:g} fps; one frame takes {min(one):.2f} to {max(one):.2f} ms")
    for time, kind, cause in steps:
        print(f"  {time:8.3f} s {kind}: {cause}")
    return {"able": able, "held": held, "steps": steps, "rate": trace["rate"], "one_ms": one}


def main() -> None:
    args = arguments()
    devices = args.devices.split(",")
    found = {"bench": bench(args, devices)}
    if args.zoom_out:
        with tempfile.TemporaryDirectory() as folder:
            kept = pathlib.Path(args.keep or folder)
            kept.mkdir(parents=True, exist_ok=True)
            found["zoom_out"] = zoom_out(args, devices, kept)
    if args.out:
        pathlib.Path(args.out).write_text(json.dumps(found, indent=1) + "\n")


main()
