#!/usr/bin/env bash
# The zip in a real Blender: validate, install, render without and with a window, disable, enable, open another file.
#
#     tests/desktop/check.sh 3.14
#
# The argument is the Python of that Blender. BLENDER and BLENDER_WINDOW say how to start it without and with a
# screen (default: blender); both run in the repository's folder. Pictures and screenshots are written to out/desktop.
set -euo pipefail
cd "$(dirname "$0")/../.."
python_version=${1:?the Python version of Blender, for example 3.13}
blender=${BLENDER:-blender} window=${BLENDER_WINDOW:-${BLENDER:-blender}}
out=out/desktop
rm -rf $out && mkdir -p $out

step() { printf '\n== %s\n' "$1"; }
images() { ls $out/$1 >/dev/null && echo "written: $(ls $out/$1 | xargs -n 1 basename | tr '\n' ' ')"; }

step "Build"
python -m tools.build --python "$python_version" --out $out
zip=$(ls $out/*.zip)

step "Validate"
$blender --command extension validate "$zip"

step "Install and enable"
$blender --command extension install-file --repo user_default --enable "$zip"

step "A scene switched from Cycles"
$blender -b --python-exit-code 1 --python tests/desktop/make_scene.py -- $out/scene.blend

step "One frame and an animation from the command line"
$blender -b $out/scene.blend -E RESTIR -o //out_ -f 1
images 'out_0001.png'
$blender -b $out/scene.blend -E RESTIR -o //anim_ -s 1 -e 3 -a
images 'anim_000?.png'

step "An animation of which one frame fails"
no_camera="import bpy
camera = bpy.context.scene.camera
def change(scene, *_): scene.camera = None if scene.frame_current == 2 else camera
bpy.app.handlers.render_pre.append(change)"
if $blender -b $out/scene.blend -E RESTIR --python-expr "$no_camera" -o //failed_ -s 1 -e 3 -a >$out/failed.txt 2>&1
then echo "no exit code tells of the failure" && exit 1; fi
tail -n 1 $out/failed.txt | grep '^ReSTIR: .*frame 2 failed$'
images 'failed_000[13].png' && test ! -e $out/failed_0002.png

step "Commands of a farm"
for command in restir_farm restir_merge; do $blender --background --command $command --help | head -1; done

step "Disable, enable, open another file, register twice"
$blender -b --python-exit-code 1 --python tests/desktop/reenable.py -- $out/scene.blend

step "In the window"
$window --python-exit-code 1 --python tests/desktop/window.py -- $out
for name in engines rendering rendered escaped tab_material shader_editor viewport_path viewport_restir viewport_restir_turned disabled; do images $name.png; done
grep . $out/window.txt
grep -q '^finished$' $out/window.txt

step "What rendered 3D views show, and a soak of ${SOAK:=20} s"
$window --python-exit-code 1 --python tests/desktop/views.py -- $out
images 'border.png' && images 'camera_*.png' && images 'local_view.png' && images 'two_views.png'
grep . $out/views.txt
grep -q '^finished$' $out/views.txt
$window --python-exit-code 1 --python tests/desktop/soak.py -- $out --seconds "$SOAK"
grep . $out/soak.txt
grep -q '^finished$' $out/soak.txt
