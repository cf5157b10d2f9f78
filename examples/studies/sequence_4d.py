#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""A 4D sequence: one CT that breathes, as one NIfTI file of a cycle.

    sequence_4d.py [CT] -o FOLDER [--phases 10] [--amplitude 15] [--period 4]

Phase n of N is the CT through one smooth field whose displacements are scaled by (1 - cos(2 pi n / N)) / 2: at rest at first, farthest in the
middle. Each phase is a case of a batch, with its field beside it: the ground truth of the motion. Makes FOLDER/sequence.nii.gz (seconds
along the fourth axis) and FOLDER/phases.csv.
"""
import csv
import math

import study

import nibabel
import numpy


def main():
    words = study.parser(__doc__)
    words.add_argument("--phases", type=int, default=10)
    words.add_argument("--amplitude", type=float, default=15, help="mm (default: %(default)s)")
    words.add_argument("--period", type=float, default=4, help="seconds of a breath (default: %(default)s)")
    words.add_argument("--seed", type=int, default=1)
    options = words.parse_args()
    ct = study.source(options)
    scale = {f"phase-{n:02}": (1 - math.cos(2 * math.pi * n / options.phases)) / 2 for n in range(options.phases)}
    results = study.batch(options, [{
        "case": name, "input": str(ct.resolve()), "cell-size": options.cell_size, "output": "phase.nii.gz", "write-field": "field.nii.gz",
        "field": f"elastic:amplitude={options.amplitude * part:.6g},spacing=80,seed={options.seed}" if part > 0 else "identity"}
        for name, part in scale.items()])
    phases = [nibabel.load(options.output / "cases" / case / "phase.nii.gz") for case in results]
    image = nibabel.Nifti1Image(numpy.stack([numpy.squeeze(phase.dataobj) for phase in phases], axis=3), phases[0].affine)
    image.header.set_zooms((*phases[0].header.get_zooms()[:3], options.period / options.phases))
    image.header.set_xyzt_units("mm", "sec")
    nibabel.save(image, options.output / "sequence.nii.gz")
    with open(options.output / "phases.csv", "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["phase", "seconds", "amplitude_mm", "field"])
        for n, case in enumerate(results):
            out.writerow([case, round(n * options.period / options.phases, 6), round(options.amplitude * scale[case], 6), f"cases/{case}/field.nii.gz"])
    print(f"{len(phases)} phases: {options.output / 'sequence.nii.gz'}")


main()
