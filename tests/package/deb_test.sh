#!/usr/bin/env bash
# deb_test.sh BUILD: the Debian package, installed into a bare Debian 12 where nothing was built, by the steps of Containerfile, and tried there.
# Exit code 77: this needs root, debootstrap and a mirror.
set -euo pipefail
build=$1
((EUID == 0)) || { echo "needs root"; exit 77; }
command -v debootstrap >/dev/null || apt-get -q install -y --no-install-recommends debootstrap >/dev/null 2>&1 || {
  echo "debootstrap cannot be installed"; exit 77; }
work=$(mktemp -d)
cleanup() { umount "$work/root/proc" 2>/dev/null || true; rm -rf --one-file-system "$work"; }
trap cleanup EXIT
rm -rf "$build/pages"  # as after scripts/demo, which builds the program alone
deb=$("$(dirname "$0")/../../scripts/package" "$build")
# Captured first: under pipefail a grep -q that ends early makes its writer fail.
control=$(dpkg-deb --info "$deb")
for field in 'Depends: .*libembree3' 'Depends: .*libassimp5' 'Recommends: .*libopenimageio' 'Recommends: .*libopencolorio' 'Maintainer: .* <.*@.*>'; do
  grep -q "^ *$field" <<<"$control" || { echo "$control"; echo "no $field"; exit 1; }
done
! grep -q 'Depends: .*libopenimageio' <<<"$control" || { echo "OpenImageIO is required"; exit 1; }

# Kept between runs: the bare system takes a minute to make.
cache=${XDG_CACHE_HOME:-$HOME/.cache}/polymorph-test-root; base=$cache/debian12.tar
if [[ ! -f $base ]]; then
  mkdir -p "$cache"
  # One of the two is mostly missing.
  mirror=$(cat /etc/apt/sources.list.d/debian.sources /etc/apt/sources.list 2>/dev/null |
    awk '/^URIs:/ || /^deb /{for (i = 2; i <= NF; ++i) if ($i ~ /^http/) {print $i; exit}}') || true
  debootstrap --variant=minbase bookworm "$work/root" "${mirror:-http://deb.debian.org/debian}" >"$work/debootstrap.log" 2>&1 || {
    tail "$work/debootstrap.log"; echo "no mirror answers"; exit 77; }
  cp /etc/apt/apt.conf.d/99* "$work/root/etc/apt/apt.conf.d/" 2>/dev/null || true
  tar -C "$work/root" -cf "$base.part" . && mv "$base.part" "$base"
else
  mkdir "$work/root" && tar -C "$work/root" -xf "$base"
fi
chmod 755 "$work/root"; cp /etc/resolv.conf "$work/root/etc/"
mount -t proc proc "$work/root/proc"
cp "$deb" "$work/root/tmp/"
inside() { chroot "$work/root" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin TERM=dumb bash -ec "cd /root; $1"; }
containerfile=$(dirname "$0")/../../Containerfile
grep -qx 'FROM debian:12-slim' "$containerfile" && grep -qx 'COPY polymorph_\*.deb /tmp/' "$containerfile" || { echo "Containerfile begins otherwise"; exit 1; }
steps=$(sed -n '/^RUN /,/[^\\]$/{s/^RUN //;s/\\$//;p}' "$containerfile" | tr '\n' ' ')
inside "$steps" >"$work/apt.log" 2>&1 || { tail -n 20 "$work/apt.log"; exit 1; }
# A job of a CI tests golden frames in it, and there is no compiler.
inside 'for tool in cc gcc g++ c++ clang make; do ! command -v $tool || exit 1; done; git --version; python3 --version; python3 -c "import ssl, urllib.request"'
inside 'echo "{\"source\": \"cube\", \"target\": \"sphere\", \"frames\": {\"count\": 2}, \"surface\": {\"resolution\": 16},
  \"image\": {\"width\": 16, \"height\": 12, \"samples\": 1}}" >scene.json; polymorph golden new tiny scene.json -f 1; CI=true /usr/share/polymorph/ci/golden; ls golden-report/junit.xml
  /usr/share/polymorph/ci/pipeline 2>&1 | grep usage'
# Without OpenImageIO, which is only recommended.
inside 'apt-get -q remove -y libopenimageio2.4 >/dev/null 2>&1'
inside 'polymorph demo --set frames.count=12 --set spheres.balls=16 --set surface.resolution=32 --set image.samples=2; ls -l teapot-penguin/morph.gif teapot-penguin/strip.png'
inside 'apt-get -q remove -y polymorph >/dev/null 2>&1; [ ! -e /usr/bin/polymorph ] && [ ! -e /usr/share/polymorph ]'
