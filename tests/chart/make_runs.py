#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Lines of gsc.run/2 with the shape of real ones: frame times with spikes, errors that grow with what is reused.

usage: make_runs.py [--trajectories N] [--runs N] [--frames N] [--eyes 1|2] [--label TEXT] [--seed N] > runs.jsonl

Same options, same lines. Not measurements: only the shape is real.
"""
import argparse
import json
import math
import random

TRAJECTORIES = ["walk", "orbit", "fast turn", "teleport", "zoom out", "level swing", "still", "aerial", "walk through", "far eyes"]


def spread(values):
    ordered = sorted(values)

    def rank(share):
        return ordered[max(0, math.ceil(share * len(ordered)) - 1)]

    return {"mean": sum(values) / len(values), "median": rank(0.5), "p95": rank(0.95), "p99": rank(0.99), "max": ordered[-1]}


def configurations(count):
    """Policies as a sweep would try them; more of them where more are asked for."""
    plain = {"max_depth": None, "guidance": None, "bound": None, "decode_budget": None}
    found = []
    for tier in ("fast", "exact"):
        found.append({**plain, "policy": "none", "tier": tier, "reuse": 0.0})
    for depth in (2, 5, 10):
        found.append({**plain, "policy": "depth", "max_depth": depth, "guidance": "linear", "tier": "fast", "reuse": 1 - 1 / depth})
    for bound in (0.25, 0.5, 1.0, 2.0, 4.0):
        found.append({**plain, "policy": "error", "bound": bound, "tier": "fast", "reuse": bound / (bound + 0.2)})
    found.append({**plain, "policy": "error", "bound": 1.0, "decode_budget": 20000, "tier": "fast", "reuse": 0.9})
    found.append({**plain, "policy": "depth", "max_depth": 10, "guidance": "staged", "tier": "fast", "reuse": 0.88})
    found.append({**plain, "policy": "depth", "max_depth": 10, "guidance": "exponential", "tier": "fast", "reuse": 0.86})
    step = 1
    while len(found) < count:
        found.append({**plain, "policy": "error", "bound": round(0.1 * step, 2), "tier": ("fast", "exact")[step % 3 == 0],
                      "reuse": 0.1 * step / (0.1 * step + 0.3)})
        step += 1
    return found[:count]


def row(trajectory, config, frames, eyes, label, rng):
    anchors, speed = 26056, 1 + 0.3 * TRAJECTORIES.index(trajectory)
    exact = config["tier"] == "exact" and config["policy"] == "none"
    base = {"exact": 9.5, "fast": 6.2}[config["tier"]] * eyes * 0.6
    noise = 1 / 255 * (0.02 if config["tier"] == "fast" else 0.002)
    wall, psnr, temporal, decoded = [], [], [], []
    visible = 9000 * eyes
    for frame in range(frames):
        motion = 0.5 + 0.5 * math.sin(2 * math.pi * frame / 60 * speed) ** 2
        jump = trajectory == "teleport" and frame % 40 == 39 or trajectory == "fast turn" and frame % 60 in (30, 31, 32)
        reuse = config["reuse"] * (0.1 if jump else 1 - 0.25 * motion) * (frame > 0)
        decoded.append(round(visible * (1 - reuse) * (0.9 + 0.2 * motion)))
        saved = 0.45 * base * reuse
        wall.append(round((base - saved) * rng.lognormvariate(0, 0.03) * (1.35 if rng.random() < 0.02 else 1), 4))
        rms = noise + config["reuse"] ** 2 / 255 * 0.9 * (config["bound"] or 0.3 * (config["max_depth"] or 0)) * motion * (1.6 if jump else 1) * rng.uniform(0.7, 1.3) * speed ** 0.5
        psnr.append(None if exact else round(-20 * math.log10(rms), 3))
        temporal.append(None if frame == 0 else 0.0 if exact else round(rms * rng.uniform(0.5, 1.2), 7))
    pooled = None if exact else -10 * math.log10(sum(10 ** (-value / 10) for value in psnr) / frames)
    known = [value for value in temporal if value is not None] or [0.0]
    reused = [visible - min(value, visible) for value in decoded]
    cache = 0 if config["policy"] == "none" else visible * 10 * 48 + (1 << 20)
    settings = {
        "id": f"{rng.getrandbits(64):016x}", "trajectory": trajectory, "cameras": f"paths/{trajectory}.json", "shots": frames,
        "frames": frames, "warmup": 5, "cold": True, "frames_in_flight": 1, **{key: config[key] for key in ("policy", "max_depth", "guidance", "bound", "decode_budget")},
        "cache_budget": None, "tier": config["tier"], "lod_bias": 0, "lod_fade": 0, "lod_hysteresis": 0, "detail": 0, "fovea_pixels": None, "target_ms": None,
        "stereo": "exact", "eyes": eyes, "ipd": 0.064 if eyes == 2 else None, "size": [640, 480], "fov_degrees": None, "near": None,
        "appearance": None, "threads": 0, "vram_budget": None}
    stages = {name: spread([value * share for value in wall]) for name, share in
              (("select", 0.05), ("decode", 0.4), ("project", 0.1), ("bin", 0.1), ("sort", 0.05), ("blend", 0.3))}
    return {
        "schema": "gsc.run/2", "tool": {"name": "gsc-play", "version": "0.1.0", "commit": "0a1b2c3d4e5f"}, "label": label,
        "file": {"path": "models/fox.gsc", "bytes": 4300800, "anchors": anchors}, "backend": "cpu", "reference": "cpu", "rendered_tier": config["tier"],
        "device": {"name": "AMD EPYC 9555", "driver": None, "memory_bytes": 16 << 30, "processors": 2, "clock_mhz": None, "memory_clock_mhz": None, "context_bytes": None},
        "config": settings,
        "ms": {"open": None, "load": None, "wall": spread(wall), "device": spread([value * 0.98 for value in wall]), "stages": stages},
        "accuracy": {
            "scored": {"first": 0, "every": 1},
            "psnr": {"pooled": pooled, "p1": None if exact else sorted(psnr)[0], "min": None if exact else min(psnr),
                     "min_frame": 0 if exact else psnr.index(min(psnr))},
            "max_error": 0.0 if exact else 12 * 10 ** (-min(psnr) / 20), "over_1_255": 0 if exact else rng.randrange(2000),
            "ssim": {"mean": 1.0 if exact else 0.999, "min": 1.0 if exact else 0.99, "frames": min(frames, 12)},
            "flip": {"mean": 0.0 if exact else 0.001, "max": 0.0 if exact else 0.004, "frames": min(frames, 12)},
            "temporal": {"rms": spread(known)["mean"], "p50": spread(known)["median"], "p99": spread(known)["p99"], "max": max(known),
                         "max_frame": temporal.index(max(known)) if frames > 1 else 0},
            "motion": None, "pop": None, "error_pop": None},
        "reuse": {
            "decoded_per_frame": spread(decoded), "reused_per_frame": spread(reused),
            "hit_rate": sum(reused) / (sum(reused) + sum(decoded)), "overdue": 0, "evictions": 0,
            "cache_bytes": cache},
        "peak_bytes": (40 << 20) * eyes + cache, "repeats": 0, "warnings": [],
        "per_frame": {"wall_ms": wall, "psnr": psnr, "temporal": temporal, "decoded": decoded}}


def rows(trajectories=3, runs=12, frames=120, eyes=1, label="", seed=1):
    rng = random.Random(seed)
    return [row(name, config, frames, eyes, label, rng) for name in TRAJECTORIES[:trajectories] for config in configurations(runs)]


def main():
    parser = argparse.ArgumentParser()
    for name, value in (("trajectories", 3), ("runs", 12), ("frames", 120), ("eyes", 1), ("seed", 1)):
        parser.add_argument(f"--{name}", type=int, default=value)
    parser.add_argument("--label", default="")
    for line in rows(**vars(parser.parse_args())):
        print(json.dumps(line, allow_nan=False))


if __name__ == "__main__":
    main()
