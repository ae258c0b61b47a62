#!/bin/sh
# Install stickslip and everything it needs, system libraries included, into .venv beside this file.
# Made for a bare Debian 12 or later (or Ubuntu with Python 3.11); safe to run again: what is there is left alone.
set -eu
cd "$(dirname "$0")"

# What each library is for is shown by `stickslip doctor`; calculix-ccx is the independent witness of the tests.
SYSTEM_PACKAGES="ca-certificates python3 python3-venv libgl1 libegl1 libx11-6 libxrender1 libexpat1 calculix-ccx"
# CHOLMOD, which makes reductions faster, is one of these, by the release. Nothing fails without it.
CHOLMOD_PACKAGES="libcholmod5 libcholmod3"
# The tests of `stickslip bench` drive a browser, which a user has already. Ubuntu has it as a snap only.
BROWSER_PACKAGE="chromium"

say() { printf '%s\n' "install.sh: $*" >&2; }

as_root() {
    if [ "$(id -u)" -eq 0 ]; then
        "$@"
    elif command -v sudo >/dev/null 2>&1; then
        sudo "$@"
    else
        say "this needs root, and there is no sudo: run as root: $*"
        exit 2
    fi
}

is_installed() {
    # shellcheck disable=SC2016  # ${Status} is dpkg's, not the shell's
    dpkg-query -W -f='${Status}' "$1" 2>/dev/null | grep -q '^install ok installed$'
}

missing_system_packages() {
    for package in $SYSTEM_PACKAGES; do
        is_installed "$package" || printf '%s ' "$package"
    done
}

is_any_installed() {
    for package in "$@"; do
        is_installed "$package" && return
    done
    return 1
}

first_known() {
    for package in "$@"; do
        if [ -n "$(apt-cache search --names-only "^$package\$")" ]; then
            printf '%s' "$package"
            return
        fi
    done
}

install_system_packages() {
    if ! command -v apt-get >/dev/null 2>&1; then
        say "this is neither Debian nor Ubuntu: install the equivalents of \"$SYSTEM_PACKAGES\" with your own package manager"
        return
    fi
    missing=$(missing_system_packages)
    [ -n "$missing" ] || return 0
    say "installing system packages: $missing"
    as_root apt-get update -q
    # shellcheck disable=SC2086  # a list of words on purpose
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $missing
}

may_install() {
    command -v apt-get >/dev/null 2>&1 && { [ "$(id -u)" -eq 0 ] || command -v sudo >/dev/null 2>&1; }
}

install_cholmod() {
    # shellcheck disable=SC2086  # lists of words on purpose, here and below
    if is_any_installed $CHOLMOD_PACKAGES || ! may_install; then return 0; fi
    # shellcheck disable=SC2086
    wanted=$(first_known $CHOLMOD_PACKAGES)
    if [ -z "$wanted" ]; then
        as_root apt-get update -q || return 1
        # shellcheck disable=SC2086
        wanted=$(first_known $CHOLMOD_PACKAGES)
        [ -n "$wanted" ] || return 1
    fi
    # Where there is no MKL it takes its matrix products from OpenBLAS.
    [ "$(uname -m)" = x86_64 ] || wanted="$wanted libopenblas0"
    say "installing $wanted"
    # shellcheck disable=SC2086
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $wanted
}

install_browser() {
    if command -v chromium >/dev/null 2>&1 || command -v chromium-browser >/dev/null 2>&1 || ! may_install; then return 0; fi
    say "installing $BROWSER_PACKAGE, for the tests of stickslip bench"
    as_root apt-get update -q || return 1
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "$BROWSER_PACKAGE"
}

find_python() {
    for candidate in python3 python3.11 python3.12 python3.13; do
        if command -v "$candidate" >/dev/null 2>&1 &&
            "$candidate" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
            printf '%s' "$candidate"
            return
        fi
    done
    say "no Python 3.11 or later with its venv module was found: install one (Debian: python3-venv) and run this again"
    exit 2
}

install_python_packages() {
    stamp=.venv/installed-from
    wanted=$(cat requirements.lock pyproject.toml install.sh | sha256sum)
    if [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$wanted" ] && [ -x .venv/bin/stickslip ]; then
        say "Python packages are up to date"
        return
    fi
    # A virtual environment that was moved, or whose interpreter is gone, is made anew.
    if ! .venv/bin/python -c 'import pip' 2>/dev/null; then
        python=$(find_python)
        say "creating .venv with $("$python" --version)"
        "$python" -m venv --clear .venv
    fi
    say "installing the tested versions of requirements.lock (about 2 GB, a few minutes)"
    .venv/bin/python -m pip install --disable-pip-version-check --progress-bar off --quiet --no-compile -r requirements.lock
    # Bytecode by all processors: pip makes it by one. Files of other Pythons, which some packages have, are left out.
    .venv/bin/python -m compileall -q -j 0 .venv/lib >/dev/null || true
    # The lock holds the build backend too, so nothing that is not in it is ever fetched.
    .venv/bin/python -m pip install --disable-pip-version-check --quiet --no-deps --no-build-isolation -e .
    printf '%s\n' "$wanted" >"$stamp"
}

compile_solver() {
    say "compiling what of the solvers is not compiled yet, so that their first use need not wait (at first a minute or two)"
    # An installation without its machine code is sound: it is made on first use.
    .venv/bin/python -m fe.sparse.compile_ahead &
    { .venv/bin/python -m hbsolve.compile_ahead && wait $!; } || say "that failed; it will be tried again on first use"
}

install_system_packages
install_cholmod || say "CHOLMOD was not installed: reductions will be slower, and are otherwise the same"
install_browser || say "$BROWSER_PACKAGE was not installed: the browser tests of check.sh need it; nothing else does"
install_python_packages
compile_solver
.venv/bin/stickslip doctor
