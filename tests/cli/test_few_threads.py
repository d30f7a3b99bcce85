#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every command where 1 to 40 processes and threads are allowed: it does its work, or ends with 6 and names the limit. A
seeded choice of commands, limits and --threads, in one of these ways:
  user      ulimit -u of a user who has nothing else
  together  the same, while another command of that user takes some of it
  group     the pids limit of a container (where control groups of version 1 may be made)
  stopped   ulimit -u, and SIGTERM soon after the start

usage: test_few_threads.py GSC GSC_PLAY WORK_FOLDER RUNS [--seed N] [--only NAME]

Checked of each run: no signal, no hang, no "internal error"; on success the files that a run without a limit writes, and
their bytes where those are the same each time; on failure no file that is not whole.
"""
import argparse
import concurrent.futures
import os
import random
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import fixtures  # noqa: E402

SKIPPED = 77
SECONDS = 10  # and ten times what the command takes without a limit
GROUPS = Path("/sys/fs/cgroup/pids")
FIRST_USER = 61000  # each run has a user of its own, so that several do not take threads from one another
VIEW = "--backend cpu --cameras D/path.json --size 32x24"

# name: command line; D/ the models, O/ an empty folder. "*" in front: its bytes differ from run to run; T: takes threads
COMMANDS = {
    "convert": "gsc convert D/octree -o O/x.gsc T",
    "convert scaffold": "gsc convert D/scaffold -o O/x.gsc --memory-budget 1M T",
    "convert refused": "gsc convert D/note.txt -o O/x.gsc T",
    "validate": "gsc validate D/octree.gsc",
    "validate archive": "gsc validate D/packed.gsc",
    "validate damaged": "gsc validate D/damaged.gsc",
    "info": "gsc info D/octree.gsc",
    "info archive": "gsc info D/packed.gsc",
    "compare": "gsc compare D/octree D/octree.gsc",
    "compare render": "gsc compare D/octree D/octree.gsc --render --cameras D/path.json --views 1 T",
    "compare pictures": "gsc compare-pictures D/pictures D/pictures T",
    "compare png": "gsc compare-pictures D/pictures D/png T",
    "ply": "gsc export D/octree.gsc --to ply -o O/x.ply --cameras D/path.json T",
    "spz": "gsc export D/octree.gsc --to spz -o O/x.spz --cameras D/path.json T",
    "glb": "gsc export D/octree.gsc --to glb -o O/x.glb --cameras D/path.json T",
    "sog": "gsc export D/octree.gsc --to sog -o O/x.sog --cameras D/path.json T",
    "lod": "gsc export D/octree.gsc --to sog --lod -o O/lod --cameras D/path.json T",
    "html": "gsc export D/octree.gsc --html O/x.html --cameras D/path.json T",
    "vdb": "gsc export D/octree.gsc --to vdb -o O/x.vdb",
    "nvdb": "gsc export D/octree.gsc --to nvdb -o O/x.nvdb",
    "*bake": "gsc bake D/octree.gsc -o O/x.gsc --target-psnr 40 --cameras D/path.json --backend cpu T",
    "bake checkpoint": "gsc bake D/scaffold -o O/x.gsc --cameras D/path.json --backend cpu T",
    "crop": "gsc bake D/octree.gsc -o O/x.gsc --crop=-5,-5,-5,5,5,5 T",
    "archive": "gsc archive D/octree.gsc -o O/x.gsc T",
    "extract": "gsc archive -x D/packed.gsc -o O/x.gsc T",
    "*sample": "gsc sample room --anchors 500 --seed 3 -o O/m",
    "sample paths": "gsc sample paths D/octree.gsc -o O/paths --only orbit --size 32x24",
    "chart": "gsc chart D/run.jsonl -o O/x.html",
    "figures": "gsc chart D/run.jsonl -o O/x.html --figures O/figures",
    "merge": "gsc merge-runs D/s1.jsonl D/s2.jsonl -o O/x.jsonl",
    "pfm": f"gsc-play D/octree.gsc {VIEW} --out O/{{frame}}.pfm T",
    "png": f"gsc-play D/octree.gsc {VIEW} --out O/{{frame}}.png T",
    "png 16": f"gsc-play D/packed.gsc {VIEW} --depth 16 --frames 0:2 --out O/{{frame}}.png T",
    "exr": f"gsc-play D/octree.gsc {VIEW} --eyes 2 --ipd 0.06 --frames 0:3 --out O/{{frame}}_{{eye}}.exr T",
    "pipe": f"gsc-play D/octree.gsc {VIEW} --out - T",
    "reference": f"gsc-play D/octree.gsc {VIEW.replace('cpu', 'cpu-reference')} --frames 0:2 --out O/{{frame}}.pfm T",
    "reuse": f"gsc-play D/octree.gsc {VIEW} --reuse depth --out O/{{frame}}.pfm T",
    "*video": f"gsc-play D/octree.gsc {VIEW} --video O/x.mp4 --fps 30 T",
    "devices": f"gsc-play D/octree.gsc --devices cpu,cpu --cameras D/path.json --size 32x24 --out O/{{frame}}.pfm T",
    "*stats": f"gsc-play D/octree.gsc {VIEW} --stats O/x.jsonl T",
    "*bench": f"gsc-play bench D/octree.gsc {VIEW} --warmup 0 --measure 2 T",
    "*sweep": "gsc-play bench D/octree.gsc --sweep D/sweep.json --size 32x24 --backend cpu --out O/x.jsonl T",
    "*stability": "gsc-play stability D/octree.gsc --trajectories D/path.json --size 32x24 --backend cpu --bound-psnr 0 "
                  "--bound-temporal 0 T",
    "*live": f"gsc-play live D/octree.gsc {VIEW} --trace O/x.json T",
    "*backends": "gsc-play backends",
    "*list": "gsc-play --list-devices",
}


def prepare(gsc, play, data):
    fixtures.small_models(gsc, play, data)
    run = lambda *words: subprocess.run([str(w) for w in words], check=True, stdout=subprocess.DEVNULL)
    run(gsc, "archive", data / "octree.gsc", "-o", data / "packed.gsc", "-q")
    for i in (1, 2):
        run(play, data / "octree.gsc", *VIEW.replace("D/", f"{data}/").split(), "--shard", f"{i}/2", "--stats",
            data / f"s{i}.jsonl", "-q")
    for folder, kind in (("pictures", "pfm"), ("png", "png")):
        (data / folder).mkdir()
        run(play, data / "octree.gsc", *VIEW.replace("D/", f"{data}/").split(), "--frames", "0:2", "--out",
            data / folder / f"{{frame}}.{kind}", "-q")


def words_of(name, args, data, out, threads):
    words = []
    for word in shlex.split(COMMANDS[name]):
        if word == "T":
            if threads is not None:
                words += ["--threads", str(threads)]
        else:
            words.append({"gsc": args.gsc, "gsc-play": args.play}.get(word, word).replace("D/", f"{data}/")
                         .replace("O/", f"{out}/"))
    return words


def limited(words, user, limit):
    """The command line as another user; `limit`: of processes and threads, 0 = none."""
    identity = f"setpriv --reuid {user} --regid {user} --clear-groups --no-new-privs".split()
    return identity + (["prlimit", f"--nproc={limit}"] if limit else []) + words


def grouped(words, group, limit):
    """The command line in a control group of its own, which is made here."""
    group.mkdir()
    (group / "pids.max").write_text(str(limit))
    return ["sh", "-c", f'echo $$ > {group}/cgroup.procs && exec "$@"', "sh", *words]


def execute(line, out, seconds, stop_after=None):
    """Exit code (None: it hung), standard output, standard error, the files it left, seconds."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    out.chmod(0o777)
    start = time.monotonic()
    try:
        process = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=out,
                                   env={**os.environ, "HOME": str(out.parent)})
        if stop_after is not None:
            time.sleep(stop_after)
            process.terminate()
        said, error = process.communicate(timeout=seconds)
        code = process.returncode
    except subprocess.TimeoutExpired:
        process.kill()
        said, error = process.communicate()
        code = None
    error = error.decode("utf-8", "replace")
    files = {str(p.relative_to(out)): p.read_bytes() for p in sorted(out.rglob("*")) if p.is_file()}
    return code, said, error, files, time.monotonic() - start


def faults_of(name, way, got, wanted):
    code, said, error, files, seconds = got
    if code is None:
        return [f"hangs: {error}"]
    faults = []
    if way == "stopped" and code in (130, -15):  # -15: before the program was there to take it
        return ["leaves a temporary file"] if any("gsc-tmp" in f for f in files) else []
    if code < 0 or code >= 128:
        faults.append(f"ends by a signal, code {code}: {error}")
    error = error[-400:]
    if "internal error" in error or "this is a bug" in error or "terminate called" in error:
        faults.append(error)
    if code not in (6, wanted[0]):
        faults.append(f"ends with {code}, expected 6 or {wanted[0]}: {error}")
    if code == 6 and not ("ulimit -u is" in error and "pids.max is" in error):
        faults.append(f"does not name the limits: {error}")
    if set(files) - set(wanted[3]):
        faults.append(f"leaves {sorted(set(files) - set(wanted[3]))}")
    same = not name.startswith("*")
    if code == wanted[0] and code != 6 and set(files) != set(wanted[3]):
        faults.append(f"has not written {sorted(set(wanted[3]) - set(files))}")
    if same and any(files[f] != wanted[3][f] for f in set(files) & set(wanted[3])):
        faults.append("other bytes than without a limit")
    if same and code == wanted[0] and name == "pipe" and said != wanted[1]:
        faults.append("other pictures than without a limit")
    return faults


def main():
    parser = argparse.ArgumentParser()
    for word in ("gsc", "play", "work"):
        parser.add_argument(word)
    parser.add_argument("runs", type=int)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="")
    args = parser.parse_args()
    args.gsc, args.play = os.path.abspath(args.gsc), os.path.abspath(args.play)
    if os.geteuid() != 0 or not shutil.which("setpriv") or not shutil.which("prlimit"):
        print("skipped: only root can run commands as another user, with setpriv and prlimit of util-linux")
        return SKIPPED
    work = Path(args.work).resolve()
    shutil.rmtree(work, ignore_errors=True)
    data = work / "data"
    data.mkdir(parents=True)
    prepare(args.gsc, args.play, data)
    subprocess.run(["chmod", "-R", "a+rX", str(work)], check=True)
    if subprocess.run(limited(["test", "-r", str(data / "octree.gsc")], FIRST_USER, 0)).returncode != 0 or \
            subprocess.run(limited([args.gsc, "--version"], FIRST_USER, 0), stdout=subprocess.DEVNULL).returncode != 0:
        print(f"skipped: another user may not read {work}")
        return SKIPPED
    if not shutil.which("ffmpeg"):
        del COMMANDS["*video"]
    names = [n for n in COMMANDS if args.only in n]
    chance = random.Random(args.seed)
    ways = ["user", "user", "together", "stopped"] + ["group"] * os.access(GROUPS / "cgroup.procs", os.W_OK)
    plan = [(names[i % len(names)], chance.choice(ways), chance.choice((chance.randint(1, 8), chance.randint(1, 40))),
             chance.choice((1, 4, None))) for i in range(args.runs)]
    chance.shuffle(plan)
    wanted, faults, codes = {}, 0, {}
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        whole = {name: pool.submit(execute, limited(words_of(name, args, data, work / f"w{i}", None), FIRST_USER + i, 0),
                                   work / f"w{i}", 120) for i, name in enumerate(sorted({p[0] for p in plan}))}
        for name, future in whole.items():
            wanted[name] = future.result()
            if wanted[name][0] is None or wanted[name][0] in (4, 6) or wanted[name][0] < 0 or \
                    (wanted[name][0] != 0 and name not in ("validate damaged", "convert refused")):
                print(f"FAILED without a limit: {name}: {wanted[name][0]}: {wanted[name][2]}")
                return 1
        runs = []
        for i, (name, way, limit, threads) in enumerate(plan):
            out = work / f"r{i}"
            words = words_of(name, args, data, out, threads)
            group = GROUPS / f"gsc_few_{os.getpid()}_{i}"
            user = FIRST_USER + 1000 + (0 if way == "together" else 1 + i)
            line = grouped(words, group, limit) if way == "group" else limited(words, user, limit)
            stop = chance.uniform(0.01, 0.3) if way == "stopped" else None
            runs.append((name, way, limit, line, group,
                         pool.submit(execute, line, out, max(SECONDS, 10 * wanted[name][4]), stop)))
        for name, way, limit, line, group, future in runs:
            got = future.result()
            if way == "group":
                group.rmdir()
            codes[got[0]] = codes.get(got[0], 0) + 1
            for fault in faults_of(name, way, got, wanted[name]):
                faults += 1
                print(f"FAILED {name}, {way} of {limit}: {fault.strip()}\n  {shlex.join(line)}")
    print(f"{len(plan)} runs, exit codes {codes}, {faults} faults")
    assert codes.get(0, 0) > len(plan) // 5, "hardly any run did its work"
    assert len(names) < len(COMMANDS) or codes.get(6, 0) > 0, "no limit was felt"
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
