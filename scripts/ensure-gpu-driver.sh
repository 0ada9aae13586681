#!/bin/sh
# Sees to it that the 3D views have a driver: a Vulkan one that is there (Debian's GL drivers may lack float targets), or
# Debian's software driver when root or a passwordless sudo lets us install it. Never fails: without a driver everything but the views is still made.

has_driver() {
    for folder in /usr/share/vulkan/icd.d /etc/vulkan/icd.d; do
        for file in "$folder"/*.json; do
            [ -e "$file" ] && return 0
        done
    done
    return 1
}

[ "$(uname -s)" = Linux ] || exit 0
has_driver && exit 0

run=none
if command -v apt-get >/dev/null 2>&1; then
    if [ "$(id -u)" = 0 ]; then
        run=
    elif command -v sudo >/dev/null 2>&1 && sudo -n true 2>/dev/null; then
        run='sudo -n'
    fi
fi
if [ "$run" != none ]; then
    echo "no Vulkan driver: installing mesa-vulkan-drivers for the 3D views" >&2
    limit=
    command -v timeout >/dev/null 2>&1 && limit='timeout 180'
    # the variables hold words, not names: they are meant to be split
    $run env DEBIAN_FRONTEND=noninteractive $limit apt-get -qq -o DPkg::Lock::Timeout=60 update >/dev/null 2>&1
    $run env DEBIAN_FRONTEND=noninteractive $limit apt-get -qq -y -o DPkg::Lock::Timeout=60 install --no-install-recommends \
        mesa-vulkan-drivers libvulkan1 >/dev/null 2>&1
fi
has_driver || echo "no Vulkan driver: 3D views may be missing (install mesa-vulkan-drivers to have them)" >&2
exit 0
