#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Registers a fixed volume with a moving one by a program or library that others use, with its usual settings.

    register.py METHOD MOVING FIXED RESULT.mha

METHOD: plastimatch, elastix (programs); niftyreg (its programs, and the package tetwarp, which reads what they write); itk-elastix,
simpleitk-demons, simpleitk-bspline, ants (antspyx) (packages of Python); gradient (Tetwarp's own: examples/learning/register.py,
wants PyTorch and the package tetwarp).
RESULT gets the displacement from fixed to moving at each voxel of FIXED, LPS mm, as `tetwarp score` takes it.
"""

from __future__ import annotations

import argparse
import pathlib
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable


def run(*words: object) -> None:
    """Runs a program; what it prints is shown where it fails."""
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"register.py: error: {words[0]} failed\n{done.stdout[-2000:]}{done.stderr[-2000:]}")


def plastimatch(moving: str, fixed: str, result: str) -> None:
    """B-splines in four stages, mean squared error: the settings that its guide names for one patient."""
    with tempfile.TemporaryDirectory() as folder:
        page = pathlib.Path(folder) / "parameters.txt"
        page.write_text(
            f"""[GLOBAL]
fixed={fixed}
moving={moving}
vf_out={result}
[STAGE]
xform=bspline
optim=lbfgsb
metric=mse
max_its=50
grid_spac=60 60 60
res=4 4 2
regularization_lambda=0.02
[STAGE]
max_its=50
grid_spac=40 40 40
res=2 2 1
[STAGE]
max_its=50
grid_spac=25 25 25
res=1 1 1
"""
        )
        run("plastimatch", "register", page)


ELASTIX_MAP = """(FixedImageDimension 3)
(MovingImageDimension 3)
(FixedInternalImagePixelType "float")
(MovingInternalImagePixelType "float")
(UseDirectionCosines "true")
(Registration "MultiResolutionRegistration")
(Interpolator "BSplineInterpolator")
(ResampleInterpolator "FinalBSplineInterpolator")
(Resampler "DefaultResampler")
(FixedImagePyramid "FixedRecursiveImagePyramid")
(MovingImagePyramid "MovingRecursiveImagePyramid")
(Optimizer "AdaptiveStochasticGradientDescent")
(Transform "BSplineTransform")
(Metric "AdvancedMattesMutualInformation")
(FinalGridSpacingInPhysicalUnits 25)
(GridSpacingSchedule 4 2 1 1)
(NumberOfResolutions 4)
(MaximumNumberOfIterations 500)
(NumberOfHistogramBins 32)
(NumberOfSpatialSamples 4096)
(NewSamplesEveryIteration "true")
(ImageSampler "RandomCoordinate")
(BSplineInterpolationOrder 1)
(FinalBSplineInterpolationOrder 3)
(DefaultPixelValue -1000)
(HowToCombineTransforms "Compose")
(AutomaticTransformInitialization "false")
(WriteResultImage "false")
(ResultImageFormat "mha")
(RandomSeed 121212)
"""


def elastix(moving: str, fixed: str, result: str) -> None:
    """B-splines, mutual information, four resolutions: elastix' usual map for one patient."""
    with tempfile.TemporaryDirectory() as folder:
        page = pathlib.Path(folder) / "parameters.txt"
        page.write_text(ELASTIX_MAP)
        run("elastix", "-f", fixed, "-m", moving, "-p", page, "-out", folder)
        run("transformix", "-def", "all", "-tp", pathlib.Path(folder) / "TransformParameters.0.txt", "-out", folder)
        shutil.copy(pathlib.Path(folder) / "deformationField.mha", result)


def niftyreg(moving: str, fixed: str, result: str) -> None:
    """reg_f3d with its defaults: B-splines in three resolutions, normalised mutual information."""
    import tetwarp

    with tempfile.TemporaryDirectory() as folder:
        spline, warped, field = (f"{folder}/{name}.nii.gz" for name in ("spline", "warped", "field"))
        run("reg_f3d", "-ref", fixed, "-flo", moving, "-cpp", spline, "-res", warped)
        run("reg_transform", "-ref", fixed, "-disp", spline, field)
        tetwarp.write_field(tetwarp.read_field(field, direction="pull"), result)


def itk_elastix(moving: str, fixed: str, result: str) -> None:
    """The default maps of itk-elastix: rigid, affine, B-splines."""
    import itk

    images = [itk.imread(path, itk.F) for path in (fixed, moving)]
    maps = itk.ParameterObject.New()
    for kind in ("rigid", "affine", "bspline"):
        maps.AddParameterMap(maps.GetDefaultParameterMap(kind))
    _, transform = itk.elastix_registration_method(*images, parameter_object=maps, log_to_console=False)
    itk.imwrite(itk.transformix_deformation_field(images[1], transform), result)


def simpleitk_demons(moving: str, fixed: str, result: str) -> None:
    """Fast symmetric forces demons in three resolutions."""
    import SimpleITK as sitk

    still, moved = (sitk.ReadImage(path, sitk.sitkFloat32) for path in (fixed, moving))
    demons = sitk.FastSymmetricForcesDemonsRegistrationFilter()
    demons.SetNumberOfIterations(60)
    demons.SetStandardDeviations(1.5)
    field = None
    for factor in (4, 2, 1):
        small = [
            sitk.Shrink(sitk.DiscreteGaussian(image, (factor / 2) ** 2), [factor] * 3) if factor > 1 else image
            for image in (still, moved)
        ]
        if field is None:
            field = demons.Execute(small[0], small[1])
        else:
            field = demons.Execute(small[0], small[1], sitk.Resample(field, small[0]))
    sitk.WriteImage(sitk.Cast(field, sitk.sitkVectorFloat32), result)


def simpleitk_bspline(moving: str, fixed: str, result: str) -> None:
    """B-splines by L-BFGS in three resolutions with 2, 4 and 10 cells an axis, mean squares at 20 000 voxels."""
    import SimpleITK as sitk

    still, moved = (sitk.ReadImage(path, sitk.sitkFloat32) for path in (fixed, moving))
    factors, voxels = (4, 2, 1), still.GetNumberOfPixels()
    method = sitk.ImageRegistrationMethod()
    method.SetInitialTransformAsBSpline(sitk.BSplineTransformInitializer(still, [2, 2, 2]), True, [1, 2, 5])
    method.SetMetricAsMeanSquares()
    method.SetMetricSamplingStrategy(method.RANDOM)
    method.SetMetricSamplingPercentagePerLevel([min(1.0, 20000 * factor**3 / voxels) for factor in factors], 1)
    method.SetShrinkFactorsPerLevel(factors)
    method.SetSmoothingSigmasPerLevel([2, 1, 0])
    method.SetOptimizerAsLBFGS2(numberOfIterations=60)
    method.SetInterpolator(sitk.sitkLinear)
    transform = method.Execute(still, moved)
    field = sitk.TransformToDisplacementField(
        transform, sitk.sitkVectorFloat64, still.GetSize(), still.GetOrigin(), still.GetSpacing(), still.GetDirection()
    )
    sitk.WriteImage(sitk.Cast(field, sitk.sitkVectorFloat32), result)


def ants(moving: str, fixed: str, result: str) -> None:
    """SyN of ANTs with its defaults: affine, then symmetric diffeomorphic, mutual information."""
    import ants as package
    import SimpleITK as sitk

    still, moved = (package.image_read(path) for path in (fixed, moving))
    with tempfile.TemporaryDirectory() as folder:
        done = package.registration(still, moved, type_of_transform="SyN", outprefix=f"{folder}/of", random_seed=1)
        whole = package.apply_transforms(still, moved, done["fwdtransforms"], compose=f"{folder}/whole")
        sitk.WriteImage(sitk.Cast(sitk.ReadImage(whole), sitk.sitkVectorFloat32), result)


def gradient(moving: str, fixed: str, result: str) -> None:
    """Gradient descent through the forward deformation, cells of 32, 16 and 8 voxels; the result is its exact inverse."""
    import tetwarp

    example = pathlib.Path(__file__).resolve().parents[2] / "learning" / "register.py"
    with tempfile.TemporaryDirectory() as folder:
        run(sys.executable, example, moving, fixed, "-o", folder)
        field = tetwarp.read_field(f"{folder}/field.mha")
        inverse = tetwarp.invert(field, tetwarp.read(fixed).geometry, outside="background")
        tetwarp.write_field(inverse, result)


METHODS: dict[str, Callable[[str, str, str], None]] = {
    "plastimatch": plastimatch,
    "elastix": elastix,
    "niftyreg": niftyreg,
    "itk-elastix": itk_elastix,
    "simpleitk-demons": simpleitk_demons,
    "simpleitk-bspline": simpleitk_bspline,
    "ants": ants,
    "gradient": gradient,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("method", choices=METHODS)
    parser.add_argument("moving")
    parser.add_argument("fixed")
    parser.add_argument("result")
    options = parser.parse_args()
    if not options.result.endswith(".mha"):
        parser.error("RESULT is a .mha file")
    result = pathlib.Path(options.result)
    with tempfile.TemporaryDirectory(prefix=".unfinished-", dir=result.parent) as folder:
        unfinished = pathlib.Path(folder) / "result.mha"
        METHODS[options.method](options.moving, options.fixed, str(unfinished))
        unfinished.rename(result)


if __name__ == "__main__":
    main()
