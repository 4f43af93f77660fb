#!/usr/bin/env bash
# manual_test.sh SOURCE BUILD: the manual can be made, without a warning; it has its pages, their pictures, and a search that finds them.
# Exit code 77: there is no mkdocs.
set -euo pipefail
command -v mkdocs >/dev/null || { echo "SKIPPED: no mkdocs (apt-get install mkdocs)"; exit 77; }
"$1/scripts/play_pages" "$1/build/play" "$2" "$1/scenes/effects/puddle.json"
index=$("$1/scripts/manual" --check)
site=$(dirname "$index")
for page in index tutorial looks_wrong cookbook gallery scene commands python method performance reliability architecture; do
  [[ -s $site/$page.html ]] || { echo "no page $page"; exit 1; }
done
# Every picture and file that a page shows is there.
python3 - "$site" <<'CHECK'
import pathlib, re, sys, urllib.parse
site = pathlib.Path(sys.argv[1])
missing = []
for page in set(site.glob("*.html")) - {site / "404.html"}:  # that one is for servers
    text = re.sub(r"<!--.*?-->", "", page.read_text(encoding="utf-8"), flags=re.S)
    for link in re.findall(r'(?:src|href)="([^"#?]+)', text):
        if not re.match(r"[a-z]+:", link) and not (page.parent / urllib.parse.unquote(link)).exists():
            missing.append(f"{page.name}: {link}")
print("\n".join(missing))
sys.exit(bool(missing))
CHECK
grep -q 'href="play/puddle.html">Turn it' "$site/cookbook.html"
grep -q 'href="play/puddle.html">Turn it' "$site/morphs.html"
grep -q '"location":"cookbook.html#puddle"' "$site/search/search_index.json"
