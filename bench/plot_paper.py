#!/usr/bin/env python3
"""Draws what `tetwarp bench paper --json` measured.

    bench/plot_paper.py paper.json paper.svg

Upper row: time of every method by field, at 512 x 512 x 300 (or the largest size measured), once with the field evaluated in
the kernel and once with the field read from memory. Lower row, where it was measured: time against the number of slices, and
against the edge of the cells, for one field. Bars and points are medians, whiskers quartiles. Tetwarp's time includes what
it does to the field before it resamples (hatched). The suffix of the second name decides the format.
"""
import json
import math
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.lines import Line2D  # noqa: E402
from matplotlib.patches import Patch  # noqa: E402

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
    return [run for run in runs if tuple(run["size"]) == size], " x ".join(str(n) for n in size)


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


def title_of(document):
    machine, options = document["machine"], document["options"]
    on_gpu = machine.get("gpu") and options["backend"] != "cpu"
    device = machine["gpu"] if on_gpu else f"{machine['cpu']}, {machine['threads']} threads (CPU)"
    inverse = "" if options["inverse"] == "as compiled" else f", inverse at {options['inverse']}"
    return (f"tetwarp bench paper on {device}, commit {document['commit']}\n"
            f"{document['input']['kind']}, median of {options['frames']} frames with quartiles{inverse}")


def draw(document):
    runs = document["runs"]
    fine = select(runs, cell_size=min(run["cell_size"] for run in runs))  # cells of one voxel, but for --methods gascon
    coarse = [run for run in runs if run["cell_size"] > 1]
    bars, size = of_one_size(fine)
    slices = [run for run in fine if run["method"] in ("paper", "tetwarp") and run["size"][:2] == bars[0]["size"][:2]]
    sources = [source for source in SOURCES if select(bars, field_source=source)]
    lower = [(draw_slices, slices)] if len({run["size"][2] for run in slices}) > 1 else []
    lower += [(draw_cells, coarse)] if len({run["cell_size"] for run in coarse}) > 1 else []

    figure = plt.figure(figsize=(13, 9.5 if lower else 5.5))
    rows = figure.add_gridspec(2 if lower else 1, 1, left=0.07, right=0.985, top=0.89 if lower else 0.82,
                               bottom=0.15 if lower else 0.2, hspace=0.3)
    methods = in_order((run["method"] for run in bars), list(COLOURS))
    fields = list(dict.fromkeys(run["field"] for run in bars))
    for source, cell in zip(sources, rows[0].subgridspec(1, len(sources), wspace=0.16)):
        axes = figure.add_subplot(cell)
        draw_bars(axes, select(bars, field_source=source), methods, fields)
        axes.set_title(f"{SOURCES[source][0]}: {size}, {cells_of(bars)}", fontsize=11)
        scale(axes, bars)
    if lower:
        for (draw_panel, measured), cell in zip(lower, rows[1].subgridspec(1, 2, wspace=0.16)):
            draw_panel(figure.add_subplot(cell), measured)
    draw_legend(figure, bars + [run for _, measured in lower for run in measured], bool(lower))
    figure.suptitle(title_of(document), fontsize=13, y=0.975)
    return figure


def main(arguments):
    if len(arguments) != 2:
        sys.exit("usage: plot_paper.py paper.json paper.svg")
    with open(arguments[0], encoding="utf-8") as file:
        document = json.load(file)
    if not document.get("runs"):
        sys.exit(f"plot_paper.py: error: no runs in {arguments[0]}; give the file that tetwarp bench paper --json wrote")
    plt.rcParams.update(STYLE)
    metadata = {"Date": None} if arguments[1].endswith(".svg") else None
    draw(document).savefig(arguments[1], metadata=metadata, dpi=100)


if __name__ == "__main__":
    main(sys.argv[1:])
