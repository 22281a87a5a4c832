// Shows the pictures of the way that is pointed at, focused or chosen; the tables say all without it.
(() => {
  const read = (id) => JSON.parse(document.getElementById(id).textContent);
  const ways = read('findings').ways;
  const pictures = read('pictures');
  document.documentElement.classList.add('scripted');
  const number = (x) => (x === 0 || (Math.abs(x) >= 1e-3 && Math.abs(x) < 1e4) ? String(+x.toPrecision(3)) : x.toExponential(2));
  const show = (part, key) => {
    const way = ways[key];
    const panel = part.querySelector('.panel');
    const [picture, map] = pictures.ways[key];
    panel.querySelector('.shot').src = picture;
    panel.querySelector('.shot').alt = 'One picture of ' + way.way.name;
    panel.querySelector('.map').src = map;
    panel.querySelector('.map').alt = 'Where ' + way.way.name + ' differs from the reference';
    panel.querySelector('p').textContent = way.way.name + ': ' + number(way.cpu_seconds.median) + ' CPU s, relMSE ' +
      number(way.errors.relmse.value) + ' (' + number(way.errors.relmse.low) + ' to ' + number(way.errors.relmse.high) + '), FLIP ' +
      number(way.flip.value) + ', ' + way.verdict + ', efficiency ' + number(way.relative_efficiency);
    part.querySelectorAll('.point').forEach((p) => p.classList.toggle('on', p.dataset.key === String(key)));
    part.querySelectorAll('.choices button').forEach((b) => b.setAttribute('aria-pressed', b.dataset.key === String(key)));
  };
  document.querySelectorAll('.knob').forEach((part) => {
    part.querySelectorAll('.reference').forEach((image) => { image.src = pictures.reference; });
    const all = [...part.querySelectorAll('[data-key]')];
    all.forEach((item) => {
      const key = Number(item.dataset.key);
      item.addEventListener('click', () => show(part, key));
      item.addEventListener('focus', () => show(part, key));
      item.addEventListener('pointerenter', () => show(part, key));
      item.addEventListener('keydown', (event) => {
        const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
        const peers = all.filter((other) => other.tagName === item.tagName);
        if (step) {
          event.preventDefault();
          peers[(peers.indexOf(item) + step + peers.length) % peers.length].focus();
        } else if (event.key === 'Enter' || event.key === ' ') {
          event.preventDefault();
          show(part, key);
        }
      });
    });
    if (all.length) show(part, Number(part.dataset.first));
  });
})();
