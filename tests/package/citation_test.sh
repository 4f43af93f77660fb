#!/usr/bin/env bash
# citation_test.sh VENV: CITATION.cff is valid, as PyPI's cffconvert judges it, installed into the virtual environment VENV; a broken one is not.
# Exit code 77: cffconvert cannot be had.
set -euo pipefail
venv=$1
source=$(cd "$(dirname "$0")/../.." && pwd)
[[ -x $venv/bin/cffconvert ]] || { /usr/bin/python3 -m venv "$venv" && "$venv/bin/pip" -q install cffconvert; } >/dev/null 2>&1 || {
  echo "SKIPPED: cffconvert cannot be had"; exit 77; }
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT
"$venv/bin/cffconvert" --validate -i "$source/CITATION.cff"
"$venv/bin/cffconvert" -f bibtex -i "$source/CITATION.cff" | grep -q 'title = {polymorph}'
sed '/^title:/d' "$source/CITATION.cff" >"$work/CITATION.cff"
! "$venv/bin/cffconvert" --validate -i "$work/CITATION.cff" >/dev/null 2>&1 || { echo "a citation without a title is valid"; exit 1; }
