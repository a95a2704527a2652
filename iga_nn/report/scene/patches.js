// Chooses what is drawn of a body: its outer faces, sections through the cube or across an axis of space, the cut. A body
// is one cube, or several that are glued.
//
// A patch has its cube, places, parameters u, v, w and a value a corner, and the corners of its triangles. `take(source,
// k)` finds its part of any data that are given on the outer faces and in the lattices of all cubes, k numbers a place.

const INSIDE = "#b8bdc7";  // of sections where no field is shown
const GHOST = "#8b95a1";  // of the rest around a section
const WHOLE = 15;  // all quarters: the quarter (i, j) of a patch is bit 2 i + j
const AXES = [0, 1, 2];
const SHARP_EDGE = "#98a2ad", MARK = "#d4145a";  // of sharp edges; of places where a gradient is infinite

function remembered(make) {
  const known = {};
  return (...given) => known[given] ??= make(...given);
}

// The corners of the triangles of some quarters of n x n points.
const triangles = remembered((n, quarters) => {
  const middle = (n - 1) >> 1, found = [];
  for (let i = 0; i + 1 < n; i++)
    for (let j = 0; j + 1 < n; j++) {
      if (!(quarters >> (2 * (i >= middle) + (j >= middle)) & 1)) continue;
      const a = i * n + j, b = a + n;
      found.push(a, b, b + 1, a, b + 1, a + 1);
    }
  return Uint32Array.from(found);
});

// The ends of the lines along the border of some quarters of n x n points.
const border = remembered((n, quarters) => {
  const starts = [0, (n - 1) >> 1], lengths = [starts[1], n - 1 - starts[1]], found = [];
  const has = (i, j) => [0, 1].includes(i) && [0, 1].includes(j) && quarters >> (2 * i + j) & 1;
  const line = (from, step, length) => {
    for (let k = 0; k < length; k++) found.push(from + k * step, from + (k + 1) * step);
  };
  for (const i of [0, 1])
    for (const j of [0, 1]) {
      if (!has(i, j)) continue;
      const from = starts[i] * n + starts[j];
      if (!has(i - 1, j)) line(from, 1, lengths[j]);
      if (!has(i + 1, j)) line(from + lengths[i] * n, 1, lengths[j]);
      if (!has(i, j - 1)) line(from, n, lengths[i]);
      if (!has(i, j + 1)) line(from + lengths[j], n, lengths[i]);
    }
  return Uint32Array.from(found);
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

// The part of a cube of data in the lattices of n^3 points, k numbers each.
function latticeOf(source, n, k, cube) {
  return source.lattice.subarray(k * n ** 3 * cube, k * n ** 3 * (cube + 1));
}

function filled(body, patch) {
  return {...patch, places: patch.take(body.places, 3), values: body.values && patch.take(body.values, 1)};
}

// The patch of an outer face; `face` counts these.
function facePatch(body, face, quarters = WHOLE) {
  const {scene} = body, n = scene.samples.faces, count = n * n, [cube, side] = scene.outer[face];
  return filled(body, {
    face, cube, plain: scene.colors[face], corners: triangles(n, quarters), border: border(n, quarters),
    parameters: parametersOn(n, side >> 1, side % 2),
    regions: scene.regions?.numbers.subarray(count * face, count * (face + 1)),
    take: (source, k) => source.faces.subarray(k * count * face, k * count * (face + 1)),
  });
}

// The patch inside a cube where the parameter of an axis is that of the lattice's plane `at`.
function sectionPatch(body, cube, axis, at, quarters = WHOLE) {
  const n = body.scene.samples.lattice;
  return filled(body, {
    face: -1, cube, plain: INSIDE, corners: triangles(n, quarters), border: border(n, quarters),
    parameters: parametersOn(n, axis, at / (n - 1)),
    take: (source, k) => plane(latticeOf(source, n, k, cube), n, k, axis, at),
  });
}

// What is seen: "surface", "cut", or the section at `share` of the way along "u", "v", "w", "x", "y" or "z". Lists of the
// patches, of those that stay as a ghost around a section, of those whose borders are blocks, of sharp edges, and of dots.
function patchesOf(body, part, share) {
  const {scene} = body, last = scene.samples.lattice - 1;
  if (part === "cut") {
    const faces = scene.cut.faces.map(([face, quarters]) => facePatch(body, face, quarters));
    const planes = scene.cut.planes.map(([cube, axis, at, quarters]) => sectionPatch(body, cube, axis, at * last, quarters));
    const whole = new Set(scene.cut.faces.filter(([, quarters]) => quarters === WHOLE).map(([face]) => face));
    return {patches: [...faces, ...planes], ghosts: [], outlines: [...faces, ...planes], ...marksOf(body, whole)};
  }
  const faces = scene.outer.map((_, face) => facePatch(body, face));
  if (part === "surface") return {patches: faces, ghosts: [], outlines: faces, ...marksOf(body)};
  const axis = scene.axes.indexOf(part), cubes = [...scene.meshes.keys()];
  const sections = axis < 0 ? cubes.map((cube) => planeSection(body, cube, "xyz".indexOf(part), share))
    : cubes.map((cube) => sectionPatch(body, cube, axis, Math.round(share * last)));
  const patches = sections.filter((patch) => patch.corners.length);
  return {patches, ghosts: faces.map((patch) => ({...patch, plain: GHOST})), outlines: [], ...marksOf(body)};
}

// The sharp edges and the marks of singular places, those on some outer faces or on all of them.
function marksOf(body, faces = null) {
  const {scene} = body, per = scene.samples.faces ** 2, places = body.places.faces;
  const kept = (numbers) => faces ? numbers.filter((at) => faces.has(Math.floor(at / per))) : numbers;
  const mark = (numbers, plain) => numbers.length ? [{places, plain, cube: 0, border: kept(numbers)}] : [];
  return {edges: mark(scene.edges, SHARP_EDGE), dots: mark(scene.singular?.marks ?? [], MARK)};
}
