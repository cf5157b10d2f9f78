# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""The features that meet: each factor with its choices, and what is refused. A new feature joins by one line.

The first choice of each factor is the plain one. What a choice means on the command line is in command.py, what must
come out in judge.py.
"""
from covering import Rule
from made_inputs import DICOM, FILES

FIELDS = {  # name: what it is for the checks
    "identity": "formula", "shift": "formula", "wave": "formula", "bubble": "formula", "tear": "formula",
    "elastic": "formula", "lattice": "lattice", "folded": "lattice", "short": "short", "mesh": "mesh",
    "two-meshes": "mesh", "island": "mesh", "composed": "composed", "composed-mesh": "composed", "affine": "transform",
    "cut-open": "scenario", "cut-springs": "scenario", "cut-closed": "scenario", "chain": "scenario",
    "springs": "scenario", "labelled": "scenario", "cut-file": "file of a scenario",
    "chain-file": "file of a scenario", "pull": "pull",
    "gaps": "pull", "pull-affine": "pull"}
SERIES = ["dicom", "dicom-rle", "dicom-deflated"]
FACTORS = {
    "field": list(FIELDS),
    "input": [*FILES, *DICOM, "vectors"],
    "with": ["none", "labels", "nearest-own", "cubic", "vectors", "series", "dose", "dose-object", "segmentation",
             "structures"],
    "points": ["none", "csv", "markups", "stl"],
    "coverage": ["none", ".nii.gz", ".mha"],
    "inverse": ["none", ".mha", ".nii.gz", ".dcm"],
    "jacobian": ["none", ".nrrd"],
    "folds": ["none", ".nii"],
    "write-field": ["none", ".mha", ".vtk"],
    "mass": ["none", "mass"],
    "grid": ["same", "fit", "file", "series"],
    "outside": ["refuse", "rest", "background"],
    "interpolation": ["linear", "nearest", "cubic", "vote"],
    "background": ["none", "7"],
    "output": [".nrrd", ".mha", ".nii", ".nii.gz", *SERIES],
    "deidentify": ["none", "basic", "shift-dates,retain-device"],
    "keep-frame": ["none", "keep-frame-of-reference"],
    "compress": ["none", "0", "9"],
    "bids": ["none", "bids"],
    "report": ["none", "report"],
    "preview": ["none", "preview"],
    "memory": ["none", "4G", "1M"],
    "backend": ["auto", "cpu", "cuda"],
    "run": ["alone", "batch"],
}

PULL = [name for name, kind in FIELDS.items() if kind == "pull"]
MESHES = ["mesh", "two-meshes", "island", "composed-mesh", "cut-open", "cut-springs", "cut-file"]
OVER_INPUT = [name for name, kind in FIELDS.items()
              if kind in ("formula", "transform", "scenario", "file of a scenario", "short")]
FILE_OUTPUTS = [".nrrd", ".mha", ".nii", ".nii.gz"]
SMALLER = ["nii-i16", "nii-oblique", "nrrd-f32", "mha-f64", "dicom-oblique"]  # than the volume of `--grid series`


def but(factor, *choices):
    return [choice for choice in FACTORS[factor] if choice not in choices]


def rules(has_device):
    """What the documents say is refused. Where several hold, any of their errors is right."""
    found = [
        Rule(2, "--points needs a forward field", field=PULL, points=but("points", "none")),
        Rule(2, "--jacobian and --folds are of the tetrahedra", field=PULL, jacobian=[".nrrd"]),
        Rule(2, "--jacobian and --folds are of the tetrahedra", field=PULL, folds=[".nii"]),
        Rule(2, "--write-field writes a forward field", field=PULL, **{"write-field": [".mha", ".vtk"]}),
        Rule(2, "--preserve mass needs the determinant", field=PULL, mass=["mass"]),
        Rule(2, "--grid fit needs to know", field=PULL, grid=["fit"]),
        Rule(2, "can only be derived from", input=list(FILES), output=SERIES),
        Rule(2, "has the grid of the series", output=SERIES, grid=but("grid", "same")),
        Rule(2, "are for a DICOM series", output=FILE_OUTPUTS, deidentify=but("deidentify", "none")),
        Rule(2, "are for a DICOM series", output=FILE_OUTPUTS, **{"keep-frame": ["keep-frame-of-reference"]}),
        Rule(2, "--compress is for", output=[".nii", *SERIES], compress=["0", "9"]),
        Rule(2, "DICOM registration between INPUT", output=FILE_OUTPUTS, inverse=[".dcm"]),
        Rule(2, "refers to a DICOM series", output=FILE_OUTPUTS, **{"with": ["dose-object", "segmentation"]}),
        Rule(2, "lie on slices of a DICOM series", output=FILE_OUTPUTS, **{"with": ["structures"]}),
        Rule(2, "--bids is for .nii and .nii.gz", bids=["bids"], output=but("output", ".nii", ".nii.gz")),
        Rule(2, "--bids says what the headers of a CT series say", bids=["bids"], input=list(FILES)),
        Rule(4, "components a voxel", input=["vectors"]),
        Rule(2, "can only be derived from", input=["vectors"], output=SERIES),
        Rule(2, "--bids says", input=["vectors"], bids=["bids"]),
        Rule(4, "cubic", input=["uneven"], interpolation=["cubic"]),
        Rule(4, "lean .* or lie at uneven distances; simulations need a straight one", input=["tilted", "uneven"],
             field=[name for name, kind in FIELDS.items() if kind == "scenario"]),
        Rule(4, "does not reach over", field=["island"], outside=["refuse"]),
        Rule(4, "does not reach over", field=OVER_INPUT, input=SMALLER, grid=["series"], outside=["refuse"]),
        Rule(4, "does not reach over", field=["pull-affine"], grid=["file"], outside=["refuse"],
             **{"with": ["nearest-own"]}),  # a transform is sampled on the output grid alone
        Rule(4, "cannot hold|written as a mesh", field=MESHES, **{"write-field": [".mha"]}),
    ]
    if has_device:
        found.append(Rule(1, "memory", memory=["1M"], backend=["cpu"]))
    else:
        found.append(Rule(1, "of memory are needed", memory=["1M"]))
        found.append(Rule(1, "cuda|CUDA", backend=["cuda"]))
    return found
