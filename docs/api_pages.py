#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Writes a page of the documentation site for each library, with a heading for each header that is installed.

    api_pages.py FOLDER

The headers are those behind HEADERS in the CMakeLists.txt of the libraries. Their paths are printed, a line each.
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
LIBRARIES = {
    "deform": "the algorithm",
    "cuda": "devices",
    "itkbridge": "filters for ITK",
    "io": "files",
}


def installed_headers(library):
    """Paths of the headers of a library, from the root."""
    text = re.sub(r"#.*", "", (ROOT / library / "CMakeLists.txt").read_text())
    found = set()
    for words in re.findall(r"\bHEADERS\b([^)]*)", text):
        for word in words.split():
            if not word.endswith((".h", ".hxx")):
                break  # the next keyword
            found.add(f"{library}/{word}")
    return sorted(header for header in found if header.endswith(".h"))


def page(library, headers):
    lines = [f"# {library}: {LIBRARIES[library]}", ""]
    for header in headers:
        lines += [f"## {header}", "", f"```{{doxygenfile}} {header}", ":project: tetwarp", "```", ""]
    return "\n".join(lines)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for library in LIBRARIES:
        headers = installed_headers(library)
        if not headers:
            sys.exit(f"api_pages.py: error: no HEADERS in {library}/CMakeLists.txt")
        (folder / f"{library}.md").write_text(page(library, headers))
        print("\n".join(headers))


if __name__ == "__main__":
    main()
