#!/usr/bin/env python3
"""Every control of every page that polymorph writes, in headless Chromium, by mouse, touch and keys, in narrow and wide windows: the page
that plays a morph, that on which landmarks are clicked, those of `compare` and `golden`, and that of `analyze`. The console stays empty.

pages_test.py PROGRAM [FOLDER]    FOLDER gets pictures of the pages.
Exit code 77: Chromium, its driver or Selenium is missing. POLYMORPH_CHROMIUM names a browser.
"""

import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

try:
    from browser import CHROMEDRIVER, Browser
    from selenium.webdriver.common.keys import Keys
except ImportError as error:
    # Another python3 may stand before Debian's on the PATH; python3-selenium is for Debian's.
    if os.path.exists("/usr/bin/python3") and not os.environ.get("POLYMORPH_PAGES_PYTHON"):
        os.environ["POLYMORPH_PAGES_PYTHON"] = "/usr/bin/python3"
        os.execv("/usr/bin/python3", ["/usr/bin/python3", "-B", *sys.argv])
    print(f"*** PAGES TESTS SKIPPED: no {error.name} (Debian's python3-selenium)", file=sys.stderr)
    sys.exit(77)

CHROMIUM = os.environ.get("POLYMORPH_CHROMIUM") or next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
PROGRAM = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "").absolute()
PICTURES = pathlib.Path(sys.argv[2]).absolute() if len(sys.argv) > 2 else None
# Width, height, and whether fingers are what it has.
WINDOWS = [(390, 844, True), (600, 450, False), (1280, 800, False)]
# Of pages that draw objects, which take five seconds of processor time to open. One test of each kind has a wide window, too, for the layout.
DRAWN_WINDOWS = WINDOWS[:2]
FRAMES = 9
SCENE = {
    "source": {"shape": "cube", "color": [0.7, 0.2, 0.1]}, "target": {"shape": "torus", "color": [0.1, 0.4, 0.7]}, "spheres": {"balls": 16},
    "frames": {"count": FRAMES, "fps": 30}, "surface": {"resolution": 16}, "image": {"width": 96, "height": 72, "samples": 4},
}
# Runs in a page: controls that overlap, that stand outside the window (where it does not scroll) or that a finger cannot hit.
LAYOUT = """
const [scrolls, touch] = arguments, faults = [], seen = [...document.querySelectorAll('button, input, select')].filter(e => e.offsetParent && !e.closest('dialog'));
const boxes = seen.map(e => ({name: e.id || e.textContent || e.className, b: e.getBoundingClientRect()}));
if (document.documentElement.scrollWidth > innerWidth) faults.push(`wider than the window: ${document.documentElement.scrollWidth}`);
for (const {name, b} of boxes) {
  if (b.left < 0 || b.right > innerWidth + .5 || (!scrolls && (b.top < 0 || b.bottom > innerHeight))) faults.push(`${name} is outside: ${[b.left, b.top, b.right, b.bottom].map(Math.round)}`);
  if (touch && b.height < 43.5) faults.push(`${name} is ${b.height} high`);
}
boxes.forEach(({name, b}, i) => boxes.slice(i + 1).forEach(o => {
  const wide = Math.min(b.right, o.b.right) - Math.max(b.left, o.b.left), high = Math.min(b.bottom, o.b.bottom) - Math.max(b.top, o.b.top);
  if (wide > 1 && high > 1) faults.push(`${name} lies over ${o.name}`);
}));
return faults;
"""


def polymorph(*arguments, code=0):
    done = subprocess.run([PROGRAM, *map(str, arguments)], cwd=Pages.folder, capture_output=True, text=True, env={**os.environ, "POLYMORPH_CACHE_DIR": str(Pages.folder / "cache")})
    assert done.returncode == code, f"{arguments}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout


class Pages(unittest.TestCase):
    """Opens a page in every window; what is common to all pages holds before and after."""

    windows = WINDOWS

    @classmethod
    def setUpClass(cls):
        temporary = tempfile.TemporaryDirectory(prefix="polymorph-pages-")
        cls.addClassCleanup(temporary.cleanup)
        Pages.folder = pathlib.Path(temporary.name)
        (cls.folder / "scene.json").write_text(json.dumps(SCENE))
        cls.browser = Browser(CHROMIUM)
        cls.addClassCleanup(cls.browser.quit)
        cls.make()

    def in_windows(self, page, ready, scrolls, visit, windows=None):
        for width, height, touch in windows or self.windows:
            with self.subTest(window=f"{width} x {height}"):
                self.browser.open(self.folder / page, width, height, touch)
                self.browser.wait(ready)
                self.assertEqual(self.browser.run(LAYOUT, scrolls, touch), [])
                self.keep(f"{page.replace('/', '-')}-{width}")
                visit(width, height, touch)
                self.assertEqual(self.browser.run(LAYOUT, scrolls, touch), [])
                self.assertEqual(self.browser.console(), [])
                self.assertEqual(self.browser.requests(), [], "the page asks for nothing else")

    def keep(self, name):
        if PICTURES:
            PICTURES.mkdir(parents=True, exist_ok=True)
            (PICTURES / f"{name}.png").write_bytes(self.browser.picture())

    def middle(self, selector):
        x, y, width, height = self.browser.box(selector)
        return x + width / 2, y + height / 2

    def tap(self, selector, touch):
        self.browser.run("document.querySelector(arguments[0]).scrollIntoView({block: 'nearest'})", selector)
        self.press(touch, self.middle(selector))

    def press(self, touch, *points):
        """Taps or clicks a point, or drags over several."""
        if touch:
            self.browser.touch(*([p] for p in points))
        elif len(points) == 1:
            self.browser.click(*points[0])
        else:
            self.browser.drag(*points)

    def slide(self, selector, touch, *shares):
        """Taps a slider at a share of its way, or drags it over several."""
        self.browser.run("document.querySelector(arguments[0]).scrollIntoView({block: 'nearest'})", selector)
        x, y, width, height = self.browser.box(selector)
        self.press(touch, *((x + 8 + share * (width - 16), y + height / 2) for share in shares))


class PlayPage(Pages):
    windows = DRAWN_WINDOWS

    @classmethod
    def make(cls):
        polymorph("mesh", "scene.json", "--html", "play.html", "-q")

    def visits(self, visit, windows=None):
        self.in_windows("play.html", "return window.polymorph && polymorph.surfaces.done", False, visit, windows)

    def still(self):
        """The picture, once it is at rest."""
        self.browser.wait("return polymorph.resting()")
        return self.browser.picture("#view")

    def frame(self):
        return float(self.browser.find("#frame").text.split("/")[0])

    def playing(self):
        return self.browser.find("#play").text == "Pause"

    def orbit(self):
        return self.browser.run("const {azimuth, elevation, distance} = polymorph.orbit; return [azimuth, elevation, distance].map(v => +v.toFixed(4));")

    def at_frame(self, frame):
        self.assertEqual(self.frame(), frame)
        self.assertEqual(float(self.browser.find("#time").get_property("value")), frame)
        self.assertFalse(self.playing())

    def test_the_slider(self):
        def visit(width, height, touch):
            _, top, _, high = self.browser.box("#view")
            self.assertLessEqual(top + high, self.browser.box("#bar")[1], "the bar covers the picture")
            self.assertTrue(self.playing(), "a page begins to play")
            for share, frame in ((0.25, 3), (0.75, 7), (0.5, 5), (1, FRAMES), (0, 1)):
                self.slide("#time", touch, share)
                self.at_frame(frame)
            self.slide("#time", touch, 0, 0.1, 0.3, 0.6, 0.75)
            self.at_frame(7)
            by_slider = self.still()
            self.slide("#time", touch, 0.75, 0.5, 0.25)
            self.at_frame(3)
            self.assertNotEqual(self.still(), by_slider)
            # Keys, with the focus on the slider and without; the picture is that of the frame, however it was come by.
            self.browser.run("document.getElementById('time').focus()")
            for keys, frame in (((Keys.HOME,), 1), ((Keys.ARROW_RIGHT,) * 3, 4), ((Keys.ARROW_LEFT,), 3), ((Keys.END,), FRAMES), ((Keys.ARROW_LEFT,) * 2, 7)):
                self.browser.press(*keys)
                self.at_frame(frame)
            self.browser.run("document.activeElement.blur()")
            self.browser.press(Keys.ARROW_LEFT, Keys.ARROW_RIGHT)
            self.at_frame(7)
            self.assertEqual(self.still(), by_slider)
            # While it plays, too.
            self.tap("#play", touch)
            self.assertTrue(self.playing())
            self.slide("#time", touch, 0.25)
            self.at_frame(3)
            # Where the slider stands already, which changes no value.
            self.slide("#time", touch, 0.5)
            self.browser.run("polymorph.morph.data.fps = 0; polymorph.play(true)")
            self.slide("#time", touch, 0.5)
            self.at_frame(5)
        self.visits(visit)

    def test_what_is_switched_on_and_off_leaves_the_picture_as_it_was(self):
        def visit(width, height, touch):
            self.slide("#time", touch, 0.5)
            plain = self.still()
            seen = {plain}
            for name, key in (("plan", "l"), ("balls", "b"), ("colors", "c")):
                self.tap(f"#{name}", touch)
                switched = self.still()
                self.keep(f"play-{name}-{width}")
                self.assertNotIn(switched, seen, f"{name} shows something")
                seen.add(switched)
                self.tap(f"#{name}", touch)
                self.assertEqual(self.still(), plain, f"{name} on and off again")
                self.browser.press(key)
                self.assertEqual(self.still(), switched, f"{name} by its key")
                self.browser.press(key)
                self.assertEqual(self.still(), plain, f"{name} by its key, on and off again")
            # All of them, and while it plays.
            for name in ("plan", "balls", "colors", "play", "play", "plan", "balls", "colors"):
                self.tap(f"#{name}", touch)
            self.slide("#time", touch, 0.5)
            self.assertEqual(self.still(), plain)
            self.assertEqual([self.browser.find(f"#{n}").get_attribute("aria-pressed") for n in ("plan", "balls", "colors")], ["false", "false", "true"])
        self.visits(visit)

    def test_play_and_pause(self):
        def visit(width, height, touch):
            self.tap("#play", touch)
            self.assertFalse(self.playing())
            self.slide("#time", touch, 0)
            self.tap("#play", touch)
            self.browser.wait("return parseFloat(document.getElementById('frame').textContent) > 1")
            self.browser.run("document.activeElement.blur()")
            self.browser.press(" ")
            self.assertFalse(self.playing())
            self.browser.press(Keys.END, " ")
            self.assertTrue(self.playing())
            self.browser.wait("return parseFloat(document.getElementById('frame').textContent) < 9")  # from the end it begins anew
        self.visits(visit)

    def test_turning_and_coming_nearer(self):
        def visit(width, height, touch):
            self.slide("#time", touch, 0.5)
            home, x, y = self.orbit(), width / 2, height / 3
            plain = self.still()
            if touch:
                self.browser.touch([(x, y)], [(x + 30, y + 10)], [(x + 60, y + 20)])
            else:
                self.browser.drag((x, y), (x + 30, y + 10), (x + 60, y + 20))
            turned = self.orbit()
            self.assertTrue(turned[0] < home[0] and turned[1] > home[1] and turned[2] == home[2], (home, turned))
            self.assertNotEqual(self.still(), plain)
            self.browser.press("r")
            self.assertEqual(self.orbit(), home)
            if touch:
                self.browser.touch([(x - 20, y), (x + 20, y)], [(x - 40, y), (x + 40, y)])
            else:
                self.browser.mouse("mouseWheel", x, y, deltaX=0, deltaY=-100)
            self.browser.wait("return polymorph.orbit.distance.toFixed(4) < arguments[0]", home[2])
            self.assertEqual(self.orbit()[:2], home[:2])
            self.browser.press("r", "-")
            self.assertGreater(self.orbit()[2], home[2])
            self.browser.press("r", "+")
            self.assertLess(self.orbit()[2], home[2])
            if not touch:
                self.browser.click(x, y, count=2)
            else:
                self.browser.press("r")
            self.assertEqual(self.orbit(), home)
            self.browser.run("document.activeElement.blur()")  # keys give what has the focus a frame
            self.browser.chord(Keys.SHIFT, Keys.ARROW_RIGHT)
            self.browser.chord(Keys.SHIFT, Keys.ARROW_UP)
            self.assertTrue(self.orbit()[0] < home[0] and self.orbit()[1] < home[1])
            self.browser.chord(Keys.SHIFT, Keys.ARROW_LEFT)
            self.browser.chord(Keys.SHIFT, Keys.ARROW_DOWN)
            self.assertEqual(self.orbit(), home)
            self.assertEqual(self.still(), plain)
        self.visits(visit)

    def test_help(self):
        def visit(width, height, touch):
            self.slide("#time", touch, 0.5)
            is_open = "return document.getElementById('keys').open"
            self.tap("#help", touch)
            self.assertTrue(self.browser.run(is_open))
            self.keep(f"play-help-{width}")
            x, y, wide, high = self.browser.box("#keys")
            self.assertTrue(x >= 0 and y >= 0 and x + wide <= width and y + high <= height, "it fits")
            self.browser.press(Keys.ARROW_RIGHT)
            self.assertEqual(self.frame(), 5, "keys of the page rest while help is open")
            self.tap("#keys button", touch)
            self.assertFalse(self.browser.run(is_open))
            self.browser.press("?")
            self.assertTrue(self.browser.run(is_open))
            self.browser.press(Keys.ESCAPE)
            self.assertFalse(self.browser.run(is_open))
        self.visits(visit, WINDOWS)


class BlendPage(Pages):
    """The handle of a page that mixes three objects."""

    windows = DRAWN_WINDOWS

    @classmethod
    def make(cls):
        weights = [{"easing": "linear", "keys": [{"frame": 1, "value": a}, {"frame": FRAMES, "value": b}]} for a, b in ((1, 0), (0, 1), (0, 1))]
        shapes = [("cube", [0.7, 0.2, 0.1]), ("sphere", [0.2, 0.6, 0.2]), ("torus", [0.1, 0.4, 0.7])]
        blend = [{"shape": shape, "color": color, "weight": weight} for (shape, color), weight in zip(shapes, weights)]
        scene = {"blend": blend, **{key: SCENE[key] for key in ("spheres", "frames", "surface", "image")}}
        (cls.folder / "blend.json").write_text(json.dumps(scene))
        (cls.folder / "still.json").write_text(json.dumps({**scene, "blend": [{**one, "weight": 1} for one in blend], "frames": {"count": 1}}))
        for name in ("blend", "still"):
            polymorph("mesh", f"{name}.json", "--html", f"{name}.html", "-q")

    def still(self):
        self.browser.wait("return polymorph.resting()")
        return self.browser.picture("#view")

    def weights(self):
        """Those that the handle shows, which are those that are mixed unless the film shows."""
        shown = self.browser.run("return polymorph.handle.weights")
        words = self.browser.find("#weights").get_attribute("aria-valuetext")
        self.assertEqual(words, ", ".join(f"{name} {round(100 * w)} %" for name, w in zip(("cube", "sphere", "torus"), shown)))
        if (mixed := self.browser.run("return polymorph.weights()")) is not None:
            self.assertEqual(mixed, shown)
        return shown

    def place(self, *weights):
        """Where in the window the point of some weights is; they may lie beside the triangle."""
        return self.browser.run("""
            const svg = document.getElementById('weights'), [x, y] = polymorph.handle.pointOf(arguments[0]);
            const p = new DOMPoint(x, y).matrixTransform(svg.getScreenCTM()); return [p.x, p.y];""", weights)

    def drag(self, touch, *places):
        self.press(touch, *(self.place(*weights) for weights in places))

    def expect_weights(self, *weights):
        """To what a pixel is: two hundredths."""
        shown = self.weights()
        self.assertAlmostEqual(sum(shown), 1, places=9)
        for w, expected in zip(shown, weights):
            self.assertLessEqual(abs(w - expected), 0.0201, (shown, weights))

    def test_the_handle(self):
        def visit(width, height, touch):
            x, y, wide, high = self.browser.box("#weights")
            self.assertTrue(x >= 0 and y >= 0 and x + wide <= width and y + high <= self.browser.box("#bar")[1], "the triangle is in the window")
            orbit = self.browser.run("return polymorph.orbit.azimuth")
            self.drag(touch, (0.5, 0.25, 0.25))
            self.expect_weights(0.5, 0.25, 0.25)
            self.assertEqual(self.browser.find("#play").text, "Play", "a touch of the handle stops the film")
            seen = {self.still()}
            self.drag(touch, (0.5, 0.25, 0.25), (0.4, 0.4, 0.2), (0.2, 0.2, 0.6))
            self.expect_weights(0.2, 0.2, 0.6)
            seen.add(self.still())
            self.keep(f"blend-mixed-{width}")
            # Beside the triangle: the nearest point of its border, and a corner.
            self.drag(touch, (0.3, 0.3, 0.4), (-0.08, 0.54, 0.54))
            self.expect_weights(0, 0.5, 0.5)
            seen.add(self.still())
            self.drag(touch, (0.8, 0.1, 0.1), (1.04, -0.02, -0.02))
            self.expect_weights(1, 0, 0)
            cube = self.still()
            seen.add(cube)
            self.assertEqual(len(seen), 4, "each mixture looks different")
            self.assertEqual(self.browser.run("return polymorph.orbit.azimuth"), orbit, "the view does not turn")
            # The mixture is the one of the weights, however it was come by: a corner of the triangle is the film's first frame.
            self.slide("#time", touch, 0)
            self.assertIsNone(self.browser.run("return polymorph.weights()"))
            self.assertEqual(self.weights(), [1, 0, 0])
            self.assertEqual(self.still(), cube)
            self.slide("#time", touch, 0.5)
            self.assertEqual([round(w, 3) for w in self.weights()], [0.333, 0.333, 0.333], "half way all weights of the film are alike")
        self.in_windows("blend.html", "return window.polymorph && polymorph.surfaces.done", False, visit, WINDOWS)

    def test_its_keys(self):
        def visit(width, height, touch):
            for key, weights in (("1", [1, 0, 0]), ("3", [0, 0, 1]), ("2", [0, 1, 0]), ("0", [0.34, 0.33, 0.33])):
                self.browser.press(key)
                self.assertEqual(sorted(self.weights()), sorted(weights))
                if key != "0":
                    self.assertEqual(self.weights(), weights)
            self.browser.run("document.getElementById('weights').focus()")
            self.browser.press(Keys.ARROW_UP, Keys.ARROW_UP)
            self.assertGreater(self.weights()[0], 0.38)
            before = self.weights()
            self.browser.press(Keys.ARROW_RIGHT)
            after = self.weights()
            self.assertTrue(after[2] > before[2] and after[1] < before[1] and after[0] == before[0], (before, after))
            self.browser.press(Keys.ARROW_LEFT, Keys.ARROW_DOWN, Keys.ARROW_DOWN)
            self.expect_weights(0.34, 0.33, 0.33)
            for _ in range(60):
                self.browser.press(Keys.ARROW_DOWN)
            self.assertEqual(self.weights()[0], 0, "it stops at the border")
            orbit = self.browser.run("return polymorph.orbit.azimuth")
            self.browser.chord(Keys.SHIFT, Keys.ARROW_LEFT)
            self.assertNotEqual(self.browser.run("return polymorph.orbit.azimuth"), orbit, "with the shift key it turns")
            self.browser.run("document.activeElement.blur()")
            self.browser.press(Keys.HOME, Keys.ARROW_RIGHT, Keys.ARROW_RIGHT)
            self.assertEqual(self.browser.find("#frame").text, f"3 / {FRAMES}", "without the focus they go over the film")
        self.in_windows("blend.html", "return window.polymorph && polymorph.surfaces.done", False, visit)

    def test_balls_and_plan(self):
        """Balls are the cube's, which is the first by name. They move to the other objects with the weights, and the plan says where to."""
        balls_and_ways = """
            const {morph} = polymorph, weights = arguments[0], balls = [], ways = [], shown = {weights, look: 0};
            ballsOf(morph, 0, shown, 0, balls); planOf(morph, 0, shown, ways);
            const corner = Math.max(0, weights.indexOf(1)), {space, objects} = morph.data.actors[0];
            const inside = balls.filter((_, i) => i % 15 === 0 && objects[corner].distances.distance(...balls.slice(i, i + 3)) > 0).length;
            return [balls, ways, space.objects[corner].volume, inside];"""

        def visit(width, height, touch):
            ends = []
            for corner in range(3):
                balls, ways, volume, inside = self.browser.run(balls_and_ways, [float(k == corner) for k in range(3)])
                ends.append([balls[i:i + 3] for i in range(0, len(balls), 15)])
                self.assertAlmostEqual(sum(4 / 3 * math.pi * r**3 for r in balls[3::15]), volume, delta=1e-4 * volume)
                self.assertGreater(inside, 0.5 * len(ends[-1]), "most centres lie in the object; some lie in the torus's hole")
            self.assertNotEqual(ends[0], ends[2])
            balls, ways, *_ = self.browser.run(balls_and_ways, [0.5, 0.3, 0.2])
            steps, count = 8, len(balls) // 15
            self.assertEqual(len(ways), 3 * steps * count * 6)
            for corner in range(3):
                for ball in range(count):
                    first, last = (6 * (count * (steps * corner + step) + ball) for step in (0, steps - 1))
                    for axis in range(3):
                        self.assertAlmostEqual(ways[first + axis], balls[15 * ball + axis], places=5)
                        self.assertAlmostEqual(ways[last + 3 + axis], ends[corner][ball][axis], places=5)
            self.drag(touch, (0.4, 0.3, 0.3))
            seen = {self.still()}
            for name in ("#balls", "#plan"):
                self.browser.find(name).click()
                seen.add(self.still())
            self.keep(f"blend-balls-{width}")
            self.drag(touch, (0.1, 0.2, 0.7))
            seen.add(self.still())
            for key in "bl":
                self.browser.press(key)
            seen.add(self.still())
            self.assertEqual(len(seen), 5, "with balls, with the plan, and those of another mixture")
        self.in_windows("blend.html", "return window.polymorph && polymorph.surfaces.done", False, visit)

    def test_a_blend_that_stands_still_has_the_handle_alone(self):
        def visit(width, height, touch):
            for name in ("play", "time", "frame"):
                self.assertFalse(self.browser.find(f"#{name}").is_displayed(), name)
            for name in ("balls", "plan", "colors"):
                self.assertTrue(self.browser.find(f"#{name}").is_displayed(), name)
            middle = self.still()
            self.browser.press(" ", Keys.END)
            self.assertEqual(self.still(), middle)
            self.drag(touch, (0.1, 0.8, 0.1))
            self.expect_weights(0.1, 0.8, 0.1)
            self.assertNotEqual(self.still(), middle)
        self.in_windows("still.html", "return window.polymorph && polymorph.surfaces.done", False, visit)


class LandmarksPage(Pages):
    @classmethod
    def make(cls):
        polymorph("landmarks", "scene.json", "--html", "landmarks.html", "-q")

    def point(self, side):
        """A place of the window where the object of a side is in front, and the point of the object's file there."""
        self.browser.wait("return polymorph.resting()")
        return self.browser.run("""
            const view = polymorph.views[arguments[0]], p = view.object.solid.positions, {eye} = view.orbit.axes(), box = view.canvas.getBoundingClientRect();
            const all = [...Array(p.length / 3).keys()].map(i => [p[3 * i], p[3 * i + 1], p[3 * i + 2]]);
            const away = q => Math.hypot(...q.map((v, i) => v - eye[i])), nearest = all.reduce((a, b) => away(a) < away(b) ? a : b);
            const [x, y] = view.pixelOf(nearest).map((v, i) => Math.round(v + (i ? box.top : box.left)));
            const hit = view.pointAt(x, y), m = view.object.to_file;
            return [x, y, [0, 4, 8].map(i => m[i] * hit[0] + m[i + 1] * hit[1] + m[i + 2] * hit[2] + m[i + 3])];""", side)

    def pin(self, side, touch):
        x, y, point = self.point(side)
        self.browser.touch([(x, y)]) if touch else self.browser.click(x, y)
        return point

    def count(self, side):
        return len(self.browser.all(f"#pins{side} .pin"))

    def test_clicks_make_landmarks(self):
        def visit(width, height, touch):
            expected = {"cube": [], "torus": []}
            for n in (1, 2):
                expected["cube"].append(self.pin(0, touch))
                self.browser.wait("return document.querySelectorAll('#pins0 .pin').length === arguments[0]", n)
                self.assertIn(f"click the place of {n} on the other object", self.browser.find("#note").text)
                self.assertEqual(self.count(1), n - 1, "a pin of one object is no landmark")
                expected["torus"].append(self.pin(1, touch))
                self.browser.wait("return document.querySelectorAll('#pins1 .pin').length === arguments[0]", n)
                for side in (0, 1):  # the next pin elsewhere
                    self.browser.run("polymorph.views[arguments[0]].orbit.turn(.9, .3); polymorph.views[arguments[0]].moved()", side)
            landmarks = self.browser.run("return polymorph.landmarks()")
            for key, points in expected.items():
                self.assertEqual(sorted(landmarks[key]), ["p1", "p2"])
                for n, point in enumerate(points):
                    for found, wanted in zip(landmarks[key][f"p{n + 1}"], point):
                        self.assertAlmostEqual(found, wanted, delta=1e-4)
            # A drag turns and sets nothing.
            x, y, _ = self.point(0)
            before = self.browser.run("return polymorph.views[0].orbit.azimuth")
            self.browser.touch([(x, y)], [(x + 30, y)], [(x + 60, y)]) if touch else self.browser.drag((x, y), (x + 30, y), (x + 60, y))
            self.assertNotEqual(self.browser.run("return polymorph.views[0].orbit.azimuth"), before)
            self.browser.wait("return polymorph.resting()")
            self.assertEqual(self.count(0), 2)
            # A name, and a pin that is taken away.
            name = self.browser.find("#list input")
            name.clear()
            name.send_keys("nose")
            self.assertEqual(sorted(self.browser.run("return polymorph.landmarks()")["cube"]), ["nose", "p2"])
            self.browser.all("#list button")[1].click()
            self.browser.wait("return document.querySelectorAll('#pins0 .pin').length === 1")
            self.tap("#copy", touch)
            self.browser.wait("return document.getElementById('note').textContent.startsWith('copied')")
            text = self.browser.run("return document.getElementById('json').value")
            # What it says is what a scene takes.
            scene = {**SCENE, "plan": json.loads("{" + text + "}")}
            self.assertEqual(sorted(scene["plan"]["landmarks"]["torus"]), ["nose"])
            (self.folder / "with.json").write_text(json.dumps(scene))
            polymorph("check", "with.json")
            self.tap("#clear", touch)
            self.browser.wait("return !document.querySelector('.pin')")
            self.assertEqual(self.browser.run("return polymorph.landmarks()"), {})
        self.in_windows("landmarks.html", "return window.polymorph && polymorph.resting()", True, visit)

    def test_the_scenes_landmarks_are_pins_and_both_objects_have_colours(self):
        scene = {**SCENE, "plan": {"landmarks": {"cube": {"a": [1, 0, 0], "b": [0, 0, 1]}, "torus": {"a": "v1", "b": "v90"}}}}
        (self.folder / "given.json").write_text(json.dumps(scene))
        polymorph("landmarks", "given.json", "--html", "given.html", "-q")
        self.browser.open(self.folder / "given.html", 1280, 800)
        self.browser.wait("return window.polymorph && polymorph.resting()")
        self.assertEqual((self.count(0), self.count(1)), (2, 2))
        self.assertEqual(self.browser.run("return polymorph.landmarks().cube"), {"a": [1, 0, 0], "b": [0, 0, 1]})
        colors = self.browser.run("""
            return polymorph.views.map(view => {
              const gl = view.picture.gl, {width, height} = view.canvas, bytes = new Uint8Array(4 * width * height);
              view.draw([], {back: [0, 0, 0], dark: 0, plan: [0, 0, 0, 1]});
              gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
              const seen = new Set();
              for (let i = 0; i < bytes.length; i += 4) if (bytes[i] + bytes[i + 1] + bytes[i + 2]) seen.add(bytes.slice(i, i + 3).map(v => v >> 5).join());
              return seen.size;
            });""")
        self.keep("given")
        for count in colors:
            self.assertGreater(count, 20)
        self.assertEqual(self.browser.console(), [])


class ReportPages(Pages):
    """The page of compare and golden: three frames, of which one is other."""

    @classmethod
    def make(cls):
        polymorph("render", "scene.json", "-o", "new/f.####.exr", "-f", "1-3", "-q")
        polymorph("render", "scene.json", "-o", "ref/f.####.exr", "-f", "1-3", "-q")
        other = ["--set", "lights.key_azimuth=80"]
        polymorph("render", "scene.json", "-o", "ref/f.####.exr", "-f", "2", "-q", "--overwrite", *other)
        polymorph("compare", "new/f.####.exr", "ref/f.####.exr", "--html", "compare.html", code=1)
        suite = cls.folder / "goldens/suite"
        suite.mkdir(parents=True)
        (suite / "suite.json").write_text(json.dumps({"command": "cp ../../new/{name} {out}".replace("{name}", "f.0002.exr"), "frames": [1, 2, 3]}))
        for frame in (1, 2, 3):
            shutil.copy(cls.folder / f"ref/f.{frame:04}.exr", suite / f"frame.{frame:04}.exr")
        polymorph("golden", "test", "--root", "goldens", "--report", "golden", code=1)

    def mode(self):
        return self.browser.run("return document.querySelector('[data-mode][aria-pressed=true]').dataset.mode")

    def name(self):
        return self.browser.find("#view h2").text

    def bar(self):
        return float(self.browser.run("return parseFloat(document.querySelector('.bar').style.left)"))

    READY = "return document.querySelector('#view h2') && [...document.images].every(i => i.complete && i.naturalWidth)"

    def visit_all(self, page):
        def visit(width, height, touch):
            b = self.browser
            listed = b.run("return [...document.querySelectorAll('#list .name')].map(e => e.title)")
            failing = self.name()
            self.assertEqual(len(listed), 3)
            # Frames, by the list and by keys.
            for n, name in enumerate(listed, 1):
                self.tap(f"#list li:nth-child({n}) button", touch)
                self.assertEqual(self.name(), name)
            b.press("k", "k", "k", "j")
            self.assertEqual(self.name(), listed[1])
            for n, text in enumerate([button.text for button in b.all("#filters button")], 1):
                kind, count = text.split()
                self.tap(f"#filters button:nth-child({n})", touch)
                self.assertEqual(len(b.all("#list li")), int(count), kind)
            self.tap("#filters button", touch)
            self.tap(f"#list li:nth-child({listed.index(failing) + 1}) button", touch)
            # Views, by their buttons and keys.
            for n, mode in enumerate(("swipe", "flip", "side", "heat", "limits"), 1):
                self.tap(f"[data-mode={mode}]", touch)
                self.assertEqual(self.mode(), mode)
                self.keep(f"{page.replace('/', '-')}-{mode}-{width}")
                b.press(str(n % 5 + 1), str(n))
                self.assertEqual(self.mode(), mode)
            # The swipe, by its slider, by keys and in the picture.
            b.press("1")
            for share in (0.2, 0.8):
                self.slide("#swipe", touch, share)
                self.assertAlmostEqual(self.bar(), 100 * share, delta=8)
            self.slide("#swipe", touch, 0.8, 0.5, 0.3)
            self.assertAlmostEqual(self.bar(), 30, delta=8)
            before = self.bar()
            b.run("document.activeElement.blur()")
            b.press("]")
            self.assertAlmostEqual(self.bar(), before + 5, delta=0.1)
            b.press("[", "[")
            self.assertAlmostEqual(self.bar(), before - 5, delta=0.1)
            b.run("document.querySelector('.frame').scrollIntoView({block: 'nearest'})")
            x, y, wide, high = b.box(".frame")
            points = [(x + share * wide, y + high / 2) for share in (0.3, 0.5, 0.7)]
            if touch:
                b.touch(*([p] for p in points))
            else:
                b.mouse("mouseMoved", *points[-1])
            self.assertAlmostEqual(self.bar(), 70, delta=2)
            if not touch:  # a finger hides what it points at
                self.assertRegex(b.find("#readout").text, r"x \d+ +y \d+.*new \d+ \d+ \d+")
                b.mouse("mouseMoved", 2, 2)
            # Flip and blink.
            top = "return getComputedStyle(document.getElementById('top')).visibility"
            b.press("f")
            self.assertEqual(self.mode(), "flip")
            flipped = b.run(top)
            b.press("f")
            self.assertNotEqual(b.run(top), flipped)
            b.press("b")
            now = b.run(top)
            b.wait("return getComputedStyle(document.getElementById('top')).visibility !== arguments[0]", now, seconds=10)
            b.press("b")
            # Sizes.
            self.tap("[data-mode=side]", touch)
            fit = b.box(".frame")[2]
            self.tap("[aria-label=larger]", touch)
            self.assertGreater(b.box(".frame")[2], fit)
            self.tap("#zoom", touch)
            self.assertEqual(b.box(".frame")[2], fit)
            self.tap("[aria-label=smaller]", touch)
            self.assertLess(b.box(".frame")[2], fit)
            b.press("+", "0")
            self.assertEqual(b.box(".frame")[2], fit)
            # The worst pixel, dark and light, the command to accept, the keys.
            self.tap("#worst", touch)
            self.assertEqual(len(b.all(".ring")), 2)
            b.press("w")
            self.assertEqual(len(b.all(".ring")), 0)
            back = "return getComputedStyle(document.body).backgroundColor"
            light = b.run(back)
            self.tap("#theme", touch)
            self.assertNotEqual(b.run(back), light)
            self.keep(f"{page.replace('/', '-')}-dark-{width}")
            b.press("d")
            self.assertEqual(b.run(back), light)
            self.assertTrue(b.find("#accept").text)
            self.tap("#copy", touch)
            b.wait("return document.getElementById('copy').textContent === 'copied'", seconds=5)
            b.press("c")
            self.tap("#help", touch)
            self.assertTrue(b.run("return document.getElementById('keys').open"))
            self.tap("#keys button", touch)
            b.press("?", Keys.ESCAPE)
            self.assertFalse(b.run("return document.getElementById('keys').open"))
        self.in_windows(page, self.READY, True, visit)

    def test_the_page_of_compare(self):
        self.visit_all("compare.html")

    def test_the_page_of_golden(self):
        self.visit_all("golden/index.html")


class AnalyzePage(Pages):
    @classmethod
    def make(cls):
        polymorph("analyze", "scene.json", "--html", "analyze.html", "-q")

    def test_the_page_of_analyze(self):
        def visit(width, height, touch):
            self.assertGreater(len(self.browser.all("svg")), 10)
            self.assertNotIn("nan", self.browser.find("body").text.lower().replace("nanometre", ""))
            outside = self.browser.run("return [...document.querySelectorAll('svg')].filter(s => s.getBoundingClientRect().right > innerWidth + 1).length")
            self.assertEqual(outside, 0)
        self.in_windows("analyze.html", "return document.readyState === 'complete'", True, visit)


if __name__ == "__main__":
    if not CHROMIUM or not CHROMEDRIVER or subprocess.run([CHROMIUM, "--version"], capture_output=True).returncode:
        print("*** PAGES TESTS SKIPPED: no Chromium or no driver (Debian's packages chromium and chromium-driver, or POLYMORPH_CHROMIUM)", file=sys.stderr)
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])
