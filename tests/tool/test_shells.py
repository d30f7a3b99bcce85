#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Completions that bash, zsh and fish offer for gsc and gsc-play. The shells are run; one that is not there is skipped.

test_shells.py PROGRAM...    gsc-play, and gsc where it was built
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import shells

PROGRAMS = [pathlib.Path(name).resolve() for name in sys.argv[1:]]
FILES = ("city.gsc", "my file.gsc", "it's.gsc", "notes.txt", "path.json", "path.jsonl", "points.ply",
         "my model/inside.gsc", "models/notes.txt", ".hidden/secret.gsc")
FOLDERS, MODELS = {"models", "my model"}, {"city.gsc", "my file.gsc", "it's.gsc"}

# line, what is offered and nothing else
EXACTLY = [
    ("gsc con", {"convert"}),
    ("gsc co", {"convert", "compare", "compare-pictures", "completion"}),
    ("gsc sample ci", {"city"}),
    ("gsc sample r", {"room", "replicate"}),
    ("gsc help sam", {"sample"}),
    ("gsc help sample ci", {"city"}),
    ("gsc help convert ", {"checkpoint", "file", "output"}),
    ("gsc man sample s", {"street"}),
    ("gsc completion ", {"bash", "zsh", "fish"}),
    ("gsc convert x --mem", {"--memory-budget"}),
    ("gsc convert x --memory-budget 1G --mem", set()),
    ("gsc convert x --memory-budget=1G --mem", set()),
    ("gsc convert x --memory-budget ", set()),
    ("gsc convert x --verify --veri", set()),
    ("gsc convert x --nonsense", set()),
    ("gsc convert x --sensitivity s", {"sampled"}),
    ("gsc convert x --sensitivity ", {"none", "sampled"}),
    ("gsc convert x --format=j", {"json"}),
    ("gsc convert x --format=", {"json", "text"}),
    ("gsc info ", MODELS | FOLDERS),
    ("gsc info c", {"city.gsc"}),
    ("gsc info no", set()),
    ("gsc info my\\ f", {"my file.gsc"}),
    ("gsc info 'my f", {"my file.gsc"}),
    ('gsc info "my f', {"my file.gsc"}),
    ('gsc info "it', {"it's.gsc"}),
    ("gsc info it", {"it's.gsc"}),
    ("gsc info my\\ model/", {"inside.gsc"}),
    ("gsc info models/", set()),
    ("gsc info ./m", {"models", "my model", "my file.gsc"}),
    ("gsc info ~/c", {"city.gsc"}),
    ("gsc info .hi", {".hidden"}),
    ("gsc convert ", {"points.ply"} | FOLDERS),
    ("gsc convert x -o ", MODELS | FOLDERS),
    ("gsc convert x -o c", {"city.gsc"}),
    ("gsc convert x --output=c", {"city.gsc"}),
    ("gsc convert x --report=pa", {"path.json"}),
    ("gsc convert x --scene-dir ", FOLDERS),
    ("gsc convert x --scene-dir=mo", {"models"}),
    ("gsc-play be", {"bench"}),
    ("gsc-play b", {"bench", "backends"}),
    ("gsc-play ci", {"city.gsc"}),
    ("gsc-play --frames 0:4 ", MODELS | FOLDERS),
    ("gsc-play city.gsc --cameras ", {"stored", "path.json"} | FOLDERS),
    ("gsc-play city.gsc --cameras s", {"stored"}),
    ("gsc-play city.gsc --cameras=pa", {"path.json"}),
    ("gsc-play city.gsc --target", {"--target-ms"}),
    ("gsc-play bench --lab", {"--label"}),
    ("gsc-play help st", {"stability"}),
    ("{by_path} he", {"help"}),
]
# line, what is among the offered, what is not
AMONG = [
    ("gsc ", {"convert", "sample", "help"}, MODELS),
    ("gsc-play ", {"bench", "help"} | MODELS | FOLDERS, {"notes.txt", "path.json"}),
    ("gsc convert x --", {"--output", "--help", "--threads"}, MODELS | FOLDERS),
]
# line, the line after TAB in bash and in zsh
COMPLETED = [
    ("gsc con", "gsc convert "),
    ("gsc convert x --format=j", "gsc convert x --format=json "),
    ("gsc convert x --report=pa", "gsc convert x --report=path.json "),
    ("gsc info my\\ f", "gsc info my\\ file.gsc "),
    ('gsc info "my f', 'gsc info "my file.gsc" '),
    ("gsc info it", "gsc info it\\'s.gsc "),
    ("gsc convert x --scene-dir mo", "gsc convert x --scene-dir models/"),
    ("gsc-play ~/ci", "gsc-play ~/city.gsc "),
    ("cd . && gsc-play city.gsc --cameras=st", "cd . && gsc-play city.gsc --cameras=stored "),
]
SAID = {"compare": "Compare a .gsc file with", "convert": "Turn a trained model into one .gsc file"}


class Shells(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.work = tempfile.TemporaryDirectory(prefix="gsc_shells_")
        cls.addClassCleanup(cls.work.cleanup)
        work = pathlib.Path(cls.work.name)
        cls.files, cls.scripts = work / "files", {"bash": [], "zsh": [], "fish": []}
        for name in FILES:
            (cls.files / name).parent.mkdir(parents=True, exist_ok=True)
            (cls.files / name).touch()
        for shell, paths in cls.scripts.items():
            for program in PROGRAMS:
                # the name that zsh looks for in fpath; the other two take any
                paths.append(work / shell / f"_{program.name}")
                paths[-1].parent.mkdir(exist_ok=True)
                with paths[-1].open("wb") as script:
                    subprocess.run([program, "completion", shell], stdout=script, check=True)
        path = ":".join([*(str(program.parent) for program in PROGRAMS), os.environ["PATH"]])
        cls.environment = {"PATH": path, "HOME": str(cls.files), "LANG": "C.UTF-8"}
        cls.environment |= {key: value for key, value in os.environ.items() if key.endswith("SAN_OPTIONS")}

    def start(self, name, make):
        if not shutil.which(name):
            self.skipTest(f"skipped: no {name} here")
        shell = make(self.scripts, self.files, self.environment)
        if isinstance(shell, shells.Terminal):
            self.addCleanup(shell.close)
        return shell

    @staticmethod
    def cases(table):
        names = [program.name for program in PROGRAMS]
        for line, *rest in table:
            if "{by_path}" in line or any(f"{name} " in line for name in names):
                yield line.format(by_path=os.path.relpath(PROGRAMS[0], Shells.files)), *rest

    def check_offers(self, shell):
        for line, expected in self.cases(EXACTLY):
            with self.subTest(line=line):
                self.assertEqual(set(shell.offers(line)), expected)
        for line, expected, others in self.cases(AMONG):
            with self.subTest(line=line):
                found = set(shell.offers(line))
                self.assertLessEqual(expected, found)
                self.assertFalse(others & found)

    def check_descriptions(self, shell):
        for line, in self.cases([("gsc co",)]):
            said = shell.offers(line)
            for word, text in SAID.items():
                self.assertTrue(said[word].startswith(text), said)

    def check_lines(self, shell):
        for line, expected in self.cases(COMPLETED):
            with self.subTest(line=line):
                self.assertEqual(shell.typed(line)[0], expected)

    def test_bash(self):
        self.check_offers(self.start("bash", shells.Bash))

    def test_bash_in_a_terminal(self):
        shell = self.start("bash", shells.bash_terminal)
        self.check_lines(shell)
        self.check_offers(shell)

    def test_zsh_in_a_terminal(self):
        shell = self.start("zsh", shells.zsh_terminal)
        self.check_lines(shell)
        self.check_offers(shell)
        self.check_descriptions(shell)

    def test_zsh_with_a_sourced_script(self):
        shell = self.start("zsh", lambda *where: shells.zsh_terminal(*where, sourced=True))
        self.check_lines(shell)

    def test_fish(self):
        shell = self.start("fish", shells.Fish)
        self.check_offers(shell)
        self.check_descriptions(shell)
        for line, in self.cases([("gsc info my",)]):
            self.assertIn(("my model/", ""), shell.complete(line))  # to go on in


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
