#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""An augmentation set for a segmentation network: a CT and its labels in many random smooth deformations.

    augmentation_set.py [CT] -o FOLDER [--labels LABELS] [--variants 100] [--seed 1]

Makes FOLDER/cases/aug-001/image.nii.gz and label.nii.gz and so on, and FOLDER/set.csv, which names the pairs. Labels go by majority
of the volume that each covers (`vote`), so no value comes up that was not there. The same seed makes the same set everywhere.
"""
import csv

import study


def main():
    words = study.parser(__doc__)
    words.add_argument("--labels", help="label map on any grid (default: thresholds)")
    words.add_argument("--variants", type=int, default=100)
    words.add_argument("--seed", type=int, default=1)
    options = words.parse_args()
    ct = study.source(options)
    labels = options.labels or study.label_map(options, ct)
    results = study.batch(options, [{
        "case": "aug", "input": str(ct.resolve()), "variants": options.variants, "seed": options.seed,
        "field": ["elastic:amplitude=2..10,spacing=40..80", "twist:angle=-5..5"], "cell-size": options.cell_size,
        "output": "image.nii.gz", "with": [study.along(labels, "label.nii.gz:vote")]}])
    with open(options.output / "set.csv", "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["image", "label", "field", "jacobian_min", "jacobian_max", "folded"])
        for case, line in results.items():
            report = line["report"]
            field = " ; ".join(word.removeprefix("--field=") for word in line["command"] if word.startswith("--field="))
            out.writerow([f"cases/{case}/image.nii.gz", f"cases/{case}/label.nii.gz", field,
                          *report["jacobian"], report["inverted"] + report["degenerate"]])
    print(f"{len(results)} pairs: {options.output / 'set.csv'}")


main()
