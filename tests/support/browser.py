"""Pages in headless Chromium, in real time, and what programs in them say."""

import re
import shutil
import subprocess
import threading

import pytest

LONGEST = 120.0  # s
needs_chromium = pytest.mark.skipif(shutil.which("chromium") is None, reason="no chromium")


def told(pages, program, folder, fragment=""):
    """What a program says in each of some pages, all open at the same time.

    Args:
        pages: HTML by name.
        program: the body of an asynchronous JavaScript function that returns a text.
        fragment: of their address, after #.
    """
    for name, html in pages.items():
        script = f'console.log("TOLD", "{name}:", await (async () => {{ {program} }})())'
        probed = html.replace("</body>", f'<script type="module">{script}</script></body>')
        (folder / f"{name}.html").write_text(probed)
    frames = "".join(
        f'<iframe src="{name}.html#{fragment}" width="900" height="700"></iframe>' for name in pages
    )
    (folder / "all.html").write_text(f"<!DOCTYPE html><title>all</title><body>{frames}</body>")
    return _listen(set(pages), folder)


def _listen(names, folder):
    process = subprocess.Popen(
        ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run",
         "--disable-background-networking", "--disable-component-update", "--disable-sync",
         f"--user-data-dir={folder / 'profile'}", "--window-size=1000,2000",
         "--enable-logging=stderr", (folder / "all.html").as_uri()],
        stderr=subprocess.PIPE, text=True, errors="replace",
    )  # fmt: skip
    clock = threading.Timer(LONGEST, process.kill)
    clock.start()
    said, complaints = {}, []
    try:
        for line in process.stderr:
            found = re.search(r'CONSOLE:\d+\] "(TOLD (\w+): )?(.*)", source:', line)
            if found and found[1]:
                said[found[2]] = found[3]
            elif found:
                complaints.append(found[3])
            if set(said) == names:
                return said
    finally:
        clock.cancel()
        process.kill()
        process.wait()
        process.stderr.close()
    raise AssertionError(f"only {said} said anything; complaints: {complaints}")
