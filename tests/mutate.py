#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Mutation run: some hundred small changes to the sources, one in force at a time, and whether a test notices each. Run
by hand in a clone of its own, because it edits sources.

    git clone . ../mutants && cd ../mutants && tests/mutate.py insert --count 320
    cmake --preset release -DGSC_WITH_CUDA=OFF && cmake --build --preset release
    tests/mutate.py run

`insert` writes all changes at once, each behind a switch (mutate_switch.h), so that there is one build. `run` runs
every test once without a change, sees which changes that test reaches with operands that make a difference, and then
runs for each change those tests, the quickest first, until one fails. It continues where --out ends; --retry runs the
survivors again, after tests were added and built. `report` prints how many were noticed. A change that does not
compile goes by `insert --without ID,ID`, after a `git checkout` of the folders. One that nothing can notice is listed
in mutate_equivalent.txt with the reason. A change that only reads or writes out of bounds is noticed under a sanitizer
alone: preset dev, `run --retry --memory 0 --build build/dev`.

A line of --out is {"id", "area", "file", "line", "before", "after", "result", "by"}; results are noticed, survived,
unreached (survived: no test differs there) and invalid (does not compile for the types in question).
"""
import argparse
import copy
import json
import os
import pathlib
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter

AREAS = {
    "format": ["format"],
    "input": ["convert/input"],
    "write": ["convert/write", "convert/survey", "convert/compare"],
    "kernels": ["kernels"],
    "runtime": ["runtime"],
    "player": ["player"],
    "chart": ["convert/chart", "convert/merge"],
}
EVERYWHERE = {"format/include/gsc/gsc_layout.h", "kernels/include/gsc/frame_types.h"}  # nearly every source would be built again
# other checks than of behaviour, and those that build something
NOT_RUN = r"^(check_|test_layers|test_package|test_installed|test_shells|test_man)"
SECONDS = 150  # a test that takes longer, without a change, is left out

# "file: before -> after", and in the line below why nothing can notice it
EQUIVALENT = set(pathlib.Path(__file__).with_name("mutate_equivalent.txt").read_text().splitlines()[::2])

COMPARISONS = {"<": ("Lt", "<="), "<=": ("Le", "<"), ">": ("Gt", ">="), ">=": ("Ge", ">"), "==": ("Eq", "!="), "!=": ("Ne", "==")}
NAME = r"[A-Za-z_]\w*"


def masked(text: str) -> str:
    """The text without comments, strings and preprocessor lines, every character where it was."""
    def blank(match: re.Match[str]) -> str:
        return re.sub(r"[^\n]", " " if match[0].startswith("/") else "_" if match[0][0] in "R\"'" else ";", match[0])

    text = re.sub(r'R"(\w*)\(.*?\)\1"|//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|(?<![0-9a-zA-Z])\'(?:\\.|[^\'\\\n])+\'', blank,
                  text, flags=re.DOTALL)
    return re.sub(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", blank, text, flags=re.MULTILINE)


def closing(code: str, start: int) -> int:
    depth = 0
    for at in range(start, len(code)):
        depth += (code[at] in "([{") - (code[at] in ")]}")
        if depth == 0:
            return at
    return len(code)


def operand(code: str, at: int, step: int, stops: str) -> int:
    """Where the operand ends that lies before (step -1) or behind (+1) position at."""
    depth = 0
    while 0 <= at < len(code):
        opens, closes = code[at] in "([{", code[at] in ")]}"
        if depth == 0 and (opens and step < 0 or closes and step > 0 or code[at] in ";,?"):
            break
        if depth == 0 and code[at] == ":" and code[at - 1] != ":" and code[at + 1] != ":":
            break
        if depth == 0 and code[at] == "=" and code[at - 1] not in "=!<>" and code[at + 1] in " \n":
            break
        if depth == 0 and any(code[at:at + 2] == s for s in stops.split()):
            break
        if depth == 0 and step < 0 and re.match(r"\breturn\b", code[at - 5:at + 1]):
            break
        depth += (opens - closes) * step
        at += step
    return at


def changes_of(code: str):
    """(start, end, what a reader would see there, [(start, end, text of the switched form with ID for its number)])."""
    for match in re.finditer(r" (<=|>=|==|!=|<|>) (?=\S)", code):
        name, other = COMPARISONS[match[1]]
        yield match.start(), match.end(), f" {other} ", [(match.start(), match.end(), f" {match[1]} gsc_mutant::{name}{{ID}} {match[1]} ")]
    for match in re.finditer(r" (&&|\|\|) ", code):
        stops = "||" if match[1] == "||" else "|| &&"
        first = operand(code, match.start() - 1, -1, "||" if match[1] == "&&" else "") + 1
        while code[first] in " \n":
            first += 1
        last = operand(code, match.end(), 1, stops)
        while code[last - 1] in " \n":
            last -= 1
        name, other = ("both", "||") if match[1] == "&&" else ("either", "&&")
        yield match.start(), match.end(), f" {other} ", [
            (first, first, f"gsc_mutant::{name}(ID, [&] {{ return static_cast<bool>("),
            (match.start(), match.end(), "); }, [&] { return static_cast<bool>("), (last, last, "); })")]
    for match in re.finditer(r"\bstd::(min|max)\(", code):
        other = {"min": "max", "max": "min"}[match[1]]
        least = "true" if match[1] == "min" else "false"
        yield match.start(), match.end(), f"std::{other}(", [(match.start(), match.end(), f"gsc_mutant::Extreme{{ID, {least}}}(")]
    for match in re.finditer(r"\bhn::(Ge|Gt|Lt|Le)\(", code):
        other = {"Ge": "Gt", "Gt": "Ge", "Lt": "Le", "Le": "Lt"}[match[1]]
        yield match.start(), match.end(), f"hn::{other}(", [(match.start(), match.end(), f"GSC_MUTANT_VECTOR(ID, hn::{match[1]}, hn::{other})(")]
    for match in re.finditer(r"(?<= [+-] )1\b(?![.'\w])", code):
        other = "2" if code[match.start() - 2] == "+" else "0"
        yield match.start(), match.end(), other, [(match.start(), match.end(), f"gsc_mutant::number(ID, 1, {other})")]
    for match in re.finditer(r"(?<![\w.])\d+\.\d*(e-?\d+)?f?(?![\w.])", code):
        value = float(match[0].rstrip("f"))
        other = (repr(value * 1.25) if value else "0.1") + ("f" if match[0].endswith("f") else "")
        yield match.start(), match.end(), other, [(match.start(), match.end(), f"gsc_mutant::number(ID, {match[0]}, {other})")]
    for match in re.finditer(r"(?<![\w:.>\[<])((?:[a-z]\w*::)*k[A-Z]\w*)\b(?!\s*[\[(<{]|::|\s*=[^=]|[>\]])", code):
        other = f"other({match[1]})"
        yield match.start(), match.end(), other, [(match.start(), match.end(), f"gsc_mutant::constant(ID, {match[1]})")]
    for match in re.finditer(r"\bif \(", code):
        end = closing(code, match.end() - 1)
        condition = code[match.end():end]
        if not re.search(r";|\b(auto|const)\b|[\w>*&] \w+ = ", condition):
            yield match.end(), end, "false", [(match.end(), match.end(), "gsc_mutant::drop(ID, static_cast<bool>("), (end, end, "))")]
        if condition.startswith("!"):
            yield match.end(), match.end() + 1, "", [(match.end(), match.end() + 1, "gsc_mutant::Not{ID} * ")]
    for match in re.finditer(r" \* (?=[\w(])", code):
        yield match.start(), match.end(), " / ", [(match.start(), match.end(), " * gsc_mutant::Times{ID} * ")]
    for match in re.finditer(r" \+= (?!\{)", code):
        yield match.start(), match.end(), " -= ", [(match.start(), match.end(), " += gsc_mutant::Plus{ID} = ")]
    for match in re.finditer(rf"(?<=[ (!])((?:{NAME}(?:::|\.|->))*(?!if|for|while|switch|return|sizeof|emplace|make|push|insert|offsetof){NAME})"
                             rf"\(((?!true|false|this){NAME}), ((?!true|false|this){NAME})\)(?!\s*(?:const)?\s*[{{:])", code):
        before = code[code.rfind("\n", 0, match.start()) + 1:match.start()].strip()
        if not (match[2] + match[3]).strip("_") or "___" in match[2] + match[3]:
            continue  # strings
        if not re.search(r"(=|\(|return|,|&&|\|\||\+|-|\*|!|\{|^)$", before) or match[2] == match[3] or match[1].startswith("std::m"):
            continue
        yield match.start(2), match.end(3), f"{match[3]}, {match[2]}", [(match.start(1), match.end(1), f"GSC_MUTANT_SWAP(ID, {match[1]})")]


def candidates(root: pathlib.Path, folders: list[str]) -> list[dict]:
    found = []
    for folder in folders:
        for path in sorted((root / folder).rglob("*")):
            file = str(path.relative_to(root))
            if path.suffix not in (".cpp", ".h") or "cuda" in file or file in EVERYWHERE:
                continue
            text = path.read_text()
            code = masked(text)
            fixed = [match.span() for match in re.finditer(r"\bconstexpr\b[^;{}()]*=[^;]*;", code)]  # when it is compiled
            for start, end, seen, edits in changes_of(code):
                if any(s <= start < e for s, e in fixed):
                    continue
                first, last = text.rfind("\n", 0, start) + 1, text.find("\n", end)
                line = text[first:last]
                if not line.startswith((" ", "\t")) and not line.startswith(("constexpr", "inline")) or re.search(
                        r"static_assert|template|\brequires\b|\bcase\b|\boperator", line):
                    continue
                if line.strip().startswith("{k") and "constant(" in edits[0][2]:
                    continue  # a table of constants
                if "hwy/" in text and "GSC_MUTANT_SWAP" in edits[0][2]:
                    continue  # a lambda there needs attributes
                found.append({"file": file, "line": text.count("\n", 0, start) + 1, "edits": edits,
                              "before": " ".join(line.split()),
                              "after": " ".join((text[first:start] + seen + text[end:last]).split())})
    return found


def key_of(mutant: dict) -> str:
    return f"{mutant['file']}: {mutant['before']} -> {mutant['after']}"


def insert(root: pathlib.Path, options: argparse.Namespace) -> None:
    if subprocess.run(["git", "diff", "--quiet", "HEAD", "--", *sum(AREAS.values(), [])], cwd=root, check=False).returncode:
        sys.exit("mutate.py: the sources have changes, expected a clean clone")
    chance = random.Random(options.seed)
    chosen = []
    for folders in AREAS.values():
        area = next(name for name, f in AREAS.items() if f == folders)
        taken: dict[str, list[tuple[int, int]]] = {}
        places = candidates(root, folders)
        chance.shuffle(places)
        print(f"{area}: {len(places)} places")
        left = options.count // len(AREAS)
        for place in places:
            spans = taken.setdefault(place["file"], [])
            if left == 0 or key_of(place) in EQUIVALENT:
                continue
            if any(s <= end and start <= e for start, end, _ in place["edits"] for s, e in spans):
                continue  # another change is in this place
            spans += [(start, end) for start, end, _ in place["edits"]]
            place |= {"id": len(chosen), "area": area}
            chosen.append(place)
            left -= 1
    without = {int(number) for number in options.without.split(",") if number}
    for file in sorted({mutant["file"] for mutant in chosen}):
        text = (root / file).read_text()
        edits = [(start, end, new.replace("ID", str(mutant["id"]))) for mutant in chosen
                 if mutant["file"] == file and mutant["id"] not in without for start, end, new in mutant["edits"]]
        for start, end, new in sorted(edits, reverse=True):
            text = text[:start] + new + text[end:]
        at = text.find("#pragma once\n") + len("#pragma once\n") if "#pragma once\n" in text else text.find("\n") + 1
        (root / file).write_text(text[:at] + '#include "tests/mutate_switch.h"\n' + text[at:])
    rows = [{name: value for name, value in mutant.items() if name != "edits"} for mutant in chosen if mutant["id"] not in without]
    options.list.write_text("".join(json.dumps(row) + "\n" for row in rows))
    print(f"{len(rows)} changes inserted, listed in {options.list}")


class Test:
    memory = 0  # bytes; 0 = no limit

    def __init__(self, entry: dict):
        self.name = entry["name"]
        self.command = entry["command"]
        properties = {p["name"]: p["value"] for p in entry["properties"]}
        self.folder = properties.get("WORKING_DIRECTORY", ".")
        self.environment = dict(item.split("=", 1) for item in properties.get("ENVIRONMENT", []))
        self.seconds = 0.0
        self.sees: set[int] = set()

    def cases(self) -> list["Test"]:
        """The test cases of a program of doctest, one by one; of others the test itself."""
        if len(self.command) > 2 or "python" in self.command[0]:
            return [self]
        listed = subprocess.run([*self.command, "--list-test-cases"], capture_output=True, text=True, check=True).stdout
        found = []
        for case in listed.splitlines():
            if not case.startswith(("[doctest]", "===")):
                test = copy.copy(self)
                test.name = f"{self.name}: {case}"
                test.command = [*self.command, "--abort-after=1", "--test-case=" + case.replace(",", "?")]
                found.append(test)
        return found

    def passes(self, seconds: float, **environment: str) -> bool:
        scratch = tempfile.mkdtemp(prefix="gsc-mutant-")
        os.chmod(scratch, 0o755)  # some tests go on as another user
        variables = os.environ | self.environment | environment | {"TMPDIR": scratch}

        def limits() -> None:
            for number in (signal.SIGHUP, signal.SIGINT):  # which nohup and a shell's & leave ignored
                signal.signal(number, signal.SIG_DFL)
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            if Test.memory > 0:
                resource.setrlimit(resource.RLIMIT_DATA, (Test.memory, Test.memory))

        start = time.monotonic()
        process = subprocess.Popen(self.command, cwd=self.folder, env=variables, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL, start_new_session=True, preexec_fn=limits)
        try:
            passed = process.wait(seconds) in (0, 77)
        except subprocess.TimeoutExpired:
            passed = False
        finally:
            try:
                os.killpg(process.pid, 9)
            except ProcessLookupError:
                pass
            process.wait()
            shutil.rmtree(scratch, ignore_errors=True)
        self.seconds = self.seconds or time.monotonic() - start
        return passed


def tests_of(build: pathlib.Path, mutants: list[dict], options: argparse.Namespace) -> tuple[list[Test], dict[int, int]]:
    """The tests that pass without a change, with the changes that each sees, and the most that any test saw of a change."""
    entries = json.loads(subprocess.run(["ctest", "--test-dir", str(build), "--show-only=json-v1"], capture_output=True,
                                        text=True, check=True).stdout)["tests"]
    kept: list[Test] = []
    most = {mutant["id"]: 0 for mutant in mutants}
    memory = build / "mutants_seen.json"  # of earlier runs with the same programs
    known = json.loads(memory.read_text()) if memory.exists() else {}

    def keep(test: Test, passed: bool, marks: bytes) -> None:
        marks = marks.ljust(1 << 14, b"\0")
        for number in most:
            most[number] = max(most[number], marks[number])
        test.sees = {number for number in most if marks[number] == 3}
        if passed:
            kept.append(test)

    chosen = [Test(entry) for entry in entries if "command" in entry and os.path.exists(entry["command"][0])
              and re.search(options.tests, entry["name"]) and not re.search(NOT_RUN, entry["name"])]
    for test in [case for test in chosen for case in test.cases()]:
        stamp = [max(os.path.getmtime(f) for f in test.command if os.path.isfile(f)), options.list.stat().st_mtime]
        if test.name in known and known[test.name]["stamp"] == stamp:
            test.seconds, passed, marks = known[test.name]["seconds"], known[test.name]["passed"], bytes.fromhex(known[test.name]["marks"])
            keep(test, passed, marks)
            continue
        with tempfile.NamedTemporaryFile() as seen:
            seen.write(bytes(1 << 14))
            seen.flush()
            passed = test.passes(SECONDS, GSC_MUTANTS_SEEN=seen.name)
            marks = pathlib.Path(seen.name).read_bytes()
        known[test.name] = {"stamp": stamp, "seconds": test.seconds, "passed": passed, "marks": marks.rstrip(b"\0").hex()}
        memory.write_text(json.dumps(known))
        keep(test, passed, marks)
        print(f"{test.name}: {test.seconds:.1f} s, sees {len(test.sees)}{'' if passed else ', fails or takes too long: left out'}", flush=True)
    return sorted(kept, key=lambda test: test.seconds), most


def read_results(path: pathlib.Path) -> dict[int, dict]:
    rows = map(json.loads, path.read_text().splitlines()) if path.exists() else []
    return {row["id"]: row for row in rows}  # the last of a number counts


def run(root: pathlib.Path, options: argparse.Namespace) -> None:
    mutants = [json.loads(line) for line in options.list.read_text().splitlines()]
    done = read_results(options.out)
    survivors = ("survived", "unreached")
    open_ones = [m for m in mutants if (done[m["id"]]["result"] in survivors if m["id"] in done else False) == options.retry
                 and (options.retry or m["id"] not in done) and options.area in ("", m["area"])]
    tests, most = tests_of(root / options.build, open_ones, options)
    kills: Counter[tuple[str, str]] = Counter()
    with options.out.open("a", encoding="utf-8") as out:
        for mutant in open_ones:
            number, by = mutant["id"], ""
            usable = [test for test in tests if number in test.sees]
            # what noticed most in this file first, as far as it is quick
            usable.sort(key=lambda test: test.seconds / (1 + kills[mutant["file"], test.name]))
            for test in usable:
                if not test.passes(20 + 8 * test.seconds, GSC_MUTANT=str(number)):
                    by = test.name
                    kills[mutant["file"], by] += 1
                    break
            result = "noticed" if by else "invalid" if most[number] == 2 else "survived" if usable else "unreached"
            out.write(json.dumps(mutant | {"result": result, "by": by}) + "\n")
            out.flush()
            print(f"{number} {result}: {mutant['file']}:{mutant['line']}: {mutant['before']} -> {mutant['after']} {by}", flush=True)
    report(root, options)


def report(_root: pathlib.Path, options: argparse.Namespace) -> None:
    rows = read_results(options.out).values()
    for area in [*AREAS, ""]:
        counts = Counter(row["result"] for row in rows if area in ("", row["area"]))
        listed = sum(key_of(row) in EQUIVALENT for row in rows if area in ("", row["area"]) and row["result"] in ("survived", "unreached"))
        tried = counts["noticed"] + counts["survived"] + counts["unreached"]
        print(f"{area or 'all':8} {counts['noticed']:4} of {tried:4} noticed ({100 * counts['noticed'] / max(tried, 1):3.0f} %), "
              f"{listed} of the others are listed as without effect, {counts['invalid']} did not compile")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("do", choices=("insert", "run", "report"))
    parser.add_argument("--count", type=int, default=320)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--without", default="", help="numbers of changes that do not compile, with commas")
    parser.add_argument("--list", type=pathlib.Path, default="mutants.jsonl", help="the changes that were inserted")
    parser.add_argument("--out", type=pathlib.Path, default="mutants_results.jsonl")
    parser.add_argument("--build", default="build/release")
    parser.add_argument("--area", choices=["", *AREAS], default="")
    parser.add_argument("--tests", default="", help="only tests whose name matches")
    parser.add_argument("--memory", type=int, default=12, help="GiB that a test may take; 0 = any, as sanitizers need")
    parser.add_argument("--retry", action="store_true", help="the survivors of --out again")
    options = parser.parse_args()
    Test.memory = options.memory << 30
    options.list, options.out = options.list.absolute(), options.out.absolute()
    {"insert": insert, "run": run, "report": report}[options.do](pathlib.Path(__file__).resolve().parent.parent, options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
