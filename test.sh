#!/usr/bin/env bash
# Runs the tests with every supported Python that this machine has. Arguments go to pytest.
set -euo pipefail
source "$(dirname "$0")/tools/environment.sh"

versions=$(available_pythons)
if [ -z "$versions" ]; then
    echo "Python 3.11 or 3.13 is needed: Blender exists as a module for these two." >&2
    exit 1
fi
cd "$root"
status=0
for version in $versions; do
    make_environment "$version" "blender test"
    echo "Tests with Python $version"
    "$python" -m pytest "$@" || status=$?
done
exit $status
