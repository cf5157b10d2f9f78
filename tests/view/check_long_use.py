#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Uses the viewer at random for a long time: every tool, undo, lost lines, a page that reads slowly.

    check_long_use.py PROGRAM [--actions N] [--seed N] [-- OPTIONS OF tetwarp view]

At the end what is seen must be, pixel for pixel, what the saved scenario gives when it is played anew, nothing may have
gone wrong that was not refused with a reason, and memory may have grown by 200 bytes an action beyond the snapshots.
Prints a JSON object of what was measured.
"""
import argparse
import json
import pathlib
import random
import sys
import tempfile
import time

from check_server import expect, expect_seen
from client import Page, Program

SNAPSHOTS = 1 << 30
REFUSALS = ("nothing is seen", "no tissue", "holds nothing", "no cut has the name", "meets no tissue", "more than 1000",
            "nothing to grip", "held", "pinned", "outside the lattice", "lies outside", "moves no vertex", "already")


def somewhere(page, chance):
    middle = page.about["middle"]
    return [middle[axis] + chance.uniform(-140, 140) for axis in range(3)]


def act(page, chance):
    what = chance.choices(
        ("grip", "move", "release", "pin", "unpin", "cut", "suture", "reopen", "ball", "lift", "undo", "redo", "look", "turn",
         "probe", "levels"), weights=(6, 60, 4, 2, 1, 0.2, 1, 1, 8, 2, 2, 1, 6, 6, 6, 1))[0]
    cuts = [cut["name"] for cut in page.state["cuts"]] or ["none"]
    keys = {
        "grip": lambda: {"at": somewhere(page, chance), "radius": chance.uniform(5, 40)},
        "move": lambda: {"by": [chance.uniform(-30, 30) for _ in range(3)]},
        "pin": lambda: {"at": somewhere(page, chance), "radius": chance.uniform(5, 30)},
        "cut": lambda: {"path": [somewhere(page, chance), somewhere(page, chance)], "along": [0, 0, 1],
                        "depth": chance.uniform(20, 80), "centred": True},
        "suture": lambda: {"name": chance.choice(cuts)},
        "reopen": lambda: {"name": chance.choice(cuts)},
        "ball": lambda: {"at": somewhere(page, chance), "radius": 25},
        "look": lambda: {"at": somewhere(page, chance)},
        "turn": lambda: {"angle": chance.uniform(0, 360), "elevation": chance.uniform(-90, 90), "zoom": chance.uniform(0.5, 4)},
        "probe": lambda: {"at": somewhere(page, chance)},
        "levels": lambda: {"width": 1500, "level": -200},
    }.get(what, dict)()
    if what == "cut" and len(cuts) > 4:
        return
    page.ask(what, **keys)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--actions", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("options", nargs="*")
    given = parser.parse_args()
    chance = random.Random(given.seed)
    begun = time.time()
    with tempfile.TemporaryDirectory() as scratch, \
            Program(str(pathlib.Path(given.program).resolve()), "--demo", *given.options, cwd=scratch) as program:
        page = Page(program)
        page.sizes(200, 200, 200)
        page.rest()
        page.ask("move", by=[0, 0, 0])
        first = program.memory_bytes()
        problems, lost = {}, 0
        grown_mb = []  # after each tenth of the actions
        for n in range(given.actions):
            if n % max(1, given.actions // 10) == 0:
                grown_mb.append(round((program.memory_bytes() - first) / 1e6))
            act(page, chance)
            page.listen(chance.choice((0, 0, 0.005, 0.025)))
            if len(page.pictures) > 200:
                del page.pictures[:-20]
            if len(page.messages) > 500:
                for message in page.messages:
                    if message["say"] == "problem":
                        problems[message["text"]] = problems.get(message["text"], 0) + 1
                page.messages.clear()
            expect(page.closed is None, f"closed: {page.closed}, {page.messages[-1:]}")
            if chance.random() < 10 / given.actions + 0.001:
                page.line.close()  # without a word
                page = Page(program, take=True)
                page.sizes(200, 200, 200)
                expect(page.listen(30, lambda p: p.about and p.state), "the line does not come back")
                lost += 1
        page.acknowledges = True
        page.ask("release")
        page.rest(300)
        grown = program.memory_bytes() - first
        for message in page.messages:
            if message["say"] == "problem":
                problems[message["text"]] = problems.get(message["text"], 0) + 1
        unknown = {text: count for text, count in problems.items() if not any(part in text for part in REFUSALS)}
        expect(not unknown, unknown)
        frames = page.state["frames"]
        saved = page.save("long", ".mha", 1200)
        expect(saved["say"] == "saved", saved)
        expect_seen(page, pathlib.Path(scratch) / "tetwarp-view" / "long.mha")
        expect(grown < SNAPSHOTS + 200 * given.actions, f"memory grew by {grown} bytes, {grown_mb} MB on the way")
        print(json.dumps({"actions": given.actions, "frames": frames, "lost_lines": lost, "minutes": round((time.time() - begun) / 60, 1),
                          "memory_grown_mb": round(grown / 1e6), "on_the_way_mb": grown_mb, "refused": sum(problems.values())}))


if __name__ == "__main__":
    sys.exit(main())
