# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""A batch that is killed at random moments and resumed comes to the bytes of one that nobody disturbed.

    check_batch_kill.py TETWARP [--data FOLDER] [--full] [--kills N] [--seed N] [--record FILE.md]

Makes phantoms, and copies of them that are broken on purpose, writes a manifest of at least 40 cases over them and over
the series below FOLDER (all that can be deformed with --full, else the smallest), and runs it twice: as it is, and with
SIGKILL. Every folder that has its name at a kill must be whole. Exits with 1 and the reason where something differs.
"""
import argparse, csv, hashlib, json, pathlib, random, shutil, signal, subprocess, sys, tempfile, time

BROKEN = {"cut-short", "no-volume", "gap", "torn-slice", "torn-field", "no-series"}


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def tree(folder):
    """Digests of all files, by name; times are nobody's promise."""
    return {str(p.relative_to(folder)): digest(p) for p in sorted(folder.rglob("*"))
            if p.is_file() and not p.name.startswith("timings")}


def run(tetwarp, folder, *arguments, **more):
    return subprocess.run([tetwarp, *map(str, arguments)], cwd=folder, capture_output=True, text=True, **more)


def need(condition, why):
    if not condition:
        sys.exit("FAILED: " + why)


def make_inputs(tetwarp, folder, full):
    size = "512,512,100" if full else "48,48,20"
    spacing = "0.8,0.8,2" if full else "8,8,10"
    for output in ["ct.nii.gz", "ct.nrrd", "series"]:
        made = run(tetwarp, folder, "phantom", "-o", output, "--size", size, "--spacing", spacing)
        need(made.returncode == 0, made.stderr)
    made = run(tetwarp, folder, "field", "wave:amplitude=6,wavelength=90", "--like", "ct.nrrd", "-o", "wave.mha", "--cell-size", 4)
    need(made.returncode == 0, made.stderr)
    for name, part in [("ct.nii.gz", "cut-short.nii.gz"), ("wave.mha", "torn.mha")]:
        content = (folder / name).read_bytes()
        (folder / part).write_bytes(content[:len(content) // 2])
    (folder / "no-volume.nii.gz").write_text("this is not a volume\n")
    shutil.copytree(folder / "series", folder / "gap")
    (folder / "gap" / "IM00007.dcm").unlink()
    shutil.copytree(folder / "series", folder / "torn")
    slice_ = folder / "torn" / "IM00009.dcm"
    slice_.write_bytes(slice_.read_bytes()[:-1000])
    (folder / "empty").mkdir()
    (folder / "empty" / "read.me").write_text("no series\n")
    (folder / "push.json").write_text(json.dumps({
        "method": "chainmail", "cell_size": 32 if full else 4, "name": "push",
        "tissues": [{"name": "bone", "hu": [300, None], "compression": 0, "stretch": 0, "shear": 0},
                    {"name": "rest", "compression": 0.2, "stretch": 0.2, "shear": 0.3}],
        "hold": [{"border": True}],
        "phases": [{"name": "in", "frames": 2, "move": [{"name": "hand", "by_mm": [0, 12, 0], "handle": {
            "at": {"body": [0.5, 0.3, 0.5]}, "radius_mm": 20}}]}]}))


def rows_of_data(tetwarp, folder, data, full):
    """A row for each volume of real series that can be deformed; without --full those of few slices."""
    sets = sorted(p for p in pathlib.Path(data).iterdir() if p.is_dir())
    if not full:
        sets = [p for p in sets if p.name in ("overlap-kits-and-topogram", "tilt-variable-spacing-ge")]
    rows = []
    for source in sets:
        listed = run(tetwarp, folder, "batch", "--init", source, "-o", "init.csv", "--overwrite", "--quiet")
        if listed.returncode != 0:
            continue
        lines = (folder / "init.csv").read_text().splitlines()
        lines = [line.removeprefix("#") for line in lines if not line.startswith("# ")]  # uneven slices too
        for row in csv.DictReader(lines):
            row = {key: value for key, value in row.items() if value and key not in ("comment", "output")}
            row["input"] = str((folder / row["input"]).resolve())
            row["case"] = source.name + "-" + row["case"]
            rows.append(row)
    return rows


def manifest_of(rows, full):
    cell = 4 if full else 2
    elastic = "elastic:amplitude=2..8,spacing=40..80"
    for row in rows:
        row.update({"field": [elastic], "seed": 5, "cell-size": cell})
    also = [dict(row, output="dicom", case=row["case"] + "-dicom") for row in rows[: 8 if full else 1]]
    rows = rows + also + [
        {"case": "augmented", "input": "ct.nii.gz", "field": [elastic], "seed": 1, "variants": 12 if full else 24, "cell-size": cell,
         "coverage": "coverage.nii.gz", "with": ["ct.nrrd=along.nii.gz:nearest"]},
        {"case": "written", "input": "ct.nrrd", "field": ["twist:angle=5..25"], "seed": 2, "variants": 4, "cell-size": cell,
         "output": "out.mha", "write-field": "field.nrrd"},
        {"case": "derived", "input": "series", "field": ["bubble:radius=60,strength=0.1..0.5"], "seed": 3, "variants": 4,
         "cell-size": cell, "output": "dicom", "inverse": "inverse.nii.gz"},
        {"case": "from-file", "input": "ct.nii.gz", "field": ["wave.mha"], "jacobian": "jacobian.nrrd"},
        {"case": "pulled", "input": "ct.nii.gz", "pull-field": "pull.mha", "output": "out.nrrd"},
        {"case": "pushed", "input": "ct.nii.gz", "scenario": "push.json", "write-field": "field.mha"},
        {"case": "cut-short", "input": "cut-short.nii.gz", "field": ["identity"]},
        {"case": "no-volume", "input": "no-volume.nii.gz", "field": ["identity"]},
        {"case": "gap", "input": "gap", "field": ["identity"]},
        {"case": "torn-slice", "input": "torn", "field": ["identity"]},
        {"case": "torn-field", "input": "ct.nii.gz", "field": ["torn.mha"]},
        {"case": "no-series", "input": "empty", "field": ["identity"]},
    ]
    return "".join(json.dumps(row) + "\n" for row in rows)


def make_pull_field(tetwarp, folder):
    made = run(tetwarp, folder, "invert", "wave.mha", "--like", "ct.nrrd", "-o", "pull.mha")
    need(made.returncode == 0, made.stderr)


def check_named_folders(out):
    """Whatever has a name is whole."""
    whole = 0
    for folder in out.iterdir():
        if not folder.is_dir() or folder.name.startswith("."):
            continue
        record = folder / "case.json"
        need(record.exists(), f"{folder} has its name and no record")
        files = json.loads(record.read_text())["files"]
        found = {name: sha for name, sha in tree(folder).items() if name != "case.json"}
        need(found == {name: file["sha256"] for name, file in files.items()}, f"{folder} has its name and is not whole")
        whole += 1
    return whole


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("tetwarp")
    parser.add_argument("--data")
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--seed", type=int, default=random.SystemRandom().randrange(1 << 30))
    parser.add_argument("--record")
    options = parser.parse_args()
    tetwarp = str(pathlib.Path(options.tetwarp).resolve())
    rng = random.Random(options.seed)
    said = [f"seed {options.seed}"]
    with tempfile.TemporaryDirectory(prefix="tetwarp-batch-") as scratch:
        folder = pathlib.Path(scratch)
        make_inputs(tetwarp, folder, options.full)
        make_pull_field(tetwarp, folder)
        rows = rows_of_data(tetwarp, folder, options.data, options.full) if options.data else []
        (folder / "manifest.jsonl").write_text(manifest_of(rows, options.full))
        for name in ("calm", "killed"):
            (folder / name).mkdir()
        batch = ["batch", "../manifest.jsonl", "-o", "out", "--quiet"]
        begun = time.time()
        calm = run(tetwarp, folder / "calm", *batch)
        seconds = time.time() - begun
        need(calm.returncode == 3, f"status {calm.returncode}, expected 3: {calm.stderr}")
        lines = [json.loads(line) for line in (folder / "calm/out/results.jsonl").read_text().splitlines()]
        status = {line["case"]: line["status"] for line in lines}
        need(len(lines) >= 40, f"{len(lines)} cases, at least 40 are meant")
        not_done = {case for case, word in status.items() if word != "done"}
        need(not_done == BROKEN, f"not done: {sorted(not_done)}, expected {sorted(BROKEN)}")
        need(check_named_folders(folder / "calm/out") == len(lines) - len(BROKEN), "folders and results differ in number")
        said.append(f"{len(lines)} cases, {len(BROKEN)} of them broken; undisturbed in {seconds:.1f} s, status 3")
        resume = []
        for kill in range(options.kills):
            process = subprocess.Popen([tetwarp, *batch, *resume], cwd=folder / "killed", stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(rng.uniform(0.02, 2 * seconds / (options.kills + 1)))
            process.send_signal(signal.SIGKILL)
            process.wait()
            out = folder / "killed/out"
            whole = check_named_folders(out) if out.exists() else 0
            partial = len([p for p in out.glob(".tetwarp-*")]) if out.exists() else 0
            said.append(f"kill {kill + 1}: {'ended before' if process.returncode != -9 else 'in work'}, {whole} cases whole, {partial} unfinished")
            resume = ["--resume"] if (out / "batch.json").exists() else []
        last = run(tetwarp, folder / "killed", *batch, *resume)
        need(last.returncode == 3, f"status {last.returncode}, expected 3: {last.stderr}")
        one, other = tree(folder / "calm/out"), tree(folder / "killed/out")
        different = sorted(name for name in one.keys() | other.keys() if one.get(name) != other.get(name))
        need(not different, f"{len(different)} files differ: {different[:10]}")
        said.append(f"after the last --resume: {len(one)} files, all with the bytes of the undisturbed run")
    print("\n".join(said))
    if options.record:
        with open(options.record, "a") as record:
            record.write("\n".join("- " + line for line in said) + "\n")


main()
