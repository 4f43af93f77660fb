#!/usr/bin/env python3
"""Plays the runners of GitHub and GitLab: the YAML of docs/ci.md with action.yml and templates/golden.yml, step by step, on a clone of a
repository here, with a server here as the API. Pushes, requests of the same repository and of forks, and acceptance by word and button.

ci_test.py PROGRAM      Exit code 77: PyYAML is missing.
"""

import http.server
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import unittest
import urllib.parse

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
SCENE = {"source": "cube", "target": "sphere", "spheres": {"balls": 8, "fit": "none"}, "frames": {"count": 4},
         "surface": {"resolution": 16}, "image": {"width": 32, "height": 24, "samples": 1}}
CHANGED = SCENE | {"camera": {"azimuth": 70}}
MARKER = "<!-- polymorph golden frames -->"
SNIPPETS = [yaml.safe_load(text) for text in re.findall(r"^```yaml\n(.*?)^```", (ROOT / "docs/ci.md").read_text(encoding="utf-8"), re.M | re.S)]


class Api(http.server.BaseHTTPRequestHandler):
    """As much of both forges' APIs as is called; `server.writable` false: as with a token that may only read."""

    def answer(self, code, data):
        body = json.dumps(data).encode()
        self.send_response(code)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def handle_call(self):
        server, path = self.server, urllib.parse.urlsplit(self.path)
        query = urllib.parse.parse_qs(path.query)
        data = json.loads(self.rfile.read(int(self.headers.get("Content-Length") or 0)) or b"null")
        server.calls.append((self.command, self.path, data))
        if "secret" not in self.headers.get("Authorization", "") + self.headers.get("PRIVATE-TOKEN", ""):
            return self.answer(401, {})
        if path.path == "/user":
            return self.answer(200, {"id": 5}) if server.user else self.answer(403, {})
        if path.path.endswith(("/pulls", "/merge_requests")):
            return self.answer(200, server.requests)
        if self.command != "GET" and not server.writable:
            return self.answer(403, {"message": "Resource not accessible by integration"})
        if "/statuses/" in path.path:
            server.states[path.path.rsplit("/", 1)[1]] = data
            return self.answer(201, {})
        if self.command == "GET":
            first = 100 * (int(query["page"][0]) - 1)
            return self.answer(200, server.comments[first:first + 100])
        author = {"author": {"id": 5}} if server.user else {"user": {"id": 1, "type": "Bot"}}
        if self.command == "POST":
            server.comments.append({"id": len(server.comments) + 1, "body": data["body"], **author})
            return self.answer(201, {})
        server.comments[int(path.path.rsplit("/", 1)[1]) - 1]["body"] = data["body"]
        return self.answer(200, {})

    do_GET = do_POST = do_PATCH = do_PUT = handle_call

    def log_message(self, *arguments):
        pass


def value(expression, context):
    """Evaluates ${{ a.b || c.d }}: the first that is there and not empty."""
    for path in expression.split("||"):
        found = context
        for name in path.strip().split("."):
            found = found.get(name) if isinstance(found, dict) else None
        if found:
            return str(found)
    return ""


def expand(text, context):
    return re.sub(r"\$\{\{(.*?)\}\}", lambda match: value(match[1], context), str(text))


class Runner(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        """Makes the repository that each test has a copy of, with golden frames of its main branch."""
        temporary = tempfile.TemporaryDirectory(prefix="polymorph-ci-")
        cls.addClassCleanup(temporary.cleanup)
        cls.common = pathlib.Path(temporary.name)
        tools, work = cls.common / "bin", cls.common / "work"
        tools.mkdir()
        (tools / "polymorph").symlink_to(PROGRAM)
        names = {f"GIT_{role}_{what}": text for role in ("AUTHOR", "COMMITTER") for what, text in (("NAME", "A"), ("EMAIL", "a@localhost"))}
        inherited = {k: v for k, v in os.environ.items() if not k.startswith(("POLYMORPH", "CI", "GIT", "GOLDEN", "REPORT"))}
        cls.environment = inherited | names | {"PATH": f"{tools}:{os.environ['PATH']}", "POLYMORPH_CACHE_DIR": str(cls.common / "cache"),
                                               "HOME": temporary.name, "GIT_CONFIG_NOSYSTEM": "1"}
        (work / "golden_frames/suite").mkdir(parents=True)
        (work / "scene.json").write_text(json.dumps(SCENE))
        (work / "golden_frames/suite/suite.json").write_text(json.dumps({"scene": "../../scene.json", "frames": [1, 3]}))
        cls.call("polymorph", "golden", "update", "suite", "--reason", "first", "-q", folder=work)
        cls.git("init", "-q", "-b", "main", folder=work)
        cls.commit("first", folder=work)

    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="polymorph-ci-")
        self.addCleanup(temporary.cleanup)
        self.outside = pathlib.Path(temporary.name)
        self.origin, self.folder, work = self.outside / "team/scenes.git", self.outside / "checkout", self.outside / "work"
        shutil.copytree(self.common / "work", work)
        self.git("clone", "-q", "--bare", str(work), str(self.origin))
        self.git("remote", "add", "origin", str(self.origin), folder=work)
        self.git("checkout", "-q", "-b", "topic", folder=work)
        self.work = work
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Api)
        self.server.calls, self.server.comments, self.server.states, self.server.requests = [], [], {}, []
        self.server.writable, self.server.user = True, False
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        self.addCleanup(self.server.server_close)
        self.addCleanup(self.server.shutdown)
        self.url = f"http://127.0.0.1:{self.server.server_address[1]}"

    @classmethod
    def call(cls, *command, folder):
        return subprocess.run(command, cwd=folder, env=cls.environment, check=True, capture_output=True, text=True).stdout.strip()

    @classmethod
    def git(cls, *arguments, folder=None):
        return cls.call("git", *arguments, folder=folder or cls.common)

    @classmethod
    def commit(cls, message, scene=None, *, folder):
        if scene:
            (folder / "scene.json").write_text(json.dumps(scene))
        cls.git("add", "-A", folder=folder)
        cls.git("commit", "-q", "--allow-empty", "-m", message, folder=folder)
        return cls.git("rev-parse", "HEAD", folder=folder)

    def push_topic(self, message, scene=None):
        head = self.commit(message, scene, folder=self.work)
        self.git("push", "-q", "--force", "origin", "topic", folder=self.work)
        return head

    def origin_head(self, branch="topic"):
        return self.git("rev-parse", f"refs/heads/{branch}", folder=self.origin)

    def check_out(self, commit):
        """As CIs do: one commit, on no branch."""
        subprocess.run(["rm", "-rf", self.folder], check=True)
        self.git("init", "-q", str(self.folder))
        self.git("remote", "add", "origin", str(self.origin), folder=self.folder)
        self.git("fetch", "-q", "--depth", "1", f"file://{self.origin}", commit, folder=self.folder)
        self.git("checkout", "-q", "FETCH_HEAD", folder=self.folder)

    def sh(self, script, variables):
        return subprocess.run(["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", script], cwd=self.folder, env=self.environment | variables,
                              capture_output=True, text=True, check=False)

    def expect_report(self):
        for file in ("index.html", "junit.xml", "report.json"):
            self.assertTrue((self.folder / "golden-report" / file).exists(), file)

    def expect_nothing_written(self, head):
        self.assertEqual([call for call in self.server.calls if call[0] != "GET"], [])
        self.assertEqual(self.origin_head(), head)
        self.assertEqual(self.git("for-each-ref", "--format=%(refname)", "refs/golden-frames", folder=self.origin), "")

    def expect_accepted(self, head, reason):
        """The branch has one commit more, of the golden frames alone, and it passes."""
        accepted = self.origin_head()
        self.assertEqual(self.git("rev-parse", f"{accepted}^", folder=self.origin), head)
        changed = self.git("diff", "--name-only", head, accepted, folder=self.origin).split()
        self.assertTrue(changed and all(name.startswith("golden_frames/suite/") for name in changed), changed)
        self.assertIn(reason, self.git("show", f"{accepted}:golden_frames/suite/CHANGES.md", folder=self.origin))
        self.check_out(accepted)
        self.call("polymorph", "golden", "test", folder=self.folder)
        return accepted


class GitHub(Runner):
    def run_workflow(self, name, event, inputs=None, sha="", ref="refs/heads/topic"):
        """Runs the workflow of docs/ci.md for an event: whether it passed, the log, and the summary."""
        workflow = next(snippet for snippet in SNIPPETS if "jobs" in snippet)
        self.assertIn(name, workflow[True])  # YAML's "on"
        (job,) = workflow["jobs"].values()
        self.assertEqual(job["container"].split(":")[0], "ghcr.io/OWNER/polymorph")
        event_file, self.summary = self.outside / "event.json", self.outside / "summary.md"
        event_file.write_text(json.dumps(event))
        self.summary.write_text("")
        context = {"github": {"event": event, "sha": sha, "token": "secret"}, "inputs": inputs or {}, "steps": {}}
        variables = {"GITHUB_ACTIONS": "true", "CI": "true", "GITHUB_EVENT_NAME": name, "GITHUB_EVENT_PATH": str(event_file), "GITHUB_REPOSITORY": "team/scenes",
                     "GITHUB_SERVER_URL": "https://github.example", "GITHUB_API_URL": self.url, "GITHUB_RUN_ID": "77", "GITHUB_REF": ref, "GITHUB_SHA": sha,
                     "GITHUB_ACTOR": "ada", "GITHUB_WORKFLOW_REF": f"team/scenes/.github/workflows/golden.yml@{ref}", "GITHUB_STEP_SUMMARY": str(self.summary),
                     "GITHUB_ACTION_PATH": str(ROOT)}
        self.log, self.passed = "", True
        for step in job["steps"]:
            given = {key: expand(text, context) for key, text in step.get("with", {}).items()}
            if step["uses"].startswith("actions/checkout@"):
                self.check_out(given["ref"])
            else:
                self.assertRegex(step["uses"], r"^OWNER/polymorph@v\d")
                self.run_action(given, context, variables)
        return self.passed

    def run_action(self, given, context, variables):
        action = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
        self.assertLessEqual(set(given), set(action["inputs"]))
        own = {"github": context["github"], "steps": {},
               "inputs": {name: given.get(name) or expand(entry.get("default", ""), context) for name, entry in action["inputs"].items()}}
        for step in action["runs"]["steps"]:
            if not self.passed and step.get("if") != "always()":
                continue
            if "uses" in step:
                if step["uses"].startswith("actions/upload-artifact@") and (self.folder / step["with"]["path"]).exists():
                    own["steps"][step["id"]] = {"outputs": {"artifact-url": "https://github.example/artifact"}}
                continue
            self.assertNotIn("${{", step["run"])  # what strangers write never becomes a word of a shell
            done = self.sh(step["run"], variables | {key: expand(text, own) for key, text in step["env"].items()})
            self.log += done.stdout + done.stderr
            self.passed = self.passed and done.returncode == 0

    def pull_request(self, head, home="team/scenes"):
        event = {"pull_request": {"number": 7, "head": {"ref": "topic", "sha": head, "repo": {"full_name": home} if home else None}}}
        return self.run_workflow("pull_request", event, sha=head, ref="refs/pull/7/merge")

    def dispatch(self, head, reason):
        return self.run_workflow("workflow_dispatch", {"inputs": {"reason": reason}, "repository": {"default_branch": "main"}}, {"reason": reason}, sha=head)

    def test_pull_request_that_passes(self):
        head = self.push_topic("nothing")
        self.assertTrue(self.pull_request(head), self.log)
        self.expect_report()
        self.assertIn("all 2 passed", self.summary.read_text())
        self.assertEqual(self.server.comments, [])
        self.expect_nothing_written(head)

    def test_pull_request_that_fails_shows_pictures_and_one_comment(self):
        self.server.comments += [{"id": i + 1, "body": "talk", "user": {"id": 9, "type": "User"}} for i in range(120)]
        self.server.comments.append({"id": 121, "body": f"{MARKER}\nall passed, says a stranger", "user": {"id": 9, "type": "User"}})
        head = self.push_topic("another view", CHANGED)
        self.assertFalse(self.pull_request(head))
        self.expect_report()
        text = self.summary.read_text()
        self.assertIn("2 of 2 failed", text)
        self.assertIn("[The whole report](https://github.example/artifact)", text)
        pictures = re.findall(r"!\[.*?\]\(https://github.example/team/scenes/blob/(\w+)/(.*?)\?raw=true\)", text)
        self.assertEqual(len(pictures), 2)
        for commit, name in pictures:
            kind = subprocess.run(["git", "cat-file", "blob", f"{commit}:{name}"], cwd=self.origin, capture_output=True, check=True).stdout[:4]
            self.assertEqual(kind, b"\x89PNG")
        self.assertEqual(len(self.server.comments), 122)
        self.assertIn("2 of 2 failed", self.server.comments[121]["body"])
        self.assertIn("Golden-Accept: REASON", self.server.comments[121]["body"])
        self.assertIn("actions/workflows/golden.yml", self.server.comments[121]["body"])
        # The next run updates it; the stranger's stays.
        self.assertTrue(self.pull_request(self.push_topic("back", SCENE)), self.log)
        self.assertEqual(len(self.server.comments), 122)
        self.assertIn("all 2 passed", self.server.comments[121]["body"])
        self.assertIn("stranger", self.server.comments[120]["body"])

    def test_accepted_by_the_word(self):
        self.push_topic("another view", CHANGED)
        head = self.push_topic("The camera moved\n\nGolden-Accept: a better view $(touch pwned)")
        self.assertTrue(self.pull_request(head), self.log)
        accepted = self.expect_accepted(head, "a better view $(touch pwned)")
        self.assertFalse((self.folder / "pwned").exists())
        self.assertEqual(self.server.states[accepted]["state"], "success")
        self.assertIn("and are accepted", self.server.comments[0]["body"])
        self.assertTrue(self.pull_request(accepted), self.log)  # as any later run of it
        self.assertEqual(self.origin_head(), accepted)

    def test_accepted_by_the_button(self):
        self.server.requests = [{"number": 7}]
        head = self.push_topic("another view", CHANGED)
        self.assertFalse(self.pull_request(head))
        self.assertTrue(self.dispatch(head, "a better view"), self.log)
        self.expect_accepted(head, "a better view")
        self.assertEqual(len(self.server.comments), 1)
        self.assertIn("and are accepted", self.server.comments[0]["body"])

    def test_button_without_a_reason_accepts_nothing(self):
        head = self.push_topic("another view", CHANGED)
        self.assertFalse(self.dispatch(head, ""))
        self.assertEqual(self.origin_head(), head)

    def test_a_word_of_an_earlier_commit_does_not_count(self):
        self.push_topic("Golden-Accept: a better view", CHANGED)
        head = self.push_topic("and more")
        self.assertFalse(self.pull_request(head))
        self.assertEqual(self.origin_head(), head)

    def test_forks_are_tested_and_never_accepted(self):
        self.server.writable = False
        head = self.push_topic("Golden-Accept: mine", CHANGED)
        for home in ("stranger/scenes", ""):
            self.assertFalse(self.pull_request(head, home))
            self.expect_report()
            self.assertIn("Not accepted", self.summary.read_text())
            self.assertIn("fork", self.summary.read_text())
        self.server.writable = True  # even where the token may write
        self.assertFalse(self.pull_request(head, "stranger/scenes"))
        self.expect_nothing_written(head)

    def test_events_with_too_many_rights_are_refused(self):
        head = self.push_topic("Golden-Accept: mine", CHANGED)
        workflow = next(snippet for snippet in SNIPPETS if "jobs" in snippet)
        for name in ("pull_request_target", "workflow_run", "issue_comment"):
            self.assertNotIn(name, workflow[True])
            workflow[True][name] = None
            self.addCleanup(workflow[True].pop, name)
            self.assertFalse(self.run_workflow(name, {}, sha=head))
            self.assertIn("rights", self.log)
            self.assertFalse((self.folder / "golden-report").exists())
        self.expect_nothing_written(head)

    def test_default_branch_is_accepted_by_the_button_alone(self):
        head = self.commit("Squashed\n\nGolden-Accept: of the branch", CHANGED, folder=self.work)
        self.git("push", "-q", "origin", "topic:main", folder=self.work)
        push = {"repository": {"default_branch": "main"}}
        self.assertFalse(self.run_workflow("push", push, sha=head, ref="refs/heads/main"))
        self.assertEqual(self.origin_head("main"), head)
        self.assertTrue(self.run_workflow("workflow_dispatch", push, {"reason": "seen"}, sha=head, ref="refs/heads/main"), self.log)
        self.assertNotEqual(self.origin_head("main"), head)

    def test_nothing_is_accepted_where_the_branch_has_moved(self):
        head = self.push_topic("Golden-Accept: mine", CHANGED)
        newer = self.push_topic("more")
        self.assertFalse(self.pull_request(head))
        self.assertEqual(self.origin_head(), newer)
        self.assertIn("Not accepted", self.summary.read_text())

    def test_nothing_is_accepted_on_a_merge(self):
        head = self.push_topic("another view", CHANGED)
        merge = self.push_topic("Golden-Accept: mine")
        event = {"pull_request": {"number": 7, "head": {"ref": "topic", "sha": head, "repo": {"full_name": "team/scenes"}}}}
        action = self.check_out
        self.check_out = lambda commit: action(merge)
        self.assertFalse(self.run_workflow("pull_request", event, sha=merge))
        self.assertEqual(self.origin_head(), merge)
        self.assertIn("its merge", self.log)

    def test_a_broken_suite_is_not_accepted(self):
        head = self.push_topic("Golden-Accept: mine", {"source": "nowhere.obj", "target": "cube"})
        self.assertFalse(self.pull_request(head))
        self.assertEqual(self.origin_head(), head)

    def test_without_rights_to_comment_the_test_still_decides(self):
        self.server.writable = False
        self.assertFalse(self.pull_request(self.push_topic("another view", CHANGED)))
        self.assertIn("no comment", self.log)
        self.assertTrue(self.pull_request(self.push_topic("back", SCENE)), self.log)


class GitLab(Runner):
    def setUp(self):
        super().setUp()
        self.server.user = True

    def rule_holds(self, text, variables):
        """Evaluates `$A == "b" && $C == $D`."""
        def side(word):
            return variables.get(word[1:], "") if word.startswith("$") else word.strip('"')
        return all(side(left) == side(right) for left, right in (part.split(" == ") for part in text.split(" && ")))

    def run_job(self, name, variables, token="secret"):
        """Runs a job of the component as the snippet of docs/ci.md includes it; None where its rules leave it out."""
        (include,) = next(snippet for snippet in SNIPPETS if "include" in snippet)["include"]
        self.assertRegex(include["component"], r"/golden@v\d")
        text = (ROOT / "templates/golden.yml").read_text(encoding="utf-8")
        spec = next(yaml.safe_load_all(text))["spec"]["inputs"]
        self.assertLessEqual({key for key, entry in spec.items() if "default" not in entry}, set(include["inputs"]))
        inputs = {key: entry.get("default") for key, entry in spec.items()} | include["inputs"]
        jobs = yaml.safe_load(re.sub(r"\$\[\[ inputs\.(\w+) \]\]", lambda match: json.dumps(inputs[match[1]]), text.split("\n---\n")[1]))
        job = jobs[name]
        if "extends" in job:
            base = jobs[job["extends"]]
            job = base | job | {"variables": base["variables"] | job["variables"]}
        own = {"CI": "true", "GITLAB_CI": "true", "CI_API_V4_URL": self.url, "CI_PROJECT_ID": "3", "CI_PROJECT_URL": f"file://{self.outside}/team/scenes",
               "CI_PROJECT_DIR": str(self.folder), "CI_JOB_URL": "https://gitlab.example/job", "CI_PIPELINE_URL": "https://gitlab.example/pipeline",
               "CI_DEFAULT_BRANCH": "main", "GITLAB_USER_NAME": "Ada", **({"GOLDEN_TOKEN": token} if token else {}), **variables}
        rule = next((rule for rule in job["rules"] if self.rule_holds(rule["if"], own)), None)
        if rule is None:
            return None
        self.manual = rule.get("when") == "manual"
        own |= {key: text.replace("$CI_PROJECT_DIR", str(self.folder)) for key, text in job["variables"].items()}
        self.check_out(own["CI_COMMIT_SHA"])
        installed = "/usr/share/polymorph/ci/"  # where the package has them
        done = self.sh("\n".join(job["script"]).replace(installed, f"{ROOT}/scripts/ci/"), own)
        self.log = done.stdout + done.stderr
        self.assertEqual(job["artifacts"]["reports"]["junit"], "golden-report/junit.xml")
        return done.returncode == 0

    def merge_request(self, head, job="golden frames", source="3", **more):
        return self.run_job(job, {"CI_PIPELINE_SOURCE": "merge_request_event", "CI_MERGE_REQUEST_IID": "7", "CI_MERGE_REQUEST_SOURCE_BRANCH_NAME": "topic",
                                  "CI_MERGE_REQUEST_SOURCE_PROJECT_ID": source, "CI_MERGE_REQUEST_PROJECT_ID": "3", "CI_COMMIT_SHA": head}, **more)

    def test_passes(self):
        self.assertTrue(self.merge_request(self.push_topic("nothing")), self.log)
        self.expect_report()
        self.assertEqual(self.server.comments, [])

    def test_failure_shows_pictures_and_one_comment(self):
        self.assertIs(self.merge_request(self.push_topic("another view", CHANGED)), False)
        self.expect_report()
        attached = re.findall(r"\[\[ATTACHMENT\|(.*?)\]\]", (self.folder / "golden-report/junit.xml").read_text())
        self.assertEqual(len(attached), 2)
        for name in attached:
            self.assertEqual((self.folder / name).read_bytes()[:4], b"\x89PNG")
        (comment,) = self.server.comments
        for name in re.findall(r"https://gitlab.example/job/artifacts/raw/(.*?)\)", comment["body"]):
            self.assertTrue((self.folder / name).exists(), name)
        self.assertIn("accept golden frames", comment["body"])
        self.assertTrue(self.merge_request(self.push_topic("back", SCENE)), self.log)
        self.assertEqual(len(self.server.comments), 1)
        self.assertIn("all 2 passed", comment["body"])

    def test_accepted_by_the_word(self):
        head = self.push_topic("Golden-Accept: a better view", CHANGED)
        self.assertTrue(self.merge_request(head), self.log)
        self.expect_accepted(head, "a better view")

    def test_accepted_by_the_button(self):
        head = self.push_topic("another view", CHANGED)
        self.assertIs(self.merge_request(head), False)
        self.assertTrue(self.merge_request(head, "accept golden frames"), self.log)
        self.assertTrue(self.manual)
        self.expect_accepted(head, "looked at, and as they should be")
        self.assertEqual(len(self.server.comments), 1)

    def test_forks_have_no_button_and_are_never_accepted(self):
        head = self.push_topic("Golden-Accept: mine", CHANGED)
        self.assertIsNone(self.merge_request(head, "accept golden frames", source="8"))
        self.assertIs(self.merge_request(head, source="8"), False)
        self.assertEqual(self.origin_head(), head)
        self.assertIn("fork", self.log)

    def test_without_a_token_frames_are_tested(self):
        head = self.push_topic("Golden-Accept: a better view", CHANGED)
        self.assertIs(self.merge_request(head, token=""), False)
        self.assertIn("no token", self.log)
        self.expect_nothing_written(head)

    def test_default_branch(self):
        head = self.commit("Golden-Accept: of the branch", CHANGED, folder=self.work)
        self.git("push", "-q", "origin", "topic:main", folder=self.work)
        self.assertIs(self.run_job("golden frames", {"CI_PIPELINE_SOURCE": "push", "CI_COMMIT_BRANCH": "main", "CI_COMMIT_SHA": head}), False)
        self.assertEqual(self.origin_head("main"), head)
        self.assertIsNone(self.run_job("golden frames", {"CI_PIPELINE_SOURCE": "push", "CI_COMMIT_BRANCH": "topic", "CI_COMMIT_SHA": head}))


class Elsewhere(Runner):
    def test_an_empty_program_is_that_of_the_path(self):
        self.check_out(self.push_topic("nothing"))
        done = self.sh(str(ROOT / "scripts/ci/golden"), {"POLYMORPH": ""})
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.expect_report()

    def test_suites_may_be_chosen(self):
        self.check_out(self.push_topic("nothing"))
        self.assertEqual(self.sh(str(ROOT / "scripts/ci/golden"), {"GOLDEN_SUITES": "suite"}).returncode, 0)
        self.assertEqual(self.sh(str(ROOT / "scripts/ci/golden"), {"GOLDEN_SUITES": "suite another"}).returncode, 3)


if __name__ == "__main__":
    unittest.main()
