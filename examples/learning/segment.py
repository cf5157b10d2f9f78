#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What random deformations are good for: a small U-Net, trained on one phantom with and without them.

    segment.py -o FOLDER [--steps 300] [--tests 6] [--device cuda]

One phantom and its labels (left lung, right lung, heart, spine) are all that there is to learn from. Tested is on bodies that neither
training has seen: the phantom breathing, swollen and turned by other seeds and families. Noise is added to all. Makes FOLDER/curves.csv and, with
matplotlib, FOLDER/curves.png: the mean Dice of the labels over the steps of training. Takes eight minutes on two cores. Needs PyTorch.
"""
import argparse
import csv
import pathlib

import numpy
import tetwarp
import torch
from tetwarp import augmentation

SIZE, SPACING = (48, 48, 32), (8.0, 8.0, 10.0)
CLASSES = 5
HEART = -15.0  # mm, where its middle lies along z


def labels_of(volume):
    """1 left lung, 2 right lung, 3 heart, 4 spine of the phantom, by thresholds of its clean voxels and by place."""
    hu, grid = volume.array, volume.geometry
    k, j, i = numpy.meshgrid(*(numpy.arange(n) for n in grid.shape), indexing="ij")
    x, y, z = numpy.moveaxis(grid.point(numpy.stack([i, j, k], -1)), -1, 0)
    across, deep = x / 200, y / 200  # of half the phantom's width and depth
    inside = across**2 / 0.48 + deep**2 / 0.24 < 1
    lung = (hu < -500) & inside & (numpy.abs(across) > 0.08)
    labels = numpy.zeros(hu.shape, numpy.uint8)
    labels[lung & (x > 0)] = 1
    labels[lung & (x < 0)] = 2
    heart = (across - 0.13) ** 2 / 0.3**2 + (deep + 0.15) ** 2 / 0.25**2 + ((z - HEART) / 70) ** 2 < 1
    labels[heart & (hu > -200)] = 3
    labels[(hu > 120) & (numpy.abs(across) < 0.12) & (deep > 0.08) & (deep < 0.5)] = 4
    return labels


def tensors(image, labels, seed, device):
    """An image with noise, (1, 1, D, H, W), scaled, and its labels, (1, D, H, W)."""
    noise = numpy.random.default_rng(seed).normal(0, 150, image.array.shape)
    scaled = (image.array.astype(numpy.float32) + noise.astype(numpy.float32)) / 1000
    return torch.from_numpy(scaled)[None, None].to(device), torch.from_numpy(labels.array.astype(numpy.int64))[None].to(device)


def block(inputs, outputs):
    layers = []
    for channels in (inputs, outputs):
        layers += [torch.nn.Conv3d(channels, outputs, 3, padding=1), torch.nn.InstanceNorm3d(outputs), torch.nn.ReLU()]
    return torch.nn.Sequential(*layers)


class UNet(torch.nn.Module):
    """Ronneberger et al. 2015 in three dimensions, two levels down."""

    def __init__(self, width=12):
        super().__init__()
        self.first, self.second, self.bottom = block(1, width), block(width, 2 * width), block(2 * width, 4 * width)
        self.up_second, self.up_first = block(6 * width, 2 * width), block(3 * width, width)
        self.last = torch.nn.Conv3d(width, CLASSES, 1)

    def forward(self, image):
        def down(x):
            return torch.nn.functional.max_pool3d(x, 2)

        def up(x):
            return torch.nn.functional.interpolate(x, scale_factor=2, mode="nearest")

        first = self.first(image)
        second = self.second(down(first))
        bottom = self.bottom(down(second))
        second = self.up_second(torch.cat([up(bottom), second], 1))
        return self.last(self.up_first(torch.cat([up(second), first], 1)))


def cost(scores, labels):
    """Cross entropy and one minus the mean soft Dice: rare labels count as much as frequent ones."""
    shares = scores.softmax(1)
    wanted = torch.nn.functional.one_hot(labels, CLASSES).movedim(-1, 1).to(shares)
    both, either = (shares * wanted).sum((0, 2, 3, 4)), (shares + wanted).sum((0, 2, 3, 4))
    return torch.nn.functional.cross_entropy(scores, labels) + 1 - (2 * both / (either + 1))[1:].mean()


def dice(scores, labels):
    """Mean Dice of the labels above 0."""
    found = scores.argmax(1)
    values = []
    for label in range(1, CLASSES):
        a, b = found == label, labels == label
        values.append(2 * float((a & b).sum()) / max(1, int(a.sum() + b.sum())))
    return float(numpy.mean(values))


def unseen(image, labels, count, device):
    """Bodies of other families than the training draws, and of seeds that it does not use."""
    families = [augmentation.Breathing((15, 40)), augmentation.Swelling((80, 150), (0.5, 1.5)), augmentation.ElasticAffine(angle=(-25, 25), scale=(0.8, 1.2))]
    bodies = []
    for n in range(count):
        warp = augmentation.draw(families[n % len(families)], image.geometry, seed=1_000_000 + n, cell_size=2)
        done = warp.deform(image, labels=[labels], backgrounds=[-1000])
        bodies.append(tensors(done.images[0], done.labels[0], seed=2_000_000 + n, device=device))
    return bodies


def train(image, labels, bodies, steps, deforms, device):
    """Mean Dice over the unseen bodies, every twentieth step."""
    torch.manual_seed(0)
    network = UNet().to(device)
    optimiser = torch.optim.Adam(network.parameters(), 3e-3)
    family = augmentation.ElasticAffine(amplitude=(2, 20), spacing=(60, 120), angle=(-15, 15), scale=(0.85, 1.15), shift=(-15, 15))
    curve = []
    for step in range(steps + 1):
        if step % 20 == 0:
            network.eval()
            with torch.no_grad():
                curve.append((step, float(numpy.mean([dice(network(x), y) for x, y in bodies]))))
            network.train()
        given = (image, labels)
        if deforms:
            warp = augmentation.draw(family, image.geometry, seed=augmentation.seed_of(0, step, "phantom"), cell_size=2)
            done = warp.deform(image, labels=[labels], backgrounds=[-1000])
            given = (done.images[0], done.labels[0])
        x, y = tensors(*given, seed=step, device=device)
        optimiser.zero_grad()
        cost(network(x), y).backward()
        optimiser.step()
    return curve


def plot(curves, path):
    try:
        import matplotlib
    except ImportError:
        return print("no plot: install matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(7, 4.5), constrained_layout=True)
    for name, curve in curves.items():
        axes.plot(*zip(*curve), label=name)
    axes.set(xlabel="step", ylabel="mean Dice on unseen bodies", ylim=(0, 1), title="One phantom to learn from")
    axes.legend(loc="lower right")
    axes.grid(alpha=0.3)
    figure.savefig(path, dpi=120)


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("-o", "--output", type=pathlib.Path, required=True)
    words.add_argument("--steps", type=int, default=300, help="of training (default: %(default)s)")
    words.add_argument("--tests", type=int, default=6, help="unseen bodies (default: %(default)s)")
    words.add_argument("--device", default="cpu", help="cpu or cuda (default: %(default)s)")
    options = words.parse_args()
    image = tetwarp.phantom(SIZE, spacing=SPACING)
    labels = tetwarp.Volume(labels_of(image), image.geometry)
    bodies = unseen(image, labels, options.tests, options.device)
    curves = {}
    for name, deforms in (("without deformations", False), ("with deformations", True)):
        curves[name] = train(image, labels, bodies, options.steps, deforms, options.device)
        print(f"{name}: Dice {curves[name][-1][1]:.3f} after {options.steps} steps")
    options.output.mkdir(parents=True, exist_ok=True)
    with open(options.output / "curves.csv", "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["step", *curves])
        for rows in zip(*curves.values()):
            table.writerow([rows[0][0], *(f"{value:.4f}" for _, value in rows)])
    plot(curves, options.output / "curves.png")


if __name__ == "__main__":
    main()
