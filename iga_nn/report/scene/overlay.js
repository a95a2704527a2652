// Draws over the picture: axes, a scale bar, the probed place. Saves the picture with its colour bar.

const AXIS_COLORS = ["#cc3311", "#228833", "#3377cc"];
const ARM = 30, SMALL_ARM = 18, NARROW = 500, EDGE = 16;  // pixels: of an axis; from the canvas's edge
const SCALE = 0.25;  // of the width: the scale bar is no longer

function drawOverlay(canvas, scene, camera, mark, ink) {
  const ratio = sharpened(canvas), pen = canvas.getContext("2d");
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  pen.scale(ratio, ratio);
  pen.font = "13px system-ui, sans-serif";
  pen.lineWidth = 2;
  const arm = width < NARROW ? SMALL_ARM : ARM;
  drawAxes(pen, camera.view, [EDGE + arm + 6, height - EDGE - arm - 6], arm);
  drawScale(pen, scene, camera.fit(canvas), width, height, ink);
  if (mark) drawMark(pen, camera, camera.fit(canvas), mark, width, height);
}

function drawAxes(pen, view, [x, y], arm) {
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  for (const axis of [...AXES].sort((a, b) => view[2][a] - view[2][b])) {  // the nearest last
    const [right, up] = [view[0][axis], view[1][axis]];
    pen.strokeStyle = pen.fillStyle = AXIS_COLORS[axis];
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(x + arm * right, y - arm * up);
    pen.stroke();
    pen.fillText("xyz"[axis], x + (arm + 10) * right, y - (arm + 10) * up);
  }
}

function drawScale(pen, scene, fit, width, height, ink) {
  const length = roundLength(SCALE * width * scene.size / fit), pixels = length / scene.size * fit;
  const right = width - EDGE, y = height - EDGE;
  pen.strokeStyle = pen.fillStyle = ink;
  pen.beginPath();
  for (const [from, to] of [[[right - pixels, y], [right, y]], [[right - pixels, y - 4], [right - pixels, y + 4]], [[right, y - 4], [right, y + 4]]]) {
    pen.moveTo(...from);
    pen.lineTo(...to);
  }
  pen.stroke();
  pen.textAlign = "right";
  pen.textBaseline = "bottom";
  pen.fillText([written(length), scene.unit].filter(Boolean).join(" "), right, y - 6);
}

function drawMark(pen, camera, fit, place, width, height) {
  const along = (row) => fit * AXES.reduce((sum, k) => sum + row[k] * place[k], 0);
  const [x, y] = [width / 2 + camera.shift[0] + along(camera.view[0]), height / 2 + camera.shift[1] - along(camera.view[1])];
  for (const [color, line] of [["#fff", 5], ["#111", 2]]) {
    pen.strokeStyle = color;
    pen.lineWidth = line;
    pen.beginPath();
    pen.arc(x, y, 6, 0, 7);
    pen.stroke();
  }
}

// A white PNG of the picture, the overlay and, where a field is shown, its bar below, as an address of its data.
function pictureOf(canvases, scene, field, range, heading) {
  const [first] = canvases, ratio = first.width / first.clientWidth, below = field ? 64 : 0;
  const paper = document.createElement("canvas"), pen = paper.getContext("2d");
  paper.width = first.width;
  paper.height = first.height + below * ratio;
  pen.fillStyle = "#fff";
  pen.fillRect(0, 0, paper.width, paper.height);
  for (const canvas of canvases) pen.drawImage(canvas, 0, 0);
  pen.scale(ratio, ratio);
  if (field) drawBar(pen, scene, field, range, heading, first.clientWidth, first.clientHeight);
  return paper.toDataURL("image/png");
}

function drawBar(pen, scene, field, range, heading, width, top) {
  const left = 24, long = width - 48;
  pen.font = "13px system-ui, sans-serif";
  pen.fillStyle = "#111";
  pen.textAlign = "left";
  pen.textBaseline = "top";
  pen.fillText([field.title, ...range.words, range.remark, heading].filter(Boolean).join(", "), left, top + 2);
  const colors = stops(scene.map);
  for (let k = 0; k < 256; k++) {
    pen.fillStyle = colors[range.remark ? 128 : k];
    pen.fillRect(left + long * k / 256, top + 22, long / 256 + 0.5, 14);
  }
  pen.fillStyle = "#111";
  pen.textAlign = "center";
  for (const value of range.ticks) pen.fillText(written(value), left + long * range.share(value), top + 42);
}
