// Says what the colours mean: a swatch a face, or the colour bar with its ticks and a range that can be changed.

const MOST_TOLD = 3;  // singular places that are named
const DECADES = 1e-4;  // of the largest value: where a logarithmic range of values that reach zero begins

// The values between which a field is coloured, evenly or by their logarithms.
class ColorRange {
  constructor({low, high, logarithmic, remark, shown, said}) {
    Object.assign(this, {least: low, largest: high, first: logarithmic, remark, shown, said});
    this.reset();
    this.showMost();
  }

  // The range of most of the body, where peaks would take the others' colours.
  showMost() {
    [this.low, this.high] = this.shown;
  }

  get isMost() {
    return Boolean(this.said) && this.low === this.shown[0] && this.high === this.shown[1];
  }

  reset() {
    [this.low, this.high, this.logarithmic] = [this.least, this.largest, this.first];
  }

  get canBeLogarithmic() {
    return this.largest > 0 && this.least >= 0;
  }

  set inDecades(wanted) {
    this.logarithmic = wanted;
    if (wanted && this.low <= 0) this.low = DECADES * this.high;
  }

  // What stands behind the title of a bar.
  get words() {
    const larger = !this.remark && this.high < this.largest - 1e-4 * (this.largest - this.least);
    return [this.logarithmic && "logarithmic", this.isMost ? this.said : larger && `▸ up to ${written(this.largest)}`].filter(Boolean);
  }

  // Why a range cannot be shown; "" where it can.
  refusal(low, high) {
    if (!Number.isFinite(low) || !Number.isFinite(high)) return "Both ends of the range must be numbers.";
    if (low >= high) return "The lower end of the range must be below the upper one.";
    return this.logarithmic && low <= 0 ? "A logarithmic range must begin above 0." : "";
  }

  // The place of a value on the bar, from 0 to 1, and beyond where it lies outside.
  share(value) {
    if (this.remark) return 0.5;
    const place = this.logarithmic ? Math.log(Math.max(value, 1e-300) / this.low) / Math.log(this.high / this.low)
      : (value - this.low) / (this.high - this.low);
    return Math.min(1e6, Math.max(-1e6, place));
  }

  // Round values within the range: decades, or some four even steps.
  get ticks() {
    if (this.remark) return [];
    if (this.logarithmic) {
      const [from, to] = [this.low, this.high].map(Math.log10), every = Math.max(1, Math.round((to - from) / 4)), found = [];
      for (let k = Math.ceil(from - 1e-9); k <= to + 1e-9; k += every) found.push(10 ** k);
      return found;
    }
    const step = roundLength((this.high - this.low) / 4), found = [];
    for (let k = Math.ceil(this.low / step - 1e-9); k * step <= this.high + 1e-9 * step; k++) found.push(k * step);
    return found;
  }
}

// The largest of 1, 2, 5 times a power of ten that is at most a length.
function roundLength(length) {
  const decade = 10 ** Math.floor(Math.log10(length));
  return [5, 2, 1].find((digit) => digit * decade <= length * (1 + 1e-9)) * decade;
}

function stops(map) {
  return [...Array(256).keys()].map((k) => `rgb(${map.subarray(3 * k, 3 * k + 3).join(",")})`);
}

function put(parent, kind, text = "") {
  const item = document.createElement("span");
  item.className = kind;
  item.textContent = text;
  parent.append(item);
  return item;
}

// Shows the swatches, or the bar of a field with the ends of its range.
function showLegend(scene, field, range) {
  const place = element("legend");
  place.replaceChildren();
  element("range").hidden = !field || Boolean(range.remark);
  if (!field) {
    scene.legend.forEach(([color, label]) => {
      const item = put(place, "swatch");
      put(item, "chip").style.background = color;
      item.append(label);
    });
    const faces = scene.smooth > 1 ? `${scene.smooth} faces between sharp edges, each in its colour` : "no sharp edges";
    if (scene.smooth) put(place, "title", `${scene.blocks.toLocaleString("en")} blocks; ${faces}`);
    return;
  }
  put(place, "title", field.title);
  const bar = put(place, "bar"), colors = stops(scene.map);
  put(bar, "colors").style.background = range.remark ? colors[128] : `linear-gradient(to right, ${colors.join(",")})`;
  if (range.remark) put(place, "end", range.remark);
  for (const value of range.ticks) put(bar, "tick", written(value)).style.left = `${100 * range.share(value)}%`;
  if (range.words.length) put(place, "said", range.words.join(", "));
  element("most").hidden = !range.said || range.isMost;
  for (const end of ["low", "high"]) {
    element(end).value = String(Number(range[end].toPrecision(4)));
    element(end).setCustomValidity("");
  }
  element("refused").textContent = "";
  element("decades").checked = range.logarithmic;
  element("decades").parentElement.hidden = !range.canBeLogarithmic;
}

// Hears the inputs of the range that `current` returns, and says so.
function watchRange(current, changed) {
  for (const end of ["low", "high"])
    element(end).addEventListener("change", () => {
      const range = current(), given = {low: range.low, high: range.high, [end]: element(end).valueAsNumber};
      const refusal = range.refusal(given.low, given.high);
      element("refused").textContent = refusal;
      element(end).setCustomValidity(refusal);
      if (!refusal) Object.assign(range, given), changed();
    });
  element("whole").addEventListener("click", () => { current().reset(); changed(); });
  element("most").addEventListener("click", () => { current().showMost(); changed(); });
  element("decades").addEventListener("change", (event) => { current().inDecades = event.target.checked; changed(); });
}

// Says what the layers are: a striped swatch for each region of data, a dot for singular places.
function showLayers(scene) {
  const place = element("layers");
  place.replaceChildren();
  const add = (kind, color, label) => {
    const item = put(place, "swatch");
    put(item, `chip ${kind}`).style.color = color;
    item.append(label);
  };
  if (scene.regions && element("regions").checked) for (const [color, label] of scene.regions.legend) add("striped", color, label);
  if (scene.singular && element("singular").checked) add("dot", MARK, `infinite at ${scene.singular.texts.slice(0, MOST_TOLD).join(", ")}${rest(scene.singular.texts)}`);
}

function rest(texts) {
  return texts.length > MOST_TOLD ? ` and ${texts.length - MOST_TOLD} more` : "";
}
