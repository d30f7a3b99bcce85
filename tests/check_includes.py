#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks what each folder may include (the table below), that no folders include each other in a circle, that none grows
past what one can look over, and that no two headers define a class of one name: linkers take either for both.

usage: check_includes.py [--circles]     --circles lists every include that is part of a circle
"""
import pathlib
import re
import sys
from collections import defaultdict

# Folder: what its files may include, besides its own. The longest prefix of a file's path counts; "a !b" = a but not b.
# <gsc/...> stands for the header in the include/ of its layer.
STAGE = "format kernels/include kernels/cuda kernels/frame kernels/math kernels/simd kernels/threads"
# rooms that are no part of libgsc_runtime
SHARED = " ".join(f"!runtime/{room}" for room in ("cameras", "cli", "frames", "image", "module", "records"))
RULES = {
    "format": "",
    "format/include": "",
    "kernels": "format kernels !kernels/reuse !kernels/coarse",
    "kernels/coarse": "format kernels !kernels/reuse",
    "kernels/bin": STAGE + " kernels/project kernels/sort",
    "kernels/blend": STAGE + " kernels/bin kernels/decode kernels/present",
    "kernels/cuda": "format kernels/include kernels/frame kernels/math",
    "kernels/decode": STAGE + " kernels/select",
    "kernels/frame": "format kernels/include kernels/math",
    "kernels/include": "format/include",
    "kernels/math": "format kernels/include",
    "kernels/project": STAGE + " kernels/decode",
    "kernels/reuse": "format kernels",
    "kernels/select": STAGE,
    "kernels/simd": "format",
    "kernels/sort": STAGE + " kernels/decode kernels/project kernels/select",
    "kernels/threads": "format",
    "runtime": "format kernels runtime " + SHARED,
    "runtime/include": "format/include kernels/include",
    "runtime/cameras": "format kernels/include runtime/include",
    "runtime/cli": "format",
    "runtime/frames": "format kernels/include kernels/threads/stopwatch runtime/include runtime/cameras runtime/records runtime/view",
    "runtime/image": "format runtime/module",
    "runtime/cuda/frame": "format kernels !kernels/reuse !kernels/coarse runtime/include runtime/backend runtime/view runtime/cuda/device",
    "runtime/backend": "format kernels runtime/include",
    "runtime/service/policy": "format kernels/include kernels/threads",
    "runtime/metrics": "format kernels/include kernels/metrics kernels/frame runtime/include",
    "runtime/metrics/lpips": "runtime/metrics kernels/threads format/include",
    "runtime/metrics/convolve3x3": "runtime/metrics kernels/simd",
    "runtime/module": "format",
    "runtime/records": "format kernels/include runtime/include runtime/cli",
    "player": "format kernels/include kernels/frame kernels/math kernels/threads/stopwatch runtime !runtime/cpu !runtime/cuda/device !runtime/cuda/frame !runtime/reuse",
    "convert": "format kernels/include kernels/frame kernels/math kernels/sensitivity kernels/threads runtime",
    "convert/bake": "format kernels !kernels/reuse runtime convert/input convert/survey convert/write",
    "convert/chart": "format runtime/cli runtime/module runtime/records convert/page",
    "convert/export": "format kernels runtime/cpu",
    "convert/export/sog": "format kernels convert/export convert/input/torch/zip_archive",
    "convert/grids": "format kernels/threads runtime/module convert/survey convert/write/spatial_index",
    "convert/input": "format runtime/cameras runtime/include",
    "convert/merge": "format runtime/cli runtime/records",
    "convert/page": "",
    "convert/sample": "format kernels/include kernels/threads runtime convert/input convert/survey convert/write/write_gsc",
    "convert/survey": "format kernels/include runtime",
    "convert/viewer": "convert/page",
    "convert/write": "format kernels/include kernels/math kernels/sensitivity kernels/threads runtime/cli runtime/cameras runtime/include runtime/module convert/input convert/survey",
}
# Circles that may be: folders, and why.
CIRCLES: dict[frozenset[str], str] = {}
MOST_ROOMS = 18  # a source with its header is one, a folder is one
SUFFIXES = {".h", ".cpp", ".cu", ".cuh", ".def"}
AREAS = ("format", "kernels", "runtime", "player", "convert")
CLASS = re.compile(r"^(?:class|struct) (\w+)(?: final)?(?: :[^;{]*)?\s*\{", re.MULTILINE)
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]+(?:"([^"]+)"|<(gsc/[^>]+)>)', re.MULTILINE)


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


def folder_of(path: str) -> str:
    """Its room; the headers of a library's interface are one room, whatever folders they are in."""
    folder = path.rpartition("/")[0]
    return folder.partition("/include/gsc")[0] + "/include" if "/include/gsc" in folder else folder


def circles(arrows: dict[str, set[str]]) -> list[set[str]]:
    """The sets of folders of which each reaches every other."""
    def reached(start: str) -> set[str]:
        found, open_ = set(), [start]
        while open_:
            for end in arrows.get(open_.pop(), ()):
                if end not in found:
                    found.add(end)
                    open_.append(end)
        return found
    reach = {folder: reached(folder) for folder in arrows}
    sets = {frozenset(other for other in reach[folder] if folder in reach.get(other, ())) for folder in arrows}
    return sorted((set(members) for members in sets if members), key=sorted)


def check_circles(includes: dict[tuple[str, str], list[str]], tell: bool) -> list[str]:
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b", "d"}}) == [{"b", "c"}], "a circle is not found"
    arrows = defaultdict(set)
    for start, end in includes:
        arrows[start].add(end)
    faults = []
    for members in circles(arrows):
        if frozenset(members) not in CIRCLES:
            faults.append(f"circle: {', '.join(sorted(members))}; let one of them stand below the others")
        for (start, end), lines in sorted(includes.items()):
            if tell and start in members and end in members:
                faults += [f"  {start} -> {end}: {line}" for line in lines]
    return faults


def main() -> int:
    root = pathlib.Path(__file__).resolve().parent.parent
    files = {str(file.relative_to(root)): file for area in AREAS for file in sorted((root / area).rglob("*"))
             if file.suffix in SUFFIXES and file.is_file()}
    public = {path.partition("/include/")[2]: path for path in files if "/include/gsc/" in path}
    faults, rooms, checked, includes, classes = [], defaultdict(set), 0, defaultdict(list), defaultdict(list)
    for path, file in files.items():
        folder = path.rpartition("/")[0]
        rooms[folder.rpartition("/")[0]].add(folder)
        rooms[folder].add(re.sub(r"(_cpu|_cuda|_reference|-inl)?\.\w+$", "", file.name))
        text = file.read_text()
        if "#include <CLI/" in text and folder != "runtime/cli":
            faults.append(f"{path}: includes CLI11, which takes seconds to compile; use runtime/cli/options.h")
        for name in set(CLASS.findall(text)) if file.suffix in {".h", ".cuh"} else ():
            classes[name].append(path)
        for quoted, named in INCLUDE.findall(text):
            checked += 1
            target = public.get(named) if named else quoted
            if "/" not in quoted and not named:
                continue  # beside it, or a library's
            if target not in files or "/include/gsc/" in quoted:
                faults.append(f"{path}: includes {quoted or named}, expected the path of a header in the repository, or "
                              "<gsc/...> of one in an include/")
                continue
            if not allowed(path, target):
                faults.append(f"{path}: includes {target}, expected only {rule_of(path)[1] or 'its own folder'}")
            if "/include/gsc/" in path and not named:
                faults.append(f"{path}: is installed and includes {quoted}, which is not")
            if folder_of(path) != folder_of(target):
                includes[folder_of(path), folder_of(target)].append(f"{path} includes {target}")
    faults += [f"{name}: is a class of {' and of '.join(paths)}, expected one; give one another name"
               for name, paths in sorted(classes.items()) if len(paths) > 1]
    faults += check_circles(includes, "--circles" in sys.argv)
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
