# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What a volume's voxels must be, given where each comes from: an own sampler, in double, with bounds of what rounding
to float may change (docs/design/definition.md, "What the voxel gets")."""
import itertools

import numpy as np

from volumes import NUMPY

EXACT_TYPES = [np.dtype(NUMPY[kind]) for kind in ("i32", "u32", "f64")]  # computed in double


class Expected:
    """By voxel: `covered`, `value` within `slack` (before rounding to the type), `padded`, and `doubtful`, where either
    may be right."""

    def __init__(self, deformed, source, interpolation, background, padding=None):
        grid, self.kind, self.background = deformed.grid, source.values.dtype, background
        shape = tuple(grid.size)
        voxel = np.stack(np.meshgrid(*[np.arange(n) for n in shape], indexing="ij"), -1)
        matrix = np.linalg.inv(source.affine) @ grid.affine
        self.is_same_grid = np.allclose(matrix, np.eye(4), atol=1e-9)
        if self.is_same_grid:
            matrix = np.eye(4)
        self.is_exact = deformed.is_exact & self.is_same_grid
        place = (voxel + deformed.u) @ matrix[:3, :3].T + matrix[:3, 3]
        self.slack_of_place = deformed.tolerance * np.abs(matrix[:3, :3]).sum(1).max() + 1e-7  # kept in float
        if source.slices is not None:
            place[..., 2] = self.uneven(place[..., 2], source.slices)
            self.slack_of_place = self.slack_of_place * 2
        slack = self.slack_of_place[..., None]
        last = source.size - 1
        inside = ((place >= -0.5) & (place <= last + 0.5)).all(-1)
        at_end = (np.minimum(np.abs(place + 0.5), np.abs(place - last - 0.5)) < slack + 1e-7).any(-1)
        mapped = deformed.mapped | deformed.rests
        self.covered = mapped & inside
        self.doubtful = deformed.doubtful | (mapped & at_end)
        place = np.clip(place, 0, last)
        self.padded = np.zeros(shape, bool)
        values = source.values.astype(float)
        if values.ndim == 3:
            values = values[..., None]
        found = [self.sample(values[..., n], place, interpolation, padding) for n in range(values.shape[3])]
        self.value, self.slack = (np.stack(part, -1) for part in zip(*found))

    @staticmethod
    def uneven(place, slices):
        low = np.clip(np.searchsorted(slices, place, side="right") - 1, 0, len(slices) - 2)
        return low + (place - slices[low]) / (slices[low + 1] - slices[low])

    def sample(self, values, place, interpolation, padding):
        last = np.array(values.shape) - 1
        base = np.minimum(np.floor(place), np.maximum(last - 1, 0)).astype(int)
        t = place - base
        reach = (-1, 3) if interpolation == "cubic" else (0, 2)
        steps = list(itertools.product(range(*reach), repeat=3))
        corners = np.stack([values[tuple(np.clip(base[..., a] + s[a], 0, last[a]) for a in range(3))] for s in steps])
        weights = self.weights(steps, t, interpolation)
        little = 1e-5 + 3 * self.slack_of_place
        is_none = np.isnan(corners)
        corners = np.where(is_none, 0, corners)
        becomes_none = (is_none & (np.abs(weights) > little)).any(0)
        self.doubtful |= self.may_meet(np.isnan(values), base, t, interpolation, little) & ~becomes_none
        if interpolation == "cubic":  # weights that rounding keeps from being 0 would make NaN of NaN
            self.doubtful |= is_none.any(0)
        nearest = np.floor(place + 0.5).astype(int)
        is_half = (np.abs(place + 0.5 - np.rint(place + 0.5)) < self.slack_of_place[..., None] + 1e-7).any(-1)
        at_nearest = values[tuple(np.minimum(nearest[..., a], last[a]) for a in range(3))]
        spread = corners.max(0) - corners.min(0)
        unit = 1e-13 if self.kind in EXACT_TYPES else 5e-7
        unit *= 3 if interpolation == "cubic" else 1
        slack = 8 * spread * self.slack_of_place + unit * np.abs(corners).max(0)
        if interpolation == "nearest":
            self.doubtful |= is_half & ((spread > 0) | is_none.any(0))
            value, slack = at_nearest, np.zeros_like(slack)
        elif interpolation == "vote":
            value, close = self.vote(corners, weights, 1e-4 + 8 * self.slack_of_place)
            self.doubtful |= close | becomes_none
            slack = np.zeros_like(slack)
        else:
            value = np.where(becomes_none, np.nan, (weights * corners).sum(0))
        if padding is None:
            return value, slack
        is_padding = corners == padding
        with_weight = (is_padding & (np.abs(weights) > little)).any(0)
        self.doubtful |= self.may_meet(values == padding, base, t, interpolation, little) & ~with_weight
        self.doubtful |= with_weight & is_half
        if interpolation == "nearest":
            with_weight = at_nearest == padding
        self.padded |= with_weight & (at_nearest == padding)
        return np.where(with_weight, at_nearest, value), np.where(with_weight, 0, slack)

    def may_meet(self, marked, base, t, interpolation, little):
        """Whether a marked voxel may have a weight that rounding makes: on one grid a weight of zero is exact on an axis
        along which all vertices move alike; else a place on a voxel may be rounded to either side of it."""
        last, width = np.array(marked.shape) - 1, 2 if interpolation == "cubic" else 1
        met = np.zeros(t.shape[:-1], bool)
        if not marked.any():
            return met
        for step in itertools.product(range(-width, width + 2), repeat=3):
            far = np.abs(t - np.array(step))
            reached = (far < width) & ((far == 0) | (far % 1 != 0))
            reached |= ~self.is_exact & (far <= width + little[..., None])
            met |= reached.all(-1) & marked[tuple(np.clip(base[..., a] + step[a], 0, last[a]) for a in range(3))]
        return met

    @staticmethod
    def weights(steps, t, interpolation):
        def along(step, f):
            if interpolation != "cubic":
                return f if step else 1 - f
            return {-1: ((-0.5 * f + 1) * f - 0.5) * f, 0: (1.5 * f - 2.5) * f * f + 1,
                    1: ((-1.5 * f + 2) * f + 0.5) * f, 2: (0.5 * f - 0.5) * f * f}[step]
        return np.stack([along(s[0], t[..., 0]) * along(s[1], t[..., 1]) * along(s[2], t[..., 2]) for s in steps])

    @staticmethod
    def vote(corners, weights, rounding):
        totals = np.stack([(weights * (corners == one)).sum(0) for one in corners])
        most = totals.max(0)
        value = np.where(totals >= most - 1e-12, corners, np.inf).min(0)
        close = ((totals > most - rounding) & (corners != value)).any(0)
        return value, close

    def preserve_mass(self, jacobian):
        """Replaces values that are covered and no padding by (HU + 1000) / |J| - 1000."""
        size = np.abs(jacobian)[..., None]
        scales = (self.covered & ~self.padded)[..., None] & (size > 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            mass = (self.value + 1000) / size
            slack = self.slack / size + np.abs(mass) * 4e-6 + np.abs(self.value) * 2e-7 / size
        self.value = np.where(scales, mass - 1000, self.value)
        self.slack = np.where(scales, slack, self.slack)

    def shown(self):
        return np.where(self.covered[..., None], self.value, self.background)

    def differences(self, found):
        """@return  voxels that are not as expected, of those that are not doubtful"""
        found = found.reshape(*self.covered.shape, -1).astype(float)
        value, slack = self.value, self.slack
        if self.kind.kind in "iu":
            limits = np.iinfo(self.kind)
            value = np.clip(value, limits.min, limits.max)
            slack = slack + np.where(slack > 0, 0.5, 0)  # what was copied is not rounded
        else:
            slack = slack + (1e-6 if self.kind == np.dtype("<f4") else 1e-12) * np.abs(value) * (slack > 0)
        with np.errstate(invalid="ignore"):
            same = (np.abs(found - value) <= slack) | (np.isnan(found) & np.isnan(value))
            wrong = ~same.all(-1) & self.covered
            wrong |= ((found != self.background).any(-1)) & ~self.covered
        return wrong & ~self.doubtful
