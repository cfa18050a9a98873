#!/bin/sh
# FOLDER -> a real Blender in it.  Debian's own build, with the Python modules it wants.
#
#   sh real_blender.sh FOLDER           (as root on a Debian; 1 GB, about 3 minutes, once)
#   FOLDER/enter blender --background --version
#
# The folder is a small Debian of its own, so the machine's libraries stay as they are.  `enter`
# shows it /tmp and the current folder at their own paths; its mounts vanish with the command.
set -eu
folder=${1:?usage: real_blender.sh FOLDER}
packages="blender python3-numpy python3-cattr python3-requests python3-zstandard
    python3-openimageio libegl1 libgl1 libgl1-mesa-dri xvfb xdotool imagemagick"
stamp="sid $(echo $packages)"

if [ "$(cat "$folder/.complete" 2>/dev/null)" != "$stamp" ]; then
    [ "$(id -u)" = 0 ] && [ -r /etc/debian_version ] ||
        { echo "a real Blender can be set up here only by root on a Debian" >&2; exit 2; }
    mirror=$(grep -rhoE 'https?://[^ ]+/debian/?( |$)' /etc/apt/sources.list* | head -n 1)
    [ -n "$mirror" ] || { echo "no Debian mirror in /etc/apt/sources.list*" >&2; exit 2; }
    if [ -e "$folder" ] && [ ! -e "$folder/.real-blender" ]; then
        echo "$folder exists and was not made by this script" >&2; exit 2
    fi
    command -v debootstrap >/dev/null ||
        { apt-get update -q; apt-get install -qy --no-install-recommends debootstrap; }

    # A minimal Debian; one that was interrupted is thrown away.
    rm -rf --one-file-system "$folder"
    mkdir -p "$folder" && touch "$folder/.real-blender"
    debootstrap --variant=minbase sid "$folder" ${mirror%% *}
    cp -L /etc/resolv.conf "$folder/etc/resolv.conf"
    # Mirrors may be a few weeks old, which apt would hold against them.
    echo 'Acquire::Check-Valid-Until "false"; Acquire::Retries "3";' \
        >"$folder/etc/apt/apt.conf.d/90real-blender"
    printf 'path-exclude /usr/share/%s/*\n' doc man >"$folder/etc/dpkg/dpkg.cfg.d/90real-blender"

    cat >"$folder/enter" <<'ENTER'
#!/bin/sh
root=$(cd "$(dirname "$0")" && pwd)
exec unshare --mount --propagation private sh -c '
    root=$1; shift
    for each in /proc /sys /dev; do mount --rbind "$each" "$root$each" || exit 125; done
    for each in /tmp "$PWD"; do
        case $each in /|/usr*|/etc*|/bin*|/lib*|/var*|/proc*|/sys*|/dev*) continue ;; esac
        mkdir -p "$root$each" && mount --rbind "$each" "$root$each" || exit 125
    done
    exec chroot "$root" sh -c "cd \"\$0\" && exec \"\$@\"" "$PWD" "$@"
' sh "$root" "$@"
ENTER
    chmod 755 "$folder/enter"

    # Blender in it.
    (
        cd /tmp
        export DEBIAN_FRONTEND=noninteractive
        "$folder/enter" apt-get update -q
        "$folder/enter" apt-get install -qy --no-install-recommends $packages
        "$folder/enter" apt-get clean
    )
    echo "$stamp" >"$folder/.complete"
fi
cd /tmp && "$folder/enter" blender --background --version | head -n 1
