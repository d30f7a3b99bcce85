#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The runtime as others get it.

check_package.py SOURCE CMAKE portable        builds the preset `portable`, looks at what the player needs, installs it,
                                              lets a project of its own use the package, and does what `bundle` does
check_package.py SOURCE CMAKE bundle FOLDER   uses the bundle in FOLDER where no other library but glibc is
check_package.py SOURCE CMAKE installed BUILD WRITE_TINY_GSC
                                              installs BUILD, moves the tree and uses it: what a start loads and takes,
                                              modules found, missing and of another version
check_package.py SOURCE CMAKE layers          no source below the converter includes what only the converter may use
"""

import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

SOURCE, CMAKE, MODE = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2], sys.argv[3]

# what is on every machine: glibc
GLIBC = re.compile(r"(lib(c|m|pthread|dl|rt)|ld-linux[-\w]*)\.so\.\d+|linux-vdso\.so\.1")
FORBIDDEN = re.compile(r'#\s*include\s*[<"](openvdb|nanovdb|OpenImageIO|draco|torch|zip\.h|yaml-cpp)')
# what a start must do without
HEAVY = re.compile(r"lib(OpenImageIO|opencv|Qt|av|openvdb|rsvg|OpenEXR)")
START_MEMORY = 40  # MB
MAY_INCLUDE = {"runtime/image/oiio_image.cpp"}


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


def check_portable() -> None:
    build = SOURCE / "build/package"  # kept: another run compiles what changed
    with tempfile.TemporaryDirectory(prefix="gsc_portable_") as name:
        folder = pathlib.Path(name)
        prefix, consumer = folder / "prefix", folder / "consumer"
        configure("portable", build, "-DCMAKE_CXX_FLAGS_RELEASE=-O0", "-DGSC_WITH_CUDA=OFF")
        # the programs alone, with nothing left of an earlier run: that installs too
        shutil.rmtree(build / "shell", ignore_errors=True)
        run(CMAKE, "--build", build, "--parallel", os.cpu_count() or 1, "--target", "gsc", "gsc-play")
        run(CMAKE, "--install", build, "--prefix", folder / "alone")
        print(run(folder / "alone/bin/gsc", "--version").strip())
        for target in ("all", "bundle"):
            run(CMAKE, "--build", build, "--parallel", os.cpu_count() or 1, "--target", target)
        run(CMAKE, "--install", build, "--prefix", prefix)

        check_shell_files(prefix)
        libraries = needed(prefix / "bin/gsc-play")
        print("gsc-play needs", *libraries)
        strangers = [library for library in libraries if not GLIBC.fullmatch(library)]
        if strangers:
            sys.exit(f"not one self-contained file: {strangers}")
        print(run(prefix / "bin/gsc-play", "--version").strip())

        run(CMAKE, "-S", SOURCE / "tests/package", "-B", consumer, "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={prefix}")
        run(CMAKE, "--build", consumer)
        run(prefix / "bin/gsc", "sample", "room", "--anchors", "500", "-o", "room", "-q", cwd=folder)
        run(prefix / "bin/gsc", "convert", "room", "-o", "room.gsc", "-q", cwd=folder)
        stats = json.loads(run(consumer / "consumer", folder / "room.gsc"))
        print("the consumer rendered with backend", stats["backend"])
        check_bundle(build / "bundle")


def pages_below(program: pathlib.Path, *path: str) -> list[str]:
    """The page of a command and those of the commands below it, as the program names them."""
    lines = run(program, "__complete", "man", *path, "").splitlines()
    below = [page for line in lines for page in pages_below(program, *path, line.split("\t")[0])]
    return ["-".join((program.name, *path)) + ".1", *below]


def check_shell_files(prefix: pathlib.Path) -> None:
    """Completions and manual pages of the programs that are there, and of no other."""
    share = prefix / "share"
    programs = sorted(p for p in (prefix / "bin").iterdir() if p.name != "gsc-play-mpi")  # its page is gsc-play's
    expected = {f"{folder}/{before}{program.name}{after}" for program in programs for folder, before, after in (
        ("bash-completion/completions", "", ""), ("zsh/site-functions", "_", ""), ("fish/vendor_completions.d", "", ".fish"))}
    expected |= {f"man/man1/{page}" for program in programs for page in pages_below(program)}
    if (prefix / "bin/gsc-play-mpi").exists():
        expected.add("man/man1/gsc-play-mpi.1")
    found = {f.relative_to(share).as_posix() for f in share.rglob("*") if f.is_file() and f.stat().st_size > 0}
    found = {name for name in found if not name.startswith("doc/")}
    if found != expected:
        sys.exit(f"share/ lacks {sorted(expected - found)} and has {sorted(found - expected)} too many")
    if shutil.which("man"):
        for name in sorted(f.stem for f in share.glob("man/man1/gsc*.1") if (prefix / "bin" / f.stem).exists()):
            page = run("man", "-M", share / "man", name, env=os.environ | {"MANPAGER": "cat"})
            if "SYNOPSIS" not in page:
                sys.exit(f"man {name} shows {page!r}")
    print(len(found), "completions and manual pages lie in share/")


def check_start(program: pathlib.Path, option: str, log: pathlib.Path) -> None:
    """Holds the libraries and the peak memory of a start to bounds, and tells its time."""
    run(program, option, env=os.environ | {"LD_DEBUG": "libs", "LD_DEBUG_OUTPUT": log})
    loaded = set(re.findall(r"calling init: (\S+)", "".join(f.read_text() for f in log.parent.glob(log.name + ".*"))))
    best, peak = math.inf, 0
    for _ in range(5):
        start = time.perf_counter()
        process = subprocess.Popen([program, option], stdout=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)
        best, peak = min(best, time.perf_counter() - start), max(peak, usage.ru_maxrss / 1024)
        process.returncode = status
    print(f"{program.name} {option}: {len(loaded)} libraries, {best * 1e3:.0f} ms, {peak:.0f} MB at most")
    heavy = sorted(library for library in loaded if HEAVY.match(pathlib.Path(library).name))
    if not loaded or heavy or peak > START_MEMORY:
        sys.exit(f"expected at most {START_MEMORY} MB and none of {HEAVY.pattern}, found {heavy}")


def expect_refused(message: str, *command, **options) -> None:
    result = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, **options)
    if result.returncode != 5 or not re.search(message, result.stderr):
        sys.exit(f"{command}: expected exit code 5 and {message!r}, found {result.returncode} and {result.stderr!r}")


def check_module(module: pathlib.Path, folder: pathlib.Path, *command) -> None:
    """Run in `folder`, the command needs the module where it was installed, and no other version of it."""
    good = module.read_bytes()
    module.rename(folder / module.name)
    before = sorted(folder.iterdir())
    expect_refused(rf"{module.name}: not found, expected it in .*lib/gsc; install", *command, cwd=folder)
    if sorted(folder.iterdir()) != before:
        sys.exit(f"{command} made something before it missed its module")
    version = re.search(r"project\(gsc VERSION ([\d.]+)", (SOURCE / "CMakeLists.txt").read_text())[1]
    module.write_bytes(good.replace(f"\0{version}, interface".encode(), f"\0{'9' * len(version)}, interface".encode()))
    expect_refused(rf"{module.name}: is of version 9+, interface .*, expected the program's, {version}, interface .*; install", *command, cwd=folder)
    module.write_bytes(b"no library" * 500)
    expect_refused(rf"{module.name}: cannot be loaded \(.+\), expected .+; install", *command, cwd=folder)
    module.write_bytes(good)
    (folder / module.name).unlink()
    run(*command, cwd=folder)


def check_installed() -> None:
    build, write_tiny = (pathlib.Path(a).resolve() for a in sys.argv[4:6])
    with tempfile.TemporaryDirectory(prefix="gsc_installed_") as name:
        folder, moved = pathlib.Path(name), pathlib.Path(name) / "moved"
        run(CMAKE, "--install", build, "--prefix", folder / "prefix")
        (folder / "prefix").rename(moved)
        for program in sorted((moved / "bin").iterdir()):
            for option in ("--version", "--help"):
                check_start(program, option, folder / f"{program.name}{option}")
        check_shell_files(moved)
        modules = {path.stem: path for path in (moved / "lib/gsc").glob("*.so")}
        play, gsc = moved / "bin/gsc-play", moved / "bin/gsc"
        picture = "gsc_image_oiio" in modules
        if runtime := [library for library in needed(play) if "cuda" in library]:  # the toolkit's is linked in
            sys.exit(f"gsc-play needs {runtime}: not there on a machine that has only a driver")
        if (".exr" in run(play, "--version")) != picture:
            sys.exit(f"--version tells of EXR, or does not; the modules are {sorted(modules)}")
        run(write_tiny, folder / "tiny.gsc")
        view = ("tiny.gsc", "--frames", "0:1", "--size", "64x48", "--backend", "cpu", "--out")
        run(play, *view, "picture.png", cwd=folder)
        if not (folder / "picture.png").read_bytes().startswith(b"\x89PNG"):
            sys.exit("picture.png is no PNG")
        if picture:
            check_module(modules["gsc_image_oiio"], folder, play, *view, "new/picture.exr")
        if gsc.exists():
            run(gsc, "sample", "room", "--anchors", "500", "-o", "room", "-q", cwd=folder)
            check_module(modules["gsc_index_openvdb"], folder, gsc, "convert", "room", "-o", "room.gsc", "-q")
        print("moved, it wrote what it should with", *sorted(modules))


def check_bundle(bundle: pathlib.Path) -> None:
    glibc = check_bundle_libraries(bundle)
    with tempfile.TemporaryDirectory(prefix="gsc_bundle_") as name:
        use_bundle_alone(bundle, glibc, pathlib.Path(name) / "root")


def check_bundle_libraries(bundle: pathlib.Path) -> set[str]:
    """Every library that the loader takes lies in the bundle, or is glibc's: those are returned."""
    beside = {f.name for f in (*bundle.glob("completions/*"), *bundle.glob("man/man1/*"))}
    if missing := {"gsc", "_gsc-play", "gsc.fish", "gsc.1", "gsc-play-bench.1"} - beside:
        sys.exit(f"completions/ and man/ lack {missing}")
    glibc = set()
    modules = sorted(bundle.glob("gsc_*.so"))
    alone = not (bundle / "gsc_image_oiio.so").exists()
    for part in (bundle / "gsc", bundle / "gsc-play", *modules):
        for line in run("ldd", part, env={"PATH": os.environ["PATH"]}).splitlines():
            library, _, path = line.split(" (")[0].strip().partition(" => ")
            if GLIBC.fullmatch(pathlib.Path(library).name):
                glibc.add(path or library)
            elif (alone and part.name == "gsc-play") or pathlib.Path(path).parent != bundle:
                sys.exit(f"{part.name} takes {library} from {path or 'nowhere'}")
    files = [f for f in bundle.iterdir() if f.is_file() and not f.is_symlink()]
    versions = re.findall(r"\(GLIBC_2\.(\d+)\)", run("objdump", "-T", *files))
    print(f"the bundle: {len(modules)} modules, {len(files) - 2 - len(modules)} libraries, {sum(f.stat().st_size for f in files) / 1e6:.0f} MB, "
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
    # all that is needed of /proc: where the program lies, for $ORIGIN and for modules
    (root / "proc/self").mkdir(parents=True)
    (root / "proc/self/exe").symlink_to("/bundle/gsc")
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
        run(*enter, *f"/bundle/{command}".split(), env={})
    pictures = [(root / f"tmp/{frame}.pfm").stat().st_size for frame in (0, 1)]
    print("alone with glibc it sampled, tiled, converted, validated and rendered pictures of", *pictures, "bytes")


if __name__ == "__main__":
    {"portable": check_portable, "bundle": lambda: check_bundle(pathlib.Path(sys.argv[4]).resolve()),
     "installed": check_installed, "layers": check_layers}[MODE]()
