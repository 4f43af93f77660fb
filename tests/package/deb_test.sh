#!/usr/bin/env bash
# deb_test.sh BUILD: the Debian package, installed into a bare Debian 12 where nothing was built, and tried there.
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
for field in 'Depends: .*libembree3' 'Depends: .*libassimp5' 'Recommends: libopenimageio' 'Maintainer: .* <.*@.*>'; do
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
cp "$deb" "$work/root/root/"
inside() { chroot "$work/root" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin TERM=dumb bash -ec "cd /root; $1"; }
inside "apt-get -q update && DEBIAN_FRONTEND=noninteractive apt-get -q install -y --no-install-recommends ./$(basename "$deb")" \
  >"$work/apt.log" 2>&1 || { tail -n 20 "$work/apt.log"; exit 1; }
inside 'polymorph demo; ls -l teapot-penguin/morph.gif teapot-penguin/strip.png'
inside 'apt-get -q remove -y polymorph >/dev/null 2>&1; [ ! -e /usr/bin/polymorph ] && [ ! -e /usr/share/polymorph ]'
