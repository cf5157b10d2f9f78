# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What the studies share: a source, labels by thresholds, and batches that may be killed and continued.

Needs the Python package (`pip install .` in a clone); some also nibabel and matplotlib. What is deformed goes through
`tetwarp.batch`, so that a study that was killed goes on where it was.
"""
import argparse
import json
import pathlib
import sys

import numpy

try:
    import tetwarp
except ImportError as missing:
    sys.exit(f"{missing}; install the package: pip install . in a clone of Tetwarp")


def folder(name):
    """As a command takes it: a name that begins with a dash is no option."""
    return pathlib.Path(name).absolute() if name.startswith("-") else pathlib.Path(name)


def parser(description):
    words = argparse.ArgumentParser(description=description.strip(), formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("ct", nargs="?", help="a folder of DICOM or a volume file (default: a phantom)")
    words.add_argument("-o", "--output", type=folder, required=True, help="folder of the study; continued where it exists")
    words.add_argument("--series", default="", help="of a folder that holds several")
    words.add_argument("--size", default="160,160,80", help="voxels of the phantom (default: %(default)s)")
    words.add_argument("--cell-size", type=int, default=4, help="voxels between vertices of the field (default: %(default)s)")
    return words


def source(options):
    """Writes the CT as OUTPUT/ct.nii.gz, in HU: the series on a straight grid, or a phantom of 400 x 400 x 320 mm."""
    options.output.mkdir(parents=True, exist_ok=True)
    path = options.output / "ct.nii.gz"
    if path.exists():
        return path
    if options.ct:
        ct = tetwarp.read(options.ct, series=options.series)
        tetwarp.write(tetwarp.deform(ct, tetwarp.fields.identity(ct.geometry)).volume, path)
    else:
        size = [int(number) for number in options.size.split(",")]
        tetwarp.write(tetwarp.phantom(size, spacing=[mm / number for mm, number in zip((400, 400, 320), size)]), path)
    return path


def segment(hu):
    """Labels by thresholds, which stand in for a segmentation network: 1 soft tissue, 2 lung, 3 bone."""
    labels = numpy.zeros(hu.shape, numpy.uint8)
    labels[hu > -300] = 1
    labels[(hu > -930) & (hu < -500)] = 2
    labels[hu > 200] = 3
    return labels


def label_map(options, ct):
    """Writes the labels as OUTPUT/labels.nii.gz, on the grid of the CT."""
    path = options.output / "labels.nii.gz"
    if not path.exists():
        volume = tetwarp.read(ct)
        tetwarp.write(tetwarp.Volume(segment(volume.array), volume.geometry), path)
    return path


def dice(a, b):
    """The Dice coefficient of each label that either volume has, by label."""
    scores = {}
    for label in sorted(set(numpy.unique(a)) | set(numpy.unique(b)) - {0}):
        if label:
            one, other = a == label, b == label
            scores[int(label)] = float(2 * (one & other).sum() / (one.sum() + other.sum()))
    return scores


def along(path, output):
    """An entry of `with`, IN=OUT. Refuses an IN that has a = in it, for the program could not tell where IN ends."""
    path = str(pathlib.Path(path).resolve())
    if "=" in path:
        sys.exit(f"a path with = cannot go along, {path}; rename it")
    return f"{path}={output}"


def batch(options, rows):
    """Runs the cases, or those that are not finished. @return the lines of results.jsonl by case"""
    manifest, out = options.output / "manifest.jsonl", options.output / "cases"
    manifest.write_text("".join(json.dumps(row) + "\n" for row in rows))
    if (status := tetwarp.batch(manifest, out, resume=True)) != 0:
        sys.exit(status)
    lines = [json.loads(line) for line in (out / "results.jsonl").read_text().splitlines()]
    return {line["case"]: line for line in lines}
