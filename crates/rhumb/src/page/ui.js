// Sliders, legend, keys.

const $ = (id) => document.getElementById(id);

const KINDS = ['laying', 'travel', 'wipe', 'retraction', 'filament forward'];

const PACES = [1, 10, 60, 300, 1000];

function clock(seconds) {
  const s = Math.round(seconds), two = (n) => String(n).padStart(2, '0');
  return s >= 3600 ? `${Math.floor(s / 3600)}:${two(Math.floor(s / 60) % 60)}:${two(s % 60)} h`
    : s >= 60 ? `${Math.floor(s / 60)}:${two(s % 60)} min` : `${seconds < 10 ? seconds.toFixed(1) : s} s`;
}

/** With two decimals, and never -0.00. */
const fixed = (value) => (Math.round(value * 100) / 100 + 0).toFixed(2);

const short = (value) => {
  const size = Math.abs(value);
  return value.toFixed(size >= 100 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 3);
};

class Page {
  constructor(data) {
    this.data = data;
    this.view = new View($('view'), data);
    const top = data.layers.length - 1;
    this.state = {
      low: 0, layer: top, move: data.n - 1, share: 1, machine: false, playing: false,
      mode: 0, shows: { travels: false, roles: data.meta.roles.map(() => true) },
    };
    this.movedAt = -Infinity;
    this.head();
    this.controls();
    this.findings();
    this.keys();
    this.pointer();
    this.setTheme(matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light');
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', (e) => this.setTheme(e.matches ? 'dark' : 'light'));
    if (innerWidth <= 720) this.fold();
    this.resize();
    addEventListener('resize', () => this.resize());
    this.view.fit();
    this.view.controls.addEventListener('change', () => this.moved());
    this.recolour();
    this.sync();
  }

  head() {
    const { data } = this, { meta } = data;
    $('name').textContent = meta.name;
    const grams = meta.density ? `, ${short(this.grams(this.laid()))} g` : '';
    const layers = data.layers.filter((layer) => layer.layer >= 0).length;
    $('facts').textContent = `${data.n.toLocaleString('en')} moves, ${layers} layers, ${clock(data.time)}${grams} · ${meta.dialect}`;
  }

  laid() { return this.data.filament.reduce((sum, e) => sum + e, 0); }

  grams(filament) { return filament * this.data.meta.filamentArea * this.data.meta.density; }

  controls() {
    const { data, state } = this;
    MODES.forEach((mode, k) => $('mode').add(new Option(mode.name, k)));
    PACES.forEach((pace) => $('pace').add(new Option(`${pace}×`, pace)));
    $('pace').value = 60;
    for (const id of ['layer', 'low']) $(id).max = data.layers.length - 1;
    $('mode').addEventListener('change', () => { state.mode = Number($('mode').value); this.recolour(); });
    $('layer').addEventListener('input', () => this.setLayer(Number($('layer').value)));
    $('low').addEventListener('input', () => this.setLow(Number($('low').value)));
    $('move').addEventListener('input', () => this.setMove(data.layers[state.layer].first + Number($('move').value)));
    $('play').addEventListener('click', () => this.play());
    $('fit').addEventListener('click', () => this.fit());
    $('theme').addEventListener('click', () => this.setTheme(this.theme === 'dark' ? 'light' : 'dark'));
    $('fold').addEventListener('click', () => this.fold());
    $('help').addEventListener('click', () => $('keys').showModal());
    const toggles = {
      travels: (on) => { state.shows.travels = on; this.recolour(); },
      retractions: (on) => { this.view.retractions.points.visible = on; },
      seams: (on) => { this.view.seams.points.visible = on; },
      machine: (on) => { state.machine = on; },
    };
    for (const [id, set] of Object.entries(toggles)) {
      $(id).addEventListener('change', () => { set($(id).checked); this.sync(); });
    }
  }

  recolour() {
    this.range = this.view.recolour(MODES[this.state.mode], this.state.shows);
    this.legend();
    this.sync();
  }

  /** Time and filament by role, and the scale of the colours. */
  legend() {
    const { data, state } = this, { roles } = data.meta, mode = MODES[state.mode];
    this.sums ||= this.sumUp();
    const box = $('legend');
    box.replaceChildren();
    if (mode.of) {
      const bar = element('div', { className: 'scale' });
      bar.style.background = gradient();
      const said = (v) => mode.whole ? clock(v) : short(v);
      const [low, high] = this.range;
      const ends = element('div', { className: 'ends' });
      for (let k = 0; k < 5; k += 2) ends.append(element('span', { textContent: said(low + (high - low) * k / 4) + (mode.whole ? '' : ` ${mode.unit}`) }));
      box.append(bar, ends);
    }
    const table = element('table');
    const head = element('tr');
    const names = data.meta.density ? ['', 'time', '%', 'm', 'g'] : ['', 'time', '%', 'm', 'cm³'];
    head.append(...names.map((name) => element('th', { textContent: name })));
    table.createTHead().append(head);
    const body = table.createTBody();
    const row = (label, sum, into) => {
      const tr = element('tr');
      const amount = data.meta.density ? this.grams(sum.filament) : sum.filament * data.meta.filamentArea / 1000;
      const cells = [clock(sum.time).replace(/ (h|min)$/, ''), (100 * sum.time / Math.max(data.time, 1e-9)).toFixed(0),
        fixed(sum.filament / 1000), fixed(amount)];
      const name = element('td');
      name.append(label);
      tr.append(name, ...cells.map((text) => element('td', { textContent: text })));
      into.append(tr);
    };
    roles.forEach((role, k) => {
      if (!this.sums.roles[k].count) return;
      const label = element('label');
      const tick = element('input', { type: 'checkbox', checked: state.shows.roles[k] });
      tick.addEventListener('change', () => { state.shows.roles[k] = tick.checked; this.recolour(); });
      label.append(tick, this.swatch(`rgb(${role.colour})`, mode.of), role.label);
      row(label, this.sums.roles[k], body);
    });
    row('Travel', this.sums.travel, body);
    row('Retraction', this.sums.filamentAlone, body);
    row('All', this.sums.all, table.createTFoot());
    box.append(table);
  }

  swatch(colour, faint) {
    const box = element('span', { className: 'swatch' });
    box.style.background = colour;
    box.hidden = Boolean(faint);
    return box;
  }

  sumUp() {
    const { data } = this, none = () => ({ time: 0, filament: 0, count: 0 });
    const sums = { roles: data.meta.roles.map(none), travel: none(), filamentAlone: none(), all: none() };
    for (let k = 0; k < data.n; k += 1) {
      const kind = data.kind[k];
      const sum = kind === EXTRUSION ? sums.roles[data.role[k]] : kind === TRAVEL ? sums.travel : sums.filamentAlone;
      for (const one of [sum, sums.all]) {
        one.time += data.duration[k];
        one.filament += data.filament[k];
        one.count += 1;
      }
    }
    return sums;
  }

  findings() {
    const { findings, judged } = this.data.meta;
    const box = $('findings'), title = box.querySelector('h2'), list = box.querySelector('ol');
    if (!judged) return;
    box.hidden = false;
    title.textContent = findings.length ? `${findings.length} findings` : 'Nothing to complain of';
    for (const finding of findings) {
      const button = element('button', { textContent: `${finding.check}: ${finding.message}`, className: finding.severity });
      button.addEventListener('click', () => this.jump(finding.move));
      const item = element('li');
      item.append(button);
      list.append(item);
    }
  }

  /** Goes to a move and looks at it. */
  jump(move) {
    this.setMove(move);
    this.view.approach(this.view.stand(move, 1).place);
    this.sync();
  }

  setLayer(layer) {
    const { data, state } = this;
    state.layer = Math.min(Math.max(layer, 0), data.layers.length - 1);
    state.low = Math.min(state.low, state.layer);
    state.move = data.layers[state.layer].end - 1;
    state.share = 1;
    this.moved();
    this.sync();
  }

  setLow(low) {
    this.state.low = Math.min(Math.max(low, 0), this.state.layer);
    this.moved();
    this.sync();
  }

  setMove(move, share = 1) {
    const { data, state } = this;
    state.move = Math.min(Math.max(move, 0), data.n - 1);
    state.share = share;
    state.layer = layerAt(data, state.move);
    state.low = Math.min(state.low, state.layer);
    this.moved();
    this.sync();
  }

  play() {
    const { data, state } = this;
    state.playing = !state.playing;
    $('play').textContent = state.playing ? '❚❚' : '▶';
    $('play').setAttribute('aria-label', state.playing ? 'Stop' : 'Play');
    if (state.playing && state.move >= data.n - 1) this.setMove(0, 0);
    this.played = data.ends[state.move] - data.duration[state.move] * (1 - state.share);
    this.sync();
  }

  /** Goes on by some seconds of the clock on the wall. */
  advance(seconds) {
    const { data, state } = this;
    this.played += seconds * Number($('pace').value);
    const move = lowerBound(data.ends, this.played);
    if (move >= data.n) {
      this.setMove(data.n - 1);
      this.play();
      return;
    }
    const share = data.duration[move] > 0 ? 1 - (data.ends[move] - this.played) / data.duration[move] : 1;
    this.setMove(move, Math.min(Math.max(share, 0), 1));
  }

  fit() { this.view.fit(); this.sync(); }

  fold() {
    const isFolded = $('panel').classList.toggle('folded');
    $('fold').setAttribute('aria-expanded', String(!isFolded));
    this.resize();
  }

  setTheme(theme) {
    this.theme = theme;
    document.documentElement.dataset.theme = theme;
    const dark = theme === 'dark';
    this.view.theme(dark ? '#14181f' : '#f4f5f7', dark ? '#39424e' : '#d9dee4', dark ? '#5d6875' : '#a9b2bd');
    this.sync();
  }

  resize() {
    // Clear of the legend, or of what lies at the foot of a narrow screen.
    const isFolded = $('panel').classList.contains('folded');
    const shift = innerWidth <= 720 ? [0, isFolded ? 60 : 160] : [isFolded ? 0 : 160, 16];
    this.view.resize(innerWidth, innerHeight, Math.min(devicePixelRatio || 1, 2), shift);
    this.sync();
  }

  moved() { this.movedAt = performance.now(); this.sync(); }

  /** Brings sliders and words up to date and asks for a frame. */
  sync() {
    const { data, state } = this, layer = data.layers[state.layer], k = state.move;
    $('layer').value = state.layer;
    $('low').value = state.low;
    $('move').max = layer.end - layer.first - 1;
    $('move').value = k - layer.first;
    const height = layer.top > -Infinity ? `, z ${layer.top.toFixed(2)} mm` : '';
    $('layer-text').textContent = `${layer.layer < 0 ? 'before the layers' : `layer ${layer.layer}`} of ${data.layers[data.layers.length - 1].layer}${height}`;
    $('move-text').textContent = `line ${data.line[k]} · ${clock(data.ends[k])} · bed ${data.bed[k + 1].toFixed(1)}°`;
    this.slowly = null;
    this.request();
  }

  frame(now) {
    this.waiting = false;
    const { state, view } = this, took = now - (this.last || now);
    this.last = now;
    if (this.slowly) {
      if (this.slowly.next().done) this.slowly = null; else this.request();
      return;
    }
    if (state.playing) this.advance(Math.min(took, 200) / 1000);
    const moving = state.playing || performance.now() - this.movedAt < 160;
    const isSlow = !moving && view.pieces(state) > view.atOnce;
    view.coarsen(moving && view.pieces(state) > view.sketch.budget);
    view.show(state, moving || isSlow);
    view.draw();
    if (moving && this.wasMoving && took < 1000) view.sketch.learn(took);
    this.wasMoving = moving;
    $('notice').hidden = true;
    if (isSlow) {
      view.show(state, false);
      this.slowly = view.drawSlowly();
      this.request();
    } else if (moving && !this.waiting) {
      // Once more when all is still, with every piece.
      clearTimeout(this.still);
      this.still = setTimeout(() => { this.still = 0; this.sync(); }, 180);
    }
  }

  /** Whether every piece is drawn and nothing is about to change. */
  get isStill() { return !this.waiting && !this.slowly && !this.still && !this.state.playing; }

  request() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame((now) => this.frame(now));
  }

  keys() {
    const actions = {
      ' ': () => this.play(), f: () => this.fit(), l: () => this.fold(), '?': () => $('keys').showModal(),
      d: () => $('theme').click(), t: () => $('travels').click(), r: () => $('retractions').click(),
      s: () => $('seams').click(), m: () => $('machine').click(),
      ArrowUp: (e) => this.setLayer(this.state.layer + (e.shiftKey ? 10 : 1)),
      ArrowDown: (e) => this.setLayer(this.state.layer - (e.shiftKey ? 10 : 1)),
      ArrowRight: (e) => this.setMove(this.state.move + (e.shiftKey ? 100 : 1)),
      ArrowLeft: (e) => this.setMove(this.state.move - (e.shiftKey ? 100 : 1)),
    };
    addEventListener('keydown', (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || $('keys').open) return;
      const target = event.target;
      const isControl = target instanceof HTMLSelectElement
        || target instanceof HTMLInputElement && (target.type === 'range' || event.key === ' ')
        || target instanceof HTMLButtonElement && (event.key === ' ' || event.key === 'Enter');
      const digit = Number(event.key);
      if (isControl && !/^[a-z?]$/i.test(event.key) && !digit) return;
      if (target instanceof HTMLSelectElement) return;
      const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
      if (digit >= 1 && digit <= MODES.length) {
        $('mode').value = digit - 1;
        $('mode').dispatchEvent(new Event('change'));
      } else if (action) {
        action(event);
      } else {
        return;
      }
      event.preventDefault();
    });
  }

  pointer() {
    const canvas = $('view'), tip = $('tip');
    let asked = false;
    canvas.addEventListener('pointerleave', () => { tip.hidden = true; });
    canvas.addEventListener('pointerdown', () => { tip.hidden = true; canvas.focus({ preventScroll: true }); });
    const look = (event) => {
      asked = false;
      const place = [event.clientX, event.clientY, innerWidth, innerHeight];
      const finding = findingAt(this.view, ...place);
      const move = finding ? finding.move : moveAt(this.view, this.state, ...place);
      tip.hidden = move < 0;
      if (move < 0) return;
      tip.textContent = finding ? `${finding.check}: ${finding.message}` : this.describe(move);
      if (finding && event.type === 'click') this.jump(finding.move);
      const left = Math.min(event.clientX + 16, innerWidth - tip.offsetWidth - 8);
      const top = Math.min(event.clientY + 16, innerHeight - tip.offsetHeight - 8);
      tip.style.left = `${left}px`;
      tip.style.top = `${top}px`;
    };
    canvas.addEventListener('pointermove', (event) => {
      if (event.buttons || asked) return;
      asked = true;
      requestAnimationFrame(() => look(event));
    });
    canvas.addEventListener('click', (event) => look(event));
    canvas.addEventListener('dblclick', (event) => {
      const move = moveAt(this.view, this.state, event.clientX, event.clientY, innerWidth, innerHeight);
      if (move >= 0) this.setMove(move);
    });
  }

  describe(k) {
    const { data } = this, place = this.view.stand(k, 1).place.map((v) => v.toFixed(3));
    const role = data.kind[k] === EXTRUSION ? data.meta.roles[data.role[k]].label : KINDS[data.kind[k]];
    const text = [
      `line ${data.line[k]}, layer ${data.layerOf[k]}: ${role}`,
      `to x ${place[0]}  y ${place[1]}  z ${place[2]} mm`,
      `bed ${data.bed[k + 1].toFixed(2)}°  carriage ${data.rail[k + 1].toFixed(3)} mm`,
      `speed ${short(data.speed[k])} mm/s`,
      `bed speed ${short(data.bedSpeed[k])} °/s, carriage ${short(data.railSpeed[k])} mm/s`,
    ];
    if (data.kind[k] === EXTRUSION) {
      text.push(`flow ${short(data.flow[k])} mm³/s`);
      text.push(`width ${short(data.width[k] || data.meta.nozzle)}, thickness ${short(data.thickness[k])} mm`);
    }
    text.push(`at ${clock(data.ends[k])}`);
    return text.join('\n');
  }
}

function element(name, properties = {}) { return Object.assign(document.createElement(name), properties); }
