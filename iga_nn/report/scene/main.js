// Starts the view: its controls, its legend, and what is said where it cannot be shown.

const element = (id) => document.getElementById(id);
const chosen = (name) => document.querySelector(`input[name=${name}]:checked`);

function start(scene) {
  const canvas = element("view"), graphics = new Graphics(scene, canvas);
  const field = () => scene.fields.find((one) => one.name === chosen("field").value);
  const part = () => chosen("part").value;
  const camera = new Camera(scene.view, (now) => graphics.draw(now, element("lined").checked));
  const draw = () => graphics.draw(camera, element("lined").checked);
  const load = () => {
    const share = Number(element("at").value), isSection = scene.axes.includes(part());
    element("moves").hidden = !isSection;
    element("where").textContent = `${part()} = ${share.toFixed(3)}`;
    graphics.load(patchesOf(scene, field(), part(), share), outlineOf(scene, part()));
    draw();
  };
  const show = () => {
    if (field() && !element("parts").dataset.touched) document.querySelector("input[name=part][value=cut]").checked = true;
    legend(scene, field());
    load();
  };
  element("at").step = 1 / (scene.samples.lattice - 1);
  element("at").addEventListener("input", load);
  element("lined").addEventListener("change", draw);
  for (const input of document.querySelectorAll("input[name=field]")) input.addEventListener("change", show);
  for (const input of document.querySelectorAll("input[name=part]"))
    input.addEventListener("change", () => { element("parts").dataset.touched = "yes"; load(); });
  element("larger").addEventListener("click", () => camera.enlarge(1.3));
  element("smaller").addEventListener("click", () => camera.enlarge(1 / 1.3));
  element("reset").addEventListener("click", () => camera.reset());
  watchPointers(canvas, camera, (x, y) => {
    const face = graphics.faceAt(x, y, camera, element("lined").checked);
    if (face >= 0) pick(scene.labels[face]);
  });
  watchWheel(canvas, camera, element("hint"));
  watchKeys(canvas, camera);
  element("scene").classList.remove("absent");
  const first = [...document.querySelectorAll("input[name=field]")].find((input) => input.value === location.hash.slice(1));
  (first || document.querySelector("input[name=field]")).checked = true;
  show();
  new ResizeObserver(draw).observe(canvas);
}

// Names the face that was clicked, and tells the page that shows this one in a frame.
function pick(label) {
  element("picked").textContent = `Face ${label}`;
  if (window.parent !== window) window.parent.postMessage({face: label.slice(0, 2)}, "*");
}

// What the colours mean: a swatch a face, or the colour bar with its ends and title.
function legend(scene, field) {
  const place = element("legend");
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
  const stops = [...Array(256).keys()].map((k) => `rgb(${scene.map.subarray(3 * k, 3 * k + 3).join(",")})`);
  put("title", field.title);
  put("end", field.low);
  put("bar", "").style.background = `linear-gradient(to right, ${stops.join(",")})`;
  put("end", field.high);
}

// Where the view cannot be drawn, the first picture of the page stands in its place.
function showStill() {
  const picture = document.querySelector("figure img"), still = element("still");
  element("scene").classList.add("absent");
  still.hidden = !picture;
  if (picture) [still.src, still.alt] = [picture.src, picture.alt];
}

const packed = JSON.parse(element("scene-data").textContent);
if (packed) {  // without it the page hides the place of the view, and says why
  try {
    element("view").addEventListener("webglcontextlost", showStill);
    start(unpacked(packed));
  } catch {
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
