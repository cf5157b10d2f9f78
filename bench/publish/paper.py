# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""The tables of the paper with Tetwarp's rows and the paper's own numbers, what each result is worth, and Appendix A,
from what `tetwarp bench paper --json` wrote; and the same numbers as CSV."""
from published import AMPLITUDES, DATA, GPUS, RTX, TWIN, Beside, field_of, published
from tables import cpu_text, cuda_text, fixed, ms_cell, section, size_text, table, title_line

SOURCES = ("kernel", "memory")
TABLE_2 = ["inverse4x4-double", "inverse3x3-double", "inverse3x3-float"]
TABLE_3 = ["inverse3x3-float", "paper"]


def whole_ms(run):
    return (run["total_ms"] or run["kernel_ms"])["median"]


class Runs:
    """The runs of one paper.json, and how they are looked up."""

    def __init__(self, document):
        self.document = document
        self.runs = document["runs"]
        self.found = {}
        for run in self.runs:
            self.found.setdefault(self.key(run, run["method"], run["field_source"]), run)

    @staticmethod
    def key(run, method, source):
        return (*run["size"], run["field"], run["cell_size"], method, source)

    def like(self, run, method, source):
        return self.found.get(self.key(run, method, source))

    def speed_up(self, run, than):
        """How many times as fast as another method on the same field, lattice and source; Tetwarp with its set_field."""
        other = self.like(run, than, run["field_source"])
        return whole_ms(other) / whole_ms(run) if other else None

    def cases(self, coarse):
        """One run a volume, field and lattice, in the order in which they were run."""
        cases = {}
        for run in self.runs:
            if (run["cell_size"] > 1) == coarse:
                cases.setdefault((*run["size"], run["field"], run["cell_size"]), run)
        return cases.values()


def introduction(document):
    machine, options = document["machine"], document["options"]
    place = (f"- CUDA: {cuda_text(machine)}\n" if options["backend"] == "cuda" else
             "- CPU: the same loops in plain C++, sampling in software, float; no copies\n")
    return title_line(document) + place + (
        f"- host: {cpu_text(machine)}\n- input: {document['input']['kind']}, int16, linear interpolation\n"
        f"- {options['frames']} timed frames after {options['warmup']}\n- inverse: as compiled. The source says every "
        "candidate voxel; a compiler may move it out of that loop, to once a tetrahedron. In the methods -per-voxel it is "
        "kept there\n\n")


BESIDE_NOTE = """\
The paper's times are the mean of 500 frames and hold the formula, the inverse and the sampling, not the picture; ours are
medians, the field evaluated in the kernel. Its Eqs. 14 to 16 have no amplitude: as they are written, t = pi / 2, times 1
and 16 voxels, which is our choice (`bench/paper/fields.h`). Methods "-per-voxel" compute the inverse for every candidate voxel,
as the paper did where it timed its Table 2 (a); the others as compiled. A ratio is the paper's time over ours. It stands
only where size, formula and settings are the same; the GPUs never are.

"""


def beside_tables(document):
    """The paper's Tables 1 to 4 and what it counts, cell by cell, with ours beside them."""
    beside, found = Beside(document), published(document)

    def sub(title, names, rows):
        return f"### {title}\n\n" + table(names, rows) + "\n"

    def rows_of(number, gpus):
        cells = [cell for cell in found["times"] if cell["table"] == number]
        for first in (cell for cell in cells if cell["gpu"] == gpus[0]):
            same = [cell for gpu in gpus for cell in cells if cell["gpu"] == gpu and all(
                cell[key] == first[key] for key in ("column", "transform", "data"))]
            for amplitude, method, run in beside.ways(first):
                ours = run and run["kernel_ms"]["median"]
                yield first, [method, f"{amplitude:.0f}"] + [f"{cell['ms']:.2f}" for cell in same] + [
                    ms_cell(run and run["kernel_ms"])] + [fixed(ours and cell["ms"] / ours) for cell in same]

    def speed_up_rows():
        for printed in (one for one in found["speed_ups"] if one["gpu"] == RTX):
            other = next(one for one in found["speed_ups"] if one["gpu"] != RTX and all(
                one[key] == printed[key] for key in ("table", "transform")))
            for amplitude, ours in zip(AMPLITUDES, printed["ours"]):
                yield [printed["table"], printed["transform"], "(a) / (c)" if printed["table"] == 2 else "(a) / (b)",
                       f"{printed['ratio']:.2f}", f"{other['ratio']:.2f}", f"{amplitude:.0f}",
                       fixed(ours["as_compiled"]), fixed(ours["per_voxel"])]

    columns = ["amplitude", "RTX 2080, ms", "GTX 1650 Mobile, ms", "ours, ms", "RTX 2080 / ours", "GTX 1650 Mobile / ours"]
    text = "## Beside the paper's own numbers\n\n" + BESIDE_NOTE
    if found["why_apart"]:
        text += ("Where nothing stands beside a number of the paper, it was not measured with its settings: " +
                 "; ".join(found["why_apart"]) + ".\n\n")
    sizes = [run["size"] for run in document["runs"]]
    text += sub("Table 1: data", ["data", "size", "the paper, MB", "ours"],
                [[name, size_text([512, 512, slices]), f"{megabytes:g}",
                  document["input"]["kind"] if [512, 512, slices] in sizes else "-"]
                 for name, (slices, megabytes) in DATA.items()])
    for number, title in ((2, "Table 2: the inverse, abdomen"), (3, "Table 3: what is interpolated, abdomen")):
        text += sub(title, ["transform", "column", "method here"] + columns,
                    [[cell["transform"], f"({cell['column']})"] + rest for cell, rest in rows_of(number, GPUS)])
    text += sub("Table 4: data sets, Wave",
                ["data", "slices", "method here", "amplitude", "GTX 1650 Mobile, ms", "ours, ms", "GTX 1650 Mobile / ours"],
                [[cell["data"], cell["slices"]] + rest for cell, rest in rows_of(4, GPUS[1:])])
    text += sub("Speed-ups", ["table", "transform", "speed-up", "RTX 2080", "GTX 1650 Mobile", "amplitude",
                              "ours, as compiled", "ours, inverse per voxel"], speed_up_rows())
    return text + sub("What it counts and claims", ["what", "the paper", "ours"],
                      [[claim["what"], claim["printed"], claim["ours"]] for claim in found["claims"]])


def method_rows(runs, like, methods, labels, than=None):
    """The rows of one case: a method each, two for Tetwarp; both field sources, each with its speed-up."""
    for method in methods:
        sources = [runs.like(like, method, source) for source in SOURCES]
        if not any(sources):
            continue
        for key in ("kernel_ms", "total_ms") if method == "tetwarp" else ("kernel_ms",):
            whole = key == "total_ms" or method != "tetwarp"
            cells = labels + [method + ("" if whole else ", resample alone")]
            for run in sources:
                cells.append(ms_cell(run and run[key]))
                if than:
                    cells.append(fixed(runs.speed_up(run, than)) if whole and run else "")
            yield cells


def measured_tables(runs):
    def speeds(title, methods):
        methods = methods + [method + TWIN for method in methods] + ["tetwarp"]
        return f"## {title}\n\n" + """\
ms, median (q1-q3). Speed-ups are against the first method, with the field from the same place. Tetwarp's time is
set_field and resample, for kernel with the formula before them; "resample alone" is part of it.

""" + table(["size", "field", "method", "field in kernel", "speed-up", "field in memory", "speed-up"],
            [cells for like in runs.cases(False)
             for cells in method_rows(runs, like, methods, [size_text(like["size"]), like["field"]], methods[0])]) + "\n"

    def size_cells(like):
        for source in SOURCES:
            for method, key in (("paper", "kernel_ms"), ("tetwarp", "total_ms")):
                run = runs.like(like, method, source)
                yield ms_cell(run and run[key])

    text = speeds("Table 2: the inverse", TABLE_2) + speeds("Table 3: what is interpolated", TABLE_3)
    text += "## Table 4: the sizes\n\nms, median (q1-q3). Tetwarp with set_field.\n\n" + table(
        ["size", "field", "paper, field in kernel", "tetwarp, field in kernel", "paper, field in memory",
         "tetwarp, field in memory"],
        [[size_text(like["size"]), like["field"], *size_cells(like)] for like in runs.cases(False)]) + "\n"
    text += section("Larger cells", "ms, median (q1-q3). A vertex every few voxels, as simulators have them.",
                    ["size", "field", "cell", "method", "field in kernel", "field in memory"],
                    [cells for like in runs.cases(True) for cells in method_rows(
                        runs, like, ["paper", "gascon", "tetwarp"],
                        [size_text(like["size"]), like["field"], like["cell_size"]])])
    if runs.document["options"]["backend"] == "cpu":
        return text  # nothing is copied: the tables above say it all
    return text + section("From the host's memory and back", """\
ms, median (q1-q3), wall clock, pageable memory. Copy in: the source, and the field where it is in memory. End to end:
copies, clearing the output, and the method (Tetwarp: set_field too).""",
                          ["size", "field", "cell", "method", "field in", "copy in", "copy out", "end to end"],
                          [[size_text(run["size"]), run["field"], run["cell_size"], run["method"], run["field_source"]] +
                           [ms_cell(run[key]) for key in ("copy_in_ms", "copy_out_ms", "end_to_end_ms")]
                           for run in runs.runs])


def quality_table(runs):
    counts = ("exact_covered", "writes", "voxels_lost", "voxels_multiple", "voxels_spilled")

    def rows():
        for run in runs.runs:
            tallies = [other and [other[key] for key in counts + ("largest_difference", "mean_difference")]
                       for other in (runs.like(run, run["method"], source) for source in SOURCES)]
            same = tallies[0] is not None and tallies[0] == tallies[1]
            if not same or run["field_source"] == "kernel":
                yield [size_text(run["size"]), run["field"], run["cell_size"], run["method"],
                       "either" if same else run["field_source"]] + [run[key] for key in counts] + [
                           f"{run['largest_difference']:.0f}", f"{run['mean_difference']:.4f}"]

    return section("What the results are worth", """\
Against Tetwarp's result, which gives every voxel one owner by an exact rule. Lost: covered, and never written. Spilled:
written, and not covered: on the border of the deformed volume, where the closed test takes both sides, and (cells of
several voxels) where the last cells reach more than half a voxel beyond the volume, which the texture clamps.
Differences in stored units, over voxels both covered and written.""",
                   ["size", "field", "cell", "method", "field in", "covered", "writes", "lost", "written more than once",
                    "spilled", "largest difference", "mean difference"], rows())


def appendix(document):
    found = document["appendix_a"]
    first = found["inverse_first_column"]
    corners = ", ".join(f"{name} ({x:g}, {y:g}, {z:g})" for name, (x, y, z) in found["corners"].items())
    text = f"""\
## Appendix A: the determinant far from the origin

The corners of the paper's Eq. 8, its order of operations, and others that a compiler or a reader may take, since the paper
names neither its compiler nor its flags. {corners}.

"""
    text += table(["form", "the paper", "ours", "difference"], [
        [form["form"], "-" if form["printed"] is None else f"{form['printed']:.7g}", f"{form['determinant']:.9g}",
         "-" if form["printed"] is None else f"{form['determinant'] - form['printed']:.1e}"]
        for form in found["determinants"]]) + "\n"
    text += table(["the inverse begins", "the paper, double", "ours", "the paper, float", "ours"], [
        [f"x of {corner}"] + [f"{first[key][n]:.6f}" for key in ("printed_double", "double", "printed_float", "float")]
        for n, corner in enumerate("ABCD")]) + "\n"
    text += ("Relative errors of the float forms (4 x 4 by minors of differences), random tetrahedra of about one "
             "cell.\n\n")
    return text + table(["coordinates up to", "tetrahedra", "4 x 4, largest", "4 x 4, median", "3 x 3, largest",
                         "3 x 3, median"],
                        [[f"{at['distance']:.0f}", at["tetrahedra"]] +
                         [f"{at[form][which]:.2g}" for form in ("float_4x4", "float_3x3")
                          for which in ("largest", "median")] for at in found["relative_errors"]])


def of_paper(document):
    runs = Runs(document)
    return (introduction(document) + beside_tables(document) + measured_tables(runs) + quality_table(runs) +
            appendix(document))


def csv_of(document):
    """Every number, one line a run; the first line names the columns. A method that was not run leaves its column empty."""
    runs, beside = Runs(document), Beside(document)
    times = ("kernel_ms", "field_ms", "total_ms", "copy_in_ms", "copy_out_ms", "end_to_end_ms")
    parts = ("median", "q1", "q3", "min", "max", "frames")
    counts = ("writes", "voxels_lost", "voxels_multiple", "voxels_spilled")
    slow = ("inverse4x4-double", "inverse3x3-float")
    short = {gpu: gpu.replace("GeForce ", "").replace(" ", "_").lower() for gpu in GPUS}
    cells = {(cell["gpu"], run["field"], run["size"][2], run["method"]): cell["ms"]
             for cell in reversed(published(document)["times"]) for _, _, run in beside.ways(cell) if run}

    def text(value):
        return "" if value is None else f"{value:.9g}"

    names = ["columns", "rows", "slices", "field", "formula", "cell_size", "method", "field_source"]
    names += [f"{key}_{part}" for key in times for part in parts]
    names += [*counts, "largest_difference", "mean_difference", "exact_covered"]
    names += [f"speed_up_over_{method.replace('-', '_')}" for method in slow]
    names += [name for gpu in GPUS for name in (f"published_ms_{short[gpu]}", f"{short[gpu]}_over_ours")]
    lines = [names]
    for run in runs.runs:
        line = [*run["size"], run["field"], f'"{run["formula"]}"', run["cell_size"], run["method"], run["field_source"]]
        line += ["" if run[key] is None else text(run[key][part]) for key in times for part in parts]
        line += [run[key] for key in counts]
        line += [text(run["largest_difference"]), text(run["mean_difference"]), run["exact_covered"]]
        line += [text(runs.speed_up(run, method)) for method in slow]
        has_settings = beside.run(run["field"], run["size"][2], run["method"]) is run
        for gpu in GPUS:
            ms = cells.get((gpu, run["field"], run["size"][2], run["method"])) if has_settings else None
            line += [f"{ms:g}" if ms else "", text(ms and ms / run["kernel_ms"]["median"])]
        lines.append(line)
    return "".join(",".join(map(str, line)) + "\n" for line in lines)
