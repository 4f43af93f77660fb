"""Disks that fill, limits, signals and two at once: what is there afterwards is whole, and what was
there before is kept. Usage: faults_test.py PROGRAM [TEST...]; the C compiler is $CC, or cc.
"""

import json
import os
import pathlib
import random
import resource
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

COMPILER = os.environ.get("CC", "cc")
PROGRAM = os.path.abspath(sys.argv.pop(1))
KILLS = int(os.environ.get("POLYMORPH_TEST_KILLS", "12"))

# Fails every write(), fsync() or rename() with the errno FAULT_ERRNO, cuts writes short, or fails to start more threads
# than FAULT_ERRNO.
SHIM = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
static int is(const char *what) { const char *f = getenv("FAULT"); return f && !strcmp(f, what); }
static int number(void) { return atoi(getenv("FAULT_ERRNO")); }
ssize_t write(int fd, const void *bytes, size_t size) {
  static ssize_t (*real)(int, const void *, size_t);
  if (!real) real = (ssize_t(*)(int, const void *, size_t))dlsym(RTLD_NEXT, "write");
  if (fd > 2 && is("write")) { errno = number(); return -1; }
  if (fd > 2 && is("short") && size > 1) size = size / 2;
  return real(fd, bytes, size);
}
int fsync(int fd) {
  static int (*real)(int);
  if (!real) real = (int (*)(int))dlsym(RTLD_NEXT, "fsync");
  if (is("fsync")) { errno = number(); return -1; }
  return real(fd);
}
int pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*start)(void *), void *argument) {
  static int started, (*real)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);
  if (!real) real = dlsym(RTLD_NEXT, "pthread_create");
  if (is("threads") && __atomic_fetch_add(&started, 1, __ATOMIC_SEQ_CST) >= number()) return EAGAIN;
  return real(thread, attributes, start, argument);
}
int rename(const char *from, const char *to) {
  static int (*real)(const char *, const char *);
  if (!real) real = (int (*)(const char *, const char *))dlsym(RTLD_NEXT, "rename");
  if (is("rename")) { errno = number(); return -1; }
  return real(from, to);
}
"""

SCENE = {
    "source": {"shape": "cube"}, "target": {"shape": "sphere"},
    "spheres": {"balls": 8, "fit": "none"}, "surface": {"resolution": 16}, "frames": {"per_leg": [6]},
    "image": {"width": 64, "height": 48, "samples": 1},
}


class Faults(unittest.TestCase):
    def setUp(self):
        self.root = pathlib.Path(tempfile.mkdtemp(prefix="polymorph-faults-"))
        self.addCleanup(shutil.rmtree, self.root, ignore_errors=True)
        self.folder = self.root / "work"
        self.folder.mkdir()
        (self.folder / "scene.json").write_text(json.dumps(SCENE))
        self.settings = dict(os.environ, POLYMORPH_CACHE_DIR=str(self.root / "cache"))

    def start(self, *words, settings=None, **more):
        return subprocess.Popen([PROGRAM, *words], cwd=self.folder, env=settings or self.settings,
                                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True, **more)

    def run_program(self, *words, **more):
        program = self.start(*words, **more)
        _, err = program.communicate(timeout=300)
        return program.returncode, err

    def render(self, pattern, *words, **more):
        return self.run_program("render", "scene.json", "-o", pattern, "--device", "cpu", *words, **more)

    def files(self, folder="."):
        return sorted(p.name for p in (self.folder / folder).iterdir())

    def shim(self):
        source, library = self.root / "shim.c", self.root / "shim.so"
        source.write_text(SHIM)
        if subprocess.run([*shlex.split(COMPILER), "-shared", "-fPIC", "-O1", str(source), "-o", str(library), "-ldl"],
                          capture_output=True).returncode != 0:
            self.skipTest("no C compiler")
        return str(library)

    def test_injected_errors(self):
        library = self.shim()
        for fault, number, code in [("write", 28, 4), ("write", 5, 4), ("fsync", 5, 4), ("rename", 18, 4),
                                    ("rename", 30, 4), ("short", 0, 0)]:
            with self.subTest(fault=fault, errno=number):
                settings = dict(self.settings, LD_PRELOAD=library, FAULT=fault, FAULT_ERRNO=str(number))
                shutil.rmtree(self.folder / "out", ignore_errors=True)
                (self.folder / "out").mkdir()
                got, err = self.render("out/f.####.png", "--no-cache", "-f", "1-2", settings=settings)
                self.assertEqual(got, code, err)
                if code == 0:
                    self.assertEqual(self.files("out"), ["f.0001.png", "f.0002.png"])
                else:
                    finals = [name for name in self.files("out") if name.endswith(".png")]
                    self.assertEqual(finals, [])
                    self.assertIn("f.0001.png", err)

    def test_full_disk(self):
        # An own mount namespace, where that is allowed.
        script = ('mount -t tmpfs -o size=256k none "$1" && cd "$2" && '
                  '"$3" render scene.json -o "$1/f.####.exr" --no-cache --device cpu --set image.width=320 '
                  '--set image.height=240; code=$?; ls "$1"; exit $code')
        (self.folder / "small").mkdir()
        ran = subprocess.run(["unshare", "-rm", "bash", "-c", script, "-", str(self.folder / "small"),
                              str(self.folder), PROGRAM], capture_output=True, text=True, timeout=300)
        if "unshare" in ran.stderr or "mount" in ran.stderr:
            self.skipTest("no mount namespaces here")
        self.assertEqual(ran.returncode, 4, ran.stderr)
        self.assertRegex(ran.stderr, "No space left|needs? ")
        for name in ran.stdout.split():
            self.assertTrue(name.endswith(".exr"), name)

    def test_no_more_threads(self):
        library = self.shim()
        codes = []
        for threads in range(0, 20):
            settings = dict(self.settings, LD_PRELOAD=library, FAULT="threads", FAULT_ERRNO=str(threads))
            got, err = self.render("t.####.exr", "-f", "2-3", "-t", "4", "--overwrite", settings=settings)
            codes.append(got)
            if got == 5:
                # A thread may also be wanted first while a frame is rendered or written.
                self.assertRegex(err, r"error: (t\.\d+\.exr: )?no thread can be started \(")
            self.assertIn(got, (0, 5), f"{threads} threads: {err}")
        self.assertEqual((codes[0], codes[-1]), (5, 0))

    def test_file_size_limit(self):
        limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
        got, err = self.render("f.####.exr", "--no-cache", "-f", "1", preexec_fn=limit)
        self.assertEqual(got, 4, err)
        self.assertEqual(self.files(), ["scene.json"])

    def test_memory_limit(self):
        for gib in (1, 2, 3):
            limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (gib << 30, gib << 30))
            got, err = self.render("big.####.exr", "-f", "3", "--overwrite", "--set", "image.width=16384",
                                   "--set", "image.height=16384", preexec_fn=limit)
            self.assertEqual(got, 5, err)
            self.assertIn("error:", err)
        self.assertEqual([name for name in self.files() if name.startswith("big")], [])

    def test_folder_is_read_only_or_missing(self):
        (self.folder / "kept").mkdir()
        (self.folder / "file").write_text("")
        got, err = self.render("file/f.####.png")
        self.assertEqual(got, 4, err)
        if os.geteuid() == 0:
            return  # root may write everywhere
        (self.folder / "kept").chmod(0o500)
        got, err = self.render("kept/f.####.png")
        self.assertEqual(got, 4, err)

    def test_kill_then_resume(self):
        got, err = self.render("whole/f.####.exr")
        self.assertEqual(got, 0, err)
        whole = self.files("whole")
        dice = random.Random(7)
        (self.folder / "cut").mkdir()
        for _ in range(KILLS):
            shutil.rmtree(self.root / "cache", ignore_errors=True)
            program = self.start("render", "scene.json", "-o", "cut/f.####.exr", "--device", "cpu",
                                 "--skip-existing")
            time.sleep(dice.uniform(0, 0.6))
            program.send_signal(signal.SIGKILL)
            program.communicate()
            for name in self.files("cut"):
                if name in whole:
                    self.assertEqual(self.run_program("info", "cut/" + name)[0], 0, name)
            if dice.random() < 0.3:
                shutil.rmtree(self.folder / "cut")
                (self.folder / "cut").mkdir()
        got, err = self.render("cut/f.####.exr", "--skip-existing")
        self.assertEqual(got, 0, err)
        for name in whole:
            got, err = self.run_program("compare", "whole/" + name, "cut/" + name)
            self.assertEqual(got, 0, err)

    def test_signals(self):
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            with self.subTest(number):
                # Under nohup the program would be right to ignore a hang-up.
                program = self.start("render", "scene.json", "-o", f"s{int(number)}.####.exr", "--device", "cpu",
                                     "--set", "image.samples=4000",
                                     preexec_fn=lambda: signal.signal(number, signal.SIG_DFL))
                time.sleep(1.5)
                program.send_signal(number)
                _, err = program.communicate(timeout=120)
                self.assertIn(program.returncode, (128 + number, -number), err)
                for name in self.files():
                    if name.startswith(f"s{int(number)}.") and name.endswith(".exr"):
                        self.assertEqual(self.run_program("info", name)[0], 0, name)

    def test_signals_end_at_once(self):
        """Two seconds of processor time after a signal everything is over, whatever was under way."""
        slow = dict(SCENE, image={"width": 640, "height": 480, "samples": 20000}, frames={"per_leg": [2]})
        fits = {"source": "torus", "target": "cube", "spheres": {"balls": 2048}}
        (self.folder / "slow.json").write_text(json.dumps(slow))
        (self.folder / "fits.json").write_text(json.dumps(fits))

        def used(pid):
            words = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
            return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")

        for number, words in [(signal.SIGTERM, ["render", "slow.json", "-o", "slow.####.exr"]),
                              (signal.SIGINT, ["render", "fits.json", "-o", "fits.####.exr"]),
                              (signal.SIGINT, ["mesh", "fits.json", "-o", "fits.####.obj"])]:
            with self.subTest(words=words):
                program = self.start(*words, "--device", "cpu", "--no-cache",
                                     preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
                while used(program.pid) < 2:
                    time.sleep(0.02)
                before = used(program.pid)
                program.send_signal(number)
                err = program.stderr.read()
                program.stdout.close()
                program.stderr.close()
                _, status, usage = os.wait4(program.pid, 0)
                program.returncode = os.waitstatus_to_exitcode(status)
                self.assertIn(program.returncode, (128 + number, -number), err)
                self.assertLess(usage.ru_utime + usage.ru_stime - before, 2, err)
                self.assertEqual([n for n in self.files() if n.endswith((".exr", ".obj", ".part"))], [])

    def test_many_at_once(self):
        """Ten processes, one cache and one output."""
        runs = [self.start("render", "scene.json", "-o", "same.####.png", "--overwrite", "--device", "cpu")
                for _ in range(10)]
        for program in runs:
            _, err = program.communicate(timeout=300)
            self.assertEqual(program.returncode, 0, err)
        self.assertEqual(self.run_program("cache", "verify")[0], 0)
        self.assertEqual(self.files(), sorted(["scene.json"] + [f"same.{i:04}.png" for i in range(1, 7)]))
        got, err = self.render("alone.####.png", "--no-cache")
        self.assertEqual(got, 0, err)
        for i in range(1, 7):
            one, other = self.folder / f"alone.{i:04}.png", self.folder / f"same.{i:04}.png"
            self.assertEqual(self.run_program("compare", str(one), str(other))[0], 0)
        self.assertEqual([p for p in (self.root / "cache").iterdir() if p.suffix == ".part"], [])

    def test_keep_going(self):
        (self.folder / "f.0002.png").mkdir()
        got, err = self.render("f.####.png", "--keep-going", "--overwrite")
        self.assertEqual(got, 6, err)
        self.assertIn("f.0002.png", err)
        self.assertEqual(self.files(), sorted(["scene.json"] + [f"f.{i:04}.png" for i in range(1, 7)]))


if __name__ == "__main__":
    unittest.main()
