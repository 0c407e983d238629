# Completion of cradled and cradle for bash: subcommands, options, their values, files.
# It reads the help of the very program that is being typed, and so is never out of date.

# The options of a help text, one a line: the long name, then its type if it takes a value.
_cradle_options() {
  sed -nE 's/^ {2,6}(-[a-zA-Z],)?(--[a-z])/\2/p' <<<"$1" |
    sed -E 's/  .*//; s/ (Excludes|Needs|REQUIRED).*//'
}

_cradle_subcommands() {
  sed -nE '/^Subcommands:/,/^$/s/^  ([a-z][a-z-]*).*/\1/p' <<<"$1"
}

# Files and folders, of the kind given by a pattern of names.
_cradle_files() {
  compopt -o filenames 2>/dev/null
  mapfile -t COMPREPLY < <(compgen -d -- "$2"; compgen -f -X "!$1" -- "$2")
}

_cradle() {
  local program=${1/#\~/$HOME} word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]}
  local help options subcommands subcommand='' i skip='' type=''
  COMPREPLY=()
  [[ $word == = ]] && word=  # bash takes --world=x apart
  [[ $before == = ]] && before=${COMP_WORDS[COMP_CWORD - 2]}
  help=$("$program" --help 2>/dev/null) || return 0
  options=$(_cradle_options "$help")
  subcommands=$(_cradle_subcommands "$help")
  for ((i = 1; i < COMP_CWORD && ${#subcommand} == 0; i++)); do
    [[ ${COMP_WORDS[i]} == = ]] && skip=yes && continue
    [[ $skip ]] && skip='' && continue  # the value of an option
    [[ ${COMP_WORDS[i]} == --* ]] && grep -q -- "^${COMP_WORDS[i]} " <<<"$options" && skip=yes
    grep -qxF -- "${COMP_WORDS[i]}" <<<"$subcommands" && subcommand=${COMP_WORDS[i]}
  done
  if [[ $subcommand ]]; then
    help=$("$program" "$subcommand" --help 2>/dev/null) || return 0
    # The client's tool takes its own options after the subcommand, too.
    [[ ${program##*/} == cradle ]] || options=
    options=$(_cradle_options "$help")$'\n'$options
    subcommands=
  fi

  [[ $before == --* ]] && type=$(sed -n "s/^$before //p" <<<"$options" | head -n 1)
  case $before:$type in
    --*:*\{*)  # one of a list: {box->2,sphere->1} or {text,json}
      type=${type#*\{} type=${type%%\}*}
      mapfile -t COMPREPLY < <(compgen -W "$(sed -E 's/->[^,]*//g; s/,/ /g' <<<"$type")" -- "$word")
      return ;;
    --config:* | --scene:*) _cradle_files '*.toml' "$word"; return ;;
    --world:?* | --name:?* | --lcm-url:?*) return ;;
    --*:TEXT* | --*:*FILE* | --*:*PATH*) _cradle_files '*' "$word"; return ;;
    --*:?*) return ;;
  esac
  if [[ $word == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$(sed 's/ .*//' <<<"$options")" -- "$word")
  elif [[ $subcommands ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$subcommands" -- "$word")
  else
    case $(sed -nE '/^Positionals:/,/^$/s/^  //p' <<<"$help") in
      SCENE*) _cradle_files '*.toml' "$word" ;;
      body* | gravity* | ticks* | '') ;;
      *) _cradle_files '*' "$word" ;;
    esac
  fi
}

complete -F _cradle cradled cradle
