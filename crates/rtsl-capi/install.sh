#!/usr/bin/env bash
# Builds the C interface and installs it: headers, a static and a shared library, and a file for pkg-config.
#
#     crates/rtsl-capi/install.sh [--profile PROFILE | --archive LIBRARY] PREFIX
#
# It needs Rust and a C compiler (CC, or cc), which makes the shared library of the static one: so its symbols have versions.
# With --archive the static library is LIBRARY, and nothing is built.
set -euo pipefail

profile=release
archive=
case ${1:-} in
--profile)
    profile=$2
    shift 2
    ;;
--archive)
    archive=$(realpath "$2")
    shift 2
    ;;
esac
if [ $# != 1 ] || [ "${1#-}" != "$1" ]; then
    sed -n '2,7s/^# \{0,1\}//p' "$0" >&2
    exit 2
fi
mkdir -p "$1"
prefix=$(cd "$1" && pwd)
crate=$(cd "$(dirname "$0")" && pwd)
cd "$crate"

if [ -z "$archive" ]; then
    cargo build --quiet --profile "$profile" --lib
    target=$(cargo metadata --no-deps --format-version 1 | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')
    folder=$profile
    [ "$profile" = dev ] && folder=debug
    archive=$target/$folder/librtsl_capi.a
fi
version=$(cargo pkgid | sed 's/.*[#@]//')
# The version of the interface: programs that were linked with another do not start with this one.
abi=1

mkdir -p "$prefix/include" "$prefix/lib/pkgconfig"
install -m 644 include/rtsl.h include/rtsl_kernel.h "$prefix/include"
install -m 644 "$archive" "$prefix/lib/librtsl.a"
"${CC:-cc}" -shared -o "$prefix/lib/librtsl.so.$version" -Wl,-soname,"librtsl.so.$abi" \
    -Wl,--version-script=rtsl.map -Wl,--gc-sections \
    -Wl,--whole-archive "$archive" -Wl,--no-whole-archive -lpthread -ldl -lm
ln -sf "librtsl.so.$version" "$prefix/lib/librtsl.so.$abi"
ln -sf "librtsl.so.$abi" "$prefix/lib/librtsl.so"
sed -e "s|@PREFIX@|$prefix|" -e "s|@VERSION@|$version|" rtsl.pc.in >"$prefix/lib/pkgconfig/rtsl.pc"
echo "installed rtsl $version in $prefix"
