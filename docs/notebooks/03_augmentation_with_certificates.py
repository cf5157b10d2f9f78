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
# # Augmentation with certificates
#
# A network for segmentation learns from many deformed copies of a CT and its labels. This page makes such copies, and
# with each a certificate: a dict that says from which seed it came, whether anything folded, how much tissue grew and
# shrank, and how the volumes of the labels changed. Thresholds stand in for a segmentation: what is half air and half
# matter, as the skin and the table, passes for lung.

# %%
import json

import matplotlib.pyplot as plt
import numpy as np

import tetwarp as tw

ct = tw.phantom((96, 96, 60), spacing=(3.7, 3.7, 5))
values = np.zeros(ct.array.shape, np.uint8)
values[ct.array > -300] = 1
values[(ct.array > -930) & (ct.array < -500)] = 2
values[ct.array > 200] = 3
labels = tw.Volume(values, ct.geometry)
NAMES = {1: "soft tissue", 2: "lung", 3: "bone"}

# %% [markdown]
# ## A field from a seed
#
# The seed decides a twist of up to 8 degrees and a smooth random field of 4 to 16 mm. `compose` makes one field of
# both, the twist first. The second field begins where the first one ends, so its lattice must reach farther: it is made
# on a grid with 16 voxels more on each side.


# %%
room = tw.Geometry(
    tuple(n + 32 for n in ct.geometry.size), ct.geometry.spacing, tuple(ct.geometry.point([-16, -16, -16]))
)


def field_of(seed):
    draw = np.random.default_rng(seed)
    twist = tw.fields.twist(ct.geometry, angle=draw.uniform(-8, 8), cell_size=4)
    elastic = tw.fields.elastic(
        room, amplitude=draw.uniform(4, 16), spacing=draw.uniform(60, 90), seed=seed, cell_size=4
    )
    return tw.compose(twist, elastic)


# %% [markdown]
# ## A copy and its certificate
#
# Folds are tetrahedra that are inverted or without volume. A fold shows the same tissue twice, or nowhere: no breath
# does that to a patient.


# %%
def certificate_of(seed, done):
    after = done.volumes[0].array
    change = {name: float((after == n).sum() / (values == n).sum() - 1) for n, name in NAMES.items()}
    return {
        "seed": seed,
        "folds": done.report.inverted + done.report.degenerate,
        "jacobian": [done.report.jacobian_min, done.report.jacobian_max],
        "volume_change": change,
    }


def augment(seed, field=None):
    done = tw.deform(
        ct, field or field_of(seed), outside="background", with_=[tw.Along(labels, interpolation="vote", background=0)]
    )
    return done.volume, done.volumes[0], certificate_of(seed, done)


copies = [augment(seed) for seed in range(1, 7)]
print(json.dumps(copies[0][2], indent=2))

# %% [markdown]
# ## All of them
#
# No copy folds, no label comes up that was not there, and no two copies are the same.

# %%
print("seed  folds  Jacobian        " + "".join(f"{name:>13}" for name in NAMES.values()))
for _, label, certificate in copies:
    low, high = certificate["jacobian"]
    change = "".join(f"{certificate['volume_change'][name]:13.1%}" for name in NAMES.values())
    print(f"{certificate['seed']:4}  {certificate['folds']:5}  {low:.3f} to {high:.3f}  {change}")
    assert certificate["folds"] == 0 and low > 0
    assert set(np.unique(label.array)) <= set(np.unique(values))
    assert all(abs(part) < 0.4 for part in certificate["volume_change"].values())
assert len({image.array.tobytes() for image, _, _ in copies}) == len(copies)

# %% [markdown]
# One axial slice of each copy, with the contours of its labels. The patient's front is up.

# %%
figure, axes = plt.subplots(2, 3, figsize=(12, 8), constrained_layout=True)
for axis, (image, label, certificate) in zip(axes.ravel(), copies):
    axis.imshow(image.array[35], cmap="gray", vmin=-1000, vmax=600)
    for number, colour in ((1, "gold"), (2, "deepskyblue"), (3, "lime")):
        axis.contour(label.array[35] == number, levels=[0.5], colors=colour, linewidths=0.8)
    low, high = certificate["jacobian"]
    axis.set_title(f"seed {certificate['seed']}: Jacobian {low:.2f} to {high:.2f}", fontsize=10)
    axis.axis("off")
plt.show()

# %% [markdown]
# ## A certificate can be checked
#
# Who has the seed makes the copy again, on any machine, and gets the same bits and the same certificate.

# %%
image, label, certificate = augment(4)
assert image.array.tobytes() == copies[3][0].array.tobytes()
assert label.array.tobytes() == copies[3][1].array.tobytes()
assert certificate == copies[3][2]
print("seed 4 again: same bits")

# %% [markdown]
# ## A certificate can say no
#
# A bubble of a strength above 3 throws its middle over what lies around it, and turns a shell between them inside out.
# The certificate says so, and the map `folds` says where: it counts the tetrahedra that claim a voxel.

# %%
bad = tw.fields.bubble(ct.geometry, radius=120, strength=8, cell_size=2)
_, _, refused = augment(0, bad)
print("folds:", refused["folds"], " Jacobian:", refused["jacobian"])
assert refused["folds"] > 0 and refused["jacobian"][0] < 0

done = tw.deform(ct, bad, outside="background", maps=("folds",))
assert done.report.multiply_owned > 0
k = int(np.argmax((done.maps["folds"].array > 1).sum(axis=(1, 2))))
figure, axes = plt.subplots(1, 2, figsize=(10, 4.5), constrained_layout=True)
axes[0].imshow(done.volume.array[k], cmap="gray", vmin=-1000, vmax=600)
axes[0].set_title("a deformation to throw away")
shown = axes[1].imshow(done.maps["folds"].array[k], cmap="magma", vmin=0)
axes[1].set_title("claims on each voxel; one is right")
figure.colorbar(shown, ax=axes[1])
plt.show()
