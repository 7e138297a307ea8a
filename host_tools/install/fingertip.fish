# Completion of the fingertip command for fish, from its own help.
complete -c fingertip -n __fish_use_subcommand -f \
  -a "(fingertip --help | sed -n '/^Subcommands:/,\$s/^  \([a-z]*\) .*/\1/p')"
complete -c fingertip -n 'not __fish_use_subcommand' -l device -x -a "(fingertip list 2> /dev/null | cut -f 1)"
for side in left right
  complete -c fingertip -n 'not __fish_use_subcommand' -l $side -x -a "(fingertip list 2> /dev/null | cut -f 1)"
end
complete -c fingertip -n 'not __fish_use_subcommand' -l gripper -x -a "(fingertip gripper list 2> /dev/null | sed -n '2,/^\$/p' | cut -f 1)"
complete -c fingertip -n 'not __fish_use_subcommand' -l transport -x -a 'auto socket serial usb'
complete -c fingertip -n 'not __fish_use_subcommand' -l unit -x -a 'Pa hPa kPa mbar bar psi mmHg'
complete -c fingertip -n '__fish_seen_subcommand_from gripper' -f -a 'list info move open close'
complete -c fingertip -n '__fish_seen_subcommand_from gripper' -l model -x -a "(fingertip gripper list 2> /dev/null | sed -n '2,/^\$/p' | cut -f 1)"
complete -c fingertip -n 'not __fish_use_subcommand' -n 'string match -q -- "-*" (commandline -ct)' \
  -a "(fingertip (commandline -opc)[2] --help 2> /dev/null | grep -o -- '--[a-z][a-z-]*')"
