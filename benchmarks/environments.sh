#!/usr/bin/env bash
# Makes the peers' environments beside Glisson's own: .venv-bench, and .venv-dolfinx where there is a Python for it.
# What cannot be made is told and left out: the benchmark then has a row with the reason.
# PYTHON is the Python of .venv-bench, DOLFINX_PYTHON (3.12 or newer) that of .venv-dolfinx, UV the program uv.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
uv=${UV:-.venv/bin/uv}

make_environment() { # FOLDER PYTHON REQUIREMENTS
    if [ "$1/.ready" -nt "$3" ]; then return; fi
    echo "== making $1 from $3 (once)"
    rm -rf "$1"
    if "$uv" venv --quiet --python "$2" "$1" && "$uv" pip install --quiet --python "$1/bin/python" -r "$3"; then
        touch "$1/.ready"
    else
        rm -rf "$1"
        echo "$1 could not be made; its engines are left out"
    fi
}

python_for_dolfinx() {
    local python
    for python in "${DOLFINX_PYTHON:-}" python3.14 python3.13 python3.12 "${PYTHON:-python3}" \
        "$HOME"/.pyenv/versions/3.1[2-4]*/bin/python3 "$HOME"/.local/share/uv/python/*/bin/python3; do
        if [ -n "$python" ] && "$python" -c 'import sys; sys.exit(not (3, 12) <= sys.version_info < (3, 15))' 2>/dev/null
        then
            "$python" -c 'import sys; print(sys.executable)'
            return
        fi
    done
}

make_environment .venv-bench "${PYTHON:-python3}" benchmarks/requirements.txt

found=$(python_for_dolfinx)
if [ -n "$found" ]; then
    make_environment .venv-dolfinx "$found" benchmarks/requirements-dolfinx.txt
else
    echo "DOLFINx needs Python 3.12 to 3.14, of which none was found; name one with DOLFINX_PYTHON"
fi

if ! command -v ccx >/dev/null; then
    echo "CalculiX (ccx) is not installed; on Debian or Ubuntu: apt install calculix-ccx"
fi
if ! command -v cc >/dev/null; then
    echo "DOLFINx needs a C compiler (cc), which is not installed"
fi
