#!/bin/sh
# command -> its exit code, with a virtual screen of its own (software OpenGL).
#
#   sh on_screen.sh COMMAND...          (wants Xvfb)
set -eu
folder=$(mktemp -d)
screen= program=
trap 'kill $program $screen 2>/dev/null || :; rm -rf "$folder"' EXIT
trap 'exit 143' TERM INT
Xvfb -displayfd 3 -screen 0 1200x800x24 -nolisten tcp 3>"$folder/display" 2>"$folder/log" &
screen=$!
until [ -s "$folder/display" ]; do
    kill -0 $screen 2>/dev/null || { cat "$folder/log" >&2; exit 125; }
    sleep 0.1
done
DISPLAY=":$(cat "$folder/display")" LIBGL_ALWAYS_SOFTWARE=1 "$@" &
program=$!
wait $program
