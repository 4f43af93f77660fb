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
 "spheres": {"fit": "none"}, "frames": {"count": 6}, "surface": {"resolution": 16}, "image": {"width": 32, "height": 24, "samples": 1}}
SCENE
export POLYMORPH_CACHE_DIR=$work/cache
"$polymorph" render "$work/scene.json" -o "$work/one/f.####.exr" -q
same_frames() {  # FOLDER: its frames are those of one process
  for file in "$work"/one/f.*.exr; do
    "$polymorph" compare "$work/$1/$(basename "$file")" "$file" --fail 0 --hardfail 0 --relative 0 >/dev/null
  done
}
run() { openjd run "$template" "$@" -p Program="$polymorph" >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }; }
openjd check "$template"
# All of it, with every parameter.
run --step Finish --run-dependencies -p Name=test -p Scene="$work/scene.json" -p Output="$work/shards/f.####.exr" -p Shards=3 -p Sheet="$work/shards/strip.png"
same_frames shards
# What the session read as progress: it says so in its log, and hides lines that it does not know.
grep -q "openjd_progress: 100.0" "$work/log"
[[ -s $work/shards/strip.png ]]
# Each step alone, with every default.
run --step Render -p Scene="$work/scene.json" -p Output="$work/alone/f.####.exr"
same_frames alone
run --step Finish -p Scene="$work/scene.json" -p Output="$work/alone/f.####.exr"
# The example of the template's head, as it stands there.
mkdir "$work/bin" "$work/example"
ln -s "$polymorph" "$work/bin/polymorph"
cp "$work/scene.json" "$template" "$work/example"
example=$(sed -n 's/^#   \(openjd run .*\)/\1/p' "$template")
(cd "$work/example" && PATH=$work/bin:$PATH && bash -ec "$example") >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }
[[ $(find "$work/example/out" -name "frame.*.exr" | wc -l) == 6 ]]
