// What lies under the pointer.

/** The move under a place of the screen (pixels), or -1. */
function moveAt(view, state, x, y, width, height) {
  const { data, camera, part } = view;
  const m = new THREE.Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse)
    .multiply(part.matrixWorld).elements;
  const project = (p, i, out) => {
    const a = p[i], b = p[i + 1], c = p[i + 2];
    const w = m[3] * a + m[7] * b + m[11] * c + m[15];
    out[0] = ((m[0] * a + m[4] * b + m[8] * c + m[12]) / w + 1) / 2 * width;
    out[1] = (1 - (m[1] * a + m[5] * b + m[9] * c + m[13]) / w) / 2 * height;
    out[2] = w;
  };
  const scale = height / 2 * camera.projectionMatrix.elements[5];
  const first = data.firstPiece[data.layers[state.low].first], end = data.firstPiece[state.move + 1];
  const a = [0, 0, 0], b = [0, 0, 0];
  let best = -1, nearest = Infinity;
  for (const chunk of view.chunks) {
    if (chunk.first >= end || chunk.end <= first || !boxMeets(chunk, project, x, y)) continue;
    for (let p = Math.max(chunk.first, first); p < Math.min(chunk.end, end); p += 1) {
      if (view.colours[4 * p + 3] === 0) continue;
      project(data.place, 3 * p, a);
      project(data.place, 3 * p + 3, b);
      if (a[2] <= 0 || b[2] <= 0) continue;
      const dx = b[0] - a[0], dy = b[1] - a[1];
      const t = Math.min(Math.max(((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy || 1), 0), 1);
      const off = Math.hypot(a[0] + t * dx - x, a[1] + t * dy - y);
      const depth = a[2] + t * (b[2] - a[2]);
      const half = view.sizes[4 * p] * 0.005 * scale / depth;
      if (off <= Math.max(half, 2.5) && depth < nearest) { nearest = depth; best = p; }
    }
  }
  return best < 0 ? -1 : data.moveOf[best];
}

/** The finding whose mark is under a place of the screen (pixels), if any. */
function findingAt(view, x, y, width, height) {
  const place = new THREE.Vector3();
  const { moves } = view.findings;
  let best, nearest = 12;
  moves.forEach((move, k) => {
    place.set(...view.stand(move, 0).place).applyMatrix4(view.part.matrixWorld).project(view.camera);
    const off = Math.hypot((place.x + 1) / 2 * width - x, (1 - place.y) / 2 * height - y);
    if (place.z < 1 && off < nearest) { nearest = off; best = view.data.meta.findings[k]; }
  });
  return best;
}

/** Whether the box of a chunk, as the screen sees it, has the place inside. */
function boxMeets(chunk, project, x, y) {
  const out = [0, 0, 0];
  let left = Infinity, right = -Infinity, top = Infinity, bottom = -Infinity;
  for (let k = 0; k < 8; k += 1) {
    project([k & 1 ? chunk.high[0] : chunk.low[0], k & 2 ? chunk.high[1] : chunk.low[1], k & 4 ? chunk.high[2] : chunk.low[2]], 0, out);
    if (out[2] <= 0) return true;
    left = Math.min(left, out[0]); right = Math.max(right, out[0]);
    top = Math.min(top, out[1]); bottom = Math.max(bottom, out[1]);
  }
  return x > left - 20 && x < right + 20 && y > top - 20 && y < bottom + 20;
}
