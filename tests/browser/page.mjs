// The page that `rhumb preview` writes, opened in a browser without a screen, from a file, and used as
// people use it: node page.mjs RHUMB MODELS FOLDER [--big]
//
// FOLDER gets programs, pages and pictures of them. Any failed expectation ends with status 1.

import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { createHash } from 'node:crypto';
import { existsSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import puppeteer from 'puppeteer-core';

const [rhumb, models, folder] = process.argv.slice(2, 5).map((path) => resolve(path));
const isBig = process.argv.includes('--big');
mkdirSync(folder, { recursive: true });

/** Runs rhumb; findings (status 1) are no failure. */
function run(...words) {
  try {
    return execFileSync(rhumb, words, { encoding: 'utf8', maxBuffer: 1 << 28 });
  } catch (error) {
    if (error.status === 1) return error.stdout;
    throw error;
  }
}

/** Slices a model and returns the paths of program and page. */
function sliced(name, model, ...words) {
  const program = join(folder, `${name}.gcode`);
  run('slice', join(models, `${model}.stl`), '-q', '-o', program, ...words);
  return page(name, program);
}

function page(name, program) {
  const html = join(folder, `${name}.html`);
  run('preview', program, '-o', html);
  return { name, program, html };
}

/** A square tower as Cura writes it, with an arc, in the corner of a Cartesian bed. */
function foreign() {
  const lines = [';FLAVOR:Marlin', 'G28', 'G90', 'M82', 'M104 S200', 'G92 E0'];
  let e = 0;
  for (let layer = 0; layer < 12; layer += 1) {
    lines.push(`;LAYER:${layer}`, ';TYPE:WALL-OUTER', `G0 F9000 X100 Y100 Z${(0.3 + 0.2 * layer).toFixed(2)}`);
    for (const [x, y] of [[130, 100], [130, 130], [100, 130], [100, 100]]) {
      lines.push(`G1 F1800 X${x} Y${y} E${(e += 1.1).toFixed(5)}`);
    }
    lines.push(';TYPE:FILL', 'G0 X105 Y115', `G2 X125 Y115 I10 J0 E${(e += 1.2).toFixed(5)}`);
  }
  const program = join(folder, 'foreign.gcode');
  writeFileSync(program, `${lines.join('\n')}\n`);
  return page('foreign', program);
}

const browserPath = ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome']
  .find((path) => existsSync(path));
assert(browserPath, 'no Chromium found');
const browser = await puppeteer.launch({
  executablePath: browserPath,
  args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
});

/** Opens a page that must not complain and must not ask for anything but itself. */
async function open(html, width = 1280, height = 800) {
  const tab = await browser.newPage();
  const complaints = [];
  tab.on('console', (message) => {
    if (['error', 'warn', 'warning'].includes(message.type())) complaints.push(message.text());
  });
  tab.on('pageerror', (error) => complaints.push(error.message));
  const url = pathToFileURL(html).href;
  tab.on('request', (request) => {
    if (request.url() !== url && !request.url().startsWith('data:')) complaints.push(`asks for ${request.url()}`);
  });
  await tab.setViewport({ width, height });
  const began = performance.now();
  await tab.goto(url);
  await tab.waitForFunction("window.rhumb && document.getElementById('notice').hidden", { timeout: 60000 });
  const took = performance.now() - began;
  return { tab, complaints, took };
}

/** Waits until every piece is drawn. */
const still = async (tab) => {
  await new Promise((done) => setTimeout(done, 50));
  await tab.waitForFunction('rhumb.page.isStill', { timeout: 60000 });
  // One frame more, for what was drawn to be on the screen.
  await tab.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
};

/** The picture, without what lies over it. */
async function look(tab) {
  await still(tab);
  const picture = await tab.screenshot({ clip: { x: 60, y: 80, width: 600, height: 560 } });
  return createHash('sha256').update(picture).digest('hex');
}

const slide = (tab, id, value) => tab.$eval(`#${id}`, (input, to) => {
  input.value = to;
  input.dispatchEvent(new Event('input'));
}, value);

const drawn = (tab) => tab.evaluate('rhumb.page.view.drawn.pieces');

async function used({ name, program, html }, expectMoves) {
  const { tab, complaints, took } = await open(html);
  await still(tab);
  await tab.screenshot({ path: join(folder, `${name}.png`) });

  // Every move of the text, and every piece of it drawn.
  const { n, pieces, layers } = await tab.evaluate('({ n: rhumb.data.n, pieces: rhumb.data.pieces, layers: rhumb.data.layers.length })');
  assert.equal(n, expectMoves, `${name}: moves`);
  assert(pieces >= n * 0.9, `${name}: ${pieces} pieces of ${n} moves`);
  assert.equal(await drawn(tab), pieces, `${name}: all is drawn`);

  // The layer slider cuts at a layer, the lower one from below, the move slider within.
  const whole = await look(tab);
  const middle = layers >> 1;
  await slide(tab, 'layer', middle);
  const half = await look(tab);
  assert.notEqual(half, whole);
  const upTo = await tab.evaluate((k) => rhumb.data.firstPiece[rhumb.data.layers[k].end], middle);
  assert.equal(await drawn(tab), upTo, `${name}: up to layer ${middle}`);
  await slide(tab, 'low', middle);
  await still(tab);
  const from = await tab.evaluate((k) => rhumb.data.firstPiece[rhumb.data.layers[k].first], middle);
  assert.equal(await drawn(tab), upTo - from, `${name}: one layer`);
  const most = await tab.$eval('#move', (input) => Number(input.max));
  await slide(tab, 'move', most >> 1);
  await still(tab);
  assert((await drawn(tab)) < upTo - from, `${name}: half a layer`);
  await slide(tab, 'low', 0);
  await slide(tab, 'layer', layers - 1);
  assert.equal(await look(tab), whole, `${name}: back to the whole print`);

  // Every way to colour has its own picture and, but for roles, a scale.
  const modes = await tab.$$eval('#mode option', (options) => options.map((option) => option.value));
  const pictures = new Set();
  for (const mode of modes) {
    await tab.select('#mode', mode);
    pictures.add(await look(tab));
    assert.equal(await tab.$$eval('.scale', (scales) => scales.length), mode === '0' ? 0 : 1);
  }
  assert(pictures.size >= modes.length - 2, `${name}: ${pictures.size} pictures of ${modes.length} colourings`);
  await tab.select('#mode', '0');

  // The legend adds up.
  const rows = await tab.$$eval('#legend tr', (all) => all.map((row) => [...row.children].map((cell) => cell.textContent)));
  const shares = rows.slice(1, -1).map((row) => Number(row[2]));
  assert(Math.abs(shares.reduce((a, b) => a + b) - 100) <= shares.length / 2 + 0.5, `${name}: shares of ${shares}`);
  const metres = rows.slice(1, -1).reduce((sum, row) => sum + Number(row[3]), 0);
  assert(Math.abs(metres - Number(rows.at(-1)[3])) < 0.05, `${name}: ${metres} m`);
  await tab.click('#legend input');
  assert.notEqual(await look(tab), whole, `${name}: a role can be hidden`);
  await tab.click('#legend input');

  // Keys: travels, seams, retractions, machine view, layers, play.
  await tab.focus('#view');
  for (const key of ['t', 's', 'm']) {
    await tab.keyboard.press(key);
    assert.notEqual(await look(tab), whole, `${name}: ${key} shows something`);
    await tab.keyboard.press(key);
    assert.equal(await look(tab), whole, `${name}: ${key} hides it again`);
  }
  await tab.keyboard.press('ArrowDown');
  assert.equal(await tab.$eval('#layer', (input) => Number(input.value)), layers - 2);
  await tab.keyboard.press('m');
  const angle = await tab.evaluate('rhumb.page.setMove(rhumb.data.n >> 1), rhumb.page.view.show(rhumb.page.state, false), rhumb.page.view.turning.rotation.z');
  assert(Math.abs(angle) > 1e-3, `${name}: the bed is turned by ${angle}`);
  const onRail = await tab.evaluate('rhumb.page.view.nozzle.position.toArray()');
  assert(Math.abs(onRail[1]) < 0.05, `${name}: the nozzle is at ${onRail}`);
  const before = await tab.evaluate('rhumb.page.state.move');
  await tab.keyboard.press(' ');
  await tab.waitForFunction((move) => rhumb.page.state.move > move + 3, { timeout: 20000 }, before);
  await tab.keyboard.press(' ');
  assert.equal(await tab.evaluate('rhumb.page.state.playing'), false);
  await tab.keyboard.press('m');

  // The pointer finds the move under it, and its line in the program.
  await tab.keyboard.press('f');
  await slide(tab, 'layer', layers - 1);
  await still(tab);
  let tip = '';
  for (let y = 620; y > 100 && !tip; y -= 12) {
    await tab.mouse.move(560, y);
    await new Promise((done) => setTimeout(done, 60));
    tip = await tab.$eval('#tip', (box) => (box.hidden ? '' : box.textContent));
  }
  const line = Number(/^line (\d+),/.exec(tip)?.[1]);
  const text = readFileSync(program, 'utf8').split('\n')[line - 1];
  assert.match(text, /^G[0-3]/, `${name}: line ${line} of the tip`);
  assert.match(tip, /speed [\d.]+ mm\/s/);
  await tab.mouse.move(5, 795);

  // Dark and light.
  await tab.keyboard.press('d');
  assert.notEqual(await look(tab), whole);
  await tab.screenshot({ path: join(folder, `${name}-dark.png`) });
  assert.deepEqual(complaints, [], `${name}: complaints`);
  await tab.close();

  // On a telephone nothing sticks out, and the legend is a touch away.
  const phone = await open(html, 390, 780);
  await still(phone.tab);
  const width = await phone.tab.evaluate('document.documentElement.scrollWidth');
  assert(width <= 390, `${name}: ${width} pixels wide`);
  await phone.tab.click('#fold');
  assert(await phone.tab.$eval('#panel', (panel) => panel.getBoundingClientRect().right <= 390 && panel.offsetHeight > 50));
  await phone.tab.screenshot({ path: join(folder, `${name}-phone.png`) });
  assert.deepEqual(phone.complaints, []);
  await phone.tab.close();
  console.log(`${name}: ${n} moves, ${layers} layers, open after ${Math.round(took)} ms`);
}

const movesOf = ({ program }) => JSON.parse(run('verify', '--proof', 'quick', '--json', program)).moves;

const coarse = ['--set', 'layer_height_mm=0.3', '--set', 'first_layer_height_mm=0.3', '--set', 'fill_density=10'];
const planar = sliced('planar', 'cross', ...coarse);
const conical = sliced('conical', 'dome', '--layers', 'conical', '--cone-angle', '25', ...coarse);
const spherical = sliced('spherical', 'dome', '--layers', 'spherical', ...coarse);
for (const one of [planar, conical, spherical]) await used(one, movesOf(one));
// Twelve layers of a way there, four sides, another way, and an arc of many pieces.
const tower = foreign();
{
  const { tab } = await open(tower.html);
  const moves = await tab.evaluate('rhumb.data.n');
  assert(moves > 12 * 6 + 12 * 20, `${moves}: arcs are drawn as arcs`);
  const kinds = await tab.evaluate('[...new Set([...rhumb.data.role].map((k) => rhumb.data.meta.roles[k].label))].sort()');
  assert(kinds.includes('External perimeter') && kinds.includes('Internal infill'), `${kinds}`);
  await tab.close();
  await used(tower, moves);
}

// A finding is a mark that leads to its place.
{
  const lines = readFileSync(planar.program, 'utf8').split('\n');
  const at = lines.findIndex((text, k) => k > lines.length / 2 && text.startsWith('G1 R'));
  lines[at] = 'G1 R500 T0 E1';
  const program = join(folder, 'damaged.gcode');
  writeFileSync(program, lines.join('\n'));
  const { tab, complaints } = await open(page('damaged', program).html);
  const count = await tab.$$eval('#findings button', (buttons) => buttons.length);
  assert(count > 0, 'findings are listed');
  await tab.$$eval('#findings button', (buttons) => buttons.find((button) => button.textContent.startsWith('reach')).click());
  const line = await tab.evaluate('rhumb.data.line[rhumb.page.state.move]');
  assert.equal(line, at + 1, 'the mark leads to the line');
  // So does the mark in the picture.
  await tab.evaluate('rhumb.page.setLayer(rhumb.data.layers.length - 1), rhumb.page.fit()');
  await still(tab);
  const [x, y] = await tab.evaluate(() => {
    const { view, data } = { view: rhumb.page.view, data: rhumb.data };
    const k = data.meta.findings.findIndex((finding) => finding.check === 'reach');
    const place = new THREE.Vector3(...view.stand(data.meta.findings[k].move, 0).place).applyMatrix4(view.part.matrixWorld).project(view.camera);
    return [(place.x + 1) / 2 * innerWidth, (1 - place.y) / 2 * innerHeight];
  });
  await tab.mouse.click(x, y);
  const reached = await tab.evaluate('rhumb.data.line[rhumb.page.state.move]');
  assert(Math.abs(reached - (at + 1)) <= 1, `the mark in the picture leads to line ${reached}, not ${at + 1}`);
  assert.deepEqual(complaints, []);
  await tab.close();
}

// A million moves: how long to open, how many frames a second while it turns.
if (isBig) {
  const big = sliced('big', 'gear', '--scale', '2.6', '--set', 'perimeters=3', '--no-verify');
  const { tab, took } = await open(big.html, 1280, 720);
  await still(tab);
  const measured = await tab.evaluate(async () => {
    const { view } = rhumb.page, { camera, controls } = view, frames = [];
    let angle = 0, last = performance.now();
    const end = last + 6000, away = Math.hypot(camera.position.x, camera.position.y);
    while (last < end) {
      await new Promise(requestAnimationFrame);
      angle += 0.02;
      camera.position.set(away * Math.cos(angle), away * Math.sin(angle), camera.position.z);
      controls.update();
      frames.push(performance.now() - last);
      last = performance.now();
    }
    const late = frames.slice(frames.length >> 1);
    return { moves: rhumb.data.n, fps: 1000 * late.length / late.reduce((a, b) => a + b), by: view.drawer.name };
  });
  console.log(`big: ${measured.moves} moves, open after ${Math.round(took)} ms, ${measured.fps.toFixed(1)} frames/s (${measured.by})`);
  await tab.close();
}
await browser.close();
console.log('the page works');
