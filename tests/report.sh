#!/usr/bin/env bash
# The HTML reports of `gloss compare` and `gloss trade` in headless Chromium (apt-get install chromium): no error, nothing
# asked of a network, charts and pictures drawn, the keyboard works, nothing wider than the screen; light and dark, wide,
# narrow and printed.
#
#     tests/report.sh [DIRECTORY]        keeps the reports and the screenshots in DIRECTORY
#     GLOSS=a/program tests/report.sh    looks at that program's reports instead of building one
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-$(mktemp -d)}
mkdir -p "$out"
out=$(cd "$out" && pwd)

if [ -z "${GLOSS:-}" ]; then
    cargo build --quiet --bin gloss
    GLOSS=${CARGO_TARGET_DIR:-target}/debug/gloss
fi
"$GLOSS" compare scenes/boxes.toml --spp 4 --rays 50000 --rounds 3 --html "$out/compare.html" --quiet
"$GLOSS" trade scenes/lemon.toml --spp 4 --rounds 2 --resolution 64x64 -o "$out/trade.html" --quiet

browse() {
    local profile status=0
    profile=$(mktemp -d)
    timeout 120 chromium --headless --no-sandbox --disable-gpu --disable-background-networking \
        --disable-component-update --disable-sync --disable-dev-shm-usage --hide-scrollbars \
        --user-data-dir="$profile" --virtual-time-budget=4000 --enable-logging=stderr "$@" \
        2> "$out/chromium.log" || status=$?
    rm -rf "$profile"
    if grep CONSOLE "$out/chromium.log" >&2 || [ $status -ne 0 ]; then
        echo "error: chromium $*" >&2
        exit 1
    fi
}

# What both reports are measured for, and what each has of its own: `found` is told to the page around it.
cat > "$out/measure.js" <<'JS'
addEventListener('load', () => setTimeout(() => {
  const all = (query) => [...document.querySelectorAll(query)];
  const found = {
    wide: document.documentElement.scrollWidth > innerWidth,
    broken: all('img').filter((i) => i.offsetParent && (!i.naturalWidth || i.getBoundingClientRect().width < 60)).length,
    unnamed: all('img:not([alt]), input:not([aria-label]), svg:not([aria-label]):not([aria-hidden])').length,
    outside: performance.getEntriesByType('resource').filter((r) => !r.name.startsWith('data:')).length,
  };
  OWN(found, all);
  parent.postMessage(JSON.stringify(found), '*');
}, 500));
JS
cat > "$out/compare.js" <<'JS'
const OWN = (found, all) => {
  const range = document.querySelector('.ab input');
  range.value = 30;
  range.dispatchEvent(new Event('input'));
  found.bars = all('.bars b').length > 8;
  found.flat = all('.bars b').filter((b) => b.getBoundingClientRect().width < 1).length;
  found.pictures = all('figure img').length;
  found.clip = getComputedStyle(document.querySelector('.over')).clipPath;
};
JS
cat > "$out/trade.js" <<'JS'
const OWN = (found, all) => {
  const ways = JSON.parse(document.getElementById('findings').textContent).ways;
  const part = document.querySelector('.knob');
  const points = [...part.querySelectorAll('.point')];
  const told = () => part.querySelector('.panel p').textContent;
  found.points = points.length === ways.length;
  // No dot is drawn outside of its chart.
  found.outside_chart = all('.plot').filter((plot) => {
    const frame = plot.getBoundingClientRect();
    return [...plot.querySelectorAll('.dot')].some((dot) => {
      const box = dot.getBoundingClientRect();
      return box.left < frame.left || box.right > frame.right || box.top < frame.top || box.bottom > frame.bottom;
    });
  }).length;
  found.charts = all('.plot').length === all('.knob').length;
  found.guides = all('.plot').every((plot) => plot.querySelector('.guide'));
  found.letters = Math.min(...all('.plot text').filter((t) => t.textContent).map((t) => t.getBoundingClientRect().height)) > 8;
  // The arrow keys go from point to point, each tells of itself, and so does a button.
  points[0].focus();
  const seen = new Set([told()]);
  for (let i = 0; i < 4; i++) {
    document.activeElement.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowRight', bubbles: true }));
    seen.add(told());
  }
  found.keys = seen.size === 5 && document.activeElement === points[4];
  const last = all('.knob').pop();
  const buttons = [...last.querySelectorAll('button')];
  buttons[1].click();
  found.pressed = last.querySelectorAll('[aria-pressed=true]').length === 1 && buttons[1].getAttribute('aria-pressed') === 'true';
  found.told = told().includes('relMSE') && part.querySelector('.shot').naturalWidth > 1;
};
JS

# Headless windows are at least 500 pixels wide: a narrow page is a frame in another.
frame() {
    cat > "$out/frame.html" <<HTML
<!doctype html><style>body { margin: 0 } iframe { border: 0; width: $1px; height: $3px }</style>
<script>onmessage = (event) => { document.documentElement.dataset.found = event.data };</script>
<iframe src="$2"></iframe>
HTML
}

# A copy of the report $1 that measures itself, at a width of $2; the rest is what it must find.
measure() {
    local report=$1 width=$2 found expected
    shift 2
    {
        sed 's|</html>||' "$out/$report.html"
        printf '<script>\n%s\n%s\n</script>\n</html>\n' "$(cat "$out/$report.js")" "$(cat "$out/measure.js")"
    } > "$out/measured.html"
    frame "$width" measured.html 900
    found=$(browse --window-size=1300,900 --dump-dom "file://$out/frame.html" | sed -n 's/&quot;/"/g; s/.*data-found="\({.*}\)".*/\1/p')
    echo "$report at $width px: $found"
    for expected in '"wide":false' '"broken":0' '"unnamed":0' '"outside":0' "$@"; do
        case $found in
            *"$expected"*) ;;
            *) echo "error: $report at $width px, not $expected" >&2; exit 1 ;;
        esac
    done
}

for width in 1280 360; do
    measure compare $width '"flat":0' '"bars":true' '"pictures":4' '30%'
    measure trade $width '"points":true' '"charts":true' '"guides":true' '"outside_chart":0' '"letters":true' '"keys":true' \
        '"pressed":true' '"told":true'
    for report in compare trade; do
        height=$([ $report = trade ] && echo 12000 || echo 5200)
        frame $width $report.html $height
        window=$((width < 500 ? 500 : width)),$height
        browse --window-size=$window --screenshot="$out/$report-light-$width.png" "file://$out/frame.html"
        browse --window-size=$window --blink-settings=preferredColorScheme=0 \
            --screenshot="$out/$report-dark-$width.png" "file://$out/frame.html"
    done
done
for report in compare trade; do
    browse --no-pdf-header-footer --print-to-pdf="$out/$report.pdf" "file://$out/$report.html"
    [ "$(head -c 4 "$out/$report.pdf")" = %PDF ]
done
rm "$out"/{frame,measured}.html "$out"/{measure,compare,trade}.js "$out/chromium.log"
echo "the reports are as they should be: $out"
