# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Spatial and Deformable Spatial Registrations of plastimatch and pydicomrt. The answer is made with NumPy."""

import shutil

import nibabel
import numpy as np

from world import TO_RAS, at_points, expect, moved, need, run, tool, values_of

MOST_HU = 0.75  # half of it is rounding to whole HU, the rest what six digits of a matrix lose
BACKGROUND = -5000


def matrix():
    """Where a point of the fixed frame lies in the moving one, LPS."""
    a, b, c = 0.1, -0.07, 0.15
    turn = (
        np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
        @ np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
        @ np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    )
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = turn, (4, -6, 5)
    return result


def shift():
    result = np.eye(4)
    result[:3, 3] = (1.5, -2, 3)
    return result


def displacement(points):
    """A smooth one, mm."""
    x, y, z = np.moveaxis(points, -1, 0)
    return np.stack([3 * np.sin(y / 19), 2 * np.cos(x / 24), 2 * np.sin(z / 15 + 1)], -1)


def moving_of(world):
    folder = world.folder / "moving"
    if folder.exists():
        shutil.rmtree(folder)
    return folder, world.other_series(folder)


def compared(world, folder, option, path, source, outside="refuse"):
    """@param source  where each voxel of the fixed series comes from"""
    out = world.folder / "registered.nii"
    world.must(
        "deform", folder, option, path, "-o", out, "--overwrite", "--background", BACKGROUND, "--outside", outside
    )
    image = nibabel.load(out)
    expect(np.abs(TO_RAS @ image.affine - world.affine).max() < 1e-4, "another grid")
    found = np.asarray(image.dataobj).transpose(2, 1, 0).astype(float)
    wanted = at_points(values_of(world.slices), world.affine, source)
    known = np.isfinite(wanted)
    # A forward field covers all that lies between voxel centres of the source, but for rounding.
    missing = int((found[known] == BACKGROUND).sum())
    expect(missing <= 0.001 * known.sum(), f"{missing} of {known.sum()} voxels are background")
    away = np.abs(found - wanted)[known & (found != BACKGROUND)]
    expect(
        known.sum() > 0.4 * known.size and away.max() < MOST_HU,
        f"{away.max():.2f} HU off, {(away > MOST_HU).sum()} of {away.size} voxels",
    )
    return f"{away.max():.2f} HU at most, of {away.size} voxels"


# --- pydicomrt


def check_rigid(world, identity):
    builder, _ = need("pydicomrt", "pydicomrt.reg.builder")
    folder, moving = moving_of(world)
    made = builder.SpatialRegistrationBuilder(world.slices).add_registration(
        moving, np.linalg.inv(matrix()).ravel().tolist()
    )
    path = world.folder / "rigid.dcm"
    made.build(include_identity=identity).save_as(path, enforce_file_format=True)
    compared(world, folder, "--pull-field", f"{path}:invert=yes", moved(matrix(), world.points))
    return compared(world, folder, "-f", path, moved(matrix(), world.points))


def check_deformable(world, pre, post):
    import SimpleITK

    builder, _ = need("pydicomrt", "pydicomrt.reg.builder")
    folder, moving = moving_of(world)
    index = np.stack(np.indices((14, 19, 21))[::-1], -1)
    grid = np.diag([7.3, 7.1, 7.9, 1])
    grid[:3, 3] = world.points.reshape(-1, 3).min(0) - 2
    values = displacement(moved(grid, index)).astype(np.float32)
    image = SimpleITK.GetImageFromArray(values.astype(float), isVector=True)
    image.SetOrigin(grid[:3, 3].tolist())
    image.SetSpacing([7.3, 7.1, 7.9])
    field = SimpleITK.DisplacementFieldTransform(image)
    made = builder.DeformableSpatialRegistrationBuilder(world.slices).add_registration(
        moving, field, None if pre is None else pre.ravel().tolist(), None if post is None else post.ravel().tolist()
    )
    path = world.folder / "deformable.dcm"
    made.build().save_as(path, enforce_file_format=True)
    offset = np.stack([at_points(values[..., n].astype(float), grid, world.points) for n in range(3)], -1)
    source = moved(np.eye(4) if post is None else post, moved(np.eye(4) if pre is None else pre, world.points) + offset)
    return compared(world, folder, "--pull-field", path, source, "background")


def pydicomrt_cases():
    proof = "the CT by NumPy"
    yield "Spatial Registration, with an identity item", proof, lambda w: check_rigid(w, True)
    yield "Spatial Registration, one item", proof, lambda w: check_rigid(w, False)
    yield "Deformable Spatial Registration", proof, lambda w: check_deformable(w, None, None)
    yield "the same with matrices before and after", proof, lambda w: check_deformable(w, shift(), matrix())


# --- plastimatch


def by_plastimatch(world, source):
    folder, _ = moving_of(world)
    made = world.folder / "registration"
    shutil.rmtree(made, ignore_errors=True)
    run(
        "plastimatch",
        "xf-convert",
        "--input",
        source,
        "--output-dicom",
        made,
        "--fixed-rcs",
        world.ct,
        "--moving-rcs",
        folder,
    )
    (path,) = made.glob("*.dcm")
    return folder, path


def check_plastimatch_rigid(world):
    text, m = world.folder / "rigid.tfm", matrix()
    numbers = " ".join(f"{v:.17g}" for v in (*m[:3, :3].ravel(), *m[:3, 3]))
    text.write_text(
        "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\n"
        f"Parameters: {numbers}\nFixedParameters: 0 0 0\n"
    )
    folder, path = by_plastimatch(world, text)
    return compared(world, folder, "-f", path, moved(m, world.points))


def check_plastimatch_field(world):
    values, file = displacement(world.points).astype("<f4"), world.folder / "field.mha"
    spacing = np.linalg.norm(world.affine[:3, :3], axis=0)
    header = {
        "ObjectType": "Image",
        "NDims": 3,
        "BinaryData": True,
        "BinaryDataByteOrderMSB": False,
        "Offset": " ".join(f"{v:.10g}" for v in world.affine[:3, 3]),
        "TransformMatrix": "1 0 0 0 1 0 0 0 1",
        "ElementSpacing": " ".join(f"{v:.10g}" for v in spacing),
        "DimSize": " ".join(str(n) for n in world.shape[::-1]),
        "ElementNumberOfChannels": 3,
        "ElementType": "MET_FLOAT",
        "ElementDataFile": "LOCAL",
    }
    file.write_bytes("".join(f"{key} = {value}\n" for key, value in header.items()).encode() + values.tobytes())
    folder, path = by_plastimatch(world, file)
    return compared(world, folder, "--pull-field", path, world.points + values)


def plastimatch_cases():
    proof = "the CT by NumPy"
    yield "Spatial Registration", proof, check_plastimatch_rigid
    yield "Deformable Spatial Registration", proof, check_plastimatch_field


def cases():
    yield "pydicomrt", lambda: need("pydicomrt")[1], pydicomrt_cases
    yield "plastimatch", lambda: run(tool("plastimatch"), "--version").split()[-1], plastimatch_cases
