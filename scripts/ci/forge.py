"""What GitHub and GitLab tell a run about itself, and what they are asked to do: comments, states of commits, pushes.

A run is described by Run; `refusal` says why nothing may be accepted in it. Commit messages, branch names and events are data: nothing of
them ever gets into a shell's words."""
import base64
import dataclasses
import json
import os
import pathlib
import subprocess
import sys
import urllib.error
import urllib.parse
import urllib.request

MARKER = "<!-- polymorph golden frames -->"
# With these events GitHub gives the rights of the repository to code that may be a stranger's.
DANGEROUS = ("pull_request_target", "workflow_run", "issue_comment")


@dataclasses.dataclass
class Run:
    forge: str = ""  # "github", "gitlab", or "" for any other place
    branch: str = ""  # that accepted frames are pushed to
    commit: str = ""  # the branch's head, which is to be tested
    number: int = 0  # of the pull or merge request; 0: none
    refusal: str = ""  # why nothing may be accepted in this run; "": it may
    reason: str = ""  # given with the button
    by_word: bool = True  # does the word in the commit's message count?
    person: str = ""
    page: str = ""  # of this run
    button: str = ""  # the page with the button
    api: str = ""
    token: str = ""
    project: str = ""  # its path in the API
    pictures: str = ""  # the address of a picture: {commit} and {name} are replaced


def warn(text):
    print(f"golden: {text}", file=sys.stderr)


def git(*arguments, text=None, **environment):
    """Output of a command of git. Raises RuntimeError where it fails."""
    done = subprocess.run(["git", "-c", "core.hooksPath=/dev/null", "-c", "safe.directory=*", *arguments], input=text, capture_output=True, text=True,
                          check=False, env=os.environ | environment)
    if done.returncode:
        raise RuntimeError(f"git {arguments[0]}: {done.stderr.strip()}")
    return done.stdout.strip()


def read_run(environment):
    if environment.get("GITHUB_ACTIONS") == "true":
        return read_github(environment)
    if environment.get("GITLAB_CI"):
        return read_gitlab(environment)
    return Run(refusal="this is neither GitHub nor GitLab")


def read_github(environment):
    event = json.loads(pathlib.Path(environment["GITHUB_EVENT_PATH"]).read_text(encoding="utf-8"))
    kind, repository, server = environment["GITHUB_EVENT_NAME"], environment["GITHUB_REPOSITORY"], environment["GITHUB_SERVER_URL"]
    workflow = environment.get("GITHUB_WORKFLOW_REF", "").split("@")[0].rsplit("/", 1)[-1]
    run = Run(forge="github", person=environment.get("GITHUB_ACTOR", ""), token=environment.get("GOLDEN_TOKEN", ""), api=environment["GITHUB_API_URL"],
              project=f"/repos/{repository}", page=f"{server}/{repository}/actions/runs/{environment['GITHUB_RUN_ID']}",
              button=f"{server}/{repository}/actions/workflows/{workflow}", pictures=f"{server}/{repository}/blob/{{commit}}/{{name}}?raw=true")
    if kind in DANGEROUS:
        raise SystemExit(f"golden: a run of {kind} has rights that a stranger's pull request must not have - test on pull_request")
    ref = environment.get("GITHUB_REF", "")
    if kind == "pull_request":
        request = event["pull_request"]
        home = (request["head"].get("repo") or {}).get("full_name", "")  # none: the fork is deleted
        run.branch, run.commit, run.number = request["head"]["ref"], request["head"]["sha"], request["number"]
        if home.lower() != repository.lower():
            run.refusal = "it is a pull request of a fork"
    elif kind in ("push", "workflow_dispatch") and ref.startswith("refs/heads/"):
        run.branch, run.commit = ref.removeprefix("refs/heads/"), environment["GITHUB_SHA"]
        # A squashed merge carries the words of all its commits.
        run.by_word = kind == "push" and run.branch != event["repository"]["default_branch"]
        if kind == "workflow_dispatch":
            run.reason = environment.get("GOLDEN_ACCEPT", "")
    else:
        run.refusal = f"a run of {kind} belongs to no branch"
    return run


def read_gitlab(environment):
    get = environment.get
    run = Run(forge="gitlab", person=get("GITLAB_USER_NAME", ""), token=get("GOLDEN_TOKEN", ""), api=environment["CI_API_V4_URL"],
              project=f"/projects/{environment['CI_PROJECT_ID']}", page=get("CI_JOB_URL", ""), button=get("CI_PIPELINE_URL", ""),
              pictures=f"{get('CI_JOB_URL', '')}/artifacts/raw/{get('REPORT', 'golden-report')}/{{name}}")
    if get("GOLDEN_BUTTON"):
        run.reason = get("GOLDEN_ACCEPT", "")
    if get("CI_PIPELINE_SOURCE") == "merge_request_event":
        run.branch, run.number = environment["CI_MERGE_REQUEST_SOURCE_BRANCH_NAME"], int(environment["CI_MERGE_REQUEST_IID"])
        run.commit = get("CI_MERGE_REQUEST_SOURCE_BRANCH_SHA") or environment["CI_COMMIT_SHA"]
        if environment["CI_MERGE_REQUEST_SOURCE_PROJECT_ID"] != environment["CI_MERGE_REQUEST_PROJECT_ID"]:
            run.refusal = "it is a merge request of a fork"
    elif get("CI_COMMIT_BRANCH"):
        run.branch, run.commit = environment["CI_COMMIT_BRANCH"], environment["CI_COMMIT_SHA"]
        run.by_word = run.branch != get("CI_DEFAULT_BRANCH")
    else:
        run.refusal = "the pipeline belongs to no branch"
    return run


def request(run, method, path, data=None):
    """The answer of the forge's API. Raises urllib.error.HTTPError, or URLError where there is no connection."""
    header = {"Authorization": f"Bearer {run.token}", "Accept": "application/vnd.github+json"} if run.forge == "github" else {"PRIVATE-TOKEN": run.token}
    body = None if data is None else json.dumps(data).encode()
    call = urllib.request.Request(run.api + path, data=body, method=method, headers=header | {"Content-Type": "application/json"})
    with urllib.request.urlopen(call, timeout=30) as answer:
        return json.loads(answer.read() or b"null")


def find_request(run):
    """The open pull or merge request of the run's branch, where the run belongs to none itself."""
    if run.number or not run.branch or not run.token:
        return run.number
    owner = run.project.split("/")[2]
    query = {"head": f"{owner}:{run.branch}", "state": "open"} if run.forge == "github" else {"source_branch": run.branch, "state": "opened"}
    found = request(run, "GET", f"{run.project}/{'pulls' if run.forge == 'github' else 'merge_requests'}?{urllib.parse.urlencode(query)}")
    return found[0]["number" if run.forge == "github" else "iid"] if found else 0


def own_comment(run, comments):
    """The path of the comments' own one: a stranger's that begins alike is not."""
    try:
        own = request(run, "GET", "/user")["id"]
    except urllib.error.HTTPError:  # GitHub's token of a run belongs to no user
        own = None
    for page in range(1, 100):
        some = request(run, "GET", f"{comments}?per_page=100&page={page}")
        for comment in some:
            author = comment.get("user") or comment.get("author") or {}
            if comment["body"].startswith(MARKER) and (author.get("id") == own if own else author.get("type") == "Bot"):
                return f"{run.project}/issues/comments/{comment['id']}" if run.forge == "github" else f"{comments}/{comment['id']}"
        if len(some) < 100:
            return ""
    return ""


def put_comment(run, text, only_update):
    """Writes the run's one comment on its pull or merge request: updates it where it exists, else makes it unless `only_update`."""
    number = find_request(run)
    if not number:
        return
    comments = f"{run.project}/issues/{number}/comments" if run.forge == "github" else f"{run.project}/merge_requests/{number}/notes"
    body = {"body": f"{MARKER}\n{text}"}
    if there := own_comment(run, comments):
        request(run, "PATCH" if run.forge == "github" else "PUT", there, body)
    elif not only_update:
        request(run, "POST", comments, body)


def report_state(run, commit, description):
    """Marks a commit as tested. GitHub starts no run for what a run pushes, so nothing else would; GitLab does."""
    if run.forge == "github":
        request(run, "POST", f"{run.project}/statuses/{commit}",
                {"state": "success", "context": "golden frames", "description": description[:140], "target_url": run.page})


def push(run, commit, ref, force=False):
    """Pushes a commit: on GitHub by what the checkout keeps, on GitLab by the token, which no command line shows."""
    remote, environment = "origin", {}
    if run.forge == "gitlab":
        remote = os.environ["CI_PROJECT_URL"] + ".git"
        secret = base64.b64encode(f"oauth2:{run.token}".encode()).decode()
        environment = {"GIT_CONFIG_COUNT": "1", "GIT_CONFIG_KEY_0": "http.extraheader", "GIT_CONFIG_VALUE_0": f"Authorization: Basic {secret}"}
    git("push", "-q", *(["--force"] if force else []), remote, f"{commit}:{ref}", **environment)
