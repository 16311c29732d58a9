"""A stand-in for gatewayd, quick enough to be asked hundreds of times: four commands and their exit codes.

A mapping is one line, and its fingerprint is its checksum. `bad` has errors, `refused` is not reloaded, and no gateway
answers while the file `down` is there. What it would run is in `running`.
"""

from __future__ import annotations

GATEWAYD = """#!/bin/sh
state=$STATE_DIRECTORY
print() { # FILE INDENT
    printf '%s"%s": "press",\\n%s"fingerprint": "%s",\\n' "$2" "$3" "$2" "$(cksum <"$1" | cut -d' ' -f1)"
}
case $1 in
    check) ! grep -qrx bad "$2" ;;
    show) print "$4" '  ' cell ;;
    status) [ -e "$state/down" ] || ! [ -e "$state/running" ] || print "$state/running" '      ' name ;;
    reload)
        [ ! -e "$state/down" ] || exit 2
        ! grep -qx refused "$state/current/press.yaml" || exit 1
        cp "$state/current/press.yaml" "$state/running"
        echo reloaded
        ;;
esac
"""
