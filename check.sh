#!/bin/sh
# All checks, as they run before every merge: style, types, imports between packages, tests.
# Every one runs even if another fails; the exit code is 1 if any did. Arguments go to pytest: `sh check.sh tests/fe`.
set -u
cd "$(dirname "$0")" || exit 1

# One thread a process: pytest already uses two processes, and more threads would only wait for each other.
OMP_NUM_THREADS=${OMP_NUM_THREADS:-1}
MKL_NUM_THREADS=${MKL_NUM_THREADS:-1}
OPENBLAS_NUM_THREADS=${OPENBLAS_NUM_THREADS:-1}
export OMP_NUM_THREADS MKL_NUM_THREADS OPENBLAS_NUM_THREADS

if [ ! -x .venv/bin/pytest ]; then
    echo "check.sh: .venv is missing or incomplete: run \`sh install.sh\` first" >&2
    exit 2
fi

if ! command -v chromium >/dev/null 2>&1 && ! command -v chromium-browser >/dev/null 2>&1; then
    echo "check.sh: the tests of stickslip bench will fail without Chromium: apt-get install chromium" >&2
fi

failed=""
check() {
    name=$1
    shift
    echo "== $name"
    "$@" || failed="$failed $name"
}

check ruff .venv/bin/ruff check .
check format .venv/bin/ruff format --check .
check mypy .venv/bin/mypy
check imports .venv/bin/lint-imports
[ -z "$failed" ] || echo "== failed so far:$failed (the tests run all the same)"

# Last, so that the last line says how many tests passed. Files keep their order: by default those of few tests, which
# are the long ones here, would come last, and one process would wait for the other.
check tests .venv/bin/pytest -n 2 --dist loadfile --no-loadscope-reorder "$@"
[ -z "$failed" ]
