# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What `tetwarp batch` makes of devices and processors: cases a minute, with one device and with several, beside what device and files take alone.
What a device takes alone comes from a batch with one job: the time that its cases hold the device, one after the other.

    measure_batch.py TETWARP FOLDER [--cases 24] [--size 512,512,300] [--devices 1,2] [--jobs 0] [--rounds 3] [--backend cuda]
                     [--scenario FILE]

FOLDER on a disk measures with files; on a memory file system (/dev/shm) with data in memory. Each source is another phantom. Rounds take turns.
Prints a table of Markdown, of medians.
"""
import argparse
import json
import os
import pathlib
import shutil
import statistics
import subprocess
import time


def run(arguments, **more):
    done = subprocess.run(list(map(str, arguments)), **more)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, arguments))}: status {done.returncode}\n{done.stderr or ''}")
    return done


def copy_seconds(folder, sources, outputs):
    """Reading all sources and writing as much, by copying, to the disk: what files take alone."""
    target = folder / "copy"
    target.mkdir()
    begun = time.time()
    for n, source in enumerate(sources[i % len(sources)] for i in range(outputs)):
        shutil.copyfile(source, target / f"{n}.nii")
        file = os.open(target / f"{n}.nii", os.O_RDONLY)
        os.fsync(file)
        os.close(file)
    seconds = time.time() - begun
    shutil.rmtree(target)
    return seconds


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("tetwarp")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--cases", type=int, default=24)
    parser.add_argument("--sources", type=int, default=4)
    parser.add_argument("--size", default="512,512,300")
    parser.add_argument("--devices", default="1")
    parser.add_argument("--jobs", default="0")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--backend", default="cuda")
    parser.add_argument("--cell-size", type=int, default=8)
    parser.add_argument("--scenario", type=pathlib.Path, help="simulate each field on the device, in the place of a formula")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    sources = [options.folder / f"ct{n}.nii" for n in range(options.sources)]
    for n, source in enumerate(sources):
        if not source.exists():
            run([options.tetwarp, "phantom", "-o", source, "--size", options.size, "--seed", n + 1, "--quiet"])
    field = {"scenario": str(options.scenario.resolve()), "backend": options.backend} if options.scenario else {
        "field": "elastic:amplitude=4..12,spacing=60..90", "cell-size": options.cell_size}
    manifest = options.folder / "m.jsonl"
    manifest.write_text("".join(json.dumps({
        "case": f"c{n:03}", "input": sources[n % len(sources)].name, "seed": n, "output": "out.nii", **field}) + "\n" for n in range(options.cases)))
    found, copies, alone = {}, [], []
    for _ in range(options.rounds):
        copies.append(copy_seconds(options.folder, sources, options.cases))
        for devices, jobs in [("1", "1")] + [(d, j) for d in options.devices.split(",") for j in options.jobs.split(",")]:
            out = options.folder / "out"
            shutil.rmtree(out, ignore_errors=True)
            seen = dict(os.environ)
            if options.backend == "cuda":
                seen["CUDA_VISIBLE_DEVICES"] = ",".join(map(str, range(int(devices))))
            begun = time.time()
            done = run([options.tetwarp, "batch", manifest, "-o", out, "--backend", options.backend, "--jobs", jobs], env=seen,
                       capture_output=True, text=True)
            wall = time.time() - begun
            timings = [json.loads(line) for line in (out / "timings.jsonl").read_text().splitlines()]
            if jobs == "1":
                alone.append(sum(t["on_device"] for t in timings))
            found.setdefault((devices, jobs), []).append((wall, done.stderr.strip().splitlines()[-1]))
    copy, device = statistics.median(copies), statistics.median(alone)
    print(f"{options.cases} cases of {options.size} voxels, int16; copying their files alone takes {copy:.2f} s, a device alone {device:.2f} s\n")
    print("| devices | jobs | s | cases a minute | slower of copying and devices / s | bottleneck |")
    print("| --- | --- | --- | --- | --- | --- |")
    for (devices, jobs), rounds in found.items():
        wall, words = sorted(rounds)[len(rounds) // 2]
        print(f"| {devices} | {jobs} | {wall:.2f} | {60 * options.cases / wall:.1f} | {max(copy, device / int(devices)) / wall:.2f} | "
              f"{words.removeprefix('bottleneck: ')} |")


main()
