#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Several workers from the command line: the pictures of one, faults survived, what is said and refused.

usage: test_workers_cli.py SOURCE_DIR GSC_PLAY WRITE_TINY_GSC
"""
import json
import pathlib
import subprocess
import sys
import tempfile

import jsonschema

SOURCE, PLAY, WRITE_TINY = pathlib.Path(sys.argv[1]), *sys.argv[2:4]
VIEW = ["--size", "192x160", "--eyes", "2", "--ipd", "0.05", "--tier", "exact"]


def run(*arguments: object, code: int = 0) -> subprocess.CompletedProcess:
    command = [PLAY, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == code, f"{command}: {done.returncode}, expected {code}\n{done.stdout}\n{done.stderr}"
    return done


def check_schema(report: dict, name: str) -> dict:
    jsonschema.validate(report, json.loads((SOURCE / f"schemas/{name}.schema.json").read_text()))
    return report


def pictures(folder: pathlib.Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in sorted(folder.iterdir())}


def check_pictures(model: pathlib.Path, folder: pathlib.Path) -> None:
    run(model, *VIEW, "--backend", "cpu", "--out", folder / "one/{frame}_{eye}.pfm")
    wanted = pictures(folder / "one")
    assert len(set(wanted.values())) > len(wanted) / 2, "the pictures are alike: the model is not in them"
    for mode in ("auto", "frame", "eye", "split"):
        out = folder / mode
        done = run(model, *VIEW, "--gpus", "cpu:2", "--mode", mode, "--out", out / "{frame}_{eye}.pfm", "--format", "json")
        assert pictures(out) == wanted, f"{mode} draws another picture"
        report = check_schema(json.loads(done.stdout), "play-report")
        assert len(report["workers"]["list"]) == 2 and report["workers"]["wire"] is None
    # of this seed's first 140 draws the 2nd, 47th, 64th and 121st fail: never one pose three times
    done = run("bench", model, *VIEW, "--gpus", "cpu:2", "--inject", "throw:0.01,lost:0.01,memory:0.01,seed:1", "--mode",
               "split", "--warmup", 0, "--measure", 50, "--format", "json")
    workers = json.loads(done.stdout)["service"]["list"]
    assert sum(worker["faults"] for worker in workers) >= 2, workers
    assert any("injected" in (worker["last_fault"] or "") for worker in workers), workers


def check_reports(model: pathlib.Path) -> None:
    devices = check_schema(json.loads(run("--list-devices", "--format", "json").stdout), "device-list")
    assert {"cpu", "cpu-reference"} <= {device["device"] for device in devices["devices"]}
    assert "cpu " in run("--list-devices").stdout
    done = run("bench", model, *VIEW, "--devices", "cpu,cpu", "--mode", "frame", "--frames-in-flight", 6, "--warmup", 8,
               "--measure", 12, "--format", "json")
    workers = check_schema(json.loads(done.stdout), "run")["service"]
    assert workers["mode"] == "frame" and sum(worker["parts"] for worker in workers["list"]) == 20
    assert all(worker["parts"] > 0 for worker in workers["list"]), "only one worker drew"
    text = run("bench", model, *VIEW, "--gpus", "cpu:2", "--warmup", 250, "--measure", 5).stdout
    assert "workers" in text and "fps" in text, "auto does not say what it measured"
    assert "service" not in json.loads(run("bench", model, *VIEW, "--backend", "cpu", "--warmup", 0, "--measure", 2, "--format",
                                           "json").stdout)
    done = run("live", model, *VIEW, "--gpus", "cpu:2", "--mode", "frame", "--rate", 40, "--seconds", 2, "--min-fps",
               "100000", "--inject", "throw:0.02")
    still = run("live", model, *VIEW, "--gpus", "cpu:1", "--rate", 40, "--seconds", 1, "--still-distance", 1e6, "--still-degrees",
                180)
    assert "1 pose at 40" in still.stdout and "and 39 as good as the pose before" in still.stdout, still.stdout
    assert "80 poses at 40 a second" in done.stdout and "below 100000" in done.stdout, done.stdout


def check_refusals(model: pathlib.Path) -> None:
    for arguments, said in [
        (["--gpus", "0"], "--gpus"),
        (["--gpus", "cpu:x"], "cpu:N"),
        (["--gpus", "cpu:2", "--devices", "cpu"], "--devices"),
        (["--gpus", "cpu:2", "--backend", "cpu"], "--backend"),
        (["--devices", "gpu:1"], "--list-devices"),
        (["--mode", "split"], "--gpus"),
        (["--min-fps", "90"], "--gpus"),
        (["--gpus", "cpu:2", "--min-fps", "90", "--max-fps", "60"], "--max-fps"),
        (["--gpus", "cpu:2", "--mode", "eye"], "--eyes 2"),
        (["--gpus", "cpu:2", "--mode", "eye", "--eyes", "2", "--ipd", "0.1", "--stereo", "merged"], "--stereo merged"),
        (["--gpus", "cpu:2", "--inject", "flood:0.1"], "--inject"),
        (["--gpus", "cpu:2", "--inject", "throw:2"], "--inject"),
    ]:
        done = run(model, *arguments, code=1)
        assert said in done.stderr, f"{arguments}: {done.stderr}"
    done = run("bench", model, "--gpus", "cpu:2", "--frames-in-flight", 50, code=1)
    assert "at most 6" in done.stderr, done.stderr
    done = run(model, "--gpus", "cpu:2", "--inject", "lost:1", "--stats", "-", code=7)
    assert "injected" in done.stderr


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        model = folder / "tiny.gsc"
        subprocess.run([WRITE_TINY, str(model), "0", "40"], check=True, capture_output=True)  # whose cameras see it
        check_pictures(model, folder)
        check_reports(model)
        check_refusals(model)
    print("workers: pictures, faults, reports and refusals")


main()
