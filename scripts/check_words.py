#!/usr/bin/env python3
"""check_words.py [PATH...]: checks names and comments of the sources by the rules of CONTRIBUTING.md, "Style".

Doc comments begin with a verb or the noun that they define; a comment after a member is no prepositional phrase; locals are nouns;
constants are kMax and kMin; functions are verbs, with few exceptions; help texts are sentences with a subject; no two files share a
name. Prints every breach (only those below each PATH, if some are given), or, with --count, the number of breaches of each kind. Exit code 1
if there is one."""
import collections
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
RIDDLE = re.compile(r"(What|Where|How|Which|Whether|Of|The same|Do(es)? the same|As|That|Those|By|At|In|With|From|To|Is|Are|Do|Can|May)\b|(Does|Has|Have)\b.*\?")
FRAGMENT = re.compile(r"///<\s*(of|by|in|from|which|as|at|to|with|where|that|what|how|on|for)\b")
LOCAL = (r"(ways?|of|by|rest|off|apart|aside|straight|made|wanted|whole|these|who|goes|never|same|told|was|then|placed|how|which|tight|turned|back|"
         r"most|least|two|three|some|only|given|said|mine|theirs|many|few|away|again|alike|with|without)")
TYPE = r"(?:auto|bool|char|int|float|double|std::[\w:]+(?:<[^;=(){}]*>)?|[A-Z]\w*(?:<[^;=(){}]*>)?)"
VARIABLE = re.compile(rf"\b{TYPE}\s*[&*]*\s+[&*]?{LOCAL}\s*(?=[;=,){{(\[:])")
# Constants that should be called kMax or kMin.
CONSTANT = re.compile(r"\bk(?:Least|Most|Fewest|Few)(?![a-z])\w*")
FUNCTION = re.compile(rf"^\s*(?:(?:PM_HD|inline|static|constexpr|virtual|template\s*<[^>]*>|\[\[nodiscard\]\])\s+)*(?:const\s+)?{TYPE}[&*]*\s+[&*]?(?:\w+::)*([a-z]\w*)\(", re.M)
# Participles that the field uses as names of functions (std::clamp is a verb; "normalized" and "transposed" are Eigen's).
ESTABLISHED = {"clamped", "normalized", "transposed", "interpolated", "transformed", "inverted", "sorted", "rotated", "reflected", "refracted",
               "unpacked", "embed", "feed", "need", "seed", "speed", "exceed", "proceed", "read", "spread", "shed", "add", "reversed"}
MAX_GENITIVES, MAX_PARTICIPLES = 40, 15  # functions called *_of, and functions that are a participle alone
PREPOSITION = r'"(?:of|by|in|from|which|as|with|at|to|on|for|where|how|what)\b[^"]* [^"]*"'
# The text of an option of the command line, and any text of the table of keys.
HELP = {"src/cli/": re.compile(r'\badd_(?:option|flag|argument|command)\(\s*(?:[^",()]+,\s*)?"[^"]*",\s*(?:[^",()]+,\s*)?(?:"[^"]*",\s*)?(?:fmt::format\(\s*)?(' + PREPOSITION + ")"),
        "src/scene/describe.h": re.compile(r"[,(]\s*(" + PREPOSITION + ")")}


def sources(paths):
    listed = subprocess.run(["git", "ls-files", "src/*.h", "src/*.cpp", "kernels/*.h", "kernels/*.cpp", "kernels/*.cu", "kernels/*.cuh", "python/*.cpp"],
                            cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    return [name for name in listed if not paths or any(name.startswith(path.rstrip("/")) for path in paths)]


def doc_breaches(name, lines):
    for i, line in enumerate(lines):
        text = line.strip()
        if text.startswith("///") and not text.startswith("///<"):
            if i > 0 and lines[i - 1].strip().startswith("///"):
                continue
            if RIDDLE.match(text[3:].strip()):
                yield "doc comment", f"{name}:{i + 1}: {text}"
        if FRAGMENT.search(line):
            yield "member comment", f"{name}:{i + 1}: {text}"


def main():
    paths = [argument for argument in sys.argv[1:] if argument != "--count"]
    found = collections.defaultdict(list)
    genitives, participles, files = {}, {}, collections.defaultdict(list)
    for name in sources(paths):
        text = (ROOT / name).read_text(encoding="utf-8")
        lines = text.split("\n")
        files[pathlib.PurePath(name).name].append(name)
        for kind, breach in doc_breaches(name, lines):
            found[kind].append(breach)
        code = re.sub(r"//[^\n]*", "", text)
        for match in VARIABLE.finditer(code):
            found["variable"].append(f"{name}:{code[:match.start()].count(chr(10)) + 1}: {match[0].strip()}")
        for constant in sorted(set(CONSTANT.findall(code))):
            found["constant"].append(f"{name}: {constant}")
        for match in FUNCTION.finditer(code):
            function = match[1]
            where = f"{name}:{code[:match.start(1)].count(chr(10)) + 1}: {function}()"
            if function.endswith("_of"):
                genitives.setdefault(function, where)
            elif "_" not in function and function.endswith("ed") and function not in ESTABLISHED:
                participles.setdefault(function, where)
        for prefix, pattern in HELP.items():
            for match in pattern.finditer(code) if name.startswith(prefix) else ():
                found["help text"].append(f"{name}:{code[:match.start(1)].count(chr(10)) + 1}: {match[1]}")
    found["file name"] += [", ".join(paths_of_name) for paths_of_name in files.values() if len(paths_of_name) > 1]
    for kind, named, limit in (("genitive", genitives, MAX_GENITIVES), ("participle", participles, MAX_PARTICIPLES)):
        if len(named) > (0 if paths else limit):
            found[kind] += sorted(named.values())
    if "--count" in sys.argv:
        for kind, breaches in sorted(found.items()):
            print(f"{kind}: {len(breaches)}")
    else:
        for kind, breaches in sorted(found.items()):
            for breach in breaches:
                print(f"{kind}: {breach}")
    if not any(found.values()):
        print("words: ok")
    return 1 if any(found.values()) else 0


sys.exit(main())
