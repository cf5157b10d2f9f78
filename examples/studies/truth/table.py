#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Makes a table in Markdown of what the workflow measured: a row for each case and method.

    table.py STUDY [--label 2=lung --label 3=bone]

--label adds a column: the mean error of the voxels of that label. The last column has the limits that are missed
(docs/guide/truth.md), and how many voxels fold.
"""

import argparse
import csv
import json
import pathlib

COLUMNS = ("mean_mm", "p95_mm", "p99_mm", "largest_mm")


def limits_missed(score: dict) -> str:
    """Names of the limits that a result misses; behind that on folds how many there are."""
    names = []
    for check in score.get("checks", []):
        if not check["passed"]:
            count = f" ({check['value']:.0f})" if check["name"] == "folded_voxels" else ""
            names.append(f"`{check['name']}`{count}")
    return ", ".join(names)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=pathlib.Path)
    parser.add_argument("--label", action="append", default=[], metavar="N=NAME")
    options = parser.parse_args()
    study = options.study
    labels = [label.split("=", 1) for label in options.label]
    with open(study / "scores.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    scores = json.loads((study / "scores.json").read_text(encoding="utf-8"))["scores"]
    missed = {(score["case"], pathlib.Path(score["result"]).name): limits_missed(score) for score in scores}
    found = {(row["case"], pathlib.Path(row["result"]).name, row["part"]): row for row in rows}
    titles = ["case", "method", "seconds", "body: mean", "95 %", "99 %", "largest", *(f"{name}: mean" for _, name in labels)]
    titles += ["near the slip: mean", "landmarks: mean", "largest", "missed"]
    print("| " + " | ".join(titles) + " |")
    print("| " + " | ".join("---" for _ in titles) + " |")
    for case, method in dict.fromkeys((case, method) for case, method, _ in found):
        body, slip, landmarks = (found.get((case, method, part)) for part in ("body", "near slip", "landmarks"))
        timed = study / "times" / f"{method}.{case}.txt"
        seconds = timed.read_text().splitlines()[1].split("\t")[0] if timed.exists() else ""
        cells = [case, method, f"{float(seconds):.0f}" if seconds else ""]
        cells += [f"{float(body[column]):.2f}" if body else "" for column in COLUMNS]
        for number, _ in labels:
            part = found.get((case, method, f"label {number}"))
            cells.append(f"{float(part['mean_mm']):.2f}" if part else "")
        cells.append(f"{float(slip['mean_mm']):.2f}" if slip else "")
        cells += [f"{float(landmarks[column]):.2f}" if landmarks else "" for column in ("mean_mm", "largest_mm")]
        cells.append(missed[case, method])
        print("| " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
