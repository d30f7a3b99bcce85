#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fails if a sentence of a comment, a docstring or a page opens with "What", "Of", "The same" or "Which".

Such a sentence has no subject that a reader knows; a noun or a verb comes first. So a comment behind C++ or
CUDA code does not begin with "of", "that", "what", "which" or "whose". Headings, quoted sentences, code and
strings are left alone, as are folders of others' code and of builds. Takes another source tree as its argument."""
import ast
import io
import re
import sys
import tokenize
from pathlib import Path

ROOT = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).resolve().parent.parent)
FOLDERS = (".ci", "convert", "format", "kernels", "player", "runtime", "samples", "schemas", "tests")
OTHERS_CODE = re.compile(r"convert/(chart/echarts|viewer/playcanvas)/|(.*/)?(node_modules|build(-[^/]*)?)/")

LIST_ITEM = r"(?:[-*+]|\d+[.)])[ \t]+"
START = r"(?:\A|\n[ \t]*(?=\n)|\n[ \t]*(?=" + LIST_ITEM + r")|[.!?][\"')\]*_]*(?=\s))"
OPENER = re.compile(START + r"\s*(?:" + LIST_ITEM + r")?[*_(>\s]*(What|Of|The same|Which)\b")
QUOTED = re.compile(r'"[^"]*"|“[^”]*”|(`+).*?\1', re.S)
CPP = re.compile(r'(//)((?:\\\n|[^\n])*)|(/\*)(.*?)\*/|R"(\w*)\(.*?\)\5"|"(?:\\.|[^"\\\n])*"|(?<![\da-fA-F])\'(?:\\.|[^\'\\\n])+\'',
                 re.S)
SHELL = re.compile(r"""(?:(?<=\s)|(?<![^\n]))(#)([^\n]*)|\\.|"(?:\\.|[^"\\])*"|'[^']*'""", re.S)
FRAGMENT = re.compile(r"\s*(of|that|what|which|whose) ")
FENCED = re.compile(r"^([ \t]*)(```|~~~).*?^\1\2[ \t]*$", re.S | re.M)


def joined(comments):
    """(line, text) of comments of one line each: those below each other in one column are one text"""
    texts, last = [], None
    for line, column, text, is_alone in comments:
        if is_alone and last == (line - 1, column):
            texts[-1][1].append(text)
        else:
            texts.append((line, [text]))
        last = None if text.lstrip().startswith("SPDX-") else (line, column)
    return [(line, "\n".join(lines)) for line, lines in texts]


def marked(pattern, code):
    """(line, text) of the comments of a language, each of which is the group behind that of its mark"""
    singles, texts = [], []
    for match in pattern.finditer(code):
        line = code.count("\n", 0, match.start()) + 1
        if match.lastindex and match[match.lastindex - 1] in ("//", "#"):
            begin = code.rfind("\n", 0, match.start()) + 1
            is_alone = not code[begin:match.start()].strip()
            singles.append((line, match.start() - begin, match[match.lastindex], is_alone))
        elif match[0].startswith("/*"):
            texts.append((line, re.sub(r"^[ \t]*\*", "", match[match.lastindex].lstrip("*!"), flags=re.M)))
    return texts + joined(singles)


def fragments(code):
    """(line, opener) of the comments behind code of C++ that begin as no sentence does"""
    found = []
    for match in CPP.finditer(code):
        fragment = FRAGMENT.match(match[2]) if match[1] else None
        if fragment and code[code.rfind("\n", 0, match.start()) + 1:match.start()].strip():
            found.append((code.count("\n", 0, match.start()) + 1, fragment[1]))
    return found


def of_python(code):
    comments = [(*token.start, token.string.lstrip("#"), not token.line[:token.start[1]].strip())
                for token in tokenize.generate_tokens(io.StringIO(code).readline) if token.type == tokenize.COMMENT]
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    strings = [node.body[0].value for node in ast.walk(ast.parse(code))
               if isinstance(node, documented) and ast.get_docstring(node, clean=False)]
    return joined(comments) + [(string.lineno, string.value) for string in strings]


def of_page(page):
    page = FENCED.sub(lambda match: re.sub(r"[^\n]", "", match[0]), page)
    texts, paragraph = [], (1, [])
    for line, text in enumerate(page.split("\n"), 1):
        if text.lstrip().startswith(("|", "#")):
            cells = re.sub(r"`[^`]*`", "`code`", text).split("|") if text.lstrip().startswith("|") else []
            texts += [paragraph] + [(line, [cell.strip()]) for cell in cells]
            paragraph = (line + 1, [])
        else:
            paragraph[1].append(text)
    return [(line, "\n".join(lines)) for line, lines in texts + [paragraph]]


READERS = {".py": of_python, ".md": of_page}
CPP_ENDS = (".h", ".cpp", ".cu", ".cuh", ".def")
READERS |= dict.fromkeys((*CPP_ENDS, ".js"), lambda code: marked(CPP, code))
READERS |= dict.fromkeys((".cmake", ".sh", ".yaml", "CMakeLists.txt", ".ci/run"), lambda code: marked(SHELL, code))


def openers(name, content):
    """(line, opener) of the sentences of a file, None if it is not of a kind that has some"""
    reader = next((reader for end, reader in READERS.items() if name.endswith(end)), None)
    if reader is None:
        return None
    found = fragments(content) if name.endswith(CPP_ENDS) else []
    for line, text in reader(content):
        text = QUOTED.sub(lambda match: re.sub(r"\w", "x", match[0]), text)
        found += [(line + text.count("\n", 0, match.start(1)), match[1]) for match in OPENER.finditer(text)]
    return sorted(found)


# files that are not of the project, and files that are
OTHERS = ("tests/viewers/node_modules/a/b.js", "node_modules/a.md", "convert/build/a.h", "tests/build-dev/deep/a.cpp",
          "convert/chart/echarts/a.js", "convert/viewer/playcanvas/a.js")
OWN = ("tests/viewers/a.js", "tests/build.cmake", "tests/rebuild/a.h", "tests/builder/a.h",
       "player/my_node_modules/a.js", "tests/convert/chart/echarts/a.js")
# (file, content, lines of what is found)
OPENERS = ("What", "Of", "The same", "Which")
CASES = [(name, content.replace("What", opener), lines) for opener in OPENERS for name, content, lines in (
    ("a.h", "// What it is.\nint a;", [1]),
    ("a.h", "// SPDX-License-Identifier: Apache-2.0\n// What it is.", [2]),
    ("a.cpp", "int a; // What it is.\nint b;  // What it is.", [1, 2]),
    ("a.cpp", "// A number. Its\n// unit is metres. What\n// it is.\n", [2]),
    ("a.cpp", "// Is called\n// What in other places.\nint a; // a number\nint b; // What it is", [4]),
    ("a.cpp", "// A number,\n// - What it is\n//\n// What it is.", [2, 4]),
    ("a.cu", "int a; /* What it is. */ int b;\n/**\n * A number (of one). What it is.\n */", [1, 3]),
    ("a.cuh", "int What; f(\"// What it is.\", '\"'); // Counts it.\n", []),
    ("a.cuh", "const char* a = R\"x(\n// What it is.)\" /* What. */)x\";", []),
    ("a.h", "// Says \"What it is. What it was.\" or `What`. `What` opens it; What in it does not: What.", []),
    ("a.h", "// Says \"It is.\" What it is.", [1]),
    ("a.h", "// Whatever it is. Offset. Somewhat. what it is.\n// (see there) What", []),
    ("a.h", "int a = 1'000;  // It is a frame's. What it is.", [1]),
    ("a.def", "ISSUE(1) // https://a.b/ What\n", []),
    ("a.js", "// What it is.\nlet a = '// What';", [1]),
    ("a.py", "# What it is.\nb = 1  # What it is.\n# What it is.", [1, 2, 3]),
    ("a.py", "b = '# What.'\nc = \"\"\"What it is.\"\"\"\n", []),
    ("a.py", "'''What it is.'''\ndef f():\n    \"\"\"It is.\n\n    What it is.\"\"\"", [1, 5]),
    ("a.cmake", "# What it is.\nset(a \"# What\") # What it is.", [1, 2]),
    ("CMakeLists.txt", "# What it is.", [1]),
    (".ci/run", "echo ${a#What} $#; echo '# What'\n: # What it is.\n", [2]),
    ("a.md", "It is. What\nit is.\n\nWhat it is: What.\n- What it is\n  1. **What it is.** *What* it is.", [1, 4, 5, 6, 6]),
    ("a.md", "# What it is\n> What it is\n", [2]),
    ("a.md", "| What | `What` |\n| --- | --- |\n| it | What it is. |\n| `What it is` | is. |", [1, 3]),
    ("a.md", "```sh\n# What it is.\n\nWhat it is. What.\n```\nSays \"It\nis. What it is.\" `is. What`", []),
    ("a.json", "{\"a\": \"What it is.\"}", None),
)]
FRAGMENTS = ("of", "that", "what", "which", "whose")
CASES += [(name, content.replace("what", opener), lines) for opener in FRAGMENTS for name, content, lines in (
    ("a.h", "int a; // what it is\nint b;  //what it is", [1, 2]),
    ("a.cuh", "#else // what it is\n};// a number", [1]),
    ("a.cpp", "// what it is\nint a; // a number\n       // what it is\nint b; // whatever; what it is", []),
    ("a.cu", "f(\"// what it is\"); int a; /* what it is */", []),
    ("a.js", "let a = 1; // what it is", []),
)]

problems, count = [], 0
for names, is_others, wanted in ((OTHERS, True, "left out"), (OWN, False, "looked at")):
    problems += [f"CASES: {name} is not {wanted}, expected it to be" for name in names
                 if bool(OTHERS_CODE.match(name)) != is_others]
for name, content, lines in CASES:
    found = openers(name, content)
    if (found and [line for line, _ in found]) != lines:
        problems.append(f"CASES: {name} {content!r}: found {found}, expected lines {lines}")
for path in [*ROOT.iterdir(), *(path for folder in FOLDERS for path in (ROOT / folder).rglob("*"))]:
    name = path.relative_to(ROOT).as_posix()
    if OTHERS_CODE.match(name) or not path.is_file():
        continue
    found = openers(name, path.read_text(errors="replace")) if any(map(name.endswith, READERS)) else None
    count += found is not None
    problems += [f'{name}:{line}: a sentence or a comment behind code opens with "{opener}", expected a noun or a verb'
                 for line, opener in found or []]
if not count:
    problems.append(f"{ROOT}: has no file with comments, expected the root of a source tree")
print("\n".join(problems) or f"{count} files: no sentence opens with What, Of, The same or Which, no comment behind code with " +
      ", ".join(FRAGMENTS))
sys.exit(bool(problems))
