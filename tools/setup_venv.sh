#!/bin/sh
# Makes or repairs ./.venv with the pinned packages of requirements.lock and this checkout, editable.
#
# Run by `make setup` from the root of the checkout; does nothing, fast, when all is up to date.
# PYTHON names the interpreter to use; it defaults to the first on PATH that is Python 3.10 or 3.11.
set -eu

VENV=.venv
STAMP=$VENV/awarenav.stamp           # what was installed, and where; written last
INCOMPLETE=$VENV/awarenav.incomplete # there while .venv is being made; left behind by an interruption
LOCK=requirements.lock

say() { printf 'setup: %s\n' "$*" >&2; }
die() { say "$*"; exit 1; }
have_uv() { command -v uv >/dev/null 2>&1; }

# Succeeds when interpreter $1 runs (a pyenv shim may exist and not run), has a supported version and
# can make a virtual environment (Debian ships ensurepip apart, in python3-venv; uv needs neither).
usable() {
    modules=sys
    have_uv || modules=sys,venv,ensurepip
    "$1" -c "import $modules; sys.exit(sys.version_info[:2] not in ((3, 10), (3, 11)))" \
        >/dev/null 2>&1
}

# Prints the first usable interpreter. Every folder of PATH is tried, not only the first hit.
find_python() {
    for name in python3.11 python3.10 python3; do
        old_ifs=$IFS
        IFS=:
        for folder in $PATH; do
            IFS=$old_ifs
            if [ -x "$folder/$name" ] && usable "$folder/$name"; then
                printf '%s\n' "$folder/$name"
                return
            fi
        done
        IFS=$old_ifs
    done
    return 1
}

choose_python() {
    if [ -n "${PYTHON:-}" ]; then
        usable "$PYTHON" || die "PYTHON=$PYTHON is not a Python 3.10 or 3.11 that runs and has the" \
            "venv module; it says: $("$PYTHON" --version 2>&1 | head -n 1)"
        command -v "$PYTHON"
    else
        find_python || die "no Python 3.10 or 3.11 with the venv module on PATH (pybullet has wheels" \
            "for these two only). Install one (Debian, Ubuntu: python3 and python3-venv), or name" \
            "it: make setup PYTHON=/path/to/python3.11"
    fi
}

minor_version() { "$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null; }

# Prints why the present .venv has to be made anew, or nothing.
fault() {
    if [ -e "$INCOMPLETE" ]; then
        echo "an earlier set-up was interrupted"
    elif ! [ -x "$VENV/bin/python" ] ||
        ! "$VENV/bin/python" -c 'import sys; sys.exit(sys.prefix == sys.base_prefix)' 2>/dev/null; then
        echo "its interpreter does not run"
    else
        version=$(minor_version "$VENV/bin/python")
        case $version in
        3.10 | 3.11)
            if [ -n "${PYTHON:-}" ] && [ "$version" != "$(minor_version "$PYTHON")" ]; then
                echo "it has Python $version and PYTHON=$PYTHON has not"
            elif [ -e "$STAMP" ] && [ "$(head -n 1 "$STAMP")" != "$PWD" ]; then
                echo "the checkout was moved or copied, and virtual environments cannot be"
            elif ! have_uv && ! "$VENV/bin/python" -c 'import pip' 2>/dev/null; then
                echo "it has no pip, and there is no uv on PATH"
            fi
            ;;
        *) echo "it has Python $version, and 3.10 or 3.11 is needed" ;;
        esac
    fi
}

# Makes .venv with interpreter $1.
make_venv() {
    say "making $VENV with $("$1" --version) ($1)"
    mkdir -p "$VENV"
    : >"$INCOMPLETE"
    if have_uv; then
        # --seed adds pip, with which the packaging tests fill their own environments.
        uv venv --quiet --allow-existing --seed --python "$1" "$VENV"
    else
        "$1" -m venv "$VENV"
    fi
}

# The lock names every package, so nothing is resolved here: --no-deps keeps it that way. pip would
# compile every module, which takes as long as all the rest; Python compiles those that it imports.
install() {
    : >"$INCOMPLETE"
    rm -f "$STAMP"
    if have_uv; then
        say "installing the pinned packages with uv"
        uv pip install --python "$VENV/bin/python" --no-deps -r "$LOCK"
        uv pip install --quiet --python "$VENV/bin/python" --no-deps --no-build-isolation -e .
    else
        say "installing the pinned packages with pip (a minute or two)"
        "$VENV/bin/python" -m pip install --disable-pip-version-check --no-input --no-deps \
            --no-compile -r "$LOCK"
        "$VENV/bin/python" -m pip install --disable-pip-version-check --no-input --quiet \
            --no-deps --no-build-isolation -e .
    fi
    printf '%s\n%s\n' "$PWD" "$(wanted)" >"$STAMP"
    rm -f "$INCOMPLETE"
    say "done"
}

wanted() { cat "$LOCK" pyproject.toml tools/setup_venv.sh | cksum; }

[ -f "$LOCK" ] && [ -f pyproject.toml ] || die "run this from the root of the checkout: make setup"
why=
if [ -e "$VENV" ] || [ -L "$VENV" ]; then
    why=$(fault)
fi
if [ -n "$why" ] || ! [ -x "$VENV/bin/python" ]; then
    python=$(choose_python) # before anything is removed
    if [ -n "$why" ]; then
        say "replacing $VENV: $why"
        rm -rf "$VENV"
    fi
    make_venv "$python"
fi
if [ ! -e "$STAMP" ] || [ "$(sed -n 2p "$STAMP")" != "$(wanted)" ]; then
    install
fi
