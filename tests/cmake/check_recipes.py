#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Whether containers (cmake/containers) and recipes (cmake/recipes) fit the sources that they build, by reading them.

    tests/cmake/check_recipes.py SOURCE
"""
import json
import pathlib
import re
import sys
import unittest

SOURCE = pathlib.Path(sys.argv.pop(1)).resolve()


def text_of(name):
    return (SOURCE / name).read_text(encoding="utf-8")


CMAKE = text_of("CMakeLists.txt")
DOCKERFILE = text_of("cmake/containers/Dockerfile")
DEFINITION = text_of("cmake/containers/tetwarp.def")
SPACK = text_of("cmake/recipes/spack/package.py")
CONDA = text_of("cmake/recipes/conda/recipe.yaml")
GUIDE = text_of("docs/guide/containers.md")
ALL = {"Dockerfile": DOCKERFILE, "tetwarp.def": DEFINITION, "package.py": SPACK, "recipe.yaml": CONDA, "containers.md": GUIDE}

OPTIONS = set(re.findall(r"^option\((\w+)", CMAKE, re.M)) - {"TETWARP_WITH_${name}"}
OPTIONS |= {f"TETWARP_WITH_{name}" for name in re.findall(r"^tetwarp_option_where_found\((\w+)", CMAKE, re.M)}


def without_comments(text):
    return "".join(line + "\n" for line in text.splitlines() if not line.lstrip().startswith("#"))


def joined(text):
    """Lines, those that end with a backslash joined with the next."""
    return re.sub(r"\s*\\\n\s*", " ", without_comments(text)).splitlines()


def sections(name):
    """The text of a section of tetwarp.def, in each of its stages."""
    found = []
    for stage in without_comments(DEFINITION).split("Bootstrap: docker\n")[1:]:
        found.append("".join(re.findall(rf"^%{name}[^\n]*\n(.*?)(?=^%|\Z)", stage, re.M | re.S)))
    return found


class Recipes(unittest.TestCase):
    def test_the_options_are_found_where_they_are_read(self):
        self.assertLessEqual({"TETWARP_WITH_CUDA", "TETWARP_WITH_VTK", "TETWARP_BUILD_APPS", "BUILD_SHARED_LIBS"}, OPTIONS)

    def test_no_option_is_named_that_cmake_does_not_have(self):
        for name, text in ALL.items():
            named = set(re.findall(r"\b(TETWARP_(?:WITH|BUILD)_[A-Z]+|BUILD_SHARED_LIBS)\b", text))
            self.assertLessEqual(named, OPTIONS, name)

    def test_no_dependency_is_used_only_because_it_happens_to_lie_there(self):
        wanted = {name for name in OPTIONS if name.startswith("TETWARP_WITH_")}
        self.assertLessEqual(wanted, set(re.findall(r"-D(\w+)=", CONDA)), "recipe.yaml")
        self.assertLessEqual(wanted, set(re.findall(r'"(\w+)"', SPACK)), "package.py")

    def test_the_version_is_that_of_the_project(self):
        version = re.search(r"^project\(tetwarp VERSION ([0-9.]+)", CMAKE, re.M)[1]
        for name, pattern in [("Dockerfile", r"^ARG VERSION=(.*)$"), ("tetwarp.def", r"^ *VERSION=(.*)$"),
                              ("package.py", r'^    version\("(.*)"\)$'), ("package.py", r"tetwarp-([0-9.]+)\.tar"),
                              ("recipe.yaml", r'^  version: "(.*)"$'), ("containers.md", r"dev-build tetwarp@([0-9.]+)$")]:
            self.assertEqual(re.findall(pattern, ALL[name], re.M), [version], f"{name}: {pattern}")

    def test_the_presets_exist(self):
        presets = {preset["name"] for preset in json.loads(text_of("CMakePresets.json"))["configurePresets"]}
        named = set(re.findall(r"\bPRESET=(\w+)", DOCKERFILE + DEFINITION + GUIDE))
        self.assertLessEqual({"cpu", "cuda"}, named)
        self.assertLessEqual(named, presets)

    def test_apptainer_does_the_steps_of_the_dockerfile(self):
        stages = "\n".join(joined(DOCKERFILE)).split("\nFROM ")[1:]
        self.assertEqual(len(stages), 2)
        for stage, post in zip(stages, sections("post"), strict=True):
            steps = [step for line in stage.splitlines() if line.startswith("RUN ") for step in re.split(r" +&& +", line[4:].strip())]
            given = [line.strip() for line in joined(post) if not re.match(r' *[A-Z_]+="\{\{|^ *cd |^ *$', line)]
            self.assertGreater(len(steps), 2)
            self.assertEqual([re.sub(" +", " ", step) for step in steps], [re.sub(" +", " ", line) for line in given])

    def test_apptainer_has_the_arguments_of_the_dockerfile(self):
        wanted = {name: value.strip('"') for name, value in re.findall(r"^ARG (\w+)=(.*)$", DOCKERFILE, re.M) if name != "REVISION"}
        given = dict(line.strip().split("=", 1) for line in "\n".join(sections("arguments")).splitlines() if line.strip())
        self.assertEqual(given, wanted)
        for name in given:
            self.assertIn("{{ " + name + " }}", DEFINITION)

    def test_what_git_ignores_is_no_context(self):
        ignored = {line.strip("/") for line in text_of(".gitignore").splitlines() if line.strip()}
        left_out = {line.removeprefix("**/") for line in without_comments(text_of("cmake/containers/Dockerfile.dockerignore")).split()}
        self.assertEqual(left_out, ignored)


unittest.main()
