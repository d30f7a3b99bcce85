#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Mutation run: changes one place of the sources at a time and looks whether a test notices. Run by hand, in a clone of
its own, because it edits sources; takes some 20 seconds a mutation.

    git clone . /tmp/mutants && cd /tmp/mutants
    cmake --preset release -DGSC_WITH_CUDA=OFF && cmake --build --preset release
    tests/mutate.py --count 300 --out mutants.jsonl

Ends with how many were noticed. A line of --out is {"file", "line", "before", "after", "result"}: noticed, survived,
or invalid (did not compile). A mutation that nothing can notice is listed in EQUIVALENT with the reason.
"""
import argparse
import json
import pathlib
import random
import re
import subprocess
import sys

# Sources, what is built of them, and the tests that answer for them.
AREAS = {
    "format": (["format"], r"^test_format_"),
    "input": (["convert/input"], r"^test_(ply|torch|input|checkpoint|trained_models)"),
    "bake": (["convert/bake"], r"^test_bake"),
    "kernels": (["kernels"], r"^test_kernel_|^test_parallel"),
    "runtime": (["runtime"], r"^test_(reuse|camera$|stereo|lod|local_model|scene|frame|metrics|camera_motion|merged)"),
    "player": (["player"], r"^test_(camera_file|play_options|run_rows|sweep|roofline|runner|accuracy|out_pattern|image_io|tool|play_cli|play_outputs|bench_cli)"),
}
OPERATORS = [  # pattern, replacement
    (r" < (?![a-z_]*>)", " <= "), (r" <= ", " < "), (r" > ", " >= "), (r" >= ", " > "),
    (r" == ", " != "), (r" != ", " == "), (r" && ", " || "), (r" \|\| ", " && "),
    (r"std::min\(", "std::max("), (r"std::max\(", "std::min("),
    (r"hn::Ge\(", "hn::Gt("), (r"hn::Gt\(", "hn::Ge("), (r"hn::Lt\(", "hn::Le("), (r"hn::Le\(", "hn::Lt("),
    (r" \+ 1\b", " + 2"), (r" - 1\b", " - 0"), (r"\b0\.5f\b", "0.6f"), (r"\b255\.0f\b", "200.0f"),
    (r"if \(!", "if ("), (r" \* ", " / "), (r"\+= ", "-= "),
]
# "file: code": why nothing can notice it
EQUIVALENT: dict[str, str] = {}


def candidates(root: pathlib.Path, folders: list[str]) -> list[tuple[pathlib.Path, int, int, int, str]]:
    found = []
    for folder in folders:
        for file in sorted((root / folder).rglob("*")):
            if file.suffix not in (".cpp", ".h") or "cuda" in str(file.relative_to(root)):
                continue
            for number, line in enumerate(file.read_text().split("\n")):
                code = line.split("//")[0]
                stripped = code.strip()
                if not stripped or stripped.startswith(("#", "template", "static_assert", "*")) or '"' in code:
                    continue
                for pattern, replacement in OPERATORS:
                    for match in re.finditer(pattern, code):
                        found.append((file, number, match.start(), match.end(), replacement))
    return found


def run(command: list[str], seconds: int) -> bool:
    try:
        return subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=seconds,
                              check=False).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", default="build/release")
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--area", choices=sorted(AREAS), action="append", help="only this; may be given several times")
    parser.add_argument("--out", default="mutants.jsonl")
    options = parser.parse_args()
    root = pathlib.Path(__file__).resolve().parent.parent
    if subprocess.run(["git", "diff", "--quiet", "HEAD"], cwd=root, check=False).returncode != 0:
        sys.exit("mutate.py: the tree has changes, expected a clean clone; commit them or clone it")
    chance = random.Random(options.seed)
    areas = options.area or sorted(AREAS)
    counts = {"noticed": 0, "survived": 0, "invalid": 0}
    with open(options.out, "a", encoding="utf-8") as out:
        for area in areas:
            folders, tests = AREAS[area]
            listing = subprocess.run(["ctest", "--test-dir", options.build, "-N", "-R", tests], capture_output=True,
                                     text=True, check=True).stdout
            targets = [name for name in re.findall(r"Test +#\d+: (\S+)", listing) if not name.endswith(("_cli", "_outputs"))]
            targets += ["gsc", "gsc-play"]  # what the tests of command lines run
            places = candidates(root, folders)
            wanted = options.count // len(areas)
            for file, number, start, end, replacement in chance.sample(places, min(3 * wanted, len(places))):
                if wanted == 0:
                    break
                before = file.read_text()
                lines = before.split("\n")
                changed = lines[number][:start] + replacement + lines[number][end:]
                name = f"{file.relative_to(root)}: {lines[number].strip()}"
                if name in EQUIVALENT:
                    continue
                try:
                    file.write_text("\n".join(lines[:number] + [changed] + lines[number + 1:]))
                    if not run(["cmake", "--build", options.build, "--target", *targets], 900):
                        result = "invalid"
                    else:
                        noticed = not run(["ctest", "--test-dir", options.build, "-R", tests, "-j2",
                                           "--stop-on-failure", "--timeout", "120"], 600)
                        result = "noticed" if noticed else "survived"
                finally:
                    file.write_text(before)
                counts[result] += 1
                wanted -= result != "invalid"
                row = {"file": str(file.relative_to(root)), "line": number + 1, "before": lines[number].strip(),
                       "after": changed.strip(), "result": result}
                out.write(json.dumps(row) + "\n")
                out.flush()
                print(f"{result}: {row['file']}:{row['line']}: {row['after']}", flush=True)
    tried = counts["noticed"] + counts["survived"]
    print(f"{counts['noticed']} of {tried} noticed ({100 * counts['noticed'] / max(tried, 1):.0f} %), "
          f"{counts['invalid']} did not compile")
    return 0


if __name__ == "__main__":
    sys.exit(main())
