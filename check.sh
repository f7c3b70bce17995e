#!/usr/bin/env bash
# Everything that must hold before a change lands: form, lints, documentation, tests.
set -euo pipefail
cd "$(dirname "$0")"
# Optional features need a compiler for C++, or libudev's headers: each is checked where there is what it needs.
optional=()
if command -v c++ >/dev/null; then optional+=(littoral-data/lod); fi
if [ "$(uname)" != Linux ] || pkg-config --exists libudev 2>/dev/null; then optional+=(littoral-fly/gamepad); fi
features=${optional:+--features $(IFS=,; echo "${optional[*]}")}
cargo fmt --all --check
cargo clippy --workspace --all-targets --locked $features -- -D warnings
RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked $features
cargo test --workspace --locked $features
