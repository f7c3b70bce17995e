#!/usr/bin/env bash
# Everything that must hold before a change lands: form, lints, documentation, tests.
set -euo pipefail
cd "$(dirname "$0")"
# Optional features include a library in C++: checked where there is a compiler for it.
features=$(command -v c++ >/dev/null && echo --all-features || true)
cargo fmt --all --check
cargo clippy --workspace --all-targets --locked $features -- -D warnings
RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked $features
cargo test --workspace --locked $features
