# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""The studies of examples/studies at a small size: what they make is what their texts say.

    check_studies.py STUDIES_FOLDER        wants the package tetwarp; status 77: nibabel is missing
"""
import csv
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy
import tetwarp

try:
    import nibabel
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
studies = pathlib.Path(sys.argv[1]).resolve()
SMALL = ["--size", "48,48,24"]
# Names that a shell, or an option, would take for more than names.
HOSTILE = ["it's; touch hurt; '", "$(touch hurt)`touch hurt`", "-o", "two\nlines\n", " blanks  ", '"quotes" & \\back\\',
           "a=b:c,d", "braces {out} {0}"]


def start(name, *arguments, **options):
    return subprocess.run([sys.executable, studies / name, *map(str, arguments)], capture_output=True, text=True, **options)


def run(name, *arguments):
    done = start(name, *SMALL, *arguments)
    assert done.returncode == 0, done.stderr


def voxels(path):
    return numpy.asarray(nibabel.load(path).dataobj)


def table(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def check_augmentation(folder):
    run("augmentation_set.py", "-o", folder, "--variants", 5)
    pairs = table(folder / "set.csv")
    assert len(pairs) == 5
    labels = voxels(folder / "labels.nii.gz")
    before = [voxels(folder / pair["image"]) for pair in pairs]
    assert len({image.tobytes() for image in before}) == 5, "two variants are the same"
    for pair, image in zip(pairs, before):
        label = voxels(folder / pair["label"])
        assert image.shape == label.shape == labels.shape
        assert set(numpy.unique(label)) <= set(numpy.unique(labels)), "a label that was not there"
        bone, air = image[label == 3].mean(), image[label == 0].mean()
        assert bone > 250 and air < -800, f"labels do not lie on what they name: bone {bone} HU, outside {air} HU"
        for number in (1, 2, 3):
            assert 0.7 < (label == number).sum() / (labels == number).sum() < 1.4, "a label grew or shrank much"
    # A study that was broken off goes on: what is there is kept, what is not is made with the same bytes.
    image = folder / pairs[2]["image"]
    kept = image.read_bytes()
    image.unlink()
    run("augmentation_set.py", "-o", folder, "--variants", 5)
    assert image.read_bytes() == kept


def check_robustness(folder):
    run("robustness_study.py", "-o", folder, "--steps", 3, "--repeats", 2)
    rows = table(folder / "robustness.csv")
    assert len(rows) == 6
    means = [numpy.mean([[float(row[key]) for key in ("mean_hu_difference", "dice_to_undeformed", "jacobian_min")]
                         for row in rows if float(row["amplitude_mm"]) == amplitude], axis=0) for amplitude in (8, 16, 24)]
    difference, kept, jacobian = numpy.transpose(means)
    assert (numpy.diff(difference) > 0).all(), difference
    assert (numpy.diff(kept) < 0).all() and kept[0] < 1, kept
    assert (numpy.diff(jacobian) < 0).all() and jacobian[-1] > 0, jacobian
    assert all(row["folded"] == "0" for row in rows)
    assert all(0.5 < float(row["dice_of_method"]) <= 1 for row in rows)
    picture = folder / "robustness.png"
    if not picture.exists():
        print("no plot: matplotlib is missing")
    else:
        assert picture.read_bytes().startswith(b"\x89PNG")


def check_sequence(folder):
    run("sequence_4d.py", "-o", folder, "--phases", 6, "--period", 3)
    sequence = nibabel.load(folder / "sequence.nii.gz")
    values = numpy.asarray(sequence.dataobj)
    assert values.shape == (48, 48, 24, 6)
    assert abs(sequence.header.get_zooms()[3] - 0.5) < 1e-6
    ct = voxels(folder / "ct.nii.gz")
    assert (values[..., 0] == ct).all(), "the first phase is not at rest"
    assert (values[..., 1] == values[..., 5]).all(), "the way out differs from the way back"
    moved = [numpy.abs(values[..., n].astype(float) - ct).mean() for n in range(4)]
    assert (numpy.diff(moved) > 0).all(), moved
    farthest = voxels(folder / table(folder / "phases.csv")[3]["field"])
    half = voxels(folder / table(folder / "phases.csv")[1]["field"])
    assert numpy.allclose(half, farthest / 4, atol=1e-5), "fields of a sequence are one field, scaled"


def check_hostile_names(folder):
    ct = tetwarp.phantom((16, 16, 8), spacing=(20, 20, 25))
    for number, name in enumerate(HOSTILE):
        here = folder / str(number)
        here.mkdir(parents=True)
        tetwarp.write(ct, here / f"{name}.nrrd")
        done = start("augmentation_set.py", f"--output={name} set", "--variants", 1, "--", f"{name}.nrrd", cwd=here)
        if "=" in name:
            assert done.returncode == 1 and "a path with = cannot go along" in done.stderr, done.stderr
        else:
            assert done.returncode == 0 and (here / f"{name} set" / "set.csv").stat().st_size > 0, done.stderr
        assert not list(here.rglob("hurt*")), name


with tempfile.TemporaryDirectory(prefix="tetwarp-studies-") as scratch:
    for name, check in (("set", check_augmentation), ("robustness", check_robustness), ("sequence", check_sequence),
                        ("names", check_hostile_names)):
        check(pathlib.Path(scratch) / name)
        print("good:", name)
