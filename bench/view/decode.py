#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""What a browser adds to the viewer's pace: decodes and paints the pictures of a recorded pull in Chromium.

    bench/view/decode.py PROGRAM INPUT [--seconds S] [--volume PIXELS] [-- OPTIONS OF tetwarp view]

Prints a JSON object: for slices and the volume the time from the bytes of a picture to its pixels on the canvas, median
and 95th percentile, ms, moving (JPEG) and at rest (PNG). The program has ended by then. It wants Chromium and playwright.
"""
import base64
import json
import shutil

from pace import arguments, part, pull
from client import Page, Program  # pace made it known where it is
from playwright.sync_api import sync_playwright

# As view/page/pane.js does it; reading a pixel waits until the canvas is painted.
PAINT = """async ([file, type, size]) => {
  const bytes = Uint8Array.from(atob(file), (c) => c.charCodeAt(0));
  window.canvas ??= document.body.appendChild(document.createElement('canvas'));
  canvas.width = canvas.height = size;
  const context = canvas.getContext('2d', {alpha: false});
  const begun = performance.now();
  const image = await createImageBitmap(new Blob([bytes], {type}));
  context.imageSmoothingQuality = 'high';
  context.drawImage(image, 0, 0, size, size);
  context.getImageData(0, 0, 1, 1);
  const spent = performance.now() - begun;
  image.close();
  return spent;
}"""


def main():
    given = arguments(seconds=6)
    with Program(given.program, *given.options) as program, Page(program) as page:
        page.sizes(512, 512, given.volume)
        page.rest()
        pull(page, given.seconds)
        page.rest()
        recorded = [(about, file) for _, about, file in page.pictures]
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"])
        tab = browser.new_page(viewport={"width": 1280, "height": 1100})
        times = {}
        for about, file in recorded:
            is_volume = about["pane"] == "volume"
            spent = tab.evaluate(PAINT, [base64.b64encode(file).decode(), "image/png" if about["exact"] else "image/jpeg",
                                         given.volume if is_volume else 512])
            name = f"{'volume' if is_volume else 'slice'}, {'at rest' if about['exact'] else 'moving'}"
            times.setdefault(name, []).append(spent)
        browser.close()
    print(json.dumps({name: {"pictures": len(all), "median_ms": round(part(all, 0.5), 1), "p95_ms": round(part(all, 0.95), 1)}
                      for name, all in sorted(times.items())}, indent=1))


if __name__ == "__main__":
    main()
