# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What the paper prints of its own measurements (Sensors 2022, 22, 6276): every cell of its Tables 1 to 4, and what it
counts. Times are ms, the mean of 500 frames of 512 x 512 x N voxels; they hold the deformation's formula, the inverse
and the sampling, and not the picture. Beside them stands what of a run has the paper's settings."""
from tables import size_text

RTX, GTX = GPUS = ("GeForce RTX 2080", "GeForce GTX 1650 Mobile")
TWIN = "-per-voxel"  # of a method's name: the inverse for every candidate voxel, as the paper has it
COLUMNS = {2: ("inverse4x4-double", "inverse3x3-double", "inverse3x3-float"),
           3: ("inverse3x3-float", "paper"),
           4: ("inverse3x3-float", "paper")}
METHODS = ("inverse4x4-double", "inverse3x3-double", "inverse3x3-float", "paper")
AMPLITUDES = (1.0, 16.0)  # ours: the paper gives none
TRANSFORMS = ("wave", "twist", "bubble")
DATA = {"abdomen": (300, 150.0), "lung": (316, 158.0), "colon": (141, 70.5), "leg": (600, 300.0)}  # slices, MB

# Table 3 (a) is Table 2 (c), and Table 4 repeats the abdomen.
TIMES = {
    2: {RTX: {"wave": (348.14, 150.55, 22.55), "twist": (376.11, 166.57, 26.56), "bubble": (385.36, 168.49, 17.44)},
        GTX: {"wave": (892.85, 360.26, 60.40), "twist": (989.42, 415.30, 98.55), "bubble": (940.06, 402.53, 58.39)}},
    3: {RTX: {"wave": (22.55, 19.75), "twist": (26.56, 23.82), "bubble": (17.44, 14.08)},
        GTX: {"wave": (60.40, 51.27), "twist": (98.55, 90.78), "bubble": (58.39, 47.18)}},
    4: {GTX: {"abdomen": (60.40, 51.27), "lung": (63.53, 54.87), "colon": (29.37, 24.46), "leg": (149.37, 127.19)}},
}
# How many times as fast the last column of a table is as the first, by transform.
SPEED_UPS = {2: {RTX: (15.43, 14.16, 22.09), GTX: (14.78, 10.03, 16.09)},
             3: {RTX: (1.14, 1.11, 1.23), GTX: (1.17, 1.09, 1.23)}}
TETRAHEDRA = 5 * 511 * 511 * 599  # of 512 x 512 x 600 voxels
BYTES_A_THREAD = 8 * 2 * 3 * 4  # eight vertices, where each is and where it rests, floats


def field_of(transform, amplitude):
    """The paper's Eqs. 14 to 16 as they are written (bench/paper/fields.h)."""
    return f"{transform}-paper-{amplitude:.0f}"


FIELDS = [field_of(transform, amplitude) for transform in TRANSFORMS for amplitude in AMPLITUDES]


class Beside:
    """The runs of a document that have the paper's settings: on a GPU, cells of one voxel, the field in the kernel."""

    def __init__(self, document):
        self.document = document
        self.runs = document["runs"]
        self.found = {}
        for run in self.runs if document["options"]["backend"] == "cuda" else []:
            if run["cell_size"] == 1 and run["field_source"] == "kernel" and run["size"][:2] == [512, 512]:
                self.found.setdefault((run["field"], run["size"][2], run["method"]), run)

    def run(self, field, slices, method):
        return self.found.get((field, slices, method))

    def ways(self, cell):
        """One cell of the paper in every way that is measured here: amplitude, method as compiled or per voxel, run."""
        for amplitude in AMPLITUDES:
            for method in (cell["method"], cell["method"] + TWIN):
                yield amplitude, method, self.run(field_of(cell["transform"], amplitude), cell["slices"], method)

    def speed_up(self, field, slow, fast):
        pair = [self.run(field, DATA["abdomen"][0], method) for method in (slow, fast)]
        return pair[0]["kernel_ms"]["median"] / pair[1]["kernel_ms"]["median"] if all(pair) else None

    def frames_a_second(self):
        runs = [self.run(field, DATA["abdomen"][0], "paper") for field in FIELDS]
        rates = [1000 / run["kernel_ms"]["median"] for run in runs if run]
        if not rates:
            return "-"
        return f"{min(rates):.0f} to {max(rates):.0f}, Algorithm 2 as compiled, 300 slices"

    def why_apart(self):
        """Why cells of the paper stand alone, each one a phrase; empty where all have ours beside them."""
        reasons = []
        if self.document["options"]["backend"] != "cuda":
            reasons.append("this run was on a CPU, the paper's were on GPUs")
        for what, key, wanted in (("not run here:", "size", [[512, 512, slices] for slices, _ in DATA.values()]),
                                  ("fields left out:", "field", FIELDS),
                                  ("methods left out:", "method", [form for method in METHODS
                                                                   for form in (method, method + TWIN)])):
            missing = [one for one in wanted if all(run[key] != one for run in self.runs)]
            if missing:
                names = (size_text(one) if key == "size" else one for one in missing)
                reasons.append(f"{what} {', '.join(names)}")
        return reasons


def cells():
    """Every time of Tables 2 to 4."""
    for table, gpus in TIMES.items():
        for gpu, rows in gpus.items():
            for name, times in rows.items():
                for column, (method, ms) in enumerate(zip(COLUMNS[table], times)):
                    data = name if table == 4 else "abdomen"
                    yield {"table": table, "column": "abc"[column], "method": method,
                           "transform": "wave" if table == 4 else name, "data": data, "slices": DATA[data][0],
                           "gpu": gpu, "ms": ms}


def claims(beside):
    """What the text counts and claims, and what of ours stands beside it."""
    rates = beside.frames_a_second()
    return [{"what": what, "printed": printed, "ours": ours} for what, printed, ours in (
        (f"frames a second, {RTX}", "40 and more", rates), (f"frames a second, {GTX}", "10", rates),
        ("the picture, in none of the times; RTX 2080, GTX 1650 Mobile", "below 1 ms, about 14 ms", "-"),
        ("tetrahedra at 512 x 512 x 600", "786 M", str(TETRAHEDRA)),
        ("the same, Aguilera; Gascon", "65 M; fewer than 5000", "-"),
        ("bytes a thread, both places of eight vertices", "192", str(BYTES_A_THREAD)),
        ("the same, Aguilera", "112", "-"),
        ("differences between the pictures of Table 2 (a), (b), (c)", "none", "each against the exact result: below"))]


def published(document):
    """The paper's numbers with ours beside them: the part `published` of paper.json."""
    beside = Beside(document)

    def ways(cell):
        for amplitude, method, run in beside.ways(cell):
            ms = run and run["kernel_ms"]["median"]
            yield {"field": field_of(cell["transform"], amplitude), "amplitude": amplitude, "method": method, "ms": ms,
                   "ratio": cell["ms"] / ms if ms else None}

    def speed_ups():
        for table, gpus in SPEED_UPS.items():
            slow, fast = COLUMNS[table][0], COLUMNS[table][-1]
            for gpu, ratios in gpus.items():
                for transform, ratio in zip(TRANSFORMS, ratios):
                    fields = [field_of(transform, amplitude) for amplitude in AMPLITUDES]
                    yield {"table": table, "slow": slow, "fast": fast, "transform": transform, "gpu": gpu, "ratio": ratio,
                           "ours": [{"field": field, "as_compiled": beside.speed_up(field, slow, fast),
                                     "per_voxel": beside.speed_up(field, slow + TWIN, fast + TWIN)} for field in fields]}

    return {"source": "Sensors 2022, 22, 6276", "frames": 500,
            "data": [{"name": name, "slices": slices, "megabytes": size} for name, (slices, size) in DATA.items()],
            "times": [{**cell, "ours": list(ways(cell))} for cell in cells()], "speed_ups": list(speed_ups()),
            "claims": claims(beside), "why_apart": beside.why_apart()}
