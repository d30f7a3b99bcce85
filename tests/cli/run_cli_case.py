#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs gsc as a user would and checks exit code, streams, reports and files.

usage: run_cli_case.py --gsc BINARY [--play BINARY] --source DIR --work DIR CASES.json...

A case file holds {"fixture": NAME or null, "cases": [...]}. A fixture (fixtures.py) fills the folder {data} once; every
case runs in an empty folder {out}. Keys of a case:
  name       what is shown
  program    "gsc-play": runs that instead of gsc; skipped, and said so, without --play
  args       command line; {data}, {out} and {checkpoints} are replaced
  needs      "checkpoints": skipped, and said so, where there are no trained models
  exit       expected code
  stdout     list of regular expressions that must be found; [] = must be empty; left out = anything
  stderr     the same for stderr
  schema     name of schemas/NAME.schema.json that stdout must satisfy; also says that stdout is one JSON value
  json       {dotted path: expected value} within that
  json_min   {dotted path: smallest value allowed} within that
  progress   true = every line of stderr satisfies progress-event.schema.json, and there is one
  report     {file: schema}: files that must exist and satisfy the schema
  files      exact list of what {out} holds afterwards (relative, folders end with /); left out = anything
  leftovers  how many temporary files and folders (*.gsc-tmp) {out} holds afterwards
  contents   {file: expected text}
  links      {file: where the symbolic link leads}
  same       list of [file, file] that hold the same bytes
  before     list of ["copy", from, to] | ["link", from, to] | ["symlink", target, path] | ["folder", path]
             | ["fifo", path] | ["write", path, text] | ["patch", path, offset, hex] | ["append", path, hex]
             | ["truncate", path, size] | ["gsc", argument, ...], which must work, done before the run; a negative offset or size counts from the end
  environment {name: value}: variables besides those there are
  stdout_to  stdout goes to this file
  file_limit largest file the process may write, bytes: a stand-in for a full disk
  disk       size of a small file system mounted at {out}/disk (bytes); without the right to mount, file_limit = disk
  memory_limit  address space the process may use, bytes
  interrupt  regular expression of a stderr line after which a signal is sent
  signal     its name, default SIGINT
  ignored    names of signals that are ignored at the start, as nohup and a shell's `command &` do it
  closed     file descriptors that are closed at the start: 0, 1, 2
  cut        [file, size]: the file is cut to that size after the line of "interrupt", in place of a signal; without
             "interrupt" as soon as the process has mapped it
  then       a case that runs afterwards in the same {out}
  head       true = both streams go to a pipe that is closed after its first line, as "2>&1 | head -1" does
  timeout    seconds, default 60
"""
import argparse
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import jsonschema

sys.path.insert(0, str(Path(__file__).parent))
import fixtures  # noqa: E402


class Failure(Exception):
    pass


def validate_schema(source, name, value):
    path = source / "schemas" / f"{name}.schema.json"
    schema = json.loads(path.read_text())
    # the schemas refer to each other by file name
    resolver = jsonschema.RefResolver(path.resolve().as_uri(), schema)
    validator = jsonschema.Draft202012Validator(schema, resolver=resolver)
    errors = sorted(validator.iter_errors(value), key=lambda error: list(error.path))
    if errors:
        lines = [f"{'/'.join(map(str, error.path)) or '.'}: {error.message}" for error in errors[:5]]
        raise Failure(f"does not satisfy {path.name}: " + "; ".join(lines))


def parse_json(text, what):
    def refuse(constant):
        raise Failure(f"{what} holds {constant}, which is not JSON")

    try:
        return json.loads(text, parse_constant=refuse)
    except json.JSONDecodeError as error:
        raise Failure(f"{what} is not one JSON value ({error}): {text[:200]!r}") from error


def look_up(value, path):
    for part in path.split("."):
        value = value[int(part)] if isinstance(value, list) else value[part]
    return value


def prepare(step, expand, programs):
    kind, path, *rest = step[0], Path(expand(step[1])), *step[2:]
    if kind == "gsc":
        subprocess.run([programs["gsc"], *map(expand, step[1:])], check=True, capture_output=True)
    elif kind == "copy":
        shutil.copytree(path, expand(rest[0])) if path.is_dir() else shutil.copy(path, expand(rest[0]))
    elif kind == "write":
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(rest[0])
    elif kind == "patch":
        data = bytearray(path.read_bytes())
        offset = rest[0] if rest[0] >= 0 else len(data) + rest[0]
        new = bytes.fromhex(rest[1])
        if bytes(data[offset : offset + len(new)]) == new:
            raise Failure(f"patch at {offset} changes nothing")
        data[offset : offset + len(new)] = new
        path.write_bytes(data)
    elif kind == "link":  # a second name of the same file
        os.link(path, expand(rest[0]))
    elif kind == "symlink":
        Path(expand(rest[0])).symlink_to(expand(step[1]))
    elif kind == "folder":
        path.mkdir(parents=True)
    elif kind == "fifo":
        os.mkfifo(path)
    elif kind == "append":
        with path.open("ab") as file:
            file.write(bytes.fromhex(rest[0]))
    elif kind == "truncate":
        size = rest[0] if rest[0] >= 0 else path.stat().st_size + rest[0]
        os.truncate(path, size)
    else:
        raise Failure(f"unknown step {kind}")


class SmallDisk:
    """A file system of a given size, where this process may mount one."""

    def __init__(self, folder, size):
        folder.mkdir(parents=True)
        self.folder = folder
        mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
        self.mounted = shutil.which("mount") and subprocess.run(mount, capture_output=True).returncode == 0
        if not self.mounted:
            print("  note: no right to mount, a file size limit stands in for the full disk")

    def files(self):
        return sorted(str(path) for path in self.folder.rglob("*"))

    def remove(self):
        if self.mounted:
            subprocess.run(["umount", str(self.folder)], check=True)


def run_head(command, case):
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    process.stdout.readline()
    process.stdout.close()
    return process.wait(timeout=case.get("timeout", 60)), "", ""


def cut_when_mapped(process, path, size):
    """The process stands still while the file shrinks, so that it has not read it all before."""
    for _ in range(20000):
        if process.poll() is not None:
            return False
        if path in Path(f"/proc/{process.pid}/maps").read_text(errors="replace"):
            process.send_signal(signal.SIGSTOP)
            os.truncate(path, size)
            process.send_signal(signal.SIGCONT)
            return True
        time.sleep(0.0005)
    return False


def run(command, case, limit, expand):
    if case.get("head"):
        return run_head(command, case)

    def before_exec():
        if limit is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        if "memory_limit" in case:
            resource.setrlimit(resource.RLIMIT_AS, (case["memory_limit"], case["memory_limit"]))
        for name in case.get("ignored", []):
            signal.signal(signal.Signals[name], signal.SIG_IGN)
        for stream in case.get("closed", []):
            os.close(stream)

    sink = open(case["stdout_to"], "wb") if "stdout_to" in case else subprocess.PIPE
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=sink, stderr=subprocess.PIPE,
                               env=os.environ | case.get("environment", {}), preexec_fn=before_exec)
    lines = []
    interrupted = threading.Event()

    def read_stderr():
        for raw in process.stderr:
            line = raw.decode(errors="replace")
            lines.append(line)
            if "interrupt" in case and not interrupted.is_set() and re.search(case["interrupt"], line):
                interrupted.set()
                if "cut" in case:
                    os.truncate(expand(case["cut"][0]), case["cut"][1])
                else:
                    process.send_signal(signal.Signals[case.get("signal", "SIGINT")])

    reader = threading.Thread(target=read_stderr)
    reader.start()
    killer = threading.Timer(case.get("timeout", 60), process.kill)
    killer.start()
    if "cut" in case and "interrupt" not in case and not cut_when_mapped(process, expand(case["cut"][0]), case["cut"][1]):
        raise Failure(f"{case['cut'][0]} was never mapped, so nothing was cut")
    stdout = process.stdout.read().decode(errors="replace") if process.stdout else ""
    process.wait()
    reader.join()
    killer.cancel()
    if "interrupt" in case and not interrupted.is_set():
        raise Failure(f"stderr never matched {case['interrupt']!r}, so nothing was interrupted")
    return process.returncode, stdout, "".join(lines)


def check_stream(name, patterns, text):
    if patterns is None:
        return
    if not patterns and text:
        raise Failure(f"{name} should be empty but is {text[:400]!r}")
    for pattern in patterns:
        if not re.search(pattern, text, re.MULTILINE):
            raise Failure(f"{name} has no match of {pattern!r}: {text[:1500]!r}")


def check_progress(source, stderr):
    events = [parse_json(line, "progress") for line in stderr.splitlines()]
    if not events:
        raise Failure("no progress event on stderr")
    for event in events:
        validate_schema(source, "progress-event", event)


def list_files(folder):
    return sorted(str(path.relative_to(folder)) + ("/" if path.is_dir() else "") for path in folder.rglob("*"))


def run_case(case, programs, source, data, out, checkpoints, again=False):
    def expand(text):
        return text.replace("{data}", str(data)).replace("{out}", str(out)).replace("{checkpoints}", checkpoints or "")

    if not again:
        shutil.rmtree(out, ignore_errors=True)
        out.mkdir(parents=True)
    for step in case.get("before", []):
        prepare(step, expand, programs)
    limit = case.get("file_limit")
    disk = SmallDisk(out / "disk", case["disk"]) if "disk" in case else None
    try:
        if disk and not disk.mounted:
            limit = case["disk"]
        command = [str(programs[case.get("program", "gsc")])] + [expand(argument) for argument in case["args"]]
        code, stdout, stderr = run(command, case, limit, expand)
        if code != case["exit"]:
            raise Failure(f"exit code {code}, expected {case['exit']}\nstdout: {stdout[:800]}\nstderr: {stderr[:1500]}")
        check_stream("stdout", case.get("stdout"), stdout)
        check_stream("stderr", case.get("stderr"), stderr)
        if "schema" in case:
            value = parse_json(stdout, "stdout")
            validate_schema(source, case["schema"], value)
            for path, expected in case.get("json", {}).items():
                if look_up(value, path) != expected:
                    raise Failure(f"{path} is {look_up(value, path)!r}, expected {expected!r}")
            for path, smallest in case.get("json_min", {}).items():
                if not look_up(value, path) >= smallest:
                    raise Failure(f"{path} is {look_up(value, path)!r}, expected at least {smallest!r}")
        if case.get("progress"):
            check_progress(source, stderr)
        for path, schema in case.get("report", {}).items():
            validate_schema(source, schema, parse_json(Path(expand(path)).read_text(), path))
        if disk and disk.files():
            raise Failure(f"left behind: {disk.files()}")
        if "files" in case and list_files(out) != sorted(case["files"]):
            raise Failure(f"{{out}} holds {list_files(out)}, expected {sorted(case['files'])}")
        leftovers = [path for path in out.rglob("*.gsc-tmp")]
        if "leftovers" in case and len(leftovers) != case["leftovers"]:
            raise Failure(f"{len(leftovers)} leftovers, expected {case['leftovers']}: {list_files(out)}")
        for path, expected in case.get("contents", {}).items():
            if Path(expand(path)).read_text() != expected:
                raise Failure(f"{path} holds {Path(expand(path)).read_text()[:200]!r}, expected {expected!r}")
        for one, other in case.get("same", []):
            if Path(expand(one)).read_bytes() != Path(expand(other)).read_bytes():
                raise Failure(f"{one} and {other} differ")
        for path, expected in case.get("links", {}).items():
            if os.readlink(expand(path)) != expand(expected):
                raise Failure(f"{path} leads to {os.readlink(expand(path))!r}, expected {expected!r}")
    finally:
        if disk:
            disk.remove()
    if "then" in case:
        run_case(case["then"], programs, source, data, out, checkpoints, again=True)


def checkpoints_root(source):
    named = os.environ.get("GSC_CHECKPOINTS")
    root = Path(named) if named else source / "../shared/checkpoints"
    if named and not root.is_dir():
        sys.exit(f"GSC_CHECKPOINTS is {named!r}, expected a folder; unset it or correct it")
    return str(root.resolve()) if root.is_dir() else None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--gsc", type=Path, required=True)
    parser.add_argument("--play", type=Path)
    parser.add_argument("--source", type=Path, required=True)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--only", help="run the cases whose name contains this")
    parser.add_argument("cases", type=Path, nargs="+")
    arguments = parser.parse_args()
    checkpoints = checkpoints_root(arguments.source)
    failed = skipped = passed = 0
    for path in arguments.cases:
        suite = json.loads(path.read_text())
        work = arguments.work / path.stem
        data = work / "data"
        shutil.rmtree(work, ignore_errors=True)
        data.mkdir(parents=True)
        if suite.get("fixture"):
            getattr(fixtures, suite["fixture"])(arguments.gsc, data)
        for case in suite["cases"]:
            label = f"{path.stem}: {case['name']}"
            if arguments.only and arguments.only not in label:
                continue
            if case.get("needs") == "checkpoints" and not checkpoints:
                print(f"skipped: {label} (no trained models; set GSC_CHECKPOINTS to their folder)")
                skipped += 1
                continue
            programs = {"gsc": arguments.gsc, "gsc-play": arguments.play}
            if case.get("program") and not arguments.play:
                print(f"skipped: {label} (no gsc-play; pass --play)")
                skipped += 1
                continue
            if "memory_limit" in case and b"__asan_init" in programs[case.get("program", "gsc")].read_bytes():
                print(f"skipped: {label} (the address sanitizer needs more address space)")
                skipped += 1
                continue
            try:
                run_case(case, programs, arguments.source, data, work / "out", checkpoints)
                passed += 1
                print(f"ok: {label}")
            except Failure as failure:
                failed += 1
                print(f"FAILED: {label}: {failure}")
        shutil.rmtree(work, ignore_errors=True)
    print(f"{passed} passed, {failed} failed, {skipped} skipped")
    return 1 if failed or passed + skipped == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
