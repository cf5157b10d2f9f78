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
# # Simulate, cut and look
#
# A scenario is one page: what is held, what is moved, what is cut. This page cuts the front wall of a body, pulls the
# lips of the cut apart, and looks at the result from outside and in slices.

# %%
import matplotlib.pyplot as plt
import numpy as np

import tetwarp as tw

ct = tw.phantom((96, 96, 60), spacing=(3.7, 3.7, 5))

# %% [markdown]
# ## The scenario
#
# Places are parts of the body: x from its right to its left, y from front to back, z from the feet up. The same page
# can also be a JSON file. `chainmail` moves a vertex only when the links to its neighbours are spent.

# %%
scenario = {
    "name": "Incision, opened",
    "method": "chainmail",
    "cell_size": 4,
    "tissues": [
        {"name": "bone", "hu": [400, None], "compression": 0, "stretch": 0, "shear": 0},
        {"name": "air", "hu": [None, -950], "compression": 0.9, "stretch": 4, "shear": 4},
        {"name": "lung", "hu": [-950, -400], "compression": 0.4, "stretch": 0.3, "shear": 0.5},
        {"name": "soft tissue", "compression": 0.2, "stretch": 0.3, "shear": 0.4},
    ],
    "hold": [
        {"half_space": {"at": {"body": [0.5, 0.6, 0.5]}, "normal": [0, 1, 0]}},
        {"border": True},
    ],
    "cuts": [
        {
            "name": "midline",
            "swept": {
                "path": [{"body": [0.5, -0.05, 0.2]}, {"body": [0.5, -0.05, 0.7]}],
                "along": [0, 1, 0],
                "depth_mm": 70,
            },
        }
    ],
    "phases": [
        {
            "name": "open",
            "frames": 4,
            "move": [
                {
                    "name": "right lip",
                    "handle": {"at": {"body": [0.44, 0.08, 0.45]}, "radius_mm": 16},
                    "by_mm": [-18, 0, 0],
                },
                {
                    "name": "left lip",
                    "handle": {"at": {"body": [0.56, 0.08, 0.45]}, "radius_mm": 16},
                    "by_mm": [18, 0, 0],
                },
            ],
        }
    ],
    "stop": {"motion_mm": 0.01, "steps": 5000},
}

# %% [markdown]
# ## Playing it
#
# Iterating simulates frame by frame. Each frame has the field that it came to.

# %%
frames = list(tw.simulate(scenario, ct))
for frame in frames:
    print(f"frame {frame.number}, {frame.phase}: {frame.steps} steps, converged: {frame.converged}")
assert len(frames) == 4 and all(frame.converged for frame in frames)

# %% [markdown]
# Vertices along the cut are there twice, one for each lip, so the field has a mesh of tetrahedra in the place of the
# cells that were cut.

# %%
field = frames[-1].field
print(field.mesh)
assert field.mesh is not None and len(field.mesh.tetrahedra) > 0

# %% [markdown]
# ## Deforming by it
#
# The gap of the cut is nobody's: no tetrahedron covers it, and its voxels get the background, which is air. No tissue
# is smeared over it, and nothing folds.

# %%
opened = tw.deform(ct, field, outside="background", maps=("coverage",))
print("inverted:", opened.report.inverted, " voxels without tissue:", opened.report.uncovered)
assert opened.report.inverted == 0 and opened.report.degenerate == 0
gap = opened.maps["coverage"].array == 0
assert 0 < gap.sum() == opened.report.uncovered
assert (opened.volume.array[gap] == -1024).all()

# %% [markdown]
# An axial slice through the handles, frame by frame. The front is up.

# %%
k = int(np.argmax(gap.sum(axis=(1, 2))))
shown = [ct] + [tw.deform(ct, frame.field, outside="background").volume for frame in frames]
figure, axes = plt.subplots(1, len(shown), figsize=(16, 3.6), constrained_layout=True)
for number, (axis, volume) in enumerate(zip(axes, shown)):
    axis.imshow(volume.array[k], cmap="gray", vmin=-1000, vmax=400)
    axis.set_title(f"frame {number}" if number else "before")
    axis.axis("off")
plt.show()

# %% [markdown]
# ## Looking at it
#
# `render` casts rays through the volume. The table `ct-skin` shows the surface, `ct-bone` what lies below it.

# %%
view = {"size": (420, 420), "angle": 25, "elevation": 10}
pictures = {
    "skin, before": tw.render(ct, transfer="ct-skin", **view),
    "skin, opened": tw.render(opened.volume, transfer="ct-skin", **view),
    "bone, opened": tw.render(opened.volume, transfer="ct-bone", **view),
}
figure, axes = plt.subplots(1, 3, figsize=(14, 5), constrained_layout=True)
for axis, (title, picture) in zip(axes, pictures.items()):
    axis.imshow(picture)
    axis.set_title(title)
    axis.axis("off")
plt.show()
assert (pictures["skin, before"] != pictures["skin, opened"]).any()

# %% [markdown]
# ## The same bits twice
#
# ChainMail, deforming and rendering give the same bits for any number of threads. (Mass-spring is the exception: its
# bits may differ from machine to machine.)

# %%
field_again = tw.simulate(scenario, ct, threads=1).field
assert field_again.mesh.displacement.tobytes() == field.mesh.displacement.tobytes()
again = tw.deform(ct, field_again, outside="background", threads=1)
assert again.volume.array.tobytes() == opened.volume.array.tobytes()
print("same bits")
