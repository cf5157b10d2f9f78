#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Prints the table of docs/reference/fields.md: how far Tetwarp is from each program on the files of tests/formats/cases.

    PYTHONPATH=build/.../python tests/formats/table.py [FOLDER]

FOLDER: the same cases on two scans, made by make.py; two more columns then.
"""
import json
import pathlib
import sys

import numpy as np
import tetwarp as tw

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "python" / "tests"))
from test_formats import FORMATS, at_voxels, has_neighbours  # noqa: E402


def largest(differences):
    """The largest of some numbers as text."""
    return f"{np.abs(differences).max():.1g}" if len(differences) else "-"


def differences_of(folder, case, volumes):
    """The largest differences of a displacement and of a voxel as text, "-" where the program gives none."""
    fixed, moving = volumes
    texts = [str(folder / text).replace("=../", f"={folder.parent}/") for text in case["pull_field"]]
    field = tw.read_field(texts, like=fixed, direction="pull")
    millimetres, values = "-", "-"
    if (folder / "expected.npy").exists():
        expected, found = np.load(folder / "expected.npy"), at_voxels(field, fixed.geometry)
        known = np.isfinite(found) & np.isfinite(expected)
        millimetres = largest((found - expected)[known])
    if (folder / "warped.nii.gz").exists():
        done = tw.deform(moving, pull_field=field, grid=fixed, background=-1000, outside="background")
        found, wanted = np.asarray(done.volume.array, float), tw.read(folder / "warped.nii.gz").array
        values = largest((found - wanted)[has_neighbours(field, fixed.geometry, moving.geometry)])
    return millimetres, values


def volumes_of(folder):
    """The two volumes of a folder; the values are not rounded."""
    fixed, moving = (tw.read(folder / name) for name in ("fixed.nii.gz", "moving.nii.gz"))
    return fixed, tw.Volume(moving.array.astype(np.float32), moving.geometry)


def ways_of(folder, case):
    """How a case is proved."""
    ways = ["a known answer" if "layout" in case["version"] else "its points"] if (folder / "expected.npy").exists() else []
    return ", ".join(ways + ["its warp"] * (folder / "warped.nii.gz").exists())


def main():
    folders = [FORMATS, *(pathlib.Path(text).resolve() for text in sys.argv[1:])]
    volumes = [volumes_of(folder) for folder in folders]
    heads = ["program", "version", "files", "proved by", "mm", "of values 0 to 100", "mm, CT", "HU"][: 4 + 2 * len(folders)]
    print("|", " | ".join(heads), "|\n|", " | ".join(["---"] * len(heads)), "|")
    for path in sorted(FORMATS.glob("*/case.json")):
        case, name = json.loads(path.read_text(encoding="utf-8")), path.parent.name
        files = ", ".join(f"`{text.split(':')[0].rsplit('/', 1)[-1]}`" for text in case["pull_field"])
        row = [case["program"], case["version"], f"{files} ({name})", ways_of(path.parent, case)]
        for folder, pair in zip(folders, volumes):
            made = folder / name / "case.json"
            row += differences_of(folder / name, case, pair) if made.exists() else ("-", "-")
        print("|", " | ".join(row), "|", flush=True)


if __name__ == "__main__":
    main()
