#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fails unless every Error says of what, what was found, what was expected and what to do (format/include/gsc/error.h).

Looks at the string literals of each construction of an Error, those of both sides of a ?: together. A function
that only throws one (marked noreturn, or a lambda that starts with throw) may leave parts out that the literals of each
call of it have. Takes another source tree as its argument."""
import re
import sys
from pathlib import Path

ROOT = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).resolve().parent.parent)
FOLDERS = ("convert", "format", "kernels", "player", "runtime")
SUFFIXES = {".cpp", ".h", ".cu", ".cuh"}

# (file, literals of the construction): why they are not the whole message
FORWARDED = {
    ("runtime/devices/device_list.cpp", "backend %s: %s"): "the rest is a text of failure() in runtime/cuda/device/cuda_device.cpp",
    ("player/mpi/mpi_renderer.cpp", "rank %d: %s"): "the rest is a message of another rank",
    ("runtime/cuda/device/cuda_device.cpp", "cuda: "): "the rest is a text of failure() in the same file",
}

OBJECT, EXPECTED, REMEDY = "the file or object", "what was expected", "what to do"
STRING = r'"(?:[^"\\\n]|\\.)*"'
TOKEN = re.compile(r'R"(\w*)\(.*?\)\1"|' + STRING + r"|'(?:[^'\\\n]|\\.)+'|//[^\n]*|/\*.*?\*/|[(){}]", re.S)
MADE = re.compile(r"\bError\((?!ErrorCode \w)|\bCLI::\w+Error\(|"
                  r"\bfail\((?=report, ErrorCode::)|\bfailure\((?=ErrorCode::)")
HELPER = re.compile(r"\[\[noreturn\]\]\s+(?:inline |static )*void (\w+)\(|\bauto (\w+) = \[[^\]]*\]\(")
DEFINITION = re.compile(r"\b(?:void (?:\w+::)*|auto )(\w+)(?: = \[[^\]]*\])?\(")
CONSTANT = re.compile(r"\bconstexpr const char\* (k\w+) = (" + STRING + ")")


def end_of(code, start):
    """The position behind the bracket that closes the first one behind `start`."""
    depth = 0
    for match in TOKEN.finditer(code, start):
        depth += (match[0] in "({") - (match[0] in ")}")
        if depth == 0 and match[0] in ")}":
            return match.end()
    raise SystemExit(f"no bracket closes: {code[start:start + 80]!r}")


def lacking(text):
    expected = text.find(", expected ")
    found = text if expected < 0 else text[:expected]
    parts = {OBJECT: ": " in found, EXPECTED: expected >= 0, REMEDY: "; " in text[max(expected, 0):]}
    return {part for part, is_there in parts.items() if not is_there}


class Source:
    def __init__(self, path):
        self.name = path.relative_to(ROOT).as_posix()
        self.header = self.name.rsplit(".")[0] + ".h"
        comment = lambda match: re.sub(r"[^\n]", " ", match[0]) if match[0][0] == "/" else match[0]
        self.code = TOKEN.sub(comment, path.read_text())
        self.constants = dict(CONSTANT.findall(self.code))
        self.declared = {match[1] or match[2] for match in HELPER.finditer(self.code)
                         if match[1] or self.throws(match.end())}
        self.needs = {}  # by helper: what its callers have to say

    def throws(self, at):
        return re.match(r"[^{;]*\{\s*throw Error\(", self.code[end_of(self.code, at - 1):])

    def find_bodies(self, names):
        self.bodies = []
        for match in DEFINITION.finditer(self.code):
            end = end_of(self.code, match.end() - 1)
            if match[1] in names and re.match(r"[^{;(]*\{", self.code[end:]):
                self.bodies.append((match.start(), end_of(self.code, end), match[1]))
                self.needs[match[1]] = set()

    def literals(self, begin):
        code = self.code[begin:end_of(self.code, begin)]
        code = re.sub(r"\bk[A-Z]\w*", lambda name: self.constants.get(name[0], name[0]), code)
        return "".join(text[1:-1] for text in re.findall(STRING, code))

    def constructions(self):
        """(position, its literals, what they lack)"""
        for match in MADE.finditer(self.code):
            text = self.literals(match.start())
            missing = lacking(text)
            if "ErrorCode::Internal" in self.code[match.start():end_of(self.code, match.start())]:
                missing = set() if re.search("this is a bug.* report it", text) else {"that it is a bug to report"}
            elif match[0] == "failure(":
                missing.discard(OBJECT)  # the callers of cudaStatus() say it
            yield match.start(), text, missing

    def calls(self, others):
        """(position, its literals, what they lack) of the calls of helpers"""
        near = [self] + [other for other in others if f'#include "{other.header}"' in self.code]
        heads = {match.start(1) for match in DEFINITION.finditer(self.code)}
        for match in re.finditer(r"\b(\w+)\(", self.code):
            home = next((source for source in near if match[1] in source.needs and
                         (source is self or match[1] in declared.get(source.header, ()))), None)
            if home and home.needs[match[1]] and match.start() not in heads:
                text = self.literals(match.start())
                yield match.start(), text, home.needs[match[1]] & lacking(text)


sources = [Source(path) for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*")) if path.suffix in SUFFIXES]
declared = {source.name: source.declared for source in sources}
problems, count, forwarded = [], 0, set()


def check(source, at, text, missing):
    global count
    count += 1
    if missing and (source.name, text) in FORWARDED:
        forwarded.add((source.name, text))
    elif missing:
        line = source.code.count("\n", 0, at) + 1
        problems.append(f"{source.name}:{line}: does not say {' or '.join(sorted(missing))}: {text!r}")


for source in sources:
    source.find_bodies(source.declared | declared.get(source.header, set()))
    for at, text, missing in source.constructions():
        helper = next((name for begin, end, name in source.bodies if begin <= at < end), None)
        if helper:
            source.needs[helper] |= missing
        else:
            check(source, at, text, missing)
for source in sources:
    for at, text, missing in source.calls(sources):
        check(source, at, text, missing)
problems += [f"FORWARDED: {file} has no {text!r} that lacks something" for file, text in FORWARDED.keys() - forwarded]
print("\n".join(problems) or f"each of {count} messages says what was found, what was expected and what to do")
sys.exit(bool(problems))
