#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Registration by gradient descent through the deformation: from one phase of a breath to another.

    register.py MOVING FIXED -o FOLDER [--device cuda] [--cells 32,16,8] [--steps 40,60,60]

Finds the forward field that moves MOVING onto FIXED: each vertex of a lattice takes what it holds along. Minimised is the mean
squared difference, voxels that nothing covers counting as --background, and a smoothness term: the mean squared second differences
of the displacement. The optimiser is Adam, coarse to fine: on volumes of half the resolution first, with larger cells.

Makes FOLDER/field.mha (the forward field), FOLDER/moved.nii.gz, FOLDER/report.json and, with matplotlib and both on one grid,
FOLDER/registration.png.
A device gives the same bits each time. Needs PyTorch 2.4 or later and the Python package.
"""
import argparse
import json
import pathlib
import time

import numpy
import tetwarp
import tetwarp.torch
import torch


MARGIN = 16  # voxels around the moving volume


def grown(geometry):
    """A grid with a margin on all sides."""
    size = [length + 2 * MARGIN for length in geometry.size]
    return tetwarp.Geometry(size, geometry.spacing, geometry.point([-MARGIN] * 3), geometry.direction)


def halved(volume, geometry):
    """A volume (1, 1, D, H, W) at half the resolution, and its grid: means of eight voxels."""
    size = [length // 2 for length in geometry.size]
    i, j, k = (2 * length for length in size)
    first = geometry.point([0.5, 0.5, 0.5])
    coarse = tetwarp.Geometry(size, [2 * mm for mm in geometry.spacing], first, geometry.direction)
    return torch.nn.functional.avg_pool3d(volume[..., :k, :j, :i], 2), coarse


def on_lattice(displacement, known, wanted):
    """A displacement (1, 3, d, h, w) of one lattice, interpolated at the vertices of another one."""
    for axis, (size, new) in enumerate(zip(known.shape, wanted.shape), start=2):
        along = 4 - axis  # i, j, k
        from_mm = wanted.spacing[along] / known.spacing[along]
        at = (torch.arange(new, dtype=torch.float64) * from_mm).clamp(max=size - 1)
        low = at.floor().long().clamp(max=size - 2)
        share = (at - low).to(displacement).view([-1 if n == axis else 1 for n in range(5)])
        low = low.to(displacement.device)
        displacement = torch.lerp(displacement.index_select(axis, low), displacement.index_select(axis, low + 1), share)
    return displacement.contiguous()


def straight(path):
    """The volume of a file or folder, on a straight, even grid."""
    volume = tetwarp.read(path)
    if volume.geometry != volume.geometry.straightened():
        volume = tetwarp.deform(volume, tetwarp.fields.identity(volume.geometry, cell_size=8)).volume
    return volume


def roughness(displacement, spacing):
    """Mean squared second differences along each axis, per mm."""
    total = 0
    for axis, along in zip((2, 3, 4), (2, 1, 0)):
        if displacement.shape[axis] < 3:
            continue
        middle = displacement.narrow(axis, 1, displacement.shape[axis] - 2)
        low, high = (displacement.narrow(axis, n, displacement.shape[axis] - 2) for n in (0, 2))
        total = total + ((low - 2 * middle + high) / spacing[along]).square().mean()
    return total


def register(moving, moving_grid, fixed, fixed_grid, cells, steps, rates, smoothness, background):
    """The displacement (1, 3, d, h, w) of the last lattice, that lattice, and the cost of each step."""
    # What lies beyond the volume is made visible, so that the cost has a slope there; and the lattice reaches beyond.
    around = torch.nn.functional.pad(moving, [MARGIN] * 6, value=background)
    levels = [(around, grown(moving_grid), fixed, fixed_grid)]
    levels.append((*halved(around, grown(moving_grid)), *halved(fixed, fixed_grid)))
    displacement, lattice, costs = None, None, []
    for number, (cell, count, rate) in enumerate(zip(cells, steps, rates)):
        volume, grid, target, output = levels[0 if number + 1 == len(cells) else 1]
        wanted = grown(fixed_grid).lattice(cell)
        if displacement is None:
            displacement = volume.new_zeros((1, 3, *wanted.shape))
        else:
            displacement = on_lattice(displacement.detach(), lattice, wanted)
        lattice = wanted
        displacement.requires_grad_()
        optimiser = torch.optim.Adam([displacement], rate)
        schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, count, rate / 10)
        for _ in range(count):
            optimiser.zero_grad()
            moved = tetwarp.torch.deform(
                volume, displacement, geometry=grid, lattice=lattice, output=output, outside="background", background=background
            )
            cost = (moved - target).square().mean() + smoothness * roughness(displacement, lattice.spacing)
            cost.backward()
            optimiser.step()
            schedule.step()
            costs.append(float(cost.detach()))
    return displacement.detach(), lattice, costs


def picture(path, fixed, before, after, costs):
    try:
        import matplotlib
    except ImportError:
        return print("no picture: install matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, panels = pyplot.subplots(2, 3, figsize=(12, 8), constrained_layout=True)
    j = fixed.shape[1] // 2
    for panel, image, title in zip(panels[0], (fixed, before, after), ("fixed", "moving", "moved")):
        panel.imshow(image[:, j], cmap="gray", vmin=-1000, vmax=400, origin="lower", aspect="auto")
        panel.set_title(title)
    for panel, image, title in zip(panels[1], (before, after), ("moving - fixed", "moved - fixed")):
        shown = panel.imshow(image[:, j] - fixed[:, j], cmap="RdBu", vmin=-500, vmax=500, origin="lower", aspect="auto")
        panel.set_title(title)
    figure.colorbar(shown, ax=panels[1, :2], label="HU", location="bottom", shrink=0.6)
    panels[1, 2].semilogy(costs)
    panels[1, 2].set(xlabel="step", ylabel="cost", title="cost")
    for panel in panels.flat[:5]:
        panel.set_axis_off()
    figure.savefig(path, dpi=100)


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("moving", help="a volume file or a folder of DICOM")
    words.add_argument("fixed")
    words.add_argument("-o", "--output", type=pathlib.Path, required=True)
    words.add_argument("--device", default="cpu", help="cpu or cuda (default: %(default)s)")
    words.add_argument("--cells", default="32,16,8", help="voxels between vertices, level by level (default: %(default)s)")
    words.add_argument("--steps", default="40,60,60", help="of each level (default: %(default)s)")
    words.add_argument("--rates", default="1,0.5,0.25", help="mm a step of each level (default: %(default)s)")
    words.add_argument("--smoothness", type=float, default=3e4, help="weight of the smoothness term (default: %(default)s)")
    words.add_argument("--background", type=float, default=-1000, help="of voxels that nothing covers (default: %(default)s)")
    options = words.parse_args()
    cells, steps = ([int(number) for number in text.split(",")] for text in (options.cells, options.steps))
    rates = [float(number) for number in options.rates.split(",")]
    if not len(cells) == len(steps) == len(rates):
        words.error("--cells, --steps and --rates differ in length")
    moving, fixed = straight(options.moving), straight(options.fixed)

    def tensor(volume):
        return torch.from_numpy(numpy.asarray(volume.array, numpy.float32))[None, None].to(options.device)

    begun = time.monotonic()
    of_moving, of_fixed = tensor(moving), tensor(fixed)
    displacement, lattice, costs = register(
        of_moving, moving.geometry, of_fixed, fixed.geometry, cells, steps, rates, options.smoothness, options.background
    )
    seconds = time.monotonic() - begun

    values = displacement[0].permute(1, 2, 3, 0).contiguous().cpu().numpy()
    field = tetwarp.VertexField(lattice, values)
    done = tetwarp.deform(
        tetwarp.Volume(of_moving[0, 0].cpu().numpy(), moving.geometry), field, grid=fixed.geometry, outside="background",
        background=options.background,
    )
    target = of_fixed[0, 0].cpu().numpy()

    def error(array):
        return float(numpy.square(array.astype(numpy.float64) - target).mean())

    options.output.mkdir(parents=True, exist_ok=True)
    tetwarp.write_field(field, options.output / "field.mha", overwrite=True)
    tetwarp.write(done.volume, options.output / "moved.nii.gz", overwrite=True)
    same_grid = moving.geometry == fixed.geometry
    report = {
        "mean_squared_error": error(done.volume.array),
        "mean_squared_error_before": error(of_moving[0, 0].cpu().numpy()) if same_grid else None,
        "inverted": done.report.inverted,
        "jacobian": [done.report.jacobian_min, done.report.jacobian_max],
        "largest_mm": float(numpy.linalg.norm(values, axis=-1).max()),
        "uncovered": done.report.uncovered,
        "seconds": seconds,
        "device": options.device,
    }
    (options.output / "report.json").write_text(json.dumps(report, indent=2) + "\n")
    print(json.dumps(report, indent=2))
    if same_grid:
        picture(options.output / "registration.png", target, of_moving[0, 0].cpu().numpy(), done.volume.array, costs)


if __name__ == "__main__":
    main()
