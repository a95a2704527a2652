// Draws patches with WebGL 2, in parallel projection. Fields have the colours of their bar, without any shading.

const INSIDE = "#b8bdc7";  // of sections where no field is shown
const OUTLINE = "#7f8b97";
const NEARER = 0.002;  // of the depth: keeps outlines before the patches they surround

const VERTEX_SHADER = `#version 300 es
in vec3 place, normal;
in float value;
uniform vec3 extent;
uniform mat3 turn;
uniform vec2 scale, shift;
uniform float nearer;
uniform int samples;
out vec3 facing;
out vec2 parameters;
out float share;
void main() {
  vec3 seen = turn * ((place - 0.5) * extent);
  gl_Position = vec4(seen.xy * scale + shift, -0.5 * seen.z / length(extent) - nearer, 1.0);
  parameters = vec2(gl_VertexID / samples, gl_VertexID % samples) / float(samples - 1);
  facing = turn * normal;
  share = value;
}`;

const FRAGMENT_SHADER = `#version 300 es
precision highp float;
in vec3 facing;
in vec2 parameters;
in float share;
uniform sampler2D map;
uniform vec3 plain;
uniform vec2 quarter;
uniform int clip;  // 0: nothing, 1: leave the quarter out, 2: keep it alone
uniform bool mapped, lined, flat_color;
out vec4 color;
void main() {
  vec2 side = (parameters - 0.5) * (2.0 * quarter - 1.0);
  if (clip > 0 && (min(side.x, side.y) > 0.0) == (clip == 1)) discard;
  vec3 base = plain;
  if (mapped) base = texture(map, vec2(share, 0.5)).rgb;
  else if (!flat_color) base *= 0.5 + 0.5 * abs(normalize(facing).z);
  if (lined && !flat_color) {
    vec2 cell = parameters * 10.0, width = fwidth(cell);
    vec2 near = abs(cell - round(cell)) / max(width, 1e-6);
    base *= 1.0 - 0.45 * (1.0 - smoothstep(0.4, 1.3, min(near.x, near.y)));
  }
  color = vec4(base, 1.0);
}`;

function compiled(gl) {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX_SHADER], [gl.FRAGMENT_SHADER, FRAGMENT_SHADER]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  gl.useProgram(program);
  return program;
}

// The corners of the triangles of a patch of n x n points.
function triangles(n) {
  const found = new Uint32Array(6 * (n - 1) ** 2);
  let at = 0;
  for (let i = 0; i + 1 < n; i++)
    for (let j = 0; j + 1 < n; j++) {
      const a = i * n + j, b = a + n;
      found.set([a, b, b + 1, a, b + 1, a + 1], at);
      at += 6;
    }
  return found;
}

// The points along the border of a patch of n x n points, or of its quarter [side, side], once around.
function border(n, quarter) {
  const middle = (n - 1) / 2, ends = (side) => side === undefined ? [0, n - 1] : side ? [middle, n - 1] : [0, middle];
  const [[top, bottom], [left, right]] = [ends(quarter?.[0]), ends(quarter?.[1])], found = [];
  for (let j = left; j < right; j++) found.push(top * n + j);
  for (let i = top; i < bottom; i++) found.push(i * n + right);
  for (let j = right; j > left; j--) found.push(bottom * n + j);
  for (let i = bottom; i > top; i--) found.push(i * n + left);
  return new Uint32Array(found);
}

// Sums of the triangles' normals at their corners; the shader makes them unit vectors.
function normals(places, extent, corners) {
  const sums = new Float32Array(places.length);
  const edge = (from, to, axis) => (places[3 * to + axis] - places[3 * from + axis]) / 65535 * extent[axis];
  for (let t = 0; t < corners.length; t += 3) {
    const [a, b, c] = corners.subarray(t, t + 3);
    const [p, q] = [[0, 1, 2].map((k) => edge(a, b, k)), [0, 1, 2].map((k) => edge(a, c, k))];
    for (let k = 0; k < 3; k++) {
      const [i, j] = [(k + 1) % 3, (k + 2) % 3];
      const part = p[i] * q[j] - p[j] * q[i];
      for (const corner of [a, b, c]) sums[3 * corner + k] += part;
    }
  }
  return sums;
}

function rgb(color) {
  return [1, 3, 5].map((at) => parseInt(color.slice(at, at + 2), 16) / 255);
}

// Draws a scene on a canvas. `load` takes patches to the graphics card, `draw` shows them.
class Graphics {
  constructor(scene, canvas) {
    this.scene = scene;
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl2", {antialias: true, preserveDrawingBuffer: true});
    if (!this.gl) throw new Error("no WebGL 2");
    const gl = this.gl;
    this.program = compiled(gl);
    this.extent = scene.high.map((value, axis) => value - scene.low[axis] || 1e-9);
    this.indices = {};  // by the number of points of a patch
    this.loaded = [];
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, 256, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, scene.map);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    gl.uniform3fv(this.uniform("extent"), this.extent);
    gl.enable(gl.DEPTH_TEST);
  }

  uniform(name) {
    return this.gl.getUniformLocation(this.program, name);
  }

  // Takes the place of what was loaded; `outline` has patches of which the border alone is drawn.
  load(patches, outline) {
    for (const {array, buffers} of this.loaded) {
      this.gl.deleteVertexArray(array);
      for (const buffer of buffers) this.gl.deleteBuffer(buffer);
    }
    this.loaded = [...patches.map((patch) => this.#sent(patch, false)), ...outline.map((patch) => this.#sent(patch, true))];
  }

  #sent(patch, outlined) {
    const gl = this.gl, array = gl.createVertexArray(), buffers = [];
    const attribute = (name, data, size, kind, normalized) => {
      const at = gl.getAttribLocation(this.program, name);
      buffers.push(gl.createBuffer());
      gl.bindBuffer(gl.ARRAY_BUFFER, buffers.at(-1));
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, size, kind, normalized, 0, 0);
    };
    // Numbers of 16 bits are padded to multiples of four bytes, which the graphics library wants.
    const padded = (data, size, stride) => {
      const found = new Uint16Array(data.length / size * stride);
      for (let i = 0; i < data.length / size; i++) found.set(data.subarray(size * i, size * (i + 1)), stride * i);
      return found;
    };
    const corners = this.#index(patch, outlined);
    gl.bindVertexArray(array);
    attribute("place", padded(patch.places, 3, 4), 4, gl.UNSIGNED_SHORT, true);
    attribute("value", padded(patch.values || new Uint16Array(patch.n ** 2), 1, 2), 2, gl.UNSIGNED_SHORT, true);
    if (!outlined) attribute("normal", normals(patch.places, this.extent, corners.data), 3, gl.FLOAT, false);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, corners.buffer);
    gl.bindVertexArray(null);
    return {patch, array, buffers, outlined, count: corners.data.length};
  }

  #index({n, quarter}, outlined) {
    const gl = this.gl, name = outlined ? `border ${n} ${quarter}` : `triangles ${n}`;
    if (!this.indices[name]) {
      const data = outlined ? border(n, quarter) : triangles(n);
      this.indices[name] = {data, buffer: gl.createBuffer()};
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.indices[name].buffer);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, data, gl.STATIC_DRAW);
    }
    return this.indices[name];
  }

  // `numbered`: one colour a face, to find out which one is at a pixel.
  draw(camera, lined, numbered = false) {
    const gl = this.gl, canvas = this.canvas, ratio = window.devicePixelRatio || 1;
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);  // the page's own background
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const fit = camera.zoom * fitted(this.scene, canvas);
    gl.uniform2f(this.uniform("scale"), 2 * fit / canvas.width, 2 * fit / canvas.height);
    gl.uniform2f(this.uniform("shift"), 2 * camera.shift[0] / canvas.clientWidth, -2 * camera.shift[1] / canvas.clientHeight);
    gl.uniformMatrix3fv(this.uniform("turn"), true, camera.view.flat());
    for (const {patch, array, outlined, count} of this.loaded) {
      if (numbered && outlined) continue;
      const plain = numbered ? [(patch.face + 2) / 10, 0, 0] : rgb(outlined ? OUTLINE : patch.plain);
      gl.uniform3fv(this.uniform("plain"), plain);
      gl.uniform1f(this.uniform("nearer"), outlined ? NEARER : 0);
      gl.uniform1i(this.uniform("samples"), patch.n);
      gl.uniform1i(this.uniform("mapped"), !numbered && !outlined && Boolean(patch.values));
      gl.uniform1i(this.uniform("flat_color"), numbered || outlined);
      gl.uniform1i(this.uniform("lined"), lined);
      gl.uniform1i(this.uniform("clip"), outlined || !patch.quarter ? 0 : patch.kept ? 2 : 1);
      gl.uniform2fv(this.uniform("quarter"), patch.quarter || [0, 0]);
      gl.bindVertexArray(array);
      gl.drawElements(outlined ? gl.LINE_LOOP : gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
    }
  }

  // The number of the face that is drawn at a place of the window, -1 for none.
  faceAt(x, y, camera, lined) {
    const gl = this.gl, canvas = this.canvas, box = canvas.getBoundingClientRect(), pixel = new Uint8Array(4);
    const place = [(x - box.left) / box.width * canvas.width, (box.bottom - y) / box.height * canvas.height];
    this.draw(camera, lined, true);
    gl.readPixels(...place.map(Math.floor), 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    this.draw(camera, lined);
    return Math.max(-1, Math.round(pixel[0] / 25.5) - 2);
  }
}

// Pixels of the canvas for a unit of length, at which the scene as first seen fits.
function fitted(scene, canvas) {
  return 0.48 * Math.min(canvas.width / scene.half[0], canvas.height / scene.half[1]);
}
