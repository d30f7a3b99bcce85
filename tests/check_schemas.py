#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fails unless every schema of schemas/ is in the list of schemas/README.md and a test holds output against it, or
against one that takes it in.

usage: check_schemas.py [SOURCE_FOLDER]
"""
import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent


def tested(name, tests, schemas):
    # check_schema("run", ...), check_schema(report, "run"), a case's "schema": "run", a file that a test opens
    direct = rf'check_schema\([^\n]*"{name}"|"schema(?:_[a-z]+)?": "{name}"|schemas/{name}\.schema\.json'
    return re.search(direct, tests) or any(f'"$ref": "{name}.schema.json"' in text and tested(other, tests, {})
                                           for other, text in schemas.items())


def main():
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE.parent
    tests = "\n".join(file.read_text() for file in sorted((root / "tests").rglob("*"))
                      if file.suffix in (".py", ".json", ".txt", ".cpp") and "node_modules" not in file.parts
                      and file.name != Path(__file__).name)
    schemas = {file.name.removesuffix(".schema.json"): file.read_text() for file in (root / "schemas").glob("*.schema.json")}
    page = (root / "schemas/README.md").read_text()
    problems = [f"schemas/{name}.schema.json: no test holds output against it" for name in sorted(schemas)
                if not tested(name, tests, schemas)]
    problems += [f"schemas/{name}.schema.json: not in the list of schemas/README.md" for name in sorted(schemas)
                 if f"({name}.schema.json)" not in page]
    problems += [f"schemas/README.md: lists {name}, which is not there"
                 for name in re.findall(r"\((\S+)\.schema\.json\)", page) if name not in schemas]
    for problem in problems:
        print(problem)
    print(f"{len(schemas)} schemas, {len(problems)} problems")
    return 1 if problems or not schemas else 0


if __name__ == "__main__":
    sys.exit(main())
