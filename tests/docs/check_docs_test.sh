#!/usr/bin/env bash
# check_docs_test.sh ROOT PROGRAM: check_docs.sh must accept a page without faults and reject each
# planted one.
set -euo pipefail
root=$1 program=$2
check=$root/tests/docs/check_docs.sh
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
page=$scratch/page.md

# expect RESULT LINE: RESULT is "accepted", or what the complaint about LINE must contain.
expect() {
    printf '# Page\n%s\n' "$2" >"$page"
    local output
    if output=$("$check" "$root" "$program" "$page" 2>&1); then
        [ "$1" = accepted ] || { echo "not rejected: $2"; exit 1; }
    else
        [ "$1" != accepted ] && [[ $output == *"$1"* ]] ||
            { echo "for '$2' expected '$1', got: $output"; exit 1; }
    fi
}

# shellcheck disable=SC2016  # backticks are Markdown
{
    expect accepted 'Read `common/backend.h`, `hit_rule.h` and [this](architecture.md#layers); `--rays` takes `ao`.'
    expect accepted '`Backend::refit` and `kMaxDepth` are in the sources, `fast_edges` too.'
    expect 'no such file' 'Read `common/no_such_file.h`.'
    expect 'no such file' 'Read `no_such_file.glsl`.'
    expect 'no such file' 'Read `cpu/no_such_*-inl.h`.'
    expect 'does not exist' 'Read [this](no_such_page.md).'
    expect 'a heading that' 'Read [this](architecture.md#no-such-heading).'
    expect 'this option' 'Try `--no-such-option`.'
    expect 'no source has' 'Call `Backend::no_such_member`.'
    expect 'no source has' 'Set `kNoSuchConstant`.'
    expect 'no source has' 'Call `no_such_function`.'
    expect 'no source has' 'See `HitRule.HasNoSuchTest`.'
}
