"use strict";
// Unpacks the scene that viewer.py makes: patches of points, and the values of a field on them.

function bytes(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

function numbers(text) {
  return new Uint16Array(bytes(text).buffer);
}

// The scene with numbers in place of its texts, which are unpacked once.
function unpacked(scene) {
  const both = (texts) => ({faces: numbers(texts.faces), lattice: numbers(texts.lattice)});
  const fields = scene.fields.map((field) => ({...field, values: both(field.values)}));
  return {...scene, map: bytes(scene.map), places: both(scene.places), fields};
}

// The plane of a lattice of n^3 points, k numbers each, whose index along an axis (0, 1, 2) is `at`.
function plane(lattice, n, k, axis, at) {
  const steps = [n * n, n, 1], across = steps.filter((_, other) => other !== axis);
  const found = new Uint16Array(n * n * k);
  for (let i = 0; i < n; i++)
    for (let j = 0; j < n; j++) {
      const from = k * (at * steps[axis] + i * across[0] + j * across[1]);
      found.set(lattice.subarray(from, from + k), k * (i * n + j));
    }
  return found;
}

// A patch of the surface: n x n places and, where a field is shown, the values there.
// `quarter` is the part [side, side] that the cut leaves out of it (`kept` false) or keeps of it (`kept` true).
function facePatch(scene, field, face) {
  const n = scene.samples.faces, count = n * n, axis = face >> 1;
  return {
    n, face, plain: scene.colors[face],
    places: scene.places.faces.subarray(3 * count * face, 3 * count * (face + 1)),
    values: field && field.values.faces.subarray(count * face, count * (face + 1)),
    quarter: scene.octant[axis] === face % 2 ? quarterOf(scene, axis) : null, kept: false,
  };
}

// A patch inside: the plane of the lattice that lies at index `at` along an axis.
function sectionPatch(scene, field, axis, at) {
  const n = scene.samples.lattice;
  return {
    n, face: -1, plain: INSIDE, places: plane(scene.places.lattice, n, 3, axis, at),
    values: field && plane(field.values.lattice, n, 1, axis, at), quarter: null, kept: true,
  };
}

function quarterOf(scene, axis) {
  return scene.octant.filter((_, other) => other !== axis);
}

const FACES = [0, 1, 2, 3, 4, 5], AXES = [0, 1, 2];

// The parts of the three mid-sections that the cut lays open.
function cutPlanes(scene, field) {
  const middle = (scene.samples.lattice - 1) / 2;
  return AXES.map((axis) => ({...sectionPatch(scene, field, axis, middle), quarter: quarterOf(scene, axis)}));
}

// What is drawn of the volume: "surface", "cut", or the section "u", "v" or "w" at `share` of the way through the cube.
function patchesOf(scene, field, part, share) {
  const faces = FACES.map((face) => facePatch(scene, field, face));
  if (part === "surface") return faces.map((patch) => ({...patch, quarter: null}));
  if (part === "cut") return [...faces, ...cutPlanes(scene, field)];
  return [sectionPatch(scene, field, scene.axes.indexOf(part), Math.round(share * (scene.samples.lattice - 1)))];
}

// Patches whose borders show the shape: around a section the faces, around the cut its planes.
function outlineOf(scene, part) {
  if (part === "surface") return [];
  return part === "cut" ? cutPlanes(scene, null) : FACES.map((face) => ({...facePatch(scene, null, face), quarter: null}));
}
