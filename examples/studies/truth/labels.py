#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Lungs and bones of a CT of the chest by thresholds: enough to say where `tetwarp truth` may move tissue, not to measure organs.

    labels.py CT LABELS.nii.gz

Labels: 1 the rest of the body, 2 lungs (below -500 HU inside the body, the two largest pieces of at least a tenth of a litre, with
their vessels), 3 bones (above 180 HU after a median of three voxels, pieces of at least 2 ml). Wants SimpleITK.
"""

from __future__ import annotations

import argparse

import SimpleITK as sitk


def pieces(mask: sitk.Image, millilitres: float, most: int = 10000) -> sitk.Image:
    """The largest pieces of a mask that have at least that volume."""
    x, y, z = mask.GetSpacing()
    voxels = max(1, int(millilitres * 1000 / (x * y * z)))
    parts = sitk.RelabelComponent(sitk.ConnectedComponent(mask), minimumObjectSize=voxels)
    return sitk.And(parts > 0, parts <= most)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("ct")
    parser.add_argument("labels")
    options = parser.parse_args()
    ct = sitk.ReadImage(options.ct, sitk.sitkFloat32)
    # The body is the largest piece that is no air; what it encloses within a slice belongs to it.
    solid = pieces(sitk.BinaryMorphologicalOpening(ct > -300, [2, 2, 1]), 500, 1)
    slices = [sitk.BinaryFillhole(solid[:, :, k]) for k in range(solid.GetSize()[2])]
    body = sitk.JoinSeries(slices, ct.GetOrigin()[2], ct.GetSpacing()[2])
    body.CopyInformation(ct)
    lungs = pieces(sitk.And(body, ct < -500), 100, 2)
    lungs = sitk.And(body, sitk.BinaryMorphologicalClosing(lungs, [4, 4, 2]))
    bones = sitk.And(sitk.And(body, sitk.Not(lungs)), pieces(sitk.Median(ct, [1, 1, 1]) > 180, 2))
    labels = sitk.Cast(body, sitk.sitkUInt8) + sitk.Cast(lungs, sitk.sitkUInt8) + 2 * sitk.Cast(bones, sitk.sitkUInt8)
    labels.SetMetaData("descrip", "1 body, 2 lung, 3 bone")
    sitk.WriteImage(labels, options.labels, True)


if __name__ == "__main__":
    main()
