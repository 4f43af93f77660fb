#!/usr/bin/env bash
# openjd_test.sh POLYMORPH TEMPLATE: the Open Job Description template, run by openjd's own command line.
# Exit code 77: openjd-cli cannot be had here.
set -euo pipefail
polymorph=$1 template=$2
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT
if ! command -v openjd >/dev/null; then
  { python3 -m venv "$work/venv" && "$work/venv/bin/pip" -q install openjd-cli; } >/dev/null 2>&1 || {
    echo "openjd-cli cannot be installed"; exit 77; }
  PATH=$work/venv/bin:$PATH
fi
cat >"$work/scene.json" <<'SCENE'
{"source": {"shape": "cube", "spheres": {"balls": 12}}, "target": {"shape": "sphere", "spheres": {"balls": 6}},
 "frames": {"count": 6}, "surface": {"resolution": 16}, "image": {"width": 32, "height": 24, "samples": 1}}
SCENE
export POLYMORPH_CACHE_DIR=$work/cache
"$polymorph" render "$work/scene.json" -o "$work/one/f.####.exr" -q
openjd check "$template"
openjd run "$template" --step Finish --run-dependencies -p Program="$polymorph" -p Scene="$work/scene.json" \
  -p Output="$work/farm/f.####.exr" -p Shards=3 -p Sheet="$work/farm/strip.png" >"$work/log" 2>&1 || {
  cat "$work/log"; exit 1; }
for file in "$work"/one/f.*.exr; do
  "$polymorph" compare "$work/farm/$(basename "$file")" "$file" --fail 0 --hardfail 0 --relative 0 >/dev/null
done
[[ -s $work/farm/strip.png ]]
