// Finds what is drawn at a place of the picture, and the values there.

const PLACES = 2e-5;  // of the box's diagonal: places are known no better

// The patch at a place of the window, its triangle and the weights of the corners; null where there is none.
function hit(patches, camera, canvas, x, y) {
  const [right, down] = fromMiddle(canvas, x, y), fit = camera.fit(canvas);
  const at = [(right - camera.shift[0]) / fit, (camera.shift[1] - down) / fit];
  let best = null;
  patches.forEach((patch, number) => {
    const seen = projected(patch.places, camera.view);
    for (let t = 0; t < patch.corners.length; t += 3) {
      const corners = patch.corners.subarray(t, t + 3), weights = weightsAt(seen, corners, at);
      if (!weights) continue;
      const depth = mixed(seen, 3, corners, weights, 2);
      if (!best || depth > best.depth) best = {patch: number, corners, weights, depth};
    }
  });
  return best;
}

function projected(places, view) {
  const found = new Float32Array(places.length);
  for (let i = 0; i < places.length; i += 3)
    for (let k = 0; k < 3; k++)
      found[i + k] = view[k][0] * places[i] + view[k][1] * places[i + 1] + view[k][2] * places[i + 2];
  return found;
}

// The weights of a triangle's corners that give a point as seen; null for one outside.
function weightsAt(seen, [a, b, c], [x, y]) {
  const ax = seen[3 * a] - x, ay = seen[3 * a + 1] - y, bx = seen[3 * b] - x, by = seen[3 * b + 1] - y;
  const cx = seen[3 * c] - x, cy = seen[3 * c + 1] - y;
  const parts = [bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx], total = parts[0] + parts[1] + parts[2];
  if (!total || parts.some((part) => part * total < 0)) return null;
  return parts.map((part) => part / total);
}

// The number `entry` of k numbers a place, between a triangle's corners.
function mixed(data, k, corners, weights, entry = 0) {
  return weights.reduce((sum, weight, i) => sum + weight * data[k * corners[i] + entry], 0);
}

// The point x, y, z of the body at rest, rounded to what is known of it.
function pointAt(scene, patch, {corners, weights}) {
  const rest = patch.take(scene.places, 3), step = scene.size * PLACES;
  return AXES.map((axis) => {
    const exact = scene.middle[axis] + scene.size * mixed(rest, 3, corners, weights, axis);
    return Number((step * Math.round(exact / step)).toPrecision(6));
  });
}

// What is said of a place: pairs of a name and a text.
function readings(scene, frame, patch, hit) {
  const {corners, weights} = hit;
  const found = [
    ["x, y, z", [pointAt(scene, patch, hit).map(written).join(", "), scene.unit].filter(Boolean).join(" ")],
    ...(scene.meshes.length > 1 ? [["patch", `p${patch.cube}`]] : []),
    ...(scene.solids ? [["solid", scene.solid_names[scene.solids[patch.cube]]]] : []),
    ["u, v, w", AXES.map((axis) => mixed(patch.parameters, 3, corners, weights, axis).toFixed(3)).join(", ")],
  ];
  for (const field of scene.fields)
    found.push([field.title, reading(field, mixed(patch.take(valuesOf(scene, frame, field), 1), 1, corners, weights))]);
  return found;
}

function reading(field, value) {
  if (field.remark) return field.remark;
  return (field.logarithmic && value <= 1.001 * field.low ? "≤ " : "") + written(value);
}

// A number of four significant digits, without needless zeros.
function written(value) {
  const size = Math.abs(value);
  if (size && (size < 1e-3 || size >= 1e6)) return value.toExponential(3).replace(/\.?0+e/, "e");
  return String(Number(value.toPrecision(4)));
}
