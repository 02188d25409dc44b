// Drawing: the body, the phase portrait, the outputs over time. Lengths are CSS pixels.

const WINDOW = 15; // s, of the trail and of the strip
const SAMPLES = 750; // in it
const FADES = 12; // shades of the trail
const NODE_SHARE = 0.014, SPRING_SHARE = 0.005, PULL_SHARE = 0.1; // of the view
const WIDEST = 1.5; // how far ranges grow with what the outputs do, in their own widths
const MARGIN = { left: 46, right: 8, top: 8, bottom: 34 };

/** The outputs of the last seconds. */
function makeTrail(timestep) {
  const every = Math.max(1, Math.round(WINDOW / SAMPLES / timestep));
  return { every, rows: [], room: Math.round(WINDOW / (every * timestep)) };
}

function remember(trail, loop) {
  if (loop.steps % trail.every) return;
  trail.rows.push({ time: loop.steps * loop.scene.timestep, values: Array.from(loop.shown) });
  if (trail.rows.length > trail.room) trail.rows.shift();
}

/** A canvas as sharp as the screen, cleared: its context and size. */
function cleared(canvas) {
  const dense = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  const wide = Math.round(width * dense), tall = Math.round(height * dense);
  if (canvas.width !== wide) canvas.width = wide;
  if (canvas.height !== tall) canvas.height = tall;
  const pen = canvas.getContext("2d");
  pen.setTransform(dense, 0, 0, dense, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.lineJoin = pen.lineCap = "round";
  return { pen, width, height };
}

/** Metres to pixels of the body's canvas: y is up. */
function viewOf(canvas, scene) {
  const [cx, cy, wide, tall] = scene.frame;
  const zoom = Math.min(canvas.clientWidth / wide, canvas.clientHeight / tall);
  const x0 = canvas.clientWidth / 2 - zoom * cx, y0 = canvas.clientHeight / 2 + zoom * cy;
  return { zoom, size: zoom * Math.max(wide, tall), toX: (x) => x0 + zoom * x, toY: (y) => y0 - zoom * y,
           fromX: (px) => (px - x0) / zoom, fromY: (py) => (y0 - py) / zoom };
}

/** Displacements (N, D) of all nodes [m]; fixed ones have none. */
function displacements(loop) {
  const { rest, free, dimensions } = loop.scene;
  const moved = rest.map(() => [0, 0, 0]);
  free.forEach((node, k) => {
    for (let d = 0; d < dimensions; d++) moved[node][d] = loop.qpos[k * dimensions + d];
  });
  return moved;
}

/** Where the nodes are drawn: displacements magnified. */
function drawnNodes(loop, view) {
  const { rest, scale } = loop.scene;
  return displacements(loop).map(([x, y], i) => [
    view.toX(rest[i][0] + scale * x), view.toY(rest[i][1] + scale * y),
  ]);
}

function drawBody(canvas, loop, chosen) {
  const { pen } = cleared(canvas);
  const { scene } = loop, view = viewOf(canvas, scene), nodes = drawnNodes(loop, view);
  pen.lineWidth = Math.max(1.5, SPRING_SHARE * view.size);
  const moved = displacements(loop);
  scene.springs.forEach(([a, b], j) => {
    pen.strokeStyle = strainColour(scene, strain(scene, moved, j));
    line(pen, [nodes[a], nodes[b]]);
  });
  if (loop.pull) drawPull(pen, loop, view, nodes);
  const radius = Math.max(3.5, NODE_SHARE * view.size), fixed = new Set(scene.rest.keys());
  scene.free.forEach((node) => fixed.delete(node));
  nodes.forEach(([x, y], i) => {
    pen.fillStyle = scene.colours.nodes[i];
    pen.beginPath();
    if (fixed.has(i)) pen.rect(x - radius, y - radius, 2 * radius, 2 * radius);
    else pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.fill();
  });
  if (chosen !== null) ring(pen, nodes[scene.free[chosen]], 1.8 * radius);
}

function strain({ rest, springs, restLengths }, moved, j) {
  const [a, b] = springs[j];
  const along = rest[a].map((_, d) => rest[a][d] + moved[a][d] - rest[b][d] - moved[b][d]);
  return Math.hypot(...along) / restLengths[j] - 1;
}

/** Red if stretched, blue if shortened; as in mcmj's films. */
function strainColour({ colours, largestStrain }, value) {
  const weight = Math.min(1, Math.abs(value) / (largestStrain || 1)) ** 0.25;
  const goal = value > 0 ? colours.stretched : colours.shortened;
  const mixed = goal.map((to, i) => Math.round((1 - weight) * colours.spring[i] + weight * to));
  return `rgb(${mixed.join(" ")})`;
}

function drawPull(pen, loop, view, nodes) {
  const { scene, pull } = loop, node = scene.free[pull.index], [x, y] = scene.rest[node];
  const end = [view.toX(x + scene.scale * pull.x), view.toY(y + scene.scale * pull.y)];
  pen.save();
  pen.strokeStyle = pen.fillStyle = "#222";
  pen.lineWidth = 2;
  pen.setLineDash([5, 5]);
  line(pen, [nodes[node], end]);
  pen.restore();
  ring(pen, nodes[node], 14);
}

function ring(pen, [x, y], radius) {
  pen.strokeStyle = "#222";
  pen.lineWidth = 2;
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.stroke();
}

function line(pen, points) {
  pen.beginPath();
  points.forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
  pen.stroke();
}

/** Axes with numbers and names over [low, high] each; returns values to pixels, and clips. */
function axes({ pen, width, height }, across, up, nameAcross, nameUp) {
  const right = width - MARGIN.right, bottom = height - MARGIN.bottom;
  const toX = scaled(across, MARGIN.left, right), toY = scaled(up, bottom, MARGIN.top);
  pen.font = "12px system-ui, sans-serif";
  pen.strokeStyle = "#ddd";
  pen.fillStyle = "#666";
  pen.lineWidth = 1;
  pen.textAlign = "center";
  for (const value of ticks(across, (right - MARGIN.left) / 55)) {
    line(pen, [[toX(value), MARGIN.top], [toX(value), bottom]]);
    pen.fillText(label(value), toX(value), bottom + 14);
  }
  pen.fillText(nameAcross, (MARGIN.left + right) / 2, height - 5);
  pen.textAlign = "right";
  for (const value of ticks(up, (bottom - MARGIN.top) / 35)) {
    line(pen, [[MARGIN.left, toY(value)], [right, toY(value)]]);
    pen.fillText(label(value), MARGIN.left - 5, toY(value) + 4);
  }
  pen.save();
  pen.translate(12, (MARGIN.top + bottom) / 2);
  pen.rotate(-Math.PI / 2);
  pen.textAlign = "center";
  pen.fillText(nameUp, 0, 0);
  pen.restore();
  pen.beginPath();
  pen.rect(MARGIN.left, MARGIN.top, right - MARGIN.left, bottom - MARGIN.top);
  pen.clip();
  return { toX, toY };
}

function scaled([low, high], start, end) {
  return (value) => start + ((value - low) / (high - low)) * (end - start);
}

/** Round numbers within [low, high], about so many. */
function ticks([low, high], most) {
  const rough = (high - low) / Math.max(2, most), power = 10 ** Math.floor(Math.log10(rough));
  const width = power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
  const first = Math.ceil(low / width), last = Math.floor(high / width);
  return Array.from({ length: last - first + 1 }, (_, i) => (first + i) * width);
}

function label(value) {
  return String(Number(value.toPrecision(4)));
}

/** [low, high] with some room around. */
function widened([low, high], share) {
  const room = share * (high - low) || 1;
  return [low - room, high + room];
}

/** The range of an output: the usual one, and what it did in the last seconds. */
function rangeOf(loop, trail, c) {
  const [low, high] = loop.readout.ranges[c], most = WIDEST * (high - low);
  const values = trail.rows.map((row) => row.values[c]);
  const lowest = Math.max(low - most, Math.min(low, ...values));
  return widened([lowest, Math.min(high + most, Math.max(high, ...values))], 0.15);
}

function drawPortrait(canvas, loop, trail, orbit) {
  const frame = cleared(canvas), { pen } = frame, { colours } = loop.scene;
  pen.save();
  const { toX, toY } = axes(frame, rangeOf(loop, trail, 0), rangeOf(loop, trail, 1), "x1", "x2");
  if (orbit) {
    pen.strokeStyle = colours.target;
    pen.lineWidth = 4;
    line(pen, [...orbit, orbit[0]].map(([x, y]) => [toX(x), toY(y)]));
  }
  const points = trail.rows.map(({ values: [x, y] }) => [toX(x), toY(y)]);
  pen.strokeStyle = pen.fillStyle = colours.outputs[0];
  pen.lineWidth = 1.6;
  for (let k = 0; k < FADES; k++) {
    const [from, to] = [k, k + 1].map((one) => Math.floor((one * points.length) / FADES));
    pen.globalAlpha = ((k + 1) / FADES) ** 2;
    line(pen, points.slice(from, to + 1));
  }
  if (points.length) {
    pen.beginPath();
    pen.arc(...points.at(-1), 4.5, 0, 2 * Math.PI);
    pen.fill();
  }
  pen.restore();
}

function drawStrip(canvas, loop, trail) {
  const frame = cleared(canvas), { pen } = frame, { colours, timestep } = loop.scene;
  const now = Math.max(WINDOW, loop.steps * timestep);
  const ranges = loop.readout.ranges.map((_, c) => rangeOf(loop, trail, c));
  const all = [Math.min(...ranges.map((r) => r[0])), Math.max(...ranges.map((r) => r[1]))];
  pen.save();
  const { toX, toY } = axes(frame, [now - WINDOW, now], all, "time [s]", "outputs");
  ranges.forEach((_, c) => {
    pen.strokeStyle = colours.outputs[c % colours.outputs.length];
    pen.lineWidth = 1.5;
    pen.setLineDash(c % 2 ? [6, 4] : []);
    line(pen, trail.rows.map(({ time, values }) => [toX(time), toY(values[c])]));
  });
  pen.restore();
}
