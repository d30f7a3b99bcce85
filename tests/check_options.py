#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fails where an option of a command has no line in the tables and cases of tests/cli that uses it rightly, or none that
misuses it, and where a line of a help is wider than 80 columns.

usage: check_options.py GSC PLAY

The programs say themselves which options they have: `--help-all` of every command. A line uses an option rightly if it is
there and the line does not exit with 1, the code of a wrong command line: it exits with 0, or refuses a file or a device;
--help, which reads no values, must not stand in it. A line misuses the option that stands last in it, or that it expects to be named, if it exits with 1.
Commands that declare an option in the same words share its lines."""
import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

CLI = Path(__file__).resolve().parent / "cli"
sys.path.insert(0, str(CLI))
from run_table import expand  # noqa: E402

COLUMNS = 80
OPTION = re.compile(r"^  (?:-(\w),)?(--[\w-]+)(.*(?:\n {20,}.*)*)", re.M)
programs = dict(zip(("gsc", "gsc-play"), sys.argv[1:]))
problems, commands, texts = [], {}, {}  # words of a command: names of its options; (program, option, text): commands


def said(program, *words):
    return subprocess.run([programs[program], *words], capture_output=True, text=True, check=True).stdout


def look(program, *path):
    subs = [line.split("\t")[0] for line in said(program, "__complete", "man", *path, "").splitlines()]
    for words in ("--help", "--help-all"):
        help_text = said(program, *path, words)
        problems.extend(f"{' '.join((program, *path))} {words}: {len(line)} columns, expected {COLUMNS} at most: {line}"
                        for line in help_text.splitlines() if len(line) > COLUMNS)
    commands[program, *path] = names = {}
    for short, name, text in OPTION.findall(help_text.split("\nCommands:")[0].split("xample")[0]):
        names[name] = name
        names[f"-{short}"] = name
        texts.setdefault((program, name, " ".join(text.split())), []).append((program, *path))
    for sub in subs:
        look(program, *path, sub)


def lines():
    """(words, exit code, text that is expected) of all tables and cases"""
    for table in (CLI / "tables").glob("*.txt"):
        if table.name == "public_cases.txt":
            continue
        for line in table.read_text().splitlines():
            fields = [field.strip() for field in re.split(r"(?:^|\s)\|(?:\s|$)", line, maxsplit=2)]
            if line[:1] not in ("", "#", "@"):
                for text in expand(fields[1]):
                    yield shlex.split(text), int(fields[0]), fields[2] if len(fields) > 2 else ""
    for file in (CLI / "cases").glob("*.json"):
        cases = json.loads(file.read_text())["cases"]
        for case in cases:
            cases += [case["then"]] if "then" in case else []
            expected = " ".join(case.get("stderr", []))
            yield [case.get("program", "gsc"), *case.get("args", [])], case.get("exit", 0), expected


for name in programs:
    look(name)
used, misused = set(), set()
for words, code, expected in lines():
    path = words[:1]
    while len(path) < len(words) and (*path, words[len(path)]) in commands:
        path.append(words[len(path)])
    names = commands[tuple(path)]
    given = []
    for word in words[len(path):]:
        found = names.get(word.split("=")[0]) or (re.match(r"-[a-zA-Z]", word) and names.get(word[:2]))
        given += [found] if found else []
    keys = [(*path, option) for option in given]
    if code != 1 and not {"--help", "--help-all"} & set(given):
        used.update(keys)
    elif keys:
        misused.update(keys[-1:])
        misused.update(key for key in keys if re.search(rf"{key[-1]}\b", expected))

for (_, option, _), owners in texts.items():
    if option in ("--help", "--help-all", "--version"):
        continue
    for kind, known in (("uses it rightly", used), ("misuses it", misused)):
        if not any((*path, option) in known for path in owners):
            problems.append(f"{' '.join(owners[0])} {option}: has no line that {kind}, expected one in tests/cli/tables")
if len(commands) < 20:
    problems.append(f"programs: have {len(commands)} commands, expected more; look at `__complete man`")
print("\n".join(problems) or f"{len(texts)} options of {len(commands)} commands have a line that uses and one that misuses them")
sys.exit(bool(problems))
