# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""UIDs and hashes of a derived series differ when anything that is read differs, and only then.

    hashes.py PROGRAM

PROGRAM is tetwarp. Each change is made to one thing that a run reads; the run before and after it are compared by the
hash of the field, Series, Frame of Reference and SOP Instance UIDs, and the hashes of inputs. Exit status 77: a module
is missing.
"""
import json
import pathlib
import shutil
import struct
import sys
import tempfile

try:
    import nibabel  # noqa: F401
    import numpy as np
    import pydicom
except ImportError as error:
    print(error)
    sys.exit(77)

import made_fields
import volumes
from all_pairs import Program
from command import World
from judge import Wrong, check
from made_fields import MIDDLE

# What a change must change. All other hashes must stay.
FIELD, SERIES, FRAME, INSTANCE, INPUT, ALONG = "field", "series", "frame", "instance", "input", "along"
OF_FIELD = {FIELD, SERIES, FRAME, INSTANCE}
OF_OPTION = {SERIES, INSTANCE}


def identity(folder):
    sidecar = json.loads((folder / "out/v.json").read_text())
    slices = [pydicom.dcmread(path, stop_before_pixels=True) for path in sorted((folder / "out/v").iterdir())]
    found = {FIELD: sidecar["field"]["sha256"], SERIES: slices[0].SeriesInstanceUID,
             FRAME: slices[0].FrameOfReferenceUID, INSTANCE: tuple(one.SOPInstanceUID for one in slices),
             INPUT: sidecar["input"]["sha256"],
             ALONG: json.dumps([one.get("sha256") for one in sidecar.get("with", []) + sidecar.get("structures", [])])}
    objects = sorted((folder / "out").glob("*.dcm"))
    if objects:
        found[ALONG] += "".join(pydicom.dcmread(path, stop_before_pixels=True).SOPInstanceUID for path in objects)
    return found


class Hashes:
    def __init__(self, program, folder):
        self.program, self.folder = program, pathlib.Path(folder)
        (self.folder / "world").mkdir()
        self.world = World(self.folder / "world", program.must)
        self.input = self.world.inputs.get("dicom")[0]
        self.problems, self.count, self.base = [], 0, {}

    def run(self, options, series=None):
        self.count += 1
        place = self.folder / f"run{self.count}"
        (place / "out").mkdir(parents=True)
        self.program.must(["deform", series or self.input, *options, "-o", "out/v", "--quiet"], place)
        found = identity(place)
        shutil.rmtree(place)
        return found

    def expect(self, what, before, after, changes, series=None):
        """@param before, after  options; @param changes  which hashes must differ"""
        try:
            key = tuple(before)
            if key not in self.base:
                self.base[key] = self.run(before)
            one, other = self.base[key], self.run(after, series)
            differ = {name for name in one if one[name] != other[name]}
            check(differ == changes, f"differ {sorted(differ)}, expected {sorted(changes)}")
        except Wrong as wrong:
            self.problems.append(f"{what}: {wrong}")

    def changed(self, name, change):
        """A copy of a file of the world, changed. @param change  from bytes to bytes"""
        copy = self.folder / f"changed{self.count}{''.join(pathlib.Path(name).suffixes)}"
        data = change(pathlib.Path(self.world.path(name)).read_bytes())
        copy.write_bytes(data)
        return str(copy)

    def files(self):
        path = self.world.path
        random = np.random.default_rng(1)
        same = lambda data: data
        for option, name, word in (("-f", "lattice.nrrd", 4), ("--pull-field", "pull.nrrd", 4)):
            start = pathlib.Path(path(name)).read_bytes().index(b"\n\n") + 2
            size = pathlib.Path(path(name)).stat().st_size - start
            for at in random.integers(0, size // word, 6):
                place = start + int(at) * word
                def flip(data):
                    value = struct.unpack_from("<f", data, place)[0]
                    return data[:place] + struct.pack("<f", value + 0.03125) + data[place + word:]
                self.expect(f"number {at} of {name}", [option, path(name)], [option, self.changed(name, flip)],
                            OF_FIELD)
            self.expect(f"{name} under another name", [option, path(name)], [option, self.changed(name, same)], set())
            for key in (b"space origin: (", b"space directions: none ("):
                def shift(data):
                    begin = data.index(key) + len(key)
                    end = data.index(b",", begin)
                    return data[:begin] + repr(float(data[begin:end]) + 0.001).encode() + data[end:]
                self.expect(f"{key.decode()} of {name}", [option, path(name)], [option, self.changed(name, shift)],
                            OF_FIELD)
        pull, second = volumes.read(path("pull.nrrd")), volumes.read(path("second.mha"))
        volumes.write_nrrd(self.folder / "second.nrrd", second)
        self.expect("pull.nrrd taken as forward", ["--pull-field", path("pull.nrrd")], ["-f", path("pull.nrrd")],
                    OF_FIELD)
        self.expect("the same numbers as .nrrd", ["-f", path("second.mha")], ["-f", str(self.folder / "second.nrrd")],
                    set())
        gap = pull.values.copy()
        gap[0, 0, 0] = np.nan
        volumes.write_nrrd(self.folder / "gap.nrrd", volumes.Volume(gap, pull.affine))
        self.expect("a gap", ["--pull-field", path("pull.nrrd")], ["--pull-field", str(self.folder / "gap.nrrd")],
                    OF_FIELD)

    def meshes(self):
        mesh = lambda: made_fields.Mesh(5, 13.5, 1.5, 5, False)

        def written(change, name):
            made = mesh()
            change(made)
            made.write_msh(self.folder / name)
            return ["-f", str(self.folder / name)]

        def displacement(made):
            made.moved[31, 1] += 0.0625

        def rest(made):
            made.rest[31, 1] += 0.0625

        def order(made):
            made.tetrahedra[0], made.tetrahedra[1] = made.tetrahedra[1], made.tetrahedra[0]

        base = ["-f", self.world.path("mesh.msh")]
        self.expect("a displacement of a mesh", base, written(displacement, "d.msh"), OF_FIELD)
        self.expect("a vertex of a mesh", base, written(rest, "r.msh"), OF_FIELD)
        self.expect("the order of a mesh's tetrahedra", base, written(order, "o.msh"), OF_FIELD)
        self.expect("the same mesh", base, written(lambda made: None, "s.msh"), set())
        made = made_fields.Mesh(5, 13.5, 1.25, 6, False)
        made.moved[31, 2] -= 0.0625
        made.write_vtk(self.folder / "other.vtk", deformed=True)
        rest_file = self.world.path("rest.vtk")
        self.expect("the second file of a mesh", ["-f", f"{rest_file}:deformed={self.world.path('moved.vtk')}"],
                    ["-f", f"{rest_file}:deformed={self.folder}/other.vtk"], OF_FIELD)

    def scenario(self, name, **changes):
        """Two balls are free, one round the cut and one far from it; all else is held."""
        at, far = MIDDLE.tolist(), (MIDDLE + [0, 9, 0]).tolist()
        near = {"sphere": {"at": {"mm": at}, "radius_mm": 5}}
        by = {"near": [-1, 0.5, 0], "far": [0.5, 0, 0.25], **changes}
        page = {"method": "chainmail", "cell_size": 1, "body_above_hu": -2000, "description": by.pop("text", "one"),
                "tissues": [{"name": "all", "compression": 0.6, "stretch": 0.6, "shear": 0.6}],
                "hold": [{"not": {"any_of": [near, {"sphere": {"at": {"mm": far}, "radius_mm": 2.2}}]}}],
                "cuts": [{"name": "cut", "disc": {"at": {"mm": at}, "normal": [1, 0, 0], "radius_mm": 3.5}}],
                "move": [{"name": "near", "handle": {"at": {"mm": [at[0] - 2, at[1], at[2]]}, "radius_mm": 1.5},
                          "by_mm": by["near"]},
                         {"name": "far", "handle": {"at": {"mm": far}, "radius_mm": 1.5}, "by_mm": by["far"]}]}
        (self.folder / name).write_text(json.dumps(page))
        return ["--scenario", str(self.folder / name), "--outside", "background"]

    def cuts(self):
        base = self.scenario("base.json")
        self.expect("what moves at a cut", base, self.scenario("near.json", near=[-1.25, 0.5, 0]), OF_FIELD)
        self.expect("what moves far from the same cut", base, self.scenario("far.json", far=[0.75, 0, 0.25]), OF_FIELD)
        self.expect("the description of a scenario", base, self.scenario("text.json", text="two"), set())
        for name, options in (("cut", base), ("far cut", self.scenario("far.json", far=[0.75, 0, 0.25]))):
            self.program.must(["simulate", options[1], self.input, "-o", str(self.folder / f"{name}.vtk"), "--quiet"])
        written = ["-f", str(self.folder / "cut.vtk"), "--outside", "background"]
        self.expect("what moves far from the same cut, of files", written,
                    ["-f", str(self.folder / "far cut.vtk"), "--outside", "background"], OF_FIELD)
        labels = self.world.labels({"input": "dicom"})
        page = ["--scenario", self.world.path("labelled.json"), "--labels"]
        grid = volumes.read(labels)
        other = str(self.folder / "labels.nrrd")
        volumes.write_nrrd(other, volumes.Volume(1 - grid.values, grid.affine))
        self.expect("labels", [*page, labels], [*page, other], OF_FIELD)

    def formulas(self):
        path = self.world.path
        wave = ["-f", "wave:amplitude=2,wavelength=24"]
        self.expect("an amplitude", wave, ["-f", "wave:amplitude=2.001,wavelength=24"], OF_FIELD)
        self.expect("--cell-size", wave, [*wave, "--cell-size", "2"], OF_FIELD)
        self.expect("a formula written otherwise", wave, ["-f", "wave:wavelength=24,amplitude=2.0"], set())
        two = ["-f", "twist:angle=20", "-f", "bubble:radius=12,strength=0.5"]
        self.expect("the order of two fields", two, two[2:] + two[:2], OF_FIELD)
        affine = ["-f", path("affine.tfm")]
        self.expect("a number of a transform", affine,
                    ["-f", self.changed("affine.tfm", lambda data: data.replace(b" 0.4 ", b" 0.41 "))], OF_FIELD)
        remarked = self.changed("affine.tfm", lambda data: data.replace(b"#Transform 0", b"#Transform 0\n#x"))
        self.expect("a comment in a transform", affine, ["-f", remarked], set())

    def options(self):
        wave = ["-f", "wave:amplitude=2,wavelength=24"]
        for more in (["--interpolation", "cubic"], ["--background", "-500"], ["--outside", "background"],
                     ["--preserve", "mass"], ["--series-number", "77"], ["--series-description", "again"]):
            self.expect(" ".join(more), wave, wave + more, OF_OPTION)
        self.expect("--transfer-syntax", wave, wave + ["--transfer-syntax", "rle"], OF_OPTION)
        for more in (["--threads", "1"], ["--backend", "cpu"], ["--coverage", "out/c.nii"], ["--report", "out/r.json"],
                     ["--preview", "out/p.png"], ["--memory", "4G"], ["--inverse", "out/i.mha"],
                     ["--with", self.world.private("labels.nii.gz") + "=out/l.nii"],
                     ["--points", self.world.private("points.csv") + "=out/p.csv"]):
            self.expect(" ".join(more), wave, wave + more, {ALONG} if more[0] == "--with" else set())

    def sources(self):
        wave = ["-f", "wave:amplitude=2,wavelength=24"]
        def edited(name, edit):
            folder = self.folder / name
            shutil.copytree(self.input, folder)
            path = folder / "s004.dcm"
            data = pydicom.dcmread(path)
            edit(data)
            data.save_as(path)
            return str(folder)

        def pixel(data):
            words = bytearray(data.PixelData)
            words[150] ^= 4
            data.PixelData = bytes(words)

        def frame(folder):
            for path in folder.iterdir():
                data = pydicom.dcmread(path)
                data.FrameOfReferenceUID = "1.2.3.4.9"
                data.save_as(path)
            return str(folder)

        def instance(data):
            data.SOPInstanceUID = data.file_meta.MediaStorageSOPInstanceUID = data.SOPInstanceUID + ".7"

        self.expect("a pixel", wave, wave, {INPUT, INSTANCE}, edited("pixel", pixel))
        self.expect("an attribute", wave, wave, {INPUT, INSTANCE},
                    edited("attribute", lambda data: setattr(data, "ImageComments", "other")))
        self.expect("a SOP Instance UID", wave, wave, {INPUT, INSTANCE, SERIES}, edited("instance", instance))
        shutil.copytree(self.input, self.folder / "frame")
        self.expect("the Frame of Reference UID", wave, wave, {INPUT, INSTANCE, FRAME},
                    frame(self.folder / "frame"))
        shutil.copytree(self.input, self.folder / "copy")
        self.expect("a copy of the series", wave, wave, set(), str(self.folder / "copy"))
        private = pathlib.Path(self.world.private("dose.dcm"))
        for name in ("dose.dcm", "seg.dcm", "structures.dcm"):
            source = pydicom.dcmread(private.with_name(name))
            if name == "structures.dcm":
                contour = source.ROIContourSequence[0].ContourSequence[1]
                contour.ContourData = [format(float(x) + 0.25, "g") for x in contour.ContourData]
            else:
                source.PixelData = bytes(source.PixelData[:-64]) + bytes(b ^ 8 for b in source.PixelData[-64:])
            source.save_as(self.folder / name)
            along = lambda path: [*wave, "--with", f"{path}=out/a.dcm"]
            self.expect(f"what {name} holds", along(private.with_name(name)), along(self.folder / name), {ALONG})


def main():
    folder = pathlib.Path(tempfile.mkdtemp(prefix="tetwarp-hashes-"))
    try:
        hashes = Hashes(Program(str(pathlib.Path(sys.argv[1]).resolve()), folder / "tmp"), folder)
        for part in (hashes.files, hashes.meshes, hashes.cuts, hashes.formulas, hashes.options, hashes.sources):
            part()
    finally:
        shutil.rmtree(folder)
    for problem in hashes.problems:
        print("FAILED", problem)
    print(f"{hashes.count} runs, {len(hashes.problems)} failed")
    return 1 if hashes.problems else 0


if __name__ == "__main__":
    sys.exit(main())
