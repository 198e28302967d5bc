# Sourced by scripts/test and scripts/steak: their plan, their steps, and how far each is.
#
# plan NAME ABOUT COMMAND...     adds a step
# show_plan                      says all steps and what each is about
# watch LOG... -- COMMAND...     runs the command and shows how far it is; status: that of the command
#
# LOG may have wildcards. How far: the last "[n/m" of ninja or "n/m Test" of ctest in the newest of the logs since the command began, and the
# time. A terminal shows it in one line, and what the command itself says after that; without one a line appears every progress_seconds.

step_names=() step_abouts=() step_commands=()
step_number=0
progress_seconds=20
export NINJA_STATUS="[%f/%t] "
live=false
if [ -t 1 ] && [ "${TERM:-dumb}" != dumb ]; then live=true; fi

plan() {
  step_names+=("$1")
  step_abouts+=("$2")
  shift 2
  step_commands+=("$*")  # split at blanks when it runs
}

show_plan() {
  local i
  for i in "${!step_names[@]}"; do
    printf '  %2d  %-24s %s\n' $((i + 1)) "${step_names[i]}" "${step_abouts[i]}"
  done
}

clock() {  # clock SECONDS: as 1:02 or 1:02:03
  if [ "$1" -ge 3600 ]; then printf '%d:%02d:%02d' $(($1 / 3600)) $(($1 / 60 % 60)) $(($1 % 60))
  else printf '%d:%02d' $(($1 / 60)) $(($1 % 60)); fi
}

step_title() {  # of the step at work: [5/8] dev build
  printf '[%d/%d] %s' "$step_number" ${#step_names[@]} "${step_names[step_number - 1]}"
}

how_far() {  # how_far STAMP LOG...: from the newest of the logs that are no older than the stamp
  local stamp=$1 newest="" log far
  shift
  for log in $*; do  # unquoted: wildcards are for files that come while the command runs
    if [ -f "$log" ] && ! [ "$stamp" -nt "$log" ] && { [ -z "$newest" ] || [ "$log" -nt "$newest" ]; }; then newest=$log; fi
  done
  [ -n "$newest" ] || return 0
  far=$(tail -c 20000 "$newest" 2>/dev/null | grep -oE '^\[[0-9]+/[0-9]+\]( files)?|^ *[0-9]+/[0-9]+ Test' | tail -n 1) || return 0
  case $far in
    *Test) far=${far% Test}; echo "${far// /} tests" ;;
    *files) far=${far#[}; echo "${far%]*} files" ;;
    *) far=${far#[}; echo "${far%]} built" ;;
  esac
}

show_progress() {  # show_progress STAMP LOG...: until it is ended
  local start=$SECONDS text columns pause=$progress_seconds
  if $live; then pause=1; fi
  trap 'kill $! 2>/dev/null; exit 0' TERM
  while true; do
    sleep "$pause" >/dev/null 2>&1 &
    wait $!
    kill -0 $$ 2>/dev/null || return
    text="$(step_title)  $(how_far "$@")"
    text="${text%  }  $(clock $((SECONDS - start)))"
    if $live; then
      columns=$(stty size <&1 2>/dev/null | cut -d ' ' -f 2)
      [ "${columns:-0}" -gt 0 ] || columns=80
      printf '\r\e[K%s' "${text:0:columns-1}"
    else
      echo "   $text"
    fi
  done
}

watcher=""
watch_stamp=""
end_watch() {
  if [ -n "$watcher" ]; then
    kill "$watcher" 2>/dev/null || true
    wait "$watcher" 2>/dev/null || true
    watcher=""
    if $live; then printf '\r\e[K'; fi
  fi
  if [ -n "$watch_stamp" ]; then
    if $live; then cat "$watch_stamp.said"; fi
    rm -f "$watch_stamp" "$watch_stamp.said"
    watch_stamp=""
  fi
}
trap end_watch EXIT

watch() {
  local watched=() watch_status=0  # the command sees these too: no names that it uses
  while [ "$1" != -- ]; do
    watched+=("$1")
    shift
  done
  shift
  watch_stamp=$(mktemp)
  show_progress "$watch_stamp" "${watched[@]}" &
  watcher=$!
  if $live; then "$@" >"$watch_stamp.said" 2>&1 || watch_status=$?; else "$@" || watch_status=$?; fi
  end_watch
  return $watch_status
}
