#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Our decode stage against PyTorch on the CPU: the same three networks on the same visible anchors of one view.

PyTorch evaluates what upstream evaluates: one concatenation and three networks. Ours also gathers the anchors, makes
the directions, positions, scales and rotations and packs the Gaussians. The two take turns in one run, both with
THREADS threads. Needs Debian's python3-torch and python3-numpy, and a model without feature bank, appearance,
distance and level inputs (fox_octree).

  bench_decode_torch.py CHECKPOINT_DIR FILE.gsc --exe build/tests/bench_decode_model [--camera 0] [--threads 2]
"""
import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np
import torch


def read_dump(path):
    raw = open(path, "rb").read()
    n, features, offsets = np.frombuffer(raw, "<u4", 3)
    values = np.frombuffer(raw, "<f4", offset=12)
    feature = values[: n * features].reshape(n, features)
    direction = values[n * features : n * (features + 3)].reshape(n, 3)
    opacity = values[n * (features + 3) :].reshape(n, offsets)
    return feature, direction, opacity


def load_networks(checkpoint):
    folder = os.path.join(checkpoint, "point_cloud")
    iterations = sorted(os.listdir(folder), key=lambda name: int(name.split("_")[-1]))
    folder = os.path.join(folder, iterations[-1])
    return [torch.jit.load(os.path.join(folder, name), map_location="cpu").eval()
            for name in ("opacity_mlp.pt", "cov_mlp.pt", "color_mlp.pt")]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkpoint")
    parser.add_argument("gsc")
    parser.add_argument("--exe", required=True)
    parser.add_argument("--camera", type=int, default=0)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=60)
    parser.add_argument("--bar", type=float, default=5.0)
    args = parser.parse_args()

    torch.set_num_threads(args.threads)
    networks = load_networks(args.checkpoint)
    with tempfile.TemporaryDirectory() as scratch:
        dump = os.path.join(scratch, "anchors.bin")
        ours = subprocess.Popen([args.exe, args.gsc, str(args.camera), str(args.threads), dump], stdin=subprocess.PIPE,
                                stdout=subprocess.PIPE, text=True)
        if ours.stdout.readline().strip() != "ready":
            sys.exit("bench_decode_model did not start, expected a .gsc and a camera it can open")
        feature, direction, opacity = read_dump(dump)
    feature, direction = torch.from_numpy(feature.copy()), torch.from_numpy(direction.copy())

    def run_torch():
        start = time.perf_counter()
        with torch.no_grad():
            joined = torch.cat([feature, direction], dim=1)
            outputs = [network(joined) for network in networks]
        return 1e3 * (time.perf_counter() - start), outputs

    def run_ours():
        ours.stdin.write("run\n")
        ours.stdin.flush()
        return float(ours.stdout.readline())

    # a benchmark of something wrong is worth nothing
    expected = run_torch()[1][0].numpy()
    worst = float(np.abs(np.where(expected >= 1 / 255, expected, 0) - opacity)[np.abs(expected - 1 / 255) > 1e-5].max())
    if not worst < 1e-5:
        sys.exit(f"opacities differ by {worst:.2g} from PyTorch's, expected less than 1e-5")
    for _ in range(5):
        run_torch()
        run_ours()
    theirs_ms, ours_ms = [], []
    for _ in range(args.rounds):
        theirs_ms.append(run_torch()[0])
        ours_ms.append(run_ours())
    ours.stdin.close()
    ours.wait()
    report = {
        "anchors": len(feature), "threads": args.threads, "rounds": args.rounds, "torch": torch.__version__,
        "torch_ms": {"min": min(theirs_ms), "median": statistics.median(theirs_ms)},
        "gsc_ms": {"min": min(ours_ms), "median": statistics.median(ours_ms)},
        "ratio": {"min": min(theirs_ms) / min(ours_ms),
                  "median": statistics.median(theirs_ms) / statistics.median(ours_ms)},
        "bar": args.bar, "worst_opacity_difference": worst,
    }
    print(json.dumps(report, indent=2))
    return 0 if report["ratio"]["median"] >= args.bar else 8


if __name__ == "__main__":
    sys.exit(main())
