#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# check.sh readme|loads SOURCE BIN
set -euo pipefail
check=$1 source=$2 bin=$3

# config/README.md says what the programs say.
check_readme() {
    diff -u "$source/config/README.md" <("$source/.ci/config-readme" "$bin") || {
        echo "config/README.md is out of date: ./run format renews it"
        return 1
    }
}

# Every INI file is one that some program takes; that for MRPT's observations2map is tried by the tests in mrpt/.
check_loads() {
    local ini program taken failed=0
    while read -r ini; do
        taken=no
        for program in "$bin"/riftmap-*; do
            if "$program" "$ini" --dump-config >/dev/null 2>&1; then
                taken=yes
                break
            fi
        done
        if [ $taken = no ]; then
            failed=1
            echo "$ini: no program takes it:"
            for program in "$bin"/riftmap-*; do "$program" "$ini" --dump-config 2>&1 >/dev/null || true; done
        fi
    done < <(find "$source/config" -name '*.ini' ! -name observations2map.ini | sort)
    return $failed
}

"check_$check"
