#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Makes the film and the pictures of the viewer: tissue is pulled in a slice, then cut open.

    docs/pictures/view/film.py PROGRAM FOLDER

Writes pull.gif, grab.png and cut.png. It wants Chromium, ffmpeg and a Python with playwright.
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "tests" / "view"))
from client import AT_REST, DONE, Program  # noqa: E402
from playwright.sync_api import sync_playwright  # noqa: E402

WIDTH, HEIGHT, SHOWN, RATE = 1180, 800, 680, 10
PALETTE = "split[a][b];[a]palettegen[p];[b][p]paletteuse=dither=none"


class Film:
    def __init__(self, page, folder):
        self.page, self.folder, self.count = page, folder, 0

    def take(self, times=1):
        path = f"{self.folder}/{self.count:04d}.png"
        self.page.screenshot(path=path)
        self.count += 1
        for _ in range(times - 1):
            shutil.copy(path, f"{self.folder}/{self.count:04d}.png")
            self.count += 1

    def still(self, path):
        """A picture at rest."""
        self.page.wait_for_function(AT_REST)
        self.page.wait_for_timeout(200)
        self.page.screenshot(path=f"{self.folder}/still.png")
        subprocess.run(["ffmpeg", "-v", "error", "-y", "-i", f"{self.folder}/still.png", "-vf", PALETTE, str(path)], check=True)

    def settle(self):
        self.page.wait_for_function(DONE)
        self.page.wait_for_timeout(400)

    def at(self, pane, x, y):
        box = self.page.locator(f"[data-pane={pane}]").bounding_box()
        return box["x"] + x * box["width"], box["y"] + y * box["height"]

    def drag(self, pane, points, each=True):
        self.page.mouse.move(*self.at(pane, *points[0]))
        self.take(2)
        self.page.mouse.down()
        for point in points[1:]:
            self.page.mouse.move(*self.at(pane, *point))
            if each:
                self.page.wait_for_timeout(250)
            self.take()
        return points[-1]


def line(begin, end, steps):
    return [(begin[0] + n / steps * (end[0] - begin[0]), begin[1] + n / steps * (end[1] - begin[1])) for n in range(steps + 1)]


def main():
    program, output = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2]).resolve()
    with tempfile.TemporaryDirectory() as scratch, Program(program, "--demo", cwd=scratch) as served, sync_playwright() as play:
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        page.goto(served.address)
        page.wait_for_function("() => window.tetwarp.state && window.tetwarp.state.quality")
        film = Film(page, scratch)
        page.select_option("#style", "ct-skin")
        film.settle()
        page.keyboard.press("g")
        film.drag("axial", line((0.5, 0.27), (0.44, 0.12), 12))
        film.still(output / "grab.png")
        page.mouse.up()
        film.settle()
        film.take(4)
        page.keyboard.press("Control+z")
        page.keyboard.press("Control+z")
        film.settle()
        film.take(3)
        page.keyboard.press("c")
        film.drag("axial", line((0.5, 0.18), (0.5, 0.42), 6), each=False)
        page.mouse.up()
        film.settle()
        page.keyboard.press("g")
        film.drag("axial", line((0.53, 0.27), (0.64, 0.2), 10))
        film.settle()
        film.take(6)
        film.still(output / "cut.png")
        browser.close()
        filters = f"fps={RATE},scale={SHOWN}:-1:flags=lanczos,{PALETTE.replace('palettegen', 'palettegen=max_colors=96')}"
        subprocess.run(["ffmpeg", "-v", "error", "-y", "-framerate", str(RATE), "-i", f"{scratch}/%04d.png", "-vf", filters,
                        "-loop", "0", str(output / "pull.gif")], check=True)


if __name__ == "__main__":
    main()
