# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Tables in Markdown, and how numbers stand in them."""


def row(cells):
    return "| " + " | ".join(str(cell) for cell in cells) + " |\n"


def table(names, rows):
    return row(names) + row(["---"] * len(names)) + "".join(row(cells) for cells in rows)


def section(title, note, names, rows):
    """A heading, what the numbers are, and the numbers; nothing where there are none."""
    rows = list(rows)
    if not rows:
        return ""
    return f"## {title}\n\n" + (f"{note}\n\n" if note else "") + table(names, rows) + "\n"


def ms_text(ms):
    return f"{ms:.{3 if ms < 10 else 2 if ms < 100 else 1}f}"


def ms_cell(ms):
    """Median and quartiles."""
    return "-" if ms is None else f"{ms_text(ms['median'])} ({ms_text(ms['q1'])}-{ms_text(ms['q3'])})"


def fixed(value, digits=2):
    return "-" if value is None else f"{value:.{digits}f}"


def over(a, b):
    """Of two summaries of times, how many times the second the first is."""
    return None if a is None or b is None else a["median"] / b["median"]


def size_text(size):
    return " x ".join(str(n) for n in size)


def title_line(document):
    return f"# {document['program']}, {document['version']} ({document['commit']})\n\n"


def cuda_text(machine):
    return (f"{machine['gpu'] or '?'}, compute capability {machine['compute_capability'] or '?'}, "
            f"driver {machine['driver'] or '?'}, runtime {machine['cuda_runtime'] or '?'}")


def cpu_text(machine):
    return f"{machine['cpu']}, {machine['threads']} threads"


def floors(document):
    """What must be reached, and what came of it."""
    def limit(floor, key):
        found = floor[key]
        return f"{'at least' if floor['at_least'] else 'at most'} {found['limit']:g}" if found else ""

    def word(floor, key, yes, no):
        return (yes if floor[key]["met"] else no) if floor[key] else ""

    note = "Ratios, of medians where they are of times, and counts of this run. A floor is required, an aim is not."
    return f"## Floors\n\n{note}\n\n" + table(
        ["ratio", "where", "value", "required", "", "aim", ""],
        [[floor["ratio"], floor["where"], fixed(floor["value"], 3), limit(floor, "required"),
          word(floor, "required", "met", "missed"), limit(floor, "aim"), word(floor, "aim", "reached", "not reached")]
         for floor in document["floors"]])
