// Cuts the lattice of a cube by a plane across an axis of space: marching tetrahedra, six in every cell.

const TETRAHEDRA = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];  // the order of their three steps

// The edges [from, to, share of the way] of the lattice where it meets the plane, three a triangle.
function crossings(heights, n, level) {
  const steps = [n * n, n, 1], found = [];
  const cut = (a, b) => [a, b, (level - heights[a]) / (heights[b] - heights[a])];
  for (let i = 0; i + 1 < n; i++)
    for (let j = 0; j + 1 < n; j++)
      for (let k = 0; k + 1 < n; k++) {
        const first = (i * n + j) * n + k;
        if (!meets(heights, first, n, level)) continue;
        for (const order of TETRAHEDRA) {
          const corners = [first];
          for (const step of order) corners.push(corners.at(-1) + steps[step]);
          const above = corners.filter((at) => heights[at] > level), below = corners.filter((at) => heights[at] <= level);
          if (!above.length || !below.length) continue;
          if (above.length !== 2) {
            const [[alone], others] = above.length === 1 ? [above, below] : [below, above];
            found.push(...others.map((other) => cut(alone, other)));
          } else {
            const [a, b, c, d] = [cut(above[0], below[0]), cut(above[0], below[1]), cut(above[1], below[1]), cut(above[1], below[0])];
            found.push(a, b, c, a, c, d);
          }
        }
      }
  return found;
}

function meets(heights, first, n, level) {
  let above = 0;
  for (const at of [0, 1, n, n + 1]) above += (heights[first + at] > level) + (heights[first + n * n + at] > level);
  return above > 0 && above < 8;
}

const latticeParameters = remembered((n) =>
  Float32Array.from({length: 3 * n ** 3}, (_, at) => {
    const point = Math.floor(at / 3), index = [Math.floor(point / (n * n)), Math.floor(point / n) % n, point % n];
    return index[at % 3] / (n - 1);
  }));

// The section of a cube where x, y or z (axis 0, 1, 2) of the body at rest is `share` of the way through its box.
function planeSection(body, cube, axis, share) {
  const {scene} = body, n = scene.samples.lattice, places = latticeOf(scene.places, n, 3, cube);
  const extent = (scene.high[axis] - scene.low[axis]) / scene.size;
  const heights = Float32Array.from({length: n ** 3}, (_, at) => places[3 * at + axis]);
  const edges = crossings(heights, n, (share - 0.5) * extent);
  const between = (lattice, k) => {
    const found = new lattice.constructor(k * edges.length);
    edges.forEach(([from, to, way], at) => {
      for (let c = 0; c < k; c++) found[k * at + c] = (1 - way) * lattice[k * from + c] + way * lattice[k * to + c];
    });
    return found;
  };
  const take = (source, k) => between(latticeOf(source, n, k, cube), k);
  const corners = Uint32Array.from(edges, (_, at) => at);
  return filled(body, {face: -1, cube, plain: INSIDE, corners, parameters: between(latticeParameters(n), 3), take});
}
