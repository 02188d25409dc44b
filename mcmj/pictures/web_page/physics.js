// The closed loop: MuJoCo steps the body, this feeds the outputs y = W s + b of its springs'
// lengths s back through the actuators' controls. One step is what mcmj's Simulation does.

const VIEWS = ["qpos", "qvel", "ctrl", "sensordata", "xfrc_applied"];

/** The bytes that an element of the page holds, compressed by gzip and as base64. */
async function unpacked(id) {
  const text = document.getElementById(id).textContent.trim();
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function openLoop(scene) {
  const wasmBinary = await unpacked("packed-wasm");
  const mujoco = await loadMujoco({ wasmBinary, locateFile: (name) => name });
  const model = mujoco.MjModel.from_xml_string(scene.xml);
  const loop = { scene, mujoco, model, data: new mujoco.MjData(model) };
  loop.inputs = scene.stops.map((values) => values[values.length >> 1]);
  loop.shown = new Float64Array(scene.nOutputs); // what is fed back, without its delay
  switchReadout(loop, 0);
  restart(loop);
  return loop;
}

function switchReadout(loop, index) {
  loop.readout = loop.scene.readouts[index];
  loop.weights = loop.readout.weights.map((row) => Float64Array.from(row));
}

/** Back to the start of the present readout, nothing frozen. */
function restart(loop) {
  const { scene, mujoco, model, data, readout } = loop;
  mujoco.mj_resetData(model, data);
  renewViews(loop);
  loop.qpos.set(readout.qpos);
  loop.qvel.set(readout.qvel);
  loop.steps = 0;
  loop.pull = null;
  loop.held = Array(scene.nOutputs).fill(null); // frozen outputs have a number here
  loop.waiting = Array.from({ length: scene.delay }, () => loop.held.map(() => 0));
}

/** Arrays in MuJoCo's memory, made anew when that memory has grown, which detaches them. */
function renewViews(loop) {
  if (loop.qpos?.byteLength) return;
  for (const name of VIEWS) loop[name] = loop.data[name];
}

/** One control step. RK4's stages have no mj_step1 and mj_step2: sensors first, then all of it. */
function step(loop) {
  const { scene, mujoco, model, data } = loop;
  if (loop.pull) pullNode(loop);
  if (scene.stages > 1) {
    mujoco.mj_fwdPosition(model, data);
    mujoco.mj_sensorPos(model, data);
  } else {
    mujoco.mj_step1(model, data);
  }
  feedBack(loop);
  if (scene.stages > 1) mujoco.mj_step(model, data);
  else mujoco.mj_step2(model, data);
  for (let k = 1; k < scene.substeps; k++) mujoco.mj_step(model, data);
  loop.steps += 1;
}

function feedBack(loop) {
  const { weights, readout, held, shown, ctrl, inputs } = loop;
  for (let c = 0; c < inputs.length; c++) ctrl[c] = inputs[c];
  for (let c = 0; c < shown.length; c++) {
    shown[c] = held[c] ?? readout.bias[c] + dot(weights[c], loop.sensordata);
  }
  loop.waiting.push(Array.from(shown));
  const fed = loop.waiting.shift();
  for (let c = 0; c < shown.length; c++) ctrl[inputs.length + c] = fed[c];
}

function dot(weights, signals) {
  let sum = 0;
  for (let j = 0; j < weights.length; j++) sum += weights[j] * signals[j];
  return sum;
}

/** A spring from a node to where the pointer would have it; `full` away from there is all it pulls. */
function pullNode(loop) {
  const { index, x, y, full } = loop.pull;
  const at = index * loop.scene.dimensions;
  const dx = x - loop.qpos[at], dy = y - loop.qpos[at + 1];
  const size = loop.scene.largestPull / Math.max(full, Math.hypot(dx, dy));
  setForce(loop, index, [size * dx, size * dy]);
}

/** A force on a free node [N]; body 0 is the world, the free nodes are the next ones. */
function setForce(loop, index, force) {
  loop.xfrc_applied.set(force, 6 * (index + 1));
}

function letGo(loop) {
  loop.pull = null;
  loop.xfrc_applied.fill(0);
}

/** Hold an output at its present value, or let it go again. */
function freeze(loop, output) {
  loop.held[output] = loop.held[output] === null ? loop.shown[output] : null;
}

/** Random velocities, normally distributed. */
function kick(loop) {
  for (let i = 0; i < loop.qvel.length; i++) {
    const radius = Math.sqrt(-2 * Math.log(1 - Math.random()));
    loop.qvel[i] += loop.scene.kickSpeed * radius * Math.cos(2 * Math.PI * Math.random());
  }
}

/** Whether all numbers are finite: MuJoCo goes on with those that are not. */
function alive(loop) {
  return loop.qpos.every(Number.isFinite) && loop.shown.every(Number.isFinite);
}

/** The run that Python did too: the largest difference of the outputs. */
function largestDifference(loop) {
  const { check } = loop.scene;
  switchReadout(loop, 0);
  restart(loop);
  let worst = 0;
  for (let k = 0; k < check.steps; k++) {
    if (k === 0) setForce(loop, check.index, check.force);
    if (k === check.pushed) letGo(loop);
    step(loop);
    if (k % check.every) continue;
    check.outputs[k / check.every].forEach((wanted, c) => {
      const away = Math.abs(loop.shown[c] - wanted);
      worst = away <= worst ? worst : away; // also NaN
    });
  }
  return worst;
}
