// Numbers and elements of the page.

const bytes_of = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
function numbers(packed) {
  const bytes = bytes_of(packed.data);
  if (packed.type === 'u32') return new Uint32Array(bytes.buffer);
  const steps = new Uint16Array(bytes.buffer);
  if (packed.type === 'u16') return steps;
  const step = (packed.high - packed.low) / 65534;
  return Float32Array.from(steps, i => i === 65535 ? NaN : packed.low + step * i);
}
const phases = text => Float32Array.from(bytes_of(text), i => (i > 127 ? i - 256 : i) * Math.PI / 128);
function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith('on'))
      made.addEventListener(name.slice(2), value);
    else if (value !== false)
      made.setAttribute(name, value === true ? '' : value);
  }
  made.append(...children);
  return made;
}
const short = (value, digits) => Number.isFinite(value) ? String(Number(value.toPrecision(digits))) : '-';

// Of sound; other pages bring their own.
const QUANTITIES = [
  {key: 'radiation', name: 'radiation pressure', number: 0, unit: 'Pa', scale: 1, digits: 3},
  {key: 'p', name: 'amplitude |p|', number: 1, unit: 'kPa', scale: 1e-3, digits: 3}, {
    key: 'p',
    name: 'level',
    number: 2,
    unit: 'dB re 20 uPa rms',
    of: p => 20 * Math.log10(p / Math.SQRT2 / 20e-6),
    digits: 4
  },
  {key: 'phase', name: 'phase', number: 3, unit: 'deg', scale: 180 / Math.PI, digits: 3}
];

function show_instead(reason) {
  const instead = document.getElementById('instead'), picture = instead.querySelector('img');
  document.getElementById('view').hidden = true;
  instead.hidden = false;
  instead.querySelector('p').textContent =
      `The 3D view cannot be shown: ${reason}. ${picture ? 'The picture shows the pressure on the skin.' : ''}`;
  document.documentElement.dataset.ready = Math.round(performance.now());
}

// Lines over time, with a marker at the time that is shown.
function diagram(label, curves, now) {
  const [width, height] = [480, 120], finite = curves.flatMap(curve => curve.values.filter(Number.isFinite));
  const times = curves.flatMap(curve => curve.times), [first, last] = [Math.min(...times), Math.max(...times)];
  const low = Math.min(0, ...finite), high = Math.max(...finite, 1e-12);
  const x = t => (50 + (width - 60) * (t - first) / (last - first || 1)).toFixed(1);
  const y = v => (height - 20 - (height - 30) * (v - low) / (high - low)).toFixed(1);
  const point = ({times, values}, k) =>
      Number.isFinite(values[k]) ? `${Number.isFinite(values[k - 1]) ? 'L' : 'M'}${x(times[k])} ${y(values[k])}` : '';
  const lines = curves.map(
      (curve, i) => `<path class="line${i % 6}" d="${curve.times.map((_, k) => point(curve, k)).join('')}"/>`);
  const marker = Number.isFinite(now) ? `<path class="marker" d="M${x(now)} 10V${height - 20}"/>` : '';
  const text = (at, down, anchor, words) => `<text x="${at}" y="${down}" text-anchor="${anchor}">${words}</text>`;
  const figure = element('figure');
  figure.innerHTML = `<svg viewBox="0 0 ${width} ${height}" role="img" aria-label="lines over time">` +
      `<path class="axis" d="M50 10V${height - 20}H${width - 10}"/>${lines.join('')}${marker}` +
      text(46, 14, 'end', short(high, 3)) + text(46, height - 20, 'end', short(low, 3)) +
      text(50, height - 5, 'start', short(first, 3) + ' s') +
      text(width - 10, height - 5, 'end', short(last, 3) + ' s') + '</svg>';
  const names = curves.map((curve, i) => element('span', {class: 'line' + i % 6}, curve.line + ' '));
  figure.append(element('figcaption', {}, label + ' ', ...names));
  return figure;
}
