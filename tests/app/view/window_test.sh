#!/usr/bin/env bash
# window_test.sh PROGRAM: drives `morphray view` under a virtual screen. Fails with a line that says
# what was wrong. Needs Xvfb and xdotool.
set -euo pipefail
program=$1
scratch=$(mktemp -d)
screen='' viewer=''
finish() {
    for process in $viewer $screen; do kill "$process" 2>/dev/null || true; done
    wait 2>/dev/null || true
    rm -rf "$scratch"
}
trap finish EXIT
fail() {
    printf 'view: %s\n' "$*" >&2
    [ ! -s "$scratch/err" ] || cat "$scratch/err" >&2
    exit 1
}
cd "$scratch"

# A screen of our own, on the first number that is free. It stays when its last window closes:
# otherwise it starts again then, and takes no connection meanwhile.
mkfifo number
Xvfb -displayfd 3 -noreset -screen 0 1400x900x24 -nolisten tcp 3>number 2>/dev/null &
screen=$!
read -r display <number || fail "Xvfb did not start"
export DISPLAY=:$display
unset WAYLAND_DISPLAY

# pixels FILE: the chunks of a PNG file that hold its pixels.
pixels() {
    python3 - "$1" <<'END'
import struct, sys
data, at = open(sys.argv[1], "rb").read(), 8
while at < len(data):
    size, kind = struct.unpack_from(">I4s", data, at)
    if kind in (b"IHDR", b"IDAT"): sys.stdout.buffer.write(data[at + 8:at + 8 + size])
    at += size + 12
END
}
# same_as_render NAME ARGS...: --screenshot writes the pixels of render.
same_as_render() {
    local name=$1
    shift
    "$program" view "$@" --screenshot "$name.png" || fail "$name: exit code $?"
    "$program" render "${@/--frame/--frames}" --out "$name.expected.png" --quiet
    pixels "$name.expected.png" >expected && pixels "$name.png" >actual && [ -s actual ] ||
        fail "$name: no pixels"
    cmp expected actual >out || fail "$name: $(cat out)"
}
scene=builtin:cloth:3000
same_as_render lit $scene --frame 8 --size 160x120 --backend cpu
same_as_render plain $scene --frame 3.5 --size 160x120 --backend cpu --rays shadow
same_as_render ground $scene --frame 5 --size 97x61 --backend cpu --ground on --flat --samples 16 \
    --eye 3,2,4 --light 5,5,5 --ao-samples 3
for shading in normal depth prim; do
    same_as_render $shading $scene --frame 9 --size 64x48 --backend cpu --shading $shading
done
# A Wayland desktop with XWayland gets a window of X11.
export XDG_SESSION_TYPE=wayland WAYLAND_DISPLAY=no-such-display
same_as_render wayland $scene --frame 8 --size 64x48 --backend cpu
unset XDG_SESSION_TYPE WAYLAND_DISPLAY
if "$program" devices >/dev/null 2>&1; then
    same_as_render vulkan $scene --frame 8 --size 80x60 --backend vulkan --samples 1
fi

# start ARGS...: a viewer that input can reach.
start() {
    "$program" view "$@" >out 2>err &
    viewer=$!
    local _
    for _ in $(seq 300); do
        kill -0 $viewer 2>/dev/null || fail "ended at once"
        window=$(xdotool search --onlyvisible --name 'morphray view' 2>/dev/null | head -n 1) || true
        [ -z "$window" ] || break
        sleep 0.1
    done
    [ -n "$window" ] || fail "no window"
    xdotool windowfocus "$window" mousemove --window "$window" 200 150
    # Keys that come before the first frame would be lost.
    sleep 1
}
# press KEY...: each for long enough that a frame sees it.
press() {
    local key
    for key in "$@"; do
        kill -0 $viewer 2>/dev/null || fail "ended before key $key"
        xdotool keydown "$key"
        sleep 0.15
        xdotool keyup "$key"
        sleep 0.1
    done
}
# drag BUTTON DX DY
drag() {
    xdotool mousedown "$1"
    sleep 0.15
    xdotool mousemove_relative -- "$2" "$3"
    sleep 0.15
    xdotool mouseup "$1"
    sleep 0.15
}
# ends CODE: the viewer ends by itself with this exit code.
ends() {
    local code=0
    timeout 120 tail --pid=$viewer -f /dev/null || fail "does not end"
    wait $viewer || code=$?
    viewer=''
    [ $code = "$1" ] || fail "exit code $code instead of $1"
}
# Scrubs, orbits, pans, zooms, plays, clicks; both backends and their difference; resized while tracing.
start $scene --size 320x240 --backend cpu --samples 4
press Right Right Left space space
drag 1 40 25
drag 3 -15 10
xdotool click 4
press 2 1 b b r
xdotool click 1
for key in v m m v; do
    press $key
    xdotool click 1
done
for size in '700 500' '900 700' '640 400'; do
    # shellcheck disable=SC2086  # two numbers
    xdotool windowsize "$window" $size
    sleep 0.1
done
press 6 7 3 space
sleep 0.5
xdotool keydown ctrl key q keyup ctrl
ends 0

# Ends while it traces an image that takes long, and at a signal.
start builtin:cloth:60000 --size 1000x700 --backend cpu --ao-samples 64
xdotool keydown ctrl key q keyup ctrl
ends 0
start builtin:cloth:60000 --size 1000x700 --backend cpu --ao-samples 64
kill -TERM $viewer
ends 143

# Ends while it builds a tree, which takes half a minute, before there is an image.
start builtin:soup:4000000 --size 320x240 --backend cpu --threads 1
xdotool keydown ctrl key q keyup ctrl
ends 0

# Without a screen it says what it needs.
code=0
env -u DISPLAY "$program" view $scene >out 2>err || code=$?
[ $code = 4 ] || fail "without a screen: exit code $code"
grep -q 'X11 display' err || fail "without a screen: $(cat err)"
