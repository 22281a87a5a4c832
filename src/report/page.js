// Moves the edge between two pictures; the page reads well without this.
document.querySelectorAll('.ab').forEach((figure) => {
  const range = figure.querySelector('input');
  const move = () => figure.style.setProperty('--at', range.value + '%');
  range.addEventListener('input', move);
  move();
});
