// Draws patches with WebGL 2, in parallel projection. Fields have the colours of their bar, without any shading.

const OUTLINE = "#7f8b97";
const NEARER = 0.002;  // of the depth: keeps outlines before the patches they surround
const BINS = 1024;  // of a parameter, in each of which one element line is nearest
const LIT = 0, FLAT = 1, FAINT = 2, DOT = 3;  // how a plain colour looks
const DOT_SIZE = 9, STRIPE = [14, 5];  // pixels: of a dot; from a stripe to the next, and of its width

const VERTEX_SHADER = `#version 300 es
in vec3 place, normal, parameter, paint;
in float value, mesh;
in vec4 stripe;
uniform mat3 turn;
uniform vec2 scale, shift;
uniform float nearer, dot_size;
out vec4 striped;
out vec3 facing, parameters, plain;
out float share;
flat out int row;
void main() {
  vec3 seen = turn * place;
  gl_Position = vec4(seen.xy * scale + shift, -0.5 * seen.z - nearer, 1.0);
  parameters = parameter;
  facing = turn * normal;
  share = value;
  plain = paint;
  row = int(mesh);
  striped = stripe;
  gl_PointSize = dot_size;
}`;

const FRAGMENT_SHADER = `#version 300 es
precision highp float;
in vec3 facing, parameters, plain;
in vec4 striped;
in float share;
flat in int row;
uniform sampler2D map, spans;
uniform int look;
uniform bool mapped, lined, regions;
uniform float ratio;
out vec4 color;
void main() {
  float towards = abs(normalize(facing).z);
  if (look == ${FAINT}) {
    float dense = 0.06 + 0.3 * pow(1.0 - towards, 2.0);
    color = vec4(plain * dense, dense);
    return;
  }
  if (look == ${DOT} && length(gl_PointCoord - 0.5) > 0.5) discard;
  vec3 base = plain;
  if (mapped) base = texture(map, vec2(share, 0.5)).rgb;
  else if (look == ${LIT}) base *= 0.5 + 0.5 * towards;
  if (lined && look == ${LIT}) {
    vec3 width = fwidth(parameters), nearest;
    for (int k = 0; k < 3; k++) nearest[k] = texelFetch(spans, ivec2(int(parameters[k] * ${BINS - 1}.0 + 0.5), row), 0)[k];
    vec3 near = mix(vec3(9.0), abs(parameters - nearest) / max(width, 1e-7), greaterThan(width, vec3(1e-7)));
    base *= 1.0 - 0.45 * (1.0 - smoothstep(0.4, 1.3, min(near.x, min(near.y, near.z))));
  }
  bool on_stripe = mod((gl_FragCoord.x + gl_FragCoord.y) / ratio, ${STRIPE[0]}.0) < ${STRIPE[1]}.0;
  if (regions && look == ${LIT} && striped.a > 0.5 && on_stripe) base = striped.rgb;
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

// Sums of the triangles' normals at their corners; the shader makes them unit vectors.
function normals(places, corners) {
  const sums = new Float32Array(places.length);
  for (let t = 0; t < corners.length; t += 3) {
    const a = 3 * corners[t], b = 3 * corners[t + 1], c = 3 * corners[t + 2];
    for (let k = 0; k < 3; k++) {
      const i = (k + 1) % 3, j = (k + 2) % 3;
      const part = (places[b + i] - places[a + i]) * (places[c + j] - places[a + j])
        - (places[b + j] - places[a + j]) * (places[c + i] - places[a + i]);
      sums[a + k] += part;
      sums[b + k] += part;
      sums[c + k] += part;
    }
  }
  return sums;
}

// The element line that is nearest to each of some even parameters, of u, v and w, a row for each mesh.
function nearestLines(spans) {
  const found = new Float32Array(3 * BINS * spans.length);
  spans.forEach((mesh, row) => mesh.forEach((lines, axis) => {
    for (let bin = 0, next = 0; bin < BINS; bin++) {
      const at = bin / (BINS - 1);
      while (next + 1 < lines.length && lines[next + 1] - at < at - lines[next]) next++;
      found[3 * (BINS * row + bin) + axis] = lines[next];
    }
  }));
  return found;
}

function rgb(color) {
  return [1, 3, 5].map((at) => parseInt(color.slice(at, at + 2), 16) / 255);
}

// Arrays of numbers one after another.
function joined(kind, parts) {
  const found = new kind(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    found.set(part, at);
    at += part.length;
  }
  return found;
}

// The numbers of corners of patches, as they are counted once the places of all patches stand one after another.
function numbered(patches, cornersOf) {
  const found = joined(Uint32Array, patches.map(cornersOf));
  let at = 0, first = 0;
  for (const patch of patches) {
    const end = at + cornersOf(patch).length;
    for (; at < end; at++) found[at] += first;
    first += patch.places.length / 3;
  }
  return found;
}

// The same numbers at each place of a patch.
function repeated(patches, numbersOf) {
  return joined(Float32Array, patches.map((patch) => {
    const numbers = numbersOf(patch), found = new Float32Array(patch.places.length / 3 * numbers.length);
    return found.map((_, at) => numbers[at % numbers.length]);
  }));
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
    this.loaded = [];
    this.palette = scene.regions?.legend.map(([color]) => rgb(color));
    gl.vertexAttrib4f(gl.getAttribLocation(this.program, "stripe"), 0, 0, 0, 0);  // where no region is sent
    this.#texture("spans", 1, gl.RGB32F, [BINS, scene.spans.length], gl.FLOAT, nearestLines(scene.spans));
    this.#texture("map", 0, gl.RGB, [256, 1], gl.UNSIGNED_BYTE, scene.map);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  #texture(name, unit, format, [width, height], kind, data) {
    const gl = this.gl;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texImage2D(gl.TEXTURE_2D, 0, format, width, height, 0, gl.RGB, kind, data);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
    for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
    gl.uniform1i(this.uniform(name), unit);
  }

  uniform(name) {
    return this.gl.getUniformLocation(this.program, name);
  }

  // Takes the place of what was loaded. `range` says where a value lies on the colour bar. Ghosts are drawn first, so
  // that they dim no colour of the patches.
  load({patches, ghosts, outlines, edges, dots}, range) {
    for (const {array, buffers} of this.loaded) {
      this.gl.deleteVertexArray(array);
      for (const buffer of buffers) this.gl.deleteBuffer(buffer);
    }
    this.loaded = [
      this.#sent(ghosts, FAINT),
      this.#sent(patches, LIT, range),
      this.#sent(outlines.map((patch) => ({...patch, plain: OUTLINE})), FLAT, null, "blocks"),
      this.#sent(edges, FLAT, null, "edges"),
      this.#sent(dots, DOT, null, "singular"),
    ];
  }

  // Sends patches as one: of thousands, each alone would take its time.
  #sent(patches, look, range = null, layer = "body") {
    const gl = this.gl, array = gl.createVertexArray(), buffers = [];
    const mapped = Boolean(range && patches.length && patches[0].values);
    const buffer = (kind, data) => {
      buffers.push(gl.createBuffer());
      gl.bindBuffer(kind, buffers.at(-1));
      gl.bufferData(kind, data, gl.STATIC_DRAW);
    };
    const attribute = (name, data, size) => {
      const at = gl.getAttribLocation(this.program, name);
      buffer(gl.ARRAY_BUFFER, data);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, size, gl.FLOAT, false, 0, 0);
    };
    const places = joined(Float32Array, patches.map((patch) => patch.places));
    const corners = numbered(patches, (patch) => look === FLAT || look === DOT ? patch.border : patch.corners);
    gl.bindVertexArray(array);
    attribute("place", places, 3);
    if (look === LIT) attribute("parameter", joined(Float32Array, patches.map((patch) => patch.parameters)), 3);
    if (look === LIT && this.scene.regions) attribute("stripe", joined(Float32Array, patches.map((patch) => this.#stripes(patch))), 4);
    attribute("paint", repeated(patches, (patch) => rgb(patch.plain)), 3);
    attribute("mesh", repeated(patches, (patch) => [this.scene.meshes[patch.cube]]), 1);
    if (mapped) attribute("value", Float32Array.from(joined(Float64Array, patches.map((patch) => patch.values)), (value) => range.share(value)), 1);
    if (look === LIT || look === FAINT) attribute("normal", normals(places, corners), 3);
    buffer(gl.ELEMENT_ARRAY_BUFFER, corners);
    gl.bindVertexArray(null);
    return {array, buffers, look, mapped, layer, count: corners.length};
  }

  // The colour of the region at each place of a patch, and 1; or zeros.
  #stripes(patch) {
    const found = new Float32Array(patch.places.length / 3 * 4);
    patch.regions?.forEach((number, at) => { if (number) found.set([...this.palette[number - 1], 1], 4 * at); });
    return found;
  }

  // layers: which of those are drawn: lined, regions, blocks, edges, singular.
  draw(camera, layers) {
    const gl = this.gl, canvas = this.canvas;
    const ratio = sharpened(canvas);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);  // the page's own background
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const fit = 2 * camera.fit(canvas);
    gl.uniform2f(this.uniform("scale"), fit / canvas.clientWidth, fit / canvas.clientHeight);
    gl.uniform2f(this.uniform("shift"), 2 * camera.shift[0] / canvas.clientWidth, -2 * camera.shift[1] / canvas.clientHeight);
    gl.uniformMatrix3fv(this.uniform("turn"), true, camera.view.flat());
    gl.uniform1i(this.uniform("lined"), layers.lined);
    gl.uniform1i(this.uniform("regions"), layers.regions);
    gl.uniform1f(this.uniform("ratio"), ratio);
    gl.uniform1f(this.uniform("dot_size"), DOT_SIZE * ratio * (canvas.clientWidth < NARROW ? 0.6 : 1));
    for (const {array, look, mapped, layer, count} of this.loaded) {
      if (layers[layer] === false) continue;
      gl.uniform1f(this.uniform("nearer"), layer === "body" ? 0 : layer === "blocks" ? NEARER : 2 * NEARER);
      gl.uniform1i(this.uniform("mapped"), mapped);
      gl.uniform1i(this.uniform("look"), look);
      (look === FAINT ? gl.enable : gl.disable).call(gl, gl.BLEND);
      gl.depthMask(look !== FAINT);
      gl.bindVertexArray(array);
      gl.drawElements(look === FLAT ? gl.LINES : look === DOT ? gl.POINTS : gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
    }
    gl.depthMask(true);
  }
}

// Gives a canvas the pixels of the screen; returns how many there are for one of the page.
function sharpened(canvas) {
  const ratio = window.devicePixelRatio || 1;
  canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
  canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
  return ratio;
}
