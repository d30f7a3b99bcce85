# SPDX-License-Identifier: Apache-2.0
"""Shared by the tests of the programs: schemas of reports, and the Vulkan driver that draws on a CPU."""

import json
import pathlib
import sys

try:
    import jsonschema
except ImportError:  # the schema checks are then left out, and the run says so
    jsonschema = None
    print("note: no jsonschema, schemas are not checked", file=sys.stderr)

SCHEMAS = pathlib.Path(__file__).resolve().parents[2] / "schemas"


def check_schema(name: str, *values) -> None:
    if jsonschema is not None:
        validator = jsonschema.Draft202012Validator(json.loads((SCHEMAS / f"{name}.schema.json").read_text()))
        for value in values:
            validator.validate(value)


def lavapipe() -> str:
    """Mesa's driver that draws on the CPU, so that any machine does the same."""
    return next((str(file) for file in pathlib.Path("/usr/share/vulkan/icd.d").glob("lvp_icd.*.json")), "")
