#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Makes what is published of a measurement, from what `tetwarp bench FAMILY --json` wrote.

    bench/publish/publish.py gpu.json gpu.md                               # tables in Markdown, of any family
    bench/publish/publish.py paper.json paper.md paper.csv paper.svg       # of the paper's a line a run and a drawing, too
    bench/publish/publish.py paper.json paper.json                         # with the paper's own numbers beside ours
    bench/publish/publish.py --fill paper.json docs/reference/paper.md     # figures into the parts of a document
    bench/publish/publish.py --check paper.json docs/reference/paper.md    # exit status 1 where it has others

The suffix of an output says what it is. A drawing needs matplotlib.
"""
import json
import sys

sys.dont_write_bytecode = True  # nothing is left beside the sources

import document as parts_of  # noqa: E402
import families  # noqa: E402
import paper  # noqa: E402
from published import published  # noqa: E402


def family_of(document):
    if "program" in document:
        return document["program"].removeprefix("tetwarp-bench ")
    return "simulate"  # whose older runs do not say


def markdown(document):
    family = family_of(document)
    return paper.of_paper(document) if family == "paper" else getattr(families, f"of_{family}")(document)


def text_of(document, suffix):
    if suffix == "md":
        return markdown(document)
    if family_of(document) != "paper":
        fail(f"of {family_of(document)} there is Markdown alone")
    if suffix == "csv":
        return paper.csv_of(document)
    return json.dumps({**document, "published": published(document)}, indent=1, sort_keys=True, ensure_ascii=False) + "\n"


def fail(text):
    sys.exit(f"publish.py: error: {text}")


def fill(document, numbers, path, check):
    with open(path, encoding="utf-8") as file:
        text = file.read()
    try:
        filled = parts_of.fill(text, document)
    except ValueError as error:
        fail(f"{path}: {error}")
    if filled == text:
        return
    if check:
        fail(f"{path} has other figures than {numbers}; --fill puts them in")
    with open(path, "w", encoding="utf-8") as file:
        file.write(filled)


def main(arguments):
    if not arguments or arguments[0] in ("--help", "-h"):
        print(__doc__.strip())
        return
    fills = arguments[0] in ("--fill", "--check")
    numbers, *outputs = arguments[fills:]
    if not outputs or (fills and len(outputs) > 1):
        fail("a file of numbers and an output are wanted; see --help")
    with open(numbers, encoding="utf-8") as file:
        document = json.load(file)
    if family_of(document) == "paper" and not document.get("runs"):
        fail(f"no runs in {numbers}; give the file that tetwarp bench paper --json wrote")
    if fills:
        fill(document, numbers, outputs[0], arguments[0] == "--check")
        return
    for output in outputs:
        suffix = output.rpartition(".")[2]
        if suffix in ("md", "csv", "json"):
            with open(output, "w", encoding="utf-8") as file:
                file.write(text_of(document, suffix))
        else:
            import drawing  # where matplotlib is not, everything else is made
            drawing.save(document, output)


if __name__ == "__main__":
    main(sys.argv[1:])
