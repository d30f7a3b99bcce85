# SPDX-License-Identifier: Apache-2.0
"""The trace that a service writes satisfies the schema, adds up, and is drawn by gsc chart.

usage: test_trace_cli.py SOURCE WRITE_SERVICE_TRACE [GSC]
"""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import jsonschema


def main():
    source, writer, *gsc = sys.argv[1:]
    line = subprocess.run([writer], check=True, capture_output=True, text=True).stdout
    assert line.count("\n") == 1
    trace = json.loads(line)
    schema = json.loads((Path(source) / "schemas/service-trace.schema.json").read_text())
    jsonschema.Draft202012Validator(schema).validate(trace)
    counts, poses, workers = trace["counts"], trace["poses"], trace["workers"]
    assert counts["submitted"] == len(poses) == 150
    for end in ("shown", "late", "expired", "failed"):
        assert counts[end] == sum(pose["end"] == end for pose in poses), end
    assert counts["left_out"] == 0
    assert sum(worker["frames"] for worker in workers) == sum(pose["worker"] is not None for pose in poses)
    for worker in workers:
        assert sum(worker["stage_ms"].values()) > 0
        assert worker["faults"] == sum(e["kind"] == "retire" and e["worker"] == worker["index"] for e in trace["events"])
    assert [event["time"] for event in trace["events"]] == sorted(event["time"] for event in trace["events"])
    assert max(event["workers"] for event in trace["events"]) == 2
    ends = [0, *(sample["time"] for sample in trace["rate"])]
    shown = sum(sample["fps"] * (end - begin) for sample, begin, end in zip(trace["rate"], ends, ends[1:]))
    assert abs(shown - counts["shown"]) < 1e-3, (shown, counts)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "service.jsonl"
        file.write_text(line)
        for program in gsc:
            said = subprocess.run([program, "chart", file, "-o", Path(folder) / "page.html", "--format", "json", "-q"],
                                  check=True, capture_output=True, text=True).stdout
            assert json.loads(said)["traces"][0]["shown"] == counts["shown"]


if __name__ == "__main__":
    main()
