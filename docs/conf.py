# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Sphinx: how docs/build.sh makes a site of the pages. Nothing is fetched from a network."""
import copy
import os
import pathlib
import re

from breathe.renderer.sphinxrenderer import SphinxRenderer
from docutils import nodes
from pygments.lexers.data import JsonLexer
from pygments.lexers.special import TextLexer

ROOT = pathlib.Path(__file__).resolve().parents[1]

project = "Tetwarp"
author = "The Tetwarp authors"
copyright = author  # Sphinx' name
version = release = re.search(r"project\(\s*\w+\s+VERSION\s+([\d.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)

extensions = ["myst_parser", "breathe"]
myst_heading_anchors = 4  # as forges make them: tests/docs/check_links.py checks the same links
breathe_projects = {"tetwarp": str(ROOT / "build/docs/doxygen/xml")}
breathe_default_project = "tetwarp"
breathe_show_include = False
primary_domain = "cpp"
highlight_language = "none"

html_theme = "furo"
html_title = f"Tetwarp {release}"
html_show_sphinx = False
html_copy_source = False


def links_within(app, docname, source):
    """Links to files that are not in the site become their text: the site has no copy of the sources."""
    folder = os.path.dirname(docname)

    def within(match):
        text, target = match.groups()
        path = os.path.normpath(os.path.join(folder, target.partition("#")[0]))
        if not path.startswith(".."):
            return match.group(0)
        path = path[len("../"):]
        return text if path in text else f"{text} (`{path}`)"

    source[0] = re.sub(r"(?<!!)\[([^\[\]]*)\]\((\.\./[^)\s]+)\)", within, source[0])


def namespace_without_declaration(self, node):
    """What a namespace holds, without a declaration of its own: Breathe would declare it anew for each header."""
    file_data = self.compound_parser.parse(node.refid)
    return self.render(file_data, self.context.create_child_context(file_data))


def exceptions_one_by_one(self, node):
    """Doxygen gives exceptions that follow one another one description; each gets a line."""
    if node.kind == "exception":
        items = []
        for item in node.parameteritem:
            for name in item.parameternamelist[0].parametername:
                single = copy.copy(item)
                single.parameternamelist = [copy.copy(item.parameternamelist[0])]
                single.parameternamelist[0].parametername = [name]
                items.append(single)
        node = copy.copy(node)
        node.parameteritem = items
    fields = docparamlist(self, node)
    for field in fields:
        for name in field.findall(nodes.field_name):  # not "throws": Sphinx would read what follows as an expression
            for text in list(name.findall(nodes.Text)):
                if node.kind == "exception" and text.startswith("throws"):
                    text.parent.replace(text, nodes.Text(text.replace("throws", "raises", 1)))
    return fields


docparamlist = SphinxRenderer.methods["docparamlist"]
SphinxRenderer.methods["docparamlist"] = exceptions_one_by_one
SphinxRenderer.visit_namespace = namespace_without_declaration


def setup(app):
    app.connect("source-read", links_within)
    app.add_lexer("jsonl", JsonLexer)
    app.add_lexer("csv", TextLexer)
