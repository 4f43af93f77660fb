#!/usr/bin/env python3
"""The CI templates of scripts/ci: their steps as the CI would run them, with the variable that names polymorph and without it.

ci_test.py PROGRAM      Exit code 77: PyYAML is missing.
"""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

try:
    import yaml
except ImportError:
    # Another python3 may stand before Debian's on the PATH; mkdocs brings python3-yaml for Debian's.
    if os.path.exists("/usr/bin/python3") and not os.environ.get("POLYMORPH_CI_PYTHON"):
        os.environ["POLYMORPH_CI_PYTHON"] = "/usr/bin/python3"
        os.execv("/usr/bin/python3", ["/usr/bin/python3", "-B", *sys.argv])
    print("SKIPPED: no PyYAML", file=sys.stderr)
    sys.exit(77)

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = pathlib.Path(sys.argv.pop(1)).absolute()
SCENE = {"source": {"shape": "cube", "spheres": {"balls": 8}}, "target": {"shape": "sphere", "spheres": {"balls": 8}}, "frames": {"count": 4},
         "surface": {"resolution": 16}, "image": {"width": 32, "height": 24, "samples": 1}}


class Templates(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="polymorph-ci-")
        self.addCleanup(temporary.cleanup)
        self.outside = pathlib.Path(temporary.name)
        self.folder = self.outside / "repository"
        (self.folder / "golden_frames/suite").mkdir(parents=True)
        (self.folder / "scene.json").write_text(json.dumps(SCENE))
        (self.folder / "golden_frames/suite/suite.json").write_text(json.dumps({"scene": "../../scene.json", "frames": [1, 3]}))
        tools = self.outside / "bin"
        tools.mkdir()
        # Nothing is installed by the test: what setup would fetch is here, or it is said and fails.
        (tools / "apt-get").write_text("#!/bin/sh\nexit 0\n")
        (tools / "apt-get").chmod(0o755)
        inherited = {k: v for k, v in os.environ.items() if not k.startswith(("POLYMORPH", "CI", "GIT"))}
        self.environment = inherited | {"PATH": f"{tools}:{os.environ['PATH']}", "POLYMORPH_CACHE_DIR": str(self.outside / "cache"), "HOME": temporary.name}
        subprocess.run([PROGRAM, "golden", "update", "suite", "--reason", "first", "-q"], cwd=self.folder, env=self.environment, check=True, capture_output=True)

    def check_out_polymorph(self):
        """A checkout that was built: what a cache of the CI brings."""
        (self.folder / "polymorph/build/release").mkdir(parents=True)
        (self.folder / "polymorph/scripts").symlink_to(ROOT / "scripts")
        (self.folder / "polymorph/build/release/polymorph").symlink_to(PROGRAM)

    def sh(self, script, **variables):
        return subprocess.run(["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", script], cwd=self.folder, env=self.environment | variables, capture_output=True, text=True)

    def github(self, address):
        """Runs the job up to the first step that fails; the names of the steps that passed, and the output of the last one."""
        job = yaml.safe_load((ROOT / "scripts/ci/github.yml").read_text(encoding="utf-8"))["jobs"]["golden"]
        summary, passed = self.outside / "summary.md", []
        for step in job["steps"]:
            if "uses" in step:
                if step.get("with", {}).get("path") == "polymorph" and "repository" in step["with"]:
                    self.assertEqual(step["with"]["repository"], "${{ vars.POLYMORPH }}")
                    if address:
                        self.check_out_polymorph()
                    else:  # as actions/checkout takes an empty name
                        shutil.copytree(self.folder, self.outside / "own")
                        (self.outside / "own").rename(self.folder / "polymorph")
                continue
            if step.get("id") == "version":  # of a real checkout
                continue
            variables = {**job["env"], **{k: v.replace("${{ vars.POLYMORPH }}", address) for k, v in step.get("env", {}).items()}}
            done = self.sh(step["run"], GITHUB_STEP_SUMMARY=str(summary), **variables)
            if done.returncode:
                return passed, done
            passed.append(step["name"])
        return passed, done

    def gitlab(self, address):
        job = yaml.safe_load((ROOT / "scripts/ci/gitlab-ci.yml").read_text(encoding="utf-8"))["golden frames"]
        variables = {k: v.replace("$CI_PROJECT_DIR", str(self.folder)) for k, v in job["variables"].items()}
        if address:
            self.check_out_polymorph()
        lines = [line for line in job["before_script"] if "git clone" not in line and "scripts/build" not in line]
        self.assertEqual(len(lines), len(job["before_script"]) - 2)
        return self.sh("\n".join([*lines, *job["script"]]), **variables, POLYMORPH_URL=address)

    def expect_report(self):
        for file in ("index.html", "junit.xml", "report.json"):
            self.assertTrue((self.folder / "golden-report" / file).exists(), file)

    def test_github(self):
        passed, done = self.github("someone/polymorph")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertEqual(passed[-1], "Test the golden frames")
        self.expect_report()
        self.assertIn("all 2 passed", (self.outside / "summary.md").read_text())

    def test_github_shows_what_fails(self):
        (self.folder / "scene.json").write_text(json.dumps(SCENE | {"camera": {"azimuth": 70}}))
        passed, done = self.github("someone/polymorph")
        self.assertEqual(done.returncode, 1)
        self.assertEqual(passed[-1], "Build polymorph")
        self.expect_report()
        self.assertIn("2 of 2 failed", (self.outside / "summary.md").read_text())

    def test_github_without_the_variable(self):
        passed, done = self.github("")
        self.assertEqual((passed, done.returncode), ([], 1))
        self.assertIn("repository's variable POLYMORPH", done.stdout)

    def test_gitlab(self):
        done = self.gitlab("https://example.org/polymorph.git")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.expect_report()

    def test_gitlab_without_the_variable(self):
        done = self.gitlab("")
        self.assertEqual(done.returncode, 1)
        self.assertIn("CI variable POLYMORPH_URL", done.stderr)

    def test_an_empty_program_is_that_of_the_path(self):
        tools = self.outside / "bin"
        (tools / "polymorph").symlink_to(PROGRAM)
        done = self.sh(str(ROOT / "scripts/ci/golden"), POLYMORPH="")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.expect_report()


if __name__ == "__main__":
    unittest.main()
