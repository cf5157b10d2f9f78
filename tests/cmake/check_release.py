#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What cmake/release refuses: a release of what is not committed, or of a version that the files do not agree on; a bill
of materials with a package whose licence nobody looked up.

    tests/cmake/check_release.py SOURCE

Exit status 77: the sources are no clone of git, of which alone a release is made.
"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import zipfile

SOURCE = pathlib.Path(sys.argv.pop(1)).resolve()
sys.path.insert(0, str(SOURCE / "cmake" / "release"))
sys.dont_write_bytecode = True
import sbom  # noqa: E402


def git(folder, *arguments):
    return subprocess.run(["git", "-C", str(folder), "-c", "safe.directory=*", "-c", "user.name=test", "-c", "user.email=test@example.org",
                           "-c", "commit.gpgsign=false", "-c", "tag.gpgsign=false", "-c", "core.hooksPath=/dev/null", *arguments],
                          check=True, capture_output=True, text=True).stdout


class Release(unittest.TestCase):
    """In a clone whose files agree: each test breaks one thing."""

    def setUp(self):
        self.scratch = tempfile.TemporaryDirectory()
        self.clone = pathlib.Path(self.scratch.name) / "clone"
        self.clone.mkdir()
        for name in git(SOURCE, "ls-files", "cmake", "CMakeLists.txt", "CITATION.cff").split():
            (self.clone / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(SOURCE / name, self.clone / name)
        self.version = re.search(r"^project\(tetwarp VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text(encoding="utf-8"), re.M)[1]
        (self.clone / "CHANGELOG.md").write_text(f"# Changes\n\n## [{self.version}] - 2026-01-31\n\n- All.\n\n## [0.0.1] - 2025-01-31\n",
                                                 encoding="utf-8")
        git(self.clone, "init", "-q")
        self.commit()

    def tearDown(self):
        self.scratch.cleanup()

    def commit(self):
        git(self.clone, "add", "-A")
        git(self.clone, "commit", "-q", "-m", "State")

    def refused(self, text, folder="out", arguments=()):
        """Runs the script without any program that would make something, and expects an error."""
        out = pathlib.Path(self.scratch.name) / folder
        before = sorted(out.iterdir()) if out.exists() else []
        tags = git(self.clone, "tag")
        tools = pathlib.Path(self.scratch.name) / "bin"
        tools.mkdir(exist_ok=True)
        for name in ["bash", "git", "sed", "awk", "grep", "ls", "mkdir", "dirname", "env"]:
            if not (tools / name).exists():
                (tools / name).symlink_to(shutil.which(name))
        run = subprocess.run([str(tools / "bash"), str(self.clone / "cmake/release/release.sh"), str(out), *arguments], env={"PATH": str(tools)},
                             capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 1, run.stderr)
        self.assertIn(text, run.stderr)
        self.assertEqual(sorted(out.iterdir()), before)
        self.assertEqual(git(self.clone, "tag"), tags)

    def test_whole_state_wants_only_programs(self):
        self.refused("doxygen is not installed")

    def test_uncommitted_change(self):
        path = self.clone / "CITATION.cff"
        path.write_text(path.read_text(encoding="utf-8") + "# more\n", encoding="utf-8")
        self.refused("changes that are not committed")

    def test_file_that_is_not_known(self):
        (self.clone / "new.txt").write_text("new", encoding="utf-8")
        self.refused("changes that are not committed")

    def test_other_version_in_citation(self):
        path = self.clone / "CITATION.cff"
        path.write_text(path.read_text(encoding="utf-8").replace(f"version: {self.version}", "version: 9.9.9"), encoding="utf-8")
        self.commit()
        self.refused("CITATION.cff does not name version")

    def test_changes_without_date(self):
        path = self.clone / "CHANGELOG.md"
        path.write_text(path.read_text(encoding="utf-8").replace(" - 2026-01-31", ""), encoding="utf-8")
        self.commit()
        self.refused("CHANGELOG.md has no section")

    def test_tag_that_is_there(self):
        git(self.clone, "tag", f"v{self.version}")
        self.refused(f"the tag v{self.version} is there already")

    def test_python_that_is_not_there(self):
        self.refused("python9.9 is no program", arguments=["--python", "python9.9"])

    def test_folder_with_files(self):
        full = pathlib.Path(self.scratch.name) / "full"
        full.mkdir()
        (full / "mine").write_text("mine", encoding="utf-8")
        self.refused("is not empty", "full")


class BillOfMaterials(unittest.TestCase):
    def test_licence_that_is_not_known(self):
        known = dict(sbom.LICENCES)
        sbom.LICENCES.clear()
        self.addCleanup(sbom.LICENCES.update, known)
        if not sbom.output_of("dpkg-query", "-W", "libc6"):
            self.skipTest("no system of Debian")
        with self.assertRaisesRegex(SystemExit, "no licence is known for libc6"):
            sbom.Document("0").debian("libc6")

    def test_libraries_of_a_wheel(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "a.whl"
            with zipfile.ZipFile(path, "w") as wheel:
                for name in ["tetwarp/_core.abi3.so", "tetwarp.libs/libtbb-1a2b3c4d.so.12.8", "tetwarp.libs/libhwy-00aa11bb.so.1.0.3"]:
                    wheel.writestr(name, "")
            self.assertEqual(list(sbom.loaded_by_wheel(path)), ["libtbb.so.12.8", "libhwy.so.1.0.3"])


if __name__ == "__main__":
    if not (SOURCE / ".git").exists():
        print("skipped: the sources are no clone of git")
        raise SystemExit(77)
    unittest.main()
