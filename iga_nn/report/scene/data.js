"use strict";
// Unpacks the scene that viewer.py makes: places, and the values of fields and vectors at them, frame by frame.

const LENGTH = 3;  // in place of a component: the length of the vector

function bytes(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

// Shares 0..1 of the outer faces and of the lattices of all cubes, changed one by one: change(share, number).
function both(texts, kind, change) {
  const numbers = (text) => kind.from(new Uint16Array(bytes(text).buffer), (one, at) => change(one / 65535, at));
  return {faces: numbers(texts.faces), lattice: numbers(texts.lattice)};
}

// The scene with numbers in place of its texts. Places are measured from the middle of the box, over its diagonal.
function unpacked(scene) {
  const extent = scene.high.map((value, axis) => value - scene.low[axis]), size = Math.hypot(...extent) || 1;
  const places = both(scene.places, Float32Array, (share, at) => (share - 0.5) * extent[at % 3] / size);
  const middle = scene.low.map((value, axis) => value + 0.5 * extent[axis]);
  const whole = (text) => new Uint32Array(bytes(text).buffer);
  const regions = scene.regions && {...scene.regions, numbers: bytes(scene.regions.numbers)};
  const singular = scene.singular && {...scene.singular, marks: whole(scene.singular.marks)};
  const layers = {edges: whole(scene.edges), regions, singular};
  return {...scene, ...layers, size, middle, places, map: bytes(scene.map), found: scene.frames.map(() => ({}))};
}

function vectorsOf(scene, frame) {
  const found = scene.found[frame], packed = scene.frames[frame].vectors;
  return found.vectors ??= packed && both(packed, Float64Array, (share) => (2 * share - 1) * scene.bound);
}

// The values of a field in a frame, those of the first where it has no own. They are unpacked once.
function valuesOf(scene, frame, field) {
  if (field.component === undefined && !(field.name in scene.frames[frame].values)) frame = 0;
  const found = scene.found[frame].fields ??= {};
  return found[field.name] ??= field.component === undefined
    ? both(scene.frames[frame].values[field.name], Float64Array, (share) => valueAt(field, share))
    : components(vectorsOf(scene, frame), field.component);
}

function valueAt({low, high, logarithmic}, share) {
  return logarithmic ? low * (high / low) ** share : low + share * (high - low);
}

function components({faces, lattice}, component) {
  const one = (data) => Float64Array.from({length: data.length / 3}, (_, i) =>
    component === LENGTH ? Math.hypot(data[3 * i], data[3 * i + 1], data[3 * i + 2]) : data[3 * i + component]);
  return {faces: one(faces), lattice: one(lattice)};
}

// The places of a body that a frame's vectors, `warp` times as large, displace.
function movedPlaces(scene, frame, warp) {
  const vectors = warp ? vectorsOf(scene, frame) : null;
  if (!vectors) return scene.places;
  const moved = (part) => scene.places[part].map((place, at) => place + warp * vectors[part][at] / scene.size);
  return {faces: moved("faces"), lattice: moved("lattice")};
}
