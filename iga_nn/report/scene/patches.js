// Chooses what is drawn of a body: its faces, sections through the cube or across an axis of space, the cut.
//
// A patch has places, parameters u, v, w and a value a corner, and the corners of its triangles. `take(source, k)` finds
// its part of any data that are given on the faces and in the lattice, k numbers a place.

const INSIDE = "#b8bdc7";  // of sections where no field is shown
const GHOST = "#8b95a1";  // of the rest around a section
const WHOLE = 0, WITHOUT = 1, ALONE = 2;  // what becomes of the octant that the cut leaves out
const FACES = [0, 1, 2, 3, 4, 5], AXES = [0, 1, 2];

function remembered(make) {
  const known = {};
  return (...given) => known[given] ??= make(...given);
}

// The corners of the triangles of n x n points.
const triangles = remembered((n) => {
  const found = new Uint32Array(6 * (n - 1) ** 2);
  let at = 0;
  for (let i = 0; i + 1 < n; i++)
    for (let j = 0; j + 1 < n; j++) {
      const a = i * n + j, b = a + n;
      found.set([a, b, b + 1, a, b + 1, a + 1], at);
      at += 6;
    }
  return found;
});

// The points along the border of n x n points, or of a quarter [side, side] of them, once around.
const border = remembered((n, first, second) => {
  const middle = (n - 1) / 2, ends = (side) => side === undefined ? [0, n - 1] : side ? [middle, n - 1] : [0, middle];
  const [[top, bottom], [left, right]] = [ends(first), ends(second)], found = [];
  for (let j = left; j < right; j++) found.push(top * n + j);
  for (let i = top; i < bottom; i++) found.push(i * n + right);
  for (let j = right; j > left; j--) found.push(bottom * n + j);
  for (let i = bottom; i > top; i--) found.push(i * n + left);
  return new Uint32Array(found);
});

// The parameters of n x n points where that of an axis (0, 1, 2) is `value`.
const parametersOn = remembered((n, axis, value) => {
  const found = new Float32Array(3 * n * n), across = AXES.filter((other) => other !== axis);
  for (let i = 0; i < n; i++)
    for (let j = 0; j < n; j++) {
      const at = 3 * (i * n + j);
      found[at + axis] = value;
      found[at + across[0]] = i / (n - 1);
      found[at + across[1]] = j / (n - 1);
    }
  return found;
});

// The plane of a lattice of n^3 points, k numbers each, whose index along an axis is `at`.
function plane(lattice, n, k, axis, at) {
  const steps = [n * n, n, 1], across = steps.filter((_, other) => other !== axis);
  const found = new lattice.constructor(n * n * k);
  for (let i = 0; i < n; i++)
    for (let j = 0; j < n; j++) {
      const from = k * (at * steps[axis] + i * across[0] + j * across[1]);
      for (let c = 0; c < k; c++) found[k * (i * n + j) + c] = lattice[from + c];
    }
  return found;
}

function filled(body, patch) {
  return {octant: WHOLE, ...patch, places: patch.take(body.places, 3), values: body.values && patch.take(body.values, 1)};
}

function facePatch(body, face) {
  const {scene} = body, n = scene.samples.faces, count = n * n, axis = face >> 1;
  return filled(body, {
    face, plain: scene.colors[face], corners: triangles(n), border: border(n),
    parameters: parametersOn(n, axis, face % 2),
    take: (source, k) => source.faces.subarray(k * count * face, k * count * (face + 1)),
  });
}

// The patch inside where the parameter of an axis is that of the lattice's plane `at`.
function sectionPatch(body, axis, at) {
  const n = body.scene.samples.lattice;
  return filled(body, {
    face: -1, plain: INSIDE, corners: triangles(n), border: border(n), parameters: parametersOn(n, axis, at / (n - 1)),
    take: (source, k) => plane(source.lattice, n, k, axis, at),
  });
}

// The parts of the three mid-sections that the cut lays open.
function cutPlanes(body) {
  const n = body.scene.samples.lattice;
  return AXES.map((axis) => {
    const quarter = body.scene.octant.filter((_, other) => other !== axis);
    return {...sectionPatch(body, axis, (n - 1) / 2), octant: ALONE, border: border(n, ...quarter)};
  });
}

// What is seen: "surface", "cut", or the section at `share` of the way along "u", "v", "w", "x", "y" or "z". Lists of the
// patches, of those that stay as a ghost around a section, and of those whose borders show the shape.
function patchesOf(body, part, share) {
  const faces = FACES.map((face) => facePatch(body, face));
  if (part === "surface") return {patches: faces, ghosts: [], outlines: body.values ? faces : []};
  if (part === "cut") {
    const planes = cutPlanes(body);
    return {patches: [...faces.map((patch) => ({...patch, octant: WITHOUT})), ...planes], ghosts: [], outlines: planes};
  }
  const axis = body.scene.axes.indexOf(part);
  const section = axis < 0 ? planeSection(body, "xyz".indexOf(part), share)
    : sectionPatch(body, axis, Math.round(share * (body.scene.samples.lattice - 1)));
  return {patches: [section], ghosts: faces.map((patch) => ({...patch, plain: GHOST})), outlines: faces};
}
