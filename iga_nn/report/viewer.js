"use strict";
// Draws the scene of report.html (see viewer.py) with WebGL 2: parallel projection, drag to turn, no library.

const VERTEX_SHADER = `#version 300 es
in vec3 place, normal;
in float value;
uniform vec3 extent;
uniform mat3 turn;
uniform vec2 scale;
uniform int samples;
out vec3 facing;
out vec2 parameters;
out float share;
void main() {
  vec3 seen = turn * ((place - 0.5) * extent);
  gl_Position = vec4(seen.xy * scale, -0.5 * seen.z / length(extent), 1.0);
  int number = gl_VertexID % (samples * samples);
  parameters = vec2(number / samples, number % samples) / float(samples - 1);
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
uniform bool mapped, lined, numbered;
out vec4 color;
void main() {
  if (numbered) {  // one colour a face, to find out which one is at a pixel
    color = vec4(plain, 1.0);
    return;
  }
  vec3 base = mapped ? texture(map, vec2(share, 0.5)).rgb : plain;
  base *= 0.5 + 0.5 * abs(normalize(facing).z);
  if (lined) {
    vec2 cell = parameters * 10.0, width = fwidth(cell);
    vec2 near = abs(cell - round(cell)) / max(width, 1e-6);
    base *= 1.0 - 0.45 * (1.0 - smoothstep(0.4, 1.3, min(near.x, near.y)));
  }
  color = vec4(base, 1.0);
}`;

const CLICK = 4;  // pixels that the pointer may move while a face is clicked

function bytes(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

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

// Triangles of all nine patches, patch after patch.
function triangles(samples) {
  const found = new Uint32Array(9 * 6 * (samples - 1) ** 2);
  let at = 0;
  for (let patch = 0; patch < 9; patch++)
    for (let i = 0; i + 1 < samples; i++)
      for (let j = 0; j + 1 < samples; j++) {
        const a = patch * samples ** 2 + i * samples + j, b = a + samples;
        found.set([a, b, b + 1, a, b + 1, a + 1], at);
        at += 6;
      }
  return found;
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

function product(left, right) {
  return left.map((row) => [0, 1, 2].map((k) => row[0] * right[0][k] + row[1] * right[1][k] + row[2] * right[2][k]));
}

// The view turned by small angles about the screen's vertical and horizontal axis, kept orthonormal.
function turned(view, across, along) {
  const [c, s, d, t] = [Math.cos(across), Math.sin(across), Math.cos(along), Math.sin(along)];
  const [x, y] = product([[1, 0, 0], [0, d, -t], [0, t, d]], product([[c, 0, s], [0, 1, 0], [-s, 0, c]], view));
  const unit = (a) => a.map((value) => value / Math.hypot(...a));
  const dot = x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
  const right = unit(x), up = unit(y.map((value, k) => value - dot * x[k]));
  return [right, up, [0, 1, 2].map((k) => right[(k + 1) % 3] * up[(k + 2) % 3] - right[(k + 2) % 3] * up[(k + 1) % 3])];
}

function rgb(color) {
  return [1, 3, 5].map((at) => parseInt(color.slice(at, at + 2), 16) / 255);
}

function start(scene, canvas) {
  if (!scene) return;  // it could not be drawn: the page hides its place, and says why
  const gl = canvas.getContext("webgl2", {antialias: true, preserveDrawingBuffer: true});
  if (!gl) {
    document.getElementById("scene").classList.add("absent");
    return;
  }
  const program = compiled(gl);
  const uniform = (name) => gl.getUniformLocation(program, name);
  const extent = scene.high.map((value, axis) => value - scene.low[axis] || 1e-9);
  const places = new Uint16Array(bytes(scene.places).buffer);
  const corners = triangles(scene.samples);
  const state = {view: scene.view, zoom: 1, shown: "faces", inside: false, lined: true, moved: 0};

  const attribute = (name, data, size, kind, normalized) => {
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    const at = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, kind, normalized, 0, 0);
  };
  // Three 16-bit numbers a point, padded to four: the graphics library wants multiples of four bytes.
  const padded = new Uint16Array(places.length / 3 * 4);
  for (let i = 0; i < places.length / 3; i++) padded.set(places.subarray(3 * i, 3 * i + 3), 4 * i);
  attribute("place", padded, 4, gl.UNSIGNED_SHORT, true);
  attribute("normal", normals(places, extent, corners), 3, gl.FLOAT, false);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corners, gl.STATIC_DRAW);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, 256, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, bytes(scene.map));
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.LINEAR);
  for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
  gl.uniform3fv(uniform("extent"), extent);
  gl.uniform1i(uniform("samples"), scene.samples);
  gl.enable(gl.DEPTH_TEST);

  const draw = (numbered = false) => {
    const ratio = window.devicePixelRatio || 1;
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);  // the page's own background
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const fit = state.zoom * 0.96 * Math.min(canvas.width / scene.half[0], canvas.height / scene.half[1]);
    gl.uniform2f(uniform("scale"), fit / canvas.width, fit / canvas.height);
    gl.uniformMatrix3fv(uniform("turn"), true, state.view.flat());
    gl.uniform1i(uniform("mapped"), state.shown !== "faces");
    gl.uniform1i(uniform("lined"), state.lined);
    gl.uniform1i(uniform("numbered"), numbered);
    const each = 6 * (scene.samples - 1) ** 2;
    for (let patch = state.inside ? 6 : 0; patch < (state.inside ? 9 : 6); patch++) {
      const plain = patch < 6 ? rgb(scene.colors[patch]) : [0.72, 0.74, 0.78];
      gl.uniform3fv(uniform("plain"), numbered ? [(patch + 1) / 10, 0, 0] : plain);
      gl.drawElements(gl.TRIANGLES, each, gl.UNSIGNED_INT, 4 * each * patch);
    }
  };

  // The number of the patch that is drawn at a place of the window, -1 for none.
  const patchAt = (x, y) => {
    const box = canvas.getBoundingClientRect(), pixel = new Uint8Array(4);
    const place = [(x - box.left) / box.width * canvas.width, (box.bottom - y) / box.height * canvas.height];
    draw(true);
    gl.readPixels(...place.map(Math.floor), 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    draw();
    return Math.round(pixel[0] / 25.5) - 1;
  };

  const values = gl.createBuffer();
  const show = (name) => {
    const field = scene.fields.find((one) => one.name === name);
    state.shown = field ? name : "faces";
    const data = field ? bytes(field.values) : new Uint8Array(places.length / 3);
    gl.bindBuffer(gl.ARRAY_BUFFER, values);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    const at = gl.getAttribLocation(program, "value");
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, 1, gl.UNSIGNED_BYTE, true, 0, 0);
    document.querySelector(`input[name=field][value=${state.shown}]`).checked = true;
    legend(scene, field);
    draw();
  };
  controls(state, scene, canvas, show, draw);
  canvas.addEventListener("click", (event) => {
    const face = state.moved > CLICK ? -1 : patchAt(event.clientX, event.clientY);
    if (face >= 0 && face < 6) pick(scene.labels[face]);
  });
  new ResizeObserver(() => draw()).observe(canvas);
  show(location.hash.slice(1));
}

// Names the face that was clicked, and tells the page that shows this one in a frame.
function pick(label) {
  document.getElementById("picked").textContent = `Face ${label}`;
  if (window.parent !== window) window.parent.postMessage({face: label.slice(0, 2)}, "*");
}

// What the colours mean: a swatch a face, or the colour bar with its ends and title.
function legend(scene, field) {
  const place = document.getElementById("legend");
  place.replaceChildren();
  const put = (kind, text, parent = place) => {
    const item = document.createElement("span");
    item.className = kind;
    item.textContent = text;
    parent.append(item);
    return item;
  };
  if (!field) {
    scene.labels.forEach((label, face) => {
      const item = put("swatch", "");
      put("chip", "", item).style.background = scene.colors[face];
      item.append(label);
    });
    return;
  }
  const map = bytes(scene.map);
  const stops = [...Array(16).keys()].map((k) => `rgb(${map.subarray(51 * k, 51 * k + 3).join(",")})`);
  put("title", field.title);
  put("end", field.low);
  put("bar", "").style.background = `linear-gradient(to right, ${stops.join(",")})`;
  put("end", field.high);
}

function controls(state, scene, canvas, show, draw) {
  const turn = (across, along) => { state.view = turned(state.view, across, along); draw(); };
  const zoom = (factor) => { state.zoom = Math.min(20, Math.max(0.3, state.zoom * factor)); draw(); };
  const reset = () => { state.view = scene.view; state.zoom = 1; draw(); };
  for (const input of document.querySelectorAll("input[name=field]"))
    input.addEventListener("change", () => show(input.value));
  for (const name of ["inside", "lined"]) {
    const box = document.getElementById(name);
    box.checked = state[name];
    box.addEventListener("change", () => { state[name] = box.checked; draw(); });
  }
  const keys = {
    ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, -0.1),
    ArrowDown: () => turn(0, 0.1), "+": () => zoom(1.2), "-": () => zoom(1 / 1.2), "0": reset,
  };
  canvas.addEventListener("keydown", (event) => {
    if (!(event.key in keys)) return;
    event.preventDefault();
    keys[event.key]();
  });
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    state.moved = 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    state.moved += Math.abs(event.movementX) + Math.abs(event.movementY);
    turn(event.movementX * 0.01, event.movementY * 0.01);
  });
  canvas.addEventListener("dblclick", reset);
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas) return; // the page scrolls until the scene is clicked
    event.preventDefault();
    zoom(Math.exp(-0.001 * event.deltaY));
  }, {passive: false});
  document.getElementById("larger").addEventListener("click", () => zoom(1.3));
  document.getElementById("smaller").addEventListener("click", () => zoom(1 / 1.3));
  document.getElementById("reset").addEventListener("click", reset);
}

start(JSON.parse(document.getElementById("scene-data").textContent), document.getElementById("view"));
