#!/usr/bin/env bash
# Renders the demo scene to translucent.png. Options: --samples 256, --size 960x640, --scene still-life, --output FILE.
set -euo pipefail
source "$(dirname "$0")/tools/environment.sh"

version=$(available_pythons | tail -n 1)
if [ -z "$version" ]; then
    echo "Python 3.11 or 3.13 is needed: Blender exists as a module for these two." >&2
    exit 1
fi
make_environment "$version" blender
cd "$root" && exec "$python" -m demo "$@"
