#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Writes the page of the Python package, from the docstrings of its sources; nothing is imported.

    python_pages.py FILE
"""

import ast
import inspect
import pathlib
import re
import sys

PACKAGE = pathlib.Path(__file__).resolve().parents[1] / "python" / "tetwarp"

#: Modules whose functions stand on the page under the module's name.
MODULES = ("fields", "hdf5", "zarr")


def public_names():
    """The names of `__all__`, and where each is defined."""
    tree = ast.parse((PACKAGE / "__init__.py").read_text())
    homes = {}
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.level == 1 and node.module:
            homes.update({alias.asname or alias.name: node.module for alias in node.names})
        if isinstance(node, ast.FunctionDef):
            homes[node.name] = "__init__"
        if isinstance(node, ast.Assign) and node.targets[0].id == "__all__":
            listed = [element.value for element in node.value.elts]
    return [(name, homes[name]) for name in sorted(listed, key=str.lower) if name in homes]


def definition(module, name):
    tree = ast.parse((PACKAGE / f"{module}.py").read_text())
    for node in tree.body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and node.name == name:
            return node
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == name:
            return node
    raise SystemExit(f"python_pages.py: error: no {name} in {module}.py")


def signature(node, name):
    arguments = ast.unparse(node.args)
    arguments = re.sub(r"^self(, )?", "", arguments)
    returns = f" -> {ast.unparse(node.returns)}" if node.returns and node.name != "__init__" else ""
    text = f"{name}({arguments}){returns}"
    if len(text) > 100:
        text = text.replace("(", "(\n    ", 1).replace(", *, ", ",\n    *,\n    ", 1)
    return f"```python\n{text}\n```\n"


def sections(docstring):
    """The docstring as Markdown: NumPy's sections, lists of parameters, examples."""
    lines, out, n = inspect.cleandoc(docstring).splitlines(), [], 0
    section = ""
    while n < len(lines):
        line = lines[n]
        if n + 1 < len(lines) and lines[n + 1] and set(lines[n + 1]) == {"-"}:
            section = line
            out += ["", f"**{line}**", ""]
            n += 2
            continue
        if section == "Examples" and line.startswith(">>>"):
            block = []
            while n < len(lines) and lines[n]:
                block.append(lines[n])
                n += 1
            out += ["```python", *block, "```"]
            continue
        if section in ("Parameters", "Attributes", "Returns", "Raises") and line and not line.startswith(" "):
            name, _, kind = line.partition(" : ")
            text = []
            while n + 1 < len(lines) and (lines[n + 1].startswith(" ") or not lines[n + 1].strip()):
                text.append(lines[n + 1].strip())
                n += 1
            words = " ".join(word for word in text if word)
            out.append(f"- `{name}`" + (f" ({kind})" if kind else "") + (f": {words}" if words else ""))
        else:
            out.append(line)
        n += 1
    return "\n".join(out) + "\n"


def remark(module, node):
    """The comment `#:` above a constant, which is its docstring."""
    lines = (PACKAGE / f"{module}.py").read_text().splitlines()
    text = []
    for line in reversed(lines[: node.lineno - 1]):
        if not line.startswith("#:"):
            break
        text.insert(0, line[2:].strip())
    if not text:
        raise SystemExit(f"python_pages.py: error: no comment #: above line {node.lineno} of {module}.py")
    return " ".join(text) + "\n"


def described(node, name, module):
    yield f"## {name}\n"
    if isinstance(node, ast.Assign):
        yield remark(module, node)
        return
    if isinstance(node, ast.FunctionDef):
        yield signature(node, f"tetwarp.{name}")
        yield sections(ast.get_docstring(node))
        return
    members = [one for one in node.body if isinstance(one, ast.FunctionDef)]
    for one in members:
        if one.name == "__init__":
            yield signature(one, f"tetwarp.{name}")
    yield sections(ast.get_docstring(node))
    for one in members:
        if one.name.startswith("_") or not ast.get_docstring(one):
            continue
        is_value = any(getattr(mark, "id", "") == "property" for mark in one.decorator_list)
        yield f"### {name}.{one.name}\n"
        if not is_value:
            yield signature(one, one.name)
        yield sections(ast.get_docstring(one))


def main():
    page = ["# tetwarp, the package of Python\n", "The [guide](../guide/python.md) shows how it is used.\n"]
    for name, module in public_names():
        page += described(definition(module, name), name, module)
    for module in MODULES:
        for node in ast.parse((PACKAGE / f"{module}.py").read_text()).body:
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                page += described(node, f"{module}.{node.name}", module)
    pathlib.Path(sys.argv[1]).write_text("\n".join(page))


if __name__ == "__main__":
    main()
