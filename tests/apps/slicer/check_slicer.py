#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""The modules for 3D Slicer, as Slicer uses them: descriptions, files in and out, progress, errors.

    check_slicer.py FOLDER PROGRAM     FOLDER: of the modules; PROGRAM: tetwarp, which makes the files and what is expected

The descriptions follow the rules of the schema of CTK's command line modules, and those of the Slicer Execution Model for
transforms, which that schema leaves out. Where Python has ctk_cli and nipype, both read them as second opinions. Exit
status 0: all holds, 1: something does not.
"""
import importlib.util
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET

MODULES = ["deform", "invert", "simulate"]
ABOUT = ["category", "title", "description", "version", "license", "contributor"]
SCENARIO = """{"method": "chainmail", "cell_size": 6, "tissues": [{"name": "all", "compression": 0.1, "stretch": 0.2,
"shear": 0.3}], "hold": [{"border": true}], "phases": [{"name": "pull", "frames": 2, "move": [{"handle": {"at": {"body":
[0.5, 0.4, 0.5]}, "radius_mm": 20}, "by_mm": [8, 0, 0]}]}]}"""
FAILURES = []


def expect(holds, what):
    if not holds:
        FAILURES.append(what)
        print("FAILED:", what)


def run(*command, status=0):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    expect(done.returncode == status, f"{' '.join(map(str, command))}: exit status {done.returncode}, {done.stderr[:400]}")
    return done


def check_parameter(module, parameter, names, places):
    """Parts in the order of the schema: name, flag or index, description, label, default, channel, elements."""
    tags = [part.tag for part in parameter]
    order = ["name", "longflag" if "longflag" in tags else "index", "description", "label"]
    order += [tag for tag in ("default", "channel") if tag in tags]
    order += ["element"] * tags.count("element")
    text = {part.tag: part.text for part in parameter}
    where = f"{module}, {text.get('name')}"
    expect(tags == order, f"{where}: parts {tags}, expected {order}")
    expect(re.fullmatch("[_a-zA-Z][_a-zA-Z0-9]*", text["name"]) is not None, f"{where}: the name is an identifier")
    expect(text["name"] not in names, f"{where}: the name is used once")
    names.add(text["name"])
    if "index" in text:
        places.append(int(text["index"]))
    expect(text.get("channel", "input") in ("input", "output"), f"{where}: channel {text.get('channel')}")
    is_file = parameter.tag in ("image", "transform", "file")
    expect(is_file == ("channel" in text), f"{where}: files, and they alone, have a channel")
    if is_file:
        expect(parameter.get("fileExtensions", "").startswith("."), f"{where}: suffixes of files")
    if parameter.tag == "string-enumeration":
        expect(text["default"] in [part.text for part in parameter.findall("element")], f"{where}: the default is a choice")


def check_description(module, program):
    text = run(program, "--xml").stdout
    root = ET.fromstring(text)
    expect(root.tag == "executable", f"{module}: the root is {root.tag}")
    tags = [part.tag for part in root]
    groups = tags.count("parameters")
    expect(groups > 0 and tags == ABOUT + ["parameters"] * groups, f"{module}: parts {tags}")
    names, places = set(), []
    for group in root.findall("parameters"):
        expect([part.tag for part in group][:2] == ["label", "description"], f"{module}: a group without label")
        for parameter in list(group)[2:]:
            check_parameter(module, parameter, names, places)
    expect(sorted(places) == list(range(len(places))), f"{module}: places {places}")
    return text, names


def second_opinions(module, program, names):
    if importlib.util.find_spec("ctk_cli"):
        import ctk_cli
        found = {parameter.name for group in ctk_cli.CLIModule(str(program)) for parameter in group}
        # ctk_cli knows no transforms that are files of several kinds; what it lists has to be ours.
        expect(names == found, f"{module}: ctk_cli reads {sorted(found)}, expected {sorted(names)}")
    else:
        print("ctk_cli: left out, Python has none")
    if importlib.util.find_spec("nipype"):
        from nipype.interfaces.slicer.generate_classes import generate_class
        category, code, name = generate_class(str(program), launcher=[], strip_module_name_prefix=False)
        for parameter in names:
            expect(f"    {parameter} = " in code, f"{module}: nipype's class has no {parameter}")
        compile(code.replace(name, "Module"), module, "exec")  # its classes are called after the program's path
        expect("Tetwarp" in str(category), f"{module}: nipype's category is {category}")
    else:
        print("nipype: left out, Python has none")


def voxels(path):
    """What follows the header of a NRRD file."""
    return path.read_bytes().split(b"\n\n", 1)[1]


def check_progress(module, done):
    lines = done.stdout.splitlines()
    expect(len(lines) > 0, f"{module}: no progress")
    opened = 0
    for line in lines:
        expect(ET.fromstring(line).tag in ("filter-start", "filter-progress", "filter-end"), f"{module}: {line!r}")
        opened += line.startswith("<filter-start>")
        opened -= line.startswith("<filter-end>")
        if line.startswith("<filter-progress>"):
            expect(0 <= float(ET.fromstring(line).text) <= 1, f"{module}: {line!r}")
    expect(opened == 0, f"{module}: a filter is not ended")
    expect(any(line.startswith("<filter-progress>") for line in lines), f"{module}: nothing says how far it is")


def check_work(folder, tetwarp, scratch):
    deform, invert, simulate = (folder / f"tetwarp-slicer-{module}" for module in MODULES)
    ct = scratch / "ct.nrrd"
    run(tetwarp, "phantom", "-o", ct, "--size", "40,36,30", "--spacing", "6,6,8", "--quiet")
    formula = "elastic:amplitude=8,spacing=60,seed=3"

    # As a formula, with outputs that exist already, as Slicer makes them.
    out, jacobian = scratch / "out.nrrd", scratch / "jacobian.nrrd"
    out.write_bytes(b"")
    done = run(deform, "--transform", "", "--formula", formula, "--cellSize", "4", "--direction", "resampling", "--interpolation",
               "linear", "--outside", "rest", "--jacobian", jacobian, "--backend", "cpu", "--threads", "0", ct, out)
    check_progress("deform", done)
    run(tetwarp, "deform", ct, "-f", formula, "--cell-size", "4", "--outside", "rest", "-o", scratch / "same.nrrd", "--jacobian",
        scratch / "same_jacobian.nrrd", "--quiet")
    expect(voxels(out) == voxels(scratch / "same.nrrd"), "deform: the volume is that of the command")
    expect(voxels(jacobian) == voxels(scratch / "same_jacobian.nrrd"), "deform: the map is that of the command")

    # The inverse of it is a resampling transform, and deforming by that gives nearly the same.
    inverse = scratch / "inverse.nrrd"
    check_progress("invert", run(invert, "--like", ct, "--output", inverse, "--formula", formula, "--cellSize", "4", "--backend", "auto"))
    expect(b"displacement field type:=resampling\n" in inverse.read_bytes()[:4096], "invert: the file says its direction")
    pulled = scratch / "pulled.nrrd"
    run(deform, "--transform", inverse, "--direction", "resampling", "--outside", "background", "--cellSize", "4", ct, pulled)
    a, b = voxels(pulled), voxels(out)
    near = sum(abs(int.from_bytes(a[n:n + 2], "little", signed=True) - int.from_bytes(b[n:n + 2], "little", signed=True)) <= 2
               for n in range(0, len(a), 2))
    expect(near > 0.5 * len(a) / 2, f"deform: by the inverse, {near} of {len(a) // 2} voxels are near")

    # A direction that the file contradicts is refused, and so are two fields, none, and unknown flags.
    refused = run(deform, "--transform", inverse, "--direction", "modeling", ct, scratch / "no.nrrd", status=4)
    expect("pull field" in refused.stderr, f"deform: {refused.stderr!r}")
    expect(not (scratch / "no.nrrd").exists(), "deform: nothing is written where it is refused")
    run(deform, "--transform", inverse, "--formula", formula, ct, scratch / "no.nrrd", status=2)
    run(deform, ct, scratch / "no.nrrd", status=2)
    run(deform, "--other", "1", ct, scratch / "no.nrrd", status=2)

    # A simulation gives a modeling transform, by which a volume is deformed.
    scenario, field = scratch / "scenario.json", scratch / "field.nrrd"
    scenario.write_text(SCENARIO, encoding="utf-8")
    check_progress("simulate", run(simulate, "--output", field, "--labels", "", scenario, ct))
    expect(b"displacement field type:=modeling\n" in field.read_bytes()[:4096], "simulate: the file says its direction")
    run(deform, "--transform", field, "--direction", "modeling", "--outside", "rest", ct, scratch / "moved.nrrd")
    expect(voxels(scratch / "moved.nrrd") != voxels(ct), "deform: the simulated field moves something")


def main():
    folder, tetwarp = pathlib.Path(sys.argv[1]), sys.argv[2]
    for module in MODULES:
        program = folder / f"tetwarp-slicer-{module}"
        _, names = check_description(module, program)
        second_opinions(module, program, names)
    with tempfile.TemporaryDirectory() as scratch:
        check_work(folder, tetwarp, pathlib.Path(scratch))
    return 1 if FAILURES else 0


if __name__ == "__main__":
    sys.exit(main())
