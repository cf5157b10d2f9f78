#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Checks what the files of each folder include, against the layout that CONTRIBUTING.md draws.

    check_includes.py SOURCE_FOLDER

Prints what is wrong, a line each; the exit status is 1 then. What it checks:
- an include in quotes is a path from the root and names a file of the repository;
- a folder includes headers of those folders alone that stand below it in the drawing;
- of another folder it includes no private header: none of a room such as io/dicom/scan/ unless it is installed, and
  none that says that it is private;
- an installed header (HEADERS of the libraries' CMakeLists.txt) includes installed headers alone;
- no header of deform/ but the one that marks functions for devices has a word of CUDA;
- no folder holds more files than a reader can survey.
"""
import collections
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "cmake"))
from installed_headers import installed_headers  # noqa: E402

MOST_FILES = 40
NOT_COUNTED = {"corpus", "results", "__pycache__"}  # data, a file a case
SOURCES = {".h", ".hxx", ".cpp", ".cu", ".cuh", ".in"}

# What stands below each folder. The program's tests may include anything.
BELOW = {
    "deform": set(),
    "cuda": {"deform"},
    "backend": {"deform", "cuda"},
    "itkbridge": {"deform", "backend"},
    "io": {"deform", "itkbridge"},
    "view": {"deform", "backend", "io"},
    "apps": {"deform", "backend", "itkbridge", "io", "view"},
    "python": {"deform", "backend", "io", "view", "apps"},
    "bench": {"deform", "backend", "itkbridge", "io"},
    "examples": {"deform", "backend", "itkbridge", "io"},
}

LIBRARIES = ("deform", "cuda", "backend", "itkbridge", "io")

# Rooms whose headers the folders above include freely.
OPEN_ROOMS = ("deform/contours/", "deform/fields/", "deform/phantom/", "deform/render/", "deform/simulate/",
              "view/server/", "view/session/")

# Headers that a folder includes though they are private, or not below it: (who, prefix of the header) and why.
FRIENDS = {
    ("apps", "deform/core/five_tetrahedra.h"): "an estimate of memory counts the bytes of a snapped vertex",
    ("cuda", "deform/"): "a backend runs the arithmetic of deform/core and checks what the CPU checks",
    ("python", "apps/"): "Python reads, refuses and reports by the code of the program, so that both say the same",
    ("bench", "deform/core/"): "the paper's algorithms are measured on the same arithmetic",
    ("bench", "cuda/runtime/"): "the paper's kernels own memory and check errors as ours do",
    ("io", "itkbridge/"): "ITK reads transforms; no header of io/ shows it",
}


def sources(root):
    for folder in BELOW:
        for path in sorted((root / folder).rglob("*")):
            if path.suffix in SOURCES:
                yield path.relative_to(root).as_posix(), path.read_text()


def is_private(root, header, installed):
    if header in installed or header.startswith(OPEN_ROOMS):
        return False
    in_room = header.count("/") > 1
    says = f"// Private to {header.split('/')[0]}/"
    return in_room or says in (root / header).read_text()


def includes(text):
    for match in re.finditer(r'^\s*#\s*include\s*"([^"]+)"', text, re.M):
        if not re.search(r"[@$]", match[1]):
            yield match[1]


def faults_of_include(root, name, header, installed):
    folder, other = name.split("/")[0], header.split("/")[0]
    if not (root / header).is_file():
        yield f"{name}: \"{header}\" is no file of the repository; write the path from the root"
        return
    is_friend = any(folder == who and header.startswith(prefix) for who, prefix in FRIENDS)
    if other != folder and other not in BELOW[folder] and not is_friend:
        yield f"{name}: includes \"{header}\", but {folder}/ does not stand above {other}/"
    if other != folder and not is_friend and is_private(root, header, installed):
        yield f"{name}: includes \"{header}\", which is private to {other}/"
    if name in installed and header not in installed:
        yield f"{name}: is installed and includes \"{header}\", which is not"


def faults(root):
    installed = {header for library in LIBRARIES for header in installed_headers(root, library)}
    if not installed:
        yield "no HEADERS found: is this the source folder?"
    for header in sorted(installed):
        if not (root / header).is_file():
            yield f"{header} is listed to be installed and does not exist"
    for name, text in sources(root):
        for header in includes(text):
            yield from faults_of_include(root, name, header, installed)
        is_plain_header = name.startswith("deform/") and name.endswith(".h") and name != "deform/core/host_device.h"
        if is_plain_header and (word := re.search(r"cuda|nvcc", text, re.I)):
            yield f"{name}: has the word {word[0]}; a header of deform/ knows nothing of CUDA"
    counts = collections.Counter()
    for top in [*BELOW, "tests"]:
        for path in (root / top).rglob("*"):
            parts = path.relative_to(root).parts
            if path.is_file() and not NOT_COUNTED & set(parts):
                counts["/".join(parts[:-1])] += 1
    for folder, count in sorted(counts.items()):
        if count > MOST_FILES:
            yield f"{folder}/ holds {count} files, at most {MOST_FILES} are wanted; give them rooms"


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    found = list(faults(pathlib.Path(sys.argv[1])))
    for fault in found:
        print(fault)
    print(f"{len(found)} faults" if found else "no fault")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
