# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What a case wrote, compared with what its truth says: the volume in any form, maps, what went along, points."""
import csv
import io
import json
import pathlib
import struct

import numpy as np
import pydicom

import made_dicom
import volumes
from expected import Expected
from made_inputs import PADDING
from judge import check, grid_of, near
from oracle import determinant, snap
from table import SERIES

WORDS = [b"zwoelfer", b"aennemarie", b"qx7781", b"19440229", b"1944-02-29"]
SOURCES = [uid.encode() for uid in (made_dicom.STUDY, made_dicom.FRAME, made_dicom.SERIES)] + [b"kappelmann"]


def is_dicom(data):
    return data is not None and data[128:132] == b"DICM"


def check_privacy(files, said, is_deidentified):
    """@param files  from name to bytes; @param said  what the program printed"""
    for name, data in [*files.items(), ("what was printed", said.encode())]:
        text = (data or b"") + name.encode()
        if is_dicom(data):
            if not is_deidentified:
                continue
            text = str(pydicom.dcmread(io.BytesIO(data))).encode() + data
        for word in WORDS + (SOURCES if is_deidentified and name != "what was printed" else []):
            check(word not in text.lower(), f"{word.decode()} stands in {name}")


class Outputs:
    def __init__(self, world, case, folder, truth):
        self.world, self.case, self.folder, self.truth = world, case, pathlib.Path(folder), truth

    def checks(self):
        """The checks, in the order in which they run. None needs another."""
        return [self.check_volume, self.check_maps, self.check_with, self.check_points, self.check_preview,
                self.check_series]

    def check_maps(self):
        for option in ("coverage", "inverse", "jacobian", "folds"):
            if self.case[option] != "none":
                self.check_map(option)

    def check_preview(self):
        if self.case["preview"] != "none":
            data = (self.folder / "preview.png").read_bytes()
            check(data[:8] == b"\x89PNG\r\n\x1a\n" and min(struct.unpack(">II", data[16:24])) > 10, "no picture")
            check(data[-8:-4] == b"IEND", "a picture that does not end")

    def check_volume(self):
        found, truth = volumes.read(self.folder / self.world.output(self.case)), self.truth
        near(truth.grid.affine, found.affine, "grid of the output")
        if self.case["output"] not in SERIES:
            check(found.values.dtype == truth.source.values.dtype, f"voxels of type {found.values.dtype}")
        if self.case["mass"] == "none" or truth.kind == "short":
            if truth.kind == "short" and self.case["mass"] != "none":
                return
            same = (found.values == truth.output.values) | ((found.values != found.values) &
                                                            (truth.output.values != truth.output.values))
            check(same.all(), f"{(~same).sum()} voxels differ from those of the run with all maps")
            return
        expected = Expected(truth.model, truth.source, self.case["interpolation"], truth.background,
                            getattr(truth.source, "padding", None))
        expected.preserve_mass(truth.jacobian.astype(float))
        truth.none(expected.differences(found.values), "--preserve mass", found.values, expected.shown())

    def check_map(self, option):
        truth, name = self.truth, option[0] + self.case[option]
        wanted = {"coverage": truth.coverage, "inverse": truth.inverse}.get(option)
        if wanted is None:
            wanted = truth.jacobian if option == "jacobian" else truth.folds
        if self.case[option] == ".dcm":
            data = pydicom.dcmread(self.folder / name)
            items = [one for one in data.DeformableRegistrationSequence if "DeformableRegistrationGridSequence" in one]
            grid = items[0].DeformableRegistrationGridSequence[0]
            size = [int(n) for n in grid.GridDimensions]
            values = volumes.shaped(bytes(grid.VectorGridData), "<f4", size, 3)
        else:
            values = volumes.read(self.folder / name).values
        check(values.shape == wanted.shape and np.array_equal(values, wanted, equal_nan=values.dtype.kind == "f"),
              f"--{option} differs from that of the run with all maps")

    def check_with(self):
        wanted, truth, along = self.case["with"], self.truth, self.world.along
        if wanted == "none" or truth.kind == "short":
            return
        name = next(path for path in self.folder.iterdir() if path.name.startswith("along."))
        if wanted in ("dose-object", "segmentation", "structures"):
            data = pydicom.dcmread(name)
            check(data.FrameOfReferenceUID == self.frame() if "FrameOfReferenceUID" in data else True,
                  "an object in another frame of reference than the derived series")
            return
        found = volumes.read(name)
        source, interpolation, background, padding = {
            "labels": lambda: (along["labels"], "vote", None, None),
            "nearest-own": lambda: (along["other"], "nearest", None, None),
            "cubic": lambda: (along["other"], "cubic", -5, None),
            "vectors": lambda: (along["vectors"], "linear", None, None),
            "series": lambda: (self.world.inputs.get("padded")[1], "nearest", PADDING, PADDING),
            "dose": lambda: (along["dose"], "linear", None, None)}[wanted]()
        if wanted == "dose":
            source = volumes.Volume((source.values * 0.001).astype(found.values.dtype), source.affine)
            check(found.values.dtype.kind == "f", "a dose in whole numbers")
        if background is None:
            background = source.values.min()
        grid = grid_of(source.affine, source.size) if wanted == "nearest-own" else truth.grid
        near(grid.affine, found.affine, "grid of --with")
        model = truth.deformed(grid) if wanted == "nearest-own" else truth.model
        expected = Expected(model, source, interpolation, background, padding)
        if wanted == "dose":
            expected.slack = expected.slack + 1e-6 * np.abs(expected.value) + 1e-9
        truth.none(expected.differences(found.values), f"--with {wanted}", found.values, expected.shown())

    def frame(self):
        first = next((self.folder / "v").iterdir())
        return pydicom.dcmread(first, stop_before_pixels=True).FrameOfReferenceUID

    def read_points(self):
        """Where each point came to lie, and whether it was said to be outside (None: not said)."""
        kind = self.case["points"]
        if kind == "csv":
            rows = list(csv.DictReader((self.folder / "p.csv").open()))
            return np.array([[float(row[a]) for a in "xyz"] for row in rows]), [r["status"] == "outside" for r in rows]
        if kind == "markups":
            markup = json.loads((self.folder / "p.mrk.json").read_text())["markups"][0]
            points = markup["controlPoints"]
            check(markup["coordinateSystem"] in ("RAS", "1", 0), "another frame than that of the markups")
            return (np.array([p["position"] for p in points]) * [-1, -1, 1],
                    ["outside the field" in p.get("description", "") for p in points])
        text = (self.folder / "p.stl").read_text()
        points = [[float(x) for x in line.split()[1:]] for line in text.splitlines() if line.split()[:1] == ["vertex"]]
        return np.array(points), None

    def check_points(self):
        """Each point lies where the field takes it: moved by one of the tetrahedra that hold it at rest."""
        if self.case["points"] == "none" or self.truth.kind == "short":
            return
        points = self.world.points[:21] if self.case["points"] == "stl" else self.world.points
        found, outside = self.read_points()
        check(found.shape == points.shape, f"{len(found)} points of {len(points)}")
        field = self.truth.tetrahedra()
        index_from_mm = np.linalg.inv(self.truth.grid.affine)
        rest = snap(field.rest_mm @ index_from_mm[:3, :3].T + index_from_mm[:3, 3])[0] / 4096.0
        corner = rest[field.corners]
        local = corner[:, :3] - corner[:, [3]]
        volume = determinant(local[:, 0], local[:, 1], local[:, 2])
        for n, point in enumerate(points):
            r = index_from_mm[:3, :3] @ point + index_from_mm[:3, 3] - corner[:, 3]
            with np.errstate(divide="ignore", invalid="ignore"):
                w = np.stack([determinant(r, local[:, 1], local[:, 2]), determinant(local[:, 0], r, local[:, 2]),
                              determinant(local[:, 0], local[:, 1], r)], -1) / volume[:, None]
            w = np.concatenate([w, 1 - w.sum(1, keepdims=True)], 1)
            least = np.where(np.isfinite(w).all(1), w.min(1), -1)
            holders = np.flatnonzero(least > -1e-3)
            if outside is not None:
                check(not outside[n] if (least > 1e-3).any() else outside[n] or len(holders),
                      f"point {n} at {point} is said to be outside, or not to be, wrongly")
            moved = [point + w[t] @ field.moved_mm[field.corners[t]] for t in holders] or [point]
            if len(holders) and not (least > 1e-3).any():
                moved.append(point)
            nearest = min(np.abs(m - found[n]).max() for m in moved)
            check(nearest < 4e-3, f"point {n} at {point} went to {found[n]}, expected {moved[0]}")

    def check_series(self):
        if self.case["output"] not in SERIES:
            return
        files = [pydicom.dcmread(path, stop_before_pixels=True) for path in sorted((self.folder / "v").iterdir())]
        sidecar = json.loads((self.folder / "v.json").read_text())
        of_series = {file.SeriesInstanceUID for file in files}
        check(of_series == {sidecar["output"]["series_instance_uid"]}, "the sidecar names another series")
        check(len({file.SOPInstanceUID for file in files}) == len(files), "two slices with one SOP Instance UID")
        check(not any(uid.startswith(made_dicom.SERIES) for uid in of_series), "the series has the source's UID")
        is_kept = self.case["keep-frame"] != "none" or self.case["field"] == "identity"
        if self.case["deidentify"] == "none":
            check((files[0].FrameOfReferenceUID == made_dicom.FRAME) == is_kept, "the Frame of Reference UID")
        name = str(files[0].PatientName)
        check((name == made_dicom.PATIENT["PatientName"]) == (self.case["deidentify"] == "none"),
              f"the patient is called {name!r}")
