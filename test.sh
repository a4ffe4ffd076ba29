#!/usr/bin/env bash
# Runs the tests with every supported Python that this machine has: ./test.sh [--deep] [arguments of pytest].
#
# The newest Python runs everything, an older one the tests that touch Blender; with --deep both run everything, and
# the cases marked `deep` as well. Kernels are compiled first, by all Pythons at once; tests follow as soon as theirs are
# there. Where pytest is given arguments each Python runs what they say, in one process.
set -euo pipefail
source "$(dirname "$0")/tools/environment.sh"

deep=()
if [ "${1:-}" = "--deep" ]; then
    deep=(--deep)
    shift
fi
versions=($(available_pythons))
if [ ${#versions[@]} = 0 ]; then
    echo "Python 3.11 or 3.13 is needed: Blender exists as a module for these two." >&2
    exit 1
fi
cd "$root"
pythons=()
for version in "${versions[@]}"; do
    make_environment "$version" "blender test"
    pythons+=("$python")
done
newest=${versions[-1]}
status=0

if [ $# != 0 ]; then
    for i in "${!versions[@]}"; do
        echo "Tests with Python ${versions[i]}"
        "${pythons[i]}" -m pytest "${deep[@]}" "$@" || status=$?
    done
    exit $status
fi

cores=$(nproc)
share=$((cores / ${#versions[@]} > 0 ? cores / ${#versions[@]} : 1))
jobs=()
for i in "${!versions[@]}"; do
    needed=()
    [ "${versions[i]}" = "$newest" ] || [ ${#deep[@]} != 0 ] || needed=(--blender)
    "${pythons[i]}" -m testing.compile --processes "$share" "${needed[@]}" | sed "s/^/Python ${versions[i]}: /" &
    jobs+=($!)
done

for i in "${!versions[@]}"; do
    wait "${jobs[i]}" || status=$?
    parts=()
    [ "${versions[i]}" = "$newest" ] || [ ${#deep[@]} != 0 ] || parts=(tests/blender tests/images)
    echo "Tests with Python ${versions[i]}"
    "${pythons[i]}" -m pytest -n "$cores" --durations=20 "${deep[@]}" "${parts[@]}" || status=$?
done
exit $status
