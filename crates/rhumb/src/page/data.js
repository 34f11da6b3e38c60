// What the program does, unpacked from the page: one entry a move, one place a drawn piece.

/** What a move is, as the page was written. */
const EXTRUSION = 0, TRAVEL = 1, WIPE = 2, RETRACTION = 3, PRIME = 4;

function bytesOf(base64) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(base64);
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let k = 0; k < bytes.length; k += 1) bytes[k] = text.charCodeAt(k);
  return bytes;
}

async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Reads numbers of seven bits a byte, the lowest first. */
class Column {
  constructor(bytes) { this.bytes = bytes; this.at = 0; }
  unsigned() {
    let byte = this.bytes[this.at++], value = byte & 127, unit = 128;
    while (byte > 127) {
      byte = this.bytes[this.at++];
      value += (byte & 127) * unit;
      unit *= 128;
    }
    return value;
  }
  /** Negative numbers are odd. */
  signed() {
    const value = this.unsigned();
    return value % 2 ? -(value + 1) / 2 : value / 2;
  }
}

async function unpack(meta, base64) {
  const bytes = await inflated(bytesOf(base64));
  let from = 0;
  const column = {};
  for (const [name, length] of meta.columns) {
    column[name] = new Column(bytes.subarray(from, from + length));
    from += length;
  }
  const n = meta.moves, pieces = meta.pieces;
  const data = {
    meta, n, pieces,
    line: new Int32Array(n), kind: new Uint8Array(n), role: new Uint8Array(n),
    layerOf: new Int32Array(n), width: new Float32Array(n), filament: new Float32Array(n),
    duration: new Float32Array(n), ends: new Float64Array(n), bed: new Float64Array(n + 1),
    rail: new Float32Array(n + 1), path: new Float32Array(n), firstPiece: new Int32Array(n + 1),
    moveOf: new Int32Array(pieces), place: new Float32Array(3 * (pieces + 1)),
  };
  const at = meta.start.slice();
  data.place.set(at.map((v) => v / 1000));
  let [line, layer, width, bed, rail] = [0, -1, 0, meta.bedStart, meta.railStart];
  let time = 0, piece = 0;
  data.bed[0] = bed * 1e-4;
  data.rail[0] = rail / 1000;
  for (let k = 0; k < n; k += 1) {
    data.line[k] = line += column.line.unsigned();
    const what = column.what.unsigned();
    data.kind[k] = what & 7;
    data.role[k] = what >> 3;
    layer += column.layer.signed();
    data.layerOf[k] = layer;
    data.width[k] = (width += column.width.signed()) / 1000;
    data.filament[k] = column.filament.signed() * 1e-5;
    data.duration[k] = column.duration.unsigned() * 1e-5;
    data.ends[k] = time += data.duration[k];
    data.bed[k + 1] = (bed += column.bed.signed()) * 1e-4;
    data.rail[k + 1] = (rail += column.rail.signed()) / 1000;
    data.firstPiece[k] = piece;
    let length = 0;
    for (let count = column.pieces.unsigned(); count > 0; count -= 1) {
      const x = column.x.signed(), y = column.y.signed(), z = column.z.signed();
      at[0] += x; at[1] += y; at[2] += z;
      length += Math.hypot(x, y, z);
      data.moveOf[piece] = k;
      piece += 1;
      data.place[3 * piece] = at[0] / 1000;
      data.place[3 * piece + 1] = at[1] / 1000;
      data.place[3 * piece + 2] = at[2] / 1000;
    }
    data.path[k] = length / 1000;
  }
  data.firstPiece[n] = piece;
  data.time = time;
  measure(data);
  return data;
}

/** What follows from the columns: layers, size, and how fast and thick everything is. */
function measure(data) {
  const { n, meta } = data;
  const box = { low: [Infinity, Infinity, Infinity], high: [-Infinity, -Infinity, -Infinity] };
  data.layers = [];
  let last;
  for (let k = 0; k < n; k += 1) {
    if (!last || last.layer !== data.layerOf[k]) {
      last = { layer: data.layerOf[k], first: k, end: k, top: -Infinity, filament: 0 };
      data.layers.push(last);
    }
    last.end = k + 1;
    if (data.kind[k] !== EXTRUSION) continue;
    last.filament += data.filament[k];
    for (let p = data.firstPiece[k]; p <= data.firstPiece[k + 1]; p += 1) {
      for (let c = 0; c < 3; c += 1) {
        const v = data.place[3 * p + c];
        if (data.layerOf[k] >= 0 && v < box.low[c]) box.low[c] = v;
        if (data.layerOf[k] >= 0 && v > box.high[c]) box.high[c] = v;
      }
      last.top = Math.max(last.top, data.place[3 * p + 2]);
    }
  }
  if (!(box.high[0] >= box.low[0])) { box.low = [-20, -20, 0]; box.high = [20, 20, 20]; }
  data.box = box;
  data.axis = meta.axis || [(box.low[0] + box.high[0]) / 2, (box.low[1] + box.high[1]) / 2];
  if (!meta.hasJoints) follow(data);
  quantities(data);
}

/** Where bed and carriage of a polar printer would be, for programs in x and y. */
function follow(data) {
  const [cx, cy] = data.axis;
  let angle = 0;
  for (let k = 0; k <= data.n; k += 1) {
    const p = 3 * (k < data.n ? data.firstPiece[k] : data.pieces);
    const x = data.place[p] - cx, y = data.place[p + 1] - cy;
    const radius = Math.hypot(x, y);
    if (radius > 1e-6) {
      const turn = Math.atan2(y, x) - angle;
      angle += turn - 2 * Math.PI * Math.round(turn / (2 * Math.PI));
    }
    data.bed[k] = angle * 180 / Math.PI;
    data.rail[k] = radius;
  }
}

function quantities(data) {
  const n = data.n, area = data.meta.filamentArea, corner = 1 - Math.PI / 4;
  for (const name of ['speed', 'bedSpeed', 'railSpeed', 'flow', 'thickness']) data[name] = new Float32Array(n);
  for (let k = 0; k < n; k += 1) {
    const t = data.duration[k];
    if (t > 0) {
      data.speed[k] = (data.path[k] > 0 ? data.path[k] : Math.abs(data.filament[k])) / t;
      data.bedSpeed[k] = Math.abs(data.bed[k + 1] - data.bed[k]) / t;
      data.railSpeed[k] = Math.abs(data.rail[k + 1] - data.rail[k]) / t;
    }
    if (data.kind[k] !== EXTRUSION) continue;
    if (t > 0) data.flow[k] = data.filament[k] * area / t;
    // A bead is a rounded rectangle: its section is w·t − t²(1 − π/4).
    const section = data.filament[k] * area / Math.max(data.path[k], 1e-6);
    const w = data.width[k] || data.meta.nozzle;
    const root = w * w - 4 * corner * section;
    data.thickness[k] = Math.min(root > 0 ? (w - Math.sqrt(root)) / (2 * corner) : w, 2);
  }
}

/** The last layer entry whose first move is not after a move. */
function layerAt(data, move) {
  let low = 0, high = data.layers.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (data.layers[middle].first <= move) low = middle; else high = middle - 1;
  }
  return low;
}

/** The first entry of an ascending array that is not below a value. */
function lowerBound(array, value) {
  let low = 0, high = array.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (array[middle] < value) low = middle + 1; else high = middle;
  }
  return low;
}
