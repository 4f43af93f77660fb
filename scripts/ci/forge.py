"""The run of a CI on GitHub or GitLab (a forge): its description, comments, commit states and pushes.

Commit messages, branch names and events are foreign data: they never become part of a shell command."""
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
# For these events GitHub gives code of possibly foreign pull requests the rights of the repository.
DANGEROUS = ("pull_request_target", "workflow_run", "issue_comment")


@dataclasses.dataclass
class Run:
    forge: str = ""  # "github", "gitlab", or "" for any other place
    branch: str = ""  # accepted frames are pushed to it
    commit: str = ""  # the branch's head, which is tested
    number: int = 0  # number of the pull or merge request; 0: none
    refusal: str = ""  # why nothing may be accepted in this run; "": frames may be accepted
    reason: str = ""  # entered by the person who pressed the button
    counts_message: bool = True  # a line "Golden-Accept:" in the commit's message counts
    person: str = ""
    page: str = ""  # the address of the run's page
    button: str = ""  # the address of the page with the button
    api: str = ""
    token: str = ""
    project: str = ""  # its path in the API
    pictures: str = ""  # the address of a picture: {commit} and {name} are replaced


def warn(text):
    print(f"golden: {text}", file=sys.stderr)


def git(*arguments, text=None, **environment):
    """Returns the output of a git command. Raises RuntimeError if it fails."""
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
    event_name, repository, server = environment["GITHUB_EVENT_NAME"], environment["GITHUB_REPOSITORY"], environment["GITHUB_SERVER_URL"]
    workflow = environment.get("GITHUB_WORKFLOW_REF", "").split("@")[0].rsplit("/", 1)[-1]
    run = Run(forge="github", person=environment.get("GITHUB_ACTOR", ""), token=environment.get("GOLDEN_TOKEN", ""), api=environment["GITHUB_API_URL"],
              project=f"/repos/{repository}", page=f"{server}/{repository}/actions/runs/{environment['GITHUB_RUN_ID']}",
              button=f"{server}/{repository}/actions/workflows/{workflow}", pictures=f"{server}/{repository}/blob/{{commit}}/{{name}}?raw=true")
    if event_name in DANGEROUS:
        raise SystemExit(f"golden: a run of {event_name} has rights that a stranger's pull request must not have - test on pull_request")
    ref = environment.get("GITHUB_REF", "")
    if event_name == "pull_request":
        request = event["pull_request"]
        head_repository = (request["head"].get("repo") or {}).get("full_name", "")  # "": the fork is deleted
        run.branch, run.commit, run.number = request["head"]["ref"], request["head"]["sha"], request["number"]
        if head_repository.lower() != repository.lower():
            run.refusal = "it is a pull request of a fork"
    elif event_name in ("push", "workflow_dispatch") and ref.startswith("refs/heads/"):
        run.branch, run.commit = ref.removeprefix("refs/heads/"), environment["GITHUB_SHA"]
        # The message of a squashed merge contains those of all its commits.
        run.counts_message = event_name == "push" and run.branch != event["repository"]["default_branch"]
        if event_name == "workflow_dispatch":
            run.reason = environment.get("GOLDEN_ACCEPT", "")
    else:
        run.refusal = f"a run of {event_name} belongs to no branch"
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
        run.counts_message = run.branch != get("CI_DEFAULT_BRANCH")
    else:
        run.refusal = "the pipeline belongs to no branch"
    return run


def request(run, method, path, data=None):
    """Calls the forge's API and returns its answer. Raises urllib.error.HTTPError, or URLError without a connection."""
    header = {"Authorization": f"Bearer {run.token}", "Accept": "application/vnd.github+json"} if run.forge == "github" else {"PRIVATE-TOKEN": run.token}
    body = None if data is None else json.dumps(data).encode()
    call = urllib.request.Request(run.api + path, data=body, method=method, headers=header | {"Content-Type": "application/json"})
    with urllib.request.urlopen(call, timeout=30) as answer:
        return json.loads(answer.read() or b"null")


def find_request(run):
    """Returns the number of the run's pull or merge request, else of the open one of its branch; 0 if there is none."""
    if run.number or not run.branch or not run.token:
        return run.number
    owner = run.project.split("/")[2]
    query = {"head": f"{owner}:{run.branch}", "state": "open"} if run.forge == "github" else {"source_branch": run.branch, "state": "opened"}
    requests = request(run, "GET", f"{run.project}/{'pulls' if run.forge == 'github' else 'merge_requests'}?{urllib.parse.urlencode(query)}")
    return requests[0]["number" if run.forge == "github" else "iid"] if requests else 0


def find_own_comment(run, comments):
    """Returns the API path of the comment of an earlier run, or "". Comments of other users with the same marker do not count."""
    try:
        user_id = request(run, "GET", "/user")["id"]
    except urllib.error.HTTPError:  # the token of a GitHub run belongs to no user
        user_id = None
    for page_number in range(1, 100):
        comment_page = request(run, "GET", f"{comments}?per_page=100&page={page_number}")
        for comment in comment_page:
            author = comment.get("user") or comment.get("author") or {}
            if comment["body"].startswith(MARKER) and (author.get("id") == user_id if user_id else author.get("type") == "Bot"):
                return f"{run.project}/issues/comments/{comment['id']}" if run.forge == "github" else f"{comments}/{comment['id']}"
        if len(comment_page) < 100:
            return ""
    return ""


def put_comment(run, text, only_update):
    """Updates the comment of earlier runs on the pull or merge request. Without one, writes a new comment unless `only_update`."""
    number = find_request(run)
    if not number:
        return
    comments = f"{run.project}/issues/{number}/comments" if run.forge == "github" else f"{run.project}/merge_requests/{number}/notes"
    body = {"body": f"{MARKER}\n{text}"}
    if own_comment := find_own_comment(run, comments):
        request(run, "PATCH" if run.forge == "github" else "PUT", own_comment, body)
    elif not only_update:
        request(run, "POST", comments, body)


def report_state(run, commit, description):
    """Marks a commit as tested on GitHub, which starts no run for a commit that a run has pushed. GitLab starts one."""
    if run.forge == "github":
        request(run, "POST", f"{run.project}/statuses/{commit}",
                {"state": "success", "context": "golden frames", "description": description[:140], "target_url": run.page})


def push(run, commit, ref, force=False):
    """Pushes a commit. Uses the credentials of the checkout on GitHub, and the token on GitLab, passed to git by the environment."""
    remote, environment = "origin", {}
    if run.forge == "gitlab":
        remote = os.environ["CI_PROJECT_URL"] + ".git"
        secret = base64.b64encode(f"oauth2:{run.token}".encode()).decode()
        environment = {"GIT_CONFIG_COUNT": "1", "GIT_CONFIG_KEY_0": "http.extraheader", "GIT_CONFIG_VALUE_0": f"Authorization: Basic {secret}"}
    git("push", "-q", *(["--force"] if force else []), remote, f"{commit}:{ref}", **environment)
