# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What Python computes has the bits of the program."""

import json
import pathlib

import numpy as np
import pytest
import tetwarp as tw

FORMULAS = {
    "identity": lambda grid, cell: tw.fields.identity(grid, cell_size=cell),
    "wave:amplitude=12,wavelength=150,phase=20": lambda grid, cell: tw.fields.wave(
        grid, amplitude=12, wavelength=150, phase=20, cell_size=cell
    ),
    "twist:angle=25": lambda grid, cell: tw.fields.twist(grid, angle=25, cell_size=cell),
    "bubble:radius=80,strength=0.8,center=5/-7/3": lambda grid, cell: tw.fields.bubble(
        grid, radius=80, strength=0.8, center=(5, -7, 3), cell_size=cell
    ),
    "bubble-paper:shift=20": lambda grid, cell: tw.fields.bubble_paper(grid, shift=20, cell_size=cell),
    "translate:by=9/0/-16": lambda grid, cell: tw.fields.translate(grid, by=(9, 0, -16), cell_size=cell),
    "elastic:amplitude=15,spacing=60,seed=11": lambda grid, cell: tw.fields.elastic(
        grid, amplitude=15, spacing=60, seed=11, cell_size=cell
    ),
}
MAPS = ("coverage", "inverse", "jacobian", "folds")


@pytest.mark.parametrize("cell", [1, 5])
@pytest.mark.parametrize("text", FORMULAS)
def test_every_formula_and_map_has_the_bits_of_the_program(program, ct, ct_file, tmp_path, backend, text, cell):
    maps = {name: tmp_path / f"{name}.mha" for name in MAPS}
    program(
        "deform", ct_file, "-f", text, "-o", tmp_path / "out.mha", "--cell-size", cell, "--outside", "background",
        "--backend", backend, "--report", tmp_path / "report.json", "--background", -1000,
        *[word for name, path in maps.items() for word in (f"--{name}", path)],
    )
    field = FORMULAS[text](ct.geometry, cell)
    done = tw.deform(ct, field, outside="background", background=-1000, maps=MAPS, backend=backend)
    assert done.report.backend == backend
    assert_same_bits(done.volume, tw.read(tmp_path / "out.mha"))
    for name, path in maps.items():
        assert_same_bits(done.maps[name], tw.read(path))
    said = json.loads((tmp_path / "report.json").read_text())
    for key in ("covered", "uncovered", "inverted", "degenerate", "multiply_owned"):
        assert list(values_of(said, key)) == [getattr(done.report, key)], key


def values_of(document, key):
    """All values of a key, wherever it stands."""
    if isinstance(document, dict):
        for name, value in document.items():
            if name == key or (key, name) in (("covered", "voxels_covered"), ("uncovered", "voxels_uncovered")):
                yield value
            else:
                yield from values_of(value, key)
    elif isinstance(document, list):
        for value in document:
            yield from values_of(value, key)


def assert_same_bits(volume, expected):
    assert volume.geometry == expected.geometry
    assert volume.array.dtype == expected.array.dtype
    assert volume.array.tobytes() == expected.array.tobytes()


@pytest.mark.parametrize("interpolation", ["nearest", "linear", "cubic"])
@pytest.mark.parametrize("dtype", ["uint8", "int16", "int32", "float32", "float64"])
def test_every_interpolation_and_type_has_the_bits_of_the_program(program, ct, tmp_path, interpolation, dtype):
    values = (ct.array.astype("float64") / 7 + 140).astype(dtype)
    volume = tw.Volume(values, ct.geometry)
    tw.write(volume, tmp_path / "in.nrrd")
    program(
        "deform", tmp_path / "in.nrrd", "-f", "twist:angle=25", "-o", tmp_path / "out.nrrd", "--interpolation",
        interpolation, "--outside", "background",
    )
    done = tw.deform(
        volume, tw.fields.twist(ct.geometry, angle=25), outside="background", interpolation=interpolation
    )
    assert_same_bits(done.volume, tw.read(tmp_path / "out.nrrd"))


@pytest.mark.parametrize("suffix", [".mha", ".nrrd", ".nii", ".nii.gz"])
def test_a_file_written_here_is_read_here_and_by_the_program(program, ct, tmp_path, suffix):
    path = tmp_path / f"volume{suffix}"
    tw.write(ct, path)
    again = tw.read(path)
    assert again.array.tobytes() == ct.array.tobytes()
    assert np.allclose(again.geometry.affine("LPS"), ct.geometry.affine("LPS"), atol=1e-4)
    said = json.loads(program("info", path, "--json").stdout)
    assert said == tw.info(path)


def test_what_goes_along_has_the_bits_of_the_program(program, ct, ct_file, tmp_path):
    labels = tw.Volume((ct.array > 200).astype(np.uint8) + (ct.array > -200), ct.geometry)
    tw.write(labels, tmp_path / "labels.mha")
    program(
        "deform", ct_file, "-f", "elastic:amplitude=15,spacing=60,seed=3", "-o", tmp_path / "out.mha",
        "--outside", "background", "--with", f"{tmp_path / 'labels.mha'}={tmp_path / 'moved.mha'}:vote",
    )
    field = tw.fields.elastic(ct.geometry, amplitude=15, spacing=60, seed=3)
    done = tw.deform(ct, field, outside="background", with_=[tw.Along(labels, interpolation="vote")])
    assert_same_bits(done.volumes[0], tw.read(tmp_path / "moved.mha"))


def test_mass_grid_that_fits_and_pull_fields_have_the_bits_of_the_program(program, ct, ct_file, tmp_path):
    field = tw.fields.twist(ct.geometry, angle=25, cell_size=4)
    program(
        "deform", ct_file, "-f", "twist:angle=25", "--cell-size", 4, "-o", tmp_path / "fit.mha", "--grid", "fit",
        "--preserve", "mass",
    )
    assert_same_bits(tw.deform(ct, field, grid="fit", preserve="mass").volume, tw.read(tmp_path / "fit.mha"))

    inverse = tw.invert(field, ct.geometry)
    finite = tw.PullField(ct.geometry, np.nan_to_num(inverse.displacement))
    tw.write_field(finite, tmp_path / "pull.mha")
    program("deform", ct_file, "--pull-field", tmp_path / "pull.mha", "-o", tmp_path / "pulled.mha")
    done = tw.deform(ct, pull_field=tw.read_field(tmp_path / "pull.mha", direction="pull"))
    assert_same_bits(done.volume, tw.read(tmp_path / "pulled.mha"))


def test_composed_fields_and_points_have_the_numbers_of_the_program(program, ct, ct_file, tmp_path):
    (tmp_path / "in.csv").write_text("x,y,z\n1,2,3\n-20,15,30\n900,0,0\n")
    program(
        "deform", ct_file, "-f", "twist:angle=25", "-f", "translate:by=9/0/0", "-o", tmp_path / "out.mha",
        "--outside", "background", "--points", f"{tmp_path / 'in.csv'}={tmp_path / 'out.csv'}",
    )
    field = tw.fields.formula(["twist:angle=25", "translate:by=9/0/0"], ct.geometry)
    done = tw.deform(ct, field, outside="background", points=[[1, 2, 3], [-20, 15, 30], [900, 0, 0]])
    assert_same_bits(done.volume, tw.read(tmp_path / "out.mha"))
    rows = [line.split(",") for line in (tmp_path / "out.csv").read_text().splitlines()[1:]]
    assert np.allclose([[float(value) for value in row[:3]] for row in rows], done.points, rtol=0, atol=1e-5)
    assert [row[3] == "moved" for row in rows] == done.inside.tolist() == [True, True, False]


SCENARIOS = pathlib.Path(__file__).resolve().parents[2] / "examples" / "scenarios"


@pytest.mark.parametrize("name", ["diaphragm_push", "retractor"])
def test_a_scenario_gives_the_field_of_the_program(program, tmp_path, name):
    body = tw.phantom((64, 64, 40), spacing=(5.5, 5.5, 8))
    tw.write(body, tmp_path / "ct.mha")
    page = SCENARIOS / f"{name}.json"
    program("simulate", page, tmp_path / "ct.mha", "-o", tmp_path / "field.mha", "--backend", "cpu")
    run = tw.simulate(page, body, backend="cpu")
    frames = list(run)
    assert [frame.number for frame in frames] == list(range(1, run.frames + 1))
    expected = tw.read_field(tmp_path / "field.mha")
    assert frames[-1].field.displacement.tobytes() == expected.displacement.tobytes()
    assert not np.array_equal(frames[0].field.displacement, expected.displacement)
    again = tw.simulate(json.loads(page.read_text()), body, backend="cpu")
    assert again.field.displacement.tobytes() == expected.displacement.tobytes()


def test_an_open_cut_is_one_field_with_that_of_the_program(program, tmp_path):
    body = tw.phantom((96, 96, 60), spacing=(3.7, 3.7, 5))
    tw.write(body, tmp_path / "ct.mha")
    page = SCENARIOS / "incision.json"
    scenario = json.loads(page.read_text())
    scenario["phases"] = scenario["phases"][:1]
    (tmp_path / "first.json").write_text(json.dumps(scenario))
    program(
        "deform", tmp_path / "ct.mha", "--scenario", tmp_path / "first.json", "-o", tmp_path / "out.mha",
        "--outside", "background", "--backend", "cpu",
    )
    field = tw.simulate(scenario, body, backend="cpu").field
    assert field.replaced is not None and len(field.mesh.tetrahedra) > 0
    assert_same_bits(tw.deform(body, field, outside="background", backend="cpu").volume, tw.read(tmp_path / "out.mha"))


def test_a_series_in_implicit_vr_is_read(program, tmp_path):
    """Without DCMTK's data dictionary nothing is known of such a file but its numbers."""
    if not tw.features()["dicom"]:
        pytest.skip("a build without DICOM")
    pydicom = pytest.importorskip("pydicom")
    program("phantom", "-o", tmp_path / "explicit", "--size", "32,32,10", "--spacing", "11,11,30")
    (tmp_path / "implicit").mkdir()
    for path in (tmp_path / "explicit").iterdir():
        slice_ = pydicom.dcmread(path)
        slice_.file_meta.TransferSyntaxUID = pydicom.uid.ImplicitVRLittleEndian
        slice_.save_as(tmp_path / "implicit" / path.name, implicit_vr=True, little_endian=True)
    assert_same_bits(tw.read(tmp_path / "implicit"), tw.read(tmp_path / "explicit"))


def test_a_derived_series_has_the_pixels_and_uids_of_the_program(program, ct, tmp_path):
    if not tw.features()["dicom"]:
        pytest.skip("a build without DICOM")
    pydicom = pytest.importorskip("pydicom")
    program("phantom", "-o", tmp_path / "study", "--size", "32,32,10", "--spacing", "11,11,30")
    program("deform", tmp_path / "study", "-f", "twist:angle=9", "--outside", "background", "-o", tmp_path / "theirs")
    study = tw.read(tmp_path / "study")
    done = tw.deform(study, tw.fields.twist(study.geometry, angle=9), outside="background")
    tw.write(done.volume, tmp_path / "ours")
    theirs = sorted((tmp_path / "theirs").iterdir())
    ours = sorted((tmp_path / "ours").iterdir())
    assert [path.name for path in ours] == [path.name for path in theirs]
    for one, other in zip(ours, theirs):
        a, b = pydicom.dcmread(one), pydicom.dcmread(other)
        assert a.PixelData == b.PixelData
        assert a.SeriesInstanceUID == b.SeriesInstanceUID
        assert a.FrameOfReferenceUID == b.FrameOfReferenceUID
