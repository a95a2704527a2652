// Starts the view: what is shown, its controls, and what is said where it cannot be shown.

const element = (id) => document.getElementById(id);
const LAYERS = ["lined", "blocks", "edges", "regions", "singular"];  // what may be drawn over the colours
const BORDERED = 150;  // blocks: the borders of more would cover the colours
const chosen = (name) => document.querySelector(`input[name=${name}]:checked`).value;

// What is seen of a scene, and how; the controls of the page change it.
class View {
  constructor(scene) {
    this.scene = scene;
    this.canvas = element("view");
    this.graphics = new Graphics(scene, this.canvas);
    this.ranges = Object.fromEntries(scene.fields.map((field) => [field.name, new ColorRange(field)]));
    this.player = new Player(scene, () => this.load());
    this.probed = null;  // as `hit` returns it
    this.camera = new Camera(scene.view, (view) => this.measured(view), () => this.draw());
  }

  get field() {
    return this.scene.fields.find((one) => one.name === chosen("field"));
  }

  get range() {
    return this.field && this.ranges[this.field.name];
  }

  get layers() {
    return Object.fromEntries(LAYERS.map((name) => [name, element(name).checked]));
  }

  get warp() {
    return Number(element("warp").value);
  }

  // Half the width and height of the body, as a view shows it, at whatever displacements the controls allow.
  measured(view) {
    const {warp, oscillates} = this.scene, half = [1e-9, 1e-9];
    for (const factor of [oscillates ? -2 * warp : 0, 2 * warp]) {
      const seen = projected(movedPlaces(this.scene, this.player.frame, factor).faces, view);
      for (let i = 0; i < seen.length; i++) if (i % 3 < 2) half[i % 3] = Math.max(half[i % 3], Math.abs(seen[i]));
    }
    return half;
  }

  load() {
    const {scene, field, player} = this, part = chosen("part"), share = Number(element("at").value);
    this.shown = patchesOf({
      scene,
      places: movedPlaces(scene, player.frame, this.warp * player.phase),
      values: field && valuesOf(scene, player.frame, field),
    }, part, share);
    this.graphics.load(this.shown, this.range);
    this.say(part, share);
    this.draw();
  }

  // Another part, or a section at another place: what was probed is gone.
  choosePart() {
    this.probed = null;
    this.load();
  }

  draw(ink = getComputedStyle(this.canvas).color) {
    if (!this.shown) return;  // while it starts
    this.graphics.draw(this.camera, this.layers);
    const patch = this.probed && this.shown.patches[this.probed.patch];
    const mark = patch && AXES.map((axis) => mixed(patch.places, 3, this.probed.corners, this.probed.weights, axis));
    drawOverlay(element("overlay"), this.scene, this.camera, mark, ink);
  }

  probe(x, y) {
    this.probed = hit(this.shown.patches, this.camera, this.canvas, x, y);
    this.say(chosen("part"), Number(element("at").value));
    this.draw();
    if (window.parent !== window) this.tell();
  }

  // Tells the page that shows this one in a frame which face was clicked, and where.
  tell() {
    const patch = this.probed && this.shown.patches[this.probed.patch];
    if (patch?.face >= 0) {
      const point = pointAt(this.scene, patch, this.probed);
      window.parent.postMessage({face: this.scene.labels[patch.face].slice(0, 2), point}, "*");
    }
    window.dispatchEvent(new Event("resize"));  // there are more lines now
  }

  // Hands the reader a picture on white paper.
  save() {
    const link = document.createElement("a");
    this.draw("#111");
    link.href = pictureOf([this.canvas, element("overlay")], this.scene, this.field, this.range, this.warpInWords);
    link.download = "view.png";
    link.click();
    this.draw();
  }

  get warpInWords() {
    return this.scene.warp ? `displacements × ${written(this.warp)}` : "";
  }

  // Writes beside the controls what they choose, and the values at the probed place.
  say(part, share) {
    const {scene, player} = this, axis = "xyz".indexOf(part);
    const at = axis < 0 ? share.toFixed(3) : written(scene.low[axis] + share * (scene.high[axis] - scene.low[axis]));
    element("moves").hidden = ["surface", "cut"].includes(part);
    element("where").textContent = `${part} = ${at}`;
    element("warped").textContent = this.warpInWords;
    element("frame").value = player.frame;
    element("moment").textContent = scene.frames[player.frame].label;
    element("play").textContent = player.plays ? "Pause" : "Play";
    element("picked").ariaLive = player.plays ? "off" : "polite";
    const patch = this.probed && this.shown.patches[this.probed.patch];
    if (!patch) return element("picked").replaceChildren("Click the body to read the values there.");
    element("picked").replaceChildren();
    if (patch.face >= 0) put(element("picked"), "reading", `Face ${scene.labels[patch.face]}`);
    for (const [name, text] of readings(scene, player.frame, patch, this.probed))
      put(put(element("picked"), "reading", `${name} = `), "number", text);
  }
}

function start(scene) {
  const view = new View(scene), {camera, canvas} = view;
  const showRange = () => { showLegend(scene, view.field, view.range); view.load(); };
  setControls(scene);
  camera.reset();
  const press = (id, action) => element(id).addEventListener("click", action);
  for (const input of document.querySelectorAll("input[name=field]")) input.addEventListener("change", showRange);
  for (const input of document.querySelectorAll("input[name=part]")) input.addEventListener("change", () => view.choosePart());
  element("at").addEventListener("input", () => view.choosePart());
  element("warp").addEventListener("input", () => view.load());
  element("frame").addEventListener("input", (event) => view.player.show(Number(event.target.value)));
  for (const name of LAYERS) element(name).addEventListener("change", () => { showLayers(scene); view.draw(); });
  element("views").addEventListener("change", (event) => camera.look(VIEWS[event.target.value] || scene.view));
  press("play", () => view.player.toggle());
  press("larger", () => camera.enlarge(1.3));
  press("smaller", () => camera.enlarge(1 / 1.3));
  press("reset", () => camera.reset());
  press("full", () => document.fullscreenElement ? document.exitFullscreen() : element("scene").requestFullscreen());
  press("save", () => view.save());
  watchRange(() => view.range, showRange);
  const probe = (x, y) => view.probe(x, y);
  watchPointers(canvas, camera, probe);
  watchWheel(canvas, camera, element("hint"));
  watchKeys(canvas, camera, probe);
  element("scene").classList.remove("absent");
  showRange();
  new ResizeObserver(() => view.draw()).observe(canvas);
  const recolored = () => requestAnimationFrame(() => view.draw());
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", recolored);
  window.addEventListener("message", recolored);
}

// Sets the controls to what the view opens on: what the address names, else what the scene says.
function setControls(scene) {
  const check = (name, value) => {
    const all = [...document.querySelectorAll(`input[name=${name}]`)];
    const input = all.find((one) => [one.value, encodeURIComponent(one.value)].includes(value));
    if (input) input.checked = true;
    return Boolean(input);
  };
  const named = location.hash.slice(1);
  if (!check("field", named)) check("field", scene.opening.field);
  check("part", named === "faces" ? "surface" : scene.opening.part);
  const has = {regions: scene.regions, singular: scene.singular, edges: scene.edges.length};
  for (const name in has) if (!has[name]) element(name).parentElement.hidden = true;
  element("blocks").checked = scene.blocks <= BORDERED;
  showLayers(scene);
  element("at").step = 1 / (scene.samples.lattice - 1);
  element("warping").hidden = !scene.warp;
  [element("warp").max, element("warp").value] = [2 * scene.warp, scene.warp];
  element("player").hidden = scene.frames.length === 1 && !scene.oscillates;
  element("frame").max = scene.frames.length - 1;
  element("frame").hidden = scene.frames.length === 1;
  element("full").hidden = !document.fullscreenEnabled;
}

// Where the view cannot be drawn, the picture of the solution stands in its place, or the first one of the page.
function showStill() {
  const picture = document.querySelector('figure img[alt^="The solution"]') ?? document.querySelector("figure img");
  const still = element("still");
  element("scene").classList.add("absent");
  still.hidden = !picture;
  if (picture) [still.src, still.alt] = [picture.src, picture.alt];
}

const packed = JSON.parse(element("scene-data").textContent);
if (packed) {  // without it the page hides the place of the view, and says why
  try {
    element("view").addEventListener("webglcontextlost", showStill);
    start(unpacked(packed));
  } catch (error) {
    console.debug(error);
    showStill();
  }
}
for (const picture of document.querySelectorAll("figure img"))
  picture.addEventListener("click", () => picture.parentElement.classList.toggle("whole"));

// The page that shows this one in a frame says whether it is light or dark.
window.addEventListener("message", ({data}) => {
  if (["light", "dark"].includes(data?.theme)) document.documentElement.style.colorScheme = data.theme;
});
if (window.parent !== window) window.parent.postMessage({scene: "ready"}, "*");

// The sheet that is printed shows pictures of the page. The whole report is printed by its button alone.
for (const copy of document.querySelectorAll("img[data-of]")) {
  const picture = document.querySelector(`img[data-file="${copy.dataset.of}"]`);
  if (picture) copy.src = picture.src;
}
element("print-sheet")?.addEventListener("click", () => window.print());
element("print-all")?.addEventListener("click", () => {
  document.documentElement.classList.add("whole");
  window.print();
  document.documentElement.classList.remove("whole");
});
