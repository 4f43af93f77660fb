#!/usr/bin/env bash
# wheel_test.sh BUILD SOURCE: a wheel of this build, installed into a bare virtual environment and used there. PYTHON names the
# interpreter, as that of scripts/wheel. Exit code 77: PyPI cannot be reached, or this is no release build of the CPU.
set -euo pipefail
build=$1 source=$2
export PYTHON=${PYTHON:-/usr/bin/python3}
grep -q '^CMAKE_BUILD_TYPE:.*=Release$' "$build/CMakeCache.txt" || { echo "SKIPPED: not a release build"; exit 77; }
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT
"$PYTHON" -m venv "$work/venv" 2>/dev/null || { echo "SKIPPED: needs python3-venv"; exit 77; }
[[ -f $("$PYTHON" -c 'import sysconfig; print(sysconfig.get_path("include"))')/Python.h ]] || {
  echo "SKIPPED: needs python3-dev"; exit 77; }
"$work/venv/bin/pip" -q install numpy >/dev/null 2>&1 || { echo "SKIPPED: PyPI cannot be reached"; exit 77; }
wheel=$("$source/scripts/wheel" "$build")
# The page says for which systems it is.
tag=$(basename "$wheel" .whl | sed 's/.*-\(manylinux_[0-9_]*\)_x86_64$/\1/')
[[ $(getconf GNU_LIBC_VERSION) != "glibc 2.36" ]] || grep -q "($tag:" "$source/docs/python.md" || { echo "docs/python.md does not name $tag"; exit 1; }
cp "$wheel" "$work/first.whl"
# Made again it is the same bytes, also where another Python made one in between.
echo '{"skbuild_path": "/nowhere"}' >"$build/.skbuild-info.json"
wheel=$(umask 077; TZ=Asia/Kolkata "$source/scripts/wheel" "$build")
cmp "$work/first.whl" "$wheel"
"$work/venv/bin/pip" -q install --no-deps "$wheel"
cd "$work"
site=$(echo "$work"/venv/lib/python3*/site-packages)
# Every library comes out of the wheel, but for those that each Linux has.
for file in "$site"/polymorph/bin/polymorph "$site"/polymorph/bin/polymorph_assimp "$site"/polymorph/_polymorph*.so; do
  foreign=$(ldd "$file" | awk '/=> \//{print $3}' | grep -v "^$site" | grep -vE '/(libc|libm|libstdc\+\+|libgcc_s|libz)\.so' || true)
  [[ -z $foreign ]] || { echo "$file takes from the system: $foreign"; exit 1; }
done
# The licences are those of the packages that its libraries come from, not of others that have a file of the same name.
[[ -s $(echo "$site"/polymorph/licenses/libgcc-s1.txt) ]] || { ls "$site/polymorph/licenses"; echo "no licence of libgcc"; exit 1; }
# It says what it is made of.
"$work/venv/bin/python" - "$site"/polymorph_render-*.dist-info/sboms/polymorph-render.spdx.json <<'CHECK'
import json, sys
document = json.load(open(sys.argv[1], encoding="utf-8"))
assert document["spdxVersion"] == "SPDX-2.3" and document["packages"][0]["name"] == "polymorph-render"
assert {"libembree3-3", "libassimp5", "libeigen3-dev"} <= {entry["name"] for entry in document["packages"]}
CHECK
export POLYMORPH_CACHE_DIR=$work/cache
"$work/venv/bin/polymorph" demo cube torus --set frames.count=12 --set spheres.balls=16 --set surface.resolution=32 --set image.samples=2 -q >/dev/null
[[ -s cube-torus/morph.gif ]]
cat >scene.json <<'SCENE'
{"source": {"shape": "cube", "spheres": {"balls": 12}}, "target": {"shape": "sphere", "spheres": {"balls": 6}},
 "spheres": {"fit": "none"}, "frames": {"count": 6}, "surface": {"resolution": 16}, "image": {"width": 32, "height": 24, "samples": 2}}
SCENE
"$build/polymorph" render scene.json -o 'f.####.exr' -q
"$work/venv/bin/python" -B "$source/tests/python/module_test.py"
"$work/venv/bin/python" -B "$source/tests/python/calls_test.py"
"$work/venv/bin/python" -B "$source/tests/python/arrays_test.py"
"$work/venv/bin/python" -B "$source/tests/python/snippets_test.py"
