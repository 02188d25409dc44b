// The page: start, a frame at a time, or with #check the run that Python did too.

const LONGEST_FRAME = 0.1; // s: a computer that is slower than this shows slow motion
const STEPPING = 12; // ms of a frame for the physics; or half of it, if drawing is slow
const REPORT = 1000; // ms between two reports of the speed

const status = document.getElementById("status");

function say(text, wrong = false) {
  status.textContent = text;
  status.classList.toggle("wrong", wrong);
}

async function start() {
  const scene = JSON.parse(document.getElementById("scene").textContent);
  const loop = await openLoop(scene);
  const ids = ["body", "portrait", "strip"];
  const canvases = Object.fromEntries(ids.map((id) => [id, document.getElementById(id)]));
  const page = { loop, canvases, trail: makeTrail(scene.timestep), speed: 1, paused: false,
                 chosen: null, // free node that the keys pull
                 held: null, // free node that the pointer pulls
                 owed: 0, last: null, // s, and ms of the last frame
                 told: { at: 0, frames: 0, steps: 0, stepping: 0 } };
  window.mcmj = page; // for the console
  if (location.hash === "#check") return check(loop);
  addCaptions(scene);
  addControls(page);
  addLicences();
  pause(page, window.matchMedia("(prefers-reduced-motion: reduce)").matches);
  say("");
  document.addEventListener("visibilitychange", () => (page.last = null)); // hidden pages have no frames
  requestAnimationFrame((now) => frame(page, now));
}

function check(loop) {
  const difference = largestDifference(loop);
  const { steps } = loop.scene.check;
  say(`Outputs differ from mcmj's by ${difference.toPrecision(2)} at most over ${steps} steps.`);
  document.title = `check ${difference}`;
}

function addCaptions({ scale, nOutputs, dimensions, readouts, colours }) {
  const seen = dimensions === 3 ? "Seen along z. " : "";
  const fill = (id, text) => document.getElementById(`${id}-caption`).append(text);
  for (const [kind, colour] of Object.entries(colours.kinds)) {
    const mark = document.createElement("span");
    mark.textContent = kind === "fixed" ? "■" : "●";
    mark.style.color = colour;
    fill("body", mark);
    fill("body", ` ${kind} `);
  }
  fill("body", ` ${seen}Springs red when stretched, blue when shortened; displacements × ${scale}.`);
  const target = readouts.some(({ orbits }) => orbits.length) ? "Red: the target. " : "";
  fill("portrait", `${target}Black: the last ${WINDOW} s of the outputs x1 and x2.`);
  const names = ["x1 black", "x2 blue", "x3 green", "x4 orange"].slice(0, nOutputs);
  fill("strip", `The outputs over time: ${names.join(", ")}.`);
  if (nOutputs < 2) {
    document.querySelector("main").classList.add("one-output");
    document.getElementById("portrait-figure").hidden = true;
  }
}

function addLicences() {
  const details = document.querySelector("details");
  details.addEventListener("toggle", async () => {
    const texts = await unpacked("packed-licences");
    document.getElementById("licences").textContent = new TextDecoder().decode(texts);
  }, { once: true });
}

function frame(page, now) {
  const elapsed = page.last === null ? 0 : Math.min((now - page.last) / 1000, LONGEST_FRAME);
  page.last = now;
  renewViews(page.loop);
  if (!page.paused) advance(page, elapsed);
  if (!alive(page.loop)) {
    startAgain(page);
    say("The body blew up: it starts again.", true);
    page.told.at = now;
  }
  draw(page);
  report(page, now);
  requestAnimationFrame((next) => frame(page, next));
}

/** The body's time since the last frame, or as much of it as there is time for. */
function advance(page, elapsed) {
  const { loop, trail } = page, { timestep } = loop.scene;
  const begun = performance.now(), until = begun + Math.max(STEPPING, 500 * elapsed);
  page.owed += elapsed * page.speed;
  while (page.owed >= timestep && performance.now() < until) {
    step(loop);
    remember(trail, loop);
    page.owed -= timestep;
    page.told.steps += 1;
  }
  page.told.stepping += performance.now() - begun;
  page.owed = Math.min(page.owed, timestep); // what is missed is missed: slow motion
}

function draw({ loop, trail, canvases, chosen, stops }) {
  drawBody(canvases.body, loop, chosen);
  const { orbits } = loop.readout;
  const orbit = orbits[orbits.length > 1 ? stops[0] : 0];
  if (loop.scene.nOutputs > 1) drawPortrait(canvases.portrait, loop, trail, orbit);
  drawStrip(canvases.strip, loop, trail);
}

/** How fast it runs, once a second. */
function report(page, now) {
  const { told, loop } = page;
  told.frames += 1;
  const passed = now - told.at;
  if (passed < REPORT) return;
  const pace = (told.steps * loop.scene.timestep * 1000) / passed;
  const frames = Math.round((told.frames * 1000) / passed);
  const share = ((100 * told.stepping) / passed).toPrecision(2);
  if (told.at && !page.paused) {
    say(`${pace.toFixed(2)} × real time, ${frames} frames a second; physics: ${share} % of the time`);
  }
  page.told = { at: now, frames: 0, steps: 0, stepping: 0 };
}

start().catch((error) => {
  const blocked = error instanceof EvalError || /unsafe-eval/.test(String(error));
  const why = blocked ? "this host does not allow pages to run WebAssembly ('unsafe-eval')" : String(error);
  say(`MuJoCo does not start here: ${why}.`, true);
  document.title = "MuJoCo does not start here";
});
