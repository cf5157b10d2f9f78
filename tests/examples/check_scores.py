#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What `tetwarp score` says of overlaps, surfaces and doses is what plastimatch measures, and of landmarks what elastix does.

    check_scores.py TETWARP        status 77: plastimatch or elastix is missing

The "registration" is a shift of all, which is off by several voxels. Labels and doses are compared that Tetwarp takes
along by it; the label does not touch the ends of the grid, where plastimatch sees a surface and Tetwarp does not.
"""

import csv
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

LABEL = 9  # the spleen of the phantom
KIND = "elastic:amplitude=9,spacing=70"
CASE = "elastic-amplitude-9-spacing-70"
SHIFT = (3.75, 2.5, 2.5)  # quarters and halves of a voxel: the grid on which vertices lie has them
# One step, of which elastix prints what its metrics were before it.
ELASTIX_MAP = """(FixedImageDimension 3)
(MovingImageDimension 3)
(FixedInternalImagePixelType "float")
(MovingInternalImagePixelType "float")
(UseDirectionCosines "true")
(Registration "MultiMetricMultiResolutionRegistration")
(Interpolator "LinearInterpolator")
(ResampleInterpolator "FinalBSplineInterpolator")
(Resampler "DefaultResampler")
(FixedImagePyramid "FixedSmoothingImagePyramid")
(MovingImagePyramid "MovingSmoothingImagePyramid")
(Optimizer "RegularStepGradientDescent")
(Transform "TranslationTransform")
(Metric "AdvancedMeanSquares" "CorrespondingPointsEuclideanDistanceMetric")
(Metric0Weight 0.0)
(Metric1Weight 1.0)
(NumberOfResolutions 1)
(MaximumNumberOfIterations 1)
(ImageSampler "Full")
(AutomaticTransformInitialization "false")
(HowToCombineTransforms "Compose")
(WriteResultImage "false")
"""
ELASTIX_SHIFT = f"""(Transform "TranslationTransform")
(NumberOfParameters 3)
(TransformParameters {SHIFT[0]} {SHIFT[1]} {SHIFT[2]})
(InitialTransformParametersFileName "NoInitialTransform")
(HowToCombineTransforms "Compose")
(FixedImageDimension 3)
(MovingImageDimension 3)
(FixedInternalImagePixelType "float")
(MovingInternalImagePixelType "float")
(UseDirectionCosines "true")
"""


def run(*words: object, folder: pathlib.Path) -> str:
    done = subprocess.run([str(word) for word in words], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode in (0, 3), f"{words}: {done.stdout}{done.stderr}"
    return done.stdout


def number(pattern: str, text: str) -> float:
    found = re.search(pattern, text)
    assert found, f"no {pattern} in {text}"
    return float(found.group(1))


def near(ours: float, theirs: float, most: float, what: str, program: str = "plastimatch") -> None:
    print(f"{what}: {ours:.5f}, {program} {theirs:.5f}")
    assert abs(ours - theirs) <= most, what


def landmarks_by_elastix(folder: pathlib.Path) -> float:
    """The mean distance between landmarks of the fixed volume taken to the moving one, and those of the moving volume."""
    taken, there = (list(csv.DictReader((folder / "set" / at / "landmarks.csv").open())) for at in (CASE, "moving"))
    known = [pair for pair in zip(taken, there) if pair[0]["status"] == "moved"]
    for name, points in (("fixed.txt", [pair[0] for pair in known]), ("moving.txt", [pair[1] for pair in known])):
        lines = [" ".join(point[axis] for axis in "xyz") for point in points]
        (folder / name).write_text("\n".join(["point", str(len(lines)), *lines, ""]))
    (folder / "map.txt").write_text(ELASTIX_MAP)
    (folder / "shift.txt").write_text(ELASTIX_SHIFT)
    (folder / "elastix").mkdir()
    run("elastix", "-f", f"set/{CASE}/fixed.nii.gz", "-m", "set/moving/moving.nii.gz", "-p", "map.txt", "-t0", "shift.txt",
        "-fp", "fixed.txt", "-mp", "moving.txt", "-out", "elastix", folder=folder)
    with open(folder / "elastix" / "IterationInfo.0.R0.txt", newline="") as file:
        return float(next(csv.DictReader(file, delimiter="\t"))["2:Metric1"])


def check(program: str, folder: pathlib.Path) -> None:
    def tetwarp(*words: object) -> str:
        return run(program, *words, folder=folder)

    def plastimatch(*words: object) -> str:
        return run("plastimatch", *words, folder=folder)

    tetwarp("phantom", "-o", "ct.nii.gz", "--labels", "labels.nii.gz", "--size", "80,80,60", "--spacing", "5,5,5", "--noise", "0")
    # A dose: the blurred spleen and its surroundings.
    plastimatch("threshold", "--input", "labels.nii.gz", "--output", "part.mha", "--range", f"{LABEL - 0.5},{LABEL + 0.5}")
    plastimatch("filter", "--pattern", "gauss", "--gauss-width", "60", "--output", "dose.mha", "part.mha")
    tetwarp("truth", "ct.nii.gz", "-o", "set", "--labels", "labels.nii.gz", "--case", KIND, "--dose", "dose.mha")
    tetwarp("invert", "translate:by=" + "/".join(str(-by) for by in SHIFT), "--like", f"set/{CASE}/fixed.nii.gz", "-o", "shift.mha")
    tetwarp("score", "set", "-r", "shift.mha", "--json", "scores.json")
    score = json.loads((folder / "scores.json").read_text())["scores"][0]

    near(score["landmarks"]["mean_mm"], landmarks_by_elastix(folder), 1e-4, "landmarks", "elastix")
    along = ("--pull-field", "shift.mha", "--outside", "background")
    tetwarp("deform", "set/moving/labels.nii.gz", *along, "--interpolation", "vote", "-o", "warped.nii.gz")
    tetwarp("deform", "set/moving/dose.nii.gz", *along, "-o", "warped-dose.nii.gz")
    for name, labels in (("should", f"set/{CASE}/labels.nii.gz"), ("is", "warped.nii.gz")):
        plastimatch("threshold", "--input", labels, "--output", f"{name}.mha", "--range", f"{LABEL - 0.5},{LABEL + 0.5}")
    said = plastimatch("dice", "--all", "should.mha", "is.mha")
    near(score["dice"][str(LABEL)], number(r"DICE:\s+(\S+)", said), 1e-5, "Dice")
    surface = score["surfaces"][str(LABEL)]
    # That of their whole masks: what they call boundary leaves voxels out. The farthest voxel lies outside the other mask in both.
    near(surface["largest_mm"], number(r"Hausdorff distance = (\S+)", said), 1e-4, "Hausdorff distance")
    # Theirs is the mean of the means of both ways; ours counts each surface voxel once.
    near(surface["mean_mm"], number(r"Avg average Hausdorff distance \(boundary\) = (\S+)", said), 0.05, "mean distance of surfaces")
    plastimatch("gamma", "--dta-tolerance", "2", "--dose-tolerance", "0.03", "--analysis-threshold", "0.1", "--ref-only-threshold",
                "--interp-search", "--output", "gamma.mha", "--output-text", "gamma.txt", f"set/{CASE}/dose.nii.gz",
                "warped-dose.nii.gz")
    said = (folder / "gamma.txt").read_text()
    near(score["gamma"]["points"], number(r"number_of_analysis_voxels\s+(\d+)", said), 0, "voxels with a dose")
    # Theirs looks along the lines between voxels, ours at places a tenth of the distance apart: it finds a little more.
    near(score["gamma"]["passing_percent"], number(r"pass_rate\(%\)\s+(\S+)", said), 1.5, "gamma, %")
    assert 5 < score["gamma"]["passing_percent"] < 95 and surface["mean_mm"] > 2, "nothing is off, so nothing was compared"


def main() -> None:
    for needed in ("plastimatch", "elastix"):
        if not shutil.which(needed):
            print(f"skipped: there is no {needed}")
            sys.exit(77)
    with tempfile.TemporaryDirectory() as folder:
        check(str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(folder))


if __name__ == "__main__":
    main()
