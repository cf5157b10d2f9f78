# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Zarr and OME-Zarr: places, units, axes, what is damaged, and slabs that have the bits of the whole."""

import json
import os
import subprocess
import sys
import textwrap

import numpy as np
import pytest
import tetwarp as tw

zarr = pytest.importorskip("zarr", minversion="2.18")
import tetwarp.zarr  # noqa: E402

HAS_3 = int(zarr.__version__.split(".")[0]) >= 3
VERSIONS = ["0.4", "0.5"] if HAS_3 else ["0.4"]
TYPES = ["int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"]


@pytest.fixture(params=VERSIONS)
def version(request):
    return request.param


def numbered(shape, kind="int16"):
    return np.arange(np.prod(shape)).reshape(shape).astype(kind)


@pytest.fixture
def volume():
    """Anisotropic, away from the origin, no axis as long as another, with chunks that end inside."""
    return tw.Volume(numbered((7, 11, 13)), tw.Geometry((13, 11, 7), (0.7, 1.3, 2.9), (-20.1, 33.3, 400.7)))


def made(folder, values, axes, steps, version="0.4", of_all=(), units="millimeter"):
    """An image of OME-Zarr by the library alone: axes such as "tczyx", and the steps of its one level."""
    kinds = {"t": "time", "c": "channel"}
    image = {
        "axes": [
            {"name": name, "type": kinds.get(name, "space"), **({"unit": units} if units and name in "xyz" else {})}
            for name in axes
        ],
        "datasets": [{"path": "full", "coordinateTransformations": steps}],
        "coordinateTransformations": list(of_all),
    }
    form = {"zarr_format": 2 if version == "0.4" else 3} if HAS_3 else {}
    group = zarr.open_group(str(folder), mode="w", **form)
    if HAS_3:
        group.create_array("full", shape=values.shape, dtype=values.dtype, chunks=values.shape)[...] = values
    else:
        group.create_dataset("full", shape=values.shape, dtype=values.dtype, chunks=values.shape)[...] = values
    if version == "0.4":
        group.attrs["multiscales"] = [{"version": version, **image}]
    else:
        group.attrs["ome"] = {"version": version, "multiscales": [image]}
    return folder


def scale(*numbers):
    return {"type": "scale", "scale": list(numbers)}


def translation(*numbers):
    return {"type": "translation", "translation": list(numbers)}


@pytest.mark.parametrize("kind", TYPES)
def test_what_is_written_is_read(tmp_path, volume, version, kind):
    given = tw.Volume(volume.array.astype(kind), volume.geometry)
    tetwarp.zarr.write(given, tmp_path / "a.zarr", chunks=(2, 5, 13), version=version)
    again = tetwarp.zarr.read(tmp_path / "a.zarr", space="LPS")
    assert again.array.dtype == kind and again.array.tobytes() == given.array.tobytes()
    assert again.geometry == volume.geometry
    assert again.notes == [] and os.listdir(tmp_path) == ["a.zarr"]


def test_what_is_written_is_what_the_specification_says(tmp_path, volume, version):
    tetwarp.zarr.write(volume, tmp_path / "a.zarr", version=version)
    file = tmp_path / "a.zarr" / ("zarr.json" if version == "0.5" else ".zattrs")
    page = json.loads(file.read_text())
    if version == "0.5":
        assert json.loads((tmp_path / "a.zarr" / "0" / "zarr.json").read_text())["dimension_names"] == ["z", "y", "x"]
        page = page["attributes"]["ome"]
        assert page["version"] == "0.5"
    else:
        assert page["multiscales"][0]["version"] == "0.4"
        assert json.loads((tmp_path / "a.zarr" / "0" / ".zarray").read_text())["dimension_separator"] == "/"
    assert [tuple(axis.values()) for axis in page["multiscales"][0]["axes"]] == [
        (name, "space", "millimeter") for name in "zyx"
    ]
    assert page["multiscales"][0]["datasets"] == [
        {"path": "0", "coordinateTransformations": [scale(2.9, 1.3, 0.7), translation(400.7, 33.3, -20.1)]}
    ]


def test_another_library_reads_the_same_place(tmp_path, volume, version):
    ngff_zarr = pytest.importorskip("ngff_zarr")
    tetwarp.zarr.write(volume, tmp_path / "a.zarr", levels=2, version=version)
    for level, image in enumerate(ngff_zarr.from_ngff_zarr(str(tmp_path / "a.zarr")).images):
        ours = tetwarp.zarr.read(tmp_path / "a.zarr", level=level, space="LPS")
        assert tuple(image.scale[name] for name in "xyz") == ours.geometry.spacing
        assert tuple(image.translation[name] for name in "xyz") == ours.geometry.origin
        assert np.array_equal(np.asarray(image.data), ours.array)


@pytest.mark.parametrize("space", ["LPS", "RAS"])
@pytest.mark.parametrize("axes", ["zyx", "xyz", "yxz"])
def test_voxels_lie_where_the_file_says(tmp_path, version, axes, space):
    values = numbered((3, 4, 5))
    folder = made(tmp_path / "a", values, axes, [scale(2, 3, 5), translation(100, 200, 300)], version)
    read = tetwarp.zarr.read(folder, space=space)
    assert np.array_equal(read.array, values)
    # The voxel of index (1, 2, 4) of the file: a coordinate is scale times index plus translation, by name of the axis.
    place = dict(zip(axes, (2 * 1 + 100, 3 * 2 + 200, 5 * 4 + 300)))
    sign = -1 if space == "RAS" else 1
    assert read.geometry.point([4, 2, 1]).tolist() == [sign * place["x"], sign * place["y"], place["z"]]


def test_places_are_those_of_simpleitk(tmp_path, volume, version):
    sitk = pytest.importorskip("SimpleITK")
    image = sitk.GetImageFromArray(volume.array)
    image.SetSpacing(volume.geometry.spacing)
    image.SetOrigin(volume.geometry.origin)
    tetwarp.zarr.write(image, tmp_path / "a.zarr", version=version)
    read = tetwarp.zarr.read(tmp_path / "a.zarr", space="LPS").geometry
    for index in [(0, 0, 0), (12, 10, 6), (3.5, 1, 2.25)]:
        assert np.allclose(read.point(index), image.TransformContinuousIndexToPhysicalPoint(index), rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    "space, direction",
    [
        ("RAS", np.diag([-1, -1, 1])),
        ("LPS", [[0, 0, 1], [1, 0, 0], [0, 1, 0]]),
        ("RAS", [[0, 0, -1], [-1, 0, 0], [0, 1, 0]]),
    ],
)
def test_grids_along_the_axes_keep_their_place(tmp_path, volume, version, space, direction):
    geometry = tw.Geometry(volume.geometry.size, volume.geometry.spacing, volume.geometry.origin, direction)
    tetwarp.zarr.write(tw.Volume(volume.array, geometry), tmp_path / "a.zarr", space=space, version=version)
    again = tetwarp.zarr.read(tmp_path / "a.zarr", space=space)
    assert again.geometry == geometry and np.array_equal(again.array, volume.array)


def test_rounded_cosines_are_no_direction_and_others_are(tmp_path, volume):
    def turned(by):
        c, s = np.cos(by), np.sin(by)
        grid = tw.Geometry(volume.geometry.size, volume.geometry.spacing, (1, 2, 3), [[c, -s, 0], [s, c, 0], [0, 0, 1]])
        return tw.Volume(volume.array, grid)

    given = turned(1e-12)
    tetwarp.zarr.write(given, tmp_path / "a.zarr", version="0.4")
    again = tetwarp.zarr.read(tmp_path / "a.zarr", space="LPS").geometry
    assert np.abs(again.point([12, 10, 6]) - given.geometry.point([12, 10, 6])).max() < 1e-6
    with pytest.raises(tw.InputError, match="no direction.*L, P, S.*write .mha"):
        tetwarp.zarr.write(turned(1e-6), tmp_path / "b.zarr", version="0.4")
    flipped = tw.Geometry(volume.geometry.size, direction=np.diag([-1, -1, 1]))
    with pytest.raises(tw.InputError, match='R, A, S, not along x, y, z of LPS: pass space="RAS"'):
        tetwarp.zarr.write(tw.Volume(volume.array, flipped), tmp_path / "b.zarr", version="0.4")
    uneven = tw.Geometry(volume.geometry.size, (1, 1, 2), slices=[0, 1, 5, 6, 9, 11, 12])
    with pytest.raises(tw.InputError, match="b.zarr: OME-Zarr has no slices at uneven distances"):
        tetwarp.zarr.write(tw.Volume(volume.array, uneven), tmp_path / "b.zarr", version="0.4")
    assert os.listdir(tmp_path) == ["a.zarr"]


def test_a_frame_is_never_guessed(tmp_path, version):
    folder = made(tmp_path / "a", numbered((3, 4, 5)), "zyx", [scale(1, 1, 1)], version)
    for space in (None, "ras"):
        with pytest.raises(tw.InputError, match="LPS"):
            tetwarp.zarr.read(folder, space=space)


def test_a_file_that_says_its_anatomy_is_believed(tmp_path):
    folder = made(tmp_path / "a", numbered((3, 4, 5)), "zyx", [scale(1, 1, 1)])
    page = json.loads((folder / ".zattrs").read_text())
    page["multiscales"][0]["axes"][2]["orientation"] = {"type": "anatomical", "value": "left-to-right"}
    (folder / ".zattrs").write_text(json.dumps(page))
    assert tetwarp.zarr.read(folder, space="RAS").geometry.orientation == "RAS"
    with pytest.raises(tw.InputError, match="x leads left-to-right"):
        tetwarp.zarr.read(folder, space="LPS")


@pytest.mark.parametrize("unit, mm", [("nanometer", 1e-6), ("micrometer", 1e-3), ("centimeter", 10), ("meter", 1000)])
def test_lengths_become_millimetres(tmp_path, version, unit, mm):
    steps = [scale(0.2, 0.3, 0.5), translation(1, 2, 3)]
    if mm < 1:
        steps = [scale(2e3, 3e3, 5e3), translation(1e3, 2e3, 3e3)]
    folder = made(tmp_path / "a", numbered((3, 4, 5)), "zyx", steps, version, units=unit)
    grid = tetwarp.zarr.read(folder, space="LPS").geometry
    assert np.allclose(grid.spacing, np.array(steps[0]["scale"][::-1]) * mm, rtol=1e-15)
    assert np.allclose(grid.origin, np.array(steps[1]["translation"][::-1]) * mm, rtol=1e-15)
    assert tetwarp.zarr.read(folder, space="LPS", unit=unit).geometry == grid
    with pytest.raises(tw.InputError, match="contradicts"):
        tetwarp.zarr.read(folder, space="LPS", unit="millimeter")


@pytest.mark.parametrize("unit", [None, "parsec", ""])
def test_units_that_are_not_known_are_asked_for(tmp_path, version, unit):
    folder = made(tmp_path / "a", numbered((3, 4, 5)), "zyx", [scale(2, 3, 5)], version, units=None)
    if unit is not None:
        folder = made(tmp_path / "a", numbered((3, 4, 5)), "zyx", [scale(2, 3, 5)], version, units=unit or " ")
    with pytest.raises(tw.InputError, match="unit.* along x; pass unit="):
        tetwarp.zarr.read(folder, space="LPS")
    assert tetwarp.zarr.read(folder, space="LPS", unit="centimeter").geometry.spacing == (50, 30, 20)
    with pytest.raises(tw.InputError, match="inch"):
        tetwarp.zarr.read(folder, space="LPS", unit="inch")


def test_transformations_follow_one_another(tmp_path, version):
    folder = made(
        tmp_path / "a", numbered((3, 4, 5)), "zyx", [scale(2, 3, 5), translation(10, 20, 30)], version,
        of_all=[scale(0.5, 2, 1), translation(1, 0, -4)],
    )
    grid = tetwarp.zarr.read(folder, space="LPS").geometry
    assert grid.spacing == (5, 6, 1) and grid.origin == (30 - 4, 20 * 2, 10 * 0.5 + 1)
    folder = made(tmp_path / "a", numbered((3, 4, 5)), "zyx", [scale(2, 3, 5)], version, of_all=[{"type": "affine"}])
    with pytest.raises(tw.InputError, match="affine"):
        tetwarp.zarr.read(folder, space="LPS")
    nan = float("nan")
    for wrong in ([], [translation(1, 1, 1)], [scale(1, 1)], [scale(1, "2", 1)], [scale(1, 0, 1)], [scale(1, 1, nan)]):
        folder = made(tmp_path / "a", numbered((3, 4, 5)), "zyx", wrong, version)
        with pytest.raises(tw.InputError, match=str(folder)):
            tetwarp.zarr.read(folder, space="LPS")


def test_times_and_channels_are_chosen_by_name(tmp_path, version):
    values = numbered((4, 2, 3, 5, 6))
    folder = made(tmp_path / "a", values, "tczyx", [scale(9, 1, 2, 3, 4)], version)
    for index in (None, {}, {"t": 1}, {"c": 1}):
        with pytest.raises(tw.InputError, match=r"t \(time\) 0 to 3, c \(channel\) 0 to 1"):
            tetwarp.zarr.read(folder, space="LPS", index=index)
    read = tetwarp.zarr.read(folder, space="LPS", index={"c": 1, "t": 2})
    assert np.array_equal(read.array, values[2, 1]) and read.geometry.spacing == (4, 3, 2)
    for wrong in ({"t": 4}, {"t": -1}, {"t": 0.0}, {"z": 1}, {"q": 1}):
        with pytest.raises(tw.InputError, match=f"index has '{next(iter(wrong))}'"):
            tetwarp.zarr.read(folder, space="LPS", index={"t": 0, "c": 0, **wrong})
    with pytest.raises(TypeError, match="dict"):
        tetwarp.zarr.read(folder, space="LPS", index=(0, 0))
    one = made(tmp_path / "b", values[:1, :1], "tczyx", [scale(9, 1, 2, 3, 4)], version)
    assert np.array_equal(tetwarp.zarr.read(one, space="LPS").array, values[0, 0])


def test_voxels_of_all_levels_lie_where_they_lay(tmp_path, volume, version):
    tetwarp.zarr.write(volume, tmp_path / "a.zarr", chunks=(3, 4, 5), levels=4, version=version)
    for level, shape in enumerate([(7, 11, 13), (4, 6, 7), (2, 3, 4), (1, 2, 2)]):
        read = tetwarp.zarr.read(tmp_path / "a.zarr", level=level, space="LPS")
        assert read.array.shape == shape and read.notes == []
        assert np.array_equal(read.array, volume.array[:: 2**level, :: 2**level, :: 2**level])
        index = np.array([1, 1, 0])
        assert np.allclose(read.geometry.point(index), volume.geometry.point(index * 2**level), rtol=0, atol=1e-12)
    with pytest.raises(tw.InputError, match="a.zarr has 0 to 3"):
        tetwarp.zarr.read(tmp_path / "a.zarr", level=4, space="LPS")
    with pytest.raises(tw.InputError, match="levels is 5"):
        tetwarp.zarr.write(volume, tmp_path / "b.zarr", levels=5, version=version)


def test_a_plain_array_wants_its_place(tmp_path, volume):
    path = str(tmp_path / "plain.zarr")
    zarr.save_array(path, volume.array)
    read = tetwarp.zarr.read(path, geometry=volume.geometry)
    assert np.array_equal(read.array, volume.array) and read.geometry == volume.geometry
    with pytest.raises(tw.InputError, match="geometry="):
        tetwarp.zarr.read(path)
    with pytest.raises(tw.InputError, match="OME-Zarr"):
        tetwarp.zarr.read(path, geometry=volume.geometry, space="LPS")
    with pytest.raises(tw.InputError, match=r"plain.zarr has the shape \(7, 11, 13\)"):
        tetwarp.zarr.read(path, geometry=volume.geometry, order="ijk")
    with pytest.raises(TypeError, match="tetwarp.Geometry"):
        tetwarp.zarr.read(path, geometry=np.eye(4))
    zarr.save_array(str(tmp_path / "ijk.zarr"), np.stack([volume.array.T, -volume.array.T]))
    turned = tetwarp.zarr.read(tmp_path / "ijk.zarr", geometry=volume.geometry, order="ijk")
    assert np.array_equal(turned.array, np.stack([volume.array, -volume.array], axis=-1))
    zarr.save_array(str(tmp_path / "big.zarr"), volume.array.astype(">i2"))
    assert np.array_equal(tetwarp.zarr.read(tmp_path / "big.zarr", geometry=volume.geometry).array, volume.array)
    for kind in ("int64", "uint64", "float16", "complex64", "bool"):
        zarr.save_array(str(tmp_path / kind), volume.array.astype(kind))
        with pytest.raises(tw.InputError, match=f"{kind} holds {kind}; expected int8"):
            tetwarp.zarr.read(tmp_path / kind, geometry=volume.geometry)


def test_what_is_no_image_is_refused_by_name(tmp_path, volume, version):
    with pytest.raises(tw.InputError, match="no such"):
        tetwarp.zarr.read(tmp_path / "none.zarr", space="LPS")
    (tmp_path / "empty").mkdir()
    with pytest.raises(tw.InputError, match="empty cannot be read as Zarr"):
        tetwarp.zarr.read(tmp_path / "empty", space="LPS")
    folder = made(tmp_path / "a", numbered((3, 4, 5)), "zyx", [scale(1, 1, 1)], version)
    group = zarr.open_group(str(folder), mode="r+")
    with pytest.raises(tw.InputError, match="geometry="):
        tetwarp.zarr.read(folder, space="LPS", geometry=volume.geometry)
    key = "multiscales" if version == "0.4" else "ome"
    page = group.attrs[key]
    inner = page[0] if version == "0.4" else page
    inner["version"] = "0.6"
    group.attrs[key] = page
    with pytest.raises(tw.InputError, match="OME-Zarr 0.6; expected 0.4 or 0.5"):
        tetwarp.zarr.read(folder, space="LPS")
    inner["version"] = version
    (page if version == "0.4" else page["multiscales"])[0]["datasets"][0]["path"] = "gone"
    group.attrs[key] = page
    with pytest.raises(tw.InputError, match="a/gone is missing"):
        tetwarp.zarr.read(folder, space="LPS")
    for wrong in ([], [5], [{}], [{"axes": 3}], [{"axes": [3], "datasets": []}], {}, None, "x"):
        group.attrs[key] = wrong if version == "0.4" else {"version": "0.5", "multiscales": wrong}
        with pytest.raises(tw.InputError, match=str(folder)):
            tetwarp.zarr.read(folder, space="LPS")
    del group.attrs[key]
    with pytest.raises(tw.InputError, match="name one in it: full"):
        tetwarp.zarr.read(folder, space="LPS")
    flat = made(tmp_path / "b", numbered((4, 5)), "yx", [scale(1, 1)], version)
    with pytest.raises(tw.InputError, match="axes of space y, x"):
        tetwarp.zarr.read(flat, space="LPS")


def chunks_of(folder):
    return sorted(
        os.path.join(at, name)
        for at, _, names in os.walk(folder)
        for name in names
        if not name.startswith(".") and name != "zarr.json"
    )


def test_a_missing_chunk_is_said_and_a_short_one_refused(tmp_path, volume, version):
    given = tw.Volume(volume.array + np.int16(1), volume.geometry)
    given.array[:2] = 0  # chunks of zeros are written, too
    tetwarp.zarr.write(given, tmp_path / "a.zarr", chunks=(2, 11, 13), version=version)
    assert tetwarp.zarr.read(tmp_path / "a.zarr", space="LPS").notes == []
    second = chunks_of(tmp_path / "a.zarr" / "0")[1]
    content = open(second, "rb").read()
    os.remove(second)
    read = tetwarp.zarr.read(tmp_path / "a.zarr", space="LPS")
    assert read.notes == [f"1 of 4 chunks of {tmp_path / 'a.zarr'}/0 are missing: their voxels are 0"]
    assert not read.array[2:4].any() and np.array_equal(read.array[4:], given.array[4:])
    field = tw.fields.identity(volume.geometry)
    report = tetwarp.zarr.deform(tmp_path / "a.zarr", tmp_path / "b.zarr", field, space="LPS", version="0.4")
    assert report.notes == read.notes
    with open(second, "wb") as file:
        file.write(content[: len(content) // 2])
    with pytest.raises(tw.InputError, match="a.zarr/0 has a chunk that is damaged"):
        tetwarp.zarr.read(tmp_path / "a.zarr", space="LPS")


def test_a_missing_shard_is_said(tmp_path, volume):
    if not HAS_3:
        pytest.skip("zarr 2 has no shards")
    array = zarr.create_array(str(tmp_path / "a"), shape=(8, 8, 8), shards=(4, 8, 8), chunks=(2, 4, 4), dtype="int16")
    array[...] = 1
    grid = tw.Geometry((8, 8, 8))
    assert tetwarp.zarr.read(tmp_path / "a", geometry=grid).notes == []
    os.remove(chunks_of(tmp_path / "a")[0])
    assert tetwarp.zarr.read(tmp_path / "a", geometry=grid).notes[0].startswith("1 of 2 chunks")


def test_what_cannot_be_written_is_refused(tmp_path, volume):
    def write(array=volume.array, geometry=volume.geometry, path=tmp_path / "a.zarr", version="0.4", **options):
        tetwarp.zarr.write(tw.Volume(array, geometry), path, version=version, **options)

    with pytest.raises(tw.InputError, match="int64"):
        write(volume.array.astype(np.int64))
    with pytest.raises(tw.InputError, match="3 values a voxel"):
        write(np.zeros((7, 11, 13, 3), np.float32))
    for chunks in ((1, 1), (0, 1, 1), (1, 1, 1.5), 4):
        with pytest.raises(tw.InputError, match="chunks is|chunks"):
            write(chunks=chunks)
    with pytest.raises(tw.InputError, match="version"):
        write(version="0.3")
    with pytest.raises(tw.InputError, match="space"):
        write(space="RPS")
    with pytest.raises(tw.Error, match="no does not exist"):
        write(path=tmp_path / "no" / "a.zarr")
    assert os.listdir(tmp_path) == []
    if not HAS_3:
        with pytest.raises(tw.InputError, match="needs zarr 3"):
            write(version="0.5")


def test_nothing_is_replaced_unasked(tmp_path, volume, version):
    path = tmp_path / "a.zarr"
    tetwarp.zarr.write(volume, path, version=version)
    other = tw.Volume(-volume.array, volume.geometry)
    with pytest.raises(tw.Error, match="exists.*overwrite=True"):
        tetwarp.zarr.write(other, path, version=version)
    assert np.array_equal(tetwarp.zarr.read(path, space="LPS").array, volume.array)
    tetwarp.zarr.write(other, path, version=version, overwrite=True)
    assert np.array_equal(tetwarp.zarr.read(path, space="LPS").array, other.array)
    assert os.listdir(tmp_path) == ["a.zarr"]
    (tmp_path / "precious").mkdir()
    (tmp_path / "precious" / "thesis.tex").write_text("x")
    (tmp_path / "file").write_text("x")
    for name in ("precious", "file"):
        with pytest.raises(tw.Error, match="no folder of Zarr"):
            tetwarp.zarr.write(other, tmp_path / name, version=version, overwrite=True)
    assert (tmp_path / "precious" / "thesis.tex").exists()


@pytest.mark.parametrize(
    "problem, expected", [(OSError("No space left"), tw.Error), (KeyboardInterrupt(), KeyboardInterrupt)]
)
def test_what_fails_leaves_nothing_and_keeps_the_old(tmp_path, volume, monkeypatch, problem, expected):
    path = tmp_path / "a.zarr"
    tetwarp.zarr.write(volume, path, version="0.4")
    put, calls = tetwarp._zarr_files.Image.put, []

    def failing(self, first, slab):
        calls.append(first)
        if len(calls) == 2:
            raise problem
        put(self, first, slab)

    monkeypatch.setattr(tetwarp._zarr_files, "_SLAB", 1)
    monkeypatch.setattr(tetwarp._zarr_files.Image, "put", failing)
    with pytest.raises(expected):
        tetwarp.zarr.write(volume, path, chunks=(2, 11, 13), version="0.4", overwrite=True)
    assert len(calls) == 2 and os.listdir(tmp_path) == ["a.zarr"]
    assert np.array_equal(tetwarp.zarr.read(path, space="LPS").array, volume.array)


def torn(grid):
    """A field whose vertices go anywhere within 40 mm, so that it folds."""
    lattice = grid.lattice(3)
    by = np.random.default_rng(8).uniform(-40, 40, (*lattice.shape, 3)).astype(np.float32)
    return tw.VertexField(lattice, by)


FIELDS = {
    "fine": lambda grid: tw.fields.elastic(grid, amplitude=15, spacing=60, seed=3, cell_size=2),
    "coarse": lambda grid: tw.fields.elastic(grid, amplitude=15, spacing=60, seed=3, cell_size=5),
    "torn": torn,
}


@pytest.mark.parametrize("name", list(FIELDS))
@pytest.mark.parametrize("interpolation", ["linear", "cubic", "vote"])
def test_slabs_have_the_bits_of_the_whole(tmp_path, ct, backend, monkeypatch, name, interpolation):
    monkeypatch.setattr(tetwarp._zarr_files, "_SLAB", 1)
    field = FIELDS[name](ct.geometry)
    options = {"outside": "background", "interpolation": interpolation, "backend": backend}
    whole = tw.deform(ct, field, **options)
    tetwarp.zarr.write(ct, tmp_path / "ct.zarr", version="0.4")
    seen = []
    report = tetwarp.zarr.deform(
        tmp_path / "ct.zarr", tmp_path / "out.zarr", field, space="LPS", chunks=(3, 16, 40), levels=3, version="0.4",
        background=-1024, progress=seen.append, **options,
    )
    assert whole.volume.background == -1024  # that of the phantom, which the file does not keep
    out = tetwarp.zarr.read(tmp_path / "out.zarr", space="LPS")
    assert out.array.tobytes() == whole.volume.array.tobytes() and out.geometry == ct.geometry
    assert out.notes == [] and report == whole.report and report.covered > 0 and report.uncovered > 0
    assert (report.inverted > 0) == (name == "torn")
    assert seen == sorted(seen) and seen[-1] == 1 and len([share for share in seen if 0.2 < share < 0.8]) > 2
    coarse = tetwarp.zarr.read(tmp_path / "out.zarr", level=2, space="LPS")
    assert np.array_equal(coarse.array, whole.volume.array[::4, ::4, ::4])


def test_slabs_of_pull_fields_and_other_grids_have_the_bits_of_the_whole(tmp_path, ct, monkeypatch):
    monkeypatch.setattr(tetwarp._zarr_files, "_SLAB", 1)
    field = FIELDS["coarse"](ct.geometry)
    pull = tw.invert(field, ct.geometry)
    other = tw.Geometry((33, 27, 41), (11.3, 9.1, 7.7), ct.geometry.origin)
    for number, (way, options) in enumerate(
        [({"pull_field": pull}, {"outside": "background"}), ({"field": field}, {"grid": "fit"}),
         ({"field": field}, {"grid": other, "outside": "rest"})]
    ):  # fmt: skip
        path = tmp_path / str(number)
        whole = tw.deform(ct, **way, **options)
        report = tetwarp.zarr.deform(ct, path, **way, chunks=(4, 64, 64), version="0.4", **options)
        out = tetwarp.zarr.read(path, space="LPS")
        assert out.array.tobytes() == whole.volume.array.tobytes() and out.geometry == whole.volume.geometry
        assert report == whole.report
    for way in ({}, {"field": field, "pull_field": pull}, {"field": pull}, {"pull_field": field}):
        with pytest.raises(TypeError):
            tetwarp.zarr.deform(ct, tmp_path / "never", **way)
    with pytest.raises(tw.InputError):  # found when the field is set, after the folder was made
        tetwarp.zarr.deform(ct, tmp_path / "never", tw.fields.identity(tw.Geometry((4, 4, 4))), version="0.4")
    assert sorted(os.listdir(tmp_path)) == ["0", "1", "2"]


def test_a_slab_takes_the_memory_of_a_slab(tmp_path):
    code = """
        import resource, sys
        import numpy as np
        import tetwarp as tw, tetwarp.zarr
        grid = tw.Geometry((256, 256, 640), (0.1, 0.1, 0.1))
        field = tw.fields.identity(grid, cell_size=32)
        small = tw.Volume(np.ones((64, 26, 26), np.float32), tw.Geometry((26, 26, 64)))
        def run(name, output):
            tetwarp.zarr.deform(small, sys.argv[1] + name, field, grid=output, outside="background", version="0.4",
                                chunks=(16, 256, 256), backend="cpu", threads=2)
            return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        first = run("/one", tw.Geometry((256, 256, 32), (0.1, 0.1, 0.1)))
        print(run("/all", grid) - first)
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code), tmp_path], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) < 60_000  # kB; the whole result has 168 MB, a slab 8


def test_the_library_is_named_where_it_is_missing(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "zarr", None)
    with pytest.raises(ModuleNotFoundError, match="pip install zarr"):
        tetwarp.zarr.read(tmp_path)
    monkeypatch.setitem(sys.modules, "zarr", type(sys)("zarr"))
    sys.modules["zarr"].__version__ = "2.17.2"
    with pytest.raises(ImportError, match="2.18 or later; this is 2.17.2"):
        tetwarp.zarr.read(tmp_path)


def test_zarr_2_names_the_version_that_reads_zarr_3(tmp_path):
    if HAS_3:
        pytest.skip("this is zarr 3")
    (tmp_path / "zarr.json").write_text("{}")
    with pytest.raises(tw.InputError, match="zarr>=3"):
        tetwarp.zarr.read(tmp_path, space="LPS")
