#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Checks the documents of a folder: relative links and their anchors lead somewhere, and the README stays a front page.

    check_links.py SOURCE_FOLDER

Prints what is wrong, a line each; the exit status is 1 then. Links to other sites are not followed.
"""
import pathlib
import re
import sys

README_LINES = 120
BUILT = {"build", ".git"}


def documents(root):
    for path in sorted(root.rglob("*.md")):
        if not BUILT & set(path.relative_to(root).parts[:1]):
            yield path


def without_code(text):
    """The text without blocks of code, in which brackets are no links."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    return re.sub(r"`[^`\n]*`", "`", text)


def anchors(path):
    """The anchors of the headings of a page, as forges make them."""
    found = set()
    for line in re.sub(r"^```.*?^```", "", path.read_text(), flags=re.M | re.S).splitlines():
        heading = re.match(r"#+ +(.*)", line)
        if heading:
            plain = re.sub(r"[^\w\- ]", "", heading.group(1).strip().lower())
            found.add(plain.replace(" ", "-"))
    return found


def wrong_links(root):
    for page in documents(root):
        for target in re.findall(r"\]\(([^)\s]+)\)", without_code(page.read_text())):
            if re.match(r"[a-z]+:", target):
                continue
            name, _, anchor = target.partition("#")
            to = (page.parent / name).resolve() if name else page
            where = page.relative_to(root)
            if not to.exists():
                yield f"{where}: no such file, {target}"
            elif anchor and to.suffix == ".md" and anchor not in anchors(to):
                yield f"{where}: no such heading, {target}"


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    root = pathlib.Path(sys.argv[1]).resolve()
    wrong = list(wrong_links(root))
    lines = len((root / "README.md").read_text().splitlines())
    if lines > README_LINES:
        wrong.append(f"README.md: {lines} lines; a front page has at most {README_LINES}, the rest belongs into docs/")
    print("\n".join(wrong) if wrong else f"{sum(1 for _ in documents(root))} documents, no wrong link")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
