#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""How far packages are from the truth when they are given one and the same forward field.

    errors.py [--size N] [--json FILE] [--markdown FILE]

The map is known in closed form, in both directions: a twist about z, whose angle grows along z, and a wave along z. Its
displacements at the voxel centres of N x N x N voxels of 1 mm are what each package gets; labels are those of ellipsoids and
of a plate, which a formula says. So the right place and the right label of each deformed voxel are known without any package.
Packages that are not installed are left out, and said.

place    distance between where a value was taken from and where it should come from, mm
labels   share of voxels with a wrong label, of those within 1.5 mm of a border between labels
"""

import argparse
import importlib
import importlib.metadata
import json
import pathlib
import platform

import numpy as np
import tetwarp as tw

ANGLE, WAVE, LENGTH = np.deg2rad(25), 2.0, 40.0  # of the twist at the ends, of the wave in mm


def centres(size):
    k, j, i = np.meshgrid(*[np.arange(size, dtype=float)] * 3, indexing="ij")
    return np.stack([i, j, k], axis=-1)


def twisted(points, size, sign):
    """Points turned about the axis of the volume by an angle that depends on z alone."""
    middle = (size - 1) / 2
    angle = sign * ANGLE * (points[..., 2] - middle) / middle
    x, y = points[..., 0] - middle, points[..., 1] - middle
    turned = [x * np.cos(angle) - y * np.sin(angle) + middle, x * np.sin(angle) + y * np.cos(angle) + middle]
    return np.stack([*turned, points[..., 2]], axis=-1)


def waved(points, sign):
    """Points moved along z by a wave of x."""
    moved = points.copy()
    moved[..., 2] += sign * WAVE * np.sin(2 * np.pi * points[..., 0] / LENGTH)
    return moved


def forward(points, size):
    return waved(twisted(points, size, +1), +1)


def inverse(points, size):
    return twisted(waved(points, -1), size, -1)


def label_of(points, size):
    """1 and 2: ellipsoids, 3: a slanting plate, 0: all else."""
    middle = (size - 1) / 2
    x, y, z = (points[..., axis] - middle for axis in range(3))
    scale = size / 96
    labels = np.zeros(points.shape[:-1], np.uint8)
    labels[np.abs(0.6 * x + 0.3 * y - 0.74 * z + 25 * scale) < 2.5] = 3
    labels[((x - 12 * scale) / 14) ** 2 + (y / 20) ** 2 + (z / 24) ** 2 < scale**2] = 1
    labels[((x + 16 * scale) / 10) ** 2 + ((y - 5 * scale) / 9) ** 2 + (z / 18) ** 2 < scale**2] = 2
    return labels


class Truth:
    def __init__(self, size):
        self.size = size
        self.points = centres(size)
        self.came_from = inverse(self.points, size)
        self.displacement = (forward(self.points, size) - self.points).astype(np.float32)
        self.field = tw.VertexField(tw.Geometry((size,) * 3), self.displacement)
        self.exact = tw.invert(self.field, self.field.lattice).displacement  # by Tetwarp
        self.labels = label_of(self.points, size)
        self.deformed = label_of(self.came_from, size)
        # Voxels near which the deformed labels change, away from the border of the volume, which the field leaves.
        steps = [np.eye(3)[axis] * sign * 1.5 for axis in range(3) for sign in (-1, 1)]
        near = np.any([label_of(inverse(self.points + step, size), size) != self.deformed for step in steps], axis=0)
        inner = np.zeros_like(near)
        edge = size // 5
        inner[edge:-edge, edge:-edge, edge:-edge] = True
        self.inner, self.border = inner, near & inner

    def place(self, came_from):
        distance = np.linalg.norm(came_from - self.came_from, axis=-1)[self.inner]
        return {"mean_mm": float(distance.mean()), "largest_mm": float(distance.max())}

    def wrong(self, labels):
        return {"wrong_labels": float((np.asarray(labels) != self.deformed)[self.border].mean())}


def by_tetwarp(truth):
    labels = tw.Volume(truth.labels, truth.field.lattice)
    done = tw.deform(labels, truth.field, outside="background", interpolation="vote", background=0)
    return {"Tetwarp, the exact inverse, labels by vote": truth.place(truth.points + truth.exact) | truth.wrong(done.volume.array)}


def by_simpleitk(truth):
    import SimpleITK as sitk  # noqa: N813

    labels = sitk.GetImageFromArray(truth.labels)
    field = sitk.GetImageFromArray(truth.displacement.astype(np.float64), isVector=True)

    def result(displacement):
        came_from = truth.points + sitk.GetArrayFromImage(displacement)
        warped = sitk.Resample(labels, labels, sitk.DisplacementFieldTransform(sitk.Image(displacement)), sitk.sitkNearestNeighbor, 0)
        return truth.place(came_from) | truth.wrong(sitk.GetArrayFromImage(warped))

    return {
        "SimpleITK, the forward field taken as it is": result(field),
        "SimpleITK, the field negated": result(sitk.GetImageFromArray(-truth.displacement.astype(np.float64), isVector=True)),
        "SimpleITK InvertDisplacementField": result(sitk.InvertDisplacementField(field)),
        "SimpleITK IterativeInverseDisplacementField": result(sitk.IterativeInverseDisplacementField(field)),
    }


def by_monai(truth):
    import torch
    from monai.networks.blocks import Warp

    # Indexed [i, j, k], channels x, y, z, in voxels; the field leads from the output to the input.
    def result(displacement):
        ddf = torch.as_tensor(displacement.transpose(3, 2, 1, 0)[None].astype(np.float32))
        labels = torch.as_tensor(truth.labels.transpose(2, 1, 0)[None, None].astype(np.float32))
        warped = Warp(mode="nearest", padding_mode="zeros")(labels, ddf)[0, 0].numpy().transpose(2, 1, 0)
        return truth.place(truth.points + displacement) | truth.wrong(np.rint(warped).astype(np.uint8))

    return {
        "MONAI Warp, the forward field taken as it is": result(truth.displacement),
        "MONAI Warp, the field negated": result(-truth.displacement),
        "MONAI Warp, Tetwarp's inverse given": result(np.nan_to_num(truth.exact)),
    }


def by_scipy(truth):
    from scipy.ndimage import map_coordinates

    came = truth.points + truth.displacement
    labels = map_coordinates(truth.labels, [came[..., 2], came[..., 1], came[..., 0]], order=0)
    return {"SciPy map_coordinates, the forward field taken as it is": truth.place(came) | truth.wrong(labels)}


def labels_linear(truth):
    """What comes of labels that are interpolated linearly and rounded, with the right places."""
    from scipy.ndimage import map_coordinates

    came = truth.came_from
    values = map_coordinates(truth.labels.astype(float), [came[..., 2], came[..., 1], came[..., 0]], order=1)
    nearest = map_coordinates(truth.labels.astype(float), [came[..., 2], came[..., 1], came[..., 0]], order=0)
    return {
        "the right places, labels linear and rounded": truth.place(came) | truth.wrong(np.rint(values)),
        "the right places, labels of the nearest voxel": truth.place(came) | truth.wrong(nearest),
    }


def markdown(result):
    lines = [
        "# What becomes of one forward field",
        "",
        f"Volume of {result['size']}^3 voxels of 1 mm; a twist of 25 degrees and a wave of 2 mm, known in closed form. `bench/python/errors.py`, "
        + ", ".join(f"{name} {version}" for name, version in result["packages"].items()) + ".",
        "",
        "| | place, mean mm | place, largest mm | wrong labels at borders |",
        "| --- | --- | --- | --- |",
    ]
    for name, row in result["rows"].items():
        lines.append(f"| {name} | {row['mean_mm']:.2g} | {row['largest_mm']:.2g} | {100 * row['wrong_labels']:.1f} % |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=96)
    parser.add_argument("--json", type=pathlib.Path)
    parser.add_argument("--markdown", type=pathlib.Path)
    options = parser.parse_args()
    truth = Truth(options.size)
    assert np.abs(forward(truth.came_from, truth.size) - truth.points).max() < 1e-9
    rows = by_tetwarp(truth)
    for package, work in (("SimpleITK", by_simpleitk), ("monai", by_monai), ("scipy", by_scipy), ("scipy", labels_linear)):
        try:
            importlib.import_module(package)
        except ImportError:
            print(f"{package} is not installed")
            continue
        rows |= work(truth)
    packages = {"tetwarp": tw.features()["commit"], "Python": platform.python_version()}
    for name in ("SimpleITK", "monai", "scipy"):
        try:
            packages[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    result = {"size": options.size, "packages": packages, "rows": rows}
    if options.json:
        options.json.write_text(json.dumps(result, indent=1) + "\n")
    if options.markdown:
        options.markdown.write_text(markdown(result))
    print(markdown(result))


if __name__ == "__main__":
    main()
