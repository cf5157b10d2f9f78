#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""How a segmentation stands growing deformations: a table and a plot.

    robustness_study.py [CT] -o FOLDER [--steps 8] [--largest 24] [--repeats 3]

A family of smooth random fields of growing amplitude deforms the CT and, by majority, its labels, which are the truth of the deformed
CT. The method under test, here thresholds, segments the deformed CT; its Dice against that truth says how much of its quality is left.
Put your own method in the place of `study.segment`. Makes FOLDER/robustness.csv and, with matplotlib, FOLDER/robustness.png.
"""
import csv

import study

import numpy
import tetwarp


def measure(folder, case, line, hu, labels):
    deformed, truth, inside = (tetwarp.read(folder / case / name).array for name in ("image.nii.gz", "truth.nii.gz", "covered.nii.gz"))
    found = numpy.where(inside > 0, study.segment(deformed), 0)
    truth = numpy.where(inside > 0, truth, 0)
    kept, method = study.dice(labels, truth), study.dice(found, truth)
    report = line["report"]
    return {"mean_hu_difference": float(numpy.abs(deformed.astype(float) - hu)[inside > 0].mean()),
            "dice_to_undeformed": numpy.mean(list(kept.values())), "dice_of_method": numpy.mean(list(method.values())),
            "jacobian_min": report["jacobian"][0], "folded": report["inverted"] + report["degenerate"]}


def plot(rows, path):
    try:
        import matplotlib
    except ImportError:
        return print("no plot: install matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(10, 4), constrained_layout=True)
    amplitudes = sorted({row["amplitude_mm"] for row in rows})

    def curve(axes, key, label):
        values = [[row[key] for row in rows if row["amplitude_mm"] == a] for a in amplitudes]
        line, = axes.plot(amplitudes, [numpy.mean(v) for v in values], "o-", label=label)
        axes.fill_between(amplitudes, [min(v) for v in values], [max(v) for v in values], alpha=0.2, color=line.get_color())

    curve(left, "dice_of_method", "of the method, to the deformed truth")
    curve(left, "dice_to_undeformed", "of the truth, to the undeformed labels")
    left.set(xlabel="largest displacement of a component, mm", ylabel="mean Dice", ylim=(0, 1.02))
    left.legend()
    curve(right, "mean_hu_difference", "mean difference to the undeformed CT")
    right.set(xlabel="largest displacement of a component, mm", ylabel="HU", ylim=(0, None))
    right.legend()
    figure.savefig(path, dpi=110)


def main():
    words = study.parser(__doc__)
    words.add_argument("--steps", type=int, default=8, help="amplitudes (default: %(default)s)")
    words.add_argument("--largest", type=float, default=24, help="amplitude, mm (default: %(default)s); a third of the spacing of 72 mm folds nothing")
    words.add_argument("--repeats", type=int, default=3, help="fields of each amplitude (default: %(default)s)")
    options = words.parse_args()
    ct = study.source(options)
    labels_path = study.label_map(options, ct)
    amplitudes = {f"a{step:02}": round(options.largest * step / options.steps, 3) for step in range(1, options.steps + 1)}
    results = study.batch(options, [{
        "case": name, "input": str(ct.resolve()), "variants": options.repeats, "seed": 1, "cell-size": options.cell_size,
        "field": f"elastic:amplitude={amplitude},spacing=72", "output": "image.nii.gz", "coverage": "covered.nii.gz",
        "with": [study.along(labels_path, "truth.nii.gz:vote")]} for name, amplitude in amplitudes.items()])
    hu, labels = tetwarp.read(ct).array, tetwarp.read(labels_path).array
    rows = [{"case": case, "amplitude_mm": amplitudes[case.split("-")[0]], **measure(options.output / "cases", case, line, hu, labels)}
            for case, line in results.items()]
    with open(options.output / "robustness.csv", "w", newline="") as file:
        out = csv.DictWriter(file, rows[0])
        out.writeheader()
        out.writerows({key: f"{value:.5g}" if isinstance(value, float) else value for key, value in row.items()} for row in rows)
    plot(rows, options.output / "robustness.png")
    print(f"{len(rows)} deformations: {options.output / 'robustness.csv'}")


main()
