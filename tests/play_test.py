#!/usr/bin/env python3
"""The page that plays a morph (`polymorph mesh --html`), in headless Chromium: its surface is the program's.

play_test.py PROGRAM [FOLDER]    FOLDER gets pictures of the page.
Exit code 77: there is no Chromium here. POLYMORPH_CHROMIUM names one.
"""

import base64
import http.server
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import threading
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
CHROMIUM = os.environ.get("POLYMORPH_CHROMIUM") or next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
SOFTWARE_GL = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
SCENE = ROOT / "scenes/standard/penguin-monkey.json"
FRAMES = [6, 12, 18]  # of the volumetric stage, in either kind of leg
RESOLUTION = 64  # what the page has

# Runs in the page: how far each point is from the page's surface, in cells, by the field over its slope.
MEASURE = """
async points => {
  const P = polymorph, cell = P.morph.data.actors[0].cell, result = {};
  for (const [frame, list] of Object.entries(points))
    result[frame] = list.map(p => {
      const f = q => P.field(+frame, ...q), slope = [0, 1, 2].map(k => {
        const a = [...p], b = [...p]; a[k] += cell / 4; b[k] -= cell / 4; return (f(a) - f(b)) / (cell / 2); });
      return Math.abs(f(p)) / Math.hypot(...slope) / cell;
    });
  return result;
}"""
# Runs in the page: pictures of frames, with the balls and the plan in the last one, and what playing shows.
LOOK = """
async frames => {
  const P = polymorph, canvas = document.getElementById('view'), result = {pictures: {}};
  await P.ready;
  for (const frame of frames) { P.show(frame); result.pictures[frame] = canvas.toDataURL('image/png'); }
  for (const id of ['balls', 'plan']) document.getElementById(id).click();
  P.show(frames[1]); result.pictures['balls'] = canvas.toDataURL('image/png');
  for (const id of ['balls', 'plan', 'colors']) document.getElementById(id).click();
  P.show(frames[1]); result.pictures['plain'] = canvas.toDataURL('image/png');
  document.getElementById('colors').click();
  const key = (key, more) => dispatchEvent(new KeyboardEvent('keydown', {key, ...more}));
  const frame = () => parseFloat(document.getElementById('frame').textContent);
  key('Home'); result.home = frame();
  key('ArrowRight'); result.right = frame();
  key('End'); result.end = frame();
  const before = P.orbit.azimuth; key('ArrowLeft', {shiftKey: true}); result.turned = P.orbit.azimuth - before;
  key('Home'); key(' ');
  for (let i = 0; i < 3000 && !(frame() > 1); ++i) await new Promise(r => setTimeout(r, 100));  // however slow it is
  result.played = frame(); key(' ');
  result.missing = P.surfaces.all - P.surfaces.meshes.size;
  return result;
}"""


def browse(page, script, argument, dark=False, window="640,560", on_mark=None):
    """What `script`, an async function in JavaScript, returns in the page; and the paths that were asked for. What it posts to
    /mark calls `on_mark` with the browser's process id."""
    runner = f"""<script>(async () => {{
  let result;
  try {{
    while (!window.polymorph) {{
      const note = document.getElementById('note').textContent;
      if (note && !note.startsWith('evaluating')) throw new Error(note);
      await new Promise(r => setTimeout(r, 30));
    }}
    result = await ({script})({json.dumps(argument)});
  }} catch (error) {{ result = {{error: String(error.stack || error)}}; }}
  await fetch('/done', {{method: 'POST', body: JSON.stringify(result)}});
}})()</script>"""
    asked, answers, done = [], [], threading.Event()

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            asked.append(self.path)
            self.send_response(200 if self.path == "/" else 404)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            if self.path == "/":
                self.wfile.write((page + runner).encode())

        def do_POST(self):
            body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            if self.path == "/mark":
                on_mark(browser.pid)
            else:
                answers.append(body)
            self.send_response(200)
            self.end_headers()
            if self.path == "/done":
                done.set()

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        options = ["--headless=new", "--no-sandbox", "--no-first-run", "--disable-background-networking", "--disable-gpu-watchdog", f"--window-size={window}",
                   f"--user-data-dir={profile}", *SOFTWARE_GL, *(["--force-dark-mode", "--blink-settings=preferredColorScheme=0"] if dark else [])]
        browser = subprocess.Popen([CHROMIUM, *options, f"http://127.0.0.1:{server.server_port}/"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        came = done.wait(600)
        browser.terminate()
        try:
            browser.wait(60)
        except subprocess.TimeoutExpired:
            browser.kill()
            browser.wait()
    server.shutdown()
    server.server_close()
    if not came:
        raise AssertionError("the page did not answer")
    if isinstance(answers[0], dict) and "error" in answers[0]:
        raise AssertionError(answers[0]["error"])
    return answers[0], [path for path in asked if path != "/favicon.ico"]


def ply_points(path):
    data = path.read_bytes()
    start = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:start].decode().split("element face")[0]
    count = int(re.search(r"element vertex (\d+)", header).group(1))
    sizes = {"float": 4, "uchar": 1, "int": 4, "uint": 4}
    stride = sum(sizes[line.split()[1]] for line in header.splitlines() if line.startswith("property"))
    return [struct.unpack_from("<3f", data, start + i * stride) for i in range(count)]


class Play(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory(prefix="polymorph-play-")
        cls.folder = pathlib.Path(cls.temporary.name)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def run_mesh(self, *arguments, code=0, scene=SCENE):
        done = subprocess.run([PROGRAM, "mesh", scene, "--cache-dir", self.folder / "cache", "-q", *map(str, arguments)], cwd=self.folder, capture_output=True, text=True)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr

    def made(self, name, *settings, scene=SCENE):
        """The page's text, and points of the program's surface at three moments."""
        sets = [word for setting in settings for word in ("--set", setting)]
        self.run_mesh("--html", f"{name}.html", *sets, scene=scene)
        self.run_mesh("-f", ",".join(map(str, FRAMES)), "-o", f"{name}.####.ply", "--set", f"surface.resolution={RESOLUTION}", *sets, scene=scene)
        points = {str(frame): ply_points(self.folder / f"{name}.{frame:04}.ply")[::3] for frame in FRAMES}
        return (self.folder / f"{name}.html").read_text(encoding="utf-8"), points

    def expect_same_surface(self, page, points, mended=0, bounds=(0.02, 0.05, 0.25)):
        """`bounds`: of the distances in cells, RMS, of 99.5 % and of all. `mended`: the share of vertices, at most, that the program has moved to cap a handle between two parts that touch."""
        distances, asked = browse(page, MEASURE, points)
        self.assertEqual(asked, ["/"], "the page asks for nothing else")
        for frame, all_of_it in distances.items():
            values = sorted(all_of_it)
            rms = (sum(v * v for v in values) / len(values)) ** 0.5
            print(f"  frame {frame}: {len(values)} points, {rms:.4f} cells RMS, 99.5 %: {values[int(0.995 * len(values))]:.4f}, at most {values[-1]:.4f}")
            self.assertGreater(len(values), 1000)
            values = values[:len(values) - int(mended * len(values))]
            rms = (sum(v * v for v in values) / len(values)) ** 0.5
            self.assertLessEqual(rms, bounds[0])
            # Vertices of the program are placed by one step on the field: beside creases some stand that far from it.
            self.assertLessEqual(values[int(0.995 * len(values))], bounds[1])
            self.assertLessEqual(values[-1], bounds[2])

    def test_the_surface_is_the_programs(self):
        page, points = self.made("distance")
        self.assertLessEqual(len(page.encode()), 1_500_000)
        self.assertIsNone(re.search(r"(src|href)=|url\(|@import|https?://(?!www\.w3\.org)", page.split('<script type="application/json"')[0]))
        self.expect_same_surface(page, points)

    def test_the_surface_with_landmarks_is_the_programs(self):
        landmarks = {"penguin.obj": {"tip": [-0.7025, 0.52359, -0.10021], "crown": [0, 1.88333, 0.03], "beak": "v2455"},
                     "monkey.obj": {"tip": [-1.03776, 0.84732, -0.20341], "crown": "v2809", "beak": [0.0875, 0.35, 0.815]}}
        page, points = self.made("landmarks", f"plan.landmarks={json.dumps(landmarks)}")
        # Half way the feet touch, and a handle between them is cut.
        self.expect_same_surface(page, points, mended=0.01)

    def test_the_surface_of_balls_is_the_programs(self):
        page, points = self.made("balls", "motion.interpolate=balls")
        self.assertLessEqual(len(page.encode()), 1_500_000)
        self.expect_same_surface(page, points)

    def test_the_surface_of_a_mixture_is_the_programs(self):
        models = ROOT / "scenes/models"
        blend = [{"model": str(models / f"{name}.obj"), "weight": {"easing": "linear", "keys": [{"frame": f, "value": w} for f, w in zip(FRAMES, weights)]}}
                 for name, weights in (("teapot", (2, 1, 0)), ("penguin", (1, 1, 1)), ("torus", (1, 1, 3)))]
        (self.folder / "blend.json").write_text(json.dumps({"blend": blend, "frames": {"count": FRAMES[-1]}}))
        page, points = self.made("blend", scene=self.folder / "blend.json")
        self.assertLessEqual(len(page.encode()), 1_500_000)
        self.expect_same_surface(page, points, mended=0.01, bounds=(0.02, 0.08, 0.25))

    def test_it_shows_and_plays(self):
        self.run_mesh("--html", "look.html", "--overwrite", "--set", "frames.fps=24", "--set", "frames.count=12")
        result, asked = browse((self.folder / "look.html").read_text(encoding="utf-8"), LOOK, [1, 6, 12])
        self.assertEqual(asked, ["/"])
        pictures = {name: base64.b64decode(url.split(",")[1]) for name, url in result["pictures"].items()}
        for name, png in pictures.items():
            self.assertGreater(len(png), 8000, f"{name} is nearly empty")
            if len(sys.argv) > 1:
                (pathlib.Path(sys.argv[1]) / f"{name}.png").write_bytes(png)
        self.assertEqual(len(set(pictures.values())), len(pictures), "all of them differ")
        self.assertEqual((result["home"], result["right"], result["end"]), (1, 2, 12))
        self.assertGreater(result["turned"], 0)
        self.assertGreater(result["played"], 1)
        self.assertEqual(result["missing"], 0)

    def test_wrong_uses_are_refused(self):
        self.assertIn("give -o morph.usda", self.run_mesh(code=2))
        self.assertIn("leave out --frames", self.run_mesh("--html", "x.html", "-f", "1", code=2))
        self.assertIn("use .html", self.run_mesh("--html", "x.htm", code=2))
        (self.folder / "there.html").write_text("mine")
        self.assertIn("exists", self.run_mesh("--html", "there.html", code=4))


if __name__ == "__main__":
    PROGRAM = str(pathlib.Path(sys.argv.pop(1)).absolute())
    if not CHROMIUM or subprocess.run([CHROMIUM, "--version"], capture_output=True).returncode:
        print("*** PLAY TESTS SKIPPED: no Chromium (Debian's package chromium, or POLYMORPH_CHROMIUM)", file=sys.stderr)
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])
