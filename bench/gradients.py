#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Gradients through a deformation by tetwarp.torch, beside torch.nn.functional.grid_sample, in one run.

    gradients.py [--device cuda] [--size 512,512,300] [--cell-size 8] [--repeats 20]

A volume of noise goes through a smooth random field on a lattice. grid_sample is given the inverse of that field, voxel by voxel,
which it could not find itself, and needs no lattice; its own backward pass adds floats in the order in which threads come. Printed
are medians of the wall time of a call, the device waited for, in milliseconds, and the most that PyTorch held of the device's memory.
"""
import argparse
import statistics
import time

import tetwarp
import tetwarp.torch
import torch


def smooth_noise(shape, lattice_shape, amplitude, device):
    generator = torch.Generator().manual_seed(7)
    coarse = torch.randn(1, 3, *(max(2, size // 4) for size in lattice_shape), generator=generator)
    fine = torch.nn.functional.interpolate(coarse, size=lattice_shape, mode="trilinear", align_corners=True)
    volume = torch.randn(1, 1, *shape, generator=generator)
    return volume.to(device), (amplitude * fine).to(device)


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    words.add_argument("--size", default="512,512,300")
    words.add_argument("--cell-size", type=int, default=8)
    words.add_argument("--repeats", type=int, default=20)
    options = words.parse_args()
    i, j, k = (int(number) for number in options.size.split(","))
    shape = (k, j, i)
    on_gpu = options.device.startswith("cuda")
    volume, displacement = smooth_noise(
        shape, tetwarp.torch.lattice_shape(shape, options.cell_size), 0.2 * options.cell_size, options.device
    )
    weights = torch.randn(volume.shape, generator=torch.Generator().manual_seed(8)).to(options.device)

    def wait():
        if on_gpu:
            torch.cuda.synchronize()

    def timed(call):
        """Median milliseconds of a call, and the most memory that PyTorch held for it, MiB."""
        for _ in range(3):
            call()
        times = []
        if on_gpu:
            torch.cuda.reset_peak_memory_stats()
        for _ in range(options.repeats):
            wait()
            begun = time.perf_counter()
            call()
            wait()
            times.append(1e3 * (time.perf_counter() - begun))
        return statistics.median(times), torch.cuda.max_memory_allocated() / 2**20 if on_gpu else float("nan")

    def tetwarp_call(of_volume, of_displacement):
        def call():
            v, d = volume.detach().requires_grad_(of_volume), displacement.detach().requires_grad_(of_displacement)
            result = tetwarp.torch.deform(v, d, lattice=options.cell_size, outside="background")
            if of_volume or of_displacement:
                result.backward(weights)
        return call

    grid = tetwarp.Geometry((i, j, k))
    resampler = tetwarp.Resampler(grid, backend="cuda" if on_gpu else "cpu")
    field = displacement[0].permute(1, 2, 3, 0).contiguous()
    field = field if on_gpu else field.numpy()
    resampler.set_field(tetwarp.VertexField(grid.lattice(options.cell_size), field), outside="background")
    offset = torch.empty((*shape, 3), device=options.device)
    resampler.resample([], maps={"inverse": offset if on_gpu else offset.numpy()})
    at = torch.stack(torch.meshgrid(*(torch.arange(n, device=options.device) for n in shape), indexing="ij")[::-1], -1) + offset
    at = torch.nan_to_num(at, nan=-1e6)
    last = torch.tensor([i - 1, j - 1, k - 1], device=options.device)
    places = (2 * at / last - 1)[None]
    del at, offset

    def grid_sample_call(of_volume, of_places):
        def call():
            v, p = volume.detach().requires_grad_(of_volume), places.detach().requires_grad_(of_places)
            result = torch.nn.functional.grid_sample(v, p, mode="bilinear", align_corners=True)
            if of_volume or of_places:
                result.backward(weights)
        return call

    name = torch.cuda.get_device_name() if on_gpu else f"CPU, {torch.get_num_threads()} threads"
    print(f"{name}, PyTorch {torch.__version__}, tetwarp {tetwarp.features()['commit']}")
    print(f"{i} x {j} x {k} float32, cells of {options.cell_size}, medians of {options.repeats} calls")
    print("| | ms | over forward alone | MiB |\n| --- | --- | --- | --- |")
    def of_others():
        """MiB of the device that are in use, but not by PyTorch."""
        free, total = torch.cuda.mem_get_info()
        return (total - free - torch.cuda.memory_reserved()) / 2**20

    tetwarp.torch.clear_cache()
    before = of_others() if on_gpu else 0
    kinds = {"forward": (False, False), "forward and backward, displacement": (False, True), "forward and backward, both": (True, True)}
    for title, make in (("tetwarp", tetwarp_call), ("grid_sample, given the inverse", grid_sample_call)):
        first = None
        for kind, wanted in kinds.items():
            ms, mebibytes = timed(make(*wanted))
            first = first or ms
            print(f"| {title}: {kind} | {ms:.2f} | {ms / first:.2f} | {mebibytes:.0f} |")
        if title == "tetwarp" and on_gpu:
            kept = of_others() - before
    if on_gpu:
        print(f"tetwarp keeps {kept:.0f} MiB of its own for the next call")
    runs = []
    for _ in range(2):
        v = volume.detach().requires_grad_()
        torch.nn.functional.grid_sample(v, places, align_corners=True).backward(weights)
        runs.append(v.grad)
    print(f"grid_sample gives the same bits twice: {torch.equal(*runs)}")
    torch.use_deterministic_algorithms(True)
    try:
        grid_sample_call(True, True)()
        ms, _ = timed(grid_sample_call(True, True))
        print(f"grid_sample with use_deterministic_algorithms(True), both: {ms:.2f} ms")
    except RuntimeError as refused:
        print(f"grid_sample with use_deterministic_algorithms(True): {str(refused).splitlines()[0]}")


if __name__ == "__main__":
    main()
