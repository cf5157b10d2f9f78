#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Runs the shell blocks of README.md and of docs/guide, as a reader would who pastes them.

    run_blocks.py SOURCE_FOLDER PROGRAM [PAGE ...]

A block is indented by four spaces, or fenced as `sh`. It runs in a folder of its own, as the root of the repository
looks after a build: `build/cpu/apps/tetwarp` is PROGRAM, and inputs that the block names, but does not write, are there.
Comments in the line before a block say what is to be known of it:

    <!-- not run: REASON -->          it is listed with the reason
    <!-- needs: PROGRAM -->           it is listed where that program is not installed, and run where it is

and `<!-- blocks follow one another -->` on top of a page lets all of its blocks run in one folder.
The exit status is 1 where a block fails. Those that were not run are listed.
"""
import dataclasses
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SIZE = ["--size", "64,64,60", "--spacing", "6.4,6.4,5", "--quiet"]

ELASTIX = """(Transform "TranslationTransform")
(NumberOfParameters 3)
(TransformParameters 1.5 0.0 -2.0)
(InitialTransformParametersFileName "NoInitialTransform")
(HowToCombineTransforms "Compose")
(FixedImageDimension 3)
(MovingImageDimension 3)
"""
STL = """solid bone
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 10 0 0
vertex 0 10 0
endloop
endfacet
endsolid bone
"""
GMSH = """$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
4
1 -40 -40 -40
2 40 -40 -40
3 -40 40 -40
4 -40 -40 40
$EndNodes
$Elements
1
1 4 2 1 1 1 2 3 4
$EndElements
$NodeData
1
"U"
1
0.0
3
0
3
4
1 0 0 0
2 5 0 0
3 0 5 0
4 0 0 5
$EndNodeData
"""
COHORT = """case,input,field,cell-size,variants,seed
one,ct.nii.gz,"wave:amplitude=8,wavelength=64",8,,
two,ct.nii.gz,"elastic:amplitude=2..8,spacing=60..90",8,2,7
"""


@dataclasses.dataclass
class Block:
    page: str
    line: int
    text: str
    not_run: str = ""  # why


def blocks_of(path, name):
    """The shell blocks of a page, and whether they follow one another."""
    lines = path.read_text().splitlines()
    found, fence, block, marker = [], None, None, ""

    def close():
        nonlocal block, marker
        if block:
            block.text = block.text.rstrip("\n") + "\n"
            found.append(block)
            marker = ""
        block = None

    for number, line in enumerate(lines, 1):
        fenced = re.match(r"```+(\w*)", line)
        if fenced:
            close()
            fence = None if fence is not None else fenced.group(1)
            if fence == "sh":
                block = Block(name, number + 1, "", why_not(marker))
        elif fence is not None:
            if block:
                block.text += line + "\n"
        elif line.startswith("    ") and (block or number == 1 or not lines[number - 2].strip() or marker):
            block = block or Block(name, number, "", why_not(marker))
            block.text += line[4:] + "\n"
        elif not line.strip():
            if block:
                block.text += "\n"
        else:
            close()
            marker = line if line.startswith("<!-- ") else ""
    close()
    return found, "<!-- blocks follow one another -->" in lines


def why_not(marker):
    reason = re.match(r"<!-- not run: (.+) -->", marker)
    if reason:
        return reason.group(1)
    needs = re.match(r"<!-- needs: (.+) -->", marker)
    if needs and not shutil.which(needs.group(1)):
        return f"{needs.group(1)} is not installed"
    return ""


def make_inputs(folder, program):
    """One of each input that the pages name."""
    folder.mkdir()

    def run(*arguments):
        subprocess.run([program, *arguments], cwd=folder, check=True, stdout=subprocess.DEVNULL)

    for name in ("ct.nii.gz", "study_folder", "ct_folder", "uneven_folder"):
        run("phantom", "-o", name, *SIZE)
    (folder / "uneven_folder" / "IM00020.dcm").unlink()
    (folder / "exam_folder").mkdir()
    run("phantom", "-o", "exam_folder/first", "--seed", "1", *SIZE)
    run("phantom", "-o", "exam_folder/second", "--seed", "2", *SIZE)
    shutil.copy(folder / "ct.nii.gz", folder / "labels.nii.gz")
    run("field", "bubble:radius=60,strength=0.3", "--like", "ct.nii.gz", "-o", "field.mha", "--cell-size", "4", "--quiet")
    run("invert", "field.mha", "--like", "ct.nii.gz", "-o", "elastix_field.mha", "--quiet")
    (folder / "TransformParameters.0.txt").write_text(ELASTIX)
    (folder / "landmarks.csv").write_text("x,y,z\n0,0,0\n10,20,30\n")
    (folder / "bone.stl").write_text(STL)
    (folder / "liver.msh").write_text(GMSH)
    (folder / "cohort.csv").write_text(COHORT)
    (folder / "key").write_text("0123456789abcdef0123456789abcdef\n")


def furnish(folder, source, program, inputs, text):
    """Makes a folder look like the root of the repository, with the inputs that a block names and does not write."""
    apps = folder / "build/cpu/apps"
    if not apps.exists():
        apps.mkdir(parents=True)
        (apps / "tetwarp").symlink_to(program)
        (folder / "examples").symlink_to(source / "examples")
    needed = {made.name for made in inputs.iterdir() if re.search(rf"(?<!-o )(?<!> )\b{re.escape(made.name)}", text)}
    if "cohort.csv" in needed:
        needed.add("ct.nii.gz")
    for name in needed:
        if (folder / name).exists():
            continue
        if (inputs / name).is_dir():
            shutil.copytree(inputs / name, folder / name)
        else:
            shutil.copy(inputs / name, folder / name)


def run_block(block, folder):
    environment = dict(os.environ, tetwarp="build/cpu/apps/tetwarp")
    environment["PATH"] = f"{folder / 'build/cpu/apps'}:{environment['PATH']}"
    done = subprocess.run(["bash", "-euxo", "pipefail", "-c", block.text], cwd=folder, env=environment, text=True,
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    return done.returncode, done.stdout


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    source, program = (pathlib.Path(argument).resolve() for argument in sys.argv[1:3])
    pages = [source / name for name in sys.argv[3:]] or [source / "README.md", *sorted((source / "docs/guide").glob("*.md"))]
    ran, left, failed = 0, [], 0
    with tempfile.TemporaryDirectory(prefix="tetwarp-pages-") as name:
        scratch = pathlib.Path(name)
        make_inputs(scratch / "inputs", program)
        for page in pages:
            where = str(page.relative_to(source))
            blocks, one_folder = blocks_of(page, where)
            for block in blocks:
                if block.not_run:
                    left.append(f"not run: {where}:{block.line}: {block.not_run}")
                    continue
                folder = scratch / "block"
                folder.mkdir(exist_ok=True)
                furnish(folder, source, program, scratch / "inputs", block.text)
                status, said = run_block(block, folder)
                ran += 1
                if status != 0:
                    failed += 1
                    print(f"{where}:{block.line}: status {status}\n{said[-2000:]}", flush=True)
                if not one_folder:
                    shutil.rmtree(folder)
            shutil.rmtree(scratch / "block", ignore_errors=True)
    print("\n".join(left))
    print(f"{ran} blocks were run, {failed} failed, {len(left)} were not run")
    return 1 if failed or ran == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
