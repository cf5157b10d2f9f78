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
# # A first deformation
#
# This page makes a CT of a body that never was, bends it by a smooth random field, and checks three things: nothing
# folds, the inverse undoes the map, and a second run gives the same bits.

# %%
import matplotlib.pyplot as plt
import numpy as np

import tetwarp as tw

# %% [markdown]
# ## A volume
#
# A volume is an array, indexed `[k, j, i]`, and a geometry, which says where the voxels lie in millimetres. Values of a
# CT are Hounsfield units: air is near -1000, water 0, bone above 200. With data of your own, write
# `ct = tw.read("folder")`.

# %%
ct = tw.phantom((96, 96, 60), spacing=(3.7, 3.7, 5))
print(ct.geometry, ct.array.dtype, ct.array.min(), "to", ct.array.max(), "HU")

# %% [markdown]
# ## A field
#
# A field says where each vertex of a lattice goes. This one is smooth and random, and its seed decides it. No component
# of a displacement is above 20 mm. Control points lie 60 mm apart, and below 60 / 2.48 = 24 mm such a field cannot
# fold.

# %%
field = tw.fields.elastic(ct.geometry, amplitude=20, spacing=60, seed=7, cell_size=4)
print(field, "largest component:", np.abs(field.displacement).max(), "mm")

# %% [markdown]
# ## Deforming
#
# `deform` moves the volume and makes maps beside it. `coverage` says which voxels got a value, `jacobian` how much the
# tissue at a voxel grew (above 1) or shrank (below 1).

# %%
done = tw.deform(ct, field, maps=("coverage", "jacobian"))
print("inverted tetrahedra:", done.report.inverted)
print("Jacobian determinant:", done.report.jacobian_min, "to", done.report.jacobian_max)
assert done.report.inverted == 0 and done.report.degenerate == 0
assert done.report.jacobian_min > 0

# %% [markdown]
# ## A picture
#
# Left: one coronal slice before. The lines are straight. Middle: the same slice after, and the lines moved by the same
# field; they lie on the tissue that they lay on before, apart from what moved out of the plane. Right: growth in red,
# shrinking in blue.

# %%
j = 48
x, _, z = np.array(ct.geometry.origin)
width, height = ct.geometry.size[0] * ct.geometry.spacing[0], ct.geometry.size[2] * ct.geometry.spacing[2]
frame = (x, x + width, z, z + height)
y = ct.geometry.point([0, j, 0])[1]


def lines():
    """Straight lines of the slice, each as points in LPS mm."""
    inner_x = np.linspace(x + 20, x + width - 20, 120)
    inner_z = np.linspace(z + 20, z + height - 20, 120)
    across = [np.stack([inner_x, np.full(120, y), np.full(120, at)], axis=1) for at in inner_z[::10]]
    upright = [np.stack([np.full(120, at), np.full(120, y), inner_z], axis=1) for at in inner_x[::10]]
    return across + upright


figure, axes = plt.subplots(1, 3, figsize=(14, 4.2), constrained_layout=True)
for axis, volume, title in ((axes[0], ct, "before"), (axes[1], done.volume, "after")):
    axis.imshow(volume.array[:, j], cmap="gray", vmin=-1000, vmax=600, origin="lower", extent=frame)
    axis.set(title=title, xlabel="x, mm", ylabel="z, mm")
for line in lines():
    moved, _ = tw.move_points(line, field, ct.geometry)
    axes[0].plot(line[:, 0], line[:, 2], color="gold", linewidth=0.6)
    axes[1].plot(moved[:, 0], moved[:, 2], color="gold", linewidth=0.6)
shown = axes[2].imshow(
    done.maps["jacobian"].array[:, j], cmap="coolwarm", vmin=0, vmax=2, origin="lower", extent=frame
)
axes[2].set(title="Jacobian determinant", xlabel="x, mm")
figure.colorbar(shown, ax=axes[2])
plt.show()

# %% [markdown]
# ## The inverse undoes the map
#
# `invert` says for each voxel of the output where its tissue came from; NaN where nothing maps. Go there, move forward
# by the field, and you are back at the voxel.

# %%
inverse = tw.invert(field, ct.geometry)
k, j_, i = (index.ravel() for index in np.indices(ct.geometry.shape))
voxels = ct.geometry.point(np.stack([i, j_, k], axis=1))
sources = voxels + inverse.displacement.reshape(-1, 3)
mapped = np.isfinite(sources).all(axis=1)
back, inside = tw.move_points(sources[mapped], field, ct.geometry)
error = np.linalg.norm(back - voxels[mapped], axis=1)[inside]
print(f"{mapped.sum()} voxels, largest error {error.max():.2e} mm")
assert mapped.sum() > 0.9 * mapped.size
assert inside.mean() > 0.999
assert error.max() < 1e-3

# %% [markdown]
# A voxel that is covered has a source. A few voxels at the border have one but are not covered: the lattice reaches a
# little over the volume, and their source lies there.

# %%
covered = done.maps["coverage"].array.ravel() > 0
assert mapped[covered].all()
index, last = ct.geometry.index(sources[mapped & ~covered]), np.array(ct.geometry.size) - 1
beyond = ((index < 0) | (index > last)).any(axis=1)
print(f"{covered.sum()} voxels covered; {len(index)} have a source beyond the outermost voxel centres")
assert beyond.all()

# %% [markdown]
# ## The same bits twice
#
# The result depends on the volume and the field alone, not on the number of threads.

# %%
again = tw.deform(ct, field, threads=1)
assert again.volume.array.tobytes() == done.volume.array.tobytes()
print("same bits with one thread")

# %% [markdown]
# ## Writing
#
# The suffix decides the format. A volume that came from a DICOM series can go to a folder, as a derived series.

# %%
tw.write(done.volume, "deformed.nii.gz")
assert (tw.read("deformed.nii.gz").array == done.volume.array).all()
