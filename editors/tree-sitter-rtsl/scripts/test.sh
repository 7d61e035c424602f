#!/bin/sh
# The tests that need the command `tree-sitter`: that generated files are current, the corpus, the highlighting, and
# that every shader is parsed without errors. `cargo test -p tree-sitter-rtsl` needs no Node.js and checks more texts.
set -eu
cd "$(dirname "$0")/.."

node scripts/words.mjs --check

generated=$(mktemp -d)
trap 'rm -r "$generated"' EXIT
tree-sitter generate --abi 14 --output "$generated"
for file in parser.c grammar.json node-types.json; do
    cmp "src/$file" "$generated/$file" || { echo "src/$file is stale; \`npm run generate\` renews it"; exit 1; }
done

tree-sitter test
tree-sitter parse --quiet '../../shaders/**/*.rtsl' '../../prelude/**/*.rtsl' '../../bench/**/*.rtsl' \
    '../../integrations/**/*.rtsl' '../../tests/lower/*.rtsl' '../../tests/packet/*.rtsl'
