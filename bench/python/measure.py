#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Times the Python package beside the program and beside other packages.

    measure.py [PROGRAM] [--json FILE] [--repeats N] [--threads N] [--size I,J,K]

Each figure is a median of interleaved repeats on random data. Packages that are not installed are left out, and said.
Ratios are of one run on one machine.
"""

import argparse
import importlib
import importlib.metadata
import json
import os
import pathlib
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np
import tetwarp as tw

AMPLITUDE, CONTROL = 6.0, 32.0  # mm, which are voxels here


def interleaved(repeats, **works):
    """Median seconds of each work; the works take turns, after one round that does not count."""
    times = {name: [] for name in works}
    for turn in range(repeats + 1):
        for name, work in works.items():
            begin = time.perf_counter()
            work()
            if turn > 0:
                times[name].append(time.perf_counter() - begin)
    return {name: statistics.median(one) for name, one in times.items()}


def noise(grid, kind):
    return np.random.default_rng(1).integers(-1000, 1000, grid.shape).astype(kind)


def beside_the_program(program, size, threads, repeats):
    """`deform` of an array against the stages field and resample of the program."""
    grid = tw.Geometry(size)
    ct = tw.Volume(noise(grid, np.int16), grid)
    text = f"elastic:amplitude={AMPLITUDE},spacing={CONTROL},seed=3"
    theirs, ours = [], []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        tw.write(ct, folder / "ct.mha")
        for turn in range(repeats + 1):
            subprocess.run(
                [program, "deform", folder / "ct.mha", "-f", text, "-o", folder / "out.mha", "--overwrite", "--quiet",
                 "--threads", str(threads), "--backend", "cpu", "--outside", "background", "--report", folder / "r.json"],
                check=True,
            )
            stages = json.loads((folder / "r.json").read_text())["stages"]
            begin = time.perf_counter()
            field = tw.fields.formula(text, grid, threads=threads)
            tw.deform(ct, field, outside="background", backend="cpu", threads=threads)
            if turn > 0:
                ours.append(time.perf_counter() - begin)
                theirs.append(stages["field"]["seconds"] + stages["resample"]["seconds"])
    return {"python_s": statistics.median(ours), "program_s": statistics.median(theirs)}


def overhead(repeats):
    grid = tw.Geometry((2, 2, 2))
    volume = tw.Volume(noise(grid, np.int16), grid)
    field = tw.fields.identity(grid)
    warp = tw.Resampler(grid, backend="cpu", threads=1)
    warp.set_field(field)

    def many():
        for _ in range(200):
            warp.resample([volume])

    def whole():
        for _ in range(200):
            tw.deform(volume, field, backend="cpu", threads=1)

    times = interleaved(repeats, resample=many, deform=whole)
    return {name: seconds / 200 * 1e6 for name, seconds in times.items()}


def peak_memory(size):
    """Bytes beyond source, output and field, in a process of its own."""
    code = f"""
import resource
import numpy as np
import tetwarp as tw
grid = tw.Geometry({size})
field = tw.fields.elastic(grid, amplitude={AMPLITUDE}, spacing={CONTROL}, seed=3)
ct = tw.Volume(np.random.default_rng(1).integers(-1000, 1000, grid.shape, dtype=np.int16), grid)
out = np.zeros(grid.shape, np.int16) + np.int16(1)
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
tw.deform(ct, field, outside="background", backend="cpu", out=out)
print(1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before))
"""
    return int(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout)


def import_time(repeats):
    def loads(what):
        return lambda: subprocess.run([sys.executable, "-c", f"import {what}"], check=True)

    times = interleaved(repeats, numpy=loads("numpy"), tetwarp=loads("numpy, tetwarp"))
    return 1e3 * (times["tetwarp"] - times["numpy"])


def module(name, missing):
    try:
        return importlib.import_module(name)
    except ImportError:
        missing.append(name)
        return None


def augmentation(threads, repeats, missing):
    """A random elastic deformation of a volume and its labels, with the exact inverse where a package has one."""
    grid = tw.Geometry((128, 128, 128))
    image = noise(grid, np.float32)
    labels = (noise(grid, np.int16) % 4).astype(np.uint8)
    seeds = iter(range(1000000))

    def ours():
        field = tw.fields.elastic(grid, amplitude=AMPLITUDE, spacing=CONTROL, seed=next(seeds), cell_size=4)
        tw.deform(
            tw.Volume(image, grid), field, outside="background", backend="cpu", threads=threads,
            with_=[tw.Along(tw.Volume(labels, grid), interpolation="vote")], maps=("inverse",),
        )

    works = {"tetwarp, with the exact inverse": ours}
    torch = module("torch", missing)
    if torch:
        torch.set_num_threads(threads)
        tensor, label_tensor = torch.as_tensor(image)[None], torch.as_tensor(labels)[None]
        torchio = module("torchio", missing)
        if torchio:
            subject = torchio.Subject(
                image=torchio.ScalarImage(tensor=tensor), labels=torchio.LabelMap(tensor=label_tensor)
            )
            warp = torchio.RandomElasticDeformation(num_control_points=7, max_displacement=AMPLITUDE)
            works["TorchIO RandomElasticDeformation"] = lambda: warp(subject)
        monai = module("monai.transforms", missing)
        if monai:
            random = monai.Rand3DElasticd(
                keys=["image", "labels"], sigma_range=(8, 8), magnitude_range=(100, 100), prob=1.0,
                mode=["bilinear", "nearest"], padding_mode="zeros",
            )
            works["MONAI Rand3DElasticd"] = lambda: random({"image": tensor, "labels": label_tensor})
    elasticdeform = module("elasticdeform", missing)
    if elasticdeform:
        works["elasticdeform"] = lambda: elasticdeform.deform_random_grid(
            [image, labels.astype(np.float32)], sigma=AMPLITUDE / 2, points=7, order=[1, 0]
        )
    return interleaved(repeats, **works)


def augmentation_on_device(repeats, missing):
    """The same as `augmentation` with tensors on a CUDA device. The field is made on the host, as the lattice is small."""
    torch = module("torch", missing)
    if not torch or not tw.features()["devices"] or not torch.cuda.is_available():
        missing.append("a CUDA device")
        return {}
    grid = tw.Geometry((128, 128, 128))
    image = torch.as_tensor(noise(grid, np.float32), device="cuda")
    labels = torch.as_tensor((noise(grid, np.int16) % 4).astype(np.uint8), device="cuda")
    lattice = grid.lattice(4)
    warp = tw.Resampler(grid, backend="cuda")
    seeds = iter(range(1000000))

    def ours():
        made = tw.fields.elastic(grid, amplitude=AMPLITUDE, spacing=CONTROL, seed=next(seeds), cell_size=4)
        warp.set_field(
            tw.VertexField(lattice, torch.as_tensor(made.displacement, device="cuda")), outside="background",
            jacobian_range=False,
        )
        volumes = [tw.Target(tw.Volume(image, grid), background=0), tw.Target(tw.Volume(labels, grid), "vote", 0)]
        warp.resample(volumes, maps=("inverse",))
        torch.cuda.synchronize()

    works = {"tetwarp, with the exact inverse": ours}
    monai = module("monai.transforms", missing)
    if monai:
        random = monai.Rand3DElasticd(
            keys=["image", "labels"], sigma_range=(8, 8), magnitude_range=(100, 100), prob=1.0,
            mode=["bilinear", "nearest"], padding_mode="zeros", device=torch.device("cuda"),
        )

        def theirs():
            random({"image": image[None], "labels": labels[None]})
            torch.cuda.synchronize()

        works["MONAI Rand3DElasticd"] = theirs
    return {"device": torch.cuda.get_device_name(), **interleaved(repeats, **works)}


def forward_field(threads, repeats, missing):
    """A forward field, against SimpleITK, which inverts it first; and against its resampling, the inverse given."""
    sitk = module("SimpleITK", missing)
    if not sitk:
        return {}
    sitk.ProcessObject.SetGlobalDefaultNumberOfThreads(threads)
    grid = tw.Geometry((128, 128, 128))
    volume = tw.Volume(noise(grid, np.float32), grid)
    field = tw.fields.elastic(grid, amplitude=AMPLITUDE, spacing=CONTROL, seed=3)
    image = sitk.GetImageFromArray(volume.array)
    forward = sitk.GetImageFromArray(field.displacement.astype(np.float64), isVector=True)
    inverse = sitk.GetImageFromArray(
        np.nan_to_num(tw.invert(field, grid).displacement).astype(np.float64), isVector=True
    )

    def resample(displacement):
        transform = sitk.DisplacementFieldTransform(sitk.Image(displacement))
        return sitk.Resample(image, image, transform, sitk.sitkLinear, -1000.0)

    return interleaved(
        repeats,
        tetwarp=lambda: tw.deform(volume, field, outside="background", backend="cpu", threads=threads),
        inverted_by_simpleitk=lambda: resample(sitk.InvertDisplacementField(forward)),
        inverse_given_to_simpleitk=lambda: resample(inverse),
    )


def machine(threads):
    names = [line.split(":")[1].strip() for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines()
             if line.startswith("model name")]
    packages = {}
    for name in ("numpy", "torch", "torchio", "monai", "elasticdeform", "SimpleITK"):
        try:
            packages[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return {"processor": names[0] if names else platform.machine(), "cores": os.cpu_count(), "threads": threads,
            "python": platform.python_version(), "packages": packages, "tetwarp": tw.features()["commit"]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", nargs="?", help="without it nothing is compared with the program")
    parser.add_argument("--json", type=pathlib.Path)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--size", default="512,512,300")
    options = parser.parse_args()
    size = tuple(int(number) for number in options.size.split(","))
    missing = []
    result = {
        "machine": machine(options.threads),
        "size": size,
        "beside_the_program": options.program
        and beside_the_program(options.program, size, options.threads, options.repeats),
        "call_us": overhead(options.repeats),
        "peak_memory_beyond_arrays_bytes": peak_memory(size),
        "import_beyond_numpy_ms": import_time(options.repeats),
        "augmentation_128_s": augmentation(options.threads, options.repeats, missing),
        "augmentation_128_on_device_s": augmentation_on_device(4 * options.repeats, missing),
        "forward_field_128_s": forward_field(options.threads, options.repeats, missing),
        "not_installed": missing,
        "peak_of_this_process_bytes": 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
    }
    text = json.dumps(result, indent=1)
    if options.json:
        options.json.write_text(text + "\n")
    print(text)


if __name__ == "__main__":
    main()
