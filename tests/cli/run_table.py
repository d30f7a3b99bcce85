#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs every line of a table of command lines as a user would type it, and checks what comes back.

usage: run_table.py --gsc BINARY --play BINARY --source DIR --work DIR [--only TEXT] TABLE.txt

A line is `EXIT | COMMAND LINE | PART` where PART must stand in what the program printed (nothing = anything may). Lines
that start with # are comments. `<a,b,c>` in the command line stands for three lines; <> inside is not nested, and \\, is a
comma. Words are split and unquoted as a shell does it, and nothing else of a shell works, but `< FILE` at the end. The
current folder is empty but for what `@` lines before made:
  @ write NAME TEXT | @ copy FROM NAME | @ link TARGET NAME | @ hard FROM NAME | @ fifo NAME | @ folder NAME | @ cut NAME BYTES
  @ mode NAME OCTAL | @ encode NAME CODEC | @ clear   each stands for the lines up to the next @ clear
D/ is the folder of the fixture's models. Every line is checked for more than its code:
  it ends within ten seconds, by no signal; the models and what the @ lines made are as they were; an error is one line
  of the form `error: <object>: <found>, expected <what>; <what to do>`; with --format json behind it the same error comes
  as an object of error.schema.json; and where it failed nothing new is left in the folder.
"""
import argparse
import hashlib
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import jsonschema

sys.path.insert(0, str(Path(__file__).parent))
import fixtures  # noqa: E402

FORM = re.compile(r"^error: .+?: .+, expected .+; .+")
SECONDS = 10


def expand(line):
    found = re.search(r"(?<!\\)<([^<>]*,[^<>]*)>", line)
    if not found:
        return [line]
    parts = [part.replace("\\,", ",") for part in re.split(r"(?<!\\),", found.group(1))]
    return [text for part in parts for text in expand(line[: found.start()] + part + line[found.end():])]


def digest(path):
    if path.is_symlink():
        return f"link {os.readlink(path)}"
    if path.is_dir():
        return "folder"
    if not path.is_file():
        return "other"
    return hashlib.sha1(path.read_bytes()).hexdigest() + oct(path.stat().st_mode)


def snapshot(folder):
    return {str(path.relative_to(folder)): digest(path) for path in folder.rglob("*")}


def stamps(folder):  # cheap: once per line
    return {str(path): (path.lstat().st_size, path.lstat().st_mtime_ns) for path in folder.rglob("*")}


class Table:
    def __init__(self, arguments):
        self.programs = {"gsc": str(arguments.gsc), "gsc-play": str(arguments.play)}
        self.data = arguments.work / "data"
        self.here = arguments.work / "here"
        self.schema = json.loads((arguments.source / "schemas/error.schema.json").read_text())
        self.lines = self.failed = 0
        self.made = []

    def path(self, name):
        return self.data / name[2:] if name.startswith("D/") else self.here / name

    def make(self, kind, name="", *rest):
        to = self.path(name)
        if kind == "clear":
            self.made = []
        elif kind == "write":
            to.write_text(rest[0].encode().decode("unicode_escape"))
        elif kind == "copy":
            (shutil.copytree if to.is_dir() else shutil.copy)(to, self.path(rest[0]))
        elif kind == "link":
            self.path(rest[0]).symlink_to(to if name.startswith("D/") else name)
        elif kind == "hard":
            os.link(to, self.path(rest[0]))
        elif kind == "fifo":
            os.mkfifo(to)
        elif kind == "folder":
            to.mkdir(parents=True)
        elif kind == "cut":
            os.truncate(to, int(rest[0]))
        elif kind == "encode":
            to.write_bytes(to.read_bytes().decode().encode(rest[0]))
        elif kind == "mode":
            to.chmod(int(rest[0], 8))
        else:
            sys.exit(f"no step {kind}")

    def run(self, words, stdin):
        source = open(self.path(stdin), "rb") if stdin else subprocess.DEVNULL
        command = [self.programs[words[0]], *[word.replace("D/", f"{self.data}/") for word in words[1:]]]
        return subprocess.run([os.fsencode(word) for word in command], cwd=self.here, stdin=source, capture_output=True,
                              timeout=SECONDS)

    def fresh(self):
        shutil.rmtree(self.here, ignore_errors=True)
        self.here.mkdir()
        for step in self.made:
            self.make(*step)

    def check(self, code, text, part):
        words = shlex.split(text)
        stdin = None
        if len(words) > 2 and words[-2] == "<":
            stdin, words = words[-1], words[:-2]
        words = [word.encode("latin-1", "ignore").decode("unicode_escape") if "\\x" in word else word for word in words]
        words = [os.fsdecode(word.encode("latin-1")) if any("\x80" <= c <= "\xff" for c in word) else word
                 for word in words]
        self.fresh()
        before, models = snapshot(self.here), stamps(self.data)
        try:
            run = self.run(words, stdin)
        except subprocess.TimeoutExpired:
            return f"still ran after {SECONDS} s"
        out, err = run.stdout.decode(errors="replace"), run.stderr.decode(errors="replace")
        said = f"\n  stdout: {out[:300]!r}\n  stderr: {err[:600]!r}"
        if run.returncode != code:
            return f"exit code {run.returncode}, expected {code}{said}"
        if part and part not in out + err:
            return f"{part!r} is not said{said}"
        if stamps(self.data) != models:
            return "a model of the fixture was changed"
        after = snapshot(self.here)
        changed = [name for name, value in before.items() if after.get(name) != value]
        if changed and (code != 0 or stdin in changed or not any(name in text for name in changed)):
            return f"changed: {changed}{said}"
        if code == 0 or code == 8 or (code in (3, 5) and words[1] == "validate"):
            return None
        if left := sorted(set(after) - set(before)):
            return f"left behind: {left}{said}"
        errors = [line for line in err.splitlines() if line.startswith("error: ")]
        if len(errors) != 1 or not FORM.match(errors[0]):
            return f"no error of the usual form{said}"
        return self.check_json(code, words, stdin, errors[0]) if "--format" not in text else None

    def check_json(self, code, words, stdin, error):
        if "--" in words:
            return None
        try:
            run = self.run([*words, "--format", "json"], stdin)
        except subprocess.TimeoutExpired:
            return f"with --format json: still ran after {SECONDS} s"
        two_documents = run.returncode == 1 and "-" in words
        if run.returncode != code and not two_documents:
            return f"with --format json: exit code {run.returncode}, expected {code}"
        try:
            value = json.loads(run.stdout)
            jsonschema.validate(value, self.schema)
        except (json.JSONDecodeError, jsonschema.ValidationError) as problem:
            return f"with --format json: {str(problem)[:300]}; stdout: {run.stdout[:300]!r}, after {error!r}"
        empty = [key for key in ("subject", "found", "expected", "remedy") if not value[key]]
        return f"with --format json: no {empty} in {value}" if empty else None

    def line(self, line, only):
        if line.startswith("@"):
            step = shlex.split(line[1:])
            if step[0] == "clear":
                self.made = []
            else:
                self.made.append(step)
            return
        fields = [field.strip() for field in re.split(r"(?:^|\s)\|(?:\s|$)", line, maxsplit=2)]
        if len(fields) < 2:
            sys.exit(f"no line of the table: {line}")
        for text in expand(fields[1]):
            if only and only not in text:
                continue
            self.lines += 1
            if problem := self.check(int(fields[0]), text, fields[2] if len(fields) > 2 else ""):
                self.failed += 1
                print(f"FAILED: {text}: {problem}")


def main():
    parser = argparse.ArgumentParser()
    for name in ("gsc", "play", "source", "work"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    parser.add_argument("--only")
    parser.add_argument("table", type=Path)
    arguments = parser.parse_args()
    shutil.rmtree(arguments.work, ignore_errors=True)
    os.environ["XR_RUNTIME_JSON"] = "/nothing"  # no headset, whatever the machine has
    table = Table(arguments)
    table.data.mkdir(parents=True)
    fixtures.small_models(arguments.gsc, arguments.play, table.data)
    for line in arguments.table.read_text().splitlines():
        if line.strip() and not line.startswith("#"):
            table.line(line, arguments.only)
    shutil.rmtree(arguments.work, ignore_errors=True)
    print(f"{table.lines} lines, {table.failed} failed")
    return 1 if table.failed or not table.lines else 0


if __name__ == "__main__":
    sys.exit(main())
