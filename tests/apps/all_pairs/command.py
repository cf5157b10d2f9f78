# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Turns a case into a command line, and into the row of a manifest."""
import json
import pathlib

import numpy as np

import made_fields
import made_inputs
from made_dicom import FOLDER
import volumes
from volumes import Volume, write_mha, write_nrrd

FORMULAS = {"identity": ["identity"], "shift": ["translate:by=1vox/-2vox/1vox"],
            "wave": ["wave:amplitude=2,wavelength=24"], "bubble": ["bubble:radius=12,strength=0.5"],
            "tear": ["bubble-paper:shift=-3"], "elastic": ["elastic:amplitude=4,spacing=9,seed=3"]}
CELLS = {"bubble": 4, "tear": 3, "elastic": 2, "affine": 5}
PAGES = {"cut-open": "open", "cut-springs": "open-springs", "cut-closed": "closed", "chain": "chain",
         "springs": "springs", "labelled": "labelled", "cut-file": "open", "chain-file": "chain"}
OUTPUTS = {"dicom": "v", "dicom-rle": "v", "dicom-deflated": "v"}
WITH = {"labels": "labels.nii.gz=along.nii:vote", "nearest-own": "other.mha=along.nrrd:nearest:own",
        "cubic": "other.mha=along.mha:cubic:background=-5", "vectors": "arrows.nrrd=along.nrrd:linear",
        "dose": "dose.dcm=along.nii.gz:linear", "dose-object": "dose.dcm=along.dcm:linear",
        "segmentation": "seg.dcm=along.dcm", "structures": "structures.dcm=along.dcm"}
POINTS = {"csv": "points.csv=p.csv", "markups": "points.mrk.json=p.mrk.json", "stl": "points.stl=p.stl"}
SCENARIOS = ("cut-open", "cut-springs", "cut-closed", "chain", "springs", "labelled")


class World:
    """All files that the cases of one run read, in a folder. @param run  runs the program, for fields made by it"""

    def __init__(self, folder, run):
        self.folder, self.run = pathlib.Path(folder), run
        made_fields.write(self.folder)
        self.named_by_patient = self.folder / FOLDER
        self.named_by_patient.mkdir()
        self.along = made_inputs.write_along(self.named_by_patient)
        self.points = made_inputs.write_points(self.named_by_patient)
        self.inputs = made_inputs.Inputs(self.folder)
        (self.folder / "key").write_text("0123456789abcdef0123456789abcdef")
        self.made, self.grids = {}, {}

    def path(self, name):
        return str(self.folder / name)

    def private(self, name):
        return str(self.named_by_patient / name)

    def input(self, case):
        return self.inputs.get(case["input"])

    def grid(self, name):
        """The output grid of an input with `--grid same`: of a leaning or uneven one what the identity gives."""
        path, volume = self.inputs.get(name)
        if name not in ("tilted", "uneven"):
            return Volume(volume.values, volume.affine)
        if name not in self.grids:
            self.run(["deform", path, "-f", "identity", "--uneven", "exact", "-o", self.path(f"grid-{name}.nrrd"),
                      "--quiet"])
            self.grids[name] = volumes.read(self.path(f"grid-{name}.nrrd"))
        return self.grids[name]

    def field(self, case):
        """Options that say which field. Some files depend on the input."""
        name = case["field"]
        if name in FORMULAS:
            return [item for text in FORMULAS[name] for item in ("-f", text)]
        if name in SCENARIOS:
            labels = ["--labels", self.labels(case)] if name == "labelled" else []
            return ["--scenario", self.path(PAGES[name] + ".json"), *labels]
        if name in ("cut-file", "chain-file"):
            return ["-f", self.simulated(case, ".vtk" if name == "cut-file" else ".mha")]
        if name == "short":
            return ["-f", self.short(case)]
        files = {"lattice": ["lattice.nrrd"], "folded": ["folded.mha"], "mesh": ["mesh.msh"],
                 "two-meshes": ["rest.vtk:deformed=moved.vtk"], "island": ["island.msh"],
                 "composed": ["lattice.nrrd", "second.mha"], "composed-mesh": ["mesh.msh", "second.mha"],
                 "affine": ["affine.tfm"], "pull": ["pull.nrrd"], "gaps": ["gaps.mha"], "pull-affine": ["affine.tfm"]}
        option = "--pull-field" if name in ("pull", "gaps", "pull-affine") else "-f"
        return [item for file in files[name] for item in (option, self.named(file))]

    def named(self, file):
        return self.path(file.replace("deformed=", "deformed=" + str(self.folder) + "/"))

    def once(self, name, make):
        if name not in self.made:
            self.made[name] = self.path(name)
            make(self.made[name])
        return self.made[name]

    def simulated(self, case, suffix):
        """A field made by `simulate`, which needs a straight grid and one value a voxel."""
        page, name = self.path(PAGES[case["field"]] + ".json"), case["input"]
        self.grid(name)
        volume = self.path(f"grid-{name}.nrrd") if name in self.grids else self.inputs.get(name)[0]
        if name == "vectors":
            volume = self.inputs.get("dicom")[0]
        return self.once(f"{case['field']}-{name}{suffix}",
                         lambda path: self.run(["simulate", page, volume, "-o", path, "--quiet"]))

    def labels(self, case):
        """A label volume on the grid of the input: its two halves have labels 0 and 1."""
        def make(path):
            grid = self.grid(case["input"])
            write_nrrd(path, Volume((np.indices(grid.size)[2] > 4).astype("u1"), grid.affine))
        return self.once(f"{FOLDER}/labels-{case['input']}.nrrd", make)

    def short(self, case):
        """The identity on the grid of the input, whose header ends 0.7 of 2^-12 voxel before the last column."""
        def make(path):
            grid = self.grid(case["input"])
            affine = grid.affine.copy()
            affine[:3, 0] *= 1 - 0.7 / 4096 / (grid.size[0] - 1)
            write_mha(path, Volume(np.zeros((*grid.size, 3), "<f4"), affine))
        return self.once(f"short-{case['input']}.mha", make)

    def with_text(self, case, prefix):
        if case["with"] == "none":
            return None
        if case["with"] == "series":
            return self.inputs.get("padded")[0] + "=" + prefix + "along.nii.gz:nearest"
        source, target = WITH[case["with"]].split("=", 1)
        return self.private(source) + "=" + prefix + target

    def options(self, case, prefix):
        """Options of `deform` but --output: pairs of name and value, names without dashes; None: a flag."""
        found = []
        add = lambda name, value=None: found.append((name, value))
        name = case["field"]
        if name in CELLS:
            add("cell-size", CELLS[name])
        if case["input"] == "uneven":
            add("uneven", "exact")
        if (text := self.with_text(case, prefix)) is not None:
            add("with", text)
        if case["points"] != "none":
            source, target = POINTS[case["points"]].split("=")
            add("points", self.private(source) + "=" + prefix + target)
        for map_name in ("coverage", "inverse", "jacobian", "folds", "write-field"):
            if case[map_name] != "none":
                add(map_name, prefix + map_name[0] + case[map_name])
        if case["mass"] != "none":
            add("preserve", "mass")
        if case["grid"] != "same":
            add("grid", {"fit": "fit", "file": self.private("grid.mha"),
                         "series": self.inputs.get("dicom")[0] if case["grid"] == "series" else ""}[case["grid"]])
        if case["outside"] != "refuse":
            add("outside", case["outside"])
        if case["interpolation"] != "linear":
            add("interpolation", case["interpolation"])
        if case["background"] != "none":
            add("background", int(case["background"]))
        if case["output"] in ("dicom-rle", "dicom-deflated"):
            add("transfer-syntax", case["output"].removeprefix("dicom-"))
        if case["deidentify"] != "none":
            add("deidentify", case["deidentify"])
            add("deidentify-key", self.path("key"))
        if case["compress"] != "none":
            add("compress", int(case["compress"]))
        for flag in (case["keep-frame"], case["bids"]):
            if flag != "none":
                add(flag)
        if case["report"] != "none":
            add("report", prefix + "r.json")
        if case["preview"] != "none":
            add("preview", prefix + "preview.png")
        return found

    def output(self, case):
        return OUTPUTS.get(case["output"], "v" + case["output"])

    def arguments(self, case, threads=0, backend=None, field=None, extra=()):
        """Arguments of `tetwarp`, for a run in a folder of its own in which "out" exists."""
        line = ["deform", self.input(case)[0], *(field or self.field(case)), "-o", "out/" + self.output(case)]
        for name, value in self.options(case, "out/"):
            line += ["--" + name] if value is None else ["--" + name, str(value)]
        if case["memory"] != "none":
            line += ["--memory", case["memory"]]
        backend = backend or case["backend"]
        return line + ["--threads", str(threads), *(["--backend", backend] if backend != "auto" else []), *extra]

    def row(self, case):
        """The row of a manifest for a case."""
        row = {"case": "one", "input": self.input(case)[0], "output": self.output(case)}
        field = self.field(case)
        key = field[0].lstrip("-")
        row["field" if key == "f" else key] = field[1::2] if key == "f" else field[1]
        if "--labels" in field:
            row["labels"] = field[-1]
        for name, value in self.options(case, ""):
            row[name] = [value] if name in ("with", "points") else True if value is None else value
        return json.dumps(row)

    def files(self, case):
        """Names of the files that lie in the folder after a case has run."""
        output = self.output(case)
        names = {output, output + ".json"}
        for name, value in self.options(case, ""):
            if name in ("with", "points"):
                names.add(value.split("=", 1)[1].split(":")[0].rsplit("=", 1)[-1])
            elif name in ("coverage", "inverse", "jacobian", "folds", "write-field", "report", "preview"):
                names.add(value)
            elif name == "bids":
                names.add("v.json")
        return names
