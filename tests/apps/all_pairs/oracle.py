# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""The definition of a deformed volume (docs/design/definition.md), tetrahedron by tetrahedron and in exact integers.

Coordinates are whole numbers: vertices of 2^-12 voxel, points and everything else here of 2^-16. A voxel is `doubtful`
where what is right hangs on the last bits of coordinates before they are rounded to 2^-12 voxel.
"""
import numpy as np

from made_fields import FIVE

ONE = 1 << 16
NUDGE = np.array([15, 7, 4])


class Tetrahedra:
    """A forward field, as the corners of all its tetrahedra, in their order."""

    def __init__(self, rest_mm, moved_mm, corners):
        self.rest_mm, self.moved_mm, self.corners = rest_mm, moved_mm, np.array(corners)

    @staticmethod
    def of_lattice(volume):
        size = volume.size
        index = np.stack(np.meshgrid(*[np.arange(n) for n in size], indexing="ij"), -1)
        index = index.transpose(2, 1, 0, 3).reshape(-1, 3)  # i fastest
        rest = index @ volume.affine[:3, :3].T + volume.affine[:3, 3]
        moved = volume.values.transpose(2, 1, 0, 3).reshape(-1, 3).astype(float)
        first = np.stack(np.meshgrid(*[np.arange(n - 1) for n in size], indexing="ij"), -1)
        first = first.transpose(2, 1, 0, 3).reshape(-1, 3)
        corner = np.array([[c & 1, c >> 1 & 1, c >> 2] for c in range(8)])
        vertex = (first[:, None] + corner) @ np.array([1, size[0], size[0] * size[1]])
        five = np.array(FIVE)[first.sum(1) % 2]
        return Tetrahedra(rest, moved, np.take_along_axis(vertex[:, None], five, 2).reshape(-1, 4))


def snap(index):
    """An index rounded to steps of 2^-12 voxel, and whether its last bits decide how it is rounded."""
    steps = index * 4096
    return np.rint(steps).astype(np.int64), (np.abs(np.abs(steps - np.floor(steps)) - 0.5) < 1e-6).any(-1)


def cross(a, b):
    return np.stack([a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1], a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
                     a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]], -1)


def dot(a, b):
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def determinant(a, b, c):
    return dot(a, cross(b, c))


def signs_beside(p, face, signs):
    """Sign of det(a - p, b - p, c - p), taken beside p where it is 0. Integers of any width."""
    a, b, c = (face[..., n, :] - p for n in range(3))
    normal = cross(b - a, c - a)
    found = np.sign(dot(a, normal)).astype(np.int64)
    for axis in range(3):
        found = np.where(found == 0, -np.sign(normal[..., axis]).astype(np.int64) * signs[..., axis], found)
    return found


class Owners:
    """Who owns each voxel of a grid.

    `count` tetrahedra own it, `lowest` is the first of them (-1: none); of rest positions likewise, where asked for."""

    def __init__(self, tetrahedra, grid, at_rest=False):
        self.size, self.corners = np.array(grid.size), tetrahedra.corners
        index_from_mm = np.linalg.inv(grid.affine)
        rest = tetrahedra.rest_mm @ index_from_mm[:3, :3].T + index_from_mm[:3, 3]
        self.rest, doubt_rest = snap(rest)
        self.moved, doubt_moved = snap(rest + tetrahedra.moved_mm @ index_from_mm[:3, :3].T)
        self.is_doubtful = (doubt_rest | doubt_moved)[self.corners].any(1)
        used = np.unique(self.corners)
        self.middle = self.rest[used].min(0) + self.rest[used].max(0)  # doubled, steps
        self.count = np.zeros(self.size, np.int64)
        self.lowest = np.full(self.size, -1, np.int64)
        self.doubtful = np.zeros(self.size, bool)
        at = self.rest if at_rest else self.moved
        self.corner_at = at[self.corners] * 16
        self.find()

    def signs(self, voxel):
        return np.where(voxel * 8192 < self.middle, 1, -1)

    def find(self):
        low, high = self.corner_at.min(1), self.corner_at.max(1)
        begin = np.maximum(low // ONE - 1, 0)
        end = np.minimum(high // ONE + 3, self.size)
        spans = np.maximum(end - begin, 0)
        number = np.repeat(np.arange(len(low)), spans.prod(1))
        within = np.arange(len(number)) - np.repeat(np.cumsum(spans.prod(1)) - spans.prod(1), spans.prod(1))
        wide = spans[number]
        voxel = np.stack([within % wide[:, 0], within // wide[:, 0] % wide[:, 1], within // (wide[:, 0] * wide[:, 1])],
                         -1) + begin[number]
        signs = self.signs(voxel)
        q = voxel * ONE + NUDGE * signs
        near = ((q >= low[number] - ONE // 64) & (q <= high[number] + ONE // 64)).all(1)
        voxel, signs, q, number = voxel[near], signs[near], q[near], number[near]
        owned = self.contains(number, q, signs)
        doubt = self.is_doubtful[number]
        doubt[doubt] = self.is_near_face(number[doubt], q[doubt])
        np.logical_or.at(self.doubtful, tuple(voxel[doubt].T), True)
        voxel, number = voxel[owned], number[owned]
        np.add.at(self.count, tuple(voxel.T), 1)
        order = np.argsort(-number, kind="stable")  # the lowest is written last
        self.lowest[tuple(voxel[order].T)] = number[order]

    def is_near_face(self, number, q):
        """Whether a step of a vertex may take a point into a tetrahedron or out of it."""
        corner = self.corner_at[number]
        w = weights(corner, q)
        local = (corner - corner[:, [3]]) / ONE
        volume = np.abs(determinant(local[:, 0], local[:, 1], local[:, 2]))
        longest = np.linalg.norm(corner[:, :, None] - corner[:, None], axis=-1).max((1, 2)) / ONE
        with np.errstate(divide="ignore", invalid="ignore"):
            margin = np.minimum(4 / 4096 * longest**2 / volume, 1)  # a step over the least height
            clear = (w.min(1) > margin) | (w.min(1) < -margin * (1 + np.abs(w).max(1)))
        return ~clear

    def contains(self, number, q, signs):
        """Whether a tetrahedron contains a point, or what lies beside it, exactly."""
        owned = np.zeros(len(number), bool)
        reach = np.abs(self.corner_at[number] - q[:, None]).max((1, 2)) if len(number) else np.zeros(0)
        for wide, some in ((False, np.flatnonzero(reach < 1 << 19)), (True, np.flatnonzero(reach >= 1 << 19))):
            if not len(some):
                continue
            corner, p, s = self.corner_at[number[some]], q[some], signs[some]
            if wide:  # float leaves out those that are clear
                some, corner, p, s = self.not_clearly_outside(some, corner, p, s)
                corner, p = corner.astype(object), p.astype(object)
            a, b, c, d = (corner[:, n] for n in range(4))
            volume = np.sign(determinant(b - a, c - a, d - a)).astype(np.int64)
            inside = volume != 0
            for face, turn in (((1, 2, 3), 1), ((0, 2, 3), -1), ((0, 1, 3), 1), ((0, 1, 2), -1)):
                inside &= signs_beside(p, corner[:, face], s) == turn * volume
            owned[some] = inside
        return owned

    @staticmethod
    def not_clearly_outside(some, corner, p, s):
        local = (corner - p[:, None]) / ONE
        a, b, c, d = (local[:, n] for n in range(4))
        faces = np.stack([determinant(b, c, d), -determinant(a, c, d), determinant(a, b, d), -determinant(a, b, c)], -1)
        bound = 1e-12 * np.abs(local).max((1, 2))**3
        keep = ~((faces > bound[:, None]).any(1) & (faces < -bound[:, None]).any(1))
        return some[keep], corner[keep], p[keep], s[keep]


def weights(corner, p):
    """Barycentric weights of points, in double from differences that are exact."""
    d = corner[..., 3, :]
    a, b, c = ((corner[..., n, :] - d).astype(float) for n in range(3))
    r = (p - d).astype(float)
    volume = determinant(a, b, c)
    with np.errstate(divide="ignore", invalid="ignore"):
        w = np.stack([determinant(r, b, c), determinant(a, r, c), determinant(a, b, r)], -1) / volume[..., None]
    return np.concatenate([w, 1 - w.sum(-1, keepdims=True)], -1)


def condition(corner, volume):
    """The factor by which a rounding error of the products in Cramer's rule grows."""
    worst = np.zeros(len(corner))
    for reference in range(4):
        e = np.abs(corner[:, [n for n in range(4) if n != reference]] - corner[:, [reference]]).astype(float)
        inside = e.sum(1)
        for a, b, c in ((inside, e[:, 1], e[:, 2]), (e[:, 0], inside, e[:, 2]), (e[:, 0], e[:, 1], inside)):
            permanent = (a[:, 0] * (b[:, 1] * c[:, 2] + b[:, 2] * c[:, 1]) + a[:, 1] *
                         (b[:, 2] * c[:, 0] + b[:, 0] * c[:, 2]) + a[:, 2] * (b[:, 0] * c[:, 1] + b[:, 1] * c[:, 0]))
            worst = np.maximum(worst, permanent)
    with np.errstate(divide="ignore"):
        return worst / np.abs(volume)


class Deformed:
    """Where voxels come from through a forward field. By voxel: `mapped`, `u` (undeformed minus deformed place,
    voxels), its `tolerance` and on which axes it `is_exact`, `jacobian`, `doubtful`."""

    def __init__(self, tetrahedra, grid, outside):
        owners = Owners(tetrahedra, grid)
        self.grid, self.count, self.doubtful = grid, owners.count, owners.doubtful
        self.mapped = owners.lowest >= 0
        shape = tuple(owners.size)
        self.u, self.tolerance = np.zeros((*shape, 3)), np.full(shape, 1e-9)
        self.is_exact = np.ones((*shape, 3), bool)
        self.jacobian = np.full(shape, np.nan)
        voxel = np.argwhere(self.mapped)
        number = owners.lowest[self.mapped]
        corner = owners.corner_at[number]
        vertex_u = (owners.rest - owners.moved)[owners.corners[number]] / 4096.0
        p = voxel * ONE
        at_p, at_q = weights(corner, p), weights(corner, p + NUDGE * owners.signs(voxel))
        least = at_p.min(1)
        w = np.where((least < -1 / 64)[:, None], at_q, at_p)
        local = (corner - corner[:, [3]]).astype(float)
        volume = determinant(local[:, 0], local[:, 1], local[:, 2])
        at_rest = (owners.rest[owners.corners[number]] - owners.rest[owners.corners[number]][:, [3]]) * 16.0
        rest_volume = determinant(at_rest[:, 0], at_rest[:, 1], at_rest[:, 2])
        self.u[self.mapped] = (w[..., None] * vertex_u).sum(1)
        self.is_exact[self.mapped] = (vertex_u == vertex_u[:, [3]]).all(1)  # else zero at a face may be rounded
        reach = np.abs(vertex_u[:, :3] - vertex_u[:, [3]]).max((1, 2))
        with np.errstate(divide="ignore", invalid="ignore"):
            self.jacobian[self.mapped] = volume / rest_volume
        # In float; and a step or two where the last bits of a vertex decide.
        is_doubtful = owners.is_doubtful[number]
        self.tolerance[self.mapped] = 1e-7 * (reach * condition(corner, volume) + 16) + is_doubtful * (
            4 / 4096 * (1 + reach * condition(corner, volume)))
        self.slack_of_jacobian = np.full(shape, 1.0)  # relative: determinants are taken in float
        self.slack_of_jacobian[self.mapped] = 2e-6 + 3e-7 * condition(corner, volume)
        self.sure_jacobian = np.zeros(shape, bool)
        self.sure_jacobian[self.mapped] = ~is_doubtful
        self.doubtful[self.mapped] |= np.abs(least + 1 / 64) < 1e-3
        self.rests = np.zeros(shape, bool)
        if outside == "rest":
            at_rest = Owners(tetrahedra, grid, at_rest=True)
            self.rests = (at_rest.lowest < 0) & ~self.mapped
            self.doubtful |= at_rest.doubtful


class Pulled:
    """Where voxels come from through a pull field, with the members that a forward field has."""

    def __init__(self, field, grid, outside):
        shape = tuple(grid.size)
        voxel = np.stack(np.meshgrid(*[np.arange(n) for n in shape], indexing="ij"), -1)
        index_from_mm = np.linalg.inv(grid.affine)
        field_from_mm = np.linalg.inv(field.affine)
        mm = voxel @ grid.affine[:3, :3].T + grid.affine[:3, 3]
        at = mm @ field_from_mm[:3, :3].T + field_from_mm[:3, 3]
        last, slack = field.size - 1, 1 / 4096
        beyond = ((at < -slack) | (at > last + slack)).any(-1)
        self.doubtful = (np.minimum(np.abs(at + slack), np.abs(at - last - slack)) < 1e-7).any(-1)
        at = np.clip(at, 0, last)
        steps, doubt = snap(np.nan_to_num(field.values.astype(float)) @ index_from_mm[:3, :3].T)
        missing = np.isnan(field.values).any(-1)
        low = np.minimum(np.floor(at).astype(int), np.maximum(last - 1, 0))
        t = at - low
        self.u = np.zeros((*shape, 3))
        gone = np.zeros(shape, bool)
        for corner in np.ndindex(2, 2, 2):
            w = np.prod([t[..., a] if corner[a] else 1 - t[..., a] for a in range(3)], axis=0)
            there = tuple(low[..., a] + corner[a] for a in range(3))
            self.u += w[..., None] * steps[there] / 4096.0
            gone |= missing[there] & (w > 0)
            self.doubtful |= (doubt[there] & (w > 0)) | (missing[there] & (w > 0) & (w < 1e-3))
        self.grid, self.mapped = grid, ~beyond & ~gone
        self.rests = beyond & (outside == "rest")
        self.tolerance = np.full(shape, 1e-6)
        self.is_exact = np.ones((*shape, 3), bool)
        self.u[~self.mapped] = 0
