// What is seen: beads as ribbons that face the eye and are lit as if they were round.

/** Pieces that are drawn at once: as many as four corners each can be counted in 16 bits. */
const CHUNK = 1 << 14;

/** The two triangles of a ribbon. */
const CORNERS = [0, 1, 2, 2, 1, 3];

/** Entries in a row of the textures that hold the pieces. */
const ROW = 2048;

/** Chunks that are drawn in one frame where a machine draws without a graphics card. */
const CHUNKS_A_FRAME = 4;

// Corners are not stored: each finds its piece by its number. That is as fast as instances on a
// graphics card, and ten times as fast without one. Only the sketch, which is small and must be
// fast everywhere, has its corners stored.
const RIBBON = `
precision highp float; precision highp int; precision highp sampler2D;
#ifdef STORED
in vec3 from; in vec3 to; in vec4 paint; in vec4 size;
#else
uniform sampler2D places, paints, sizes; uniform int base;
ivec2 entry(int k) { return ivec2(k & 2047, k >> 11); }
#endif
uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec3 eye, light; uniform float grow;
out vec3 colour;
#ifdef PLAIN
float side; vec2 lit; float sky;
#else
out float side; out vec2 lit; out float sky;
#endif
void main() {
#ifndef STORED
  int a = (gl_VertexID >> 2) + base, b = a + 1;
  vec4 paint = texelFetch(paints, entry(a), 0);
  if (paint.a == 0.0) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
  vec3 from = texelFetch(places, entry(a), 0).xyz, to = texelFetch(places, entry(b), 0).xyz;
  vec4 size = texelFetch(sizes, entry(a), 0) * 255.0;
#endif
  vec2 corner = vec2(float(gl_VertexID & 1), float(gl_VertexID & 2) - 1.0);
  vec3 way = to - from;
  float far = length(way);
  vec3 along = far > 0.0 ? way / far : vec3(1.0, 0.0, 0.0);
  vec2 half_size = size.xy * 0.005;
  half_size.y *= grow;
  vec3 place = mix(from, to, corner.x);
  vec3 view = normalize(eye - place);
  vec3 across = cross(along, view);
  across = dot(across, across) > 1e-12 ? normalize(across) : vec3(along.y, -along.x, 0.0);
  vec2 flat_side = vec2(along.y, -along.x);
  flat_side = dot(flat_side, flat_side) > 1e-12 ? normalize(flat_side) : vec2(1.0, 0.0);
  float reach = length(vec2(dot(across.xy, flat_side) * half_size.x, across.z * half_size.y));
  reach = max(reach, size.z * length(eye - place) * 0.0006);
  place += across * corner.y * reach + along * (corner.x * 2.0 - 1.0) * half_size.x * 0.4;
  place.z -= half_size.y;
  side = corner.y;
  lit = vec2(dot(across, light), dot(view, light));
  sky = view.z;
#ifdef PLAIN
  colour = paint.rgb * (0.4 + 0.14 * sky + 0.5 * max(lit.x * side * 0.7 + lit.y * 0.8, 0.0));
#else
  colour = paint.rgb;
#endif
  gl_Position = projectionMatrix * modelViewMatrix * vec4(place, 1.0);
}`;

const RIBBON_COLOUR = `
precision mediump float;
in vec3 colour;
#ifndef PLAIN
in float side; in vec2 lit; in float sky;
#endif
out vec4 shown;
void main() {
#ifdef PLAIN
  shown = vec4(colour, 1.0);
#else
  float facing = sqrt(max(1.0 - side * side, 0.0));
  float light = 0.36 + 0.14 * sky + 0.62 * max(lit.x * side + lit.y * facing, 0.0);
  shown = vec4(colour * light, 1.0);
#endif
}`;

const DOT = `
precision highp float;
in vec3 position;
uniform mat4 modelViewMatrix, projectionMatrix; uniform float pixels;
void main() { gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); gl_PointSize = pixels; }`;

const DOT_COLOUR = `
precision mediump float;
uniform vec3 colour; out vec4 shown;
void main() {
  vec2 off = gl_PointCoord - 0.5;
  if (dot(off, off) > 0.25) discard;
  shown = vec4(dot(off, off) > 0.14 ? vec3(1.0) : colour, 1.0);
}`;

/** Everything that is not laid: as light as its corners. */
const BODY = `
precision highp float;
in vec3 position; in vec3 normal;
uniform mat4 modelViewMatrix, projectionMatrix, modelMatrix; uniform vec3 tint;
out vec3 colour;
void main() {
  vec3 facing = normalize(mat3(modelMatrix) * normal);
  colour = tint * (0.68 + 0.2 * facing.z + 0.16 * dot(facing, vec3(-0.4, -0.8, 0.4)));
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

const BODY_COLOUR = `
precision mediump float;
in vec3 colour; out vec4 shown;
void main() { shown = vec4(colour, 1.0); }`;

const bodyOf = (tint) => new THREE.RawShaderMaterial({
  glslVersion: THREE.GLSL3, vertexShader: BODY, fragmentShader: BODY_COLOUR, uniforms: { tint: { value: new THREE.Color(tint) } },
});

const COPY = `
precision highp float;
out vec2 place;
void main() { place = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 2.0; gl_Position = vec4(place * 2.0 - 1.0, 0.0, 1.0); }`;

const COPY_COLOUR = `
precision highp float;
uniform sampler2D picture; in vec2 place; out vec4 shown;
void main() { shown = vec4(texture(picture, place).rgb, 1.0); }`;

/** What draws: the name of the graphics card, or of what stands for one. */
function drawer() {
  const gl = document.createElement('canvas').getContext('webgl2');
  if (!gl) throw new Error('it has no WebGL 2');
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  const name = info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : '';
  gl.getExtension('WEBGL_lose_context')?.loseContext();
  return { name, isSoftware: /swiftshader|llvmpipe|software|basic render/i.test(name) };
}

class View {
  constructor(canvas, data) {
    this.data = data;
    this.drawer = drawer();
    /** More pieces than these are drawn in several frames. */
    this.atOnce = this.drawer.isSoftware ? 60000 : 3000000;
    // All colours are as they are written.
    THREE.ColorManagement.enabled = false;
    this.renderer = new THREE.WebGLRenderer({
      canvas, antialias: !this.drawer.isSoftware, powerPreference: 'high-performance',
    });
    this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    this.renderer.autoClear = false;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(35, 1, 0.5, 5000);
    this.camera.up.set(0, 0, 1);
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.turning = new THREE.Group();
    this.part = new THREE.Group();
    this.part.position.set(-data.axis[0], -data.axis[1], 0);
    this.turning.add(this.part);
    this.surroundings = new THREE.Group();
    this.scene.add(this.turning, this.surroundings);
    this.colours = new Uint8Array(4 * ROW * Math.ceil(data.pieces / ROW));
    this.sizes = this.sizesOfPieces();
    this.buildMaterial();
    this.buildChunks();
    this.sketch = new Sketch(this);
    this.buildSurroundings();
    this.buildMarks();
  }

  buildMaterial() {
    const { data } = this;
    const points = new Float32Array(4 * ROW * Math.ceil((data.pieces + 1) / ROW));
    for (let p = 0; p <= data.pieces; p += 1) {
      for (let c = 0; c < 3; c += 1) points[4 * p + c] = data.place[3 * p + c];
    }
    this.paints = texture(this.colours, 4, THREE.RGBAFormat, THREE.UnsignedByteType);
    this.uniforms = {
      places: { value: texture(points, 4, THREE.RGBAFormat, THREE.FloatType) },
      paints: { value: this.paints },
      sizes: { value: texture(this.sizes, 4, THREE.RGBAFormat, THREE.UnsignedByteType) },
      eye: { value: new THREE.Vector3() }, light: { value: new THREE.Vector3() },
      base: { value: 0 }, grow: { value: 1 },
    };
    const material = (defines) => new THREE.RawShaderMaterial({
      glslVersion: THREE.GLSL3, vertexShader: RIBBON, fragmentShader: RIBBON_COLOUR,
      uniforms: this.uniforms, side: THREE.DoubleSide, defines,
    });
    const plain = this.drawer.isSoftware ? { PLAIN: 1 } : {};
    this.material = material(plain);
    this.storedMaterial = material({ ...plain, STORED: 1 });
    const order = new Uint16Array(6 * CHUNK);
    for (let k = 0; k < CHUNK; k += 1) {
      for (let c = 0; c < 6; c += 1) order[6 * k + c] = 4 * k + CORNERS[c];
    }
    this.order = new THREE.BufferAttribute(order, 1);
  }

  /** Width and thickness in hundredths of a millimetre, and whether a thin line. */
  sizesOfPieces() {
    const { data } = this, sizes = new Uint8Array(this.colours.length);
    for (let p = 0; p < data.pieces; p += 1) {
      const k = data.moveOf[p], lays = data.kind[k] === EXTRUSION;
      sizes[4 * p] = lays ? Math.min((data.width[k] || data.meta.nozzle) * 100, 255) : 5;
      sizes[4 * p + 1] = lays ? Math.min(Math.max(data.thickness[k] * 100, 1), 255) : 5;
      sizes[4 * p + 2] = lays ? 0 : 1;
    }
    return sizes;
  }

  /** A mesh of up to `CHUNK` pieces from `base` on. */
  ribbons(base) {
    const geometry = new THREE.BufferGeometry();
    geometry.setIndex(this.order);
    const mesh = new THREE.Mesh(geometry, this.material);
    mesh.frustumCulled = false;
    mesh.onBeforeRender = () => {
      this.uniforms.base.value = base;
      this.uniforms.grow.value = 1;
      this.material.uniformsNeedUpdate = true;
    };
    this.part.add(mesh);
    return mesh;
  }

  buildChunks() {
    const { data } = this;
    this.chunks = [];
    for (let first = 0; first < data.pieces; first += CHUNK) {
      const end = Math.min(first + CHUNK, data.pieces);
      const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
      for (let k = 3 * first; k < 3 * (end + 1); k += 1) {
        const c = k % 3, v = data.place[k];
        if (v < low[c]) low[c] = v;
        if (v > high[c]) high[c] = v;
      }
      this.chunks.push({ mesh: this.ribbons(first), first, end, low, high });
    }
  }

  buildSurroundings() {
    const { data } = this;
    const [cx, cy] = data.axis;
    this.reach = 10;
    for (let k = 0; k < data.n; k += 1) {
      if (data.kind[k] !== EXTRUSION || data.layerOf[k] < 0) continue;
      const p = 3 * data.firstPiece[k];
      this.reach = Math.max(this.reach, Math.hypot(data.place[p] - cx, data.place[p + 1] - cy));
    }
    this.radius = Math.ceil(this.reach * 1.1 / 10) * 10;
    const plate = new THREE.Mesh(new THREE.CylinderGeometry(this.radius, this.radius, 2, 96),
      this.plateMaterial = bodyOf(0xcfd5dc));
    plate.rotation.x = Math.PI / 2;
    plate.position.z = -1.06;
    const rings = [];
    for (let r = 10; r <= this.radius; r += 10) {
      for (let k = 0; k < 96; k += 1) {
        for (const a of [k, k + 1]) rings.push(r * Math.cos(a * Math.PI / 48), r * Math.sin(a * Math.PI / 48), -0.04);
      }
    }
    rings.push(0, 0, -0.04, this.radius, 0, -0.04);
    this.ringMaterial = new THREE.LineBasicMaterial({ color: 0x98a3b1 });
    this.bed = new THREE.Group();
    this.bed.add(plate, new THREE.LineSegments(geometryOf(rings), this.ringMaterial));
    this.turning.add(this.bed);
    this.nozzle = new THREE.Group();
    const tip = new THREE.Mesh(new THREE.ConeGeometry(1.8, 4, 24), bodyOf(0xc8963c));
    tip.rotation.x = -Math.PI / 2;
    tip.position.z = 2;
    const grey = bodyOf(0x8c96a3);
    const barrel = new THREE.Mesh(new THREE.CylinderGeometry(1.8, 1.8, 12, 24), grey);
    barrel.rotation.x = Math.PI / 2;
    barrel.position.z = 10;
    this.nozzle.add(tip, barrel);
    this.carriage = new THREE.Mesh(new THREE.BoxGeometry(9, 7, 6), grey);
    this.carriage.position.z = 17;
    this.nozzle.add(this.carriage);
    this.rail = new THREE.Group();
    const beam = new THREE.Mesh(new THREE.BoxGeometry(1, 2.4, 2.4), bodyOf(0x5d6875));
    beam.scale.x = this.radius * 1.6;
    beam.position.set(this.radius * 0.55, 0, 17);
    this.rail.add(beam);
    this.surroundings.add(this.nozzle, this.rail);
  }

  buildMarks() {
    const { data } = this;
    this.marks = new THREE.Group();
    this.part.add(this.marks);
    const retractions = [], seams = [], findings = [];
    const start = (k) => 3 * data.firstPiece[k];
    for (let k = 0; k < data.n; k += 1) {
      if (data.kind[k] === RETRACTION || data.kind[k] === WIPE && data.kind[k - 1] !== WIPE) retractions.push(k);
      const begins = data.kind[k] === EXTRUSION && data.role[k] === 0
        && (k === 0 || data.kind[k - 1] !== EXTRUSION || data.role[k - 1] !== 0);
      if (begins) seams.push(k);
    }
    for (const finding of data.meta.findings) {
      const k = Math.min(lowerBound(data.line, finding.line), data.n - 1);
      finding.move = k;
      if (k >= 0) findings.push(k);
    }
    const dots = (moves, colour, pixels, hidden) => {
      const places = new Float32Array(3 * moves.length);
      moves.forEach((k, i) => places.set(data.place.subarray(start(k), start(k) + 3), 3 * i));
      const points = new THREE.Points(geometryOf(places), new THREE.RawShaderMaterial({
        glslVersion: THREE.GLSL3, vertexShader: DOT, fragmentShader: DOT_COLOUR, depthTest: !hidden,
        uniforms: { colour: { value: new THREE.Color(colour) }, pixels: { value: pixels } },
      }));
      points.frustumCulled = false;
      points.visible = false;
      points.renderOrder = hidden ? 2 : 1;
      this.marks.add(points);
      return { points, moves };
    };
    this.retractions = dots(retractions, 0xd86ad8, 7);
    this.seams = dots(seams, 0x2a82b8, 6);
    this.findings = dots(findings, 0xd81e5b, 13, true);
    this.findings.points.visible = findings.length > 0;
  }

  recolour(mode, shows) {
    const range = paint(this.data, mode, shows, this.colours);
    this.paints.needsUpdate = true;
    this.sketch.forget();
    return range;
  }

  theme(back, plate, ring) {
    this.renderer.setClearColor(new THREE.Color(back), 1);
    this.plateMaterial.uniforms.tint.value.set(plate);
    this.ringMaterial.color.set(ring);
  }

  /** Looks at the whole print. */
  fit() {
    const { box, axis } = this.data;
    const high = box.high[2], away = Math.max(this.reach * 1.1, high * 0.8) / Math.tan(17.5 * Math.PI / 180);
    const narrow = Math.max(1.1, 1.3 / this.camera.aspect);
    this.controls.target.set((box.low[0] + box.high[0]) / 2 - axis[0], (box.low[1] + box.high[1]) / 2 - axis[1], high * 0.4);
    this.camera.position.set(0.36, -0.74, 0.56).multiplyScalar(away * narrow).add(this.controls.target);
    this.controls.update();
  }

  /** Looks at a place of the part from nearby. */
  approach(place) {
    const target = this.part.localToWorld(new THREE.Vector3(...place));
    const off = this.camera.position.clone().sub(this.controls.target).setLength(Math.max(this.reach, 20));
    this.controls.target.copy(target);
    this.camera.position.copy(target).add(off);
    this.controls.update();
  }

  /** Fits the canvas; the middle of the picture is shifted to the left and upwards by some pixels. */
  resize(width, height, ratio, shift) {
    this.ratio = ratio;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.setViewOffset(width, height, shift[0], shift[1], width, height);
    this.camera.updateProjectionMatrix();
  }

  /** Where the nozzle is in the part, and the bed's angle in degrees, on the way of a move. */
  stand(move, share) {
    const { data } = this;
    const from = data.firstPiece[move], end = data.firstPiece[move + 1];
    const along = from + (end - from) * share, p = Math.min(Math.floor(along), Math.max(end - 1, from));
    const part = end > from ? along - p : 0;
    const place = [0, 1, 2].map((c) => {
      const a = data.place[3 * p + c], b = end > from ? data.place[3 * p + 3 + c] : a;
      return a + (b - a) * part;
    });
    return { place, bed: data.bed[move] + (data.bed[move + 1] - data.bed[move]) * share };
  }

  /** Without a graphics card pixels are dear: fewer of them while the picture moves. */
  coarsen(moving) {
    const ratio = this.ratio * (moving && this.drawer.isSoftware ? this.sketch.sharpness : 1);
    if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
  }

  /** How many pieces a state shows. */
  pieces(state) {
    const { data } = this;
    return data.firstPiece[state.move + 1] - data.firstPiece[data.layers[state.low].first];
  }

  /** Shows the moves of a state; only a sketch of all but the topmost layer when `moving`. */
  show(state, moving) {
    const { data } = this;
    const end = data.firstPiece[state.move + 1], first = data.firstPiece[data.layers[state.low].first];
    const isSketch = this.sketch.show(state, moving, first, end);
    const begin = isSketch ? this.sketch.topFrom : first;
    let drawn = 0;
    for (const { mesh, first: from, end: to } of this.chunks) {
      const skip = Math.max(begin - from, 0), count = Math.min(end, to) - from - skip;
      mesh.visible = count > 0;
      if (!mesh.visible) continue;
      mesh.geometry.setDrawRange(6 * skip, 6 * count);
      drawn += count;
    }
    this.drawn = { pieces: drawn, sketched: isSketch ? this.sketch.count : 0 };
    const low = data.layers[state.low].first;
    for (const { points, moves } of [this.retractions, this.seams]) {
      const from = lowerBound(moves, low);
      points.geometry.setDrawRange(from, Math.max(lowerBound(moves, state.move + 1) - from, 0));
    }
    const { place, bed } = this.stand(state.move, state.share);
    this.turning.rotation.z = state.machine ? -bed * Math.PI / 180 : 0;
    this.turning.updateMatrixWorld(true);
    this.nozzle.position.copy(this.part.localToWorld(new THREE.Vector3(...place)));
    this.nozzle.visible = state.machine || state.playing || state.move < data.n - 1;
    this.rail.visible = this.carriage.visible = state.machine;
    this.rail.position.set(0, state.machine ? this.nozzle.position.y : 0, place[2]);
  }

  aim() {
    const inverse = new THREE.Matrix4().copy(this.part.matrixWorld).invert();
    this.camera.updateMatrixWorld();
    this.uniforms.eye.value.copy(this.camera.position).applyMatrix4(inverse);
    const m = this.camera.matrixWorld.elements;
    // Over the left shoulder.
    this.uniforms.light.value.set(m[8] * 0.72 + m[4] * 0.5 - m[0] * 0.5, m[9] * 0.72 + m[5] * 0.5 - m[1] * 0.5,
      m[10] * 0.72 + m[6] * 0.5 - m[2] * 0.5).normalize().transformDirection(inverse);
  }

  draw() {
    this.aim();
    this.renderer.clear();
    this.renderer.render(this.scene, this.camera);
  }

  /** Draws as `draw`, beside the screen and a few chunks at a time, and shows the result at the end. */
  * drawSlowly() {
    this.aim();
    const { renderer, scene, camera } = this, size = renderer.domElement;
    if (!this.target || this.target.width !== size.width || this.target.height !== size.height) {
      this.target?.dispose();
      this.target = new THREE.WebGLRenderTarget(size.width, size.height);
    }
    const chunks = this.chunks.filter(({ mesh }) => mesh.visible);
    const all = [this.bed, this.surroundings, this.marks, ...chunks.map(({ mesh }) => mesh)];
    const pass = (shown) => {
      for (const one of all) one.visible = shown.includes(one);
      renderer.setRenderTarget(this.target);
      renderer.render(scene, camera);
      renderer.setRenderTarget(null);
      for (const one of all) one.visible = true;
    };
    renderer.setRenderTarget(this.target);
    renderer.clear();
    pass([this.bed, this.surroundings]);
    for (let k = 0; k < chunks.length; k += CHUNKS_A_FRAME) {
      pass(chunks.slice(k, k + CHUNKS_A_FRAME).map(({ mesh }) => mesh));
      yield;
    }
    pass([this.marks]);
    this.copy(this.target.texture);
  }

  copy(picture) {
    if (!this.copier) {
      const geometry = new THREE.BufferGeometry();
      geometry.setIndex([0, 1, 2]);
      this.copier = new THREE.Mesh(geometry, new THREE.RawShaderMaterial({
        glslVersion: THREE.GLSL3, vertexShader: COPY, fragmentShader: COPY_COLOUR,
        uniforms: { picture: { value: null } }, depthTest: false, depthWrite: false, side: THREE.DoubleSide,
      }));
      this.copier.frustumCulled = false;
    }
    this.copier.material.uniforms.picture.value = picture;
    this.renderer.clear();
    this.renderer.render(this.copier, this.camera);
  }
}

/** A texture that holds numbers, `ROW` entries a row. */
function texture(array, numbers, format, type) {
  const made = new THREE.DataTexture(array, ROW, array.length / numbers / ROW, format, type);
  made.needsUpdate = true;
  return made;
}

function geometryOf(places) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(places), 3));
  return geometry;
}

/** Roles that are hidden inside as long as the outline is shown. */
const INSIDE = new Set(['Perimeter', 'Internal infill', 'Solid infill', 'Gap fill']);

/** With fewer runs a sketch shows nothing of the print. */
const LEAST_RUNS = 10000;

/** When a run of the sketch is shown; 0 is never. */
const ON_TOP = 1, BY_LAYER = 2, ALWAYS = 3;

/**
 * What stands for the lower layers while the picture moves, where drawing every piece would be too
 * slow: outlines and tops, straight runs joined, and if need be every other layer, twice as thick.
 */
class Sketch {
  constructor(view) {
    this.view = view;
    this.budget = view.drawer.isSoftware ? 30000 : 1500000;
    this.sharpness = 0.6;
    this.slow = 0;
    this.count = 0;
    this.capacity = 0;
    this.grow = 1;
  }

  /** The runs of all groups of at most `CHUNK` pieces; a group never spans two layers. */
  prepare() {
    const { data } = this.view;
    const start = new Int32Array(data.pieces), end = new Int32Array(data.pieces), groups = [];
    let count = 0, group = null, layer = -1, run = null;
    const p = data.place;
    for (let k = 0; k < data.n; k += 1) {
      const from = data.firstPiece[k], to = data.firstPiece[k + 1];
      if (layer < 0 || k >= data.layers[layer].end || from - group.piece > CHUNK) {
        if (layer < 0 || k >= data.layers[layer].end) layer += 1;
        group = { layer, piece: from, first: count, end: count };
        groups.push(group);
        run = null;
      }
      if (data.kind[k] !== EXTRUSION) { run = null; continue; }
      for (let i = from; i < to; i += 1) {
        const x = p[3 * i + 3] - p[3 * i], y = p[3 * i + 4] - p[3 * i + 1], z = p[3 * i + 5] - p[3 * i + 2];
        const length = Math.hypot(x, y, z) || 1e-9;
        const goesOn = run && run.role === data.role[k] && run.length + length < 8
          && (x * run.x + y * run.y + z * run.z) / length > 0.966;
        if (goesOn) {
          run.length += length;
          end[count - 1] = i + 1;
        } else {
          run = { role: data.role[k], length, x: x / length, y: y / length, z: z / length };
          start[count] = i;
          end[count] = i + 1;
          count += 1;
        }
      }
      group.end = count;
    }
    Object.assign(this, { start: start.slice(0, count), end: end.slice(0, count), groups });
  }

  forget() { this.key = ''; this.counts = null; }

  /** Which runs are shown: always, on layers that are not left out, or on the topmost layer only. */
  countShown() {
    const { data, colours } = this.view, roles = data.meta.roles;
    const index = (label) => roles.findIndex((role) => role.label === label);
    const outlines = this.shows.roles[index('External perimeter')];
    const rank = roles.map((role) => (role.label === 'Top solid infill' ? ALWAYS
      : outlines && INSIDE.has(role.label) ? ON_TOP : BY_LAYER));
    this.ranks = new Uint8Array(this.start.length);
    this.counts = this.groups.map((group) => {
      const counts = [0, 0, 0, 0];
      for (let k = group.first; k < group.end; k += 1) {
        const piece = this.start[k];
        // Hidden pieces have no opacity in the colours.
        this.ranks[k] = colours[4 * piece + 3] > 0 ? rank[data.role[data.moveOf[piece]]] : 0;
        counts[this.ranks[k]] += 1;
      }
      return counts;
    });
  }

  /** The least rank that is shown of a group. */
  least(group, top, stride) {
    return group.layer === this.groups[top].layer ? ON_TOP : group.layer % stride === 0 ? BY_LAYER : ALWAYS;
  }

  show(state, moving, first, end) {
    if (!moving || end - first <= Math.min(this.budget, this.view.atOnce)) {
      if (this.mesh) this.mesh.visible = false;
      return false;
    }
    if (!this.groups) this.prepare();
    this.shows = state.shows;
    if (!this.counts) this.countShown();
    let top = this.groups.length - 1;
    while (top > 0 && this.groups[top].piece > 0 && this.groups[top].piece >= end) top -= 1;
    this.topFrom = Math.max(this.groups[top].piece, first);
    let low = 0;
    while (low < top && this.groups[low].layer < state.low) low += 1;
    let stride = 1, total;
    for (; stride < 64; stride *= 2) {
      total = 0;
      for (let g = low; g < top; g += 1) {
        for (let rank = this.least(this.groups[g], top, stride); rank <= ALWAYS; rank += 1) total += this.counts[g][rank];
      }
      if (total <= this.budget) break;
    }
    const key = `${low} ${top} ${stride}`;
    if (key !== this.key) this.fill(low, top, stride, total);
    this.key = key;
    this.mesh.visible = true;
    return true;
  }

  fill(low, top, stride, total) {
    const { data, colours, sizes } = this.view;
    if (total > this.capacity || !this.mesh) this.build(Math.ceil(Math.max(total, 4096) * 1.2));
    const { from, to, paint, size } = this.corners;
    let at = 0;
    // From above, so that little is painted over.
    for (let g = top - 1; g >= low; g -= 1) {
      const group = this.groups[g], least = this.least(group, top, stride);
      for (let k = group.first; k < group.end; k += 1) {
        if (this.ranks[k] < least) continue;
        const a = this.start[k], b = this.end[k];
        for (const end = at + 4; at < end; at += 1) {
          for (let c = 0; c < 3; c += 1) {
            from[3 * at + c] = data.place[3 * a + c];
            to[3 * at + c] = data.place[3 * b + c];
          }
          for (let c = 0; c < 4; c += 1) {
            paint[4 * at + c] = colours[4 * a + c];
            size[4 * at + c] = sizes[4 * a + c];
          }
        }
      }
    }
    this.count = at / 4;
    this.grow = stride * 1.3;
    this.mesh.geometry.setDrawRange(0, 6 * this.count);
    for (const name of Object.keys(this.corners)) {
      const attribute = this.mesh.geometry.attributes[name];
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, at * attribute.itemSize);
      attribute.needsUpdate = true;
    }
  }

  /** Makes room for so many runs. */
  build(capacity) {
    const { view } = this;
    if (this.mesh) {
      view.part.remove(this.mesh);
      this.mesh.geometry.dispose();
    }
    this.capacity = capacity;
    const n = 4 * capacity, order = new Uint32Array(6 * capacity);
    for (let k = 0; k < capacity; k += 1) {
      for (let c = 0; c < 6; c += 1) order[6 * k + c] = 4 * k + CORNERS[c];
    }
    this.corners = {
      from: new Float32Array(3 * n), to: new Float32Array(3 * n), paint: new Uint8Array(4 * n), size: new Uint8Array(4 * n),
    };
    const geometry = new THREE.BufferGeometry();
    for (const [name, array] of Object.entries(this.corners)) {
      geometry.setAttribute(name, new THREE.BufferAttribute(array, array.length / n, name === 'paint'));
    }
    geometry.setIndex(new THREE.BufferAttribute(order, 1));
    this.mesh = new THREE.Mesh(geometry, view.storedMaterial);
    this.mesh.frustumCulled = false;
    this.mesh.onBeforeRender = () => {
      view.uniforms.grow.value = this.grow;
      view.storedMaterial.uniformsNeedUpdate = true;
    };
    view.part.add(this.mesh);
  }

  /** Learns from how long a frame took, ms. */
  learn(took) {
    if (took > 30) {
      this.budget = Math.max(this.budget * 0.85, LEAST_RUNS);
      this.slow += this.budget === LEAST_RUNS ? 1 : 0;
      if (this.slow === 10) {
        this.sharpness = Math.max(this.sharpness - 0.1, 0.4);
        this.slow = 0;
      }
    } else if (took < 20) this.budget = Math.min(this.budget * 1.05, 8e6);
  }
}
