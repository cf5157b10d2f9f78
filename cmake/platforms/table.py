#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Makes the table of docs/reference/platforms.md of the records that rows.sh, arm64.sh, emulated.sh and device.sh keep.

    cmake/platforms/table.py           prints the page
    cmake/platforms/table.py --write   writes it
    cmake/platforms/table.py --check   exit status 1 unless the page is what the records make
"""
import pathlib
import sys

SOURCE = pathlib.Path(__file__).resolve().parents[2]
RECORDS = SOURCE / "bench" / "results" / "platforms"
PAGE = SOURCE / "docs" / "reference" / "platforms.md"
COLUMNS = ["system", "compiler", "options", "tests", "bits", "date", "commit", "result"]
HEAD = """# Platforms

Where Tetwarp was built and tested, by `cmake/platforms/rows.sh`, `arm64.sh`, `emulated.sh` and `device.sh`. *Bits*: hashes of voxels, vectors and maps that every machine has to
give ([tests/bits](../../tests/bits/README.md)). The records are in `bench/results/platforms`; this page is made of them by `cmake/platforms/table.py`.
A warning of the compiler is an error in the rows of `rows.sh` and `arm64.sh`.

"""


def read(path):
    """The fields of a record."""
    fields = dict(line.split(": ", 1) for line in path.read_text(encoding="utf-8").splitlines() if ": " in line)
    missing = [column for column in COLUMNS if column not in fields]
    if missing:
        raise SystemExit(f"table.py: error: {path} has no {', '.join(missing)}")
    return fields


def main():
    text = HEAD + "| row | " + " | ".join(COLUMNS) + " |\n" + "| --- " * (len(COLUMNS) + 1) + "|\n"
    for path in sorted(RECORDS.glob("*.txt")):
        fields = read(path)
        text += f"| {path.stem} | " + " | ".join(fields[column].replace("|", "\\|") for column in COLUMNS) + " |\n"
    if sys.argv[1:] == ["--write"]:
        PAGE.write_text(text, encoding="utf-8")
    elif sys.argv[1:] == ["--check"]:
        if PAGE.read_text(encoding="utf-8") != text:
            raise SystemExit(f"table.py: error: {PAGE} is not what the records make; run cmake/platforms/table.py --write")
    else:
        print(text, end="")


if __name__ == "__main__":
    main()
