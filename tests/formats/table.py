#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Prints the table of docs/reference/fields.md: how far Tetwarp is from each program on the files of tests/formats/cases.

    PYTHONPATH=build/.../python tests/formats/table.py
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


def main():
    fixed, moving = (tw.read(FORMATS / name) for name in ("fixed.nii.gz", "moving.nii.gz"))
    print("| program | version | files | proved by | mm | of values 0 to 100 |\n| --- | --- | --- | --- | --- | --- |")
    for path in sorted(FORMATS.glob("*/case.json")):
        case, folder = json.loads(path.read_text(encoding="utf-8")), path.parent
        texts = [str(folder / text).replace("=../", f"={FORMATS}/") for text in case["pull_field"]]
        field = tw.read_field(texts, like=fixed, direction="pull")
        millimetres, values, ways = "-", "-", []
        if (folder / "expected.npy").exists():
            expected, found = np.load(folder / "expected.npy"), at_voxels(field, fixed.geometry)
            known = np.isfinite(found) & np.isfinite(expected)
            millimetres = largest((found - expected)[known])
            ways.append("its points" if "layout" not in case["version"] else "a known answer")
        if (folder / "warped.nii.gz").exists():
            done = tw.deform(moving, pull_field=field, grid=fixed, background=-1000, outside="background")
            found, wanted = np.asarray(done.volume.array, float), tw.read(folder / "warped.nii.gz").array
            values = largest((found - wanted)[has_neighbours(field, fixed.geometry, moving.geometry)])
            ways.append("its warp")
        files = ", ".join(f"`{text.split(':')[0].rsplit('/', 1)[-1]}`" for text in case["pull_field"])
        print(f"| {case['program']} | {case['version']} | {files} ({folder.name}) | {', '.join(ways)} | {millimetres} | {values} |")


if __name__ == "__main__":
    main()
