# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Files of other programs lead points where these programs say, and warp as they do (tests/formats)."""

import json
import os
import pathlib

import numpy as np
import pytest
import tetwarp as tw

FORMATS = pathlib.Path(__file__).resolve().parents[2] / "tests" / "formats" / "cases"
CASES = sorted(path.parent.name for path in FORMATS.glob("*/case.json"))

#: Largest difference of a displacement, mm: fields are float32, and ITK's points in double.
BOUND_MM = 2e-5
#: Largest difference of a voxel of values from 0 to 100; programs interpolate in float.
BOUND_VALUE = 2e-2


@pytest.fixture(name="case", params=CASES)
def _case(request, monkeypatch):
    monkeypatch.chdir(FORMATS / request.param)
    return json.loads(pathlib.Path("case.json").read_text(encoding="utf-8"))


@pytest.fixture(name="field")
def _field(case):
    like = tw.read("../fixed.nii.gz")
    files = [file.partition(":") for file in case["pull_field"]]
    by_itk = any(name.endswith((".h5", ".toml", ".mat", ".txt")) and "tool=" not in options for name, _, options in files)
    if by_itk and not tw.features()["itk_transforms"]:
        pytest.skip("a build without ITK")
    return tw.read_field(case["pull_field"], like=like, direction="pull")


@pytest.mark.parametrize("name", ["warp.npz", "WARP.NPZ"])
@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_an_array_of_an_archive_is_read_a_piece_at_a_time(tmp_path, monkeypatch, save, name):
    monkeypatch.chdir(tmp_path)
    by = np.random.default_rng(5).normal(size=(30, 40, 50, 3)).astype(np.float32)
    with open(name, "wb") as file:
        save(file, first=by[:2], vol=by)
    like = tw.Volume(np.zeros((30, 40, 50), np.int16), tw.Geometry((50, 40, 30)))
    field = tw.read_field(f"{name}:key=vol,order=zyx,units=mm", like=like, direction="pull")
    assert np.array_equal(np.asarray(field.displacement), by)
    whole = pathlib.Path(name).read_bytes()
    at = len(whole) * 3 // 4  # of the values of vol
    pathlib.Path(name).write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
    with pytest.raises(tw.InputError, match="damaged"):
        tw.read_field(f"{name}:key=vol,order=zyx,units=mm", like=like, direction="pull")


def test_there_are_cases():
    assert len(CASES) >= 15


def test_points_go_where_the_program_says(field, case):
    if not os.path.exists("expected.npy"):
        pytest.skip("the program does not say where points go")
    expected = np.load("expected.npy")
    fixed = tw.read("../fixed.nii.gz").geometry
    found = at_voxels(field, fixed)
    known = np.isfinite(found) & np.isfinite(expected)
    assert known.mean() > 0.5
    assert np.abs(found - expected)[known].max() <= case.get("bound_mm", BOUND_MM)


def at_voxels(field, geometry):
    """The displacements of a pull field whose grid has the voxels of another, perhaps along other axes."""
    values = np.asarray(field.displacement)
    step = np.linalg.inv(np.asarray(geometry.direction)) @ np.asarray(field.geometry.direction)
    assert np.allclose(np.abs(step), np.eye(3), atol=1e-4)
    flips = tuple(2 - axis for axis in range(3) if step[axis, axis] < 0)
    return np.flip(values, flips) if flips else values


def test_the_volume_is_the_program_s(field):
    if not os.path.exists("warped.nii.gz"):
        pytest.skip("the program does not warp")
    moving, expected = tw.read("../moving.nii.gz"), tw.read("warped.nii.gz")
    done = tw.deform(moving, pull_field=field, grid=tw.read("../fixed.nii.gz"), background=-1000, outside="background")
    found, wanted = np.asarray(done.volume.array, float), np.asarray(expected.array, float)
    inside = has_neighbours(field, tw.read("../fixed.nii.gz").geometry, moving.geometry)
    assert inside.mean() > 0.2
    assert np.abs(found - wanted)[inside].max() <= BOUND_VALUE


def has_neighbours(field, fixed, moving):
    """Whether what a voxel takes lies between voxels of the moving volume: beyond, each program does otherwise."""
    k, j, i = np.indices(tuple(reversed(fixed.size)))
    points = at(fixed, np.stack([i, j, k], -1)) + at_voxels(field, fixed)
    index = (points - moving.origin) @ np.linalg.inv(np.asarray(moving.direction)).T / moving.spacing
    return np.all((index >= 0) & (index <= np.asarray(moving.size) - 1), axis=-1)


def at(geometry, index):
    """The points, LPS mm, of indices i, j, k."""
    return np.asarray(geometry.origin) + (index * geometry.spacing) @ np.asarray(geometry.direction).T
