#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A line of gsc.service-trace/1 with the shape of a real one: poses at a steady rate, a worker that fails and comes back,
another that starts when the scene gets heavy and stops after it.

usage: make_traces.py [--seconds S] [--rate POSES] [--workers N] [--seed N] > service.jsonl

Same options, same line. Not a measurement: only the shape is real.
"""
import argparse
import json
import math
import random

STAGES = {"select": 0.06, "decode": 0.2, "project": 0.08, "bin": 0.12, "sort": 0.11, "blend": 0.36}


def trace(seconds=12.0, rate=90.0, workers=3, seed=1):
    rng = random.Random(seed)
    events, poses, latencies = [], [], []

    def note(time, kind, worker, cause):
        events.append({"time": round(time, 6), "kind": kind, "worker": worker, "cause": cause})

    last = workers - 1
    for index in range(workers):
        note(0.001 * index, "start", index, "all draw from the start")
        note(0.35 + 0.08 * index, "ready", index, f"loaded in {350 + 80 * index} ms")
    note(1.2, "plan", None, "frame with %d workers: 2.9 ms a frame" % workers)
    fault, back, rest, again = 0.35 * seconds, 0.42 * seconds, 0.6 * seconds, 0.8 * seconds
    if workers > 1:
        note(fault, "retire", last, "cuda:%d: illegal address; destroy its renderers and make others" % last)
        note(back, "return", last, "after a fault")
        note(back + 0.3, "ready", last, "loaded in 410 ms")
        note(rest, "stop", last, "122 fps, above 120 with one worker fewer")
        note(again, "start", last, "71 fps, below 72")
    events.sort(key=lambda event: event["time"])

    def working(time):
        started, ready = set(), set()
        for event in events:
            if event["time"] > time:
                break
            change = {"start": started.add, "stop": started.discard, "ready": ready.add, "retire": ready.discard}
            change.get(event["kind"], lambda worker: None)(event["worker"])
        return sorted(started & ready)

    facts = [{"index": i, "device": f"cuda:{i}", "name": "GPU of a wordy vendor 80 GB", "state": "working", "frames": 0,
              "parts": 0, "starts": 1 + (i == last and workers > 1), "stops": int(i == last and workers > 1),
              "faults": int(i == last and workers > 1), "busy_ms": 0.0, "load_ms": 350.0 + 80 * i,
              "stage_ms": dict.fromkeys(STAGES, 0.0),
              "last_fault": "cuda: illegal address" if i == last and workers > 1 else None} for i in range(workers)]
    free = [0.0] * workers
    for number in range(int(seconds * rate)):
        submitted = number / rate
        able = working(submitted)
        heavy = 1 + 0.8 * math.exp(-((submitted / seconds - 0.75) / 0.06) ** 2)
        ms = 14 * heavy * rng.lognormvariate(0, 0.08) * (2.5 if rng.random() < 0.01 else 1)
        pose = {"id": number + 1, "submitted": round(submitted, 6), "begun": None, "ended": None, "end": "expired",
                "latency_ms": None, "worker": None, "mode": None, "attempts": None}
        worker = min(able, key=lambda w: free[w], default=None)
        if worker is None or free[worker] > submitted + 1.5 / rate:
            pose["ended"] = round(submitted + 1 / rate, 6)
        else:
            begun = max(submitted, free[worker])
            ended = begun + ms / 1000
            free[worker] = ended
            pose.update(begun=round(begun, 6), ended=round(ended, 6), worker=worker, mode="frame", attempts=1,
                        end="shown" if rng.random() > 0.02 else rng.choice(["late", "late", "failed"]))
            if pose["end"] == "shown":
                pose["latency_ms"] = round(1000 * (ended - submitted), 4)
                latencies.append(pose["latency_ms"])
            fact = facts[worker]
            fact["frames"] += 1
            fact["parts"] += 1
            fact["busy_ms"] += ms
            for name, share in STAGES.items():
                fact["stage_ms"][name] += share * ms
        poses.append(pose)
    poses.sort(key=lambda pose: pose["ended"])
    shown = [pose["ended"] for pose in poses if pose["end"] == "shown"]
    step = max(seconds / 120, 0.1)

    def count(begin, end):
        return sum(begin < time <= end for time in shown)

    for event in events:
        span = min(event["time"], 1)
        event["rate"] = count(event["time"] - span, event["time"]) / span if span else 0
        event["workers"] = len(working(event["time"]))
    samples = [{"time": round((i + 1) * step, 6), "fps": count(i * step, (i + 1) * step) / step,
                "workers": len(working((i + 1) * step))} for i in range(int(seconds / step + 1e-9))]
    latencies.sort()
    rank = {name: latencies[max(0, math.ceil(share * len(latencies)) - 1)] if latencies else 0
            for name, share in (("p50", 0.5), ("p95", 0.95), ("p99", 0.99), ("max", 1))}
    ends = {end: sum(pose["end"] == end for pose in poses) for end in ("shown", "late", "expired", "failed")}
    return {"schema": "gsc.service-trace/1", "tool": {"name": "gsc-play", "version": "0.1.0", "commit": None},
            "file": "city/city.gsc",
            "options": {"mode": "auto", "rate": rate, "min_fps": 72, "max_fps": 120, "keeps_all": False,
                        "devices": [f"cuda:{i}" for i in range(workers)]},
            "counts": {"submitted": len(poses), **ends, "still": 0, "left_out": 0}, "latency_ms": rank, "rate": samples,
            "workers": facts, "events": events, "poses": poses}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=12)
    parser.add_argument("--rate", type=float, default=90)
    parser.add_argument("--workers", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    print(json.dumps(trace(**vars(parser.parse_args()))))


if __name__ == "__main__":
    main()
