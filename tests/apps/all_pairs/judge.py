# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What must hold of a case: an oracle for what it computes, and what is so for every case."""
import copy
import json
import pathlib
import re

import numpy as np
import made_fields
import volumes
from expected import Expected
from oracle import Deformed, Pulled, Tetrahedra
from table import FIELDS


class Wrong(Exception):
    """What a case did that it must not do."""


def check(condition, text):
    if not condition:
        raise Wrong(text)


def contents(folder):
    """Bytes of every file below a folder, hidden ones too; empty folders as None."""
    found = {}
    for path in sorted(pathlib.Path(folder).rglob("*")):
        name = str(path.relative_to(folder))
        if path.is_dir():
            if not any(path.iterdir()):
                found[name + "/"] = None
        else:
            found[name] = path.read_bytes()
    return found


def check_files(folder, names):
    found = {path.name for path in pathlib.Path(folder).iterdir()}
    check(found == names, f"files {sorted(found)}, expected {sorted(names)}")


def check_refusal(result, rules, folder):
    check(result.status in {rule.status for rule in rules},
          f"status {result.status}, expected {' or '.join(map(str, rules))}; it said {result.error!r}")
    check(result.error.count("\n") == 1 and result.error.startswith("tetwarp: error: "),
          f"a refusal is one line of error, not {result.error!r}")
    check(not result.output, f"a refusal with an output, {result.output!r}")
    check(any(re.search(rule.says, result.error) for rule in rules),
          f"{result.error!r} is none of {[str(rule) for rule in rules]}")
    left = sorted(contents(folder))
    check(left == ["out/"], f"a refusal left {left}")


def without_backends(document):
    """A report or sidecar without where its volume, and the field of a simulation, were made."""
    document.pop("backend", None)
    document.get("field", {}).get("simulation", {}).pop("backend", None)
    return document


def without_times(report):
    report = without_backends(json.loads(report))
    for key in ("stages", "total_seconds", "threads", "memory", "paths"):
        report.pop(key, None)
    return report


def check_alike(one, other, how):
    """Compares two runs whose command lines differ in what must not matter."""
    check(one.keys() == other.keys(), f"other files {how}: {sorted(one.keys() ^ other.keys())}")
    for name, data in one.items():
        if name == "r.json":
            check(without_times(data) == without_times(other[name]), f"another report {how}")
        else:
            check(data == other[name], f"other bytes of {name} {how}")


def grid_of(affine, size):
    return volumes.Volume(np.zeros(size, "u1"), affine)


def near(expected, found, what, tolerance=1e-3):
    check(np.abs(expected - found).max() < tolerance, f"{what} at {found.tolist()}, expected {expected.tolist()}")


class Truth:
    """The run that makes all maps of a case, as raw files, compared with the oracle."""

    def __init__(self, world, case, folder):
        self.world, self.case, self.folder = world, case, pathlib.Path(folder)
        self.kind = FIELDS[case["field"]]
        self.source = world.input(case)[1]
        self.output = volumes.read(self.folder / "out/v.nrrd")
        self.inverse = volumes.read(self.folder / "out/i.mha").values
        self.coverage = volumes.read(self.folder / "out/c.mha").values
        self.is_pull = self.kind == "pull"
        if not self.is_pull:
            self.jacobian = volumes.read(self.folder / "out/j.nrrd").values
            self.folds = volumes.read(self.folder / "out/f.nii").values
        self.grid = grid_of(self.output.affine, self.output.size)
        self.sidecar = json.loads((self.folder / "out/v.nrrd.json").read_text())
        self.background = self.sidecar["options"]["background"]

    def check_grid(self):
        """--grid same and FILE exactly; fit: the input's, grown by whole voxels."""
        wanted = self.case["grid"]
        if wanted == "fit":
            own = self.world.grid(self.case["input"])
            near(own.affine[:3, :3], self.grid.affine[:3, :3], "axes of the grown grid", 1e-5)
            shift = np.linalg.inv(own.affine)[:3, :3] @ (own.affine[:3, 3] - self.grid.affine[:3, 3])
            near(np.rint(shift), shift, "origin of the grown grid", 1e-3)
            check((np.rint(shift) >= 0).all() and (self.grid.size - np.rint(shift) >= own.size).all(),
                  "the grown grid does not hold the input's")
            return self.check_fit(own, np.rint(shift).astype(int))
        own = {"same": lambda: self.world.grid(self.case["input"]), "file": lambda: self.world.along["grid"],
               "series": lambda: self.world.inputs.get("dicom")[1]}[wanted]()
        near(own.affine, self.grid.affine, "grid")
        check((own.size == self.grid.size).all(), f"{self.grid.size} voxels, expected {own.size}")

    def check_fit(self, own, before):
        field = self.tetrahedra()
        used = np.unique(field.corners)
        index_from_mm = np.linalg.inv(own.affine)
        at = (field.rest_mm + field.moved_mm)[used] @ index_from_mm[:3, :3].T + index_from_mm[:3, 3]
        after = self.grid.size - before - 1
        tight = [np.minimum(np.floor(at.min(0) + 0.01), 0), np.maximum(np.ceil(at.max(0) - 0.01), own.size - 1)]
        wide = [np.minimum(np.floor(at.min(0)), 0), np.maximum(np.ceil(at.max(0)), own.size - 1)]  # with rounding
        fits = (wide[0] <= -before) & (-before <= tight[0]) & (tight[1] <= after) & (after <= wide[1])
        check(fits.all(), f"--grid fit goes from {-before} to {after}, the deformed vertices from {at.min(0)} to "
              f"{at.max(0)}")

    def tetrahedra(self):
        """The field as files of its own say it, or as --write-field does where the program makes it."""
        name, path = self.case["field"], self.world.path
        if name in ("lattice", "folded"):
            return Tetrahedra.of_lattice(volumes.read(path(name + (".nrrd" if name == "lattice" else ".mha"))))
        if self.kind == "mesh":
            count, step, amplitude, seed, rests = {"mesh": (5, 13.5, 1.5, 5, False), "island": (4, 6.0, 1.5, 7, True),
                                                   "two-meshes": (5, 13.5, 1.25, 6, False)}[name]
            mesh = made_fields.Mesh(count, step, amplitude, seed, rests)
            moved = (mesh.rest + mesh.moved) - mesh.rest if name == "two-meshes" else mesh.moved
            return Tetrahedra(mesh.rest, moved.astype("<f4").astype(float), mesh.tetrahedra)
        written = self.folder / "out/w.mha"
        if written.exists():
            return Tetrahedra.of_lattice(volumes.read(written))
        return Tetrahedra(*volumes.read_mesh(self.folder / "out/w.vtk"))

    def check_formula(self):
        """Vertices of a formula or transform against the formula."""
        name = self.case["field"]
        if name not in ("shift", "wave", "affine", "identity"):
            return
        field = volumes.read(self.folder / "out/w.mha")
        points = made_fields.points_of(field.size, field.affine)
        if name == "shift":
            expected = np.broadcast_to(self.source.affine[:3, :3] @ [1, -2, 1], points.shape)
        elif name == "wave":
            middle = self.source.affine[:3, :3] @ ((self.source.size - 1) / 2) + self.source.affine[:3, 3]
            expected = np.zeros(points.shape)
            expected[..., 0] = 2 * np.sin(2 * np.pi * (points[..., 2] - middle[2]) / 24)
        elif name == "affine":
            matrix = made_fields.rotation(2, -3, 4) * 1.03
            expected = (points - made_fields.MIDDLE) @ matrix.T + made_fields.MIDDLE + [0.4, -0.3, 0.2] - points
        else:
            expected = np.zeros(points.shape)
        near(expected.ravel(), field.values.ravel(), f"vertices of {name}", 1e-4)

    def deformed(self, grid):
        outside = self.case["outside"]
        if self.case["grid"] == "fit" and outside == "refuse":
            outside = "background"
        if not self.is_pull:
            return Deformed(self.tetrahedra(), grid, outside)
        if self.case["field"] == "pull-affine":
            points = made_fields.points_of(self.grid.size, self.grid.affine)
            matrix = made_fields.rotation(2, -3, 4) * 1.03
            to = (points - made_fields.MIDDLE) @ matrix.T + made_fields.MIDDLE + [0.4, -0.3, 0.2]
            return Pulled(volumes.Volume((to - points).astype("<f4"), self.grid.affine), grid, outside)
        return Pulled(volumes.read(self.world.path({"pull": "pull.nrrd", "gaps": "gaps.mha"}[self.case["field"]])),
                      grid, outside)

    def checks(self):
        """The checks, in the order in which they run. The first one makes what all others need."""
        if self.kind == "short":
            return [self.check_grid, self.check_short]
        of_forward = [] if self.is_pull else [self.check_folds, self.check_jacobian, self.check_range]
        return [self.make_model, self.check_grid, self.check_formula, self.check_values, self.check_inverse,
                *of_forward, self.check_report]

    def make_model(self):
        self.model = self.deformed(self.grid)
        self.sure = ~self.model.doubtful
        least = 0.3 if "scenario" in self.kind else 0.8  # simulations move by whole 2^-16 mm, often half a step
        check(self.sure.mean() > least, f"only {self.sure.mean():.0%} of the voxels can be judged")

    def check_values(self):
        padding = getattr(self.source, "padding", None)
        expected = Expected(self.model, self.source, self.case["interpolation"], self.background, padding)
        self.none(~expected.doubtful & (expected.covered != (self.coverage == 1)), "--coverage")
        self.none(expected.differences(self.output.values), "values", self.output.values, expected.shown())

    def check_folds(self):
        self.none(self.sure & (self.folds != self.model.count), "--folds", self.folds, self.model.count)

    def check_inverse(self):
        model, sure = self.model, self.sure
        mm = model.u @ self.grid.affine[:3, :3].T
        slack = model.tolerance * np.abs(self.grid.affine[:3, :3]).sum(1).max() + 2e-6
        with np.errstate(invalid="ignore"):
            wrong = (np.abs(self.inverse - mm) > slack[..., None] + 2e-7 * np.abs(mm)).any(-1)
        self.none(sure & model.mapped & (wrong | np.isnan(self.inverse).any(-1)), "--inverse", self.inverse, mm)
        self.none(sure & ~model.mapped & ~model.rests & ~np.isnan(self.inverse).all(-1), "--inverse where nothing maps")
        self.none(sure & model.rests & (self.inverse != 0).any(-1), "--inverse of what rests outside the field")

    def check_jacobian(self):
        model, sure = self.model, self.sure
        with np.errstate(invalid="ignore"):
            wrong = ~(np.abs(self.jacobian - model.jacobian) <= model.slack_of_jacobian * np.abs(model.jacobian))
        wrong &= sure & model.sure_jacobian & np.isfinite(model.jacobian)
        self.none(wrong, "--jacobian", self.jacobian, model.jacobian)
        self.none(sure & ~model.mapped & ~model.rests & ~np.isnan(self.jacobian), "--jacobian where nothing maps")
        self.none(sure & model.rests & (self.jacobian != 1), "--jacobian of what rests outside the field")

    def check_range(self):
        low, high = self.sidecar["report"]["jacobian"]
        check(low is not None and high is not None, f"the report has no range of the Jacobian, {[low, high]}")
        found = self.jacobian[np.isfinite(self.jacobian) & self.model.mapped]
        check(found.size == 0 or (low <= found.min() and found.max() <= high),
              f"the report's Jacobian is {low} to {high}, that of the map {found.min()} to {found.max()}")

    def check_report(self):
        report = self.sidecar["report"]
        check(report["covered"] == int(self.coverage.sum()), "the report counts other covered voxels than the map")
        check(report["covered"] + report["uncovered"] == self.coverage.size, "voxels are lost in the report")
        uncovered = self.output.values[self.coverage == 0]
        check((uncovered == np.array(self.background).astype(uncovered.dtype)).all(), "no background where not covered")
        if (self.folder / "out/r.json").exists() and not self.is_pull and report["covered"]:
            trip = json.loads((self.folder / "out/r.json").read_text())["quality"]["round_trip"]
            check(trip["forward_after_inverse"]["points"] > 0, "no point in forward_after_inverse")

    def check_by_inverse(self, folder):
        """Checks the volume that the inverse gives as a pull field, whose samples are rounded to 2^-12 voxel."""
        model = copy.copy(self.model)
        model.tolerance = model.tolerance + 2 / 4096
        padding = getattr(self.source, "padding", None)
        expected = Expected(model, self.source, self.case["interpolation"], self.background, padding)
        coverage, values = volumes.read(folder / "c.mha").values, volumes.read(folder / "v.nrrd").values
        self.none(~expected.doubtful & (expected.covered != (coverage == 1)), "coverage by the inverse")
        self.none(expected.differences(values), "values by the inverse", values, expected.shown())

    def check_short(self):
        """Checks a field that ends before the last column by less than a header rounds: no voxel may be lost."""
        if self.case["grid"] != "same" or self.case["outside"] == "background":
            return
        self.background_of_nothing = self.coverage.size - int(self.coverage.sum())
        leaning = self.case["input"] in ("tilted", "uneven")
        check(leaning or self.background_of_nothing == 0, f"{self.background_of_nothing} voxels are lost")

    def none(self, wrong, what, found=None, expected=None):
        if not wrong.any():
            return
        at = tuple(np.argwhere(wrong)[0])
        values = "" if found is None else f": {found[at]}, expected {expected[at]}"
        raise Wrong(f"{what} wrong at {wrong.sum()} voxels, the first {tuple(int(n) for n in at)}{values}")
