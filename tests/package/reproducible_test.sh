#!/usr/bin/env bash
# reproducible_test.sh BUILD: the Debian package, made twice of one build, is the same bytes: whatever time, umask, language and dates of files.
set -euo pipefail
build=$1
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT
cp "$("$here/../../scripts/package" "$build")" "$work/first.deb"
sleep 1
find "$build/pages" -type f ! -name 'done' -exec touch {} +
second=$(umask 077; LC_ALL=C.UTF-8 TZ=Asia/Kolkata "$here/../../scripts/package" "$build")
cmp "$work/first.deb" "$second" || {
  diff <(dpkg-deb -c "$work/first.deb") <(dpkg-deb -c "$second") || true
  echo "two packages of one build differ"; exit 1; }
# It carries its bill of materials, and the commit's date.
dpkg-deb -c "$second" >"$work/list"
grep -q ' ./usr/share/doc/polymorph/polymorph.spdx.json$' "$work/list" || { echo "no bill of materials in the package"; exit 1; }
date=$(TZ=UTC date -d "@$(git -C "$here" log -1 --format=%ct)" '+%Y-%m-%d %H:%M')
if TZ=UTC dpkg-deb -c "$second" | grep -v " $date "; then echo "dated otherwise than the commit, $date"; exit 1; fi
