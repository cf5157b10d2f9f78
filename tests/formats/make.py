#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Makes the transforms and fields of other programs that the tests read, with where these programs say that points go.

    tests/formats/make.py FOLDER [CASE...]

Each case is a folder: the files, and case.json, which names the program with its version, the arguments of `--pull-field`
and the expected files:

- expected.npy: T(p) - p at the voxel centres of fixed.nii.gz, LPS mm, float32, [k, j, i, xyz], as the program has it
  (NaN where it does not say)
- warped.nii.gz: moving.nii.gz warped by the program, linear

The two volumes are oblique, of different sizes, and one of them is right-handed. Packages: those of PyPI that CASES names;
plastimatch, elastix and mrtrix3 of Debian; the programs of NiftyReg, built from its source. Where FOLDER holds fixed.nii.gz and
moving.nii.gz already, they are taken: table.py then says what the differences are on scans.
"""
import importlib.metadata
import json
import pathlib
import shutil
import subprocess
import sys

import nibabel
import numpy as np

FIXED, MOVING = "fixed.nii.gz", "moving.nii.gz"
LPS = np.array([-1.0, -1.0, 1.0])


def turned(a, b, c):
    """A rotation about three axes."""
    ca, sa, cb, sb, cc, sc = np.cos(a), np.sin(a), np.cos(b), np.sin(b), np.cos(c), np.sin(c)
    return (
        np.array([[ca, -sa, 0], [sa, ca, 0], [0, 0, 1]])
        @ np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
        @ np.array([[1, 0, 0], [0, cc, -sc], [0, sc, cc]])
    )


def smooth(shape, seed):
    """Texture between 0 and 100."""
    values = np.random.default_rng(seed).random(shape)
    for _ in range(2):
        for axis in range(3):
            values = (np.roll(values, 1, axis) + 2 * values + np.roll(values, -1, axis)) / 4
    return ((values - values.min()) / (values.max() - values.min()) * 100).astype(np.float32)


def make_volumes(folder):
    """The two volumes that all cases share."""
    for name, shape, turn, spacing, origin, seed in (
        (FIXED, (12, 10, 8), (0.1, 0.05, -0.07), (-3.0, 2.5, 4.0), (16, -11, -14), 1),
        (MOVING, (15, 13, 11), (-0.05, 0.1, 0.03), (2.8, 2.6, 3.9), (-20, -17, -18), 2),
    ):
        affine = np.eye(4)
        affine[:3, :3] = turned(*turn) @ np.diag(spacing)
        affine[:3, 3] = origin
        image = nibabel.Nifti1Image(smooth(shape, seed), affine)
        image.header.set_xyzt_units("mm")
        image.set_sform(affine, 1)
        image.set_qform(affine, 1)
        nibabel.save(image, folder / name)


class Volumes:
    """The two volumes, and points of the fixed one in RAS mm."""

    def __init__(self, folder):
        self.folder = folder
        self.fixed, self.moving = nibabel.load(folder / FIXED), nibabel.load(folder / MOVING)
        index = np.stack(np.meshgrid(*[np.arange(n) for n in self.fixed.shape], indexing="ij"), -1).reshape(-1, 3)
        self.points = nibabel.affines.apply_affine(self.fixed.affine, index)

    def displacement(self, scale=1.0):
        """A smooth displacement in RAS mm, of the shape of the fixed volume."""
        x, y, z = self.points.T
        by = np.stack([1.8 * np.sin(y / 9), 1.4 * np.cos(x / 8), 1.1 * np.sin(z / 7 + 1)], -1)
        return (scale * by).astype(np.float32).reshape(*self.fixed.shape, 3)


MATRIX = np.array([[1.05, 0.02, 0.01, 1.5], [-0.03, 0.97, 0.03, 2.5], [0.01, -0.02, 1.02, -1.25], [0, 0, 0, 1]])


def moved(matrix, points):
    """Points by a 4 x 4 matrix."""
    return nibabel.affines.apply_affine(matrix, points)


def run(*command, folder=None):
    """Runs a program, in a folder where its files shall not name folders of the maker's machine."""
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL, cwd=folder)


def version_of(package):
    """The version of a package of PyPI."""
    return importlib.metadata.version(package)


# Each case takes the two volumes and its folder, and returns: program, version, arguments, T(p) in RAS mm or None, the
# warped image or None, and how its numbers are known.


def ants_registration(volumes, folder, **options):
    """A registration by ANTs, whose files stay in the folder under their names."""
    import ants

    fixed, moving = (ants.image_read(str(volumes.folder / name)) for name in (FIXED, MOVING))
    made = folder / "made"
    made.mkdir()
    ants.registration(
        fixed, moving, "SyN", outprefix=str(made) + "/", reg_iterations=(20, 10), random_seed=1, singleprecision=False,
        **options,
    )
    return made


def by_ants(volumes, folder, transforms, inverted):
    """Points and the moving volume by antsApplyTransforms and antsApplyTransformsToPoints."""
    import ants
    import pandas

    fixed, moving = (ants.image_read(str(volumes.folder / name)) for name in (FIXED, MOVING))
    warped = ants.apply_transforms(fixed, moving, transforms, interpolator="linear", whichtoinvert=inverted)
    points = pandas.DataFrame(volumes.points * LPS, columns=["x", "y", "z"])
    there = ants.apply_transforms_to_points(3, points, transforms, whichtoinvert=inverted).to_numpy() * LPS
    image = nibabel.Nifti1Image(np.moveaxis(warped.numpy(), 0, 0).astype(np.float32), volumes.fixed.affine)
    return there, image


def case_ants_list(volumes, folder):
    """A field and an affine transform of a registration, in the order of antsApplyTransforms -t."""
    made = ants_registration(volumes, folder)
    names = ["1Warp.nii.gz", "0GenericAffine.mat"]
    for name in names:
        shutil.copy(made / name, folder / name)
    shutil.rmtree(made)
    there, warped = by_ants(volumes, folder, [str(folder / name) for name in names], [False, False])
    return "ANTs", "antspyx " + version_of("antspyx"), names, there, warped


def case_ants_inverse_list(volumes, folder):
    """The list of the other direction: the affine transform inverted, then the inverse field."""
    made = ants_registration(volumes, folder)
    names = ["0GenericAffine.mat", "1InverseWarp.nii.gz"]
    for name in names:
        shutil.copy(made / name, folder / name)
    shutil.rmtree(made)
    there, warped = by_ants(volumes, folder, [str(folder / name) for name in names], [True, False])
    return "ANTs", "antspyx " + version_of("antspyx"), [names[0] + ":invert=yes", names[1]], there, warped


def case_ants_composite(volumes, folder):
    """The composite of a registration, ITK's HDF5."""
    made = ants_registration(volumes, folder, write_composite_transform=True)
    shutil.copy(made / "Composite.h5", folder / "Composite.h5")
    shutil.rmtree(made)
    there, warped = by_ants(volumes, folder, [str(folder / "Composite.h5")], [False])
    return "ANTs", "antspyx " + version_of("antspyx"), ["Composite.h5"], there, warped


def case_greedy_list(volumes, folder):
    """A field of a registration by Greedy, and a matrix."""
    import picsl_greedy

    np.savetxt(folder / "affine.mat", MATRIX, fmt="%.10f")
    greedy = picsl_greedy.Greedy3D()
    fixed, moving, warp, affine = (
        volumes.folder / FIXED, volumes.folder / MOVING, folder / "warp.nii.gz", folder / "affine.mat"
    )
    greedy.execute(f"-d 3 -threads 1 -i {fixed} {moving} -it {affine} -o {warp} -n 20x10 -m SSD -s 4.0vox 1.0vox")
    greedy.execute(f"-d 3 -threads 1 -rf {fixed} -rm {moving} {folder / 'out.nii.gz'} -r {warp} {affine}")
    warped = nibabel.load(folder / "out.nii.gz")
    warped = nibabel.Nifti1Image(np.asarray(warped.dataobj, np.float32), volumes.fixed.affine)
    (folder / "out.nii.gz").unlink()
    return "Greedy", "picsl-greedy " + version_of("picsl-greedy"), ["warp.nii.gz", "affine.mat:tool=greedy"], None, warped


def case_elastix_toml(volumes, folder):
    """A registration by elastix: affine, then B-spline, as TOML."""
    import itk

    fixed, moving = (itk.imread(str(volumes.folder / name), itk.F) for name in (FIXED, MOVING))
    parameters = itk.ParameterObject.New()
    for kind, spacing in (("affine", 20.0), ("bspline", 15.0)):
        one = parameters.GetDefaultParameterMap(kind, 1, spacing)
        one["MaximumNumberOfIterations"], one["OutputTransformParameterFileFormat"] = ["30"], ["TOML"]
        one["NumberOfSpatialSamples"], one["FinalBSplineInterpolationOrder"] = ["500"], ["1"]
        parameters.AddParameterMap(one)
    method = itk.ElastixRegistrationMethod.New(fixed, moving)
    method.SetParameterObject(parameters)
    method.SetOutputDirectory(str(folder))
    method.SetLogToConsole(False)
    method.SetNumberOfThreads(1)
    method.Update()
    result = method.GetTransformParameterObject()
    transformix = itk.TransformixFilter.New(moving)
    transformix.SetTransformParameterObject(result)
    transformix.SetComputeDeformationField(True)
    transformix.SetOutputDirectory(str(folder))
    transformix.Update()
    vectors = itk.array_from_image(transformix.GetOutputDeformationField())  # k, j, i, xyz; LPS
    there = volumes.points + np.moveaxis(vectors, (0, 1, 2), (2, 1, 0)).reshape(-1, 3) * LPS
    values = np.moveaxis(itk.array_from_image(transformix.GetOutput()), (0, 1, 2), (2, 1, 0))
    for file in [*folder.glob("result.*"), *folder.glob("deformationField.*")]:
        file.unlink()
    for file in folder.glob("*.toml"):  # the name of the initial transform without a folder of the maker's machine
        file.write_text(file.read_text().replace(str(folder) + "/", ""))
    warped = nibabel.Nifti1Image(values.astype(np.float32), volumes.fixed.affine)
    return "elastix", "itk-elastix " + version_of("itk-elastix"), ["TransformParameters.1.toml"], there, warped


def case_mrtrix_linear(volumes, folder):
    """A linear transform of MRtrix."""
    (folder / "linear.txt").write_text(
        "# made by hand\n" + "\n".join(" ".join(f"{v:.10f}" for v in row) for row in MATRIX) + "\n"
    )
    run("mrtransform", "-quiet", "-force", volumes.folder / MOVING, "-linear", folder / "linear.txt", "-template",
        volumes.folder / FIXED, "-oversample", "1", "-interp", "linear", folder / "out.nii.gz")
    return "MRtrix", mrtrix_version(), ["linear.txt:tool=mrtrix"], None, on_fixed(volumes, folder / "out.nii.gz")


def mrtrix_version():
    """The version of MRtrix."""
    return subprocess.run(["mrinfo", "--version"], check=True, capture_output=True, text=True).stdout.split()[2]


def on_fixed(volumes, path):
    """An image that MRtrix wrote with its axes in another order, on the grid of the fixed volume."""
    image = nibabel.load(path)
    step = np.rint(np.linalg.inv(image.affine) @ volumes.fixed.affine).astype(int)
    values = np.asarray(image.dataobj, np.float32)
    for axis in range(3):
        if step[axis, axis] == -1:
            values = np.flip(values, axis)
    path.unlink()
    assert np.abs(step[:3, :3]).sum() == 3 and values.shape[:3] == volumes.fixed.shape
    return nibabel.Nifti1Image(values, volumes.fixed.affine)


def case_mrtrix_warp(volumes, folder):
    """A deformation field of MRtrix: positions in scanner RAS mm along the fourth axis."""
    there = moved(MATRIX, volumes.points) + volumes.displacement().reshape(-1, 3)
    image = nibabel.Nifti1Image(there.reshape(*volumes.fixed.shape, 3).astype(np.float32), volumes.fixed.affine)
    nibabel.save(image, folder / "made.nii.gz")
    run("mrconvert", "-quiet", folder / "made.nii.gz", folder / "warp.nii.gz")
    (folder / "made.nii.gz").unlink()
    run("mrtransform", "-quiet", "-force", volumes.folder / MOVING, "-warp", folder / "warp.nii.gz", "-interp", "linear",
        folder / "out.nii.gz")
    warped = on_fixed(volumes, folder / "out.nii.gz")
    return "MRtrix", mrtrix_version(), ["warp.nii.gz:values=positions,frame=ras"], there, warped


def case_mrtrix_displacement(volumes, folder):
    """What warpconvert makes of it: displacements, on a grid with its axes in another order."""
    there = moved(MATRIX, volumes.points) + volumes.displacement().reshape(-1, 3)
    image = nibabel.Nifti1Image(there.reshape(*volumes.fixed.shape, 3).astype(np.float32), volumes.fixed.affine)
    nibabel.save(image, folder / "warp.nii.gz")
    run("warpconvert", "-quiet", folder / "warp.nii.gz", "deformation2displacement", folder / "displacement.nii.gz")
    (folder / "warp.nii.gz").unlink()
    return "MRtrix", mrtrix_version(), ["displacement.nii.gz:values=displacements,frame=ras"], there, None


def by_mrtrix(volumes, folder, positions):
    """Points and the moving volume by a deformation in MRtrix's own format, which MRtrix reads again."""
    run("mrconvert", "-quiet", positions, "-strides", "1,2,3,4", folder / "read.nii.gz")
    run("mrtransform", "-quiet", volumes.folder / MOVING, "-warp", positions, "-interp", "linear", "-strides", "1,2,3",
        folder / "out.nii.gz")
    there = np.asarray(on_fixed(volumes, folder / "read.nii.gz").dataobj).reshape(-1, 3)
    return there, on_fixed(volumes, folder / "out.nii.gz")


def case_mrtrix_mif(name, *options, displacements=False):
    """A case of a warp in MRtrix's own format, with its values in an order that the options of mrconvert say."""

    def case(volumes, folder):
        there = moved(MATRIX, volumes.points) + volumes.displacement().reshape(-1, 3)
        image = nibabel.Nifti1Image(there.reshape(*volumes.fixed.shape, 3).astype(np.float32), volumes.fixed.affine)
        made, positions, values = "made.nii.gz", folder / name, "positions"
        nibabel.save(image, folder / made)
        if displacements:
            run("warpconvert", "-quiet", made, "deformation2displacement", "by.nii.gz", folder=folder)
            made, positions, values = "by.nii.gz", folder / "positions.mif", "displacements"
        run("mrconvert", "-quiet", made, name, *options, folder=folder)  # its header holds this command
        if displacements:
            run("warpconvert", "-quiet", folder / name, "displacement2deformation", positions)
        read = by_mrtrix(volumes, folder, positions)
        for file in [*folder.glob("*.nii.gz"), *folder.glob("positions.mif")]:
            file.unlink()
        return "MRtrix", mrtrix_version(), [f"{name}:values={values}"], *read

    return case


def case_mrtrix_registration(volumes, folder):
    """The deformation of a registration by mrregister."""
    run("mrregister", "-quiet", f"../{MOVING}", f"../{FIXED}", "-type", "nonlinear", "-nl_scale", "1", "-nl_niter", "20", "-nl_warp", "warp.mif",
        "back.mif", "-nthreads", "0", folder=folder)
    (folder / "back.mif").unlink()
    return "MRtrix", mrtrix_version(), ["warp.mif:values=positions"], *by_mrtrix(volumes, folder, folder / "warp.mif")


def surfa_warp(volumes):
    """A warp of FreeSurfer by surfa, with the moving volume warped, and T of the points."""
    import surfa

    fixed, moving = (surfa.load_volume(str(volumes.folder / name)) for name in (FIXED, MOVING))
    there = moved(MATRIX, volumes.points) + volumes.displacement().reshape(-1, 3)
    by = (there - volumes.points).reshape(*volumes.fixed.shape, 3).astype(np.float32)
    warp = surfa.Warp(by, source=moving.geom, target=fixed.geom, format=surfa.Warp.Format.disp_ras)
    warped = warp.transform(moving)
    image = nibabel.Nifti1Image(np.asarray(warped.data, np.float32), volumes.fixed.affine)
    return surfa, warp, there, image


def case_freesurfer(form):
    """A case of one of the four forms of a warp in .mgz."""

    def case(volumes, folder):
        surfa, warp, there, image = surfa_warp(volumes)
        from surfa.core.framed import FramedArrayIntents

        converted = warp.convert(getattr(surfa.Warp.Format, form))
        surfa.io.framed.save_framed_array(converted, str(folder / "warp.mgz"), intent=FramedArrayIntents.warpmap)
        return "FreeSurfer", "surfa " + version_of("surfa"), ["warp.mgz"], there, image

    return case


def case_freesurfer_nifti(volumes, folder):
    """The same in NIfTI, as mri_synthmorph writes it."""
    surfa, warp, there, image = surfa_warp(volumes)
    from surfa.core.framed import FramedArrayIntents

    surfa.io.framed.save_framed_array(warp, str(folder / "warp.nii.gz"), intent=FramedArrayIntents.warpmap)
    return "FreeSurfer", "surfa " + version_of("surfa"), ["warp.nii.gz"], there, image


def case_freesurfer_lta(space):
    """A case of a linear transform between RAS or voxels. It leads from the moving to the fixed volume."""

    def case(volumes, folder):
        import surfa

        fixed, moving = (surfa.load_volume(str(volumes.folder / name)) for name in (FIXED, MOVING))
        affine = surfa.Affine(np.linalg.inv(MATRIX), space="world", source=moving.geom, target=fixed.geom)
        affine.convert(space=space).save(str(folder / "affine.lta"))
        warped = moving.transform(affine).resample_like(fixed)
        image = nibabel.Nifti1Image(np.asarray(warped.data, np.float32), volumes.fixed.affine)
        there = moved(MATRIX, volumes.points)
        return "FreeSurfer", "surfa " + version_of("surfa"), ["affine.lta:invert=yes"], there, image

    return case


def fsl_images(volumes):
    """The two volumes as fslpy has them."""
    import fsl.data.image

    return [fsl.data.image.Image(str(volumes.folder / name)) for name in (FIXED, MOVING)]


def case_flirt(volumes, folder):
    """A matrix of flirt, from moving to fixed in the coordinates of FSL."""
    import fsl.transform.flirt

    fixed, moving = fsl_images(volumes)
    matrix = fsl.transform.flirt.toFlirt(np.linalg.inv(MATRIX), moving, fixed, "world", "world")
    fsl.transform.flirt.writeFlirt(matrix, str(folder / "flirt.mat"))
    argument = "flirt.mat:tool=flirt,source=../moving.nii.gz,reference=../fixed.nii.gz,invert=yes"
    return "FSL flirt", "fslpy " + version_of("fslpy"), [argument], moved(MATRIX, volumes.points), None


def case_fnirt(kind):
    """A field of fnirt, of displacements ("relative") or positions ("absolute")."""

    def case(volumes, folder):
        import fsl.transform.fnirt
        import fsl.transform.nonlinear

        fixed, moving = fsl_images(volumes)
        there = moved(MATRIX, volumes.points) + volumes.displacement().reshape(-1, 3)
        field = fsl.transform.nonlinear.DeformationField(
            there.reshape(*volumes.fixed.shape, 3).astype(np.float32), moving, fixed, srcSpace="world", refSpace="world",
            defType="absolute", xform=fixed.voxToWorldMat,
        )
        field = fsl.transform.fnirt.toFnirt(field)  # which keeps the positions
        if kind == "relative":
            values = fsl.transform.nonlinear.convertDeformationType(field, "relative")
            field = fsl.transform.nonlinear.DeformationField(
                values, moving, fixed, srcSpace="fsl", refSpace="fsl", defType="relative", header=field.header,
                xform=fixed.voxToWorldMat,
            )
        field.save(str(folder / "warp.nii.gz"))
        values = "positions" if kind == "absolute" else "displacements"
        argument = f"warp.nii.gz:values={values},source=../moving.nii.gz"
        return "FSL fnirt", "fslpy " + version_of("fslpy"), [argument], there, None

    return case


def case_fnirt_coefficients(volumes, folder):
    """Coefficients of fnirt: a cubic B-spline with knots every 4, 3 and 2 voxels, after an affine map of flirt."""
    import fsl.transform.affine
    import fsl.transform.flirt
    import fsl.transform.fnirt
    import fsl.transform.nonlinear

    fixed, moving = fsl_images(volumes)
    knots = (4, 3, 2)
    shape = [-(-(size + 1) // knot) + 2 for size, knot in zip(volumes.fixed.shape, knots)]
    values = np.random.default_rng(11).normal(scale=3, size=(*shape, 3)).astype(np.float32)
    field = fsl.transform.nonlinear.CoefficientField(
        nibabel.Nifti1Image(values, np.eye(4)), moving, fixed, srcSpace="fsl", refSpace="fsl", fieldType="cubic", knotSpacing=knots,
        fieldToRefMat=fsl.transform.affine.scaleOffsetXform(knots, 0),
        srcToRefMat=fsl.transform.flirt.toFlirt(np.linalg.inv(MATRIX), moving, fixed, "world", "world"),
    )
    fsl.transform.fnirt.toFnirt(field).save(str(folder / "coefficients.nii.gz"))
    written = fsl.transform.fnirt.readFnirt(str(folder / "coefficients.nii.gz"), moving, fixed)
    there = written.transform(volumes.points, "world", "world")
    argument = "coefficients.nii.gz:source=../moving.nii.gz,reference=../fixed.nii.gz"
    return "FSL fnirt", "fslpy " + version_of("fslpy"), [argument], there, None


def niftyreg_version():
    """The version of NiftyReg, whose programs must be in PATH."""
    return subprocess.run(["reg_f3d", "--version"], check=True, capture_output=True, text=True).stdout.split()[-1]


def by_niftyreg(volumes, folder, transform):
    """Points by the deformation field that reg_transform makes of any transform, and the moving volume by reg_resample."""
    fixed, moving, field, out = volumes.folder / FIXED, volumes.folder / MOVING, folder / "points.nii", folder / "out.nii"
    run("reg_transform", "-ref", fixed, "-def", transform, field)
    run("reg_resample", "-ref", fixed, "-flo", moving, "-trans", transform, "-res", out, "-inter", 1, "-pad", 0)
    there = np.asarray(nibabel.load(field).dataobj)
    warped = np.asarray(nibabel.load(out).dataobj, np.float32)
    assert there.shape == (*volumes.fixed.shape, 1, 3) and warped.shape == volumes.fixed.shape
    for file in (field, out):
        file.unlink()
    return there.reshape(-1, 3), nibabel.Nifti1Image(warped, volumes.fixed.affine)


def niftyreg_spline(volumes, folder):
    """A registration by reg_f3d: a cubic B-spline. Its control points are not 5 voxels apart along i: if they are, reg_f3d
    and reg_resample of 1.5.70 take them to be so along j and k too, and reg_transform does not."""
    run("reg_f3d", "-ref", volumes.folder / FIXED, "-flo", volumes.folder / MOVING, "-cpp", folder / "cpp.nii.gz", "-res",
        folder / "result.nii.gz", "-sx", -4, "-sy", -5, "-sz", -3, "-ln", 1, "-lp", 1, "-maxit", 20, "-be", 0.0001)
    (folder / "result.nii.gz").unlink()
    return folder / "cpp.nii.gz"


def case_niftyreg_spline(volumes, folder):
    """The B-spline of a registration by reg_f3d."""
    spline = niftyreg_spline(volumes, folder)
    return "NiftyReg", niftyreg_version(), [spline.name], *by_niftyreg(volumes, folder, spline)


def case_niftyreg_field(option, name):
    """A case of the field that reg_transform makes of that B-spline: positions (-def) or displacements (-disp)."""

    def case(volumes, folder):
        spline = niftyreg_spline(volumes, folder)
        run("reg_transform", "-ref", volumes.folder / FIXED, option, spline, folder / name)
        spline.unlink()
        return "NiftyReg", niftyreg_version(), [name], *by_niftyreg(volumes, folder, folder / name)

    return case


def case_niftyreg_affine(volumes, folder):
    """The matrix of an affine registration by reg_aladin, in text."""
    run("reg_aladin", "-ref", volumes.folder / FIXED, "-flo", volumes.folder / MOVING, "-aff", folder / "affine.txt",
        "-res", folder / "result.nii.gz", "-ln", 1, "-lp", 1, "-maxit", 5, "-noSym")
    (folder / "result.nii.gz").unlink()
    there, warped = by_niftyreg(volumes, folder, folder / "affine.txt")
    return "NiftyReg", niftyreg_version(), ["affine.txt:tool=niftyreg"], there, warped


def case_spm(volumes, folder):
    """A deformation of SPM12 by its published layout: positions in RAS mm, five axes, intent_name Mapping."""
    there = moved(MATRIX, volumes.points) + volumes.displacement().reshape(-1, 3)
    image = nibabel.Nifti1Image(
        there.reshape(*volumes.fixed.shape, 1, 3).astype(np.float32), volumes.fixed.affine
    )
    image.header.set_intent("vector", name="Mapping")
    image.header["descrip"] = b"Deformation"
    image.set_sform(volumes.fixed.affine, 2)
    image.set_qform(volumes.fixed.affine, 2)
    nibabel.save(image, folder / "y_fixed.nii")
    (folder / "y_fixed.nii.gz").unlink(missing_ok=True)
    return "SPM", "layout of SPM12", ["y_fixed.nii"], there, None


def case_voxelmorph(volumes, folder):
    """A warp of VoxelMorph in .npz: displacements in voxels of the fixed grid, [i, j, k, 3], key `vol`."""
    by = np.linalg.inv(volumes.fixed.affine)[:3, :3] @ volumes.displacement().reshape(-1, 3).T
    np.savez_compressed(folder / "warp.npz", vol=by.T.reshape(*volumes.fixed.shape, 3).astype(np.float32))
    argument = "warp.npz:key=vol,order=xyz,units=voxel"
    there = volumes.points + volumes.displacement().reshape(-1, 3)
    return "VoxelMorph", "layout of 0.2", [argument], there, None


def plastimatch_version():
    """The version of plastimatch."""
    return subprocess.run(["plastimatch", "--version"], check=True, capture_output=True, text=True).stdout.split()[2]


def plastimatch_registration(volumes, folder):
    """A registration by plastimatch: vf.mha, its field, and bspline.txt. Returns T of the points, and the volume."""
    import itk

    (folder / "parms.txt").write_text(
        f"[GLOBAL]\nfixed={volumes.folder / FIXED}\nmoving={volumes.folder / MOVING}\nvf_out={folder / 'vf.mha'}\n"
        f"xform_out={folder / 'bspline.txt'}\n[STAGE]\nxform=bspline\noptim=lbfgsb\nimpl=plastimatch\nmetric=mse\n"
        "max_its=8\nres=1 1 1\ngrid_spac=15 15 15\nregularization_lambda=0.01\n"
    )
    run("plastimatch", "register", folder / "parms.txt")
    run("plastimatch", "warp", "--input", volumes.folder / MOVING, "--xf", folder / "vf.mha", "--fixed",
        volumes.folder / FIXED, "--interpolation", "linear", "--output-type", "float", "--output-img", folder / "out.mha")
    vectors = itk.array_from_image(itk.imread(str(folder / "vf.mha")))
    values = itk.array_from_image(itk.imread(str(folder / "out.mha"), itk.F))
    for name in ("parms.txt", "out.mha"):
        (folder / name).unlink()
    there = volumes.points + np.moveaxis(vectors, (0, 1, 2), (2, 1, 0)).reshape(-1, 3) * LPS
    warped = np.ascontiguousarray(np.moveaxis(values, (0, 1, 2), (2, 1, 0)))
    return there, nibabel.Nifti1Image(warped, volumes.fixed.affine)


def case_plastimatch_field(volumes, folder):
    """The field of a registration by plastimatch."""
    there, warped = plastimatch_registration(volumes, folder)
    (folder / "bspline.txt").unlink()
    return "plastimatch", plastimatch_version(), ["vf.mha"], there, warped


def case_plastimatch_spline(volumes, folder):
    """The B-spline of the same registration, against the field that plastimatch made of it."""
    there, warped = plastimatch_registration(volumes, folder)
    (folder / "vf.mha").unlink()
    return "plastimatch", plastimatch_version(), ["bspline.txt"], there, warped


def case_dicom_spatial_registration(volumes, folder):
    """A rigid transform that plastimatch wrote as a Spatial Registration, from the moving to the fixed volume."""
    rigid = np.eye(4)
    rigid[:3, :3], rigid[:3, 3] = turned(0.1, 0.05, -0.03), [1.5, 2.5, -1.25]
    lps = np.diag([*LPS, 1]) @ rigid @ np.diag([*LPS, 1])
    numbers = " ".join(f"{v:.12f}" for v in [*lps[:3, :3].ravel(), *lps[:3, 3]])
    (folder / "rigid.tfm").write_text(
        "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\n"
        f"Parameters: {numbers}\nFixedParameters: 0 0 0\n"
    )
    run("plastimatch", "xf-convert", "--input", folder / "rigid.tfm", "--output-dicom", folder / "out", "--fixed-image",
        volumes.folder / FIXED, "--moving-image", volumes.folder / MOVING, "--filenames-without-uids")
    shutil.move(folder / "out" / "sro.dcm", folder / "sro.dcm")
    shutil.rmtree(folder / "out")
    (folder / "rigid.tfm").unlink()
    there = moved(rigid, volumes.points)
    return "plastimatch", plastimatch_version(), ["sro.dcm:invert=yes"], there, None


CASES = {
    "ants-list": case_ants_list,
    "ants-inverse-list": case_ants_inverse_list,
    "ants-composite": case_ants_composite,
    "greedy-list": case_greedy_list,
    "elastix-toml": case_elastix_toml,
    "plastimatch-field": case_plastimatch_field,
    "plastimatch-spline": case_plastimatch_spline,
    "dicom-spatial-registration": case_dicom_spatial_registration,
    "mrtrix-linear": case_mrtrix_linear,
    "mrtrix-warp": case_mrtrix_warp,
    "mrtrix-displacement": case_mrtrix_displacement,
    "mrtrix-registration": case_mrtrix_registration,
    "mrtrix-mif": case_mrtrix_mif("warp.mif", "-strides", "2,3,4,1"),
    "mrtrix-mif-backwards": case_mrtrix_mif("warp.mif", "-strides", "-3,2,-1,4", "-datatype", "float32be"),
    "mrtrix-mif-left": case_mrtrix_mif("warp.mif", "-config", "RealignTransform", "false"),
    "mrtrix-mif-packed": case_mrtrix_mif("displacement.mif.gz", "-strides", "-2,4,-1,3", displacements=True),
    "freesurfer-abs-crs": case_freesurfer("abs_crs"),
    "freesurfer-disp-crs": case_freesurfer("disp_crs"),
    "freesurfer-abs-ras": case_freesurfer("abs_ras"),
    "freesurfer-disp-ras": case_freesurfer("disp_ras"),
    "freesurfer-nifti": case_freesurfer_nifti,
    "freesurfer-lta-ras": case_freesurfer_lta("world"),
    "freesurfer-lta-voxel": case_freesurfer_lta("voxel"),
    "fsl-flirt": case_flirt,
    "fsl-fnirt-relative": case_fnirt("relative"),
    "fsl-fnirt-absolute": case_fnirt("absolute"),
    "fsl-fnirt-coefficients": case_fnirt_coefficients,
    "niftyreg-affine": case_niftyreg_affine,
    "niftyreg-spline": case_niftyreg_spline,
    "niftyreg-deformation": case_niftyreg_field("-def", "deformation.nii.gz"),
    "niftyreg-displacement": case_niftyreg_field("-disp", "displacement.nii.gz"),
    "spm": case_spm,
    "voxelmorph": case_voxelmorph,
}


#: Other bounds than those of the test, mm: a header of plastimatch has six decimals, which an oblique volume feels.
BOUNDS = {"plastimatch-spline": {"bound_mm": 2e-4}}


def main():
    folder = pathlib.Path(sys.argv[1]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    if not (folder / FIXED).exists():
        make_volumes(folder)
    volumes = Volumes(folder)
    for name in sys.argv[2:] or CASES:
        place = folder / name
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir()
        program, version, arguments, there, warped = CASES[name](volumes, place)
        if there is not None:
            by = ((there - volumes.points) * LPS).reshape(*volumes.fixed.shape, 3)
            np.save(place / "expected.npy", np.ascontiguousarray(by.transpose(2, 1, 0, 3).astype(np.float32)))
        if warped is not None:
            nibabel.save(warped, place / "warped.nii.gz")
        case = {"program": program, "version": version, "pull_field": arguments, "about": CASES[name].__doc__ or ""}
        case.update(BOUNDS.get(name, {}))
        (place / "case.json").write_text(json.dumps(case, indent=1) + "\n", encoding="utf-8")
        print(name, program, version, sorted(file.name for file in place.iterdir()))


if __name__ == "__main__":
    main()
