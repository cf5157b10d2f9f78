# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Puts what `tetwarp bench paper --json` measured into a document, so that its figures are those of one run.

A part of the document that a program writes stands between two lines, of which the first one names it:

    <!-- paper.json: times -->
    <!-- end -->

What lies between them is replaced.
"""
import re

from paper import SOURCES, whole_ms
from published import GPUS, METHODS, TWIN, published
from tables import size_text
from tables import table as table_of

MAIN_SIZE = [512, 512, 300]
ALL_METHODS = [*METHODS, *(method + TWIN for method in METHODS), "tetwarp"]
OUR_FIELDS = ["identity", "wave", "twist", "bubble"]


def number(value):
    """Three digits, and no more than are there."""
    if value is None:
        return "-"
    if value >= 100:
        return f"{value:.0f}"
    return f"{value:.3g}" if value < 1 else f"{value:.{2 if value < 10 else 1}f}"


def table(names, rows):
    return table_of(names, rows).rstrip("\n")


class Run:
    """One paper.json, and how its numbers are looked up."""

    def __init__(self, document):
        self.document = document
        self.runs = document["runs"]
        self.published = published(document)
        sizes = [run["size"] for run in self.runs]
        self.size = MAIN_SIZE if MAIN_SIZE in sizes else sizes[0]
        self.size_text = size_text(self.size)

    def find(self, method, field, source="kernel", size=None, cell=1):
        for run in self.runs:
            if (run["method"], run["field"], run["field_source"], run["size"], run["cell_size"]) == (
                    method, field, source, size or self.size, cell):
                return run
        return None

    def ms(self, *wanted, of=whole_ms, **more):
        found = self.find(*wanted, **more)
        return None if found is None else of(found)

    def fields(self, among):
        return [field for field in among if any(run["field"] == field for run in self.runs)]

    def written_fields(self):
        return list(dict.fromkeys(run["field"] for run in self.runs if "-paper-" in run["field"]))


def where(run):
    machine, options = run.document["machine"], run.document["options"]
    if options["backend"] == "cuda":
        place = f"one {machine['gpu']}, driver {machine['driver']}, CUDA {machine['cuda_runtime']}"
    else:
        place = f"{machine['cpu']}, {machine['threads']} threads, no GPU"
    return (f"Measured on {place}; commit {run.document['commit']}; {run.document['input']['kind']}; "
            f"medians of {options['frames']} frames after {options['warmup']}.")


def ours_beside(cell_of_gpus):
    """Ours in every way, each with the ratios to the paper's GPUs; `cell_of_gpus`: the paper's cell, one a GPU."""
    cells = []
    for ways in zip(*(cell["ours"] for cell in cell_of_gpus)):
        if ways[0]["ms"] is None:
            cells.append("-")
        else:
            cells.append(number(ways[0]["ms"]) + " (" + ", ".join(number(way["ratio"]) for way in ways) + ")")
    return cells


def ways_of(cells):
    return [f"{way['amplitude']:g} voxel{'s' if way['amplitude'] > 1 else ''}, "
            f"{'inverse per voxel' if way['method'].endswith(TWIN) else 'as compiled'}" for way in cells[0]["ours"]]


def beside_table(number_of_table, by_data=False):
    def text(run):
        cells = [cell for cell in run.published["times"] if cell["table"] == number_of_table]
        gpus = [gpu for gpu in GPUS if any(cell["gpu"] == gpu for cell in cells)]
        rows = []
        for first in (cell for cell in cells if cell["gpu"] == gpus[0]):
            same = [cell for gpu in gpus for cell in cells if cell["gpu"] == gpu and all(
                cell[key] == first[key] for key in ("column", "transform", "data"))]
            label = f"{first['data']}, {first['slices']}" if by_data else first["transform"]
            rows.append([label, f"({first['column']}) `{first['method']}`"] + [f"{cell['ms']:.2f}" for cell in same] +
                        ours_beside(same))
        return table(["data, slices" if by_data else "transform", "column"] + gpus + ways_of(cells), rows)

    return text


def speed_ups(run):
    rows = []
    for printed in (one for one in run.published["speed_ups"] if one["gpu"] == GPUS[0]):
        notebook = next(other for other in run.published["speed_ups"] if other["gpu"] == GPUS[1] and all(
            other[key] == printed[key] for key in ("table", "transform")))
        ours = [f"{number(way['as_compiled'])} / {number(way['per_voxel'])}" for way in printed["ours"]]
        rows.append([f"{printed['table']}, {'(a) / (c)' if printed['table'] == 2 else '(a) / (b)'}",
                     printed["transform"], f"{printed['ratio']:.2f}", f"{notebook['ratio']:.2f}"] + ours)
    return table(["table", "transform", *GPUS, "ours, 1 voxel", "ours, 16 voxels"], rows)


def claims(run):
    return table(["", "the paper", "ours"],
                 [[claim["what"], claim["printed"], claim["ours"]] for claim in run.published["claims"]])


def apart(run):
    reasons = run.published["why_apart"]
    if not reasons:
        return "Every cell of the paper has ours beside it."
    return "Cells of the paper that stand alone were not measured with its settings: " + "; ".join(reasons) + "."


def appendix(run):
    rows = [[form["form"], "-" if form["printed"] is None else f"{form['printed']:.7g}", f"{form['determinant']:.9g}"]
            for form in run.document["appendix_a"]["determinants"]]
    return table(["form", "the paper", "ours"], rows)


def appendix_errors(run):
    rows = [[f"{at['distance']:g}", at["tetrahedra"]] +
            [f"{at[form][which]:.2g}" for form in ("float_4x4", "float_3x3") for which in ("largest", "median")]
            for at in run.document["appendix_a"]["relative_errors"]]
    return table(["coordinates up to", "tetrahedra", "4 x 4, largest", "4 x 4, median", "3 x 3, largest",
                  "3 x 3, median"], rows)


def times(run):
    fields = run.fields(OUR_FIELDS)
    rows = []
    for method in ALL_METHODS:
        cells = [" / ".join(number(run.ms(method, field, source)) for source in SOURCES)
                 for field in fields]
        if any(cell != "- / -" for cell in cells):
            rows.append([f"`{method}`"] + cells)
    resample = [" / ".join(number(run.ms("tetwarp", field, source, of=lambda found: found["kernel_ms"]["median"]))
                           for source in SOURCES) for field in fields]
    rows.append(["of that, `resample` alone"] + resample)
    return f"Median ms, {run.size_text}, field in kernel / in memory:\n\n" + table(["method"] + fields, rows)


def written(run):
    fields = run.written_fields()
    rows = [[f"`{method}`"] + [number(run.ms(method, field)) for field in fields] for method in
            ALL_METHODS]
    return f"Median ms, {run.size_text}, field in kernel:\n\n" + table(["method"] + fields, rows)


def sizes(run):
    shown = sorted({tuple(found["size"]) for found in run.runs}, key=lambda size: size[2])
    rows = [[f"`{method}`"] + [number(run.ms(method, "wave", size=list(size))) for size in shown]
            for method in ("inverse3x3-float", "paper", "tetwarp")]
    return "Wave, field in kernel, by slices:\n\n" + table(["method"] + [str(size[2]) for size in shown], rows)


def cells(run):
    edges = sorted({found["cell_size"] for found in run.runs if found["cell_size"] > 1})
    if not edges:
        return "No larger cells were measured."
    rows = [[f"`{method}`"] + [" / ".join(number(run.ms(method, field, cell=edge)) for field in ("wave", "bubble"))
                               for edge in edges] for method in ("paper", "gascon", "tetwarp")]
    return (f"Larger cells, {run.size_text}, field in kernel, Wave / Bubble:\n\n" +
            table(["method"] + [f"cells of {edge}" for edge in edges], rows))


def span(values):
    values = [value for value in values if value is not None]
    return f"{number(min(values))} to {number(max(values))}" if values else "-"


def findings(run):
    def quotients(slow, fast, fields, sources=SOURCES, of=whole_ms):
        for field in fields:
            for source in sources:
                a, b = run.ms(slow, field, source), run.ms(fast, field, source, of=of)
                if a is not None and b is not None:
                    yield a / b

    ours, theirs = run.fields(OUR_FIELDS), run.written_fields()
    pairs = [("3 x 3 double against 4 x 4 double", "inverse4x4-double", "inverse3x3-double"),
             ("3 x 3 float against 4 x 4 double", "inverse4x4-double", "inverse3x3-float"),
             ("places instead of values (Algorithm 2 against Aguilera)", "inverse3x3-float", "paper"),
             ("Tetwarp, all of it, against Algorithm 2", "paper", "tetwarp")]
    rows = []
    for label, slow, fast in pairs:
        twins = (slow + TWIN, fast if fast == "tetwarp" else fast + TWIN)
        rows.append([label, span(quotients(slow, fast, ours)), span(quotients(slow, fast, theirs)),
                     span(quotients(*twins, ours)), span(quotients(*twins, theirs))])
    return f"How many times as fast, {run.size_text}, from the least to the largest:\n\n" + table(
        ["", "our fields", "the paper's", "our fields, inverse per voxel", "the paper's, inverse per voxel"], rows)


def copies(run):
    rows = []
    for method in ("paper", "tetwarp"):
        for source in SOURCES:
            found = run.find(method, "wave", source)
            if found and found["copy_in_ms"]:
                rows.append([f"`{method}`", source] + [number(found[key]["median"]) for key in (
                    "copy_in_ms", "copy_out_ms", "end_to_end_ms")])
    if not rows:
        return "Nothing is copied on a CPU."
    return f"Wave, {run.size_text}, ms:\n\n" + table(["method", "field in", "copy in", "copy out", "end to end"], rows)


def quality(run):
    def both(key, field, text):
        found = [run.find(method, field) for method in ("inverse3x3-float", "paper")]
        return " / ".join("-" if each is None else str(text(each[key], each)) for each in found)

    rows = []
    for field in run.fields(OUR_FIELDS) + run.written_fields():
        rows.append([field,
                     both("writes", field, lambda n, each: number(n / each["exact_covered"])),
                     both("voxels_multiple", field, lambda n, each: f"{100 * n / each['exact_covered']:.3g} %"),
                     both("voxels_lost", field, lambda n, _: n),
                     both("largest_difference", field, lambda n, _: f"{n:g}"),
                     both("mean_difference", field, lambda n, _: f"{n:.2g}")])
    return (f"{run.size_text}, cells of one voxel, field in kernel, differences in stored units; two numbers are\n"
            "`inverse3x3-float` / `paper`:\n\n" +
            table(["field", "writes a covered voxel", "written more than once", "lost", "largest difference", "mean"],
                  rows))


PARTS = {
    "where": where,
    "table-2": beside_table(2),
    "table-3": beside_table(3),
    "table-4": beside_table(4, by_data=True),
    "speed-ups": speed_ups,
    "claims": claims,
    "apart": apart,
    "appendix": appendix,
    "appendix-errors": appendix_errors,
    "times": times,
    "written": written,
    "sizes": sizes,
    "cells": cells,
    "findings": findings,
    "copies": copies,
    "quality": quality,
}


def fill(text, document):
    """The document's text with every part made anew. Raises ValueError where there is none, or one that nobody makes."""
    run, parts = Run(document), 0

    def made(match):
        nonlocal parts
        parts += 1
        if match[1] not in PARTS:
            raise ValueError(f"no part \"{match[1]}\"; choose from {', '.join(PARTS)}")
        return f"<!-- paper.json: {match[1]} -->\n{PARTS[match[1]](run)}\n<!-- end -->"

    filled = re.sub(r"<!-- paper\.json: (.+?) -->\n.*?<!-- end -->", made, text, flags=re.DOTALL)
    if parts == 0:
        raise ValueError("no part to fill; see --help")
    return filled
