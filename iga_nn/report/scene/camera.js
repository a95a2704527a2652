// Turns, moves and enlarges the view by mouse, fingers and keys.

const CLICK = 4;  // pixels that the pointer may move while a face is clicked
const TURN = 0.01;  // radians for a pixel
const STEP = 40;  // pixels that a key moves the picture
const SHOWN = 1500;  // milliseconds of the hint on the wheel

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

// The view rows to the right, up and towards the viewer, of one who looks from a direction.
function viewFrom(towards) {
  const up = Math.abs(towards[2]) > 0.9 ? [0, 1, 0] : [0, 0, 1];
  const cross = (a, b) => [0, 1, 2].map((k) => a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]);
  const unit = (a) => a.map((value) => value / Math.hypot(...a));
  const right = unit(cross(up, towards));
  return [right, cross(unit(towards), right), unit(towards)];
}

const VIEWS = {
  "iso": viewFrom([1, -1, 1]),
  "+x": viewFrom([1, 0, 0]), "−x": viewFrom([-1, 0, 0]),
  "+y": viewFrom([0, 1, 0]), "−y": viewFrom([0, -1, 0]),
  "+z": viewFrom([0, 0, 1]), "−z": viewFrom([0, 0, -1]),
};

// What is seen: the turned view, the enlargement, and how far the picture is moved, in pixels of the page.
// `measured` gives half the width and height of what is drawn, as a view shows it.
class Camera {
  constructor(view, measured, changed) {
    this.measured = measured;
    this.changed = changed;
    this.look(view);
  }

  look(view) {
    this.first = view;
    this.reset();
  }

  reset() {
    [this.view, this.zoom, this.shift, this.half] = [this.first, 1, [0, 0], this.measured(this.first)];
    this.changed(this);
  }

  // Pixels of the page for a unit of the scene.
  fit(canvas) {
    return 0.48 * this.zoom * Math.min(canvas.clientWidth / this.half[0], canvas.clientHeight / this.half[1]);
  }

  turn(across, along) {
    this.view = turned(this.view, across, along);
    this.changed(this);
  }

  move(right, down) {
    this.shift = [this.shift[0] + right, this.shift[1] + down];
    this.changed(this);
  }

  // Enlarges about a point, given in pixels from the middle of the picture, which stays where it is.
  enlarge(factor, [x, y] = [0, 0]) {
    const zoom = Math.min(50, Math.max(0.2, this.zoom * factor)), by = zoom / this.zoom;
    this.shift = [x + (this.shift[0] - x) * by, y + (this.shift[1] - y) * by];
    this.zoom = zoom;
    this.changed(this);
  }
}

// The middle of the picture, in pixels of the window, and a place of the window measured from it.
function middleOf(canvas) {
  const box = canvas.getBoundingClientRect();
  return [box.left + box.width / 2, box.top + box.height / 2];
}

function fromMiddle(canvas, x, y) {
  const middle = middleOf(canvas);
  return [x - middle[0], y - middle[1]];
}

// One finger, or the mouse, turns; with Shift or the right button it moves; two fingers move and enlarge.
function watchPointers(canvas, camera, clicked) {
  const down = new Map();
  let moved = 0;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    if (!down.size) moved = 0;
    down.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!down.has(event.pointerId)) return;
    const old = down.get(event.pointerId), now = [event.clientX, event.clientY], by = [now[0] - old[0], now[1] - old[1]];
    moved += Math.abs(by[0]) + Math.abs(by[1]);
    down.set(event.pointerId, now);
    if (down.size === 2) {
      const [[, other]] = [...down].filter(([id]) => id !== event.pointerId);
      const apart = (point) => Math.max(1, Math.hypot(point[0] - other[0], point[1] - other[1]));
      camera.move(by[0] / 2, by[1] / 2);
      camera.enlarge(apart(now) / apart(old), fromMiddle(canvas, (now[0] + other[0]) / 2, (now[1] + other[1]) / 2));
    } else if (down.size === 1 && (event.shiftKey || event.buttons & 6)) camera.move(...by);
    else if (down.size === 1) camera.turn(by[0] * TURN, by[1] * TURN);
  });
  for (const end of ["pointerup", "pointercancel"])
    canvas.addEventListener(end, (event) => {
      if (down.size > 1) moved = Infinity;  // two fingers are no click
      down.delete(event.pointerId);
    });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", () => camera.reset());
  canvas.addEventListener("click", (event) => { if (moved <= CLICK) clicked(event.clientX, event.clientY); });
}

// The wheel enlarges with Ctrl held, as a touchpad's pinch reports itself, or once the picture is clicked; else the page
// scrolls, and a hint says how to enlarge.
function watchWheel(canvas, camera, hint) {
  let hiding = 0;
  canvas.addEventListener("wheel", (event) => {
    if (event.ctrlKey || event.metaKey || document.activeElement === canvas) {
      event.preventDefault();
      const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 20 : 1;
      const speed = event.ctrlKey && Math.abs(event.deltaY) < 20 ? 0.01 : 0.001;  // a pinch has small steps
      camera.enlarge(Math.exp(-speed * lines * event.deltaY), fromMiddle(canvas, event.clientX, event.clientY));
      return;
    }
    hint.classList.add("shown");
    clearTimeout(hiding);
    hiding = setTimeout(() => hint.classList.remove("shown"), SHOWN);
  }, {passive: false});
}

// Keys do what the pointer does; Enter clicks the middle of the picture.
function watchKeys(canvas, camera, clicked) {
  const way = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
  canvas.addEventListener("keydown", (event) => {
    const by = way[event.key];
    if (by) event.shiftKey ? camera.move(...by.map((k) => STEP * k)) : camera.turn(...by.map((k) => 0.1 * k));
    else if (event.key === "+") camera.enlarge(1.2);
    else if (event.key === "-") camera.enlarge(1 / 1.2);
    else if (event.key === "0") camera.reset();
    else if (event.key === "Enter") clicked(...middleOf(canvas));
    else if (event.key === "Escape") canvas.blur();  // the wheel scrolls the page again
    else return;
    event.preventDefault();
  });
}
