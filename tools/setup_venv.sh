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
LOG=$VENV/setup.log                  # all that pip or uv says
FAILED=$VENV/setup.failed            # the exit status of a command that failed
SIZE="600 MB to download, 1.8 GB on disk" # with Python 3.11 on x86-64

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
            "for these two only). With uv, which needs no other Python (pipx install uv):" \
            "uv python install 3.11 && make setup PYTHON=\"\$(uv python find 3.11)\""
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

# Prints the number of packages that the lock holds for the interpreter of .venv; without pip's
# parser of markers, the number that it holds for all.
packages() {
    "$VENV/bin/python" - "$LOCK" 2>/dev/null <<'END' ||
import sys
from pip._vendor.packaging.requirements import Requirement

lines = [line.partition("#")[0].strip() for line in open(sys.argv[1], encoding="utf-8")]
pins = [Requirement(line) for line in lines if line]
print(sum(pin.marker is None or pin.marker.evaluate() for pin in pins))
END
        sed -n 's/^\([A-Za-z0-9._-]*\) *[=@].*/\1/p' "$LOCK" | sort -u | wc -l
}

# Shows how far an installer is, from its output: one line that changes on a terminal, else one line
# for each third of the $1 packages.
show_progress() {
    fetched=0
    while IFS= read -r line; do
        printf '%s\n' "$line" >>"$LOG"
        case $line in
        "Collecting "* | "Processing "*) # pip, once a package; the second for files on this machine
            fetched=$((fetched + 1))
            name=${line#* }
            name=${name%% *}
            name=${name##*/}
            if [ -t 2 ]; then
                printf '\r\033[Ksetup: package %s of %s: %s' "$fetched" "$1" "$name" >&2
            elif [ $((fetched * 3 / $1)) != $(((fetched - 1) * 3 / $1)) ]; then
                say "fetched $fetched of $1 packages"
            fi
            ;;
        "Downloading "*) # uv, once a large package; pip says it with spaces before
            [ ! -t 2 ] || printf '\r\033[Ksetup: %s' "$line" >&2
            ;;
        "Installing collected packages"* | "Prepared "*)
            [ ! -t 2 ] || printf '\r\033[K' >&2
            say "unpacking"
            ;;
        esac
    done
}

# Runs an installer with the arguments after the number of packages; its output goes to the log.
logged() {
    total=$1
    shift
    { "$@" 2>&1 || echo $? >"$FAILED"; } | show_progress "$total"
    if [ -e "$FAILED" ]; then
        [ ! -t 2 ] || printf '\r\033[K' >&2
        say "failed with exit status $(cat "$FAILED"); the last lines of $PWD/$LOG:"
        tail -n 12 "$LOG" >&2
        die "run make setup again to repair it"
    fi
}

# Installs this checkout, editable, after the number of packages.
install_checkout() {
    if have_uv; then
        logged "$1" uv pip install --quiet --python "$VENV/bin/python" --no-deps \
            --no-build-isolation -e .
    else
        logged "$1" "$VENV/bin/python" -m pip install --disable-pip-version-check --no-input \
            --progress-bar off --no-deps --quiet --no-build-isolation -e .
    fi
}

# Succeeds where a later `pip install .` has put a copy of the checkout in place of the link to it.
is_copy() {
    for record in "$VENV"/lib/python3.*/site-packages/awarenav-*.dist-info/direct_url.json; do
        [ ! -e "$record" ] || grep -q '"editable": *true' "$record" || return 0
    done
    return 1
}

# The lock names every package, so nothing is resolved here: --no-deps keeps it that way. pip would
# compile every module, which takes as long as all the rest; Python compiles those that it imports.
install() {
    : >"$INCOMPLETE"
    rm -f "$STAMP" "$FAILED"
    : >"$LOG"
    started=$(date +%s)
    count=$(packages)
    how="pip: up to $SIZE, a minute or two"
    ! have_uv || how="uv: up to $SIZE, less than a minute"
    say "installing $count pinned packages with $how"
    if have_uv; then
        logged "$count" uv pip install --python "$VENV/bin/python" --no-deps -r "$LOCK"
    else
        logged "$count" "$VENV/bin/python" -m pip install --disable-pip-version-check --no-input \
            --progress-bar off --no-deps --no-compile -r "$LOCK"
    fi
    install_checkout "$count"
    printf '%s\n%s\n' "$PWD" "$(wanted)" >"$STAMP"
    rm -f "$INCOMPLETE"
    say "done after $(($(date +%s) - started)) s"
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
elif is_copy; then
    say "$VENV has a copy of this checkout, as after 'pip install .': linking the checkout again"
    : >"$LOG"
    rm -f "$FAILED"
    install_checkout 1
fi
