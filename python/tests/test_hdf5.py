# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""HDF5: images that ITK wrote lie where ITK says, and plain datasets where they are said to lie."""

import os
import shutil
import sys

import numpy as np
import pytest
import tetwarp as tw

h5py = pytest.importorskip("h5py", minversion="3.0")
import tetwarp.hdf5  # noqa: E402


@pytest.fixture
def volume():
    return tw.Volume(
        np.arange(7 * 11 * 13, dtype=np.int16).reshape(7, 11, 13),
        tw.Geometry((13, 11, 7), (0.7, 1.3, 2.9), (-20.1, 33.3, 400.7)),
    )


@pytest.fixture
def itk_file(tmp_path):
    """A turned image, and the file that SimpleITK wrote of it."""
    sitk = pytest.importorskip("SimpleITK")

    def made(array, name="itk.h5", is_vector=False, **options):
        image = sitk.GetImageFromArray(array, isVector=is_vector)
        c, s, d, t = np.cos(0.3), np.sin(0.3), np.cos(0.8), np.sin(0.8)
        turned = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, d, -t], [0, t, d]])
        if image.GetDimension() == 3:
            image.SetSpacing((0.7, 1.3, 2.9))
            image.SetOrigin((-20.1, 33.3, 400.7))
            image.SetDirection(turned.ravel().tolist())
        sitk.WriteImage(image, str(tmp_path / name), **options)
        return image, tmp_path / name

    return made


@pytest.mark.parametrize("kind", ["int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"])
def test_an_image_of_itk_lies_where_itk_says(itk_file, volume, kind):
    image, path = itk_file(volume.array.astype(kind), useCompression=kind == "int16")
    read = tetwarp.hdf5.read(path)
    assert read.array.dtype == kind and np.array_equal(read.array, volume.array.astype(kind))
    assert read.geometry == tw.adapters.volume_of(image)[0].geometry
    for index in [(12, 0, 0), (0, 10, 0), (0, 0, 6), (3.5, 1, 2.25)]:
        point = image.TransformContinuousIndexToPhysicalPoint(index)
        assert np.allclose(read.geometry.point(index), point, rtol=0, atol=1e-12)
    assert image[12, 3, 5] == read.array[5, 3, 12]


def test_vectors_of_itk_are_a_last_axis(itk_file, volume):
    values = np.stack([volume.array, -volume.array, 2 * volume.array], -1).astype(np.float32)
    image, path = itk_file(values, is_vector=True)
    assert np.array_equal(tetwarp.hdf5.read(path).array, values)
    assert image[12, 3, 5][1] == values[5, 3, 12, 1]


def test_images_of_itk_that_are_no_volume_are_refused(itk_file, volume, tmp_path):
    _, path = itk_file(volume.array)
    with pytest.raises(tw.InputError, match="itk.h5 is an image of ITK"):
        tetwarp.hdf5.read(path, geometry=volume.geometry)
    _, wide = itk_file(volume.array.astype(np.int64), "wide.h5")
    with pytest.raises(tw.InputError, match="wide.h5:ITKImage/0/VoxelData holds int64; expected int8"):
        tetwarp.hdf5.read(wide)
    _, flat = itk_file(volume.array[0], "flat.h5")
    with pytest.raises(tw.InputError, match="flat.h5 holds an image of 2 dimensions; expected 3"):
        tetwarp.hdf5.read(flat)
    for key in ("Directions", "Origin", "Spacing", "Dimension", "VoxelData"):
        for wrong in (None, "text", np.zeros(5)):
            shutil.copy(path, tmp_path / "wrong.h5")
            with h5py.File(tmp_path / "wrong.h5", "r+") as file:
                del file[f"ITKImage/0/{key}"]
                if wrong is not None:
                    file[f"ITKImage/0/{key}"] = wrong
            with pytest.raises(tw.InputError, match="wrong.h5"):
                tetwarp.hdf5.read(tmp_path / "wrong.h5")
    shutil.copy(path, tmp_path / "wrong.h5")
    with h5py.File(tmp_path / "wrong.h5", "r+") as file:
        file["ITKImage/0/Spacing"][...] = [1, 0, 1]
    with pytest.raises(tw.InputError, match="wrong.h5: "):
        tetwarp.hdf5.read(tmp_path / "wrong.h5")


def test_a_plain_dataset_wants_its_place(tmp_path, volume):
    path = tmp_path / "case.h5"
    with h5py.File(path, "w") as file:
        file["image"] = volume.array
        file["group/monai"] = np.stack([volume.array.T, -volume.array.T])
        file["big"] = volume.array.astype(">f4")
        file["flag"] = volume.array > 3
        file["text"] = "x"
        file["nothing"] = h5py.Empty("f4")
        file["chunks"] = volume.array
    read = tetwarp.hdf5.read(path, dataset="image", geometry=volume.geometry)
    assert np.array_equal(read.array, volume.array) and read.geometry == volume.geometry
    turned = tetwarp.hdf5.read(path, dataset="group/monai", geometry=volume.geometry, order="ijk")
    assert np.array_equal(turned.array, np.stack([volume.array, -volume.array], -1))
    big = tetwarp.hdf5.read(path, dataset="big", geometry=volume.geometry).array
    assert big.dtype == np.dtype("=f4") and np.array_equal(big, volume.array)
    with pytest.raises(tw.InputError, match="geometry="):
        tetwarp.hdf5.read(path, dataset="image")
    with pytest.raises(tw.InputError, match="no image of ITK; pass dataset=, one of .*group/monai"):
        tetwarp.hdf5.read(path)
    with pytest.raises(tw.InputError, match=r"no dataset 'imag'; it has .*image"):
        tetwarp.hdf5.read(path, dataset="imag", geometry=volume.geometry)
    for name, why in (("flag", "bool"), ("text", "object"), ("nothing", "empty"), ("group/monai", "shape")):
        with pytest.raises(tw.InputError, match=f"case.h5:{name} .*{why}"):
            tetwarp.hdf5.read(path, dataset=name, geometry=volume.geometry)


def test_what_is_cut_short_is_refused(tmp_path, volume):
    path = tmp_path / "case.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("image", data=volume.array, chunks=(1, 11, 13), compression="gzip")
    whole = path.read_bytes()
    for length in (0, 100, len(whole) // 2, len(whole) - 100):
        path.write_bytes(whole[:length])
        with pytest.raises(tw.InputError, match="case.h5 cannot be read as HDF5"):
            tetwarp.hdf5.read(path, dataset="image", geometry=volume.geometry)
    path.write_bytes(whole)
    with h5py.File(path) as file:
        at = file["image"].id.get_chunk_info(3).byte_offset
    path.write_bytes(whole[: at + 8] + bytes(8) + whole[at + 16 :])
    with pytest.raises(tw.InputError, match="case.h5 cannot be read as HDF5"):
        tetwarp.hdf5.read(path, dataset="image", geometry=volume.geometry)
    with pytest.raises(tw.InputError, match="no such file"):
        tetwarp.hdf5.read(tmp_path / "none.h5")
    assert os.listdir(tmp_path) == ["case.h5"]


def test_the_library_is_named_where_it_is_missing(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(ModuleNotFoundError, match="pip install h5py"):
        tetwarp.hdf5.read(tmp_path / "a.h5")
