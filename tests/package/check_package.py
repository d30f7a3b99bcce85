#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The runtime as others get it.

check_package.py SOURCE CMAKE lean            builds runtime and player alone, looks at what they need, installs them
                                              and lets a project of its own use the package
check_package.py SOURCE CMAKE layers          no source below the converter includes what only the converter may use
"""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

SOURCE, CMAKE, MODE = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3]

# what a player may need at run time
ALLOWED = re.compile(
    r"lib(stdc\+\+|m|gcc_s|c|pthread|dl|rt|atomic|tbb|hwy|asan|ubsan)\.so(\.[0-9.]+)?|ld-linux[-\w]*\.so\.\d+"
)
FORBIDDEN = re.compile(r'#\s*include\s*[<"](openvdb|nanovdb|OpenImageIO|draco|torch|zip\.h|yaml-cpp)')
MAY_INCLUDE = {"player/image/oiio_image.cpp"}


def run(*command) -> str:
    result = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    if result.returncode != 0:
        print(" ".join(str(c) for c in command), result.stdout[-4000:], result.stderr[-4000:], sep="\n")
        sys.exit(1)
    return result.stdout


def check_layers() -> None:
    bad, count = [], 0
    for folder in ("format", "kernels", "runtime", "player"):
        for path in sorted((SOURCE / folder).rglob("*")):
            name = path.relative_to(SOURCE).as_posix()
            if path.suffix in (".h", ".cpp", ".cu", ".cuh") and name not in MAY_INCLUDE:
                count += 1
                bad += [f"{name}: {line}" for line in path.read_text().splitlines() if FORBIDDEN.search(line)]
    print("\n".join(bad) or f"none of {count} sources below the converter includes what only the converter may use")
    sys.exit(bool(bad) or count == 0)


def needed(binary: pathlib.Path) -> list[str]:
    return re.findall(r"\(NEEDED\).*\[(.+)\]", run("readelf", "-d", binary))


def check_lean() -> None:
    jobs = str(os.cpu_count() or 1)
    with tempfile.TemporaryDirectory(prefix="gsc_lean_") as name:
        folder = pathlib.Path(name)
        build, prefix, consumer = folder / "build", folder / "prefix", folder / "consumer"
        # the options of the preset `lean`; the two that only save time here come last
        presets = {p["name"]: p for p in json.loads((SOURCE / "CMakePresets.json").read_text())["configurePresets"]}
        options = [f"-D{key}={value}" for key, value in presets["lean"]["cacheVariables"].items()]
        run(CMAKE, "-S", SOURCE, "-B", build, "-G", "Ninja", *options, "-DCMAKE_BUILD_TYPE=Release",
            "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG")
        run(CMAKE, "--build", build, "--parallel", jobs)
        run(CMAKE, "--install", build, "--prefix", prefix)

        libraries = needed(prefix / "bin/gsc-play")
        print("gsc-play needs", *libraries)
        strangers = [library for library in libraries if not ALLOWED.fullmatch(library)]
        if strangers:
            sys.exit(f"not expected: {strangers}")
        print(run(prefix / "bin/gsc-play", "--version").strip())

        run(CMAKE, "-S", SOURCE / "tests/package", "-B", consumer, "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={prefix}")
        run(CMAKE, "--build", consumer)
        run(sys.argv[4], folder / "tiny.gsc")
        stats = json.loads(run(consumer / "consumer", folder / "tiny.gsc"))
        print("the consumer rendered with backend", stats["backend"])


if __name__ == "__main__":
    {"lean": check_lean, "layers": check_layers}[MODE]()
