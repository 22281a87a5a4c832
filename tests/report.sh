#!/usr/bin/env bash
# The HTML report of `gloss compare` in headless Chromium (apt-get install chromium): no error, nothing asked of a network,
# charts and pictures drawn, nothing wider than the screen; light and dark, wide and narrow.
#
#     tests/report.sh [DIRECTORY]        keeps the report and the screenshots in DIRECTORY
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-$(mktemp -d)}
mkdir -p "$out"
out=$(cd "$out" && pwd)

cargo build --quiet --bin gloss
gloss=${CARGO_TARGET_DIR:-target}/debug/gloss
"$gloss" compare scenes/boxes.toml --spp 4 --rays 50000 --rounds 3 --html "$out/report.html" --quiet

browse() {
    local profile
    profile=$(mktemp -d)
    timeout 120 chromium --headless --no-sandbox --disable-gpu --disable-background-networking \
        --disable-component-update --disable-sync --disable-dev-shm-usage --hide-scrollbars --user-data-dir="$profile" \
        --virtual-time-budget=2000 --enable-logging=stderr --v=0 "$@" 2> "$out/chromium.log"
    rm -rf "$profile"
    if grep -q CONSOLE "$out/chromium.log"; then
        grep CONSOLE "$out/chromium.log" >&2
        exit 1
    fi
}

# A copy of the page that measures itself and writes what it finds where --dump-dom shows it.
sed 's|</body>|<script>onload = () => {\
  const all = (query) => [...document.querySelectorAll(query)];\
  const range = document.querySelector(".ab input");\
  range.value = 30;\
  range.dispatchEvent(new Event("input"));\
  document.body.dataset.found = JSON.stringify({\
    wide: document.documentElement.scrollWidth > innerWidth,\
    bars: all(".bars b").length,\
    flat: all(".bars b").filter((b) => b.getBoundingClientRect().width < 1).length,\
    pictures: all("figure img").length,\
    broken: all("img").filter((i) => !i.naturalWidth \|\| i.getBoundingClientRect().width < 100).length,\
    unnamed: all("img:not([alt]), input:not([aria-label])").length,\
    moved: getComputedStyle(document.querySelector(".over")).clipPath,\
    outside: performance.getEntriesByType("resource").filter((r) => !r.name.startsWith("data:")).length,\
  });\
}</script></body>|' "$out/report.html" > "$out/measured.html"

for width in 1280 360; do
    # Headless windows are at least 500 pixels wide: a narrow one is a frame in a page.
    printf '<!doctype html><style>body{margin:0}iframe{border:0;width:%spx;height:%spx}</style><iframe src="%s"></iframe>' \
        "$width" 5200 report.html > "$out/frame-$width.html"
    for scheme in light dark; do
        flags=()
        [ $scheme = dark ] && flags=(--blink-settings=preferredColorScheme=0)
        browse "${flags[@]}" --window-size=$((width < 500 ? 500 : width)),5200 \
            --screenshot="$out/$scheme-$width.png" "file://$out/frame-$width.html"
    done
    sed 's/report.html/measured.html/' "$out/frame-$width.html" > "$out/frame-measured.html"
    sed -i 's|</iframe>|</iframe><script>onmessage = (e) => { document.body.dataset.found = e.data }</script>|' "$out/frame-measured.html"
    sed -i 's|document.body.dataset.found = JSON.stringify(|const found = JSON.stringify(|; s|^}</script></body>|;parent.postMessage(found, "*");}</script></body>|' "$out/measured.html"
    found=$(browse --window-size=1300,900 --dump-dom "file://$out/frame-measured.html" | grep -o 'data-found="[^"]*"' | sed 's/&quot;/"/g')
    echo "$width px: $found"
    for expected in '"wide":false' '"flat":0' '"pictures":4' '"broken":0' '"unnamed":0' '30%' '"outside":0'; do
        case $found in
            *"$expected"*) ;;
            *) echo "error: at $width px, not $expected" >&2; exit 1 ;;
        esac
    done
done
echo "the report is as it should be: $out"
