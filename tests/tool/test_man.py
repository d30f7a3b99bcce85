#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The manual page of every command: what man and whatis make of it, and that it tells what --help-all tells.

test_man.py PROGRAM...
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

PROGRAMS = [pathlib.Path(name).resolve() for name in sys.argv[1:]]


def run(*command, **options) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True, **options).stdout


def commands(program, *path):
    """The command and all below it."""
    yield path
    for line in run(program, "__complete", "man", *path, "").splitlines():
        yield from commands(program, *path, line.split("\t")[0])


def plain(roff: str) -> str:
    return re.sub(r"\\f[BIR]|\\&", "", roff).replace("\\-", "-").replace("\\e", "\\")


class Man(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.pages = [(program, path, run(program, "man", *path)) for program in PROGRAMS for path in commands(program)]

    def each(self, check):
        self.assertGreaterEqual(len(self.pages), 7)
        for program, path, page in self.pages:
            with self.subTest(command=" ".join((program.name, *path))):
                check(program, path, page)

    def check_told(self, program, path, page):
        text = re.sub(r"\|\n {6}(?=\S)", "|", run(program, *path, "--help-all"))
        if footer := re.search(r"^\.SH NOTES\n\.nf\n(.*?)\n\.fi$", page, re.DOTALL | re.MULTILINE):
            notes = plain(footer[1])
            self.assertIn("\n" + notes, text)  # line for line
            text = text[: text.rindex(notes)]
        # "  -o,--output FILE  what for", or the text in the next line
        told = set(re.findall(r"^  (\S.*?)(?:  .*)?$", text, re.MULTILINE))
        told = {name if name.startswith("-") else name.split(" ")[0] for name in told}
        entries = {plain(name).replace(", -", ",-") for name in re.findall(r"^\.TP\n(.*)$", page, re.MULTILINE)}
        self.assertIn("-h,--help", entries)
        self.assertEqual(entries, told)

    def check_rendered(self, _program, _path, page):
        wide = os.environ | {"MANWIDTH": "400", "LC_ALL": "C.UTF-8", "MANPAGER": "cat"}
        shown = subprocess.run(["man", "--warnings", "-E", "UTF-8", "-l", "-"], input=page, env=wide, check=True,
                               capture_output=True, text=True)
        self.assertEqual(shown.stderr, "")
        # every line is there, without roff's signs, and those of the examples are lines still
        rows = [" ".join(row.split()) for row in re.sub(r".\x08", "", shown.stdout).splitlines()]
        for line in page.splitlines():
            if not line.startswith("."):
                self.assertIn(" ".join(plain(line).split()), " ".join(rows))
        for block in re.findall(r"^\.nf\n(.*?)^\.fi$", page, re.DOTALL | re.MULTILINE):
            self.assertLessEqual({" ".join(line.split()) for line in plain(block).splitlines()}, set(rows))

    def check_name(self, program, path, page):
        name = "-".join((program.name, *path))
        with tempfile.NamedTemporaryFile("w", suffix=".1") as file:
            file.write(page)
            file.flush()
            self.assertRegex(run("lexgrog", file.name), rf': "{name} - \w[^"]+[^".]"\n$')

    def test_tells_what_help_tells(self):
        self.each(self.check_told)

    @unittest.skipUnless(shutil.which("man"), "skipped: no man here")
    def test_is_rendered_as_it_stands(self):
        self.each(self.check_rendered)

    @unittest.skipUnless(shutil.which("lexgrog"), "skipped: no lexgrog here")
    def test_has_a_name_for_whatis(self):
        self.each(self.check_name)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
