#!/usr/bin/env bash
# install_test.sh BUILD: what `cmake --install` puts in place works there, without the source tree.
set -euo pipefail
build=$1
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT
cmake --install "$build" --prefix "$work/usr" >/dev/null
program=$work/usr/bin/polymorph
export PATH=$work/usr/bin:$PATH
here=$(cd "$(dirname "$0")" && pwd)
cd "$work"
# Read whole: under pipefail a `| grep -q` that ends early makes its writer fail.
says() { local said; said=$("${@:2}") && grep -q -- "$1" <<<"$said" || { echo "${*:2}: no $1 in: $said"; exit 1; }; }
says '^  teapot$' "$program" demo --list
# The image reader is found beside the program: only it reads a BMP.
printf 'BM:\0\0\0\0\0\0\0\66\0\0\0\50\0\0\0\1\0\0\0\1\0\0\0\1\0\30\0\0\0\0\0\4\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\377\0\0\0' >one.bmp
says '1 x 1, 3 channels' "$program" info one.bmp
says ': ok' "$program" check "$work/usr/share/polymorph/quickstart/scene.json"
for file in man/man1/polymorph.1 man/man1/polymorph-render.1 bash-completion/completions/polymorph zsh/vendor-completions/_polymorph \
            fish/vendor_completions.d/polymorph.fish polymorph/scene.schema.json polymorph/openjd/polymorph.openjd.yaml doc/polymorph/polymorph.spdx.json doc/polymorph/CITATION.cff; do
  [[ -s $work/usr/share/$file ]] || { echo "missing: $file"; exit 1; }
done
# The README's links to pages and pictures lead somewhere.
pages=$work/usr/share/doc/polymorph
for link in $(grep -o '](docs/[^)#]*' "$pages/README.md" | cut -c3- | sort -u) CONTRIBUTING.md SECURITY.md LICENSE; do
  [[ -s $pages/$link ]] || { echo "missing: $link of the README"; exit 1; }
done
# Completion answers as bash asks.
bash -ec 'source "$1"; COMP_WORDS=(polymorph render --sk); COMP_CWORD=2; _polymorph; [[ ${COMPREPLY[*]} == "--skip-existing" ]]
  COMP_WORDS=(polymorph cache v); _polymorph; [[ ${COMPREPLY[*]} == "verify" ]]
  COMP_WORDS=(polymorph dem); COMP_CWORD=1; _polymorph; [[ ${COMPREPLY[*]} == "demo" ]]
  COMP_WORDS=(polymorph demo teapot pen); COMP_CWORD=3; _polymorph; [[ ${COMPREPLY[*]} == "penguin" ]]
  COMP_WORDS=(polymorph demo teapot --through mel); COMP_CWORD=4; _polymorph; [[ ${COMPREPLY[*]} == "melt" ]]
  COMP_WORDS=(polymorph render s.json --set camera.fo); COMP_CWORD=4; _polymorph; [[ ${COMPREPLY[*]} == *"camera.fov="* ]]
  COMP_WORDS=(polymorph render s.json --set look.kind = me); COMP_CWORD=6; _polymorph; [[ ${COMPREPLY[*]} == "metal" ]]
  COMP_WORDS=(polymorph render s.json --set ground.enabled =); COMP_CWORD=5; _polymorph; [[ ${COMPREPLY[*]} == "true false" ]]
  COMP_WORDS=(polymorph render s.json --set image.aovs = albe); COMP_CWORD=6; _polymorph; [[ ${COMPREPLY[*]} == "albedo" ]]
  COMP_WORDS=(polymorph render --progress j); COMP_CWORD=3; _polymorph; [[ ${COMPREPLY[*]} == "json" ]]' \
  -- "$work/usr/share/bash-completion/completions/polymorph"
# And as zsh and fish do, where they are installed.
if command -v zsh >/dev/null; then
  "$here/completion_test.zsh" "$work/usr/share/zsh/vendor-completions"
else
  echo "no zsh here: its completion was not tried"
fi
if command -v fish >/dev/null; then
  fish_says() {
    says "$1" fish --no-config -c "source $work/usr/share/fish/vendor_completions.d/polymorph.fish; complete -C '$2'"
  }
  fish_says '^demo' 'polymorph dem'; fish_says '^--skip-existing' 'polymorph render --sk'
  fish_says '^lines' 'polymorph render --progress '; fish_says '^teapot' 'polymorph demo teap'
  fish_says '^camera.fov=' 'polymorph render s.json --set camera.fo'; fish_says '^look.kind=metal' 'polymorph render s.json --set look.kind='
  fish_says '^melt' 'polymorph demo teapot --through mel'
else
  echo "no fish here: its completion was not tried"
fi
# The manual pages are without faults.
if command -v man >/dev/null; then
  for page in "$work"/usr/share/man/man1/*.1; do
    faults=$(LC_ALL=C.UTF-8 man -l --warnings "$page" 2>&1 >/dev/null)
    [[ -z $faults ]] || { echo "$page: $faults"; exit 1; }
  done
fi
! grep -rlI "$build" "$work/usr/share" || { echo "the build folder is named in what is installed"; exit 1; }
