#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Writes a page of the documentation site for each library, with a heading for each header that is installed.

    api_pages.py FOLDER

Their paths are printed, a line each. What a .hxx declares stands in its .h.
"""
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "cmake"))
from installed_headers import installed_headers  # noqa: E402

LIBRARIES = {
    "deform": "the algorithm",
    "backend": "where work is done",
    "itkbridge": "filters for ITK",
    "io": "files",
}


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
        headers = [header for header in installed_headers(ROOT, library) if header.endswith(".h")]
        if not headers:
            sys.exit(f"api_pages.py: error: no HEADERS in {library}/CMakeLists.txt")
        (folder / f"{library}.md").write_text(page(library, headers))
        print("\n".join(headers))


if __name__ == "__main__":
    main()
