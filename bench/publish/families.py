# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""The tables of every family of measurements but the paper's, from what `tetwarp bench FAMILY --json` wrote."""
from tables import (cpu_text, cuda_text, fixed, floors, ms_cell, over, section, size_text, table, title_line)


def further(run):
    """What a second volume adds to resample."""
    return None if run["two_volumes_ms"] is None else run["two_volumes_ms"]["median"] - run["resample_ms"]["median"]


def stages(run):
    return [ms_cell(run[key]) for key in ("set_field_ms", "resample_ms", "new_field_ms")]


def peer_ms(run, peer):
    return run[peer] and run[peer]["ms"]


def differing(run, peer):
    return f"{100 * run[peer]['differing']:.3f} %" if run[peer] else "-"


def ns_a_voxel(ms, size):
    return "-" if ms is None else f"{ms['median'] * 1e6 / (size[0] * size[1] * size[2]):.2f}"


def of_cpu(document):
    options, scaling = document["options"], document["scaling"]

    def program(name):
        return f"{name} {document[name.lower()] or 'not in this build, left out'}"

    text = title_line(document) + (
        f"- CPU: {cpu_text(document['machine'])}, the same for everything\n"
        f"- beside it: {program('ITK')}; {program('VTK')}\n"
        f"- input: phantom, {size_text([options['width'], options['width'], options['slices']])}, int16, "
        f"linear interpolation\n- {options['repeats']} timed repeats, in turn\n\n")
    text += section("A vertex on every voxel", """\
ms, median (q1-q3). New field is set_field (with the range of Jacobian determinants) and resample. Bytes: reading field
and source once and writing the output once, plain copies on the same threads. Paper: Algorithm 2, field in memory. ITK
warp: WarpImageFilter, given the inverse. Further volume: what a second int16 volume adds to resample.""",
                    ["field", "at rest", "set_field", "resample", "new field", "new field, ns a voxel",
                     "further volume", "bytes", "paper", "ITK warp"],
                    [[run["field"], f"{100 * run['at_rest']:.1f} %"] + stages(run) +
                     [ns_a_voxel(run["new_field_ms"], run["size"]), fixed(further(run)), ms_cell(run["bytes_ms"]),
                      ms_cell(peer_ms(run, "paper")), ms_cell(peer_ms(run, "itk_warp"))]
                     for run in document["runs"]])
    for run in document["runs"]:
        if run["resting"]:
            text += (f"{run['field']}: {100 * run['resting']['share']:.1f} % of the slices rest, and so do those beside "
                     f"them. Resampling these, and set_field of them alone: {ms_cell(run['resting']['new_field_ms'])} "
                     f"ms.\n\n")
    text += section("Against the paper, ITK and memory", """\
"Differ": part of the voxels covered by Tetwarp whose values differ by more than 1. ITK truncates where Tetwarp rounds;
the paper's method leaves voxels out.""",
                    ["field", "paper / new field", "ITK warp / resample", "new field / bytes", "resample / bytes",
                     "paper: differ", "ITK warp: differ"],
                    [[run["field"], fixed(over(peer_ms(run, "paper"), run["new_field_ms"])),
                      fixed(over(peer_ms(run, "itk_warp"), run["resample_ms"])),
                      fixed(over(run["new_field_ms"], run["bytes_ms"])), fixed(over(run["resample_ms"], run["bytes_ms"])),
                      differing(run, "paper"), differing(run, "itk_warp")] for run in document["runs"]])
    text += section("Slow peers", """\
On fewer slices, under the middle of the same fields; the peers once, Tetwarp on this volume too. ms, and ns a voxel. ITK invert and warp:
InvertDisplacementFieldImageFilter with its defaults, then WarpImageFilter. VTK probe: vtkProbeFilter on the deformed
vtkStructuredGrid. "Differ" as above.""",
                    ["field", "size", "peer", "ms", "ns a voxel", "new field, ms", "new field, ns a voxel",
                     "peer / new field", "differ"],
                    [[run["field"], size_text(run["size"]), name, f"{run[peer]['ms']['median']:.0f}",
                      ns_a_voxel(run[peer]["ms"], run["size"]), ms_cell(run["new_field_ms"]),
                      ns_a_voxel(run["new_field_ms"], run["size"]), fixed(over(run[peer]["ms"], run["new_field_ms"])),
                      differing(run, peer)]
                     for run in document["slow_peers"]
                     for peer, name in (("itk_invert_and_warp", "ITK invert and warp"), ("vtk_probe", "VTK probe"))
                     if run[peer]])
    text += section("Larger cells", "", ["field", "cell", "set_field", "resample", "new field", "new field, ns a voxel"],
                    [[run["field"], run["cell_size"]] + stages(run) + [ns_a_voxel(run["new_field_ms"], run["size"])]
                     for run in document["larger_cells"]])
    text += section("From small to large", "", ["field", "size", "set_field, ns a voxel", "resample", "new field", "bytes"],
                    [[run["field"], size_text(run["size"])] +
                     [ns_a_voxel(run[key], run["size"]) for key in ("set_field_ms", "resample_ms", "new_field_ms",
                                                                    "bytes_ms")] for run in document["growth"]])
    for size in document["growth_left_out"] if document["growth"] else []:
        text += f"Left out, {size_text(size)}: not enough memory is free.\n\n"
    if scaling:
        text += section("Threads", "Efficiency: the time on one thread, over the time on all times their number.",
                        [f"{scaling['field']}, threads", "set_field", "resample", "new field"],
                        [[1] + stages(scaling["one"]), [scaling["threads"]] + stages(scaling["all"])])
        text += f"Efficiency of a new field: {scaling['efficiency']:.2f}.\n\n"
    return text + floors(document)


def of_gpu(document):
    machine, options, copies, size = (document[key] for key in ("machine", "options", "copies", "size"))
    first = [run for run in document["runs"] if run["size"] == size]
    text = title_line(document) + (
        f"- CUDA: {cuda_text(machine)}\n- host: {cpu_text(machine)}\n"
        f"- input: {document['input']['kind']}, {size_text(size)}, int16, linear interpolation in float\n"
        f"- {options['frames']} timed frames after {options['warmup']}\n"
        f"- copy on the device, ms: volume {ms_cell(copies['volume_ms'])}, field {ms_cell(copies['field_ms'])}\n"
        f"- floors, ms: source and output {copies['volume_floor_ms']:.3f}, source, field and output "
        f"{copies['bytes_floor_ms']:.3f}\n\n")
    text += section("A vertex on every voxel", """\
ms, median (q1-q3). New field is set_field and resample. Paper: Algorithm 2, field in memory. Backward: a warp that is
given the inverse, float3 coordinates in memory, trilinear. Further volume: what a second int16 volume adds to resample.""",
                    ["field", "at rest", "set_field", "resample", "new field", "further volume", "paper", "backward",
                     "paper / resample", "paper / new field", "resample / bytes"],
                    [[run["field"], f"{100 * run['at_rest']:.1f} %"] + stages(run) +
                     [fixed(further(run), 3), ms_cell(run["paper_ms"]), ms_cell(run["backward_ms"]),
                      fixed(over(run["paper_ms"], run["resample_ms"])), fixed(over(run["paper_ms"], run["new_field_ms"])),
                      fixed(run["resample_ms"]["median"] / copies["bytes_floor_ms"])]
                     for run in first if run["cell_size"] == 1])
    text += section("Larger cells", "", ["field", "cell", "set_field", "resample", "new field", "further volume", "paper",
                                         "gascon", "new field / copy"],
                    [[run["field"], run["cell_size"]] + stages(run) +
                     [fixed(further(run), 3), ms_cell(run["paper_ms"]), ms_cell(run["gascon_ms"]),
                      fixed(run["new_field_ms"]["median"] / copies["volume_floor_ms"])]
                     for run in document["runs"] if run["cell_size"] != 1])
    text += section("Meshes", """\
The tetrahedra of a field with large cells, given as a mesh on the host: set_field snaps and checks it there, uploads it
and lists its tetrahedra, for what lies outside is background.""",
                    ["field", "cell", "tetrahedra", "set_field", "resample", "gascon", "gascon / resample"],
                    [[run["field"], run["cell_size"], run["tetrahedra"], ms_cell(run["set_field_ms"]),
                      ms_cell(run["resample_ms"]), ms_cell(run["gascon_ms"]),
                      fixed(over(run["gascon_ms"], run["resample_ms"]))] for run in document["meshes"]])
    text += section("Other lengths", "", ["size", "field", "set_field", "resample", "new field"],
                    [[size_text(run["size"]), run["field"]] + stages(run)
                     for run in document["runs"] if run["size"] != size])
    text += section("Frames per second", """\
One resampler, an elastic field of another amplitude in every frame. Kernels: all data on the device. With copies: fields
from pinned host memory and outputs into it while kernels run, the source stays. Copies alone: the same without kernels.
Host views: source, field and output in pageable host memory, as a program without CUDA calls it.""",
                    ["cell", "kernels", "with copies", "copies alone", "host views"],
                    [[loop["cell_size"]] + [fixed(loop[f"{key}_per_s"], 1) for key in (
                        "kernels", "with_copies", "copies_alone", "host_views")] for loop in document["frame_loops"]])
    text += section("Memory", """\
MB (10^6 bytes). Data: source, field and output. Allowed: 10 % or 128 MB more. Host views: most that a resampler holds
on the device, given all of it on the host. Device views: most that it holds beside data that the caller has there.""",
                    ["field", "data", "allowed", "host views", "device views"],
                    [[use["field"]] + [fixed(use[f"{key}_bytes"] / 1e6, 1) for key in (
                        "data", "allowed", "host_views", "device_views")] for use in document["memory"]])
    return text + floors(document)


def of_io(document):
    text = title_line(document) + (
        f"- host: {cpu_text(document['machine'])}\n- input: phantom, {size_text(document['size'])}, int16\n"
        f"- {document['options']['repeats']} repeats\n\n")
    text += section("Times", """\
ms, median (q1-q3), each program in turn; CPU ms of all threads. All files were just written, so they are read from the page cache and written
to it; only the whole job flushes to the disk, as `tetwarp deform` does. In: list the folder and read it; the loop with
DCMTK knows the order of the files. "tetwarp, hashed" makes the hash of the files as well, which `deform` records; it hashes every slice that it writes.
ITK reads and writes series, and NIfTI, in one thread. Whole job: `tetwarp deform` as a program, and its stages alone;
deform alone hashes the field, as the program does. The program writes slices while others are deformed. A program's memory is
given back when it ends, so that is a stage, too.
CUDA, awake: the whole job in this process, which has used the device before.""", ["step", "by", "ms", "CPU ms"],
                    [[time["step"], time["by"], ms_cell(time["ms"]), ms_cell(time["cpu_ms"])]
                     for time in document["times"]])
    text += "## Sizes\n\n" + table(["file", "by", "bytes"], [[size["file"], size["by"], size["bytes"]]
                                                             for size in document["sizes"]]) + "\n"
    return text + floors(document)


def of_invert(document):
    options = document["options"]
    runs = document["runs"]

    def error(run, key):
        return "-" if run[f"{key}_error"] is None else f"{run[f'{key}_error']:.2g}"

    text = title_line(document) + (
        f"- CPU: {cpu_text(document['machine'])}, the same for everything\n"
        f"- beside it: ITK {document['itk'] or 'not in this build, left out'}\n"
        f"- fields: {size_text([options['width'], options['width'], options['slices']])} vertices, one on every voxel\n"
        f"- {options['repeats']} timed repeats, in turn\n\n")
    text += section("Time and error", """\
ms, median (q1-q3), and CPU ms of all threads. tetwarp: set_field, without the range of Jacobian determinants, and resample
to the inverse alone. ITK invert: InvertDisplacementFieldImageFilter with its defaults; border free: with
EnforceBoundaryCondition off. ITK iterative: IterativeInverseDisplacementFieldImageFilter with its defaults; its iterations
run in one thread. Errors: voxels, distance from the known inverse, over all voxels with a source that have a vector.""",
                    ["field", "by", "ms", "CPU ms", "mean error", "99 % below", "largest error"],
                    [[run["field"], run["by"], ms_cell(run["ms"]), ms_cell(run["cpu_ms"])] +
                     [error(run, key) for key in ("mean", "percentile_99", "largest")] for run in runs])
    text += section("Sources", """\
Voxels. With a source: the undeformed place lies in the lattice. Left out: of these, without a vector. Written: vectors of
voxels without a source; of these zero vectors, and vectors to a place in the lattice, from where a warp takes a value.""",
                    ["field", "by", "with a source", "left out", "without a source", "written", "zero", "into the lattice"],
                    [[run[key] for key in ("field", "by", "with_source", "left_out", "without_source",
                                           "written_without_source", "zero_without_source",
                                           "pointing_in_without_source")] for run in runs])
    return text + floors(document)


def megabytes(count):
    value = 1e-6 * count
    return f"{value:.{1 if value < 10 else 0}f}"


def seconds(ms):
    value = 1e-3 * ms["median"]
    return f"{value:.{3 if value < 1 else 2 if value < 10 else 1}f}"


def of_itk(document):
    options, loads = document["options"], document["load_averages"]

    def own_of(run):
        return next((own for own in document["runs"] if own["own"] and all(
            own[key] == run[key] for key in ("task", "field", "cell_size"))), None)

    def errors(run):
        found = run["error"]
        return f"{found['rms']:.2g}, {found['largest']:.2g}" if found and found["rms"] is not None else "-"

    def pair(run, own):
        unit = (run["error"] or {}).get("unit", "")
        return [run["filters"], own["filters"], f"{run['field']}, {run['cell_size']}",
                f"{seconds(run['ms'])} / {seconds(own['ms'])}", f"{over(run['ms'], own['ms']):.3g}",
                f"{megabytes(run['peak_bytes_beyond_inputs'])} / {megabytes(own['peak_bytes_beyond_inputs'])} "
                f"({megabytes(own['output_bytes'])})", f"{errors(run)} / {errors(own)}" + (f" {unit}" if unit else "")]

    def alone(run):
        found = run["error"]
        return [f"{run['field']}, {run['cell_size']}", run["filters"], ms_cell(run["ms"]), ms_cell(run["cpu_ms"])] + [
            megabytes(run[key]) for key in ("input_bytes", "output_bytes", "peak_bytes_beyond_inputs")] + (
                [f"{found[key]:.2g}" for key in ("rms", "mean", "largest")] + [found["compared"], found["missing"]]
                if found else ["-"] * 5)

    text = title_line(document) + (
        f"- CPU: {cpu_text(document['machine'])}, the same for everything\n- load averages of 1 and 15 minutes: " +
        ", ".join(f"{load:.1f}" for load in loads["before"]) + " before, " +
        ", ".join(f"{load:.1f}" for load in loads["after"]) + f" after\n- beside it: ITK {document['itk']}\n"
        f"- input: phantom, {size_text([options['width'], options['width'], options['slices']])}, int16\n"
        f"- {options['repeats']} repeats, in turn, each in a process of its own\n\n")
    text += section("Beside ITK's filters", """\
ITK's / ours. s: Update() of a new filter in a process of its own, inputs in memory, medians in turn. MB: the largest resident
set up to the end of Update() less the resident set before it, so the output and all that is made on the way, but not the
inputs; in brackets the output alone. Error: rms and largest. Of warps: HU, against the source read linearly, in double, at the true
undeformed place, half a voxel or more inside the volume. Of inverses: voxels of the volume, against the true inverse, wherever the undeformed
place lies in the field. Of determinants: against the formula's, where each filter has its values (ours at the deformed
place, ITK's at the undeformed one), a voxel or more inside. Of the B-spline: voxels, against its closed form.""",
                    ["ITK's filter", "ours", "field, cells", "s", "times", "MB", "error"],
                    [pair(run, own_of(run)) for run in document["runs"] if not run["own"] and own_of(run)])
    text += section("Every filter", """\
ms, median (q1-q3), and CPU ms of all threads. Bytes in MB (10^6); beyond: the inputs, as above. Missing: values that are not finite where there is
a truth.""",
                    ["field, cells", "filter", "ms", "CPU ms", "inputs", "output", "beyond", "rms", "mean", "largest",
                     "compared", "missing"], [alone(run) for run in document["runs"]])
    text += section("In pieces", """\
An .mha file, not compressed, is read, warped and written, as many times in turn as everything else; ms and memory are of all three.
Ours: the forward field with cells of 8; the reader gives slices back behind each piece (ReleaseDataFlagOn). WarpImageFilter: the
inverse with cells of 8; it asks for the whole volume for each piece, so that the reader keeps it. MB: beyond the field. Bytes
that differ from the file that was written whole, in all repeats.""",
                    ["filter", "pieces", "ms", "CPU ms", "MB", "bytes that differ"],
                    [[stream["filters"], stream["pieces"], ms_cell(stream["ms"]), ms_cell(stream["cpu_ms"]),
                      megabytes(stream["peak_bytes_beyond_field"]), stream["differing_bytes"]]
                     for stream in document["streams"]])
    return text + floors(document)


def of_simulate(document):
    machine, options = document["machine"], document.get("options")

    def or_empty(run, key):
        return ms_cell(run[key]) if key in run else ""

    document.setdefault("program", "tetwarp-bench simulate")  # older runs do not name it
    text = title_line(document) + f"- CPU: {cpu_text(machine)}\n"
    text += f"- GPU: {cuda_text(machine)}\n" if machine["gpu"] else ""
    text += (f"- scenario: {document['scenario']}, on a phantom of {size_text(document['volume'])} voxels, "
             f"{size_text(document['lattice'])} vertices\n")
    text += (f"- {options['frames']} timed frames after {options['warmup']}\n" if options else "") + "\n"
    text += section("Until it has settled", """\
The first phase in one go, from rest: largest motion of a vertex in the last step, and largest net force on a free vertex
over the largest by which placed ones are kept in their places (mass-spring).""",
                    ["method", "backend", "seconds", "steps", "last motion, mm", "residual", "settled"],
                    [[run["method"], run["backend"], fixed(run["seconds"], 3), run["steps"], f"{run['motion_mm']:.2g}",
                      f"{run['residual']:.2g}", "yes" if run["reached"] else "no"] for run in document["settle"]])
    text += section("Frame by frame", """\
The same way in equal frames, each with a few steps, then set_field and resample of the volume, then a picture of it if one is asked
for: its empty blocks are found and its rays cast. "Turning" are pictures of a volume that stands, from all around. ms, median (q1-q3).
With pictures, frames a second are those of a loop that works on three frames at a time; "in turn" is one part after the other.""",
                    ["method", "backend", "steps", "simulate", "resample", "picture", "frames a second", "in turn", "turning",
                     "last motion, mm"],
                    [[run["method"], run["backend"], run["steps"], ms_cell(run["simulate_ms"]), ms_cell(run["resample_ms"]),
                      or_empty(run, "render_ms"), fixed(run["frames_per_second"], 1),
                      fixed(run["parts_per_second"], 1) if "parts_per_second" in run else "", or_empty(run, "turn_ms"),
                      f"{run['last']['motion_mm']:.2g}"] for run in document["frames"]])
    return text + floors(document)
