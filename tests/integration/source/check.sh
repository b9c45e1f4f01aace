#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# check.sh NAME: looks at the sources of the repository that it is started in, prints a line a
# finding, and fails if there is any.
set -euo pipefail

if ! git rev-parse --is-inside-work-tree >/dev/null 2>&1; then
    echo "SKIPPED: not a git work tree, so it is not known what belongs to the sources"
    exit 77
fi

files() { git ls-files --cached --others --exclude-standard -- "$@" | while read -r f; do [ ! -f "$f" ] || echo "$f"; done; }

# clang-format-14 changes nothing.
check_format() {
    command -v clang-format-14 >/dev/null || {
        echo "clang-format-14 is not installed"
        return
    }
    files '*.cpp' '*.h' | xargs clang-format-14 --dry-run 2>&1 | grep 'warning:' |
        sed 's/warning:.*/not formatted; .\/run format does it/' | sort -u
}

# The first line, or the second after #!, names the licence.
check_headers() {
    files '*.cpp' '*.h' '*.in' '*.cmake' '*CMakeLists.txt' '*.sh' '*.ini' run .ci .clang-tidy |
        while read -r f; do
            head -n 2 "$f" | grep -q 'SPDX-License-Identifier: BSD-3-Clause' || echo "$f: no SPDX line"
        done
}

# A library includes itself and those before it: core < stereo < graph < {maps, planner};
# core < sim; {graph, sim} < eval; all < apps.
check_layering() {
    local allowed='core:core
stereo:core|stereo
graph:core|stereo|graph
maps:core|stereo|graph|maps
planner:core|stereo|graph|planner
sim:core|sim
eval:core|stereo|graph|sim|eval
apps:core|stereo|graph|maps|planner|sim|eval|apps' library may
    while IFS=: read -r library may; do
        files "libs/$library" | { xargs -r grep -nE '^ *# *include +[<"]riftmap/' || true; } |
            { grep -vE "[<\"]riftmap/($may)/" || true; } | sed "s/$/  <- libs\/$library may not use that/"
    done <<<"$allowed"
    files libs/*/include | { xargs grep -nE '#include "\.' || true; } | sed 's/$/  <- include by full name/'
    files 'apps/*.cpp' | { xargs -r grep -nE '#include "riftmap/(core|stereo|graph|maps|planner|sim|eval)/' || true; } |
        sed 's/$/  <- a program uses libs\/apps alone/'
}

# Nothing of the machine it was written on.
check_local_paths() {
    files | xargs grep -nIE '(^|[^A-Za-z0-9_.])/(work|home|root)/' || true
}

# A file says one thing; main.cpp says next to nothing.
check_length() {
    files '*.cpp' '*.h' | while read -r f; do
        [ "$(wc -l <"$f")" -le 600 ] || echo "$f: more than 600 lines"
    done
    files 'apps/*/main.cpp' | while read -r f; do
        [ "$(wc -l <"$f")" -le 40 ] || echo "$f: more than 40 lines"
    done
}

# One version everywhere.
check_version() {
    local version
    version=$(sed -n 's/^  VERSION \([0-9.]*\)$/\1/p' CMakeLists.txt)
    [ -n "$version" ] || echo "CMakeLists.txt: no version"
    grep -q "^version: $version$" CITATION.cff || echo "CITATION.cff: not version $version"
    grep -qE "^## \[($version|Unreleased)\]" CHANGELOG.md || echo "CHANGELOG.md: no heading for $version"
}

found=$("check_$1" || true)
[ -z "$found" ] || {
    printf '%s\n' "$found"
    exit 1
}
