#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# check.sh GRABBER PLUGIN SIMULATE
set -euo pipefail
grabber=$1 plugin=$2 simulate=$3
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"

settings="World.name=sculpture Camera.width=96 Camera.height=72 Camera.f=80 Trajectory.views=6 Noise.level=N4"
sets=()
{
    printf '[global]\nrawlog_prefix = grabbed\ntime_between_launches = 0\nSF_max_time_span = 0.05\n'
    printf 'use_sensoryframes = 0\nGRABBER_PERIOD_MS = 50\n'
    printf '[CAM]\ndriver = SimulatedStereoSensor\nsensorLabel = stereo\nprocess_rate = 50\nseed = 3\n'
    for setting in $settings; do
        echo "${setting/=/ = }"
    done
} > grabber.ini
for setting in $settings; do sets+=(--set "$setting"); done

"$simulate" "${sets[@]}" --seed 3 --no-progress --out simulated.rawlog
# It stops at a key press, and takes a closed stdin for one.
sleep 6 | "$grabber" -p "$plugin" grabber.ini > log 2>&1 || { cat log; exit 1; }

images() { find "$1" -name '*.png' -exec sha256sum {} + | cut -d' ' -f1 | sort; }
images simulated_Images > expected
images grabbed_*_Images > actual
[ "$(wc -l < expected)" = 12 ]
diff expected actual || { cat log; exit 1; }

rawlog-edit -i grabbed_*.rawlog --info > info
grep -E 'pose +/ +6 ' info
grep -E 'stereo +/ +6 ' info
