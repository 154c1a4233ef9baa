#!/bin/sh
# Installs the Debian packages that jostle builds and tests with, those that are missing only. Quiet when none is.
set -eu
packages="gcc g++ make git pkg-config libc6-dev liblcm-dev liblcm-bin libode-dev libbox2d-dev libcmocka-dev \
libjansson-dev libassimp-dev libqhull-dev libosmesa6-dev libpng-dev ffmpeg python3-venv python3-pip iproute2"
missing=""
for p in $packages; do
    case "$(dpkg-query -W -f='${db:Status-Abbrev}' "$p" 2>/dev/null || true)" in
    ii*) ;;
    *) missing="$missing $p" ;;
    esac
done
[ -z "$missing" ] && exit 0
install="apt-get install -y --no-install-recommends$missing"
if [ "$(id -u)" = 0 ]; then
    as_root=""
elif command -v sudo >/dev/null 2>&1 && sudo -n true 2>/dev/null; then
    as_root="sudo"
else
    echo "jostle needs packages that are not installed. As root, run:" >&2
    echo "  apt-get update && $install" >&2
    exit 1
fi
echo "installing:$missing"
export DEBIAN_FRONTEND=noninteractive
$as_root apt-get update -qq
# shellcheck disable=SC2086
$as_root env DEBIAN_FRONTEND=noninteractive $install >/dev/null
