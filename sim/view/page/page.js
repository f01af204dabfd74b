// The page: its data, controls, values under the pointer, time, and what comes by events.

class Page {
  constructor(data) {
    this.data = data;
    this.maps = bytes_of(data.maps);
    this.quantities = data.quantities?.map(own => ({number: 0, digits: 3, ...own})) || QUANTITIES;
    this.state = {
      quantity: data.quantities || this.starts_with_radiation() ? 0 : 1,
      cap: 1,
      method: 'all',
      shown: new Set(data.array ? ['array'] : []),
      skin: 0
    };
    this.skins = data.skins.map(() => null);
    this.planes = data.fields.map(field => this.plane(field));
    this.build();
    this.viewer = new Viewer(this.canvas, this.maps);
    if (data.array)
      this.array = {
        positions: numbers(data.array.positions),
        axes: numbers(data.array.axes),
        radius: data.array.radius
      };
    new ResizeObserver(() => this.resize()).observe(this.stage);
    if (data.skins.length)
      this.begin();
    else if (!data.live)
      this.without_skin();
    if (data.live) this.listen();
  }
  // Where every method that has a pressure has a radiation pressure too.
  starts_with_radiation() {
    const {tops, skins} = this.data, known = skins.flatMap(skin => skin.methods);
    return tops.radiation !== undefined && known.every(method => !method || method.radiation);
  }
  begin() {
    const sounds = skin => skin.methods.some(method => Object.values(method || {}).some(values => values.high > 0));
    this.show_skin(Math.max(0, this.data.skins.findIndex(sounds)));
    this.slider.value = this.state.skin;
    this.view(this.skin.outline ? 'target' : 'skin');
  }
  // A file that keeps no skins has its diagrams.
  without_skin() {
    this.stage.replaceChildren('This file keeps no skins: compute the scene again to see the hand.');
    for (const controls of document.querySelectorAll('.controls, .scale')) controls.hidden = true;
    this.draw_diagrams();
    document.documentElement.dataset.ready = Math.round(performance.now());
  }
  // The skin of a number, made from the data when it is first shown.
  decoded(number) {
    if (this.skins[number]) return this.skins[number];
    const source = this.data.skins[number], faces = this.faces(number, skin => skin);
    const skin = {mesh: new Skin(numbers(source.vertices), faces), time: source.time, source, values: new Map()};
    if (source.sensed) skin.sensed = new Skin(numbers(source.sensed.vertices), this.faces(number, skin => skin.sensed));
    if (source.outline) skin.outline = numbers(source.outline);
    if (source.wanted) {
      const corners = numbers(source.wanted.corners);
      skin.wanted = new Skin(corners, Uint32Array.from({length: corners.length / 3}, (_, i) => i));
      skin.wanted.p = numbers(source.wanted.p);
    }
    return this.skins[number] = skin;
  }
  // They are written where they change.
  faces(number, mesh_of) {
    const mesh = mesh_of(this.data.skins[number]);
    return mesh && mesh.faces ? numbers(mesh.faces) : this.faces(number - 1, mesh_of);
  }
  // Values of the faces of one method, and what the picture interpolates.
  values(skin, method, quantity) {
    const key = method + ' ' + quantity.key, source = skin.source.methods[method];
    if (!skin.values.has(key) && source) {
      const sounds = quantity.key === 'p' || quantity.key === 'phase', turn = sounds && phases(source.phase);
      const packed = source[sounds ? 'p' : quantity.key], own = packed && numbers(packed);
      skin.values.set(
          key, own && {name: key, faces: quantity.key === 'phase' ? turn : own, data: skin.mesh.smooth(own, turn)});
    }
    return skin.values.get(key);
  }
  get quantity() {
    return this.quantities[this.state.quantity];
  }
  top() {
    const {top, key} = this.quantity;
    return (top || this.data.tops[key === 'radiation' ? key : 'pressure']) * this.state.cap;
  }
  wanted_value(p) {
    return this.quantity.key === 'radiation' ? this.data.radiation_per_square * p * p : p;
  }
  wanted_patch(skin) {
    if (!skin.wanted || this.quantity.key === 'phase') return null;
    const patch = skin.wanted;
    if (patch.of === this.quantity.key) return patch;
    patch.of = this.quantity.key;
    patch.values = new Float32Array(patch.vertices.length);
    for (let v = 0; v < patch.vertices.length; v += 3) patch.values[v] = this.wanted_value(patch.p[v / 9 | 0]);
    return patch;
  }
  plane(field) {
    const normal = field.count.indexOf(1), [a, b] = [0, 1, 2].filter(i => i !== normal),
          axis = (i, length) => [0, 1, 2].map(k => k === i ? length : 0);
    const corner = field.origin.map((x, i) => i === normal ? x : x - 0.5 * field.spacing[i]);
    return {
      field,
      corner,
      across: axis(a, field.count[a] * field.spacing[a]),
      along: axis(b, field.count[b] * field.spacing[b]),
      width: field.count[a],
      height: field.count[b],
      textures: new Map()
    };
  }
  plane_texture(plane, method) {
    const source = plane.field.methods[method], gl = this.viewer.gl;
    if (source && !plane.textures.has(method)) {
      const p = numbers(source.p), turn = phases(source.phase), pixels = new Float32Array(4 * p.length);
      p.forEach(
          (value, i) =>
              pixels.set(Number.isNaN(value) ? [0, 0, 0, 0] : [value, Math.cos(turn[i]), Math.sin(turn[i]), 1], 4 * i));
      plane.textures.set(
          method, this.viewer.texture(gl.RGBA32F, plane.width, plane.height, gl.RGBA, gl.FLOAT, pixels, gl.NEAREST));
    }
    return plane.textures.get(method);
  }
  build() {
    const {data, state} = this, option = (value, text) => element('option', {value}, text);
    const select = (label, id, options, changed) => element(
        'label', {}, label,
        element(
            'select', {
              id,
              onchange: e => {
                changed(e.target.value);
                this.update();
              }
            },
            ...options));
    const button = (text, act) => element('button', {type: 'button', onclick: act}, text);
    const check = (text, key) => element(
        'label', {}, element('input', {
          type: 'checkbox',
          id: 'show-' + key,
          checked: state.shown.has(key),
          onchange: e => {
            state.shown[e.target.checked ? 'add' : 'delete'](key);
            if (e.target.checked && key.startsWith('plane') &&
                this.quantity.key === 'radiation') {  // defined on skin alone
              state.quantity = document.getElementById('quantity').value = 1;
            }
            this.update();
          }
        }),
        text);
    const quantities = this.quantities.map((q, i) => option(i, `${q.name} [${q.unit}]`))
                           .slice(data.quantities || data.tops.radiation !== undefined ? 0 : 1);
    const methods = [option('all', 'side by side'), ...data.methods.map((m, i) => option(i, m.name))];
    if (data.live || data.skins.some(skin => skin.wanted)) methods.push(option('wanted', 'wanted'));
    if (window.innerWidth < 700 && data.methods.length > 2) state.method = String(0);
    this.canvas = element('canvas', {
      tabindex: 0,
      role: 'img',
      'aria-label':
          'the skin in 3D; arrows turn it, shift and arrows move it, + and - zoom, Enter reads the value in the middle'
    });
    this.labels = element('div', {id: 'labels', 'aria-hidden': 'true'});
    this.tip = element('output', {id: 'tip', 'aria-live': 'polite', hidden: true});
    this.stage = element('div', {id: 'stage'}, this.canvas, this.labels, this.tip);
    this.bar = element('canvas', {id: 'bar', width: 256, height: 1});
    this.ends = [element('span'), element('span')];
    this.cap = element('input', {
      type: 'range',
      id: 'cap',
      min: -2,
      max: 1,
      step: 0.05,
      value: 0,
      'aria-label': 'end of the colours',
      oninput: e => {
        state.cap = 2 ** e.target.value;
        this.update();
      }
    });
    const targets = data.live || data.skins.some(skin => skin.outline);
    const planes = data.fields.map((field, i) => check('plane ' + field.name, 'plane' + i));
    const moving = data.skins.some(skin => skin.sensed) ? [check('hand as sensed', 'sensed')] : [];
    document.getElementById('view').append(
        element(
            'div', {class: 'controls'},
            select(
                'show ', 'quantity', quantities,
                value => {
                  state.quantity = Number(value);
                }),
            select(
                'methods ', 'method', methods,
                value => {
                  state.method = value;
                }),
            element(
                'span', {},
                ...[['target', data.quantities ? 'patch' : 'target'], ['skin', 'whole skin'], ['behind', 'from behind'],
                    ['side', 'with the array']]
                    .filter(([key]) => (data.array || key !== 'side') && (targets || key !== 'target'))
                    .map(([key, text]) => button(text, () => this.view(key)))),
            ...(data.array ? [check('array', 'array')] : []), ...moving, ...planes),
        this.stage,
        element(
            'div', {class: 'scale'}, element('span', {id: 'unit'}), this.ends[0], this.bar, this.ends[1],
            element('label', {}, 'end of the colours ', this.cap)),
        this.build_time(button), this.diagrams = element('div', {id: 'diagrams'}));
    document.getElementById('method').value = state.method;
    document.getElementById('quantity').value = state.quantity;
    this.listen_to_hands();
  }
  build_time(button) {
    const {data} = this;
    this.slider = element('input', {
      type: 'range',
      id: 'time',
      min: 0,
      max: Math.max(data.skins.length - 1, 0),
      step: 1,
      value: 0,
      'aria-label': 'time',
      oninput: e => {
        this.show_skin(Number(e.target.value));
        this.update();
      }
    });
    this.clock = element('span', {id: 'clock'});
    this.play = button('play', () => this.toggle_play());
    return element(
        'div', {class: 'controls', hidden: data.skins.length < 2 && !data.live},
        ...(data.live ? [] : [this.play, this.slider]), this.clock);
  }
  toggle_play() {
    if (this.timer) {
      clearTimeout(this.timer);
      this.timer = null;
    } else {
      const step = () => {
        const {skins} = this.data, next = (this.state.skin + 1) % skins.length;
        this.slider.value = next;
        this.show_skin(next);
        this.update();
        const gap = next + 1 < skins.length ? skins[next + 1].time - skins[next].time : 0.5;
        this.timer = setTimeout(step, 1000 * Math.max(gap, 0.1));  // slower than it was where frames are closer
      };
      this.timer = setTimeout(step, 0);
    }
    this.play.textContent = this.timer ? 'stop' : 'play';
  }
  show_skin(number) {
    const before = this.skin;
    this.state.skin = number;
    this.skin = this.decoded(number);
    if (this.follows && before.outline && this.skin.outline) {
      const sum = (points, i) => points.reduce((sum, x, k) => k % 3 === i ? sum + x : sum, 0);
      const middle = points => [0, 1, 2].map(i => 3 * sum(points, i) / points.length);
      const [from, to] = [before.outline, this.skin.outline].map(middle), {camera} = this.viewer;
      camera.centre = camera.centre.map((x, i) => x + to[i] - from[i]);
    }
    this.draw_diagrams();
  }
  // The direction of sight and what fills the cells.
  view(key) {
    if (!this.skin) return;
    const {facing} = this.data, {mesh, outline} = this.skin;
    this.follows = key === 'target';  // which moves in a motion
    const away = Math.abs(facing[2]) < 0.9 ? [0, 0, 1] : [0, 1, 0], across = unit(cross(facing, away));
    const skewed = unit([0, 1, 2].map(i => 0.9 * away[i] - 0.35 * across[i] - 0.35 * facing[i]));
    const all = this.array ? Float32Array.from([...mesh.vertices, ...this.array.positions]) : mesh.vertices;
    if (key === 'side')
      this.viewer.look(skewed, all, 0.85, facing.map(x => (dot(facing, [0, 0, 1]) < 0 ? -x : x)));
    else
      this.viewer.look(
          key === 'behind' ? facing.map(x => -x) : facing, key === 'target' && outline ? outline : mesh.vertices,
          key === 'target' && outline ? (this.data.live ? 0.2 : 0.45) : 0.8);  // live, the target goes about
    this.update();
  }
  update() {
    if (this.pending || !this.skin) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = null;
      this.draw();
    });
  }
  get density() {
    return window.devicePixelRatio || 1;
  }
  resize() {
    this.canvas.width = Math.round(this.stage.clientWidth * this.density);
    this.canvas.height = Math.round(this.stage.clientHeight * this.density);
    this.update();
  }
  draw() {
    const {state, viewer, data, skin, quantity} = this, wanted = {name: 'wanted', method: -1};
    const methods = data.methods.map((m, method) => ({...m, method}));
    const all = [...(skin.wanted || !methods.length ? [wanted] : []), ...methods];
    if (!skin.wanted && !methods.length) wanted.name = 'skin';
    viewer.cells = state.method === 'all' ? all : state.method === 'wanted' ? [wanted] : [methods[state.method]];
    for (const cell of viewer.cells) {
      const shown = quantity.key === 'radiation' ? [] : this.planes.filter((_, i) => state.shown.has('plane' + i));
      cell.planes = shown.map(plane => ({...plane, texture: this.plane_texture(plane, cell.method)}))
                        .filter(plane => plane.texture);
      cell.patch = cell.method < 0 ? this.wanted_patch(skin) : null;
      cell.values = this.silent ? null : this.values(skin, cell.method, quantity);
      cell.caption = this.caption(cell);
      if (cell.method >= 0 ? !cell.values : quantity.key === 'phase') cell.paint = [0.7, 0.72, 0.74, 1];
    }
    viewer.density = this.density;
    viewer.depth = 1.5;
    viewer.colours = {quantity: quantity.number, top: this.top()};
    viewer.draw({
      skin: skin.mesh,
      outline: skin.outline,
      array: state.shown.has('array') ? this.array : null,
      sensed: state.shown.has('sensed') ? skin.sensed : null
    });
    this.label();
    if (!this.tip.hidden) this.read(...this.tip_at);
    const {dataset} = document.documentElement;
    dataset.ready = dataset.ready || Math.round(performance.now());
    dataset.frames = 1 + Number(dataset.frames || 0);
  }
  caption({name, method, values, caption}) {
    const {quantity} = this, {wanted} = this.skin.source;
    if (method >= 0) return values ? caption || '' : this.silent ? 'silent' : 'not computed';
    if (!wanted) return name === 'skin' ? '' : 'no skin in the target';
    return quantity.key === 'phase' ? 'has no phase' :
                                      `${this.converted(this.wanted_value(wanted.most))} ${quantity.unit}`;
  }
  converted(value, digits = 3) {
    const {of, scale} = this.quantity;
    return short(of ? of(value) : value * scale, digits);
  }
  label() {
    const {viewer, quantity, data, density} = this;
    this.labels.replaceChildren(...viewer.cells.map((cell, i) => {
      const [x, y, width] = viewer.cell_box(i).map(value => value / density);
      return element(
          'div', {style: `left:${x}px;top:${y}px;max-width:${width}px`}, element('b', {}, cell.name), element('br'),
          cell.caption);
    }));
    // The bar's lower end as a share of its upper one; what is below 0 is suction.
    const top = this.top(), ranges = this.skin.source.methods.map(m => m && m[quantity.key] || {});
    const most = Math.max(...ranges.map(range => range.high || 0));
    const lows = quantity.key === 'radiation' ? ranges.map(range => range.low || 0) : [];
    const from = Math.max(-1, Math.min(0, ...lows) / top);
    document.getElementById('unit').textContent = `${quantity.name} [${quantity.unit}]`;
    this.ends[0].textContent = quantity.key === 'phase' ? '-180' :
        quantity.of                                     ? short(quantity.of(top) - LEVELS, 3) :
                                                          this.converted(from * top);
    this.ends[1].textContent =
        quantity.key === 'phase' ? '180' : this.converted(top) + (most > top ? ` (up to ${this.converted(most)})` : '');
    const pixels = new ImageData(256, 1);
    for (let i = 0; i < 256; ++i) {
      const share = from + (1 - from) * (i + 0.5) / 256,
            at = 3 * (quantity.key === 'phase' ? 512 + 2 * i : Math.floor(256 + 255.5 * share));
      pixels.data.set([...this.maps.subarray(at, at + 3), 255], 4 * i);
    }
    this.bar.getContext('2d').putImageData(pixels, 0, 0);
    this.cap.setAttribute('aria-valuetext', this.ends[1].textContent + ' ' + quantity.unit);
    this.slider.setAttribute('aria-valuetext', `${short(this.skin.time, 4)} s`);
    this.clock.textContent = this.note || (data.skins.length > 1 ? `${short(this.skin.time, 4)} s` : '');
  }
  // The value under a place of the stage [CSS pixels]; of a key, at that place in every cell.
  read(x, y, everywhere = false) {
    if (!this.skin) return;
    const hit = this.viewer.pick(x * this.density, y * this.density), {cells} = this.viewer, {quantity} = this;
    this.tip_at = [x, y, everywhere];
    this.tip.hidden = !hit;
    if (!hit) return;
    const value = ({method, values}) => method < 0 ? this.wanted_at(hit) : values ? values.faces[hit.face] : NaN;
    const read = everywhere ? cells : [cells[hit.cell]];
    Object.assign(this.tip.dataset, {face: hit.face, value: value(read[0]), method: read[0].name});
    this.tip.textContent =
        read.map(cell => `${cell.name}: ${this.converted(value(cell), quantity.digits)} ${quantity.unit}`).join('; ') +
        ` at ${hit.at.map(v => (1e3 * v).toFixed(1)).join(', ')} mm`;
    this.tip.style.left = Math.max(2, Math.min(x + 12, this.stage.clientWidth - this.tip.offsetWidth - 4)) + 'px';
    this.tip.style.top = Math.max(y - 34, 2) + 'px';
  }
  // The wanted value at a place: that of the piece of the target which holds it.
  wanted_at(hit) {
    const patch = this.skin.wanted, main = this.viewer.scene.skin;
    if (!patch || this.quantity.key === 'phase') return NaN;
    this.viewer.scene.skin = patch;
    const {camera} = this.viewer, d = hit.at.map((x, i) => x - camera.centre[i]),
          [left, top, width, height] = this.viewer.cell_box(hit.cell);
    const scale = 2 * camera.half / Math.min(width, height);
    const piece = this.viewer.pick(
        left + 0.5 * width + dot(camera.frame[0], d) / scale, top + 0.5 * height - dot(camera.frame[1], d) / scale);
    this.viewer.scene.skin = main;
    return piece && Math.abs(piece.near - hit.near) < 3e-4 ? this.wanted_value(patch.p[piece.face]) : 0;
  }
  listen_to_hands() {
    const {canvas} = this, held = new Map(), size = () => Math.min(...this.viewer.cell_size()) / this.density;
    canvas.addEventListener('pointerdown', e => {
      canvas.setPointerCapture(e.pointerId);
      this.read(e.offsetX, e.offsetY);
      held.set(e.pointerId, e);
    });
    for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, e => held.delete(e.pointerId));
    canvas.addEventListener('pointerleave', e => {
      if (e.pointerType === 'mouse') this.tip.hidden = true;
    });
    canvas.addEventListener('pointermove', e => {
      const before = held.get(e.pointerId);
      if (before) {
        const [dx, dy] = [(e.offsetX - before.offsetX) / size(), (before.offsetY - e.offsetY) / size()];
        const other = [...held.values()].find(p => p.pointerId !== e.pointerId);
        if (other) {
          const gap = p => Math.hypot(p.offsetX - other.offsetX, p.offsetY - other.offsetY);
          this.viewer.zoom(gap(e) / Math.max(gap(before), 1));
          this.viewer.shift(dx / 2, dy / 2);
        } else if (e.shiftKey || e.buttons === 4)
          this.viewer.shift(dx, dy);
        else
          this.viewer.turn(3 * dx, 3 * dy);
        held.set(e.pointerId, e);
        this.update();
      }
      if (held.size < 2) this.read(e.offsetX, e.offsetY);
    });
    canvas.addEventListener('wheel', e => {
      e.preventDefault();
      this.viewer.zoom(Math.exp(-0.0015 * e.deltaY));
      this.update();
    }, {passive: false});
    canvas.addEventListener('keydown', e => {
      const arrow = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[e.key];
      if (arrow)
        this.viewer[e.shiftKey ? 'shift' : 'turn'](0.1 * arrow[0], 0.1 * arrow[1]);
      else if (e.key === '+' || e.key === '=' || e.key === '-')
        this.viewer.zoom(e.key === '-' ? 1 / 1.2 : 1.2);
      else if (e.key === 'Enter') {
        const [x, y, width, height] = this.viewer.cell_box(0).map(value => value / this.density);
        this.read(x + width / 2, y + height / 2, true);
      } else
        return;
      e.preventDefault();
      this.update();
    });
  }
  draw_diagrams() {
    const {curves, skins} = this.data, labels = [...new Set(curves.map(curve => curve.label))];
    const now = this.skin && skins.length > 1 ? this.skin.time : NaN;
    this.diagrams.replaceChildren(
        ...labels.map(label => diagram(label, curves.filter(curve => curve.label === label), now)));
  }
  listen() {
    const events = new EventSource('events');
    events.onmessage = event => this.live_frame(JSON.parse(event.data));
    events.addEventListener('end', event => {
      this.note = event.data;
      events.close();
      this.update();
    });
    events.onerror = () => {
      this.note = events.readyState === EventSource.CLOSED ?
          'refused: 8 viewers watch already; close one and load this page again' :
          'no connection; waiting for the loop';
      this.update();
    };
  }
  live_frame(message) {
    if (message.live !== this.data.live) return location.reload();  // another loop has taken the port
    const first = !this.skin;
    this.note = message.state;
    this.silent = !message.sounds;
    this.data.tops = message.tops;
    for (const [label, value] of Object.entries(message.strips)) {
      let curve = this.data.curves.find(own => own.label === label);
      if (!curve) this.data.curves.push(curve = {label, line: '', times: [], values: []});
      curve.times.push(message.time);
      curve.values.push(value);
      while (curve.times[0] < message.time - 10) {
        curve.times.shift();
        curve.values.shift();
      }
    }
    if (message.skin) {
      this.skins = [null];
      this.data.skins = [message.skin];
      first ? this.begin() : this.show_skin(0);
    } else
      this.draw_diagrams();
    this.update();
  }
}

try {
  window.page = new Page(JSON.parse(document.getElementById('data').textContent));
  page.canvas.addEventListener(
      'webglcontextlost', () => show_instead('the browser has lost its graphics context; load the page again'));
} catch (error) {
  show_instead(error.message);
}
