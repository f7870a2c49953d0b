# What the scripts beside this one share; they source it. Nothing here runs by itself.
#
# A script ends with 0 when every digest and every proof holds. Where a tool is missing and cannot be installed it says
# "skipped: NAME: why" and fails, unless DYNVOX_TARGETS_MAY_SKIP=1 allows that.
set -euo pipefail
targets=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
name=$(basename "$0")
build=${DYNVOX_TARGETS_BUILD:-$targets/../../target/targets}/$name
mkdir -p "$build"

skip() {
  echo "skipped: $name: $1"
  [ "${DYNVOX_TARGETS_MAY_SKIP:-0}" = 1 ] && exit 0
  exit 1
}

# need PROGRAM-OR-FILE PACKAGE...: installs the Debian packages unless the program or file is there.
need() {
  command -v "$1" >/dev/null || [ -e "$1" ] && return 0
  local wanted=$1 root=()
  shift
  command -v apt-get >/dev/null || skip "$wanted is missing and there is no apt-get to install $* with"
  [ "$(id -u)" = 0 ] || root=(sudo -n)
  # One at a time: targets are checked side by side.
  exec {installing}<"$targets" && flock "$installing"
  { "${root[@]}" apt-get update -qq && DEBIAN_FRONTEND=noninteractive "${root[@]}" apt-get install -y -qq --no-install-recommends "$@"; } \
    >"$build/apt.log" 2>&1 || skip "$wanted is missing and $* cannot be installed: $(tail -n 1 "$build/apt.log")"
  exec {installing}<&-
}

# A compiler that has its library's source beside it, to build the library for targets without a shipped one: the toolchain in
# use where it has that component, else Debian's. And the linker that all of them share.
cross_toolchain() {
  local sysroot
  sysroot=$(rustc --print sysroot)
  if [ -d "$sysroot/lib/rustlib/src/rust/library" ]; then
    cross_cargo=cargo cross_rustc=rustc
  else
    need /usr/share/doc/rust-web-src rustc-web cargo-web rust-web-src
    need /usr/bin/cargo cargo-web rustc-web
    cross_cargo=/usr/bin/cargo cross_rustc=/usr/bin/rustc
  fi
  linkers=$(dirname "$(find "$sysroot/lib/rustlib" -name rust-lld -print -quit 2>/dev/null || true)")
  [ -x "$linkers/rust-lld" ] || skip "no rust-lld in $sysroot"
}

# The fixture as the firmware embeds it, packed from its files: ours, or the one in DYNVOX_FIXTURE.
pack() {
  local root=$targets/../.. fixture
  fixture=$(realpath "${DYNVOX_FIXTURE:-$root/fixtures/street-320x96}")
  local packed; packed=$(realpath "$(dirname "$build")")/$(basename "$fixture")
  export DYNVOX_CLIP=$packed.clip DYNVOX_CONSTANTS=$packed.rs DYNVOX_DIGESTS=$fixture/digests.txt
  # The binary that the tests have built, unless sources are newer.
  dynvox=$root/target/debug/dynvox
  [ -x "$dynvox" ] && [ -z "$(find "$root/Cargo.lock" "$root/core" "$root/host/Cargo.toml" "$root/host/src" -newer "$dynvox" \( -name '*.rs' -o -name 'Cargo.*' \) -print -quit)" ] ||
    (cd "$root" && cargo build --quiet --locked -p dynvox)
  # Digests are not in it.
  [ -s "$DYNVOX_CONSTANTS" ] && [ -z "$(find "$fixture" "$root/core/src" "$dynvox" -newer "$DYNVOX_CONSTANTS" -type f ! -name '*.txt' -print -quit)" ] &&
    return 0
  "$dynvox" fixtures pack "$fixture" --out "$DYNVOX_CLIP" --rust "$DYNVOX_CONSTANTS"
}

# own_fixture FRAMES MEMORY [SYNTH-ARGUMENT...]: makes the street a fixture of its own, without its first frame, and the one to pack from now on.
own_fixture() {
  local own=$build/own frames=$1 memory=$2
  shift 2
  rm -rf "$own"
  mkdir -p "$own"
  "$dynvox" synth --out "$own/street" --frames "$frames" "$@" >"$own/log"
  "$dynvox" fixtures new "$own/pinned" --from "$own/street" --frames $((frames - 1)) --start 1 --memory "$memory" --set volume.voxel_size_m=0.1 >>"$own/log"
  export DYNVOX_FIXTURE=$own/pinned
}

# hosted FOLDER: the firmware as an ordinary program of this machine, in $elf.
hosted() {
  pack
  CARGO_TARGET_DIR=$1 CARGO_PROFILE_RELEASE_LTO=off CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16 cargo build --quiet --release --locked \
    --features hosted,snapshots --manifest-path "$targets/firmware/Cargo.toml"
  elf=$1/release/dynvox-firmware
}

# cross TARGET RUSTFLAGS [CARGO-ARGUMENT...]: the firmware for a target, in $elf; with cross_library=core without the crate alloc.
cross() {
  local target=$1 flags=$2
  shift 2
  pack
  cross_toolchain
  echo "$name: $("$cross_rustc" --version), $target"
  # Only this one command sees the other compiler.
  env RUSTC="$cross_rustc" RUSTC_BOOTSTRAP=1 PATH="$linkers:$PATH" CARGO_TARGET_DIR="$build" RUSTFLAGS="$flags" \
    "$cross_cargo" build --quiet --release --locked --manifest-path "$targets/firmware/Cargo.toml" --target "$target" \
    -Zbuild-std=${cross_library:-core,alloc},compiler_builtins -Zbuild-std-features=compiler-builtins-mem "$@" || return
  elf=$build/$target/release/dynvox-firmware
}

# Flags for a static Linux program without a C library.
bare_linux="-Clinker=rust-lld -Clinker-flavor=ld.lld -Crelocation-model=static -Ctarget-feature=+crt-static"

# replay COMMAND...: runs the firmware; it compares the digests itself and says so by its exit code.
replay() {
  local start code=0
  start=$(date +%s%N)
  timeout 300 "$@" >"$build/lines" 2>&1 || code=$?
  if [ $code != 0 ]; then
    tail -n 30 "$build/lines"
    echo "$name: FAILED with code $code (1: a digest, 2: the fixture, 3: the stack, 124: time), see $build/lines"
    exit 1
  fi
  grep '^stack of a step [1-9]' "$build/lines" || true
  local ms=$((($(date +%s%N) - start) / 1000000)) elsewhere=$(grep '^elsewhere' "$build/lines") snapshot=$(grep '^snapshot' "$build/lines" || true)
  [ "$name" = x86-64 ] || same_here "$elsewhere" ${snapshot:+"$snapshot"}
  echo "$name: $(grep -cE '^[0-9]+ [0-9a-f]{16} ' "$build/lines") frames in $ms ms, every digest the one on file; $elsewhere${snapshot:+; $snapshot}"
}

# same_here LINE...: the ways the fixture does not come to, and snapshots, have no digest on file: they must give what they give on this machine.
same_here() {
  local reference=$(dirname "$build")/reference line
  hosted "$reference"
  "$elf" >"$build/here"
  for line; do
    grep -qx "$line" "$build/here" || { echo "$name: FAILED: $line, here it is $(grep "^${line%% *}" "$build/here")"; exit 1; }
  done
}
