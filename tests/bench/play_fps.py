#!/usr/bin/env python3
"""Frames a second of the page that plays a morph (`polymorph mesh --html`), in headless Chromium with software GL, and where a frame goes.

play_fps.py PAGE.html [PAGE.html ...]    several are measured in turns, for a comparison beside other work
  --rounds N     each page so often (3); medians are printed
  --seconds S    of playing (6)
  --window W,H   of the browser (640,560)
"""

import argparse
import os
import pathlib
import statistics
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import play_test  # noqa: E402

# Runs in the page. Frames are those that the page drew; it draws each moment once, however often the browser asks (`asked`). `script` is
# what the page itself takes for a frame and `raster` the wait until it is drawn (a pixel read back, in frames of their own after
# playing); what is left of the processor time is the browser's: it composes the window.
MEASURE = """
async seconds => {
  const P = polymorph, gl = document.getElementById('view').getContext('webgl2'), sleep = ms => new Promise(r => setTimeout(r, ms));
  const median = list => { const s = [...list].sort((a, b) => a - b); return s.length ? s[s.length >> 1] : 0; };
  const begun = performance.now();
  /// Plays so long, or until `until` says so.
  const play = (ms, until) => new Promise(done => {
    const start = performance.now(), {drawn, played} = P.stats; let last, gaps = [];
    const tick = now => {
      if (last !== undefined) gaps.push(now - last);
      last = now;
      if (now - start < ms && !(until && until())) requestAnimationFrame(tick);
      else done({fps: (P.stats.drawn - drawn) / (P.stats.played - played), asked: 1000 * gaps.length / (now - start), frames: P.stats.drawn - drawn});
    };
    requestAnimationFrame(tick);
  });
  P.play(true);
  const first = await play(120000, () => P.surfaces.done);
  await P.ready;
  const ready = (performance.now() - begun) / 1000;
  await play(3000);  // until the resolution has settled
  const mark = () => fetch('/mark', {method: 'POST', body: 'null'});
  await mark();
  const steady = await play(1000 * seconds);
  await mark();
  const canvas = gl.canvas, scale = P.stats.scale, size = [canvas.width, canvas.height];
  P.play(false); await sleep(400);
  const pixel = new Uint8Array(4), wait = () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  const script = [], raster = [], count = P.morph.count;
  for (let i = 0; i < 24; ++i) {
    const frame = 1 + (i * 5) % Math.max(1, count - 1);
    wait();
    const a = performance.now();
    P.show(frame, scale);
    const b = performance.now();
    wait();
    const c = performance.now();
    script.push(b - a); raster.push(c - b);
  }
  return {first: first.fps, ready, fps: steady.fps, frames: steady.frames, asked: steady.asked, moments: P.surfaces.per_frame * P.morph.data.fps, script: median(script), raster: median(raster),
    scale, width: size[0], height: size[1], surfaces: P.surfaces.all};
}"""


def processor_seconds(browser):
    """Processor time until now of the browser's processes, by their kind."""
    parents, used = {}, {}
    for folder in pathlib.Path("/proc").iterdir():
        try:
            if folder.name.isdigit():
                fields = (folder / "stat").read_text().rsplit(")", 1)[1].split()
                parents[int(folder.name)] = int(fields[1]), (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
        except OSError:
            pass  # gone
    for process, (_, seconds) in parents.items():
        ancestor = process
        while ancestor in parents and ancestor != browser:
            ancestor = parents[ancestor][0]
        if ancestor != browser:
            continue
        words = pathlib.Path(f"/proc/{process}/cmdline").read_bytes().decode(errors="replace").replace("\0", " ").split()
        kind = next((word[len("--type="):] for word in words if word.startswith("--type=")), "browser")
        used[kind] = used.get(kind, 0) + seconds
    return used


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("pages", nargs="+", type=pathlib.Path)
    arguments.add_argument("--rounds", type=int, default=3)
    arguments.add_argument("--seconds", type=float, default=6)
    arguments.add_argument("--window", default="640,560")
    options = arguments.parse_args()
    results = {page: [] for page in options.pages}
    for _ in range(options.rounds):
        for page in options.pages:
            marks = []
            result = play_test.browse(page.read_text(encoding="utf-8"), MEASURE, options.seconds, window=options.window,
                                      on_mark=lambda browser: marks.append(processor_seconds(browser)))[0]
            for kind, key in (("renderer", "page_ms"), ("gpu-process", "gpu_ms"), (None, "all_ms")):
                before, after = [mark.get(kind, 0) if kind else sum(mark.values()) for mark in marks]
                result[key] = 1000 * (after - before) / result["frames"]
            results[page].append(result)
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    for page, rounds in results.items():
        r = {key: statistics.median(one[key] for one in rounds) for key in rounds[0]}
        print(f"{page.name}: {r['fps']:.1f} frames a second ({min(one['fps'] for one in rounds):.1f} to {max(one['fps'] for one in rounds):.1f}) of {r['moments']:.0f}, "
              f"asked for {r['asked']:.1f}; {r['first']:.1f} while {r['surfaces']:.0f} surfaces are made, in {r['ready']:.1f} s")
        print(f"  {r['width']:.0f} x {r['height']:.0f} pixels (scale {r['scale']:.2f}); one frame alone: script {r['script']:.1f} ms, drawing {r['raster']:.1f} ms")
        print(f"  processor time of a frame in play: {r['all_ms']:.1f} ms: the page's process {r['page_ms']:.1f}, the drawing process {r['gpu_ms']:.1f}")


if __name__ == "__main__":
    main()
