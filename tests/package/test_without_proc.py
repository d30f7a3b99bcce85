#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The programs find their modules and do their work where /proc is empty, as in a chroot or a sandbox; where a module is
missing, the message names the folders that were looked in.

usage: test_without_proc.py GSC GSC_PLAY
"""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

GSC, PLAY = (Path(a).resolve() for a in sys.argv[1:3])
USER = [] if os.geteuid() == 0 else ["--user", "--map-root-user"]
ENTER = ["unshare", "--mount", *USER, "sh", "-c", 'mount -t tmpfs none /proc && exec "$0" "$@"']


def may_enter() -> bool:  # the address sanitizer reads /proc itself
    return b"__asan_init" not in GSC.read_bytes() and bool(shutil.which("unshare")) and subprocess.run([*ENTER, "test", "!", "-e", "/proc/self"],
                                                            capture_output=True, check=False).returncode == 0


class WithoutProc(unittest.TestCase):
    def setUp(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="gsc-without-proc-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def run_it(self, *command, code: int = 0, proc: bool = False, cwd=None, **environment: str) -> str:
        run = subprocess.run([*([] if proc else ENTER), *map(str, command)], cwd=cwd or self.folder, capture_output=True,
                             text=True, check=False, env={**os.environ, **environment})
        self.assertEqual(run.returncode, code, run.stderr)
        return run.stdout + run.stderr

    @unittest.skipUnless(may_enter(), "this user may not mount")
    def test_all_commands(self) -> None:
        self.run_it(GSC, "sample", "room", "--anchors", 500, "-o", "room", "-q")
        self.run_it(GSC, "convert", "room", "-o", "room.gsc", "-q")
        self.run_it(GSC, "sample", "paths", "room.gsc", "-o", "paths", "--only", "walk")
        self.assertIn("peak memory", self.run_it(GSC, "convert", "room", "-o", "room.gsc", "-w"))
        self.run_it(GSC, "validate", "room.gsc")
        self.run_it(GSC, "info", "room.gsc", "--format", "json")
        self.run_it(GSC, "export", "room.gsc", "--to", "spz", "--sh", 0, "-o", "room.spz", "-q")
        self.run_it(GSC, "export", "room.gsc", "--to", "vdb", "-o", "room.vdb", "-q")
        self.run_it(PLAY, "room.gsc", "--backend", "cpu", "--size", "16x16", "--frames", "0:1", "--out", "{frame}.pfm",
                    "--stats", "s.jsonl", "-q")
        self.run_it(PLAY, "bench", "room.gsc", "--backend", "cpu", "--size", "16x16", "--measure", 2, "--warmup", 0, "-q")

    @unittest.skipUnless(may_enter(), "this user may not mount")
    def test_every_way_to_start(self) -> None:
        self.run_it(GSC, "sample", "room", "--anchors", 500, "-o", "room", "-q")
        (self.folder / "link").symlink_to(GSC)
        (self.folder / "links").mkdir()
        (self.folder / "links/gsc").symlink_to("../link")
        loader = next(iter(Path("/lib64").glob("ld-linux*.so.*")), None)
        for name, path in ((GSC, ""), (os.path.relpath(GSC, self.folder), ""), ("gsc", f"{GSC.parent}:"), ("./link", ""),
                           ("gsc", f"{self.folder}/links:"), *([(f"{loader} {GSC}", "")] if loader else [])):
            for proc in (False, True):
                with self.subTest(name=str(name), path=path, proc=proc):
                    self.run_it(*str(name).split(" "), "convert", "room", "-o", "room.gsc", "-w", "-q", proc=proc,
                                PATH=path + os.environ["PATH"])

    def test_the_current_folder_is_not_looked_at(self) -> None:
        """It may hold a module of the same name: found in PATH, the program's own name is no path."""
        alone = self.folder / "alone/gsc"
        alone.parent.mkdir()
        shutil.copy(GSC, alone)
        self.run_it(GSC, "sample", "room", "--anchors", 500, "-o", "room", "-q", proc=True)
        shutil.copy(GSC, self.folder / "gsc")
        for module in (GSC.parent / "../lib/gsc").resolve().glob("*.so"):
            shutil.copy(module, self.folder / module.name)
        for proc in (True, False) if may_enter() else (True,):
            said = self.run_it("gsc", "convert", "room", "-o", "room.gsc", "-q", code=5, proc=proc,
                               PATH=f"{alone.parent}:{os.environ['PATH']}")
            self.assertIn(f"not found, expected it in {alone.parent.resolve()}", said)

    def test_a_missing_module_is_said(self) -> None:
        alone = self.folder / "some/where/gsc"
        alone.parent.mkdir(parents=True)
        shutil.copy(GSC, alone)
        self.run_it(GSC, "sample", "room", "--anchors", 500, "-o", "room", "-q", proc=True)
        for proc in (True, False) if may_enter() else (True,):
            for name in (alone, "some/where/gsc"):
                with self.subTest(proc=proc, name=str(name)):
                    said = self.run_it(name, "convert", "room", "-o", "room.gsc", "-q", code=5, proc=proc)
                    here = self.folder.resolve()
                    self.assertIn(f".so: not found, expected it in {here}/some/where or in {here}/some/lib/gsc;", said)
        (self.folder / "some/lib/gsc").mkdir(parents=True)
        for module in (GSC.parent / "../lib/gsc").resolve().glob("*.so"):
            shutil.copy(module, self.folder / "some/lib/gsc")
        self.run_it(alone, "convert", "room", "-o", "room.gsc", "-q", proc=True)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
