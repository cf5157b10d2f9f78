# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Draws what `tetwarp bench paper --json` measured.

Upper row: time of every method by field, at 512 x 512 x 300 (or the largest size measured), once with the field
evaluated in the kernel and once with the field read from memory. Lower row, where it was measured: time against the
number of slices, and against the edge of the cells, for one field. Bars and points are medians, whiskers quartiles.
Tetwarp's time includes what it does to the field before it resamples (hatched). Last row, where ours has the paper's
sizes and settings: the paper's own times of its Tables 2 and 3 and ours beside them, for its fields as it writes them.
"""
import math

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.lines import Line2D  # noqa: E402
from matplotlib.patches import Patch  # noqa: E402

from published import GPUS, METHODS, TWIN, published  # noqa: E402
from tables import size_text  # noqa: E402

# Colours of Okabe and Ito, which readers with any colour vision tell apart.
COLOURS = {
    "inverse4x4-double": "#999999",
    "inverse3x3-double": "#56B4E9",
    "inverse3x3-float": "#0072B2",
    "paper": "#009E73",
    "gascon": "#CC79A7",
    "tetwarp": "#D55E00",
}
SOURCES = {"kernel": ("field evaluated in the kernel", "-", "o"), "memory": ("field read from memory", "--", "s")}
PAPER_GPUS = dict(zip(GPUS, "^v"))  # the paper's, and their marks
PAPER_SIZE = (512, 512, 300)
LINE_FIELD = "wave"  # the one of the lower row, where it was measured
LOG_FROM = 30.0  # from about this ratio on, a linear axis hides the short bars
STYLE = {
    "font.size": 11,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "hatch.linewidth": 0.8,
    "svg.hashsalt": "tetwarp",  # the same numbers give the same bytes
}


class Times:
    """Median and quartiles of one run, ms. `field` is the part of the median that is spent on the field beforehand."""

    def __init__(self, run):
        kernel, total = run["kernel_ms"], run["total_ms"] or run["kernel_ms"]
        self.median = total["median"]
        self.kernel = min(kernel["median"], self.median)
        self.field = self.median - self.kernel
        self.whiskers = (self.median - total["q1"], total["q3"] - self.median)


def in_order(values, order):
    """The distinct values: those that `order` names in its order, then the others."""
    present = list(dict.fromkeys(values))
    return [v for v in order if v in present] + [v for v in present if v not in order]


def select(runs, **wanted):
    return [run for run in runs if all(run[key] == value for key, value in wanted.items())]


def of_one_size(runs):
    sizes = {tuple(run["size"]) for run in runs}
    size = PAPER_SIZE if PAPER_SIZE in sizes else max(sizes, key=math.prod)
    return [run for run in runs if tuple(run["size"]) == size], size_text(size)


def cells_of(runs):
    edge = runs[0]["cell_size"]
    return f"cells of {edge} voxel" + ("s" if edge > 1 else "")


def of_one_field(runs):
    fields = in_order((run["field"] for run in runs), [LINE_FIELD])
    return select(runs, field=fields[0]), fields[0]


def scale(axes, runs):
    """Logarithmic where the times are far apart, else from zero."""
    times = [Times(run) for run in runs]
    top = max(t.median + t.whiskers[1] for t in times)
    bottom = min(t.kernel for t in times)
    if bottom > 0 and top / bottom > LOG_FROM:
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.set_ylim(10 ** math.floor(math.log10(bottom)), top * 1.3)
    else:
        axes.set_ylim(0, top * 1.05)
    axes.grid(axis="y", color="#DDDDDD")
    axes.set_ylabel("ms a frame")


def draw_bars(axes, runs, methods, fields):
    """One group of bars a field, one bar a method."""
    width = 0.84 / len(methods)
    for run in runs:
        times, colour = Times(run), COLOURS.get(run["method"], "black")
        x = fields.index(run["field"]) + (methods.index(run["method"]) - (len(methods) - 1) / 2) * width
        axes.bar(x, times.kernel, 0.9 * width, color=colour, edgecolor=colour)
        if times.field > 0:
            axes.bar(x, times.field, 0.9 * width, bottom=times.kernel, color="white", edgecolor=colour, hatch="/////")
        axes.errorbar(x, times.median, [[w] for w in times.whiskers], color="black", capsize=3, linewidth=1.2)
    axes.set_xticks(range(len(fields)), fields)
    axes.tick_params(axis="x", length=0)


def draw_lines(axes, runs, position):
    """Time against `position` of a run, one line a method and field source."""
    for method in in_order((run["method"] for run in runs), list(COLOURS)):
        for source, (_, line, marker) in SOURCES.items():
            points = sorted(select(runs, method=method, field_source=source), key=position)
            times = [Times(run) for run in points]
            if points:
                axes.errorbar([position(run) for run in points], [t.median for t in times],
                              list(zip(*(t.whiskers for t in times))), color=COLOURS.get(method, "black"),
                              linestyle=line, marker=marker, markersize=6, capsize=3)


def draw_slices(axes, runs):
    shown, field = of_one_field(runs)
    draw_lines(axes, shown, lambda run: run["size"][2])
    axes.set_xlim(left=0)
    axes.set_xlabel("slices: " + ", ".join(str(n) for n in sorted({run["size"][2] for run in shown})))
    axes.set_title(f"{field}, {shown[0]['size'][0]} x {shown[0]['size'][1]}, {cells_of(shown)}", fontsize=11)
    scale(axes, shown)


def draw_cells(axes, runs):
    shown, field = of_one_field(runs)
    shown, size = of_one_size(shown)
    axes.set_xscale("log", base=2)
    draw_lines(axes, shown, lambda run: run["cell_size"])
    axes.set_xticks(edges := sorted({run["cell_size"] for run in shown}), edges)
    axes.minorticks_off()
    axes.set_xlabel("edge of a cell, voxels")
    axes.set_title(f"{field}, {size}, larger cells", fontsize=11)
    scale(axes, shown)


def draw_legend(figure, runs, with_lines):
    handles = [Patch(color=COLOURS.get(m, "black"), label=m) for m in in_order((r["method"] for r in runs), list(COLOURS))]
    if any(Times(run).field > 0 for run in runs):
        handles.append(Patch(facecolor="white", edgecolor=COLOURS["tetwarp"], hatch="/////",
                             label="tetwarp: preparing the field"))
    if with_lines:
        handles += [Line2D([], [], color="black", linestyle=line, marker=marker, label=text)
                    for text, line, marker in SOURCES.values()]
    figure.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.5, 0.0), ncol=5, frameon=False)


def cells_beside(document):
    """The paper's times of Tables 2 and 3 that have ours beside them, each once."""
    cells = {}
    for cell in published(document)["times"]:
        if cell["table"] < 4 and any(ours["ms"] for ours in cell["ours"]):
            cells.setdefault((cell["transform"], cell["method"], cell["gpu"]), cell)
    return cells


def draw_beside(axes, cells):
    """A column a transform and method; the paper's GPUs as grey triangles, ours as circles in the method's colour."""
    transforms = list(dict.fromkeys(transform for transform, _, _ in cells))
    columns = [(transform, method) for transform in transforms for method in METHODS]
    for (transform, method, gpu), cell in cells.items():
        x = columns.index((transform, method))
        axes.plot(x, cell["ms"], PAPER_GPUS[gpu], color="#555555", markersize=8)
        for ours in cell["ours"]:
            if not ours["ms"]:
                continue
            twin, large = ours["method"].endswith(TWIN), ours["amplitude"] > 1
            axes.plot(x + (0.12 if twin else -0.12), ours["ms"], "o", color=COLOURS[method],
                      markerfacecolor="white" if twin else COLOURS[method], markersize=9 if large else 5.5)
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.grid(axis="y", color="#DDDDDD")
    axes.set_ylabel("ms a frame")
    labels = [transform + "\n" + method.replace("-", "\n") for transform, method in columns]
    axes.set_xticks(range(len(columns)), labels, fontsize=9)
    axes.set_title("the paper's Tables 2 and 3, and ours with its fields as written, field evaluated in the kernel",
                   fontsize=11)
    black = {"color": "black", "linestyle": "none", "marker": "o"}
    handles = [Line2D([], [], color="#555555", linestyle="none", marker=marker, label=gpu)
               for gpu, marker in PAPER_GPUS.items()]
    handles += [Line2D([], [], markersize=5.5, label="ours, amplitude 1", **black),
                Line2D([], [], markersize=9, label="ours, amplitude 16", **black),
                Line2D([], [], markerfacecolor="white", label="open: inverse for every voxel", **black)]
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.19), ncol=5, frameon=False)


def title_of(document):
    machine, options = document["machine"], document["options"]
    on_gpu = machine.get("gpu") and options["backend"] != "cpu"
    device = machine["gpu"] if on_gpu else f"{machine['cpu']}, {machine['threads']} threads (CPU)"
    return (f"tetwarp bench paper on {device}, commit {document['commit']}\n"
            f"{document['input']['kind']}, median of {options['frames']} frames with quartiles")


def drawn_as_bars(runs):
    """Without what only stands beside the paper's numbers, unless nothing else was run."""
    return [run for run in runs if TWIN not in run["method"] and "-paper-" not in run["field"]] or runs


def draw(document):
    beside = cells_beside(document)
    runs = drawn_as_bars(document["runs"])
    fine = select(runs, cell_size=min(run["cell_size"] for run in runs))  # cells of one voxel, but for --methods gascon
    coarse = [run for run in runs if run["cell_size"] > 1]
    bars, size = of_one_size(fine)
    slices = [run for run in fine if run["method"] in ("paper", "tetwarp") and run["size"][:2] == bars[0]["size"][:2]]
    sources = [source for source in SOURCES if select(bars, field_source=source)]
    lower = [(draw_slices, slices)] if len({run["size"][2] for run in slices}) > 1 else []
    lower += [(draw_cells, coarse)] if len({run["cell_size"] for run in coarse}) > 1 else []

    count = 1 + bool(lower) + bool(beside)
    margin = 1.7 if beside else 1.4  # inches, of the legends
    height = 0.1 + margin + 4 * count
    figure = plt.figure(figsize=(13, height))
    grid = figure.add_gridspec(count, 1, left=0.07, right=0.985, top=1 - 1 / height, bottom=margin / height,
                               hspace=0.35)
    methods = in_order((run["method"] for run in bars), list(COLOURS))
    fields = list(dict.fromkeys(run["field"] for run in bars))
    for source, cell in zip(sources, grid[0].subgridspec(1, len(sources), wspace=0.16)):
        axes = figure.add_subplot(cell)
        draw_bars(axes, select(bars, field_source=source), methods, fields)
        axes.set_title(f"{SOURCES[source][0]}: {size}, {cells_of(bars)}", fontsize=11)
        scale(axes, bars)
    if lower:
        for (draw_panel, measured), cell in zip(lower, grid[1].subgridspec(1, 2, wspace=0.16)):
            draw_panel(figure.add_subplot(cell), measured)
    if beside:
        draw_beside(figure.add_subplot(grid[count - 1]), beside)
    draw_legend(figure, bars + [run for _, measured in lower for run in measured], bool(lower))
    figure.suptitle(title_of(document), fontsize=13, y=1 - 0.25 / height)
    return figure


def save(document, path):
    """The suffix of the path decides the format."""
    plt.rcParams.update(STYLE)
    draw(document).savefig(path, metadata={"Date": None} if str(path).endswith(".svg") else None, dpi=100)
