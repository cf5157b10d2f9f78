# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Geometries, layouts, and images of other libraries."""

import pickle

import numpy as np
import pytest
import tetwarp as tw

ANGLES = [(0, 0, 0), (0.3, -0.2, 0.5)]


def rotation(a, b, c):
    def about(axis, angle):
        i, j = [n for n in range(3) if n != axis]
        matrix = np.eye(3)
        matrix[i, i] = matrix[j, j] = np.cos(angle)
        matrix[i, j], matrix[j, i] = -np.sin(angle), np.sin(angle)
        return matrix

    return about(0, a) @ about(1, b) @ about(2, c)


def geometries():
    for angles in ANGLES:
        for flip in ([1, 1, 1], [1, -1, 1], [-1, 1, -1]):
            yield tw.Geometry((7, 6, 5), (1.5, 2.0, 3.25), (-11, 4, 60), rotation(*angles) @ np.diag(flip))


@pytest.fixture(params=list(geometries()), ids=str)
def geometry(request):
    return request.param


@pytest.fixture
def volume(geometry):
    values = np.arange(np.prod(geometry.shape), dtype=np.int16).reshape(geometry.shape)
    return tw.Volume(values, geometry)


def test_an_affine_and_back_is_the_same_grid(geometry):
    for space in ("RAS", "LPS"):
        again = tw.Geometry.from_affine(geometry.affine(space), geometry.size, space=space)
        assert np.allclose(again.affine("LPS"), geometry.affine("LPS"), rtol=0, atol=1e-12)
    assert np.allclose(geometry.index(geometry.point([1, 2, 3])), [1, 2, 3])
    assert pickle.loads(pickle.dumps(geometry)) == geometry
    assert hash(geometry) == hash(pickle.loads(pickle.dumps(geometry)))


def test_ras_and_lps_are_told_apart():
    grid = tw.Geometry((3, 3, 3), origin=(10, 20, 30))
    assert grid.affine("RAS")[:3, 3].tolist() == [-10, -20, 30]
    assert grid.affine("LPS")[:3, 3].tolist() == [10, 20, 30]
    with pytest.raises(tw.InputError, match="RAS"):
        grid.affine("ras")
    with pytest.raises(TypeError):
        tw.Geometry.from_affine(np.eye(4), (2, 2, 2))


def test_a_fortran_array_is_the_same_memory():
    array = np.asfortranarray(np.arange(24, dtype=np.int16).reshape(4, 3, 2))
    volume = tw.Volume(array, tw.Geometry((4, 3, 2)), order="ijk")
    assert np.shares_memory(volume.array, array)
    assert volume.array[1, 2, 3] == array[3, 2, 1]
    with pytest.raises(tw.InputError, match="ascontiguousarray"):
        tw.Volume(array, tw.Geometry((2, 3, 4)))
    with pytest.raises(tw.InputError, match="ascontiguousarray"):
        tw.Volume(np.zeros((4, 6, 8), np.int16)[:, ::2], tw.Geometry((8, 3, 4)))


def shifted(volume, back):
    """The image moved by one voxel along i, by our resampler, and where its values should be."""
    step = volume.geometry.point([1, 0, 0]) - volume.geometry.point([0, 0, 0])
    field = tw.fields.translate(volume.geometry, by=step)
    return tw.deform(back, field, outside="background", background=-1)


def test_simpleitk_there_and_back(volume):
    sitk = pytest.importorskip("SimpleITK")
    image = sitk.GetImageFromArray(volume.array)
    image.SetSpacing(volume.geometry.spacing)
    image.SetOrigin(volume.geometry.origin)
    image.SetDirection(volume.geometry.direction.ravel().tolist())
    given, _ = tw.adapters.volume_of(image)
    assert given.geometry == volume.geometry
    assert np.allclose(image.TransformContinuousIndexToPhysicalPoint((2.5, 1, 3)), given.geometry.point([2.5, 1, 3]))
    moved = shifted(volume, image).volume
    assert isinstance(moved, sitk.Image)
    assert moved.GetDirection() == image.GetDirection() and moved.GetOrigin() == image.GetOrigin()
    assert moved[3, 2, 1] == image[2, 2, 1] and moved[0, 0, 0] == -1


def test_nibabel_there_and_back(volume):
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(volume.array.T, volume.geometry.affine("RAS"))
    given, _ = tw.adapters.volume_of(image)
    assert np.shares_memory(given.array, volume.array)
    ras = nibabel.affines.apply_affine(image.affine, [2, 1, 3])
    assert np.allclose(ras * [-1, -1, 1], given.geometry.point([2, 1, 3]))
    done = shifted(volume, image)
    assert done.report.copies == 0
    assert type(done.volume) is nibabel.Nifti1Image
    assert np.allclose(done.volume.affine, image.affine)
    assert done.volume.dataobj[3, 2, 1] == image.dataobj[2, 2, 1]
    unordered = nibabel.Nifti1Image(np.ascontiguousarray(volume.array.T), image.affine)
    assert shifted(volume, unordered).report.copies == 1


def test_nibabel_scaled_values_are_those_of_nibabel(volume, tmp_path):
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(volume.array.T, volume.geometry.affine("RAS"))
    image.header.set_slope_inter(2, -1024)
    nibabel.save(image, tmp_path / "scaled.nii")
    loaded = nibabel.load(tmp_path / "scaled.nii")
    given, _ = tw.adapters.volume_of(loaded)
    assert np.array_equal(given.array.T, np.asanyarray(loaded.dataobj))


def test_itk_there_and_back(volume):
    itk = pytest.importorskip("itk")
    image = itk.image_from_array(volume.array)
    image.SetSpacing(volume.geometry.spacing)
    image.SetOrigin(volume.geometry.origin)
    image.SetDirection(itk.matrix_from_array(np.array(volume.geometry.direction)))
    given, _ = tw.adapters.volume_of(image)
    assert np.shares_memory(given.array, itk.array_view_from_image(image))
    assert np.allclose(list(image.TransformIndexToPhysicalPoint([2, 1, 3])), given.geometry.point([2, 1, 3]))
    moved = shifted(volume, image).volume
    assert type(moved) is type(image)
    assert np.allclose(itk.array_from_matrix(moved.GetDirection()), volume.geometry.direction)
    assert moved.GetPixel([3, 2, 1]) == image.GetPixel([2, 2, 1]) and moved.GetPixel([0, 0, 0]) == -1


def test_monai_and_torchio_there_and_back(volume):
    torch = pytest.importorskip("torch")
    affine = volume.geometry.affine("RAS")
    tensor = torch.as_tensor(volume.array.T.copy().astype(np.float32))[None]
    made = []
    try:
        from monai.data import MetaTensor

        made.append((MetaTensor(tensor, affine=torch.as_tensor(affine)), lambda image: image))
    except ImportError:
        pass
    try:
        import torchio

        made.append((torchio.ScalarImage(tensor=tensor, affine=affine), lambda image: image.data))
    except ImportError:
        pass
    if not made:
        pytest.skip("neither MONAI nor TorchIO is installed")
    for image, data in made:
        done = shifted(volume, image)
        assert type(done.volume) is type(image)
        assert float(data(done.volume)[0, 3, 2, 1]) == float(tensor[0, 2, 2, 1])
        assert np.allclose(np.asarray(done.volume.affine), affine)
        assert done.report.copies == 2


def test_a_simpleitk_volume_keeps_its_image():
    sitk = pytest.importorskip("SimpleITK")
    volume = tw.adapters.volume_of(sitk.GetImageFromArray(np.full((40, 64, 64), 7, np.int16)))[0]
    junk = [np.full((40, 64, 64), 99, np.int16) for _ in range(20)]
    assert len(junk) == 20 and np.unique(volume.array).tolist() == [7]


def test_a_cropped_itk_image_lies_where_itk_says():
    itk = pytest.importorskip("itk")
    image = itk.image_from_array(np.zeros((10, 10, 10), np.int16))
    image.SetSpacing([2, 2, 2])
    region = itk.ImageRegion[3]()
    region.SetIndex([3, 0, 0])
    region.SetSize([5, 10, 10])
    cropped = itk.extract_image_filter(image, extraction_region=region, direction_collapse_to_strategy=1)
    geometry = tw.adapters.volume_of(cropped)[0].geometry
    assert geometry.origin == (6, 0, 0) and geometry.size == (5, 10, 10)


def test_uneven_slices_lie_where_they_say():
    grid = tw.Geometry((4, 4, 4), spacing=(1, 1, 2), slices=[0, 1, 5, 6])
    assert grid.point([[0, 0, 2], [0, 0, 1.5]])[:, 2].tolist() == [5, 3]
    assert grid.index([0, 0, 5]).tolist() == [0, 0, 2]
    assert np.allclose(grid.index(grid.point([1, 2, 4.5])), [1, 2, 4.5])
    with pytest.raises(tw.InputError, match="straightened"):
        grid.affine("LPS")


def test_labels_at_another_place_are_refused():
    body = tw.phantom((32, 32, 16), spacing=(10, 10, 15))
    labels = tw.Volume(np.zeros(body.geometry.shape, np.uint8), tw.Geometry(body.geometry.size, origin=(999, 0, 0)))
    page = {
        "name": "push", "method": "chainmail", "cell_size": 4,
        "tissues": [{"name": "all", "compression": 0.2, "stretch": 0.2, "shear": 0.2}],
        "phases": [{"move": [{"handle": {"at": {"body": [0.5, 0.5, 0.5]}, "radius_mm": 20}, "by_mm": [0, -9, 0]}]}],
    }
    with pytest.raises(tw.InputError, match="label"):
        tw.simulate(page, body, labels=labels, backend="cpu")


def test_an_array_without_a_place_is_refused(volume):
    with pytest.raises(TypeError, match="tetwarp.Volume"):
        tw.deform(volume.array, tw.fields.identity(volume.geometry))


def test_a_pull_field_goes_to_simpleitk_and_comes_back():
    sitk = pytest.importorskip("SimpleITK")
    ct = tw.phantom((40, 36, 30), spacing=(2.0, 2.5, 3.0))
    turned = tw.Geometry(ct.geometry.size, ct.geometry.spacing, (5, -7, 9), [[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    ct = tw.Volume(ct.array, turned)
    field = tw.fields.bubble(turned, radius=35, strength=0.7)  # nothing moves at the border, and NaN comes of nothing
    inverse = tw.invert(field, turned, outside="rest")
    image = inverse.to_simpleitk()
    again = tw.PullField.from_image(image)
    assert again.geometry == turned and again.displacement.tobytes() == inverse.displacement.tobytes()
    # SimpleITK, which adds the vectors to points in LPS mm, takes values from where Tetwarp takes them.
    source = sitk.GetImageFromArray(ct.array.astype(np.float32))
    source.CopyInformation(image)
    theirs = sitk.GetArrayFromImage(
        sitk.Resample(source, source, sitk.DisplacementFieldTransform(image), sitk.sitkLinear, -1000.0)
    )
    ours = tw.deform(tw.Volume(ct.array.astype(np.float32), turned), pull_field=again, outside="background").volume.array
    inner = (slice(6, -6),) * 3
    assert np.abs(theirs - ours)[inner].max() < 0.5 < np.abs(ours - ct.array)[inner].max()


def test_images_that_say_no_axes_of_their_vectors_are_no_fields():
    sitk = pytest.importorskip("SimpleITK")
    with pytest.raises(tw.InputError, match="1 x int16 a voxel"):
        tw.PullField.from_image(sitk.GetImageFromArray(np.zeros((3, 3, 3), np.int16)))
    with pytest.raises(TypeError, match="axes of their vectors"):
        tw.PullField.from_image(np.zeros((3, 3, 3, 3), np.float32))


def test_directions_are_never_mistaken(volume):
    forward = tw.fields.identity(volume.geometry)
    pull = tw.invert(forward, volume.geometry)
    with pytest.raises(TypeError, match="pull_field="):
        tw.deform(volume, pull)
    with pytest.raises(TypeError, match="second argument"):
        tw.deform(volume, pull_field=forward)
    with pytest.raises(TypeError, match="PullResampler"):
        tw.Resampler(volume.geometry).set_field(pull)
    with pytest.raises(TypeError, match="tetwarp.Resampler"):
        tw.PullResampler(volume.geometry).set_field(forward)
    for function in (lambda: tw.invert(pull, volume.geometry), lambda: tw.move_points([[0, 0, 0]], pull, volume.geometry)):
        with pytest.raises(TypeError, match="PullField"):
            function()
