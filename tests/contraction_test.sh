#!/usr/bin/env bash
# contraction_test.sh PROGRAM: nothing is fused in the program but where the source asks for it.
# GCC 12 makes vfmaddsub of products and sums that alternate in sign, with -ffp-contract=off too; a program for plain x86-64 has no such
# instruction and would fit other balls in the last bit. Skipped (77) without objdump.
set -euo pipefail
command -v objdump >/dev/null || { echo "no objdump here" >&2; exit 77; }
fused=$(objdump -d --no-show-raw-insn "$1" | awk '/^[0-9a-f]+ <.*>:$/ { name = $2 } /vfmaddsub|vfmsubadd/ { print name }' | sort -u | c++filt)
[[ -z $fused ]] || { printf 'products and sums rounded as one in:\n%s\n' "$fused" >&2; exit 1; }
