#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""SEG, RTSTRUCT and registration objects of other programs: read, moved, written, and read back by those programs.

    check_objects.py PROGRAM [--only WORD] [--keep FOLDER] [--markdown]

PROGRAM is tetwarp. Each case has another program make an object of a phantom's CT, sends it through a field with
`deform`, has a program that is not Tetwarp read what comes out, and compares. A line a case says what was found.
--only: cases with WORD in program or object; --keep: leaves all files there, in a folder that is new; --markdown: lines
of a table. Programs that are not installed are left out, with the reason. All of them are there in an environment with

    pip install highdicom dcmqi pydicom-seg-rb rt-utils pydicomrt SimpleITK nibabel

and with plastimatch of Debian; pydicom-seg itself needs an environment of its own, with "pydicom<3". Exit status 0: all
is right, 1: it is not, 77: nothing could be tried.
"""

import argparse
import pathlib
import shutil
import sys
import tempfile
import traceback
import warnings

try:
    import label_segmentations
    import registrations
    import segmentations
    import structures
    from world import Missing, World, Wrong
except ImportError as error:
    print(error)
    sys.exit(77)


def judge(check, world):
    """@return the result in words, and whether it is right, wrong, or nothing that could be judged"""
    try:
        return check(world), "right"
    except Wrong as wrong:
        return str(wrong), "wrong"
    except Missing:
        raise
    except Exception:  # of the other program, or of this check
        return traceback.format_exc(limit=-2).strip().replace("\n", " "), "failed"


def lines_of(kind, world, only):
    """@return rows: program, version, object, proof, result, verdict"""
    for program, version_of, cases_of in kind.cases():
        try:
            version = version_of()
            for what, proof, check in cases_of():
                if only not in f"{program} {what}":
                    continue
                result, verdict = judge(check, world)
                yield program, version, what, proof, result, verdict
        except Missing as missing:
            print(f"skipped: {program}: {missing}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--only", default="")
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("--markdown", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    folder = options.keep or pathlib.Path(tempfile.mkdtemp())
    wrong, count = [], 0
    try:
        # Odd numbers of pixels, for the bits of frames follow one another. rt-utils takes rows for columns, so where it
        # reads there are as many of both.
        oblong, square = ("61,47,24", "2.5,2.5,3"), ("91,91,30", "2,2,3")
        worlds = {segmentations: oblong, label_segmentations: oblong, structures: square, registrations: oblong}
        for kind, (size, spacing) in worlds.items():
            world = World(options.program, folder / kind.__name__, size, spacing)
            for *row, verdict in lines_of(kind, world, options.only):
                count += 1
                if options.markdown:
                    print("| " + " | ".join(row) + " |", flush=True)
                else:
                    print(f"{verdict}: " + ", ".join(row), flush=True)
                if verdict in ("wrong", "failed"):
                    wrong.append(row)
    finally:
        if not options.keep:
            shutil.rmtree(folder)
    print(f"{count} cases, {len(wrong)} wrong", file=sys.stderr)
    sys.exit(1 if wrong else 0 if count else 77)


main()
