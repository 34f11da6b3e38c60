#!/bin/sh
# Makes three.min.js.gz anew: the parts of three.js that the page uses, as one classic script.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm init -y >/dev/null
npm install --no-audit --no-fund three@0.187.0 esbuild@0.28.2
cp "$here/three.entry.js" entry.js
npx esbuild entry.js --bundle --minify --format=iife --global-name=THREE --legal-comments=none \
    --outfile=three.min.js
gzip -9 -n -c three.min.js >"$here/three.min.js.gz"
cp node_modules/three/LICENSE "$here/three.LICENSE"
