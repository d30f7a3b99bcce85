#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks .ci/build.sh, which ./demo.sh runs: its options for CMake with and without a GPU, and what it shows. CMake, the
compiler and the driver's program are stood in for, so nothing is built.

usage: test_build_script.py SOURCE
"""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(sys.argv.pop(1)).resolve()
CMAKE = """echo "$*" >>asked
case $1 in
--preset) echo '-- gsc: without window: Vulkan cannot be found' ;;
--build) for n in 1 2 3; do echo "[$n/3] Building"; done; exit ${BUILD_ENDS:-0} ;;
esac"""


class BuildScript(unittest.TestCase):
    def setUp(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="gsc-build-script-"))
        self.addCleanup(shutil.rmtree, self.folder)
        (self.folder / ".ci").mkdir()
        shutil.copy(SOURCE / ".ci/build.sh", self.folder / ".ci")
        self.put(".ci/setup.sh", 'echo "set-up $*" >>asked')
        self.put("bin/cmake", CMAKE)

    def put(self, name: str, text: str) -> None:
        path = self.folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("#!/bin/bash\n" + text + "\n")
        path.chmod(0o755)

    def build(self, *parts: str, ends: int = 0, **environment: str) -> tuple[str, str]:
        """Runs the script; returns the lines that were asked for and what was shown."""
        names = ("CUDACXX", "CUDA_PATH", "CUDA_HOME", "CMAKE_CUDA_ARCHITECTURES")
        asked = self.folder / "asked"
        asked.unlink(missing_ok=True)
        clean = {name: value for name, value in os.environ.items() if name not in names}
        shim = f"{self.folder}/bin:/usr/bin:/bin"
        run = subprocess.run([".ci/build.sh", *parts], cwd=self.folder, env=clean | {"PATH": shim} | environment, check=False,
                             capture_output=True, text=True, stdin=subprocess.DEVNULL)
        self.assertEqual(run.returncode, ends, run.stderr)
        return asked.read_text(), run.stdout + run.stderr

    def gpus(self, *capabilities: str) -> None:
        self.put("bin/nvidia-smi", f"[ $1 = --query-gpu=compute_cap ] && printf '%s\\n' {' '.join(capabilities)}")
        self.put("toolkit/nvcc", "[ $1 = --list-gpu-arch ] && printf 'compute_%s\\n' 80 89 90 100")

    def test_without_gpu(self) -> None:
        self.put("bin/nvidia-smi", "echo 'NVIDIA-SMI has failed'; exit 9")
        asked, shown = self.build()
        self.assertIn("-DGSC_WITH_CUDA=OFF", asked)
        self.assertIn("-DGSC_BUILD_TESTS=OFF -DGSC_BUILD_BENCH=OFF", asked)
        self.assertIn("build: without CUDA: no NVIDIA GPU", shown)
        self.assertIn("build: without window: Vulkan cannot be found", shown)
        self.assertIn("[1/3]", shown)

    def test_gpus(self) -> None:
        for gpus, expected in ((("9.0", "8.9", "9.0"), "89;90"), (("7.5", "10.0"), "100"), (("15.1",), "90")):
            self.gpus(*gpus)
            asked, shown = self.build(CUDACXX=f"{self.folder}/toolkit/nvcc")
            self.assertIn(f"-DGSC_WITH_CUDA=AUTO -DCMAKE_CUDA_ARCHITECTURES={expected} ", asked)
            self.assertIn(f"build: with CUDA for compute capability {expected.replace(';', ' ')}\n", shown)

    def test_gpu_that_is_too_old(self) -> None:
        self.gpus("7.5")
        self.assertIn("-DGSC_WITH_CUDA=OFF", self.build(CUDACXX=f"{self.folder}/toolkit/nvcc")[0])

    def test_gpus_of_the_environment(self) -> None:
        asked, _ = self.build(CMAKE_CUDA_ARCHITECTURES="80-real;90")
        self.assertIn("-DGSC_WITH_CUDA=ON -DCMAKE_CUDA_ARCHITECTURES=80-real;90 ", asked)

    def test_parts(self) -> None:
        asked, _ = self.build("window", "headset", "figures", "images", "mpi")
        self.assertIn("set-up window headset figures images mpi\n", asked)
        for switch in ("WINDOW", "XR", "FIGURES", "OIIO", "MPI"):
            self.assertIn(f"-DGSC_WITH_{switch}=ON", asked)
        self.assertRegex(asked, "--target .* gsc-play-mpi\n")

    def test_failure_names_the_log(self) -> None:
        _, shown = self.build(ends=4, BUILD_ENDS="1")
        self.assertIn("[3/3] Building\nbuild: the build failed; the whole log is build/build.log", shown)


if __name__ == "__main__":
    unittest.main()
