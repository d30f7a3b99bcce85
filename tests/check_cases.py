#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fails unless every line of cli/tables/public_cases.txt is whole, stands there once and names a test that exists.

usage: check_cases.py [TABLE]
"""
import re
import sys
from collections import Counter
from pathlib import Path

HERE = Path(__file__).resolve().parent
ANSWER = re.compile(r"(read|warned|written|goes on|refused with [1-8]|ends with \d+)\b")


def problem_of(fields):
    if len(fields) != 5:
        return f"{len(fields)} fields, expected KIND | SOURCE | ESSENCE | ANSWER | TEST"
    if not all(fields):
        return "a field is empty"
    kind, source, essence, answer, test = fields
    if not ANSWER.match(answer):
        return f"answer {answer!r}, expected read, warned, written, goes on, refused with CODE or ends with CODE first"
    file, _, name = test.partition(": ")
    if not name:
        return f"test {test!r}, expected FILE: NAME, the file below tests/"
    if not (HERE / file).is_file():
        return f"there is no {file}"
    if name not in (HERE / file).read_text():
        return f"{file} has no {name!r}"
    return None


def main():
    table = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "cli/tables/public_cases.txt"
    problems, seen, kinds = [], set(), Counter()
    for number, line in enumerate(table.read_text().splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        fields = [field.strip() for field in line.split(" | ")]
        problem = problem_of(fields)
        if problem is None and tuple(fields[:3]) in seen:
            problem = "the same case twice"
        seen.add(tuple(fields[:3]))
        kinds[fields[0]] += 1
        if problem:
            problems.append(f"{table.name}:{number}: {problem}")
    if not kinds:
        problems.append(f"{table.name}: has no case")
    print("\n".join(problems) or f"{sum(kinds.values())} public cases of {len(kinds)} kinds, each with its test")
    return bool(problems)


if __name__ == "__main__":
    sys.exit(main())
