// What a person does: pointer, keys, buttons. `page` is {loop, trail, canvases, chosen, speed, ..}.

const SPEEDS = [0.25, 0.5, 1, 2, 5, 10];
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

function addControls(page) {
  const { scene } = page.loop, bar = document.getElementById("controls");
  page.buttons = { pause: button(bar, "", () => pause(page, !page.paused)) };
  button(bar, "Start again", () => startAgain(page));
  button(bar, "Kick", () => kick(page.loop));
  page.buttons.freeze = page.loop.held.map((_, c) =>
    button(bar, `Freeze x${c + 1}`, () => toggleFreeze(page, c)));
  if (scene.readouts.length > 1) {
    select(bar, "Readout", scene.readouts.map(({ name }) => name.replaceAll("_", " ")), 0,
           (k) => switchReadout(page.loop, k));
  }
  select(bar, "Speed", SPEEDS.map((speed) => `× ${speed}`), SPEEDS.indexOf(1),
         (k) => (page.speed = SPEEDS[k]));
  page.stops = scene.stops.map((values) => values.length >> 1);
  scene.stops.forEach((values, c) => {
    const name = scene.stops.length > 1 ? `Input ${c + 1}` : "Input";
    slider(bar, name, values, (k) => { page.stops[c] = k; page.loop.inputs[c] = values[k]; });
  });
  addPointer(page);
  addKeys(page);
}

function button(bar, text, press) {
  const made = Object.assign(document.createElement("button"), { type: "button", textContent: text });
  made.addEventListener("click", press);
  return bar.appendChild(made);
}

function select(bar, name, texts, first, choose) {
  const made = document.createElement("select");
  texts.forEach((text, k) => made.add(new Option(text, k, k === first, k === first)));
  made.addEventListener("change", () => choose(Number(made.value)));
  labelled(bar, name, made);
}

function slider(bar, name, values, choose) {
  const made = Object.assign(document.createElement("input"),
    { type: "range", min: 0, max: values.length - 1, value: values.length >> 1 });
  const shown = document.createElement("output");
  const show = () => (shown.value = label(values[made.value]));
  made.addEventListener("input", () => { choose(Number(made.value)); show(); });
  labelled(bar, name, made, shown);
  show();
}

function labelled(bar, name, ...elements) {
  const made = bar.appendChild(document.createElement("label"));
  made.append(name, ...elements);
}

function pause(page, whether) {
  page.paused = whether;
  page.buttons.pause.textContent = whether ? "Go on" : "Pause";
}

function startAgain(page) {
  restart(page.loop);
  page.trail.rows = [];
  showFrozen(page);
}

function toggleFreeze(page, output) {
  freeze(page.loop, output);
  showFrozen(page);
}

function showFrozen({ loop, buttons }) {
  buttons.freeze.forEach((one, c) => one.setAttribute("aria-pressed", loop.held[c] !== null));
}

/** The nearest free node is held where the pointer went down, and follows it. */
function addPointer(page) {
  const canvas = page.canvases.body;
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button) return;
    canvas.setPointerCapture(event.pointerId);
    canvas.classList.add("pulling");
    page.chosen = null;
    const view = viewOf(canvas, page.loop.scene);
    page.held = nearestNode(page.loop, view, event.offsetX, event.offsetY);
    pullTo(page, page.held, event.offsetX, event.offsetY);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (page.held !== null) pullTo(page, page.held, event.offsetX, event.offsetY);
  });
  for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
    canvas.addEventListener(end, () => {
      canvas.classList.remove("pulling");
      if (page.held !== null) letGo(page.loop);
      page.held = null;
    });
  }
}

function nearestNode(loop, view, px, py) {
  const nodes = drawnNodes(loop, view);
  const away = loop.scene.free.map((node) => Math.hypot(nodes[node][0] - px, nodes[node][1] - py));
  return away.indexOf(Math.min(...away));
}

/** From so far away [m] the mouse pulls with all its force. */
function fullPull({ frame, scale }) {
  return (PULL_SHARE * Math.max(frame[2], frame[3])) / scale;
}

/** Pull a free node towards a pixel: displacements on the screen are `scale` times as large. */
function pullTo(page, index, px, py) {
  const { scene } = page.loop, view = viewOf(page.canvases.body, scene);
  const [x, y] = scene.rest[scene.free[index]];
  const to = { x: (view.fromX(px) - x) / scene.scale, y: (view.fromY(py) - y) / scene.scale };
  page.loop.pull = { index, full: fullPull(scene), ...to };
}

function addKeys(page) {
  const canvas = page.canvases.body, { free } = page.loop.scene;
  canvas.addEventListener("keydown", (event) => {
    if (event.key in ARROWS) {
      pullByKey(page, ARROWS[event.key]);
      event.preventDefault();
    } else if (event.key.toLowerCase() === "n") {
      page.chosen = page.chosen === null ? 0 : (page.chosen + 1) % free.length;
    }
  });
  canvas.addEventListener("keyup", (event) => event.key in ARROWS && letGo(page.loop));
  canvas.addEventListener("blur", () => { page.chosen = null; letGo(page.loop); });
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.matches("button, select, input, summary")) return; // they have keys of their own
    const output = Number(event.key) - 1;
    if (event.key === " ") pause(page, !page.paused);
    else if (event.key === "k") kick(page.loop);
    else if (event.key === "r") startAgain(page);
    else if (output >= 0 && output < page.loop.held.length) toggleFreeze(page, output);
    else return;
    event.preventDefault();
  });
}

/** With the greatest force, in one direction, from where the node is. */
function pullByKey(page, [right, up]) {
  const { loop } = page, full = fullPull(loop.scene);
  page.chosen ??= 0;
  const at = page.chosen * loop.scene.dimensions;
  loop.pull = { index: page.chosen, full, x: loop.qpos[at] + full * right, y: loop.qpos[at + 1] + full * up };
}
