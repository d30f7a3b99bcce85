#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Commands in a container of little memory: each does its work or ends with 6, none is killed, none leaves a temporary file.

usage: test_memory_limit.py GSC GSC_PLAY WORK_FOLDER [CHECKPOINTS]

Limits are control groups of version 1 where root may make them. Those of version 2 are a folder that is mounted over
/sys/fs/cgroup: the programs have to read it, nothing enforces it.
"""
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

SKIPPED = 77
GROUPS = Path("/sys/fs/cgroup/memory")
MEGABYTE = 1 << 20


def run(words, **kw):
    return subprocess.run([str(w) for w in words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **kw)


def check(done, words, out):
    text = f"{' '.join(map(str, words))}: {done.returncode}: {done.stderr}"
    assert done.returncode in (0, 6), text
    assert "internal error" not in done.stderr and "this is a bug" not in done.stderr, text
    left = [p for p in out.iterdir() if p.name.endswith(".gsc-tmp")]
    assert not left, f"{text}: leaves {left}"
    return done.returncode


def commands(gsc, play, checkpoint, out):
    file, packed = out / "m.gsc", out / "packed.gsc"
    return [
        [gsc, "convert", checkpoint, "-o", file, "-w"],
        [gsc, "export", file, "--to", "ply", "-o", out / "m.ply", "-w"],
        [gsc, "export", file, "--to", "spz", "--sh", "0", "-o", out / "m.spz", "-w"],
        [gsc, "archive", file, "-o", packed, "-w"],
        [gsc, "archive", "-x", packed, "-o", out / "again.gsc", "-w"],
        [gsc, "info", packed],
        [gsc, "validate", packed],
        [play, file, "--backend", "cpu", "--frames", "0:1", "--out", out / "a.pfm", "-w"],
        [play, packed, "--backend", "cpu", "--frames", "0:1", "--reuse", "depth", "--out", out / "b.pfm", "-w"],
    ]


def grouped(words, megabytes):
    """In a group of its own, `megabytes` of memory."""
    group = GROUPS / f"gsc_memory_{os.getpid()}"
    group.mkdir()
    try:
        (group / "memory.limit_in_bytes").write_text(str(megabytes * MEGABYTE))
        return run(["sh", "-c", f'echo $$ > {group}/cgroup.procs && exec "$@"', "sh", *words])
    finally:
        group.rmdir()


def test_first(gsc, play, work, checkpoint, limits):
    """Version 1: exit codes of all commands at each limit."""
    whole = work / "whole"
    whole.mkdir()
    for words in commands(gsc, play, checkpoint, whole):
        assert run([*words, "-q"]).returncode == 0, words
    codes = {}
    for megabytes in limits:
        out = work / f"at_{megabytes}"
        shutil.copytree(whole, out)
        for words in commands(gsc, play, checkpoint, out):
            code = check(grouped([*words, "-q"], megabytes), words, out)
            codes.setdefault(megabytes, []).append(code)
        for name in ("m.gsc", "again.gsc", "a.pfm", "b.pfm"):  # the old one or the new one, which is the same
            assert (out / name).read_bytes() == (whole / name).read_bytes(), f"{name} at {megabytes} MB"
        shutil.rmtree(out)
    print(f"{checkpoint}: exit codes by megabytes {codes}")
    return codes


def mounted(words, files, work):
    """With a folder of `files` in the place of /sys/fs/cgroup."""
    folder = work / "groups"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for name, text in files.items():
        (folder / name).write_text(text)
    return run(["unshare", "--mount", "sh", "-c", f'mount --bind {folder} /sys/fs/cgroup && exec "$@"', "sh", *words])


def test_second(gsc, play, work, checkpoint):
    """Version 2: what the programs say, and what they do where half of it is asked for."""
    if mounted(["true"], {}, work).returncode != 0:
        print("skipped: no folder can be mounted over /sys/fs/cgroup")
        return
    out = work / "second"
    out.mkdir()
    model = out / "m.gsc"
    assert run([gsc, "convert", checkpoint, "-o", model, "-q"]).returncode == 0
    bench = [play, "bench", model, "--backend", "cpu", "--size", "32x32", "--warmup", "0", "--measure", "1", "--format",
             "json", "-q"]
    cpu = lambda files: json.loads(mounted(bench, files, work).stdout)["device"]
    machine = cpu({"memory.max": "max\n", "cpu.max": "max 100000\n"})
    small = cpu({"memory.max": f"{300 * MEGABYTE}\n", "cpu.max": "50000 100000\n"})
    assert small["memory_bytes"] == 300 * MEGABYTE < machine["memory_bytes"], (small, machine)
    assert small["processors"] == 1 and machine["processors"] == len(os.sched_getaffinity(0)), (small, machine)
    assert cpu({"memory.max": "max\n", "memory.high": f"{200 * MEGABYTE}\n"})["memory_bytes"] == 200 * MEGABYTE
    for words in commands(gsc, play, checkpoint, out):
        assert run([*words, "-q"]).returncode == 0, words
    codes = {}
    for megabytes in (20, 60, 512):
        for words in commands(gsc, play, checkpoint, out):
            files = {"memory.max": f"{megabytes * MEGABYTE}\n", "memory.current": f"{8 * MEGABYTE}\n"}
            codes.setdefault(megabytes, []).append(check(mounted([*words, "-q"], files, work), words, out))
    assert codes[512][0] == 0 and 6 in codes[20], codes
    full = {"memory.max": f"{20 * MEGABYTE}\n", "memory.current": f"{20 * MEGABYTE}\n"}
    for words in commands(gsc, play, checkpoint, out):  # a bound below what a program has when it starts would end it
        assert mounted([*words, "-q"], full, work).returncode == 0, words
    print(f"version 2: exit codes by megabytes {codes}")


def main():
    gsc, play, work = (Path(a).resolve() for a in sys.argv[1:4])
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    if any(os.path.exists(driver) for driver in ("/dev/nvidiactl", "/dev/dxg")):
        print("skipped: where a GPU's driver is, the programs do not bound their memory")
        return SKIPPED
    if os.geteuid() != 0:
        print("skipped: only root can limit memory")
        return SKIPPED
    assert run([gsc, "sample", "room", "--anchors", "5k", "--seed", "1", "-o", work / "room", "-q"]).returncode == 0
    test_second(gsc, play, work, work / "room")
    if not os.access(GROUPS / "cgroup.procs", os.W_OK):
        print("skipped: no control group of memory, version 1, can be made")
        return 0
    codes = test_first(gsc, play, work, work / "room", (16, 40, 96, 512))
    assert codes[512][0] == 0 and 6 in codes[16], codes
    if len(sys.argv) == 4:
        return 0
    named = Path(os.environ.get("GSC_CHECKPOINTS") or sys.argv[4])
    if (named / "boruszyn_octree").is_dir():
        shutil.rmtree(work)
        work.mkdir()
        codes = test_first(gsc, play, work, named / "boruszyn_octree", (512, 64))
        assert codes[512][:2] == [0, 0] and codes[512][3:5] == [0, 0], codes
    else:
        print("skipped: no trained models")
    return 0


if __name__ == "__main__":
    sys.exit(main())
