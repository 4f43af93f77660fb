#!/usr/bin/env python3
"""Checks that all links, files, scripts, subcommands and options in README, CONTRIBUTING and docs/ exist; that docs/ describes every
environment variable and room; and that some pages and sentences are short enough."""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("scenes/**/*.md")])
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
CODE = re.compile(r"```(?:sh|bash|console)?\n(.*?)```|`([^`\n]+)`", re.S)
PATH = re.compile(r"^(?:src|kernels|tests|scripts|docs|scenes|golden_frames|cmake)/[\w./*#-]+$")
FOLDERS = ["", "src/", "src/cli/commands/", "kernels/"]

# Limits in lines, to keep history out of these pages: it belongs in commit messages.
MAX_LINES = {"docs/performance.md": 120, "docs/reliability.md": 90}
MAX_WORDS = 30  # per sentence of docs/method.md

sources = {path.stem: path.read_text(encoding="utf-8") for path in (ROOT / "src/cli").glob("**/*.cpp")}
shared = sources["command_line"] + sources["report_options"] + sources["scene_options"]
options = {
    name: set(re.findall(r"--[a-z][\w-]*", text + shared)) | {"--help"}
    for text in sources.values()
    for name in re.findall(r'add_command\(\s*[\w.*&>-]+,\s*"([a-z]+)"', text)
}
scripts = {path.name: path.read_text(encoding="utf-8", errors="replace") for path in (ROOT / "scripts").iterdir() if path.is_file()}


def anchors(page: pathlib.Path) -> set[str]:
    """Returns the anchors that GitHub makes of a page's headings."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.M)
    return {re.sub(r"[^\w -]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def wrong_links(page: pathlib.Path, text: str):
    """Yields what is wrong with the links of a page. Links to other sites are not checked."""
    for target in LINK.findall(text):
        if "://" in target or target.startswith("mailto:"):
            continue
        name, _, anchor = target.partition("#")
        file = (page.parent / name).resolve() if name else page
        if not file.exists():
            yield f"link to {target}: no such file"
        elif anchor and file.suffix == ".md" and anchor not in anchors(file):
            yield f"link to {target}: no such heading"


def wrong_command(line: str):
    """Yields what is wrong with a command line of polymorph or of scripts/."""
    words = line.split("#")[0].split()
    while words and re.match(r"^[A-Z_]+=", words[0]):  # environment variables
        words = words[1:]
    if not words:
        return
    program, *rest = words
    used = {word.split("=")[0] for word in rest if word.startswith("--")}
    if program.split("/")[-1] == "polymorph" and rest and re.match(r"^[a-z]+$", rest[0]):
        if rest[0] not in options:
            yield f"`{line}`: no such subcommand"
        elif unknown := used - options[rest[0]]:
            yield f"`{line}`: {rest[0]} has no option {', '.join(sorted(unknown))}"
    if program.startswith("scripts/") and "*" not in program:
        name = program.removeprefix("scripts/")
        if not (ROOT / program).exists():
            yield f"`{line}`: no such script"
        elif unknown := {option for option in used if option not in scripts.get(name, option)}:
            yield f"`{line}`: the script has no option {', '.join(sorted(unknown))}"


def long_sentences(text: str):
    """Yields the length and start of sentences of more than MAX_WORDS words; tables, headings and formulas do not count."""
    prose = re.sub(r"^```.*?^```|^(?:\||#| {4}).*?$", "", text, flags=re.M | re.S)
    for block in re.split(r"\n\s*\n|\n- ", prose):
        for sentence in re.split(r"(?<=[.?!])\)?\s+", " ".join(block.split())):
            words = sentence.split()
            if len(words) > MAX_WORDS:
                yield len(words), " ".join(words[:8])


def pattern(word: str) -> str:
    """Returns the glob pattern of a path in which capitals and #### stand for any name."""
    return re.sub(r"#+|(?<![A-Za-z])[A-Z]{2,}(?![a-z])|N(?=[*.])", "*", word.rstrip("/")).replace("**", "*")


def wrong_paths(word: str):
    """Yields a message if the word looks like a path of the repository that does not exist."""
    if PATH.match(word) and word != "scripts/" and not any(ROOT.glob(pattern(word))):
        yield f"`{word}`: no such file"
    elif re.match(r"^[a-z_]+(/[a-z_]+)+\.(h|cpp|cu|cuh)$", word) and not any((ROOT / folder / word).exists() for folder in FOLDERS):
        yield f"`{word}`: no such file"


all_problems = []
for page in PAGES:
    text = page.read_text(encoding="utf-8")
    problems = list(wrong_links(page, text))
    for block, inline in CODE.findall(text):
        for line in (block or inline).replace("\\\n", " ").split("\n"):
            line = line.strip()
            problems += wrong_command(line)
            if inline:
                problems += wrong_paths(line)
    all_problems += [f"{page.relative_to(ROOT)}: {problem}" for problem in problems]
# Environment variables: docs/settings.md describes each, and a test of the program uses it.
variables = set(re.findall(r'"(POLYMORPH_[A-Z_]+)"', "".join(p.read_text(encoding="utf-8") for p in (ROOT / "src").rglob("*.cpp"))))
tested = "".join(p.read_text(encoding="utf-8") for p in (ROOT / "tests/cli").glob("*.cpp"))
for name in sorted(variables):
    if f"`{name}`" not in (ROOT / "docs/settings.md").read_text(encoding="utf-8"):
        all_problems.append(f"docs/settings.md: says nothing of {name}")
    if f'"{name}"' not in tested:
        all_problems.append(f"tests/cli: nothing tests {name}")
# Rooms: CONTRIBUTING.md lists them in order, and docs/architecture.md describes each.
rooms = re.findall(r'"(\w+)"', re.search(r"^ROOMS = \[(.*?)\]", (ROOT / "scripts/check_layers.py").read_text(encoding="utf-8"), re.M | re.S)[1])
if ", ".join(rooms) not in " ".join((ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").split()):
    all_problems.append("CONTRIBUTING.md: the list of rooms is not that of scripts/check_layers.py")
for room in rooms:
    if f"`{room}`" not in (ROOT / "docs/architecture.md").read_text(encoding="utf-8"):
        all_problems.append(f"docs/architecture.md: says nothing of the room {room}")
for page, limit in MAX_LINES.items():
    if (count := len((ROOT / page).read_text(encoding="utf-8").splitlines())) > limit:
        all_problems.append(f"{page}: {count} lines, more than {limit}")
all_problems += [f"docs/method.md: a sentence of {count} words: {start} ..." for count, start in long_sentences((ROOT / "docs/method.md").read_text(encoding="utf-8"))]
version = re.search(r"project\(polymorph VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"))[1]
for page, version_line in (("CHANGELOG.md", r"^## (?:Unreleased \()?([\d.]+)"), ("CITATION.cff", r"^version: (.*)")):
    if re.search(version_line, (ROOT / page).read_text(encoding="utf-8"), re.M)[1] != version:
        all_problems.append(f"{page}: its newest version is not {version}, that of CMakeLists.txt")
if len(options) < 10 or len(variables) < 10:
    all_problems.append("found too few subcommands or variables in src: the pattern of this script is out of date")
print("\n".join(all_problems) if all_problems else f"docs: ok ({len(PAGES)} pages)")
sys.exit(1 if all_problems else 0)
