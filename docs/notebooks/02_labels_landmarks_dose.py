# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# %% [markdown]
# # Labels, landmarks and a dose
#
# A CT rarely comes alone. This page moves labels, points and a dose through the field of the CT, in one call, and
# checks that tissue, volume and dose are still those of before.

# %%
import matplotlib.pyplot as plt
import numpy as np

import tetwarp as tw

ct = tw.phantom((96, 96, 60), spacing=(3.7, 3.7, 5))
field = tw.fields.elastic(ct.geometry, amplitude=16, spacing=70, seed=3, cell_size=4)

# %% [markdown]
# ## Labels
#
# Thresholds stand in for a segmentation: 1 is soft tissue, 2 lung, 3 bone. Voxels
# at the skin and of the table, half air and half matter, pass for lung; labels by a reader would not.

# %%
NAMES = {1: "soft tissue", 2: "lung", 3: "bone"}
values = np.zeros(ct.array.shape, np.uint8)
values[ct.array > -300] = 1
values[(ct.array > -930) & (ct.array < -500)] = 2
values[ct.array > 200] = 3
labels = tw.Volume(values, ct.geometry)

# %% [markdown]
# ## A dose
#
# A dose has a grid of its own, as in a clinic: here 6 mm. This one is a ball of 60 Gy in a lung.

# %%
k, j, i = np.nonzero(values == 2)
lung = ct.geometry.point(np.stack([i, j, k], axis=1))
middle = lung[lung[:, 0] > np.median(lung[:, 0])].mean(axis=0)
size, spacing = (60, 60, 50), np.array([6.0, 6.0, 6.0])
extent = np.array(ct.geometry.size) * ct.geometry.spacing
origin = np.array(ct.geometry.origin) + extent / 2 - np.array(size) * spacing / 2
grid = tw.Geometry(size, tuple(spacing), tuple(origin))
k, j, i = np.indices(grid.shape)
places = grid.point(np.stack([i.ravel(), j.ravel(), k.ravel()], axis=1))
far = np.linalg.norm(places - middle, axis=1)
dose = tw.Volume((60 * np.exp(-((far / 45) ** 4))).reshape(grid.shape).astype(np.float32), grid)

# %% [markdown]
# ## Landmarks
#
# Points in LPS millimetres: 40 voxels whose neighbours within two voxels have the same label, so that a landmark surely
# lies inside of its organ.

# %%
blocks = np.lib.stride_tricks.sliding_window_view(values, (5, 5, 5))
flat = blocks.reshape(*blocks.shape[:3], -1)
deep = (flat.min(axis=3) == flat.max(axis=3)) & (flat[..., 0] > 0)
k, j, i = (index + 2 for index in np.nonzero(deep))
chosen = np.random.default_rng(0).choice(len(k), 40, replace=False)
landmarks = ct.geometry.point(np.stack([i, j, k], axis=1)[chosen])
before_at = values[k[chosen], j[chosen], i[chosen]]

# %% [markdown]
# ## One call for all
#
# Labels go by `vote`: the label that covers most of an output voxel wins, so no value comes up that was not there. The
# dose is interpolated and comes out on the grid of the CT.

# %%
done = tw.deform(
    ct, field,
    with_=[tw.Along(labels, interpolation="vote"), tw.Along(dose, background=0)],
    points=landmarks,
    maps=("coverage", "jacobian"),
)
moved_labels, moved_dose = (volume.array for volume in done.volumes)
assert done.report.inverted == 0
assert set(np.unique(moved_labels)) <= set(np.unique(values))
assert moved_dose.shape == ct.array.shape

# %% [markdown]
# ## What it looks like
#
# Contours are labels, colour is dose, dots are landmarks near the slice.

# %%
row = int(round(ct.geometry.index(middle)[1]))
left, _, low = ct.geometry.origin
frame = (left, left + extent[0], low, low + extent[2])
still = tw.deform(dose, tw.fields.identity(dose.geometry), grid=ct.geometry, outside="background", background=0)

figure, axes = plt.subplots(1, 2, figsize=(13, 5), constrained_layout=True)
sides = (
    ("before", ct.array, values, still.volume.array, landmarks),
    ("after", done.volume.array, moved_labels, moved_dose, done.points),
)
for axis, (title, hu, label, gray, points) in zip(axes, sides):
    axis.imshow(hu[:, row], cmap="gray", vmin=-1000, vmax=600, origin="lower", extent=frame)
    shown = axis.imshow(
        np.ma.masked_less(gray[:, row], 5), cmap="inferno", vmin=0, vmax=60, alpha=0.5, origin="lower", extent=frame
    )
    for number, colour in ((1, "white"), (2, "deepskyblue"), (3, "lime")):
        axis.contour(label[:, row] == number, levels=[0.5], colors=colour, linewidths=0.8, extent=frame)
    near = np.abs(landmarks[:, 1] - ct.geometry.point([0, row, 0])[1]) < 40
    axis.plot(points[near, 0], points[near, 2], "o", color="red", markersize=4)
    axis.set(title=title, xlabel="x, mm", ylabel="z, mm")
figure.colorbar(shown, ax=axes, label="Gy")
plt.show()

# %% [markdown]
# ## Landmarks stay in their organs

# %%
assert done.inside.all()
i, j, k = np.rint(ct.geometry.index(done.points)).astype(int).T
within = ((0 <= i) & (i < 96)) & ((0 <= j) & (j < 96)) & ((0 <= k) & (k < 60))
same = moved_labels[k[within], j[within], i[within]] == before_at[within]
print(f"{same.sum()} of {within.sum()} landmarks in the organ that they were in")
assert within.sum() >= 35 and same.mean() >= 0.95

# %% [markdown]
# ## Volumes of labels
#
# An organ grows and shrinks with the tissue. The Jacobian determinant says by how much at each voxel, so the sum of 1 /
# J over the organ must be its volume of before. An organ that leaves the field of view loses what left; the lungs do
# not.

# %%
covered = done.maps["coverage"].array > 0
jacobian = np.where(covered, done.maps["jacobian"].array, 1)
cc = np.prod(ct.geometry.spacing) / 1000
print("organ          before cc   after cc   after, undone by 1/J")
undone = {}
for number, name in NAMES.items():
    before, after = (values == number).sum() * cc, (moved_labels == number).sum() * cc
    undone[number] = (1 / jacobian)[moved_labels == number].sum() * cc / before
    print(f"{name:12} {before:11.0f} {after:10.0f} {undone[number]:14.1%} of before")
assert abs(undone[2] - 1) < 0.02

# %% [markdown]
# ## Dose
#
# The dose moved with the tissue. Weighted by the tissue of before, 1 / J, its sum over the volume is what it was. The
# mean dose of the lungs is, too, but for what voxels of 4 to 5 mm blur where the dose falls from 60 Gy to nothing.

# %%
weight = 1 / jacobian
total_before, total_after = still.volume.array.sum(), (moved_dose * weight).sum()
print(f"sum of the dose: {total_after / total_before:.2%} of before")
assert abs(total_after / total_before - 1) < 0.02
in_lung = moved_labels == 2
mean_before = still.volume.array[values == 2].mean()
mean_after = np.average(moved_dose[in_lung], weights=weight[in_lung])
print(f"mean dose of the lungs: {mean_before:.2f} Gy before, {mean_after:.2f} Gy after")
assert abs(mean_after / mean_before - 1) < 0.06
assert moved_dose.max() <= dose.array.max()
