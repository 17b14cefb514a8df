#!/usr/bin/env bash
# Makes three.js, the bundle that every page carries, from the packages of npm.  Run it after a change of
# three_entry.js or of a version below; it needs npm and a network.
set -euo pipefail
three=0.187.0
esbuild=0.28.2
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cd "$scratch"
cp "$here/three_entry.js" .
npm install --no-save --silent --no-audit --no-fund "three@$three" "esbuild@$esbuild"
npx esbuild three_entry.js --bundle --minify --format=iife --global-name=THREE --target=es2020 --legal-comments=none \
    --outfile="$here/three.js"
cp node_modules/three/LICENSE "$here/three.LICENSE.txt"
