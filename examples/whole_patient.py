# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Labels and landmarks for whole_patient.sh, and its picture.

whole_patient.py labels FOLDER           ct.nii.gz -> labels.nii.gz, landmarks.csv
whole_patient.py picture FOLDER [SLICE]  -> picture.png
"""
import csv
import json
import sys
from pathlib import Path

import nibabel
import numpy

LPS_FROM_RAS = numpy.diag([-1.0, -1.0, 1.0, 1.0])


def read(path):
    image = nibabel.load(path)
    return numpy.squeeze(numpy.asarray(image.dataobj)), image.affine


def make_labels(folder):
    """1 soft tissue, 2 lung, 3 bone and contrast; the thresholds are HU, of means of 3 x 3 voxels."""
    hu, affine = read(folder / "ct.nii.gz")
    near = [numpy.roll(hu.astype(numpy.float32), shift, axis=(0, 1)) for shift in numpy.ndindex(3, 3)]
    mean = numpy.roll(numpy.mean(near, axis=0), (-1, -1), axis=(0, 1))
    labels = numpy.zeros(hu.shape, numpy.uint8)
    labels[mean > -300] = 1
    labels[(mean > -930) & (mean < -500)] = 2
    labels[mean > 200] = 3
    nibabel.save(nibabel.Nifti1Image(labels, affine), folder / "labels.nii.gz")
    return hu, affine


def make_landmarks(folder, hu, affine):
    """Writes landmarks, LPS mm: the centre of the largest values in every tenth slice from the middle."""
    with open(folder / "landmarks.csv", "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["label", "x", "y", "z"])
        middle = hu.shape[2] // 2
        for k in range(middle - 20, middle + 21, 10):
            for half, columns in (("right", slice(0, hu.shape[0] // 2)), ("left", slice(hu.shape[0] // 2, None))):
                index = numpy.argwhere(hu[columns, :, k] > 300).mean(axis=0)
                index[0] += columns.start
                point = LPS_FROM_RAS @ affine @ [index[0], index[1], k, 1]
                out.writerow([f"{half} {k}", *(f"{x:.3f}" for x in point[:3])])


def landmarks_near(path, affine, k):
    index_from_lps = numpy.linalg.inv(LPS_FROM_RAS @ affine)
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            index = index_from_lps @ [float(row["x"]), float(row["y"]), float(row["z"]), 1]
            if abs(index[2] - k) < 3:
                yield index[0], index[1]


def draw(folder, k):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plot

    before, affine = read(folder / "ct.nii.gz")
    volumes = {name: read(folder / f"{name}.nii.gz")[0] for name in
               ("deformed", "labels", "labels_deformed", "dose_deformed", "coverage", "inverse", "jacobian", "folds")}
    k = before.shape[2] // 2 if k is None else k
    figure, axes = plot.subplots(2, 3, figsize=(13, 9), facecolor="white")
    ratio = abs(numpy.linalg.norm(affine[:3, 1]) / numpy.linalg.norm(affine[:3, 0]))

    def show(axis, title, volume, unit=None, **look):
        picture = axis.imshow(volume[:, :, k].T, aspect=ratio, interpolation="nearest", **look)
        axis.set_title(title)
        axis.axis("off")
        if unit is not None:
            figure.colorbar(picture, ax=axis, fraction=0.04, label=unit)

    def outline(axis, labels, dose=None):
        for label, colour in ((2, "deepskyblue"), (3, "gold")):
            axis.contour((labels[:, :, k] == label).T, levels=[0.5], colors=colour, linewidths=0.4)
        if dose is not None and dose[:, :, k].max() > 0:
            levels = numpy.array([0.1, 0.3, 0.6]) * dose[:, :, k].max()
            axis.contour(dose[:, :, k].T, levels=levels, cmap="autumn", linewidths=1)

    window = {"cmap": "gray", "vmin": -1000, "vmax": 500}
    show(axes[0, 0], "CT, labels and landmarks", before, **window)
    outline(axes[0, 0], volumes["labels"])
    show(axes[0, 1], "deformed, with dose", volumes["deformed"], **window)
    outline(axes[0, 1], volumes["labels_deformed"], volumes["dose_deformed"])
    show(axes[0, 2], "labels, deformed (vote)", volumes["labels_deformed"], cmap="viridis")
    show(axes[1, 0], "Jacobian determinant", volumes["jacobian"], "1", cmap="coolwarm", vmin=0.4, vmax=1.6)
    show(axes[1, 1], "length of the inverse", numpy.linalg.norm(volumes["inverse"], axis=-1), "mm", cmap="magma")
    show(axes[1, 2], "owners (0: not covered)", volumes["folds"], "1", cmap="Greys_r", vmin=0, vmax=2)
    for axis, name in ((axes[0, 0], "landmarks.csv"), (axes[0, 1], "landmarks_deformed.csv")):
        for x, y in landmarks_near(folder / name, affine, k):
            axis.plot(x, y, "+", color="lime", markersize=12, markeredgewidth=2)
    quality = json.loads((folder / "report.json").read_text())["quality"]
    figure.suptitle(quality["verdict"], fontsize=10, wrap=True)
    figure.tight_layout()
    figure.savefig(folder / "picture.png", dpi=64)


def main():
    what, folder = sys.argv[1], Path(sys.argv[2])
    if what == "labels":
        make_landmarks(folder, *make_labels(folder))
    elif what == "picture":
        draw(folder, int(sys.argv[3]) if len(sys.argv) > 3 else None)
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
