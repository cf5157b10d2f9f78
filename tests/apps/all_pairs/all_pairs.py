# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Features together: cases in which every pair of choices occurs (table.py), each run and judged.

    all_pairs.py PROGRAM [--part I/N] [--third T | --seed S [--case N]] [--keep FOLDER] [--list]

PROGRAM is tetwarp. Of the cases of a seed a third is run, of which the hash of the commit decides: in a few commits all
have their turn, and a commit always has the same ones. TETWARP_CI_FULL=1 takes all cases of three seeds, whose triples
differ; --seed takes all of one. A case that fails is named with its number, its choices, and the command line; `--seed S
--case N --keep FOLDER` runs it alone and leaves all its files. Exit status 77: a module is missing.
"""
import argparse
import json
import os
import pathlib
import shlex
import shutil
import subprocess
import sys
import tempfile
import traceback

try:
    import nibabel  # noqa: F401
    import numpy as np
    import pydicom  # noqa: F401
except ImportError as error:
    print(error)
    sys.exit(77)

import table
from command import SCENARIOS, World
from covering import Covering
from judge import Truth, Wrong, check, check_alike, check_files, check_refusal, contents, without_backends
from outputs import Outputs, check_privacy


# Choices of a run that is made for comparison.
PLAIN = {"output": ".nrrd", "with": "none", "points": "none", "coverage": "none", "inverse": "none", "jacobian": "none",
         "folds": "none", "write-field": "none", "mass": "none", "deidentify": "none", "bids": "none",
         "keep-frame": "none", "compress": "none", "preview": "none", "report": "none", "memory": "none"}


class Result:
    def __init__(self, done):
        self.status = done.returncode
        self.output, self.error = (stream.decode(errors="replace") for stream in (done.stdout, done.stderr))


class Program:
    def __init__(self, path, temporary):
        self.path, self.temporary = path, pathlib.Path(temporary)
        self.temporary.mkdir()

    def run(self, arguments, folder="."):
        environment = {**os.environ, "TMPDIR": str(self.temporary), "LC_ALL": "C.UTF-8"}
        done = subprocess.run([self.path, *arguments], cwd=folder, env=environment, capture_output=True, timeout=120)
        return Result(done)

    def must(self, arguments, folder="."):
        result = self.run(arguments, folder)
        command = "tetwarp " + shlex.join(map(str, arguments))
        check(result.status == 0, f"status {result.status}: {result.error.strip()!r} of {command}")
        for line in result.error.splitlines():
            check(line.startswith(("tetwarp: ", "wrote ", "simulated: ")), f"it said {line!r}")
        self.check_temporary()
        return result

    def check_temporary(self):
        left = sorted(path.name for path in self.temporary.iterdir())
        check(not left, f"temporary files are left: {left}")

    def has_device(self):
        line = next(line for line in self.run(["--version"]).output.splitlines() if "cuda:" in line)
        return "usable" in line and "not" not in line


class Cases:
    def __init__(self, program, folder, has_device):
        self.program, self.folder, self.has_device = program, pathlib.Path(folder), has_device
        self.rules = table.rules(has_device)
        (self.folder / "world").mkdir()
        self.world = World(self.folder / "world", program.must)

    def place(self, name):
        (self.folder / "runs" / name / "out").mkdir(parents=True)
        return self.folder / "runs" / name

    def run(self, case):
        """@return  all that is wrong with a case: texts"""
        shutil.rmtree(self.folder / "runs", ignore_errors=True)
        problems = []

        def attempt(judge, *arguments):
            try:
                return judge(*arguments)
            except Wrong as wrong:
                problems.append(str(wrong))
            except Exception as error:
                place = traceback.extract_tb(error.__traceback__)[-1]
                problems.append(f"{type(error).__name__}: {error}, {place.filename}:{place.lineno}")

        refusals = [rule for rule in self.rules if rule.holds(case)]
        if refusals:
            attempt(self.refused, case, refusals)
            return problems
        files = attempt(self.alone, case)
        if files is not None:
            attempt(self.on_threads, case, files)
            if self.has_device and "springs" not in case["field"]:
                attempt(self.on_both_backends, case)
            if case["run"] == "batch":
                attempt(self.in_batch, case, files)
        truth = attempt(self.truth, case)
        if truth is None:
            return problems
        for judge in truth.checks():
            attempt(judge)
        if files is not None:
            for judge in Outputs(self.world, case, self.folder / "runs/plain/out", truth).checks():
                attempt(judge)
        if case["field"] in SCENARIOS:
            attempt(self.from_written, case, truth)
        if case["grid"] == "same" and truth.kind not in ("pull", "short"):
            attempt(self.by_inverse, case, truth)
        is_plain = case["grid"] == "same" and case["outside"] == "refuse" and case["field"] not in SCENARIOS
        if is_plain or truth.kind == "pull":
            attempt(self.by_commands, case, truth)
        return problems

    def alone(self, case):
        place = self.place("plain")
        result = self.program.must(self.world.arguments(case), place)
        files = contents(place / "out")
        everything = contents(place)
        check(set(everything) == {"out/" + name for name in files}, f"beside OUTPUT lies {sorted(everything)}")
        check_files(place / "out", self.world.files(case))
        check_privacy(files, result.output + result.error, case["deidentify"] != "none")
        return files

    def on_threads(self, case, files):
        for threads, name in ((1, "one thread"), (3, "three threads")):
            place = self.place(name)
            self.program.must(self.world.arguments(case, threads=threads), place)
            check_alike(files, contents(place / "out"), "with " + name)

    def refused(self, case, refusals):
        place = self.place("refused")
        result = self.program.run(self.world.arguments(case), place)
        check_refusal(result, refusals, place)
        check_privacy({}, result.error, False)
        self.program.check_temporary()
        if case["run"] == "batch" and case["backend"] == "auto" and case["memory"] == "none":
            (place / "m.jsonl").write_text(self.world.row(case) + "\n")
            result = self.program.run(["batch", "m.jsonl", "-o", "results", "--quiet"], place)
            check(result.status in (3, 4), f"a batch of a case that is refused ends with status {result.status}")
            made = [name for name in contents(place / "results") if name.startswith(("one/", "."))] if (
                place / "results").exists() else []
            check(not made, f"a batch left {made}")
            if case["deidentify"] != "none" and result.status == 3:
                check_privacy(contents(place / "results"), "", True)

    def on_both_backends(self, case):
        files = {}
        for backend in ("cpu", "cuda"):
            other = self.place(backend)
            # A limit is met by streaming on a device alone.
            given = case if backend == "cuda" else {**case, "memory": "none"}
            self.program.must(self.world.arguments(given, backend=backend), other)
            files[backend] = contents(other / "out")
        sidecar = self.world.output(case) + ".json"
        documents = [without_backends(json.loads(files[backend].pop(sidecar))) for backend in files]
        check(documents[0] == documents[1], "another sidecar on the other backend")
        check_alike(files["cpu"], files["cuda"], "on the other backend")

    def in_batch(self, case, files):
        place = self.place("batch")
        (place / "m.jsonl").write_text(self.world.row(case) + "\n")
        result = self.program.run(["batch", "m.jsonl", "-o", "results", "--quiet"], place)
        check(result.status == 0, f"status {result.status} of a batch: {result.error!r}")
        made = contents(place / "results")
        expected = {"one", "batch.json", "batch.lock", "results.jsonl", "summary.txt", "timings.jsonl"}
        check({name.split("/")[0] for name in made} == expected, f"a batch left {sorted(made)}")
        check_privacy(made, result.output + result.error, case["deidentify"] != "none")
        of_case = {name.removeprefix("one/"): data for name, data in made.items() if name.startswith("one/")}
        of_case.pop("case.json")
        alone = dict(files)
        sidecar = self.world.output(case) + ".json"
        texts = [without_backends(json.loads(one.pop(sidecar).decode().replace("results/one/", "out/")))
                 for one in (of_case, alone)]
        for text in texts:
            text.pop("command")
        check(texts[0] == texts[1], "another sidecar in a batch")
        for one in (of_case, alone):
            one.pop("r.json", None)
        check_alike(alone, of_case, "in a batch")

    def truth(self, case):
        """Runs a case with all maps, as files that are easy to read."""
        maps = {"report": case["report"], "coverage": ".mha", "inverse": ".mha"}
        if table.FIELDS[case["field"]] != "pull":
            maps |= {"jacobian": ".nrrd", "folds": ".nii",
                     "write-field": ".vtk" if case["field"] in table.MESHES else ".mha"}
        place = self.place("truth")
        self.program.must(self.world.arguments({**case, **PLAIN, **maps}), place)
        return Truth(self.world, case, place)

    def by_inverse(self, case, truth):
        """Resamples by the inverse as a pull field: values must agree to within the rounding of its samples."""
        place = self.place("by inverse")
        options = {**case, **PLAIN, "field": "pull", "coverage": ".mha"}
        field = ["--pull-field", str(truth.folder / "out/i.mha")]
        self.program.must(self.world.arguments(options, field=field), place)
        truth.check_by_inverse(place / "out")

    def from_written(self, case, truth):
        """The field that a scenario made, written and read again, deforms to the same bits."""
        written = next((truth.folder / "out").glob("w.*"))
        place = self.place("written")
        self.program.must(self.world.arguments({**case, **PLAIN, "inverse": ".mha"}, field=["-f", str(written)]), place)
        for name in ("v.nrrd", "i.mha"):
            one, other = ((run / "out" / name).read_bytes() for run in (truth.folder, place))
            strip = lambda data: b"\n".join(line for line in data.split(b"\n", 16) if not line.startswith(b"descrip"))
            check(strip(one) == strip(other), f"other bytes of {name} from the field that the scenario wrote")


    def by_commands(self, case, truth):
        """`invert` gives what --inverse does, `field` what --write-field does, and pull fields have an inverse too."""
        place, written = self.place("commands"), truth.folder / "out"
        field = self.world.field(case)
        like = ["--like", self.world.input(case)[0], "--quiet"]
        for name, value in self.world.options(case, ""):
            like += ["--" + name, str(value)] if name in ("cell-size", "uneven") else []
        if truth.kind == "pull":
            result = self.program.run(["invert", *field, *like, "-o", "out/f.mha"], place)
            wanted = 4 if case["field"] == "gaps" else 0  # a gap has no inverse
            check(result.status == wanted, f"status {result.status} of invert --pull-field: {result.error!r}")
            return
        self.program.must(["invert", *field[1::2], *like, "-o", "out/i.mha"], place)
        check((place / "out/i.mha").read_bytes() == (written / "i.mha").read_bytes(), "invert differs from --inverse")
        if case["field"] not in table.MESHES:
            self.program.must(["field", *field[1::2], *like, "-o", "out/w.mha"], place)
            check((place / "out/w.mha").read_bytes() == (written / "w.mha").read_bytes(),
                  "field differs from --write-field")


def third_of_commit():
    """0, 1, or 2 by the hash of the commit whose sources these are, 0 where that is not known."""
    done = subprocess.run(["git", "-C", pathlib.Path(__file__).parent, "rev-parse", "HEAD"], capture_output=True)
    return int(done.stdout, 16) % 3 if done.returncode == 0 else 0


def choose(cases, third, part):
    """The cases of a third, or of all thirds if it is None, that belong to a part, with their numbers."""
    index, count = (int(n) for n in part.split("/"))
    return [(n, case) for n, case in enumerate(cases) if third is None or n % 3 == third][index - 1::count]


def describe(case):
    return " ".join(f"{name}={choice}" for name, choice in case.items() if choice != table.FACTORS[name][0])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--part", default="1/1")
    parser.add_argument("--third", type=int, choices=(0, 1, 2))
    parser.add_argument("--seed", type=int)
    parser.add_argument("--case", type=int, nargs="*")
    parser.add_argument("--keep")
    parser.add_argument("--list", action="store_true")
    options = parser.parse_args()
    full = os.environ.get("TETWARP_CI_FULL") == "1"
    seeds = [options.seed] if options.seed is not None else [1, 2, 3] if full else [1]
    third = options.third
    if third is None and options.seed is None and options.case is None and not full:
        third = third_of_commit()
    folder = pathlib.Path(options.keep or tempfile.mkdtemp(prefix="tetwarp-all-pairs-")).resolve()
    folder.mkdir(exist_ok=True)
    program = Program(str(pathlib.Path(options.program).resolve()), folder / "tmp")
    failures = ran = 0
    try:
        has_device = program.has_device()
        if not has_device:
            print("no CUDA device: that bits are alike on both backends is not looked at")
        cases_of = Cases(program, folder, has_device)
        for seed in seeds:
            factors = table.FACTORS
            cases = Covering(factors, cases_of.rules, seed=seed).cases()
            print(f"seed {seed}: {len(cases)} cases" + (f", of these third {third}" if third is not None else ""))
            for number, case in choose(cases, third, options.part):
                if options.case is not None and number not in options.case:
                    continue
                if options.list:
                    print(number, describe(case))
                    continue
                ran += 1
                problems = cases_of.run(case)
                if problems:
                    failures += 1
                    again = [sys.argv[0], options.program, "--seed", str(seed), "--case", str(number)]
                    print(f"\nFAILED case {number} of seed {seed}: {describe(case)}", *problems,
                          shlex.join([options.program, *cases_of.world.arguments(case)]),
                          f"again: {shlex.join(again)} --keep FOLDER", sep="\n  ", flush=True)
    finally:
        if not options.keep:
            shutil.rmtree(folder)
    print(f"{ran} cases, {failures} failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
