#!/bin/sh
# The first process of a small machine of its own, in new namespaces: installs the program, its service and a robot the
# way the unit file says, and becomes systemd. Whatever it writes is in memory, and gone with the machine.
#
# boot.sh LAYER PROGRAM UNIT ROBOT DEVICE...: an empty folder for the layer that is written to, the program, the unit
# file, the folder that becomes /etc/hippocamp, and the robot's serial devices.
set -eu
layer=$1 program=$2 unit=$3 robot=$4
shift 4

mount --make-rprivate /
mount -t tmpfs tmpfs "$layer"
mkdir "$layer/upper" "$layer/work" "$layer/root"
mount -t overlay overlay -o "lowerdir=/,upperdir=$layer/upper,workdir=$layer/work" "$layer/root"
cd "$layer/root"
mkdir -p etc/hippocamp etc/systemd/system usr/local/bin root/host
cp "$robot"/* etc/hippocamp
cp "$unit" root
: > usr/local/bin/hippocamp
mount --bind "$program" usr/local/bin/hippocamp
mount --rbind /dev dev
mount --rbind /sys sys
mount -t proc proc proc
mount -t tmpfs tmpfs run
mount -t tmpfs tmpfs tmp
mount -t cgroup2 cgroup2 sys/fs/cgroup
pivot_root . root/host
umount --lazy /root/host
cd /root

for group in dialout input; do getent group "$group" > /dev/null || groupadd --system "$group"; done
sed -n 's/^# *sudo \(useradd\|install\)/\1/p' "${unit##*/}" > install.sh
sh -eu install.sh
for device in "$@"; do chgrp dialout "$device"; chmod 660 "$device"; done

# Units that every service has behind it, and nothing else of this system's.
for target in boot sysinit basic shutdown; do
    printf '[Unit]\nDefaultDependencies=no\n' > "/etc/systemd/system/$target.target"
done
exec env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin container=hippocamp SYSTEMD_UNIT_PATH=/etc/systemd/system \
    SYSTEMD_LOG_TARGET=console /lib/systemd/systemd --system --unit=boot.target
