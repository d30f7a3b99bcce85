#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks what each folder may include (the table below), and that no folder grows past what one can look over.

usage: check_includes.py
"""
import pathlib
import re
import sys
from collections import defaultdict

# Folder: what its files may include, besides its own. The longest prefix of a file's path counts; "a !b" = a but not b.
PLAIN_STAGE = "format kernels !kernels/reuse"
RULES = {
    "format": "",
    "kernels": PLAIN_STAGE,
    "kernels/frame": "format kernels/math",
    "kernels/math": "format kernels/frame",
    "kernels/reuse": "format kernels",
    "runtime": "format kernels",
    "runtime/cuda/frame_": "format kernels !kernels/reuse runtime !runtime/reuse",
    "runtime/metrics": "format kernels/metrics kernels/frame",
    "runtime/metrics/lpips": "runtime/metrics kernels/threads",
    "runtime/metrics/convolve3x3": "runtime/metrics kernels/simd",
    "runtime/cli": "format",
    "runtime/module": "format",
    "runtime/cameras": "format runtime",
    "runtime/image": "format runtime/module",
    "runtime/records": "format kernels/frame runtime",
    "player": "format kernels/frame kernels/math runtime",
    "convert": "format kernels/frame kernels/math kernels/sensitivity kernels/threads runtime",
    "convert/explicit": "format kernels",
    "convert/explicit/sog": "format kernels convert/explicit convert/input/torch/zip_archive",
    "convert/input": "format runtime/cameras runtime/source_camera",
    "convert/reduce": "format kernels !kernels/reuse runtime convert",
}
MOST_ROOMS = 21  # a source with its header is one, a folder is one
SUFFIXES = {".h", ".cpp", ".cu", ".cuh"}
INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)


def rule_of(path: str) -> tuple[str, str]:
    prefix = max((p for p in RULES if path.startswith(p)), key=len)
    return prefix, RULES[prefix]


def allowed(path: str, included: str) -> bool:
    prefix, rule = rule_of(path)
    if included.startswith(prefix) and "!" not in rule:
        return True
    words = rule.split() + [prefix]
    if any(w[0] == "!" and included.startswith(w[1:]) for w in words):
        return False
    return any(w[0] != "!" and included.startswith(w) for w in words)


def main() -> int:
    root = pathlib.Path(__file__).resolve().parent.parent
    faults, rooms, checked = [], defaultdict(set), 0
    for area in ("format", "kernels", "runtime", "player", "convert"):
        for file in sorted((root / area).rglob("*")):
            path = str(file.relative_to(root))
            if file.suffix not in SUFFIXES or not file.is_file():
                continue
            folder = str(file.parent.relative_to(root))
            parent = str(pathlib.PurePath(folder).parent)
            rooms[parent].add(folder)
            rooms[folder].add(re.sub(r"(_cpu|_cuda|_reference|-inl)?\.\w+$", "", file.name))
            text = file.read_text()
            if "#include <CLI/" in text and folder != "runtime/cli":
                faults.append(f"{path}: includes CLI11, which takes seconds to compile; use runtime/cli/options.h")
            for included in INCLUDE.findall(text):
                checked += 1
                if included.startswith("tests/cuda_emulation/"):
                    continue  # stands for the toolkit's own header
                if "/" in included and not allowed(path, included):
                    faults.append(f"{path}: includes {included}, expected only {rule_of(path)[1] or 'its own folder'}")
    for folder, names in rooms.items():
        if len(names) > MOST_ROOMS:
            faults.append(f"{folder}: {len(names)} rooms, expected at most {MOST_ROOMS}; make a folder of some")
    for fault in faults:
        print(fault)
    print(f"{checked} includes, {len(rooms)} folders, {len(faults)} faults; most rooms: "
          + ", ".join(f"{folder} {len(names)}" for folder, names in
                      sorted(rooms.items(), key=lambda item: -len(item[1]))[:4]))
    assert checked > 500, "hardly anything was read"
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
