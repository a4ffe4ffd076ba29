# Sourced by demo.sh and test.sh: finds Python, makes .venv-311 or .venv-313 and installs what is needed, once.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
system_packages="libxrender1 libxi6 libxkbcommon0 libsm6 libgl1 libxfixes3"

# find_python 3.11: the path of a Python of that version, or nothing.
find_python() {
    local candidate
    for candidate in "python$1" python3 "${PYENV_ROOT:-$HOME/.pyenv}/versions/$1".*/bin/python; do
        if "$candidate" -c "import sys; sys.exit('%d.%d' % sys.version_info[:2] != '$1')" 2>/dev/null; then
            "$candidate" -c 'import sys; print(sys.executable)'
            return
        fi
    done
}

# available_pythons: those of the supported versions that this machine has.
available_pythons() {
    local version
    for version in 3.11 3.13; do
        [ -z "$(find_python $version)" ] || echo $version
    done
}

# make_environment 3.11 "blender test": installs the project's dependencies with these extras into a virtual
# environment; sets $python to its Python.
make_environment() {
    local version=$1 extras=$2 folder="$root/.venv-${1/./}" base wanted
    base=$(find_python "$version")
    python="$folder/bin/python"
    if [ ! -x "$folder/bin/pip" ]; then
        echo "Making $(basename "$folder") with Python $version"
        rm -rf "$folder"
        if ! "$base" -m venv "$folder"; then
            rm -rf "$folder"
            echo "Python $version cannot make virtual environments. On Debian: apt install python$version-venv" >&2
            return 1
        fi
    fi
    wanted=$("$python" - "$root/pyproject.toml" $extras <<'PYTHON'
import sys
import tomllib

with open(sys.argv[1], "rb") as file:
    project = tomllib.load(file)["project"]
print("\n".join([*project["dependencies"], *(item for name in sys.argv[2:] for item in project["optional-dependencies"][name])]))
PYTHON
    )
    if ! grep -qxF -f <(echo "$wanted") "$folder/installed" 2>/dev/null ||
        [ -n "$(echo "$wanted" | grep -vxF -f "$folder/installed")" ]; then
        echo "Installing packages for Python $version (Blender as a module is a download of some 350 MB)"
        "$python" -m pip install --quiet --disable-pip-version-check -r <(echo "$wanted")
        echo "$wanted" >>"$folder/installed"
    fi
    check_system_libraries
}

# Blender needs some libraries of a desktop even where there is no screen.
check_system_libraries() {
    local missing
    "$python" -c 'import os, bpy; os._exit(0)' 2>/dev/null && return
    missing=$(ldd "$("$python" -c 'import importlib.util as u; print(u.find_spec("bpy").origin)')" | awk '/not found/ {print $1}' | sort -u)
    echo "Blender cannot be loaded${missing:+; missing: $(echo $missing)}." >&2
    echo "On Debian: apt install $system_packages" >&2
    return 1
}
