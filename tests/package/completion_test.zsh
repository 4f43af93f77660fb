#!/usr/bin/env zsh
# completion_test.zsh FOLDER: zsh, asked as a person asks it. FOLDER holds _polymorph; the program is in the search path.
zmodload zsh/zpty
cd "$(mktemp -d)" || exit 1
zpty shell "zsh -f -i"
zpty -w shell "fpath=($1 \$fpath); autoload -U compinit; compinit -D -u; PS1=; print up"
zpty -r -m shell answer '*up*up*'
# WORDS ANSWER: what WORDS and two tabs show.
shows() {
  zpty -w -n shell "$1"$'\t\t'
  sleep 2
  local all= line
  while zpty -r -t shell line; do all+=$line; done
  zpty -w -n shell $'\C-u'
  [[ $all == *$2* && $all != *rguments:* ]] || { print -r -- "zsh, $1: no $2 in: $all"; exit 1 }
}
shows 'polymorph dem' 'demo'
shows 'polymorph render --sk' '--skip-existing'
shows 'polymorph render --progress ' 'lines'
shows 'polymorph cache ' 'verify'
shows 'polymorph demo teap' 'teapot'
shows 'polymorph demo teapot pen' 'penguin'
shows 'polymorph demo teapot --through mel' 'melt'
shows 'polymorph render s.json --set camera.fo' 'camera.fov='
shows 'polymorph render s.json --set look.kind=me' 'look.kind=metal'
zpty -d shell
