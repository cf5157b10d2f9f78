#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Compares what a program makes with the hashes that every machine has to give (hashes.tsv).

    tests/bits/check.py PROGRAM [--launcher "COMMAND ..."] [--write] [--only TEXT] [-- OPTION ...]

--launcher: what starts the program, such as an emulator of another processor. --write: writes hashes.tsv anew.
--only: cases whose name contains a text; not with --write. OPTION: such as --threads 3 or --backend cuda; of each
`deform` and `invert`, and --threads of all commands.

Hashed are the values of voxels, vectors and maps, never files, whose headers name the version. Exit status 0: all are
equal, 1: some differ, or a command failed.
"""
import argparse
import array
import hashlib
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
HASHES = HERE / "hashes.tsv"
SCENARIOS = HERE.parents[1] / "examples" / "scenarios"
FIELDS = ["identity", "translate:by=1.5/-2/3", "translate:by=3/6/-5", "wave:amplitude=12,wavelength=60",
          "wave:amplitude=5,wavelength=40,along=x,axis=y,phase=30", "twist:angle=50", "bubble:radius=60,strength=0.8",
          "bubble:radius=60,strength=5", "bubble-paper:shift=-9", "elastic:amplitude=8,spacing=40,seed=7",
          "elastic:amplitude=30,spacing=30,seed=4"]
CELLS = [1, 4, 8]
MAPS = ["coverage", "inverse", "jacobian", "folds"]


def values_of(path):
    """The bytes of the voxels of an uncompressed file."""
    data = path.read_bytes()
    begin = data.index(b"ElementDataFile = LOCAL\n")
    return data[begin + len(b"ElementDataFile = LOCAL\n"):]


def cases():
    """Name, and arguments of the program, of each case; {ct}, {wide}, {real}, {pull}: files that `prepare` makes;
    {scenarios}: a folder."""
    maps = [word for name in MAPS for word in (f"--{name}", f"{name}.mha")]
    for field in FIELDS:
        for cell in CELLS:
            yield (f"{field} cells of {cell}", ["deform", "{ct}", "-f", field, "--cell-size", str(cell),
                                                "--outside", "background", "-o", "volume.mha", *maps])
    for interpolation in ["nearest", "cubic", "vote"]:
        for field in FIELDS[3], FIELDS[6], FIELDS[9]:
            yield (f"{field} {interpolation}", ["deform", "{ct}", "-f", field, "--cell-size", "4", "--outside", "rest",
                                                "--interpolation", interpolation, "-o", "volume.mha"])
    yield ("two fields", ["deform", "{ct}", "-f", FIELDS[5], "-f", FIELDS[3], "--outside", "rest", "-o", "volume.mha",
                          "--write-field", "field.mha"])
    yield ("preserved mass", ["deform", "{ct}", "-f", FIELDS[6], "--preserve", "mass", "--outside", "rest", "-o", "volume.mha"])
    yield ("grown grid", ["deform", "{ct}", "-f", FIELDS[4], "--grid", "fit", "--outside", "background", "-o", "volume.mha"])
    yield ("float values", ["deform", "{real}", "-f", FIELDS[9], "--cell-size", "2", "--outside", "rest", "-o", "volume.mha"])
    yield ("pull field", ["deform", "{ct}", "--pull-field", "{pull}", "--outside", "background", "-o", "volume.mha"])
    yield ("formula sampled", ["field", FIELDS[9], "--like", "{ct}", "-o", "field.mha", "--cell-size", "3"])
    for scenario in ["bending", "diaphragm_push", "incision", "retractor"]:
        for method in ["chainmail", "mass-spring"]:
            yield (f"{scenario} {method}", ["deform", "{wide}", "--scenario", f"{{scenarios}}/{scenario}-{method}.json",
                                            "-o", "volume.mha", "--inverse", "inverse.mha"])


class Runner:
    """Runs the program in folders of their own."""

    def __init__(self, program, launcher, scratch, options):
        self.start = [*shlex.split(launcher), str(pathlib.Path(program).resolve())]
        self.options = options
        self.scratch = scratch
        self.count = 0

    def __call__(self, arguments):
        """Runs a command in a new folder and returns the folder. Raises RuntimeError where it fails."""
        self.count += 1
        folder = self.scratch / str(self.count)
        folder.mkdir()
        options = self.options
        if arguments[0] not in ("deform", "invert"):
            at = options.index("--threads") if "--threads" in options else len(options)
            options = options[at:at + 2]
        done = subprocess.run([*self.start, *arguments, *options, "--quiet"], cwd=folder, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"{shlex.join(arguments)}: exit status {done.returncode}, {done.stderr.strip()[:500]}")
        return folder


def prepare(run):
    """The files that the cases read."""
    ct = run(["phantom", "-o", "ct.mha", "--size", "48,40,24", "--spacing", "3,3,5"]) / "ct.mha"
    wide = run(["phantom", "-o", "wide.mha", "--size", "48,40,24", "--spacing", "6,6,9", "--seed", "2"]) / "wide.mha"
    pull = run(["invert", FIELDS[9], "--like", str(ct), "-o", "pull.mha"]) / "pull.mha"
    real = ct.with_name("real.mha")  # the same values as 32-bit numbers, a quarter added
    data = ct.read_bytes()
    at = len(data) - len(values_of(ct))
    header = data[:at].replace(b"MET_SHORT", b"MET_FLOAT")
    values = array.array("h", data[at:])
    assert header != data[:at] and sys.byteorder == "little"
    real.write_bytes(header + array.array("f", [value + 0.25 for value in values]).tobytes())
    for path in SCENARIOS.glob("*.json"):
        for method in ["chainmail", "mass-spring"]:
            text = re.sub(r'"cell_size": *[0-9.]+', '"cell_size": 4', path.read_text(encoding="utf-8"))
            text, found = re.subn(r'"method": *"[a-z-]+"', f'"method": "{method}"', text)
            assert found == 1, path
            (ct.parent / f"{path.stem}-{method}.json").write_text(text, encoding="utf-8")
    return {"ct": ct, "wide": wide, "pull": pull, "real": real, "scenarios": ct.parent}


def filled(argument, files):
    return re.sub(r"\{(\w+)\}", lambda found: str(files[found[1]]), argument)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("--launcher", default="")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--only", default="")
    own = sys.argv[1:]
    extra = own[own.index("--") + 1:] if "--" in own else []
    given = parser.parse_args(own[:own.index("--")] if "--" in own else own)
    if given.write and given.only:
        parser.error("--write is for all cases")
    wanted = dict(line.rsplit("\t", 1) for line in HASHES.read_text(encoding="utf-8").splitlines()) if HASHES.exists() else {}
    found, tried, failed, differ = {}, 0, 0, 0
    with tempfile.TemporaryDirectory() as scratch:
        run = Runner(given.program, given.launcher, pathlib.Path(scratch), extra)
        files = prepare(run)
        for name, values in [("phantom", files["ct"]), ("phantom", files["wide"]), ("inverse of the formula", files["pull"])]:
            found[f"{name}\t{values.stem}"] = hashlib.sha256(values_of(values)).hexdigest()[:32]
        for name, arguments in cases():
            if given.only not in name:
                continue
            tried += 1
            try:
                folder = run([filled(argument, files) for argument in arguments])
            except RuntimeError as error:
                failed += 1
                print(f"{name}: {error}")
                continue
            for path in sorted(folder.glob("*.mha")):
                found[f"{name}\t{path.stem}"] = hashlib.sha256(values_of(path)).hexdigest()[:32]
    if given.write and not failed:
        HASHES.write_text("".join(f"{key}\t{value}\n" for key, value in found.items()), encoding="utf-8")
    else:
        for key, value in found.items():
            if wanted.get(key) != value:
                differ += 1
                print("differs: " + key.replace("\t", ", "))
        missing = set() if given.only else set(wanted) - set(found)
        for key in sorted(missing):
            print("missing: " + key.replace("\t", ", "))
        differ += len(missing)
    print(f"{len(found)} hashes, {differ} differ, {failed} commands failed")
    return 1 if differ or failed or not tried else 0


if __name__ == "__main__":
    sys.exit(main())
