#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""How fast the viewer follows a hand: a scripted page that pulls tissue and takes pictures as fast as they come.

    bench/view/pace.py PROGRAM INPUT [--seconds S] [--volume PIXELS] [-- OPTIONS OF tetwarp view]

Prints a JSON object: seconds to the first picture, pictures a second of each pane while the hand moves, the time from
a move to the last byte of the first picture that shows it (median and 95th percentile, ms), the time to exact pictures
after the hand rests, bytes a second and memory. What a browser adds, decoding and painting, is not in it.
"""
import argparse
import json
import math
import pathlib
import signal
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests" / "view"))
from client import Page, Program  # noqa: E402


def part(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else math.nan


def arguments(seconds):
    """What the scripts of this folder are given: program, input, seconds of the pull, size of the volume's picture."""
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("input")
    parser.add_argument("--seconds", type=float, default=seconds)
    parser.add_argument("--volume", type=int, default=1024)
    parser.add_argument("options", nargs="*")
    given = parser.parse_args()
    given.options = [*(["--demo"] if given.input == "demo" else [given.input]), *given.options]
    return given


def pull(page, seconds, rate=60):
    """Grips tissue in front of the middle and moves it around a circle, `rate` moves a second."""
    x, y, z = page.about["middle"]
    page.ask("grip", at=[x, y - 40, z], radius=25)
    begun = time.perf_counter()
    moves = []
    while (now := time.perf_counter()) - begun < seconds:
        angle = 2 * math.pi * (now - begun) / 4
        moves.append(page.ask("move", by=[30 * math.sin(angle), 15 * (math.cos(angle) - 1), 10 * math.sin(2 * angle)]))
        page.listen(max(0.0, begun + len(moves) / rate - time.perf_counter()))
    return begun, moves


def latencies(page, pane, moves):
    """From each move to the first picture of a pane that shows it, or a later one."""
    pictures = [(when, about["request"]) for when, about, _ in page.pictures if about["pane"] == pane]
    times, at = [], 0
    for move in moves:
        while at < len(pictures) and pictures[at][1] < move:
            at += 1
        if at < len(pictures):
            times.append(1e3 * (pictures[at][0] - page.sent[move]))
    return times


def main():
    given = arguments(seconds=8)
    begun = time.perf_counter()
    with Program(given.program, "--verbose", *given.options) as program, Page(program) as page:
        page.sizes(512, 512, given.volume)
        page.listen(120, lambda p: len({about["pane"] for _, about, _ in p.pictures}) == 4)
        first = page.pictures[0][0] - begun
        all_panes = page.pictures[-1][0] - begun
        page.rest()
        page.pictures.clear()
        page.bytes = 0
        start, moves = pull(page, given.seconds)
        stop = time.perf_counter()
        during = [about for when, about, _ in page.pictures if when <= stop]
        size = page.bytes
        frames = page.state["frames"]
        last = time.perf_counter()
        page.rest()
        result = {
            "backend": page.about["backend"],
            "size": page.about["size"],
            "first_picture_s": round(first, 2),
            "all_panes_s": round(all_panes, 2),
            "steps_per_s": round(frames / given.seconds, 1),
            "exact_at_rest_s": round(time.perf_counter() - last, 2),
            "megabytes_per_s": round(size / given.seconds / 1e6, 2),
            "memory_mb": round(program.memory_bytes() / 1e6),
        }
        for pane in ("axial", "coronal", "sagittal", "volume"):
            waits = latencies(page, pane, moves)
            result[pane] = {
                "per_s": round(sum(about["pane"] == pane for about in during) / given.seconds, 1),
                "median_ms": round(part(waits, 0.5), 1),
                "p95_ms": round(part(waits, 0.95), 1),
            }
        program.process.send_signal(signal.SIGINT)
        result["stages"] = [line for line in program.process.communicate(timeout=30)[1].splitlines() if " each" in line]
        print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
