# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Which headers the libraries install, for scripts: what stands behind HEADERS in their CMakeLists.txt."""
import pathlib
import re


def installed_headers(root, library):
    """Paths of the headers of a library from the root, sorted; `root` is the source folder."""
    text = re.sub(r"#.*", "", (pathlib.Path(root) / library / "CMakeLists.txt").read_text())
    found = set()
    for words in re.findall(r"\bHEADERS\b([^)]*)", text):
        for word in words.split():
            if not word.endswith((".h", ".hxx")):
                break  # the next keyword
            found.add(f"{library}/{word}")
    return sorted(found)
