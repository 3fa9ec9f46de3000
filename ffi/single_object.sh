#!/bin/sh
# Makes of the library without the standard library an archive of one object whose only global symbols are blik_*:
#
#   ffi/single_object.sh target/embedded/libblik.a libblik_nostd.a
#
# So it links beside any other Rust library, and weighs kilobytes instead of megabytes. For another machine name its
# tools: LD=ld.lld OBJCOPY=llvm-objcopy NM=llvm-nm AR=llvm-ar.
set -eu
archive=$1 result=$2
: "${LD:=ld}" "${OBJCOPY:=objcopy}" "${NM:=nm}" "${AR:=ar}"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
# nm warns of members without symbols
"$NM" --defined-only "$archive" 2>/dev/null | awk '$2 == "T" && $3 ~ /^blik_/ { print $3 }' | sort -u >"$folder/keep"
[ -s "$folder/keep" ] || { echo "$archive: no blik_ functions" >&2; exit 1; }
# shellcheck disable=SC2046
"$LD" -r --gc-sections -e blik_version $(sed 's/^/-u /' "$folder/keep") -o "$folder/whole.o" "$archive"
"$OBJCOPY" --strip-debug --keep-global-symbols="$folder/keep" --remove-section=.llvmbc --remove-section=.llvmcmd \
    --remove-section=.comment "$folder/whole.o" "$folder/blik.o"
rm -f "$result"
(cd "$folder" && "$AR" rcs blik.a blik.o)
mv "$folder/blik.a" "$result"
