# Completion of the fingertip command for bash, from its own help.
_fingertip() {
  local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} words
  if [ "$COMP_CWORD" -eq 1 ]; then
    words=$(fingertip --help | sed -n '/^Subcommands:/,$s/^  \([a-z]*\) .*/\1/p')
  else
    case $before in
      --device|--left|--right) words=$(fingertip list 2> /dev/null | cut -f 1) ;;
      --transport) words='auto socket serial usb' ;;
      --gripper|--model) words=$(fingertip gripper list 2> /dev/null | sed -n '2,/^$/p' | cut -f 1) ;;
      --colour) words='auto truecolour 256 plain' ;;
      --unit) words='Pa hPa kPa mbar bar psi mmHg' ;;
      gripper) [ "$COMP_CWORD" -eq 2 ] && words='list info move open close' ;;
    esac
    if [ -z "$words" ] && [ "${current#-}" != "$current" ]; then
      words=$(fingertip "${COMP_WORDS[1]}" --help 2> /dev/null | grep -o -- '--[a-z][a-z-]*')
    fi
  fi
  COMPREPLY=($(compgen -W "$words" -- "$current"))
}
complete -o default -F _fingertip fingertip
