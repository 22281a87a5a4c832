#!/usr/bin/env bash
# The HTML report of `gloss compare` in headless Chromium (apt-get install chromium): no error, nothing asked of a network,
# charts and pictures drawn, nothing wider than the screen; light and dark, wide and narrow.
#
#     tests/report.sh [DIRECTORY]        keeps the report and the screenshots in DIRECTORY
#     GLOSS=a/program tests/report.sh    looks at that program's report instead of building one
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-$(mktemp -d)}
mkdir -p "$out"
out=$(cd "$out" && pwd)

if [ -z "${GLOSS:-}" ]; then
    cargo build --quiet --bin gloss
    GLOSS=${CARGO_TARGET_DIR:-target}/debug/gloss
fi
"$GLOSS" compare scenes/boxes.toml --spp 4 --rays 50000 --rounds 3 --html "$out/report.html" --quiet

browse() {
    local profile status=0
    profile=$(mktemp -d)
    timeout 120 chromium --headless --no-sandbox --disable-gpu --disable-background-networking \
        --disable-component-update --disable-sync --disable-dev-shm-usage --hide-scrollbars \
        --user-data-dir="$profile" --virtual-time-budget=2000 --enable-logging=stderr "$@" \
        2> "$out/chromium.log" || status=$?
    rm -rf "$profile"
    if grep CONSOLE "$out/chromium.log" >&2 || [ $status -ne 0 ]; then
        echo "error: chromium $*" >&2
        exit 1
    fi
}

# A copy of the page that moves the slider, measures itself and tells the page around it.
cat > "$out/measure.js" <<'JS'
addEventListener('load', () => {
  const all = (query) => [...document.querySelectorAll(query)];
  const range = document.querySelector('.ab input');
  range.value = 30;
  range.dispatchEvent(new Event('input'));
  const found = {
    wide: document.documentElement.scrollWidth > innerWidth,
    bars: all('.bars b').length,
    flat: all('.bars b').filter((b) => b.getBoundingClientRect().width < 1).length,
    pictures: all('figure img').length,
    broken: all('img').filter((i) => !i.naturalWidth || i.getBoundingClientRect().width < 100).length,
    unnamed: all('img:not([alt]), input:not([aria-label])').length,
    clip: getComputedStyle(document.querySelector('.over')).clipPath,
    outside: performance.getEntriesByType('resource').filter((r) => !r.name.startsWith('data:')).length,
  };
  parent.postMessage(JSON.stringify(found), '*');
});
JS
{
    sed 's|</html>||' "$out/report.html"
    printf '<script>\n%s\n</script>\n</html>\n' "$(cat "$out/measure.js")"
} > "$out/measured.html"

# Headless windows are at least 500 pixels wide: a narrow page is a frame in another.
frame() {
    cat > "$out/frame.html" <<HTML
<!doctype html><style>body { margin: 0 } iframe { border: 0; width: $1px; height: 5200px }</style>
<script>onmessage = (event) => { document.documentElement.dataset.found = event.data };</script>
<iframe src="$2"></iframe>
HTML
}

for width in 1280 360; do
    frame $width report.html
    window=$((width < 500 ? 500 : width)),5200
    browse --window-size=$window --screenshot="$out/light-$width.png" "file://$out/frame.html"
    browse --window-size=$window --blink-settings=preferredColorScheme=0 \
        --screenshot="$out/dark-$width.png" "file://$out/frame.html"

    frame $width measured.html
    found=$(browse --window-size=1300,900 --dump-dom "file://$out/frame.html" | sed -n 's/&quot;/"/g; s/.*data-found="\({.*}\)".*/\1/p')
    echo "$width px: $found"
    for expected in '"wide":false' '"flat":0' '"pictures":4' '"broken":0' '"unnamed":0' '30%' '"outside":0'; do
        case $found in
            *"$expected"*) ;;
            *) echo "error: at $width px, not $expected" >&2; exit 1 ;;
        esac
    done
    case $found in
        *'"bars":0,'*) echo "error: at $width px no bar is drawn" >&2; exit 1 ;;
    esac
done
rm "$out/frame.html" "$out/measure.js" "$out/measured.html" "$out/chromium.log"
echo "the report is as it should be: $out"
