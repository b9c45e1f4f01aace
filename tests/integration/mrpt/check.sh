#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# check.sh observations2map|rawlog-edit SOURCE BIN LIBRIFTMAP_MAPS
set -euo pipefail
check=$1 source=$2 bin=$3 library=$4
command -v "$check" >/dev/null || { echo "SKIPPED: no $check here (Debian's mrpt-apps)"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# Our map, made by a program that has never heard of it, is the one riftmap-build makes.
check_observations2map() {
    "$bin/riftmap-build" "$source/config/build.ini" "$source/rawlogs/step.rawlog" --out run --no-progress >/dev/null
    LD_PRELOAD=$library observations2map "$source/config/observations2map.ini" run/keyframes.simplemap out >log 2>&1 ||
        { cat log; return 1; }
    ls -l out_riftmap__PixelGraphMap_00.{ply,3Dscene,pixelgraph}
    "$bin/riftmap-info" out_riftmap__PixelGraphMap_00.pixelgraph --compare run/map.pixelgraph | tee comparison
    grep -qx 'only_in_a: 0' comparison
    grep -qx 'only_in_b: 0' comparison
    ! grep -qx 'vertices_a: 0' comparison
}

check_rawlog-edit() {
    # rawlog-edit finds no external images beside a rawlog in another folder; ours are inside.
    rawlog-edit -i "$source/rawlogs/step.rawlog" --info | tee info
    grep -q 'Observations format *: Yes' info
    grep -Eq 'stereo */ *3 */' info
    # What it cuts out, we read.
    rawlog-edit -i "$source/rawlogs/step.rawlog" -o half.rawlog --cut --from-index 0 --to-index 4 -q -w
    "$bin/riftmap-info" half.rawlog | tee described
    grep -qx 'stereo_stereo_pairs: 2' described
    grep -qx 'damage: none' described
}

"check_$check"
