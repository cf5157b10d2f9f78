#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Uses the page of the viewer in Chromium: every tool, every key, touch, a lost line, two pages, accessibility.

    check_page.py PROGRAM [--environment FOLDER] [--pictures FOLDER]

--environment: a virtual environment with playwright and axe-playwright-python (tests/python_environment.sh makes one).
--pictures: keeps pictures of what it saw. Without Chromium or playwright the exit status is 77, and one line says why.
"""
import argparse
import contextlib
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

PATIENCE_MS = 60000


def skip(why):
    print(f"skipped: {why}")
    sys.exit(77)


def parse():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--environment")
    parser.add_argument("--pictures")
    parser.add_argument("--only", help="a part of the names of the tests to run")
    return parser.parse_args()


GIVEN = parse()
GIVEN.program = str(pathlib.Path(GIVEN.program).resolve())
if GIVEN.environment:
    python = pathlib.Path(GIVEN.environment) / "bin" / "python"
    if python.exists() and pathlib.Path(sys.prefix).resolve() != pathlib.Path(GIVEN.environment).resolve():
        os.execv(python, [python, *sys.argv])
try:
    from playwright.sync_api import sync_playwright
except ImportError:
    skip("this Python has no playwright")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
if not CHROMIUM:
    skip("there is no Chromium")

from client import AT_REST, DONE, Program  # noqa: E402


def expect(what, message=""):
    if not what:
        raise AssertionError(message)


class Viewer:
    """A page in the browser, and what is read from it."""

    def __init__(self, page, address):
        self.page = page
        self.problems = []
        page.on("console", lambda m: self.problems.append(m.text) if m.type in ("error", "warning") else None)
        page.on("pageerror", lambda e: self.problems.append(str(e)))
        page.goto(address)

    def rest(self):
        """Waits until the program has done all that was asked, and all panes that are seen show exact pictures of it."""
        self.page.wait_for_function(AT_REST, timeout=PATIENCE_MS)

    def text(self, selector):
        return self.page.locator(selector).inner_text()

    def frames(self):
        return int(self.text("#held").split()[0])

    def wait_frames(self, least):
        """Waits for so many frames; or for what was asked to come to rest with fewer, as moves that follow each other
        quickly are one."""
        self.page.wait_for_function(
            f"n => window.tetwarp.state.frames >= n || (window.tetwarp.state.frames > 0 && ({DONE})())", arg=least,
            timeout=PATIENCE_MS)

    def wait_text(self, selector, part):
        self.page.wait_for_function("([s, t]) => document.querySelector(s).textContent.includes(t)", arg=[selector, part],
                                    timeout=PATIENCE_MS)

    def key(self, key):
        self.page.keyboard.press(key)

    def focus(self, pane):
        self.page.locator(f"[data-pane={pane}]").focus()

    def at(self, pane, across, below):
        box = self.page.locator(f"[data-pane={pane}]").bounding_box()
        return box["x"] + across * box["width"], box["y"] + below * box["height"]

    def drag(self, pane, begin, end, steps=6, button="left", hold=False):
        self.page.mouse.move(*self.at(pane, *begin))
        self.page.mouse.down(button=button)
        for n in range(1, steps + 1):
            part = n / steps
            self.page.mouse.move(*self.at(pane, begin[0] + part * (end[0] - begin[0]), begin[1] + part * (end[1] - begin[1])))
            time.sleep(0.05)
        if not hold:
            self.page.mouse.up(button=button)

    def pixels(self, pane):
        """The picture of a pane, as it is on the screen."""
        return self.page.locator(f"[data-pane={pane}] canvas").evaluate("c => c.toDataURL()")

    def slice(self, pane):
        """Number of the slice that a pane shows."""
        return self.page.evaluate("p => window.tetwarp.panes.find((one) => one.name === p).voxel", pane)

    def picture(self, name):
        if GIVEN.pictures:
            pathlib.Path(GIVEN.pictures).mkdir(parents=True, exist_ok=True)
            self.page.screenshot(path=f"{GIVEN.pictures}/{name}.png")

    def reset(self):
        self.key("Escape")
        self.key("Escape")
        if self.page.locator("#reset").is_enabled():
            self.page.click("#reset")
            self.page.wait_for_function("() => document.getElementById('reset').disabled", timeout=PATIENCE_MS)
        self.key("v")
        self.key("r")
        self.rest()


def the_first_picture_is_there_and_nothing_is_wrong(v):
    v.rest()
    expect(v.page.title() == "Tetwarp", v.page.title())
    expect("#" not in v.page.url, "the token stays in the address")
    expect(v.text("#badge") == "No folds")
    v.picture("first")


def the_wheel_slices_and_with_ctrl_it_zooms(v):
    before = v.slice("axial")
    v.page.mouse.move(*v.at("axial", 0.4, 0.4))
    v.page.mouse.wheel(0, -300)
    expect(v.slice("axial") == before + 3, f"{before} -> {v.slice('axial')}")
    v.page.mouse.wheel(0, 500)
    expect(v.slice("axial") == before - 2)
    was = v.page.evaluate("() => window.tetwarp.panes[0].zoom")
    v.page.keyboard.down("Control")
    v.page.mouse.wheel(0, -200)
    v.page.keyboard.up("Control")
    expect(v.page.evaluate("() => window.tetwarp.panes[0].zoom") > was)
    expect(v.slice("axial") == before - 2, "zooming went through slices")


def dragging_looks_pans_and_zooms(v):
    v.page.mouse.click(*v.at("axial", 0.3, 0.35))
    coronal, sagittal = v.slice("coronal"), v.slice("sagittal")
    v.drag("axial", (0.3, 0.35), (0.6, 0.6))
    expect(v.slice("coronal") > coronal and v.slice("sagittal") > sagittal, "the crosshair stays")
    pan = "() => window.tetwarp.panes[0].pan.x"
    before = v.page.evaluate(pan)
    v.page.keyboard.down("Shift")
    v.drag("axial", (0.4, 0.4), (0.6, 0.4))
    v.page.keyboard.up("Shift")
    expect(v.page.evaluate(pan) > before, "Shift and drag does not pan")
    middle = v.page.evaluate(pan)
    v.drag("axial", (0.4, 0.4), (0.5, 0.4), button="middle")
    expect(v.page.evaluate(pan) > middle, "the middle button does not pan")
    zoom = v.page.evaluate("() => window.tetwarp.panes[0].zoom")
    v.drag("axial", (0.4, 0.6), (0.4, 0.4), button="right")
    expect(v.page.evaluate("() => window.tetwarp.panes[0].zoom") > zoom, "the right button does not zoom")
    turned = v.page.evaluate("() => window.tetwarp.panes[3].camera.angle")
    v.drag("volume", (0.4, 0.5), (0.6, 0.45))
    expect(v.page.evaluate("() => window.tetwarp.panes[3].camera.angle") != turned, "the volume does not turn")


def a_value_is_shown_under_the_pointer(v):
    v.page.mouse.move(*v.at("axial", 0.5, 0.5))
    v.wait_text("#value", "HU")
    expect("mm" in v.text("#place"), v.text("#place"))
    for n in range(12):  # faster than values come
        v.page.mouse.move(*v.at("axial", 0.3 + 0.02 * n, 0.5))
    time.sleep(1)
    value = v.text("#value")
    v.page.mouse.move(*v.at("axial", 0.1, 0.1))
    time.sleep(1)
    v.page.mouse.move(*v.at("axial", 0.3 + 0.02 * 11, 0.5))
    time.sleep(1)
    expect(v.text("#value") == value, f"{value} where {v.text('#value')} is")


def windows_are_chosen_and_dragged(v):
    for key, width in (("1", "1500"), ("2", "1800"), ("3", "400"), ("4", "80"), ("5", "150")):
        v.key(key)
        v.wait_text("#window", f"width {width}")
    v.key("w")
    v.drag("axial", (0.4, 0.5), (0.6, 0.5))
    v.page.wait_for_function("() => !document.getElementById('window').textContent.includes('width 150,')")
    v.page.select_option("#preset", "bone")
    v.wait_text("#window", "width 1800")


def tissue_is_grabbed_in_a_slice_and_comes_back_by_undo(v):
    v.rest()
    before = v.pixels("axial")
    v.key("g")
    v.drag("axial", (0.45, 0.3), (0.35, 0.2), hold=True)
    v.wait_frames(4)
    v.picture("grab-slice")
    v.page.mouse.up()
    v.rest()
    frames = v.frames()
    v.key("Control+z")
    v.key("Control+z")
    v.page.wait_for_function("() => document.getElementById('undo').disabled", timeout=PATIENCE_MS)
    v.page.mouse.move(5, 5)
    v.rest()
    expect(v.frames() == 0, v.frames())
    expect(v.pixels("axial") == before, "undo does not bring the picture back")
    v.key("Control+y")
    v.key("Control+y")
    v.wait_frames(frames)


def tissue_is_grabbed_in_the_volume(v):
    v.page.select_option("#style", "ct-skin")
    v.rest()
    v.key("g")
    v.drag("volume", (0.5, 0.5), (0.6, 0.42), hold=True)
    v.wait_frames(3)
    v.picture("grab-volume")
    at = v.page.evaluate("() => window.tetwarp.hand.at")
    expect(at is not None, "nothing is held")
    v.page.mouse.up()
    v.rest()


def tissue_is_pinned_and_freed(v):
    v.key("p")
    v.page.mouse.click(*v.at("axial", 0.4, 0.4))
    v.wait_text("#held", "1 pin")
    v.key("u")
    v.page.wait_for_function("() => !document.getElementById('held').textContent.includes('pin')", timeout=PATIENCE_MS)


def a_cut_is_made_opened_and_sutured(v):
    v.key("c")
    v.drag("axial", (0.35, 0.3), (0.6, 0.33))
    v.wait_text("#cuts", "cut 1, open")
    v.rest()
    v.key("g")
    v.drag("axial", (0.45, 0.28), (0.45, 0.15), hold=True)
    v.wait_frames(v.frames() + 3)
    v.picture("cut-open")
    v.page.mouse.up()
    v.page.click("#cuts button")
    v.wait_text("#cuts", "cut 1, closed")
    v.rest()
    v.picture("cut-sutured")
    v.page.click("#cuts button")
    v.wait_text("#cuts", "cut 1, open")
    v.page.select_option("#style", "ct-skin")
    v.rest()
    v.key("c")
    v.drag("volume", (0.45, 0.4), (0.55, 0.6), steps=12)
    v.wait_text("#cuts", "cut 2, open")


def a_ball_pushes_and_is_lifted(v):
    v.key("b")
    v.drag("axial", (0.5, 0.12), (0.5, 0.3), hold=True)
    v.wait_text("#held", "a ball")
    v.wait_frames(3)
    v.picture("ball")
    v.page.mouse.up()
    v.key("l")
    v.page.wait_for_function("() => !document.getElementById('held').textContent.includes('ball')", timeout=PATIENCE_MS)


def overlays_and_before_and_after(v):
    v.key("g")
    v.drag("axial", (0.45, 0.3), (0.35, 0.2), hold=True)
    v.wait_frames(4)
    v.rest()
    seen = {v.pixels("axial")}
    for kind in ("lattice", "jacobian", "folds", "coverage"):
        v.page.select_option("#overlay", kind) if kind != "lattice" else v.key("o")
        v.page.wait_for_function("k => document.getElementById('overlay').value === k", arg=kind)
        v.rest()
        v.picture(f"overlay-{kind}")
        seen.add(v.pixels("axial"))
    expect(len(seen) >= 3, "overlays change nothing")
    v.page.select_option("#overlay", "")
    for key, how in (("x", "swipe"), ("d", "difference"), ("t", "before")):
        v.key(key)
        v.page.wait_for_function("h => document.getElementById('show').value === h", arg=how)
        v.rest()
        v.picture(how)
        expect(v.pixels("axial") not in seen, how)
        v.key(key)
        v.page.wait_for_function("() => document.getElementById('show').value === 'after'")
    v.page.mouse.up()


def the_radius_changes_by_keys_and_wheel(v):
    v.key("g")
    before = v.text("#radius-mm")
    v.key("]")
    expect(v.text("#radius-mm") != before)
    v.key("[")
    v.page.mouse.move(*v.at("axial", 0.5, 0.5))
    v.page.keyboard.down("Alt")
    v.page.mouse.wheel(0, -200)
    v.page.keyboard.up("Alt")
    expect(v.text("#radius-mm") != before)


def the_keyboard_alone_does_a_whole_session(v):
    v.focus("axial")
    for key in ("ArrowUp", "ArrowLeft", "PageUp", "Shift+ArrowUp"):
        v.key(key)
    v.key("p")
    v.key("Enter")
    v.wait_text("#held", "1 pin")
    v.key("g")
    v.key("Shift+ArrowUp")
    v.key("Enter")
    for _ in range(6):
        v.key("ArrowUp")
        time.sleep(0.05)
    v.wait_frames(v.frames() + 1)
    v.key("Enter")
    v.key("c")
    v.key("Enter")
    v.key("Shift+ArrowRight")
    v.key("Shift+Enter")
    v.wait_text("#cuts", "cut")
    v.key("b")
    v.key("Enter")
    v.wait_text("#held", "a ball")
    v.key("Escape")
    v.key("l")
    v.focus("volume")
    angle = v.page.evaluate("() => window.tetwarp.panes[3].camera.angle")
    v.key("v")
    v.key("ArrowLeft")
    expect(v.page.evaluate("() => window.tetwarp.panes[3].camera.angle") != angle)
    v.key("+")
    v.key("-")
    v.rest()
    v.key("Control+z")
    v.key("m")
    v.key("m")
    v.key("?")
    expect(v.page.locator("#help-dialog").is_visible())
    v.picture("help")
    v.key("Escape")
    expect(not v.page.locator("#help-dialog").is_visible())
    v.key("s")
    expect(v.page.locator("#save-dialog").is_visible())
    v.page.fill("#save-name", "by-keys")
    v.key("Enter")
    v.page.wait_for_selector("#saved-dialog", state="visible", timeout=PATIENCE_MS)
    expect("tetwarp deform" in v.text("#saved-command"))
    v.picture("saved")
    v.key("Escape")


def a_fold_is_shown_and_jumped_to(v):
    v.page.evaluate("() => window.tetwarp.connection.ask('grip', {at: window.tetwarp.about.middle, radius: 8})")
    v.page.evaluate("() => window.tetwarp.connection.ask('move', {by: [90, 0, 0]})")
    v.wait_frames(2)
    v.rest()
    folds = v.text("#badge") == "It folds"
    expect(folds == v.page.locator("#fold").is_visible(), "badge and button disagree")
    if folds:
        before = [v.slice(p) for p in ("axial", "coronal", "sagittal")]
        v.key("f")
        expect([v.slice(p) for p in ("axial", "coronal", "sagittal")] != before, "it does not jump")
        v.picture("fold")


def one_pane_is_made_large_and_small_again(v):
    x, y = v.at("coronal", 0.5, 0.5)
    v.page.mouse.dblclick(x, y)
    expect(v.page.locator("[data-pane=coronal]").bounding_box()["width"] > 800)
    expect(not v.page.locator("[data-pane=axial]").is_visible())
    v.rest()
    v.picture("single")
    v.page.mouse.dblclick(x, y)
    expect(v.page.locator("[data-pane=axial]").is_visible())


def fingers_slice_pinch_and_pan(v):
    touch = """([pane, moves]) => {
      const canvas = document.querySelector(`[data-pane=${pane}] canvas`);
      const box = canvas.getBoundingClientRect();
      canvas.setPointerCapture = () => {};
      for (const [type, id, x, y] of moves) {
        canvas.dispatchEvent(new PointerEvent(type, {pointerId: id, pointerType: 'touch', bubbles: true, button: 0,
          clientX: box.left + x * box.width, clientY: box.top + y * box.height}));
      }
    }"""
    before = v.slice("axial")
    v.page.evaluate(touch, ["axial", [["pointerdown", 1, 0.5, 0.5], ["pointermove", 1, 0.5, 0.3], ["pointerup", 1, 0.5, 0.3]]])
    expect(v.slice("axial") > before, "a finger does not go through slices")
    zoom = v.page.evaluate("() => window.tetwarp.panes[0].zoom")
    v.page.evaluate(touch, ["axial", [["pointerdown", 1, 0.4, 0.5], ["pointerdown", 2, 0.6, 0.5], ["pointermove", 2, 0.8, 0.5],
                                      ["pointerup", 1, 0.4, 0.5], ["pointerup", 2, 0.8, 0.5]]])
    expect(v.page.evaluate("() => window.tetwarp.panes[0].zoom") > zoom * 1.5, "two fingers do not zoom")
    angle = v.page.evaluate("() => window.tetwarp.panes[3].camera.angle")
    v.page.evaluate(touch, ["volume", [["pointerdown", 1, 0.5, 0.5], ["pointermove", 1, 0.7, 0.5], ["pointerup", 1, 0.7, 0.5]]])
    expect(v.page.evaluate("() => window.tetwarp.panes[3].camera.angle") != angle, "a finger does not turn the volume")


def the_method_is_changed(v):
    v.page.select_option("#method", "mass-spring")
    v.key("g")
    v.drag("axial", (0.45, 0.3), (0.40, 0.25), hold=True)
    v.wait_frames(2)
    v.page.mouse.up()
    expect(v.page.locator("#method").input_value() == "mass-spring")
    v.page.click("#reset")
    v.page.select_option("#method", "chainmail")
    v.rest()


def an_error_is_told(v):
    v.page.evaluate("() => window.tetwarp.connection.ask('suture', {name: 'nothing'})")
    v.wait_text("#message", "no cut has the name")
    expect("problem" in v.page.locator("#message").get_attribute("class"))
    v.picture("error")


def small_and_enlarged_pages_fit(v):
    for width, height, scale in ((1024, 700, 1), (1024, 768, 2)):
        v.page.set_viewport_size({"width": width, "height": height})
        v.page.evaluate("s => { document.body.style.zoom = s; document.body.style.height = `calc(100vh / ${s})`; }", scale)
        expect(v.page.evaluate("() => document.documentElement.scrollWidth <= innerWidth + 1"), f"{width} x {height}, {scale}")
        for pane in ("axial", "volume"):
            box = v.page.locator(f"[data-pane={pane}]").bounding_box()
            expect(box["width"] > 100 and box["height"] > 80, f"{pane}: {box}")
        v.rest()
        v.picture(f"size-{width}-{scale}")
    v.page.evaluate("() => { document.body.style.zoom = 1; document.body.style.height = ''; }")
    v.page.set_viewport_size({"width": 1280, "height": 860})
    v.rest()


def nothing_serious_stands_against_access(v):
    try:
        from axe_playwright_python.sync_playwright import Axe
    except ImportError:
        print("        axe is not installed: left out")
        return
    for what in ("page", "help"):
        if what == "help":
            v.key("?")
        found = Axe().run(v.page, options={"rules": {}}).response["violations"]
        serious = [f"{one['id']}: {[n['target'] for n in one['nodes']]}" for one in found
                   if one["impact"] in ("serious", "critical")]
        expect(not serious, serious)
    v.key("Escape")


def a_second_page_is_told_and_may_take_over(v):
    second = v.page.context.new_page()
    try:
        second.goto(v.address)
        second.wait_for_selector("#banner", state="visible", timeout=PATIENCE_MS)
        expect("nother page" in second.locator("#banner-text").inner_text())
        second.screenshot(path=f"{GIVEN.pictures}/second.png") if GIVEN.pictures else None
        second.click("#banner-button")
        second.wait_for_selector("[data-pane=axial][data-exact=true]", timeout=PATIENCE_MS)
        v.page.wait_for_selector("#banner", state="visible", timeout=PATIENCE_MS)
        v.picture("taken")
    finally:
        second.close()
    v.page.click("#banner-button")
    v.page.wait_for_selector("#banner", state="hidden", timeout=PATIENCE_MS)
    v.rest()


def a_lost_line_comes_back(v):
    v.key("p")
    v.page.mouse.click(*v.at("axial", 0.4, 0.4))
    v.wait_text("#held", "1 pin")
    v.page.evaluate("() => window.tetwarp.connection.socket.close()")
    v.page.wait_for_selector("#banner", state="visible", timeout=PATIENCE_MS)
    v.picture("lost")
    v.page.wait_for_selector("#banner", state="hidden", timeout=PATIENCE_MS)
    v.rest()
    expect("1 pin" in v.text("#held"), v.text("#held"))


def a_page_is_loaded_again_and_has_all(v):
    v.key("p")
    v.page.mouse.click(*v.at("axial", 0.4, 0.4))
    v.wait_text("#held", "1 pin")
    v.page.reload()
    v.rest()
    expect("1 pin" in v.text("#held"), v.text("#held"))


@contextlib.contextmanager
def another(v, *options):
    """A page of another program."""
    with tempfile.TemporaryDirectory() as scratch:
        for words in options[0]:
            subprocess.run([GIVEN.program, *words], check=True, cwd=scratch, capture_output=True)
        with Program(GIVEN.program, *options[1:], cwd=scratch) as program:
            other = Viewer(v.page.context.new_page(), program.address)
            try:
                yield other
                expect(not other.problems, other.problems)
            finally:
                other.page.close()


def asked(v, word):
    """The keys of the last message of a kind that the page said since `listen`."""
    return v.page.evaluate("w => (window.asked.filter(([what]) => what === w).pop() ?? [])[1]", word)


def listen(v):
    v.page.evaluate("""() => {
      const {connection} = window.tetwarp;
      window.asked = [];
      const ask = Object.getPrototypeOf(connection).ask.bind(connection);
      connection.ask = (what, keys) => { window.asked.push([what, keys]); return ask(what, keys); };
    }""")


def a_line_that_comes_back_is_a_lasso(v):
    listen(v)
    v.page.select_option("#style", "ct-skin")
    v.rest()
    for pane, radius in (("axial", 0.12), ("volume", 0.08)):
        v.key("c")
        around = [(0.5 + radius * math.cos(0.45 * n), 0.5 + radius * math.sin(0.45 * n)) for n in range(15)]
        v.page.mouse.move(*v.at(pane, *around[0]))
        v.page.mouse.down()
        for point in around[1:-1]:
            v.page.mouse.move(*v.at(pane, *point))
        expect(not v.page.evaluate("() => window.tetwarp.hand.isClosed"), "closed before it is back")
        v.page.mouse.move(*v.at(pane, *around[0]))
        v.picture(f"lasso-{pane}")
        v.page.mouse.up()
        expect(asked(v, "cut")["closed"], "its ends are not joined")
        v.page.wait_for_function("n => document.querySelectorAll('#cuts li').length === n", arg=1 if pane == "axial" else 2,
                                 timeout=PATIENCE_MS)
        v.rest()
    v.key("c")
    v.drag("axial", (0.3, 0.3), (0.6, 0.33))
    expect(not asked(v, "cut")["closed"], "a straight line is closed")


def tissues_are_changed(v):
    listen(v)
    v.page.click("#tissues")
    expect(v.page.locator("#tissue-rows tr").count() == 4)
    v.page.fill("[aria-label='bone, stretch']", "0.07")
    v.picture("tissues")
    v.page.fill("[aria-label='bone, compression']", "7")
    v.page.click("#tissues-form button[value=apply]")
    expect(v.page.locator("#tissues-dialog").is_visible(), "a number out of its range is taken")
    v.page.fill("[aria-label='bone, compression']", "0.5")
    v.page.click("#tissues-form button[value=apply]")
    v.page.wait_for_function("() => window.tetwarp.state.tissues[0].stretch === 0.07", timeout=PATIENCE_MS)
    expect(v.page.evaluate("() => window.tetwarp.state.tissues[0].compression") == 0.5)
    v.page.click("#tissues")
    v.page.fill("[aria-label='bone, stretch']", "0.02")
    v.page.fill("[aria-label='bone, compression']", "0.02")
    v.key("Enter")
    v.page.wait_for_function("() => window.tetwarp.state.tissues[0].stretch === 0.02", timeout=PATIENCE_MS)


def all_that_may_be_kept_is_saved(v):
    v.key("p")
    v.page.mouse.click(*v.at("axial", 0.4, 0.4))
    v.wait_text("#held", "1 pin")
    v.rest()
    v.picture("pinned")
    v.key("s")
    v.page.fill("#save-name", "all")
    v.page.select_option("#save-volume", ".nrrd")
    v.page.check("#save-field")
    v.page.check("#save-pictures")
    if shutil.which("ffmpeg"):
        v.page.select_option("#save-film", ".gif")
        v.page.select_option("#save-of", "coronal")
    v.picture("save")
    v.page.click("#save-form button[value=save]")
    v.page.wait_for_selector("#saved-dialog", state="visible", timeout=PATIENCE_MS)
    files = v.text("#saved-files")
    for name in ("all.json", "all.nrrd", "all-field.mha", "all-volume.png", *(("all.gif",) if shutil.which("ffmpeg") else ())):
        expect(name in files, f"{name}: {files}")
    v.picture("saved-all")
    v.key("Escape")


def a_given_field_grows_and_labels_lie_over_it(v):
    phantom = ("phantom", "-o", "p.mha", "--size", "64,64,40", "--spacing", "6.4,6.4,7.5")
    labels = ("deform", "p.mha", "-f", "identity", "--coverage", "labels.mha", "-o", "same.mha")
    with another(v, [phantom, labels], "p.mha", "-f", "twist:angle=30", "--labels", "labels.mha") as one:
        one.rest()
        expect(not one.page.locator("#hand").is_visible() and not one.page.locator("[data-tool=grab]").is_visible())
        expect(one.text("#frame-number") == "25 of 25", one.text("#frame-number"))
        one.key("g")
        one.wait_text("#message", "hands work without it")
        whole = one.pixels("axial")
        one.page.fill("#frame", "0")
        one.wait_text("#frame-number", "1 of 25")
        one.rest()
        expect(one.pixels("axial") != whole, "nothing grows")
        one.page.locator("body").click(position={"x": 5, "y": 5})
        one.key(" ")
        one.wait_text("#frame-number", "25 of 25")
        one.rest()
        one.picture("grown")
        seen = set()
        for kind in ("labels", "contours"):
            one.page.select_option("#overlay", kind)
            one.rest()
            one.picture(f"overlay-{kind}")
            seen.add(one.pixels("axial"))
        expect(len(seen | {whole}) == 3, "labels are not seen")
        one.key("s")
        expect(not one.page.locator("#save-field-label").is_visible())
        one.page.fill("#save-name", "grown")
        one.page.select_option("#save-volume", ".mha")
        one.page.click("#save-form button[value=save]")
        one.page.wait_for_selector("#saved-dialog", state="visible", timeout=PATIENCE_MS)
        expect("-f twist:angle=30" in one.text("#saved-command").replace("'", ""), one.text("#saved-command"))


def main():
    tests = [f for name, f in globals().items() if "_" in name and callable(f) and getattr(f, "__code__", None)
             and f.__code__.co_argcount == 1 and f.__code__.co_varnames[0] == "v" and (GIVEN.only or "") in name]
    failed = 0
    with contextlib.ExitStack() as stack:
        scratch = stack.enter_context(tempfile.TemporaryDirectory())
        program = stack.enter_context(Program(GIVEN.program, "--demo", cwd=scratch))
        browser = stack.enter_context(sync_playwright()).chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"])
        context = browser.new_context(viewport={"width": 1280, "height": 860})
        viewer = Viewer(context.new_page(), program.address)
        viewer.address = program.address
        for test in tests:
            begun = time.time()
            try:
                test(viewer)
                expect(not viewer.problems, viewer.problems)
                print(f"passed  {test.__name__}  ({time.time() - begun:.1f} s)", flush=True)
            except Exception as error:  # the next test says more
                failed += 1
                viewer.picture(f"failed-{test.__name__}")
                print(f"FAILED  {test.__name__}: {type(error).__name__} {str(error)[:600]}", flush=True)
            viewer.problems.clear()
            with contextlib.suppress(Exception):
                viewer.page.mouse.up()
                viewer.reset()
        browser.close()
    print(f"{len(tests) - failed} of {len(tests)} passed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
