#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The runtime as others get it.

check_package.py SOURCE CMAKE lean            builds runtime and player alone, looks at what they need, installs them
                                              and lets a project of its own use the package
check_package.py SOURCE CMAKE bundle [FOLDER] builds the preset `portable` and its bundle, or takes that of FOLDER, and
                                              uses it where no other library but glibc is
check_package.py SOURCE CMAKE layers          no source below the converter includes what only the converter may use
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SOURCE, CMAKE, MODE = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3]

# what is on every machine: glibc
GLIBC = re.compile(r"(lib(c|m|pthread|dl|rt)|ld-linux[-\w]*)\.so\.\d+|linux-vdso\.so\.1")
FORBIDDEN = re.compile(r'#\s*include\s*[<"](openvdb|nanovdb|OpenImageIO|draco|torch|zip\.h|yaml-cpp)')
MAY_INCLUDE = {"player/image/oiio_image.cpp"}


def run(*command, **options) -> str:
    result = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, **options)
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


def configure(preset: str, build: pathlib.Path, *more: str) -> None:
    # the options of the preset, those of the ones it inherits first; what only saves time here comes last
    presets = {p["name"]: p for p in json.loads((SOURCE / "CMakePresets.json").read_text())["configurePresets"]}
    options = {}
    while preset:
        options = presets[preset].get("cacheVariables", {}) | options
        preset = presets[preset].get("inherits")
    run(CMAKE, "-S", SOURCE, "-B", build, "-G", "Ninja", *(f"-D{key}={value}" for key, value in options.items()),
        "-DCMAKE_BUILD_TYPE=Release", *more)


def check_lean() -> None:
    jobs = str(os.cpu_count() or 1)
    with tempfile.TemporaryDirectory(prefix="gsc_lean_") as name:
        folder = pathlib.Path(name)
        build, prefix, consumer = folder / "build", folder / "prefix", folder / "consumer"
        configure("lean", build, "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG", "-DCMAKE_CUDA_ARCHITECTURES=90")
        run(CMAKE, "--build", build, "--parallel", jobs)
        run(CMAKE, "--install", build, "--prefix", prefix)

        libraries = needed(prefix / "bin/gsc-play")
        print("gsc-play needs", *libraries)
        strangers = [library for library in libraries if not GLIBC.fullmatch(library)]
        if strangers:
            sys.exit(f"not one self-contained file: {strangers}")
        print(run(prefix / "bin/gsc-play", "--version").strip())

        run(CMAKE, "-S", SOURCE / "tests/package", "-B", consumer, "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={prefix}")
        run(CMAKE, "--build", consumer)
        run(sys.argv[4], folder / "tiny.gsc")
        stats = json.loads(run(consumer / "consumer", folder / "tiny.gsc"))
        print("the consumer rendered with backend", stats["backend"])


def check_bundle() -> None:
    with tempfile.TemporaryDirectory(prefix="gsc_bundle_") as name:
        folder = pathlib.Path(name)
        bundle = pathlib.Path(sys.argv[4]).resolve() if len(sys.argv) > 4 else folder / "build/bundle"
        if not bundle.exists():
            configure("portable", bundle.parent, "-DCMAKE_CXX_FLAGS_RELEASE=-O0", "-DGSC_WITH_CUDA=OFF")
            run(CMAKE, "--build", bundle.parent, "--parallel", os.cpu_count() or 1, "--target", "bundle")
        glibc = check_bundle_libraries(bundle)
        use_bundle_alone(bundle, glibc, folder / "root")


def check_bundle_libraries(bundle: pathlib.Path) -> set[str]:
    """Every library that the loader takes lies in the bundle, or is glibc's: those are returned."""
    glibc = set()
    for program in ("gsc", "gsc-play"):
        for line in run("ldd", bundle / program, env={"PATH": os.environ["PATH"]}).splitlines():
            library, _, path = line.split(" (")[0].strip().partition(" => ")
            if GLIBC.fullmatch(pathlib.Path(library).name):
                glibc.add(path or library)
            elif program == "gsc-play" or pathlib.Path(path).parent != bundle:
                sys.exit(f"{program} takes {library} from {path or 'nowhere'}")
    files = [f for f in bundle.iterdir() if not f.is_symlink()]
    versions = re.findall(r"\(GLIBC_2\.(\d+)\)", run("objdump", "-T", *files))
    print(f"the bundle: {len(files) - 2} libraries, {sum(f.stat().st_size for f in files) / 1e6:.0f} MB, "
          f"runs with glibc 2.{max(map(int, versions))} or later")
    return glibc


def use_bundle_alone(bundle: pathlib.Path, glibc: set[str], root: pathlib.Path) -> None:
    """Samples, converts and plays in a root folder that holds the bundle, glibc and nothing else."""
    shutil.copytree(bundle, root / "bundle", symlinks=True)
    for library in glibc:
        if library.startswith("/"):
            (root / library[1:]).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(library, root / library[1:])
    (root / "tmp").mkdir()
    path = os.environ["PATH"] + ":/usr/sbin:/sbin"
    enter = [shutil.which("chroot", path=path), root]
    if os.geteuid() != 0:
        enter = [shutil.which("unshare", path=path), "--user", "--map-root-user", *enter]
    if None in enter or subprocess.run([*enter, "/bundle/gsc-play", "--version"], capture_output=True).returncode != 0:
        print("skipped: this user may not chroot; the libraries were looked at, nothing was run")
        sys.exit(77)
    for command in ("gsc sample city --anchors 2000 -o /tmp/city -q",
                    "gsc sample replicate /tmp/city --anchors 5000 -o /tmp/tiles -q",
                    "gsc convert /tmp/tiles -o /tmp/tiles.gsc --verify -q",
                    "gsc validate /tmp/tiles.gsc",
                    "gsc-play /tmp/tiles.gsc --frames 0:2 --size 64x48 --out /tmp/{frame}.pfm -q"):
        # $ORIGIN without /proc
        run(*enter, *f"/bundle/{command}".split(), env={"LD_ORIGIN_PATH": "/bundle"})
    pictures = [(root / f"tmp/{frame}.pfm").stat().st_size for frame in (0, 1)]
    print("alone with glibc it sampled, tiled, converted, validated and rendered pictures of", *pictures, "bytes")


if __name__ == "__main__":
    {"lean": check_lean, "bundle": check_bundle, "layers": check_layers}[MODE]()
