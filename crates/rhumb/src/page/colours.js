// What the colours mean.

const SCALE = [[0x3b, 0x4c, 0xa8], [0x2a, 0x82, 0xb8], [0x2f, 0xae, 0x9d], [0x9c, 0xcb, 0x62], [0xf6, 0xd5, 0x5c]];

/** Ways to colour; those with `of` have a scale. */
const MODES = [
  { name: 'role' },
  { name: 'speed', unit: 'mm/s', of: (d) => d.speed },
  { name: 'bed speed', unit: '°/s', of: (d) => d.bedSpeed },
  { name: 'carriage speed', unit: 'mm/s', of: (d) => d.railSpeed },
  { name: 'flow', unit: 'mm³/s', of: (d) => d.flow },
  { name: 'layer thickness', unit: 'mm', of: (d) => d.thickness },
  { name: 'width', unit: 'mm', of: (d) => d.width },
  { name: 'time', unit: 's', of: (d) => d.ends, whole: true },
];

function onScale(share) {
  const place = Math.min(Math.max(share, 0), 1) * (SCALE.length - 1);
  const k = Math.min(Math.floor(place), SCALE.length - 2), part = place - k;
  return SCALE[k].map((v, c) => Math.round(v + (SCALE[k + 1][c] - v) * part));
}

const gradient = () => `linear-gradient(90deg, ${SCALE.map((c) => `rgb(${c})`).join(', ')})`;

/** The range that the scale spans: all but the rarest two percent at each end, by time. */
function rangeOf(data, mode) {
  const values = mode.of(data);
  if (mode.whole) return [0, data.time];
  let low = Infinity, high = -Infinity;
  for (let k = 0; k < data.n; k += 1) {
    if (data.kind[k] !== EXTRUSION) continue;
    if (values[k] < low) low = values[k];
    if (values[k] > high) high = values[k];
  }
  if (!(high > low)) return [low === Infinity ? 0 : low, low === Infinity ? 1 : low];
  const bins = new Float64Array(1024), scale = 1023 / (high - low);
  let all = 0;
  for (let k = 0; k < data.n; k += 1) {
    if (data.kind[k] !== EXTRUSION) continue;
    bins[Math.floor((values[k] - low) * scale)] += data.path[k];
    all += data.path[k];
  }
  const edge = (share) => {
    let sum = 0, k = 0;
    while (k < 1023 && sum + bins[k] <= share * all) { sum += bins[k]; k += 1; }
    return k;
  };
  return [low + edge(0.02) / scale, Math.min(high, low + (edge(0.98) + 1) / scale)];
}

/** Colours of all pieces as bytes: red, green, blue, and whether it is shown. */
function paint(data, mode, shows, into) {
  const range = mode.of ? rangeOf(data, mode) : null;
  const values = mode.of && mode.of(data);
  const table = new Uint8Array(256 * 3);
  for (let k = 0; k < 256; k += 1) table.set(onScale(k / 255), 3 * k);
  const roles = data.meta.roles.map((role) => role.colour);
  const span = range && range[1] > range[0] ? 255 / (range[1] - range[0]) : 0;
  for (let k = 0; k < data.n; k += 1) {
    const from = 4 * data.firstPiece[k], end = 4 * data.firstPiece[k + 1];
    if (from === end) continue;
    const kind = data.kind[k];
    let r = 0x33, g = 0xb1, b = 0xff, seen = shows.travels ? 255 : 0;
    if (kind === WIPE) [r, g, b] = [0xd8, 0x6a, 0xd8];
    if (kind === EXTRUSION) {
      const role = data.role[k];
      seen = shows.roles[role] ? 255 : 0;
      if (values) {
        const at = 3 * Math.min(Math.max(Math.round((values[k] - range[0]) * span), 0), 255);
        r = table[at]; g = table[at + 1]; b = table[at + 2];
      } else {
        [r, g, b] = roles[role];
      }
    }
    for (let p = from; p < end; p += 4) {
      into[p] = r; into[p + 1] = g; into[p + 2] = b; into[p + 3] = seen;
    }
  }
  return range;
}
