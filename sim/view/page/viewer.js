'use strict';
// A skin in 3D, in cells of one canvas that share a camera. Lengths in metres; parallel projection.
const SEEN = `#version 300 es
precision highp float; precision highp int;
uniform mat3 frame; uniform vec3 centre; uniform vec2 half_size; uniform float depth; uniform float nearer;
vec4 seen(vec3 x) { vec3 d = frame * (x - centre); return vec4(d.xy / half_size, -d.z / depth - nearer, 1.0); }
`;
const COLOURED = `#version 300 es
precision highp float; precision highp int;
uniform sampler2D maps; uniform int quantity; uniform float top; uniform vec4 paint; out vec4 colour;
vec3 coloured(vec3 value) {  // |p|, cosine and sine of the phase; or P, the share of faces without it
  if (quantity == 0 && value.y > 0.5) return vec3(0.72);
  if (quantity == 3) return texture(maps, vec2(0.5 + atan(value.z, value.y) / 6.2831853, 0.75)).rgb;
  float share = quantity == 2 ? clamp(1.0 + log(max(value.x, 1e-9) / top) / 2.302585 * 20.0 / LEVELS, 0.0, 1.0)
                              : clamp(value.x / top, -1.0, 1.0);
  return texture(maps, vec2(0.5 + 0.499 * share, 0.25)).rgb;
}
`;
const LEVELS = 40;  // dB from the bottom to the top of the colours
const SKIN = [
  SEEN + `in vec3 at; in vec3 normal; in vec3 value; out vec3 v; out vec3 n; out vec3 x;
void main() { v = value; n = frame * normal; x = frame * (at - centre); gl_Position = seen(at); }`,
  COLOURED + `in vec3 v; in vec3 n; in vec3 x;
void main() {
  vec3 flat_normal = normalize(cross(dFdx(x), dFdy(x))), smooth_normal = normalize(n);
  vec3 normal = dot(flat_normal, smooth_normal) > 0.6 ? smooth_normal : flat_normal;
  float light = 0.66 + 0.34 * abs(normal.z);
  colour = paint.a > 0.0 ? vec4(paint.rgb * light, paint.a) : vec4(coloured(v) * light, 1.0);
}`
];
const LINE = [
  SEEN + `in vec3 begin; in vec3 end; uniform vec2 pixels; uniform float width;
void main() {
  vec4 a = seen(begin), b = seen(end);
  vec2 along = normalize((b.xy - a.xy) * pixels + vec2(1e-6, 0.0)), side = vec2(-along.y, along.x);
  bool last = gl_VertexID % 4 > 1;
  gl_Position = last ? b : a;
  vec2 out_of_line = side * (gl_VertexID % 2 == 0 ? 1.0 : -1.0) + along * (last ? 0.5 : -0.5);
  gl_Position.xy += out_of_line * width / pixels;
}`,
  COLOURED + 'void main() { colour = paint; }'
];
const DISC = [
  SEEN + `in vec3 begin; in vec3 end; uniform vec2 pixels; uniform float width; out vec3 n;
void main() {
  n = frame * end;
  gl_Position = seen(begin);
  gl_PointSize = width / half_size.x * pixels.x;
}`,
  COLOURED + `in vec3 n;
void main() {
  vec2 x = 2.0 * gl_PointCoord - 1.0, along = vec2(n.x, -n.y) / max(n.z, 1e-3);
  if (n.z <= 0.0 || dot(x, x) + dot(x, along) * dot(x, along) > 1.0) discard;  // seen from behind: nothing
  colour = vec4(paint.rgb * (0.6 + 0.4 * n.z), 1.0);
}`
];
const PLANE = [
  SEEN + `uniform vec3 corner; uniform vec3 across; uniform vec3 along; out vec2 share;
void main() {
  share = vec2(gl_VertexID % 2, gl_VertexID / 2);
  gl_Position = seen(corner + share.x * across + share.y * along);
}`,
  COLOURED + `uniform sampler2D values; in vec2 share;
void main() {
  vec4 value = texture(values, share);
  if (value.a < 0.5) discard;
  colour = vec4(coloured(value.xyz), 1.0);
}`
];

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = a => a.map(x => x / (Math.hypot(...a) || 1));

// The sum over the faces at each vertex of size * value(face, i), and of the sizes.
function gathered(faces, vertices, sizes, width, value) {
  const sums = new Float32Array(width * vertices), weights = new Float32Array(vertices);
  for (let f = 0; f < sizes.length; ++f) {
    for (let c = 3 * f; c < 3 * f + 3; ++c) {
      weights[faces[c]] += sizes[f];
      for (let i = 0; i < width; ++i) sums[width * faces[c] + i] += sizes[f] * value(f, i);
    }
  }
  return {sums, weights};
}

// Whether the browser has no graphics card to draw with.
function drawn_by_software() {
  const gl = document.createElement('canvas').getContext('webgl2'), own = gl?.getExtension('WEBGL_debug_renderer_info');
  return /swiftshader|llvmpipe|software/i.test(gl?.getParameter(own ? own.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
}

// Faces in an order in which neighbours follow each other, in pieces of 256 with a ball around each: what is out of
// sight is not drawn.
function pieces_of(vertices, faces) {
  const low = [0, 1, 2].map(i => vertices.reduce((least, x, k) => k % 3 === i ? Math.min(least, x) : least, Infinity));
  const spread = x => [16, 8, 4, 2].reduce(
      (bits, by, k) => (bits | bits << by) & [0x30000ff, 0x300f00f, 0x30c30c3, 0x9249249][k], x);
  const keys = new Uint32Array(faces.length / 3);
  for (let f = 0; f < keys.length; ++f) {
    const cells = low.map((least, i) => Math.min(1023, (vertices[3 * faces[3 * f] + i] - least) * 1500));
    keys[f] = cells.reduce((key, cell, i) => key | spread(cell) << i, 0);
  }
  const order = Uint32Array.from(keys.keys()).sort((a, b) => keys[a] - keys[b]), size = 256;
  const sorted = faces.map((_, k) => faces[3 * order[k / 3 | 0] + k % 3]), pieces = [];
  for (let begin = 0; begin < sorted.length; begin += 3 * size) {
    const own = sorted.subarray(begin, begin + 3 * size);
    const at = v => vertices.subarray(3 * v, 3 * v + 3),
          centre = [0, 1, 2].map(i => own.reduce((sum, v) => sum + at(v)[i], 0) / own.length);
    const radius = own.reduce((most, v) => Math.max(most, Math.hypot(...centre.map((x, i) => x - at(v)[i]))), 0);
    pieces.push({begin, end: begin + own.length, centre, radius});
  }
  return {sorted, pieces};
}

class Skin {
  constructor(vertices, faces) {
    Object.assign(this, {vertices, faces, count: vertices.length / 3, areas: new Float32Array(faces.length / 3)});
    const normals = new Float32Array(faces.length);
    for (let f = 0; f < this.areas.length; ++f) {
      const [a, b, c] = [0, 1, 2].map(k => vertices.subarray(3 * faces[3 * f + k], 3 * faces[3 * f + k] + 3));
      const n = cross([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
      this.areas[f] = Math.hypot(...n) || 1e-20;
      for (let i = 0; i < 3; ++i) normals[3 * f + i] = n[i] / this.areas[f];
    }
    Object.assign(this, pieces_of(vertices, faces));
    this.normals = gathered(faces, this.count, this.areas, 3, (f, i) => normals[3 * f + i]).sums;
  }
  // Values of the faces, averaged by area to the vertices: value, and cosine and sine of the phase or the share of NaN.
  smooth(values, phases) {
    const {sums, weights} = gathered(
        this.faces, this.count, this.areas, 3,
        (f, i) => i === 0 ? values[f] || 0 :
            phases        ? values[f] * (i === 1 ? Math.cos(phases[f]) : Math.sin(phases[f])) :
                            Number(Number.isNaN(values[f])));
    for (let v = 0; v < sums.length; ++v) sums[v] /= weights[Math.floor(v / 3)] || 1;
    return sums;
  }
}

class Viewer {
  constructor(canvas, maps) {
    const gl = canvas.getContext('webgl2', {antialias: !drawn_by_software(), preserveDrawingBuffer: true});
    if (!gl) throw new Error('this browser has no WebGL 2, or it is switched off');
    Object.assign(
        this, {canvas, gl, cells: [], buffers: new Map(), camera: {frame: null, centre: [0, 0, 0], half: 0.1}});
    [this.skin_program, this.line_program, this.disc_program, this.plane_program] =
        [SKIN, LINE, DISC, PLANE].map(sources => this.program(sources));
    this.maps = this.texture(gl.RGB8, maps.length / 6, 2, gl.RGB, gl.UNSIGNED_BYTE, maps, gl.LINEAR);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.SCISSOR_TEST);
  }
  program(sources) {
    const gl = this.gl, program = gl.createProgram();
    sources.forEach((source, i) => {
      const shader = gl.createShader(i ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
      gl.shaderSource(shader, source.replaceAll('LEVELS', LEVELS.toFixed(1)));
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    });
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error('WebGL 2: ' + gl.getProgramInfoLog(program));
    const uniforms = {}, inputs = {};
    for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); ++i) {
      const name = gl.getActiveUniform(program, i).name;
      uniforms[name] = gl.getUniformLocation(program, name);
    }
    for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_ATTRIBUTES); ++i) {
      const name = gl.getActiveAttrib(program, i).name;
      if (!name.startsWith('gl_')) inputs[name] = gl.getAttribLocation(program, name);
    }
    return {program, uniforms, inputs};
  }
  texture(kind, width, height, format, type, data, filter) {
    const gl = this.gl, texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, kind, width, height, 0, format, type, data);
    for (const name of ['TEXTURE_MIN_FILTER', 'TEXTURE_MAG_FILTER']) gl.texParameteri(gl.TEXTURE_2D, gl[name], filter);
    for (const name of ['TEXTURE_WRAP_S', 'TEXTURE_WRAP_T'])
      gl.texParameteri(gl.TEXTURE_2D, gl[name], gl.CLAMP_TO_EDGE);
    return texture;
  }
  // A buffer of this name, filled with an array unless it holds that one.
  buffer(name, data, target = this.gl.ARRAY_BUFFER) {
    const gl = this.gl, own = this.buffers.get(name) || {buffer: gl.createBuffer()};
    this.buffers.set(name, own);
    gl.bindBuffer(target, own.buffer);
    if (own.data !== data) gl.bufferData(target, data, gl.DYNAMIC_DRAW);
    own.data = data;
  }
  use(program, uniforms) {
    const gl = this.gl, {frame, centre} = this.camera;
    gl.useProgram(program.program);
    const all = {
      frame,
      centre,
      half_size: this.half_size(),
      depth: this.depth,
      nearer: 0,
      pixels: this.cell_size(),
      maps: 0,
      values: 1,
      paint: [0, 0, 0, 0],
      ...this.colours,
      ...uniforms
    };
    for (const [name, location] of Object.entries(program.uniforms)) {
      const value = all[name];
      if (['maps', 'values', 'quantity'].includes(name))
        gl.uniform1i(location, value);
      else if (name === 'frame')
        gl.uniformMatrix3fv(location, true, value.flat());
      else if (value.length === undefined)
        gl.uniform1f(location, value);
      else
        gl[`uniform${value.length}fv`](location, value);
    }
  }
  input(program, name, buffer, data, stride = 0, offset = 0) {
    const gl = this.gl, location = program.inputs[name];
    if (location === undefined) return;
    this.buffer(buffer, data);
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, 3, gl.FLOAT, false, stride, offset);
  }
  draw_skin(name, skin, values, uniforms) {
    const gl = this.gl, program = this.skin_program;
    this.use(program, uniforms);
    this.input(program, 'at', name + ' vertices', skin.vertices);
    this.input(program, 'normal', name + ' normals', skin.normals);
    if (values) {
      this.input(program, 'value', name + ' ' + values.name, values.data);
    } else {
      gl.disableVertexAttribArray(program.inputs.value);
      gl.vertexAttrib3f(program.inputs.value, 0, 1, 0);
    }
    this.buffer(name + ' faces', skin.sorted, gl.ELEMENT_ARRAY_BUFFER);
    const bytes = skin.sorted.BYTES_PER_ELEMENT, type = bytes === 2 ? gl.UNSIGNED_SHORT : gl.UNSIGNED_INT;
    const {frame, centre} = this.camera, sides = this.half_size();
    const seen = skin.pieces.map(
        piece => [0, 1].every(
            a => Math.abs(dot(frame[a], piece.centre) - dot(frame[a], centre)) < sides[a] + piece.radius));
    for (let first = 0; first < seen.length; ++first) {
      if (!seen[first]) continue;
      let last = first;
      while (seen[last + 1]) ++last;
      const {begin} = skin.pieces[first], {end} = skin.pieces[last];
      gl.drawElements(gl.TRIANGLES, end - begin, type, begin * bytes);
      first = last;
    }
  }
  // Pieces of lines, [begin, end] one behind another, as rectangles. (Instances are slow without a graphics card.)
  draw_lines(name, lines, uniforms) {
    const gl = this.gl, program = this.line_program, count = lines.length / 6;
    const own = this.strokes?.of === lines ? this.strokes : {of: lines, corners: new Float32Array(4 * lines.length)};
    if (own !== this.strokes) {
      own.faces = Uint32Array.from({length: 6 * count}, (_, i) => 4 * (i / 6 | 0) + [0, 1, 2, 2, 1, 3][i % 6]);
      for (let k = 0; k < 4 * count; ++k) own.corners.set(lines.subarray(6 * (k >> 2), 6 * (k >> 2) + 6), 6 * k);
      this.strokes = own;
    }
    this.use(program, uniforms);
    this.input(program, 'begin', name, own.corners, 24, 0);
    this.input(program, 'end', name, own.corners, 24, 12);
    this.buffer(name + ' faces', own.faces, gl.ELEMENT_ARRAY_BUFFER);
    gl.drawElements(gl.TRIANGLES, 6 * count, gl.UNSIGNED_INT, 0);
  }
  draw_cell(scene, cell) {
    const gl = this.gl;
    gl.disable(gl.BLEND);
    gl.enable(gl.CULL_FACE);
    this.draw_skin('skin', scene.skin, cell.values, cell.paint ? {paint: cell.paint} : {});
    if (cell.patch) this.draw_skin('wanted', cell.patch, {name: 'patch', data: cell.patch.values}, {nearer: 2e-5});
    gl.disable(gl.CULL_FACE);
    const back = this.camera.frame[2],
          from_front = (x, k, axes) => k % 3 === 2 && axes[k - 2] * back[0] + axes[k - 1] * back[1] + x * back[2] > 0;
    if (scene.array?.axes.some(from_front)) {
      this.use(this.disc_program, {width: scene.array.radius, paint: [0.56, 0.6, 0.66, 1]});
      this.input(this.disc_program, 'begin', 'array positions', scene.array.positions);
      this.input(this.disc_program, 'end', 'array axes', scene.array.axes);
      gl.drawArrays(gl.POINTS, 0, scene.array.axes.length / 3);
    }
    for (const plane of cell.planes || []) {
      gl.activeTexture(gl.TEXTURE1);
      gl.bindTexture(gl.TEXTURE_2D, plane.texture);
      gl.activeTexture(gl.TEXTURE0);
      this.use(this.plane_program, plane);
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    }
    if (scene.outline) {
      for (const [width, paint] of [[4, [1, 1, 1, 1]], [2, [0, 0.47, 0.31, 1]]]) {
        this.draw_lines(
            'outline', scene.outline, {width: width * this.density, paint, nearer: width === 2 ? 3e-4 : 2e-4});
      }
    }
    if (scene.sensed) {
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
      this.draw_skin('sensed', scene.sensed, null, {paint: [0.1, 0.35, 0.8, 0.35]});
    }
  }
  // Columns and rows that leave each of n cells the most room.
  layout() {
    const {width, height} = this.canvas, n = this.cells.length;
    const sizes = Array.from({length: n}, (_, i) => Math.min(width / (i + 1), height / Math.ceil(n / (i + 1))));
    const columns = sizes.indexOf(Math.max(...sizes)) + 1;
    return [columns, Math.ceil(n / columns)];
  }
  cell_size() {
    const [columns, rows] = this.layout();
    return [this.canvas.width / columns, this.canvas.height / rows];
  }
  // Of a cell [m].
  half_size() {
    const [width, height] = this.cell_size(), {half} = this.camera;
    return [half * Math.max(1, width / height), half * Math.max(1, height / width)];
  }
  cell_box(i) {
    const [columns] = this.layout(), [width, height] = this.cell_size();
    return [i % columns * width, Math.floor(i / columns) * height, width, height];
  }
  draw(scene) {
    const gl = this.gl;
    this.scene = scene;
    gl.bindTexture(gl.TEXTURE_2D, this.maps);
    this.cells.forEach((cell, i) => {
      const [x, y, width, height] = this.cell_box(i).map(Math.round);
      gl.viewport(x, this.canvas.height - y - height, width, height);
      gl.scissor(x, this.canvas.height - y - height, width, height);
      gl.clearColor(1, 1, 1, 1);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      this.draw_cell(scene, cell);
    });
  }
  // Looks along `direction` at what all points [x, y, z, ...] fill, with world +y up, or +x.
  look(direction, points, share, vertical) {
    const back = unit(direction).map(x => -x), up0 = vertical || (Math.abs(back[1]) < 0.99 ? [0, 1, 0] : [1, 0, 0]);
    const right = unit(cross(up0, back)), up = cross(back, right), frame = [right, up, back];
    const low = [Infinity, Infinity, Infinity], high = low.map(x => -x);
    for (let i = 0; i < points.length; i += 3) {
      frame.forEach((axis, a) => {
        const value = dot(axis, points.subarray(i, i + 3));
        low[a] = Math.min(low[a], value);
        high[a] = Math.max(high[a], value);
      });
    }
    const middle = low.map((x, a) => 0.5 * (x + high[a]));
    this.camera = {
      frame,
      half: 0.5 * Math.max(high[0] - low[0], high[1] - low[1], 1e-3) / share,
      centre: [0, 1, 2].map(i => frame.reduce((sum, axis, a) => sum + axis[i] * middle[a], 0))
    };
  }
  turn(right, up) {  // radians
    const [x, y, z] = this.camera.frame,
                 mixed = (a, b, angle) =>
                     [a.map((v, i) => Math.cos(angle) * v + Math.sin(angle) * b[i]),
                      b.map((v, i) => Math.cos(angle) * v - Math.sin(angle) * a[i])];
    const [x1, z1] = mixed(x, z, right), [y1, z2] = mixed(y, z1, up);
    this.camera.frame = [x1, y1, z2].map(unit);
  }
  shift(right, up) {  // shares of a cell's shorter side
    const {frame, half, centre} = this.camera;
    this.camera.centre = centre.map((x, i) => x - 2 * half * (right * frame[0][i] + up * frame[1][i]));
  }
  zoom(factor) {
    this.camera.half = Math.min(Math.max(this.camera.half / factor, 1e-4), 2);
  }
  // The face under a place of the canvas [pixels of the picture], with its cell and the place on it.
  pick(x, y) {
    const i = this.cells.findIndex((_, k) => {
      const [left, top, width, height] = this.cell_box(k);
      return x >= left && x < left + width && y >= top && y < top + height;
    });
    if (i < 0) return null;
    const [left, top, width, height] = this.cell_box(i), {frame, centre, half} = this.camera;
    const scale = 2 * half / Math.min(width, height), {vertices, faces} = this.scene.skin;
    const u = (x - left - 0.5 * width) * scale + dot(frame[0], centre),
          v = (0.5 * height - y + top) * scale + dot(frame[1], centre);
    const seen = new Float32Array(vertices.length);
    for (let k = 0; k < vertices.length; k += 3) {
      const at = [vertices[k], vertices[k + 1], vertices[k + 2]];
      for (let a = 0; a < 3; ++a) seen[k + a] = dot(frame[a], at);
    }
    let found = null;
    for (let f = 0; f < faces.length; f += 3) {
      const [a, b, c] = [3 * faces[f], 3 * faces[f + 1], 3 * faces[f + 2]];
      const bx = seen[b] - seen[a], by = seen[b + 1] - seen[a + 1], cx = seen[c] - seen[a],
            cy = seen[c + 1] - seen[a + 1];
      const whole = bx * cy - by * cx, px = u - seen[a], py = v - seen[a + 1];
      const s = (px * cy - py * cx) / whole, t = (bx * py - by * px) / whole;
      const near = seen[a + 2] + s * (seen[b + 2] - seen[a + 2]) + t * (seen[c + 2] - seen[a + 2]);
      if (whole > 0 && s >= 0 && t >= 0 && s + t <= 1 && (!found || near > found.near))
        found = {face: f / 3, near, cell: i};
    }
    if (found) found.at = [0, 1, 2].map(k => u * frame[0][k] + v * frame[1][k] + found.near * frame[2][k]);
    return found;
  }
}
