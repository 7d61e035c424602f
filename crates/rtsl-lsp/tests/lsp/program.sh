#!/bin/sh
# A stand-in for the program `rtsl`: answers from files beside the file that its second argument names. `bench.json` has
# the output of `bench`, `bench.error` its messages; with `bench.endless`, it does not end, and with `bench.large`, its
# output is large.
folder=$(dirname "$2")
echo "$@" >> "$folder/arguments"
if [ -e "$folder/$1.endless" ]; then
    echo $$ > "$folder/process"
    exec sleep 600
fi
if [ -e "$folder/$1.large" ]; then
    exec head -c 100000000 /dev/zero
fi
if [ -e "$folder/$1.error" ]; then
    cat "$folder/$1.error" >&2
    exit 1
fi
cat "$folder/$1.json"
