// SPDX-License-Identifier: Apache-2.0
// Shows the model of the page: cameras to step through, and a mouse, fingers or keys that move.
"use strict";
(() => {
const model = JSON.parse(document.getElementById("model").textContent);
const element = id => document.getElementById(id);
const canvas = element("canvas"), say = text => { element("state").textContent = text; };
const number = value => value.toLocaleString("en");

// Vectors of three.
const V = {
  add: (a, b, k = 1) => [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]],
  dot: (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2],
  cross: (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]],
  scale: (a, k) => [k * a[0], k * a[1], k * a[2]],
  unit: a => V.scale(a, 1 / (Math.hypot(...a) || 1)),
  distance: (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]),
  turn: (a, axis, angle) => { // Rodrigues
    const c = Math.cos(angle), s = Math.sin(angle);
    return V.add(V.add(V.scale(a, c), V.cross(axis, a), s), axis, V.dot(axis, a) * (1 - c));
  },
};
const column = (camera, i) => camera.rotation.map(row => row[i]);

// Shows the facts of the file.
function fill() {
  element("name").textContent = model.name;
  const { count, sh_degree, fit_cameras, loss } = model.gaussians, facts = [];
  const judges = loss && (model.at !== null ? "of that camera" : `of ${loss.cameras} ${loss.cameras === 1 ? "camera" : "cameras"} that the fit did not use`);
  const grade = loss && (loss.psnr_pooled === null ? "No difference from the exact pictures"
                                                   : `${loss.psnr_pooled.toFixed(1)} dB PSNR against the exact pictures`);
  element("loss").textContent = loss ? `${grade} ${judges}` : "Loss against the exact pictures: not measured";
  facts.push(["Gaussians", number(count)]);
  facts.push(["Colours", model.at !== null ? `as camera ${model.at} sees them` : `spherical harmonics of degree ${sh_degree}, fitted over ${number(fit_cameras)} cameras`]);
  facts.push(["Bytes of the model", `${number(model.bytes)}, as SOG`]);
  if (loss)
    facts.push(["Loss", `${grade}, pooled; SSIM ${loss.ssim_mean.toFixed(3)}`],
               ["Worst picture", loss.psnr_worst === null ? "equal" : `${loss.psnr_worst.toFixed(1)} dB, camera ${loss.worst_camera}`]);
  facts.push(["Made by", `gsc ${model.version}`]);
  for (const [term, text] of facts) {
    const dt = document.createElement("dt"), dd = document.createElement("dd");
    dt.textContent = term;
    dd.textContent = text;
    element("facts").append(dt, dd);
  }
  model.cameras.forEach((camera, i) => element("camera").add(new Option(`${camera.name}  (${i + 1} of ${model.cameras.length})`, i)));
}

// Where the cameras look: the point nearest to all their axes, and how far they are from each other.
function focusOfCameras() {
  const m = [[1e-6, 0, 0], [0, 1e-6, 0], [0, 0, 1e-6]], b = [0, 0, 0];
  let low = model.cameras[0].position, high = low;
  for (const camera of model.cameras) {
    const d = column(camera, 2), p = camera.position, along = V.dot(d, p);
    for (let i = 0; i < 3; ++i) {
      for (let j = 0; j < 3; ++j)
        m[i][j] += (i === j) - d[i] * d[j];
      b[i] += p[i] - d[i] * along;
    }
    low = low.map((v, i) => Math.min(v, p[i]));
    high = high.map((v, i) => Math.max(v, p[i]));
  }
  const det = V.dot(m[0], V.cross(m[1], m[2])); // symmetric: rows are columns
  return { point: [V.dot(b, V.cross(m[1], m[2])) / det, V.dot(m[0], V.cross(b, m[2])) / det, V.dot(m[0], V.cross(m[1], b)) / det],
           size: Math.max(V.distance(low, high), 1e-3) };
}

const focus = focusOfCameras();
// of the world: against the cameras' mean downwards, or the first one's where they cancel
const mean = model.cameras.reduce((sum, camera) => V.add(sum, column(camera, 1), -1 / model.cameras.length), [0, 0, 0]);
const up = V.unit(Math.hypot(...mean) > 0.01 ? mean : V.scale(column(model.cameras[0], 1), -1));
// The eye: its place, its axes, how far away what it turns round is, and the camera whose lens it has.
const eye = { position: [0, 0, 0], right: [1, 0, 0], down: [0, 1, 0], forward: [0, 0, 1], distance: 1, camera: 0 };
let orbiting = true, dirty = true;
const look = () => { dirty = true; };

function toCamera(i) {
  const count = model.cameras.length, camera = model.cameras[(i + count) % count];
  eye.camera = (i + count) % count;
  eye.position = camera.position;
  [eye.right, eye.down, eye.forward] = [0, 1, 2].map(axis => column(camera, axis));
  const ahead = V.dot(V.add(focus.point, eye.position, -1), eye.forward);
  eye.distance = ahead > 0.05 * focus.size && ahead < 5 * focus.size ? ahead : 0.5 * focus.size;
  element("camera").value = eye.camera;
  look();
}

function turnAxes(axis, angle) {
  for (const name of ["right", "down", "forward"])
    eye[name] = V.unit(V.turn(eye[name], axis, angle));
}

// Angles to the right and down.
function turn(x, y) {
  const target = V.add(eye.position, eye.forward, eye.distance);
  const pitch = Math.asin(Math.max(-1, Math.min(1, V.dot(eye.forward, up))));
  const steep = 1.45; // radians that one may look up or down
  turnAxes(up, orbiting ? -x : x);
  const tilt = orbiting ? -y : y;
  turnAxes(eye.right, Math.max(-steep - pitch, Math.min(steep - pitch, tilt)));
  if (orbiting)
    eye.position = V.add(target, eye.forward, -eye.distance);
  look();
}

function slide(right, down, forward) {
  eye.position = V.add(V.add(V.add(eye.position, eye.right, right), eye.down, down), eye.forward, forward);
  look();
}

function closer(factor) { // of the distance that stays
  const least = 1e-3 * focus.size, next = Math.max(eye.distance * factor, least);
  slide(0, 0, orbiting ? eye.distance - next : 0.5 * eye.distance * (1 - factor));
  if (orbiting)
    eye.distance = next;
}

function choose(orbit) {
  orbiting = orbit;
  element("orbit").setAttribute("aria-pressed", orbit);
  element("fly").setAttribute("aria-pressed", !orbit);
}

function about(open) {
  element("about").hidden = !open;
  element("more").setAttribute("aria-expanded", open);
}

function listen() {
  const fingers = new Map(), held = new Set();
  const middle = () => [...fingers.values()].reduce((sum, f) => [sum[0] + f.x / fingers.size, sum[1] + f.y / fingers.size], [0, 0]);
  const spread = () => { const [a, b] = [...fingers.values()]; return b ? Math.hypot(a.x - b.x, a.y - b.y) : 0; };
  canvas.addEventListener("pointerdown", event => {
    canvas.focus();
    canvas.setPointerCapture(event.pointerId);
    canvas.classList.add("held");
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY, slides: event.button !== 0 || event.shiftKey });
  });
  canvas.addEventListener("pointermove", event => {
    const finger = fingers.get(event.pointerId);
    if (!finger)
      return;
    const before = middle(), apart = spread();
    finger.x = event.clientX;
    finger.y = event.clientY;
    const now = middle(), x = now[0] - before[0], y = now[1] - before[1];
    if (fingers.size > 1 || finger.slides) {
      const step = 2 * eye.distance * tangents().vertical / canvas.clientHeight; // what is that far away stays under the finger
      slide(-x * step, -y * step, 0);
      if (apart > 0)
        closer(apart / Math.max(spread(), 1));
    } else
      turn(4 * x / canvas.clientHeight, 4 * y / canvas.clientHeight);
  });
  const release = event => {
    fingers.delete(event.pointerId);
    if (fingers.size === 0)
      canvas.classList.remove("held");
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("contextmenu", event => event.preventDefault());
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    closer(Math.exp(Math.max(-100, Math.min(100, event.deltaY * (event.deltaMode ? 30 : 1))) * 0.0015));
  }, { passive: false });

  element("before").addEventListener("click", () => toCamera(eye.camera - 1));
  element("after").addEventListener("click", () => toCamera(eye.camera + 1));
  element("camera").addEventListener("change", event => toCamera(Number(event.target.value)));
  element("orbit").addEventListener("click", () => choose(true));
  element("fly").addEventListener("click", () => choose(false));
  element("reset").addEventListener("click", () => toCamera(eye.camera));
  element("more").addEventListener("click", () => about(element("about").hidden));

  const keys = { ",": () => toCamera(eye.camera - 1), ".": () => toCamera(eye.camera + 1), o: () => choose(true), f: () => choose(false),
                 r: () => toCamera(eye.camera), "?": () => about(element("about").hidden), escape: () => about(false) };
  addEventListener("keydown", event => {
    if (event.target.tagName === "SELECT" || event.ctrlKey || event.metaKey || event.altKey)
      return;
    const key = event.key.toLowerCase();
    keys[key]?.();
    if ("wasdqe".includes(key))
      held.add(key);
    look();
  });
  addEventListener("keyup", event => held.delete(event.key.toLowerCase()));
  addEventListener("blur", () => held.clear());
  addEventListener("resize", look);
  return (seconds, fast) => { // what the held keys do
    const step = seconds * eye.distance * 0.6 * (fast ? 4 : 1), axis = (more, less) => step * (held.has(more) - held.has(less));
    if (held.size > 0)
      slide(axis("d", "a"), axis("e", "q"), axis("w", "s"));
  };
}

// Tangents of half the angles, vertically and across: pixels have the camera's shape, and the whole of its picture is
// in sight.
function tangents() {
  const camera = model.cameras[eye.camera], x = Math.tan(camera.fov_x / 2), y = Math.tan(camera.fov_y / 2);
  const aspect = canvas.clientWidth / canvas.clientHeight * (x / camera.width) / (y / camera.height);
  const vertical = Math.max(y, x / aspect);
  return { vertical, across: vertical * aspect };
}

async function start() {
  fill();
  toCamera(model.first);
  const device = await pc.createGraphicsDevice(canvas, { deviceTypes: ["webgl2"], antialias: false, powerPreference: "high-performance" });
  if (!device.isWebGL2)
    throw new Error("this browser has no WebGL2");
  device.maxPixelRatio = Math.min(devicePixelRatio, 2);
  const app = new pc.Application(canvas, { graphicsDevice: device });
  app.setCanvasFillMode(pc.FILLMODE_NONE);
  app.setCanvasResolution(pc.RESOLUTION_AUTO);
  app.autoRender = false; // a frame is drawn when something changed
  app.start();
  const camera = new pc.Entity("camera");
  camera.addComponent("camera", { clearColor: new pc.Color(...model.background), aspectRatioMode: pc.ASPECT_MANUAL, nearClip: 2e-3 * focus.size, farClip: 1e3 * focus.size });
  app.root.addChild(camera);

  const text = atob(element("sog").textContent), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i)
    bytes[i] = text.charCodeAt(i);
  element("sog").remove();
  const asset = new pc.Asset("model", "gsplat", { url: "model.sog", filename: "model.sog", contents: bytes.buffer });
  await new Promise((resolve, reject) => {
    asset.on("load", resolve);
    asset.on("error", reject);
    app.assets.add(asset);
    app.assets.load(asset);
  });
  const world = new pc.Entity("world");
  world.addComponent("gsplat", { asset });
  app.root.addChild(world);
  say("");

  const move = listen(), matrix = new pc.Mat4(), turned = new pc.Quat();
  let fast = false;
  addEventListener("keydown", event => { fast = event.shiftKey; });
  addEventListener("keyup", event => { fast = event.shiftKey; });
  app.systems.gsplat.on("frame:request", look); // sorted anew
  app.on("update", seconds => {
    move(Math.min(seconds, 0.1), fast);
    if (!dirty)
      return;
    dirty = false;
    app.resizeCanvas();
    matrix.data.set([...eye.right, 0, ...V.scale(eye.down, -1), 0, ...V.scale(eye.forward, -1), 0, ...eye.position, 1]);
    camera.setPosition(...eye.position);
    camera.setRotation(turned.setFromMat4(matrix));
    const { vertical, across } = tangents();
    camera.camera.fov = 2 * Math.atan(vertical) * 180 / Math.PI;
    camera.camera.aspectRatio = across / vertical;
    app.renderNextFrame = true;
  });
  window.gsc = { app, eye, toCamera, look }; // for the console
}

start().catch(fault => say(`The model cannot be shown: ${fault && fault.message || fault}`));
})();
