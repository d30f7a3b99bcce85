#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fails unless tests/README.md names a test for each of the 36 traps, and every test it names exists."""
import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
problems, covered = [], set()
for line in (HERE / "README.md").read_text().splitlines():
    match = re.match(r"\| (\d+) \| [^|]+ \| (.+) \|$", line)
    if not match:
        continue
    covered.add(int(match[1]))
    tests = re.findall(r'`([^`]+)`: "([^"]+)"', match[2])
    if not tests:
        problems.append(f"trap {match[1]}: names no test")
    for file, name in tests:
        path = HERE / file
        if not path.is_file() or f'"{name}"' not in path.read_text():
            problems.append(f"trap {match[1]}: {file} has no test {name!r}")
problems += [f"trap {number}: not in the table" for number in sorted(set(range(1, 37)) - covered)]
print("\n".join(problems) or "each of the 36 traps has its tests")
sys.exit(bool(problems))
